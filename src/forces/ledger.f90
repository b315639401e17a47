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
!> Sums run over fixed blocks and then over blocks in order: the same bits for any number of threads.
module polydem_ledger
   use polydem_archive, only: archive_t
   use polydem_bodies, only: bodies_t
   use polydem_contacts, only: contacts_t
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: ledger_t, balance_t, open_ledger, book_step, balance_of, keep_ledger

   !> Rates: power of elastic, damping and friction forces and of walls; force along x and y and torque from outside;
   !> the sums of the absolute values of all forces and torques from outside. Last, no rate: the elastic energy
   integer, parameter :: n_rates = 10

   !> Accumulated work and impulses
   type :: ledger_t
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
      !> Energy, momentum and angular momentum at the start
      real(wp), private :: start(4) = 0.0_wp
      !> Rates at the last evaluation, in the order of n_rates
      real(wp), private :: rate(n_rates) = 0.0_wp
      !> Elastic energy of the contacts at the start, if they have one [J/m]
      real(wp), private :: elastic_start = 0.0_wp
      !> Greatest kinetic energy so far, the scale of the residual [J/m]
      real(wp) :: energy_scale = 0.0_wp
      !> Sums of absolute impulses so far, the scales of the residuals
      real(wp), private :: impulse_scale = 0.0_wp, angular_scale = 0.0_wp
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
      !> Energy that the books cannot explain [J/m]
      real(wp) :: energy_residual = 0.0_wp
      !> The same over the energy turned over: the greatest kinetic energy or work done, but at least a billionth of
      !> the potential, below which there is nothing but rounding
      real(wp) :: relative_energy_residual = 0.0_wp
      !> Momentum that the books cannot explain, over the sum of absolute impulses from outside
      real(wp) :: relative_momentum_residual = 0.0_wp
      !> Angular momentum that the books cannot explain, over the sum of absolute angular impulses
      real(wp) :: relative_angular_residual = 0.0_wp
   end type balance_t

   !> Least energy turned over, as a share of the potential
   real(wp), parameter :: least_share = 1.0e-9_wp
   !> Contacts or bodies per block of a sum
   integer(ip), parameter :: block = 1024_ip

contains

   !> Start the books with the bodies and forces of step 0.
   subroutine open_ledger(ledger, gravity, bodies, contacts)
      !> Books
      type(ledger_t), intent(out) :: ledger
      !> Acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      !> Bodies with their forces
      type(bodies_t), intent(in) :: bodies
      !> Contacts with their forces
      type(contacts_t), intent(in) :: contacts
      real(wp) :: kinetic, potential, momentum(2), angular_momentum

      call measure(gravity, bodies, kinetic, potential, momentum, angular_momentum)
      ledger%start = [kinetic + potential, momentum, angular_momentum]
      ledger%energy_scale = kinetic
      ledger%impulse_scale = abs(momentum(1)) + abs(momentum(2))
      ledger%angular_scale = abs(angular_momentum)
      ledger%rate = rates(gravity, bodies, contacts)
      ledger%elastic_start = ledger%rate(n_rates)
   end subroutine open_ledger

   !> Book one step; call it when the step is done.
   subroutine book_step(ledger, dt, gravity, bodies, contacts)
      !> Books
      type(ledger_t), intent(inout) :: ledger
      !> Step [s]
      real(wp), intent(in) :: dt
      !> Acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      !> Bodies at the end of this step, with its forces
      type(bodies_t), intent(in) :: bodies
      !> Contacts with the forces of this step
      type(contacts_t), intent(in) :: contacts
      real(wp) :: now(n_rates), change(n_rates)

      now = rates(gravity, bodies, contacts)
      change = (0.5_wp*dt)*(ledger%rate + now)
      ledger%elastic_work = ledger%elastic_work + change(1)
      if (contacts%energy_is_quadratic) ledger%elastic_work = ledger%elastic_start - now(n_rates)
      ledger%damping_work = ledger%damping_work + change(2)
      ledger%friction_work = ledger%friction_work + change(3)
      ledger%wall_work = ledger%wall_work + change(4)
      ledger%impulse = ledger%impulse + change(5:6)
      ledger%angular_impulse = ledger%angular_impulse + change(7)
      ledger%impulse_scale = ledger%impulse_scale + change(8)
      ledger%angular_scale = ledger%angular_scale + change(9)
      ledger%rate = now
   end subroutine book_step

   !> Compare the bodies with the books.
   subroutine balance_of(ledger, gravity, bodies, balance)
      !> Books
      type(ledger_t), intent(inout) :: ledger
      !> Acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      !> Bodies at the end of a step
      type(bodies_t), intent(in) :: bodies
      !> Energy, momentum, and what is unexplained
      type(balance_t), intent(out) :: balance
      real(wp) :: work, missing(2), missing_angular

      call measure(gravity, bodies, balance%kinetic, balance%potential, balance%momentum, balance%angular_momentum)
      work = ledger%elastic_work + ledger%damping_work + ledger%friction_work + ledger%wall_work
      ledger%energy_scale = max(ledger%energy_scale, balance%kinetic, abs(ledger%elastic_work), &
                                abs(ledger%damping_work), abs(ledger%friction_work), abs(ledger%wall_work), &
                                least_share*abs(balance%potential))
      balance%energy_residual = balance%kinetic + balance%potential - ledger%start(1) - work
      missing = balance%momentum - ledger%start(2:3) - ledger%impulse
      missing_angular = balance%angular_momentum - ledger%start(4) - ledger%angular_impulse
      balance%relative_energy_residual = share(balance%energy_residual, ledger%energy_scale)
      balance%relative_momentum_residual = share(abs(missing(1)) + abs(missing(2)), ledger%impulse_scale)
      balance%relative_angular_residual = share(missing_angular, ledger%angular_scale)
   end subroutine balance_of

   !> Keep the books in an archive.
   subroutine keep_ledger(ledger, archive)
      !> Books
      type(ledger_t), intent(inout) :: ledger
      !> Archive
      class(archive_t), intent(inout) :: archive

      call archive%keep('/run/elastic_work', ledger%elastic_work, 'J/m', 'work of the elastic normal forces')
      call archive%keep('/run/damping_work', ledger%damping_work, 'J/m', 'work of the normal damping')
      call archive%keep('/run/friction_work', ledger%friction_work, 'J/m', 'work of the tangential forces')
      call archive%keep('/run/wall_work', ledger%wall_work, 'J/m', 'work done by moving walls')
      call archive%keep('/run/impulse', ledger%impulse, 'N s/m', 'impulse of gravity and fixed bodies')
      call archive%keep('/run/angular_impulse', ledger%angular_impulse, 'N s', 'their angular impulse')
      call archive%keep('/run/ledger_start', ledger%start, 'J/m, N s/m, N s', &
                        'energy, momentum and angular momentum at the start')
      call archive%keep('/run/ledger_rate', ledger%rate, 'W/m, N/m, N, J/m', 'rates of the books at the last step')
      call archive%keep('/run/elastic_start', ledger%elastic_start, 'J/m', 'elastic energy at the start')
      call archive%keep('/run/energy_scale', ledger%energy_scale, 'J/m', 'greatest energy turned over')
      call archive%keep('/run/impulse_scale', ledger%impulse_scale, 'N s/m', 'sum of absolute impulses')
      call archive%keep('/run/angular_scale', ledger%angular_scale, 'N s', 'sum of absolute angular impulses')
   end subroutine keep_ledger

   pure real(wp) function share(part, whole)
      real(wp), intent(in) :: part, whole

      share = 0.0_wp
      if (whole > 0.0_wp) share = abs(part)/whole
   end function share

   !> All rates of this moment.
   function rates(gravity, bodies, contacts) result(rate)
      real(wp), intent(in) :: gravity(2)
      type(bodies_t), intent(in) :: bodies
      type(contacts_t), intent(in) :: contacts
      real(wp) :: rate(n_rates), torque
      real(wp) :: partial(4, (contacts%n + block - 1_ip)/block)
      integer(ip) :: b, n_blocks, s

      n_blocks = size(partial, 2, kind=ip)
      !$omp parallel do if (n_blocks > 1_ip) schedule(static) default(none) &
      !$omp    shared(n_blocks, partial, bodies, contacts) private(b)
      do b = 1_ip, n_blocks
         partial(:, b) = contact_power(bodies, contacts, (b - 1_ip)*block + 1_ip, min(b*block, contacts%n))
      end do
      !$omp end parallel do
      rate = 0.0_wp
      do b = 1_ip, n_blocks
         rate([1, 2, 3, n_rates]) = rate([1, 2, 3, n_rates]) + partial(:, b)
      end do
      do s = 1_ip, bodies%n
         if (bodies%fixed(s)) then
            rate(4) = rate(4) - bodies%force(1, s)*bodies%velocity(1, s) - bodies%force(2, s)*bodies%velocity(2, s) &
               - bodies%torque(s)*bodies%angular_velocity(s)
            torque = bodies%torque(s) &
               + (bodies%position(1, s)*bodies%force(2, s) - bodies%position(2, s)*bodies%force(1, s))
            rate(5:6) = rate(5:6) - bodies%force(:, s)
            rate(7) = rate(7) - torque
            rate(8) = rate(8) + abs(bodies%force(1, s)) + abs(bodies%force(2, s))
            rate(9) = rate(9) + abs(torque)
         else
            torque = bodies%mass(s)*(bodies%position(1, s)*gravity(2) - bodies%position(2, s)*gravity(1))
            rate(5:6) = rate(5:6) + bodies%mass(s)*gravity
            rate(7) = rate(7) + torque
            rate(8) = rate(8) + bodies%mass(s)*(abs(gravity(1)) + abs(gravity(2)))
            rate(9) = rate(9) + abs(torque)
         end if
      end do
   end function rates

   !> Power of the elastic, damping and friction forces of some contacts [W/m], and their elastic energy [J/m]
   pure function contact_power(bodies, contacts, low, high) result(power)
      type(bodies_t), intent(in) :: bodies
      type(contacts_t), intent(in) :: contacts
      integer(ip), intent(in) :: low, high
      real(wp) :: power(4)
      real(wp) :: vx, vy, approach
      integer(ip) :: c

      power = 0.0_wp
      do c = low, high
         associate (i => contacts%first(c), j => contacts%second(c))
            vx = (bodies%velocity(1, i) - bodies%angular_velocity(i)*contacts%arm_first(2, c)) &
               - (bodies%velocity(1, j) - bodies%angular_velocity(j)*contacts%arm_second(2, c))
            vy = (bodies%velocity(2, i) + bodies%angular_velocity(i)*contacts%arm_first(1, c)) &
               - (bodies%velocity(2, j) + bodies%angular_velocity(j)*contacts%arm_second(1, c))
         end associate
         approach = contacts%direction(1, c)*vx + contacts%direction(2, c)*vy &
            + contacts%lever(c)*(bodies%angular_velocity(contacts%first(c)) &
                                 - bodies%angular_velocity(contacts%second(c)))
         power(1) = power(1) + contacts%elastic(c)*approach
         power(2) = power(2) + (contacts%normal_force(c) - contacts%elastic(c))*approach
         if (contacts%has_twist) then
            power(2) = power(2) + contacts%twist(c)*(bodies%angular_velocity(contacts%first(c)) &
                                                     - bodies%angular_velocity(contacts%second(c)))
         end if
         power(3) = power(3) + contacts%tangential_force(c) &
            *(contacts%direction(1, c)*vy - contacts%direction(2, c)*vx)
         power(4) = power(4) + 0.5_wp*contacts%elastic(c)*contacts%area(c)/contacts%length(c)
      end do
      if (.not. contacts%energy_is_quadratic) power(4) = 0.0_wp
   end function contact_power

   subroutine measure(gravity, bodies, kinetic, potential, momentum, angular_momentum)
      real(wp), intent(in) :: gravity(2)
      type(bodies_t), intent(in) :: bodies
      real(wp), intent(out) :: kinetic, potential, momentum(2), angular_momentum
      integer(ip) :: k, s

      kinetic = 0.0_wp
      potential = 0.0_wp
      momentum = 0.0_wp
      angular_momentum = 0.0_wp
      do k = 1_ip, size(bodies%free, kind=ip)
         s = bodies%free(k)
         associate (v => bodies%velocity(:, s), x => bodies%position(:, s))
            kinetic = kinetic + 0.5_wp*(bodies%mass(s)*(v(1)*v(1) + v(2)*v(2)) &
                                        + bodies%inertia(s)*bodies%angular_velocity(s)**2)
            potential = potential - bodies%mass(s)*(gravity(1)*x(1) + gravity(2)*x(2))
            momentum = momentum + bodies%mass(s)*v
            angular_momentum = angular_momentum + bodies%mass(s)*(x(1)*v(2) - x(2)*v(1)) &
               + bodies%inertia(s)*bodies%angular_velocity(s)
         end associate
      end do
   end subroutine measure

end module polydem_ledger
