!> Energy and momentum balance of a run.
!>
!> Work is the integral of power over time, by the trapezoidal rule between the ends of steps. Its channels are the
!> elastic normal forces, damping and friction (all contacts; usually negative), and moving walls with gravity that
!> changes. Powers are those of the final velocities of a step. With predicted velocities each jump of a force would
!> leave a residual. Force times final velocity is exactly the energy that velocity Verlet adds from the middle of a
!> step to the middle of the next. With the potential energy of gravity, kinetic + potential - work is constant up to
!> the error of integration.
!> The area law has no potential energy: its elastic work does not return to zero when contacts open. The elastic work
!> of the conservative law is not a sum over steps. It is the elastic energy at the start minus the present one.
!>
!> Impulses of gravity and of the fixed bodies are summed in the same way. For velocity Verlet these sums equal the
!> change of momentum and angular momentum up to rounding, if and only if the forces of every contact are opposite and
!> act at one point.
!>
!> Every free body has its own channels (`polydem_body_contributions`) on the rank that moves it. A channel is a sum of
!> rates over steps. The first rate has the weight 1/2; `evaluate_balance` subtracts half of the last rate. Totals
!> over bodies are exact sums, rounded once, then multiplied by the time step. Their bits do not depend on the number of
!> threads and ranks.
!>
!> Residuals of momentum are relative to what moves: the largest sum over bodies of absolute momenta so far, plus the
!> absolute impulses, of contacts with fixed bodies and of gravity on each body. A scene whose total momentum is zero
!> therefore has a scale, and forces that cancel within a fixed body add to it.
module polydem_energy_balance
   use polydem_bodies, only: bodies_t
   use polydem_body_contributions, only: add_fields, add_given, add_powers, add_torques, add_walls, motion_of, &
      n_channels, n_motions, n_wall_channels
   use polydem_communicator, only: communicator_t
   use polydem_exact_all_reduce, only: all_reduce_exact_sums
   use polydem_exact_sum, only: exact_sum_t
   use polydem_force_sums, only: force_sums_t, sum_energy
   use polydem_kinds, only: ip, lp, wp
   use polydem_wall_terms, only: wall_terms_t
   implicit none
   private
   public :: energy_balance_t, balance_t, start_energy_balance, expire_balance, accumulate_bodies, &
      accumulate_all, accumulate_walls, count_step, evaluate_balance, allocate_channels, totals
   public :: n_totals, at_mass, at_torque, at_channels, at_walls

   !> Running sums of the energy and momentum balance, and its values at the start
   type :: energy_balance_t
      !> Energy scale of the residual: largest kinetic energy or work of a channel so far [J/m]
      real(wp) :: energy_scale = 0.0_wp
      !> Largest sums over bodies of absolute momenta [N s/m] and angular momenta [N s] so far
      real(wp) :: momentum_scale(2) = 0.0_wp
      !> Whether bodies and contacts are those of the last accumulated step. In the middle of a step they are not, and
      !> the last rates have full weight
      logical :: is_current = .false.
      !> Sums over steps of the powers of forces on each body, (n_channels, slot); not allocated without a balance [W/m]
      real(wp), allocatable :: power_sum(:, :)
      !> Sums over steps of the torque of gravity on each body about the origin, (slot) [N]
      real(wp), allocatable :: torque(:)
      !> Sums over steps of the wall channels of each body, (n_wall_channels, slot)
      real(wp), allocatable :: wall_sum(:, :)
      !> Number of accumulated steps
      integer(lp) :: steps = 0_lp
      !> Energy, momentum along x and y, and angular momentum at the start
      real(wp) :: start(4) = 0.0_wp
      !> Elastic energy of the contacts at the start, if they have one [J/m]
      real(wp) :: elastic_start = 0.0_wp
      !> Totals of the bodies that have left, of which those from `at_torque` on are used; not allocated if the bodies
      !> of the run are always the same (`polydem_changed_bodies`)
      real(wp), allocatable :: departed(:)
      !> Impulse of gravity on them, less what bodies that entered have not felt (2), and its scale [N s/m]
      real(wp) :: carried(3) = 0.0_wp
      !> Energy that bodies brought when they entered, and that others took when they left [J/m]
      real(wp) :: exchanged(2) = 0.0_wp
      !> Gravity before its last change [m/s2], and number of accumulated steps then
      real(wp) :: former_gravity(3) = -1.0_wp
   end type energy_balance_t

   !> Terms and residuals of the balance at one time
   type :: balance_t
      !> Kinetic energy of the free bodies [J/m]
      real(wp) :: kinetic = 0.0_wp
      !> Potential energy of gravity of the free bodies, zero at the origin [J/m]
      real(wp) :: potential = 0.0_wp
      !> Momentum of the free bodies, (2) [kg/s]
      real(wp) :: momentum(2) = 0.0_wp
      !> Their angular momentum about the origin [kg m/s]
      real(wp) :: angular_momentum = 0.0_wp
      !> Work of the elastic normal forces on both bodies [J/m]
      real(wp) :: elastic_work = 0.0_wp
      !> Work of the damping of normal motion and of tilts [J/m]
      real(wp) :: damping_work = 0.0_wp
      !> Work of the tangential forces [J/m]
      real(wp) :: friction_work = 0.0_wp
      !> Work done by moving walls, and by gravity that changes [J/m]
      real(wp) :: wall_work = 0.0_wp
      !> Whether walls are load-controlled
      logical :: has_loads = .false.
      !> Work of the loads and of the damping of their walls, and their kinetic energy [J/m]
      real(wp) :: load_work = 0.0_wp, load_damping_work = 0.0_wp, wall_kinetic = 0.0_wp
      !> Whether bodies enter or leave
      logical :: bodies_change = .false.
      !> Energy that bodies brought when they entered, and that others took when they left [J/m]
      real(wp) :: exchanged(2) = 0.0_wp
      !> Impulse of gravity and fixed bodies, (2) [N s/m]
      real(wp) :: impulse(2) = 0.0_wp
      !> Angular impulse of gravity and fixed bodies about the origin [N s]
      real(wp) :: angular_impulse = 0.0_wp
      !> Unexplained energy [J/m]
      real(wp) :: energy_residual = 0.0_wp
      !> Unexplained energy over the largest kinetic energy or work so far, at least over 1e-9 of the potential energy
      real(wp) :: relative_energy_residual = 0.0_wp
      !> Unexplained momentum, over the largest sum of absolute momenta of the bodies so far plus the absolute impulses
      !> of gravity on each body and of all contacts with fixed bodies
      real(wp) :: relative_momentum_residual = 0.0_wp
      !> Unexplained angular momentum, likewise with angular momenta and angular impulses
      real(wp) :: relative_angular_residual = 0.0_wp
   end type balance_t

   !> Least energy scale, as a fraction of the potential energy
   real(wp), parameter :: least_share = 1.0e-9_wp
   !> Least number of bodies in a partial sum, and the greatest number of partial sums
   integer(ip), parameter :: block = 1024_ip, most_blocks = 32_ip

   !> Indices of the totals: values of `motion_of`; mass times steps; torque of gravity and its absolute value; elastic
   !> energy; number of bodies with unknown last rates; then channels and wall channels
   integer, parameter :: at_mass = n_motions + 1, at_torque = at_mass + 1, at_energy = at_torque + 2, &
      at_unknown = at_energy + 1, at_channels = at_unknown, at_walls = at_channels + n_channels, &
      n_totals = at_walls + n_wall_channels

contains

   !> Start the balance with the bodies and forces of step 0. Collective.
   subroutine start_energy_balance(sums, comm, gravity, bodies, forces, walls)
      !> Running sums
      type(energy_balance_t), intent(out) :: sums
      class(communicator_t), intent(inout) :: comm
      !> Acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      !> Bodies with their forces
      type(bodies_t), intent(in) :: bodies
      !> Sums of the contact forces on each body
      type(force_sums_t), intent(in) :: forces
      !> Contacts with fixed bodies
      type(wall_terms_t), intent(in) :: walls
      real(wp) :: total(n_totals)

      call allocate_channels(sums, bodies%n)
      call accumulate_all(sums, 0.5_wp, gravity, bodies, forces)
      call add_walls(bodies, walls, 0.5_wp, 1_ip, bodies%n, sums%power_sum, sums%wall_sum)
      sums%is_current = .true.
      total = totals(sums, comm, gravity, bodies, forces, walls)
      sums%energy_scale = total(1)
      sums%momentum_scale = total(6:7)
      sums%start = [total(1) + total(2), total(3:5)]
      sums%elastic_start = total(at_energy)
   end subroutine start_energy_balance

   !> Accumulate the rates of all free bodies of this rank, times a weight.
   pure subroutine accumulate_all(sums, weight, gravity, bodies, forces)
      !> Running sums; only those of these bodies change
      type(energy_balance_t), intent(inout) :: sums
      !> Factor of the rates: 1 for a step
      real(wp), intent(in) :: weight
      !> Acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      !> Bodies at the end of this step
      type(bodies_t), intent(in) :: bodies
      !> Sums of the contact forces on each body
      type(force_sums_t), intent(in) :: forces
      integer(ip) :: k

      do k = 1_ip, size(bodies%free, kind=ip)
         call accumulate_bodies(sums, weight, gravity, bodies, forces, bodies%free(k), bodies%free(k))
      end do
   end subroutine accumulate_all

   !> Accumulate the rates of a run of free bodies of this rank, times a weight. Several threads may call it for
   !> different bodies.
   pure subroutine accumulate_bodies(sums, weight, gravity, bodies, forces, first, last)
      !> Running sums; only those of these bodies change
      type(energy_balance_t), intent(inout) :: sums
      !> Factor of the rates: 1 for a step
      real(wp), intent(in) :: weight
      !> Acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      !> Bodies at the end of this step
      type(bodies_t), intent(in) :: bodies
      !> Sums of the contact forces on each body
      type(force_sums_t), intent(in) :: forces
      !> First and last slot
      integer(ip), intent(in) :: first, last

      call add_powers(bodies, forces, weight, first, last, sums%power_sum)
      if (allocated(forces%field)) call add_fields(bodies, forces%field, forces%acceleration, weight, first, last, &
                                                  sums%power_sum, sums%wall_sum)
      if (allocated(forces%given)) call add_given(bodies, forces%given, weight, first, last, sums%power_sum, &
                                                  sums%wall_sum)
      if (last < first .or. .not. any(abs(gravity) > 0.0_wp)) return
      call add_torques(last - first + 1_ip, weight, gravity, bodies%mass(first), bodies%position(1, first), &
                       sums%torque(first))
   end subroutine accumulate_bodies

   !> Accumulate the action of fixed bodies on some bodies in one step, after the rates of these bodies. Several threads
   !> may call it for different bodies.
   pure subroutine accumulate_walls(sums, bodies, walls, first, last)
      !> Running sums; only those of these bodies change
      type(energy_balance_t), intent(inout) :: sums
      !> Bodies at the end of this step
      type(bodies_t), intent(in) :: bodies
      !> Contacts with fixed bodies
      type(wall_terms_t), intent(in) :: walls
      !> First and last slot
      integer(ip), intent(in) :: first, last

      call add_walls(bodies, walls, 1.0_wp, first, last, sums%power_sum, sums%wall_sum)
   end subroutine accumulate_walls

   !> At the start of a step bodies and contacts are no longer those of the last accumulated step.
   pure subroutine expire_balance(sums)
      !> Running sums
      type(energy_balance_t), intent(inout) :: sums

      sums%is_current = .false.
   end subroutine expire_balance

   !> Count a step of which the rates of all bodies and the action of fixed bodies are accumulated.
   pure subroutine count_step(sums)
      !> Running sums
      type(energy_balance_t), intent(inout) :: sums

      sums%steps = sums%steps + 1_lp
      sums%is_current = .true.
   end subroutine count_step

   !> Evaluate all terms and residuals. Collective.
   subroutine evaluate_balance(sums, comm, dt, gravity, bodies, forces, walls, balance)
      !> Running sums
      type(energy_balance_t), intent(inout) :: sums
      class(communicator_t), intent(inout) :: comm
      !> Time step, the same for the whole run [s]
      real(wp), intent(in) :: dt
      !> Acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      !> Bodies at the end of a step
      type(bodies_t), intent(in) :: bodies
      !> Sums of the contact forces on each body
      type(force_sums_t), intent(in) :: forces
      !> Contacts with fixed bodies
      type(wall_terms_t), intent(in) :: walls
      !> Terms and residuals
      type(balance_t), intent(out) :: balance
      real(wp) :: total(n_totals)

      total = totals(sums, comm, gravity, bodies, forces, walls)
      balance%kinetic = total(1)
      balance%potential = total(2)
      balance%momentum = total(3:4)
      balance%angular_momentum = total(5)
      if (allocated(sums%departed)) then
         balance%bodies_change = .true.
         balance%exchanged = sums%exchanged
         total(at_torque:at_torque + 1) = total(at_torque:at_torque + 1) + sums%departed(at_torque:at_torque + 1)
         total(at_channels + 1:) = total(at_channels + 1:) + sums%departed(at_channels + 1:)
      end if
      sums%momentum_scale = max(sums%momentum_scale, total(6:7))
      associate (works => dt*total(at_channels + 1:at_walls), on_walls => dt*total(at_walls + 1:), &
                 mass_time => dt*total(at_mass), torques => dt*total(at_torque:at_torque + 1))
         balance%elastic_work = works(1)
         if (walls%energy_is_known .and. .not. total(at_unknown) > 0.0_wp) &
            balance%elastic_work = sums%elastic_start - total(at_energy)
         balance%damping_work = works(2)
         balance%friction_work = works(3)
         balance%wall_work = on_walls(1)
         balance%impulse = on_walls(2:3) + mass_time*gravity
         if (balance%bodies_change) balance%impulse = balance%impulse + sums%carried(1:2)
         balance%angular_impulse = on_walls(4) + torques(1)
         call find_residuals(sums, on_walls(5) + mass_time*(abs(gravity(1)) + abs(gravity(2))) + sums%carried(3), &
                             on_walls(6) + torques(2), balance)
      end associate
   end subroutine evaluate_balance

   !> Make room for the channels of bodies and set them to zero.
   subroutine allocate_channels(sums, n)
      !> Running sums
      type(energy_balance_t), intent(inout) :: sums
      !> Number of bodies
      integer(ip), intent(in) :: n

      if (allocated(sums%power_sum)) deallocate (sums%power_sum, sums%torque, sums%wall_sum)
      allocate (sums%power_sum(n_channels, n), sums%torque(n), sums%wall_sum(n_wall_channels, n))
      sums%power_sum = 0.0_wp
      sums%torque = 0.0_wp
      sums%wall_sum = 0.0_wp
   end subroutine allocate_channels

   !> Find the unexplained energy, momentum and angular momentum.
   subroutine find_residuals(sums, impulse_scale, angular_scale, balance)
      type(energy_balance_t), intent(inout) :: sums
      !> Absolute impulses [N s/m] and angular impulses [N s] of gravity and fixed bodies
      real(wp), intent(in) :: impulse_scale, angular_scale
      type(balance_t), intent(inout) :: balance
      real(wp) :: missing(2), missing_angular, work

      associate (b => balance, start => sums%start)
         sums%energy_scale = max(sums%energy_scale, b%kinetic, abs(b%elastic_work), abs(b%damping_work), &
                                   abs(b%friction_work), abs(b%wall_work), least_share*abs(b%potential))
         work = b%elastic_work + b%damping_work + b%friction_work + b%wall_work
         b%energy_residual = b%kinetic + b%potential - start(1) - work
         missing = b%momentum - start(2:3) - b%impulse
         missing_angular = b%angular_momentum - start(4) - b%angular_impulse
         b%relative_energy_residual = share(b%energy_residual, sums%energy_scale)
         b%relative_momentum_residual = share(abs(missing(1)) + abs(missing(2)), &
                                              sums%momentum_scale(1) + impulse_scale)
         b%relative_angular_residual = share(missing_angular, sums%momentum_scale(2) + angular_scale)
      end associate
   end subroutine find_residuals

   !> Absolute value of a part over the whole; 0 if the whole is 0
   pure real(wp) function share(part, whole)
      real(wp), intent(in) :: part, whole

      share = 0.0_wp
      if (whole > 0.0_wp) share = abs(part)/whole
   end function share

   !> Totals over all bodies of the communicator
   function totals(sums, comm, gravity, bodies, forces, walls) result(total)
      !> Running sums
      type(energy_balance_t), intent(in) :: sums
      class(communicator_t), intent(inout) :: comm
      !> Acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      !> Bodies; those that `free` lists count
      type(bodies_t), intent(in) :: bodies
      !> Sums of the contact forces on each body
      type(force_sums_t), intent(in) :: forces
      !> Contacts with fixed bodies
      type(wall_terms_t), intent(in) :: walls
      real(wp) :: total(n_totals)
      type(exact_sum_t), allocatable :: partial_sums(:, :)
      type(energy_balance_t) :: now
      real(wp), allocatable :: energy(:)
      integer(ip) :: ends(0:most_blocks), b, n, n_blocks
      integer :: i

      ! The last rates have half their weight.
      now = sums
      energy = forces%value(sum_energy, :)
      if (sums%is_current) then
         call accumulate_all(now, -0.5_wp, gravity, bodies, forces)
         call add_walls(bodies, walls, -0.5_wp, 1_ip, bodies%n, now%power_sum, now%wall_sum, energy)
      end if
      if (.not. walls%energy_is_known) energy = 0.0_wp
      n = size(bodies%free, kind=ip)
      n_blocks = max(1_ip, min(n/block, most_blocks))
      ends(:n_blocks) = [(int(int(n, lp)*int(b, lp)/int(n_blocks, lp), ip), b=0_ip, n_blocks)]
      allocate (partial_sums(n_totals, n_blocks))
      !$omp parallel do if (n_blocks > 1_ip) schedule(static) default(none) &
      !$omp    shared(ends, n_blocks, partial_sums, now, energy, gravity, bodies) private(b)
      do b = 1_ip, n_blocks
         call add_block(now, energy, gravity, bodies, ends(b - 1_ip) + 1_ip, ends(b), partial_sums(:, b))
      end do
      !$omp end parallel do
      do b = 2_ip, n_blocks
         do i = 1, n_totals
            call partial_sums(i, 1)%add(partial_sums(i, b))
         end do
      end do
      call all_reduce_exact_sums(comm, partial_sums(:, 1))
      total = partial_sums(:, 1)%value()
   end function totals

   !> Add the contributions of some free bodies to the sums.
   subroutine add_block(sums, energy, gravity, bodies, low, high, partial_sums)
      type(energy_balance_t), intent(in) :: sums
      !> Elastic energy of each body [J/m]
      real(wp), intent(in) :: energy(:)
      real(wp), intent(in) :: gravity(2)
      type(bodies_t), intent(in) :: bodies
      !> First and last index in `bodies%free`
      integer(ip), intent(in) :: low, high
      type(exact_sum_t), intent(inout) :: partial_sums(n_totals)
      real(wp) :: row(n_totals)
      integer(ip) :: k, s
      integer :: i

      do k = low, high
         s = bodies%free(k)
         row(:n_motions) = motion_of(gravity, bodies, s)
         row(at_mass) = bodies%mass(s)*real(sums%steps, wp)
         row(at_torque) = sums%torque(s)
         row(at_torque + 1) = abs(sums%torque(s))
         row(at_energy) = energy(s)
         row(at_unknown) = merge(0.0_wp, 1.0_wp, sums%is_current)
         if (.not. sums%is_current) row(at_mass) = row(at_mass) + 0.5_wp*bodies%mass(s)
         row(at_channels + 1:at_walls) = sums%power_sum(:, s)
         row(at_walls + 1:) = sums%wall_sum(:, s)
         do i = 1, n_totals
            call partial_sums(i)%add(row(i))
         end do
      end do
   end subroutine add_block

end module polydem_energy_balance
