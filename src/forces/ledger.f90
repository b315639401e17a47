!> The books of a run: where energy and momentum come from and go to.
!>
!> Work is the sum over steps of power times step (trapezoids between the ends of steps): of the elastic
!> normal forces, of damping and of friction (all contacts; usually negative), and of moving walls. Powers are those of
!> the final velocities of a step: with the predicted ones each jump of a force would leave a residual, whereas force
!> times final velocity is what velocity Verlet exactly adds to the kinetic energy from the middle of a step to
!> that of the next. With the potential of gravity, kinetic + potential - work stays constant up to the error of
!> integration. The area law has no potential energy, so its elastic work does not return to zero when contacts open.
!> That of the conservative law is no sum over steps but the energy that the contacts had at the start, less what they
!> have now.
!>
!> Impulses of gravity and of the fixed bodies are summed likewise. For velocity Verlet these sums equal the
!> change of momentum and angular momentum exactly, so that their residuals are rounding errors, if
!> and only if the forces of every contact are opposite and act at one point.
!>
!> Every free body has its own books (see `polydem_body_rates`), kept by the process that moves it. They are sums of
!> rates over steps, in which the first counts half; the other half of the last is taken off when a balance is drawn.
!> Totals over bodies are exact sums, rounded once, then multiplied by the step: they have the same bits for any number
!> of threads and processes.
!>
!> The scale of impulses, on which the residuals are measured, is the sum over contacts with fixed bodies, and over
!> bodies for gravity: forces that cancel within a fixed body count.
module polydem_ledger
   use polydem_archive, only: archive_t
   use polydem_assemble, only: incidence_t
   use polydem_bodies, only: bodies_t
   use polydem_body_rates, only: add_rates, elastic_energy_of, motion_of, n_books, n_motions, n_wall_books
   use polydem_contacts, only: contacts_t
   use polydem_exact_sum, only: exact_sum_t
   use polydem_kinds, only: ip, lp, wp, worth_threads
   use polydem_team, only: team_t
   use polydem_team_sums, only: add_up_sums
   implicit none
   private
   public :: ledger_t, balance_t, open_ledger, book_step, balance_of, keep_ledger, keep_books

   !> Books that are open
   type :: ledger_t
      !> Greatest energy turned over so far, the scale of the residual [J/m]
      real(wp) :: energy_scale = 0.0_wp
      !> Whether bodies and contacts are those of the last step that was booked: so after `book_step`. To be made false
      !> when a step begins; then the last rates count in full, as they do in the middle of a step
      logical :: is_current = .false.
      !> Sums of powers of forces on each body, (n_books, slot); not allocated if there is no ledger [W/m]
      real(wp), allocatable :: book(:, :)
      !> Sums of the torques of gravity on each body about the origin, (slot) [N]
      real(wp), allocatable :: torque(:)
      !> Sums of rates of what fixed bodies do to each body, (n_wall_books, slot)
      real(wp), allocatable :: wall_book(:, :)
      !> Steps booked
      integer(lp), private :: steps = 0_lp
      !> Energy, momentum and angular momentum at the start
      real(wp), private :: start(4) = 0.0_wp
      !> Elastic energy of the contacts at the start, if they have one [J/m]
      real(wp), private :: elastic_start = 0.0_wp
   end type ledger_t

   !> The state of the books at one time
   type :: balance_t
      !> Kinetic energy of the free bodies [J/m]
      real(wp) :: kinetic = 0.0_wp
      !> Potential of gravity of the free bodies, zero at the origin [J/m]
      real(wp) :: potential = 0.0_wp
      !> Momentum of the free bodies, (2) [kg/s]
      real(wp) :: momentum(2) = 0.0_wp
      !> Their angular momentum about the origin [kg m/s]
      real(wp) :: angular_momentum = 0.0_wp
      !> Work of the elastic normal forces on both bodies [J/m]
      real(wp) :: elastic_work = 0.0_wp
      !> Work of the normal damping and of that of tilts [J/m]
      real(wp) :: damping_work = 0.0_wp
      !> Work of the tangential forces [J/m]
      real(wp) :: friction_work = 0.0_wp
      !> Work done by moving walls [J/m]
      real(wp) :: wall_work = 0.0_wp
      !> Impulse of gravity and fixed bodies, (2) [N s/m]
      real(wp) :: impulse(2) = 0.0_wp
      !> Angular impulse of gravity and fixed bodies about the origin [N s]
      real(wp) :: angular_impulse = 0.0_wp
      !> Energy that the books cannot explain [J/m]
      real(wp) :: energy_residual = 0.0_wp
      !> The same over the energy turned over: the greatest kinetic energy or work done, but at least a billionth of
      !> the potential, below which there is nothing but rounding
      real(wp) :: relative_energy_residual = 0.0_wp
      !> Momentum that the books cannot explain, over the absolute momentum at the start with the sum of the absolute
      !> impulses of gravity and of all contacts with fixed bodies
      real(wp) :: relative_momentum_residual = 0.0_wp
      !> Angular momentum that the books cannot explain, over that at the start with the absolute angular impulses of
      !> gravity on each body and of all contacts with fixed bodies
      real(wp) :: relative_angular_residual = 0.0_wp
   end type balance_t

   !> Least energy turned over, as a share of the potential
   real(wp), parameter :: least_share = 1.0e-9_wp
   !> Bodies that are worth a sum of their own, and the greatest number of such sums
   integer(ip), parameter :: block = 1024_ip, most_blocks = 32_ip

   !> Places among the totals: kinetic energy, potential and momenta; mass times steps; torque of gravity and its
   !> absolute value; elastic energy; bodies whose last rates are unknown; behind them books, and books of fixed bodies
   integer, parameter :: at_mass = n_motions + 1, at_torque = at_mass + 1, at_energy = at_torque + 2, &
      at_unknown = at_energy + 1, at_books = at_unknown, at_walls = at_books + n_books, &
      n_totals = at_walls + n_wall_books

contains

   !> Start the books with the bodies and forces of step 0; collective.
   subroutine open_ledger(ledger, team, gravity, bodies, incidence, contacts)
      !> Books
      type(ledger_t), intent(out) :: ledger
      !> Processes that share the bodies
      class(team_t), intent(inout) :: team
      !> Acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      !> Bodies with their forces
      type(bodies_t), intent(in) :: bodies
      !> Index of the contacts
      type(incidence_t), intent(in) :: incidence
      !> Contacts with their forces
      type(contacts_t), intent(in) :: contacts
      real(wp) :: total(n_totals)

      call allocate_books(ledger, bodies%n)
      call add_to_books(ledger, 0.5_wp, gravity, bodies, incidence, contacts)
      ledger%is_current = .true.
      total = totals(ledger, team, gravity, bodies, incidence, contacts)
      ledger%energy_scale = total(1)
      ledger%start = [total(1) + total(2), total(3:5)]
      ledger%elastic_start = total(at_energy)
   end subroutine open_ledger

   !> Book one step; call it when the step is done.
   subroutine book_step(ledger, gravity, bodies, incidence, contacts)
      !> Books
      type(ledger_t), intent(inout) :: ledger
      !> Acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      !> Bodies at the end of this step
      type(bodies_t), intent(in) :: bodies
      !> Index of the contacts
      type(incidence_t), intent(in) :: incidence
      !> Contacts with the forces of this step
      type(contacts_t), intent(in) :: contacts

      call add_to_books(ledger, 1.0_wp, gravity, bodies, incidence, contacts)
      ledger%steps = ledger%steps + 1_lp
      ledger%is_current = .true.
   end subroutine book_step

   !> Compare the bodies with the books; collective.
   subroutine balance_of(ledger, team, dt, gravity, bodies, incidence, contacts, balance)
      !> Books
      type(ledger_t), intent(inout) :: ledger
      !> Processes that share the bodies
      class(team_t), intent(inout) :: team
      !> Step, the same in all steps [s]
      real(wp), intent(in) :: dt
      !> Acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      !> Bodies at the end of a step
      type(bodies_t), intent(in) :: bodies
      !> Index of the contacts
      type(incidence_t), intent(in) :: incidence
      !> Contacts with the forces of this step
      type(contacts_t), intent(in) :: contacts
      !> Energy, momentum, and what is unexplained
      type(balance_t), intent(out) :: balance
      real(wp) :: total(n_totals)

      total = totals(ledger, team, gravity, bodies, incidence, contacts)
      balance%kinetic = total(1)
      balance%potential = total(2)
      balance%momentum = total(3:4)
      balance%angular_momentum = total(5)
      associate (books => dt*total(at_books + 1:at_walls), walls => dt*total(at_walls + 1:), &
                 mass_time => dt*total(at_mass), torques => dt*total(at_torque:at_torque + 1))
         balance%elastic_work = books(1)
         if (contacts%energy_is_quadratic .and. .not. total(at_unknown) > 0.0_wp) &
            balance%elastic_work = ledger%elastic_start - total(at_energy)
         balance%damping_work = books(2)
         balance%friction_work = books(3)
         balance%wall_work = walls(1)
         balance%impulse = walls(2:3) + mass_time*gravity
         balance%angular_impulse = walls(4) + torques(1)
         call find_residuals(ledger, walls(5) + mass_time*(abs(gravity(1)) + abs(gravity(2))), walls(6) + torques(2), &
                             balance)
      end associate
   end subroutine balance_of

   !> Keep in an archive what belongs to the whole run.
   subroutine keep_ledger(ledger, archive)
      !> Books
      type(ledger_t), intent(inout) :: ledger
      !> Archive
      class(archive_t), intent(inout) :: archive

      call archive%keep('/run/ledger_start', ledger%start, 'J/m, N s/m, N s', &
                        'energy, momentum and angular momentum at the start')
      call archive%keep('/run/ledger_steps', ledger%steps, '1', 'steps booked')
      call archive%keep('/run/elastic_start', ledger%elastic_start, 'J/m', 'elastic energy at the start')
      call archive%keep('/run/energy_scale', ledger%energy_scale, 'J/m', 'greatest energy turned over')
   end subroutine keep_ledger

   !> Keep the books of bodies in an archive; if it gives back, those of others than before.
   subroutine keep_books(ledger, n_bodies, archive)
      !> Books
      type(ledger_t), intent(inout) :: ledger
      !> Number of bodies
      integer(ip), intent(in) :: n_bodies
      !> Archive
      class(archive_t), intent(inout) :: archive

      if (archive%gives_back) ledger%is_current = .false.
      if (archive%gives_back .or. .not. allocated(ledger%book)) call allocate_books(ledger, n_bodies)
      call archive%keep('/bodies/book', ledger%book, 'W/m', 'sums over steps of the powers of elastic, damping and '// &
                        'tangential forces')
      call archive%keep('/bodies/torque_book', ledger%torque, 'N', 'sum over steps of the torque of gravity')
      call archive%keep('/bodies/wall_book', ledger%wall_book, 'W/m, N/m, N/m, N, N/m, N', &
                        'sums over steps of what fixed bodies do: power, force, torque, absolute forces and torques')
   end subroutine keep_books

   !> Make room for the books of bodies, which are empty.
   subroutine allocate_books(ledger, n)
      type(ledger_t), intent(inout) :: ledger
      !> Number of bodies
      integer(ip), intent(in) :: n

      if (allocated(ledger%book)) deallocate (ledger%book, ledger%torque, ledger%wall_book)
      allocate (ledger%book(n_books, n), ledger%torque(n), ledger%wall_book(n_wall_books, n))
      ledger%book = 0.0_wp
      ledger%torque = 0.0_wp
      ledger%wall_book = 0.0_wp
   end subroutine allocate_books

   !> What is unexplained.
   subroutine find_residuals(ledger, impulse_scale, angular_scale, balance)
      type(ledger_t), intent(inout) :: ledger
      !> Absolute impulses [N s/m] and angular impulses [N s] from outside
      real(wp), intent(in) :: impulse_scale, angular_scale
      type(balance_t), intent(inout) :: balance
      real(wp) :: missing(2), missing_angular, work

      associate (b => balance, start => ledger%start)
         ledger%energy_scale = max(ledger%energy_scale, b%kinetic, abs(b%elastic_work), abs(b%damping_work), &
                                   abs(b%friction_work), abs(b%wall_work), least_share*abs(b%potential))
         work = b%elastic_work + b%damping_work + b%friction_work + b%wall_work
         b%energy_residual = b%kinetic + b%potential - start(1) - work
         missing = b%momentum - start(2:3) - b%impulse
         missing_angular = b%angular_momentum - start(4) - b%angular_impulse
         b%relative_energy_residual = share(b%energy_residual, ledger%energy_scale)
         b%relative_momentum_residual = share(abs(missing(1)) + abs(missing(2)), &
                                              abs(start(2)) + abs(start(3)) + impulse_scale)
         b%relative_angular_residual = share(missing_angular, abs(start(4)) + angular_scale)
      end associate
   end subroutine find_residuals

   pure real(wp) function share(part, whole)
      real(wp), intent(in) :: part, whole

      share = 0.0_wp
      if (whole > 0.0_wp) share = abs(part)/whole
   end function share

   !> Add a multiple of the rates of this moment to the books of all bodies of this process.
   subroutine add_to_books(ledger, weight, gravity, bodies, incidence, contacts)
      type(ledger_t), intent(inout) :: ledger
      real(wp), intent(in) :: weight, gravity(2)
      type(bodies_t), intent(in) :: bodies
      type(incidence_t), intent(in) :: incidence
      type(contacts_t), intent(in) :: contacts
      integer(ip) :: b, n, n_blocks

      n = size(bodies%free, kind=ip)
      n_blocks = max(1_ip, n/worth_threads)
      !$omp parallel do if (n_blocks > 1_ip) schedule(static) default(none) &
      !$omp    shared(ledger, weight, gravity, bodies, incidence, contacts, n, n_blocks) private(b)
      do b = 1_ip, n_blocks
         call add_to_some(ledger, weight, gravity, bodies, incidence, contacts, &
                          bodies%free(end_of(b - 1_ip, n_blocks, n) + 1_ip:end_of(b, n_blocks, n)))
      end do
      !$omp end parallel do
   end subroutine add_to_books

   !> Add to the books of some bodies; a procedure of its own, so that its loops are compiled knowing that nothing
   !> overlaps.
   pure subroutine add_to_some(ledger, weight, gravity, bodies, incidence, contacts, slots)
      type(ledger_t), intent(inout) :: ledger
      real(wp), intent(in) :: weight, gravity(2)
      type(bodies_t), intent(in) :: bodies
      type(incidence_t), intent(in) :: incidence
      type(contacts_t), intent(in) :: contacts
      integer(ip), intent(in), contiguous :: slots(:)
      integer(ip) :: k, s

      do k = 1_ip, size(slots, kind=ip)
         s = slots(k)
         ledger%torque(s) = ledger%torque(s) + weight*torque_of(gravity, bodies, s)
      end do
      do k = 1_ip, size(slots, kind=ip)
         s = slots(k)
         if (has_contacts(incidence, s)) &
            call add_rates(bodies, incidence, contacts, s, weight, ledger%book(:, s), ledger%wall_book(:, s))
      end do
   end subroutine add_to_some

   !> Whether a body has contacts, without which there are no powers
   pure logical function has_contacts(incidence, s)
      type(incidence_t), intent(in) :: incidence
      integer(ip), intent(in) :: s

      has_contacts = incidence%start_first(s + 1_ip) > incidence%start_first(s) &
         .or. incidence%start_second(s + 1_ip) > incidence%start_second(s)
   end function has_contacts

   !> Totals over all bodies of the team
   function totals(ledger, team, gravity, bodies, incidence, contacts) result(total)
      type(ledger_t), intent(in) :: ledger
      class(team_t), intent(inout) :: team
      real(wp), intent(in) :: gravity(2)
      type(bodies_t), intent(in) :: bodies
      type(incidence_t), intent(in) :: incidence
      type(contacts_t), intent(in) :: contacts
      real(wp) :: total(n_totals)
      type(exact_sum_t), allocatable :: sums(:, :)
      integer(ip) :: b, n, n_blocks
      integer :: i

      n = size(bodies%free, kind=ip)
      n_blocks = max(1_ip, min(n/block, most_blocks))
      allocate (sums(n_totals, n_blocks))
      !$omp parallel do if (n_blocks > 1_ip) schedule(static) default(none) &
      !$omp    shared(n, n_blocks, sums, ledger, gravity, bodies, incidence, contacts) private(b)
      do b = 1_ip, n_blocks
         call add_block(ledger, gravity, bodies, incidence, contacts, &
                        end_of(b - 1_ip, n_blocks, n) + 1_ip, end_of(b, n_blocks, n), sums(:, b))
      end do
      !$omp end parallel do
      do b = 2_ip, n_blocks
         do i = 1, n_totals
            call sums(i, 1)%add(sums(i, b))
         end do
      end do
      call add_up_sums(team, sums(:, 1))
      total = sums(:, 1)%value()
   end function totals

   !> Last place of the b-th of n_blocks blocks of n places
   pure integer(ip) function end_of(b, n_blocks, n)
      integer(ip), intent(in) :: b, n_blocks, n

      end_of = int(int(n, lp)*int(b, lp)/int(n_blocks, lp), ip)
   end function end_of

   !> Add some of the free bodies to sums.
   subroutine add_block(ledger, gravity, bodies, incidence, contacts, low, high, sums)
      type(ledger_t), intent(in) :: ledger
      real(wp), intent(in) :: gravity(2)
      type(bodies_t), intent(in) :: bodies
      type(incidence_t), intent(in) :: incidence
      type(contacts_t), intent(in) :: contacts
      !> First and last place in `bodies%free`
      integer(ip), intent(in) :: low, high
      type(exact_sum_t), intent(inout) :: sums(n_totals)
      real(wp) :: row(n_totals)
      integer(ip) :: k, s
      integer :: i

      do k = low, high
         s = bodies%free(k)
         row = 0.0_wp
         row(:n_motions) = motion_of(gravity, bodies, s)
         row(at_mass) = bodies%mass(s)*real(ledger%steps, wp)
         row(at_torque) = ledger%torque(s)
         row(at_books + 1:at_walls) = ledger%book(:, s)
         row(at_walls + 1:) = ledger%wall_book(:, s)
         if (ledger%is_current) then
            row(at_torque) = row(at_torque) - 0.5_wp*torque_of(gravity, bodies, s)
            call add_rates(bodies, incidence, contacts, s, -0.5_wp, row(at_books + 1:at_walls), row(at_walls + 1:))
            if (contacts%energy_is_quadratic) row(at_energy) = elastic_energy_of(bodies, incidence, contacts, s)
         else
            row(at_mass) = row(at_mass) + 0.5_wp*bodies%mass(s)
            row(at_unknown) = 1.0_wp
         end if
         row(at_torque + 1) = abs(row(at_torque))
         do i = 1, n_totals
            call sums(i)%add(row(i))
         end do
      end do
   end subroutine add_block

   !> Torque of gravity on a free body about the origin [N]
   pure real(wp) function torque_of(gravity, bodies, s)
      real(wp), intent(in) :: gravity(2)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: s

      torque_of = bodies%mass(s)*(bodies%position(1, s)*gravity(2) - bodies%position(2, s)*gravity(1))
   end function torque_of

end module polydem_ledger
