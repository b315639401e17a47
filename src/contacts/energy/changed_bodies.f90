!> Bodies that enter, leave or change between two steps, in the energy balance.
!>
!> Works and impulses up to the end of a step have half of the last rates. What a body that leaves has felt until then
!> is kept in `departed`. Its kinetic and potential energy and its momenta leave the values at the start; those that a
!> body brings are added there. So the residuals do not change. The impulse of gravity on a body is its mass times all
!> steps; `carried` has that of the bodies that left, less that of the steps before bodies entered.
module polydem_changed_bodies
   use polydem_bodies, only: bodies_t
   use polydem_body_contributions, only: motion_of, n_motions
   use polydem_communicator, only: communicator_t
   use polydem_energy_balance, only: accumulate_all, allocate_channels, at_channels, at_mass, at_torque, at_walls, &
      energy_balance_t, n_totals, totals
   use polydem_exact_all_reduce, only: all_reduce_exact_sums
   use polydem_exact_sum, only: exact_sum_t
   use polydem_force_sums, only: force_sums_t, of_normal, of_tangential, sum_torque, sum_x, sum_y
   use polydem_kinds, only: ip, wp
   use polydem_wall_terms, only: wall_terms_t
   implicit none
   private
   public :: change_accelerations, expect_changes, find_leaving_totals, &
      take_leaving, start_entering, count_entering, n_totals

contains

   !> Prepare for bodies that enter or leave.
   pure subroutine expect_changes(sums)
      !> Running sums
      type(energy_balance_t), intent(inout) :: sums

      allocate (sums%departed(n_totals), source=0.0_wp)
   end subroutine expect_changes

   !> Find the totals of bodies that leave at the end of a step. Collective.
   subroutine find_leaving_totals(sums, comm, gravity, bodies, forces, walls, leaves, total)
      !> Running sums
      type(energy_balance_t), intent(in) :: sums
      class(communicator_t), intent(inout) :: comm
      !> Acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      !> Bodies at the end of the step
      type(bodies_t), intent(in) :: bodies
      !> Sums of the contact forces on each body
      type(force_sums_t), intent(in) :: forces
      !> Contacts with fixed bodies
      type(wall_terms_t), intent(in) :: walls
      !> Whether each body leaves, (slot)
      logical, intent(in) :: leaves(:)
      !> Their totals
      real(wp), intent(out) :: total(n_totals)
      type(bodies_t) :: chosen
      type(exact_sum_t) :: pushes(3)
      integer(ip) :: c, k

      chosen = bodies
      chosen%free = pack(bodies%free, leaves(bodies%free))
      total = totals(sums, comm, gravity, chosen, forces, walls)
      ! Forces between free bodies cancel in the impulse as long as both are there. With one of them, the half of the
      ! last rate goes that its partner still feels in the next step.
      do k = 1_ip, size(chosen%free, kind=ip)
         associate (s => chosen%free(k))
            if (.not. forces%has_terms(s)) cycle
            associate (f => [forces%value(sum_x(of_normal), s) + forces%value(sum_x(of_tangential), s), &
                             forces%value(sum_y(of_normal), s) + forces%value(sum_y(of_tangential), s), &
                             forces%value(sum_torque(of_normal), s) + forces%value(sum_torque(of_tangential), s)])
               call add_push(bodies%position(:, s), -0.5_wp*f, pushes)
               if (allocated(forces%field)) call add_push(bodies%position(:, s), 0.5_wp*forces%field(:, s), pushes)
            end associate
         end associate
      end do
      do c = 1_ip, walls%n
         associate (wall => walls%slots(1, c), term => walls%term(:, c))
            if (.not. leaves(walls%slots(2, c))) cycle
            call add_push(bodies%position(:, wall), -0.5_wp*[ &
               term(sum_x(of_normal)) + term(sum_x(of_tangential)), &
               term(sum_y(of_normal)) + term(sum_y(of_tangential)), &
               term(sum_torque(of_normal)) + term(sum_torque(of_tangential))], pushes)
         end associate
      end do
      call all_reduce_exact_sums(comm, pushes)
      total(at_walls + 2:at_walls + 4) = total(at_walls + 2:at_walls + 4) + pushes%value()
   end subroutine find_leaving_totals

   !> Count the impulse by which the first half step differs from that of the forces at the start, because bodies keep
   !> the accelerations of an earlier run. Those had the predicted velocities of their step, and its walls and fields.
   pure subroutine change_accelerations(sums, before, bodies)
      !> Running sums with the forces at the start
      type(energy_balance_t), intent(inout) :: sums
      !> Bodies with the accelerations of these forces, and with those that they keep
      type(bodies_t), intent(in) :: before, bodies
      real(wp) :: push(2), turn
      integer(ip) :: k

      if (.not. allocated(sums%wall_sum)) return
      do k = 1_ip, size(bodies%free, kind=ip)
         associate (s => bodies%free(k))
            push = 0.5_wp*bodies%mass(s)*(bodies%acceleration(:, s) - before%acceleration(:, s))
            turn = 0.5_wp*bodies%inertia(s)*(bodies%angular_acceleration(s) - before%angular_acceleration(s))
            associate (x => bodies%position(:, s))
               sums%wall_sum(2:4, s) = sums%wall_sum(2:4, s) + [push, turn + (x(1)*push(2) - x(2)*push(1))]
            end associate
         end associate
      end do
   end subroutine change_accelerations

   !> Add a force at a point, and its torque about the origin.
   pure subroutine add_push(point, force, pushes)
      !> The point [m]; force along x and y [N/m] and torque about the point [N]
      real(wp), intent(in) :: point(2), force(3)
      type(exact_sum_t), intent(inout) :: pushes(3)

      call pushes(1)%add(force(1))
      call pushes(2)%add(force(2))
      call pushes(3)%add((point(1)*force(2) - point(2)*force(1)) + force(3))
   end subroutine add_push

   !> Take bodies that leave from the balance.
   pure subroutine take_leaving(sums, dt, gravity, total)
      !> Running sums
      type(energy_balance_t), intent(inout) :: sums
      !> Time step [s]
      real(wp), intent(in) :: dt
      !> Acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      !> Totals of these bodies
      real(wp), intent(in) :: total(n_totals)

      sums%departed(at_torque:at_torque + 1) = sums%departed(at_torque:at_torque + 1) + total(at_torque:at_torque + 1)
      sums%departed(at_channels + 1:) = sums%departed(at_channels + 1:) + total(at_channels + 1:)
      sums%exchanged(2) = sums%exchanged(2) + (total(1) + total(2))
      call carry(sums, 1.0_wp, dt*total(at_mass), gravity, total(1:5))
   end subroutine take_leaving

   !> Move the impulse of gravity, and take energy and momenta from the start.
   pure subroutine carry(sums, sign, mass_time, gravity, motion)
      type(energy_balance_t), intent(inout) :: sums
      !> 1 for bodies that leave, -1 for those that enter
      real(wp), intent(in) :: sign
      !> Mass times time in which gravity acted [kg s/m]
      real(wp), intent(in) :: mass_time
      real(wp), intent(in) :: gravity(2)
      !> Kinetic and potential energy, momentum and angular momentum
      real(wp), intent(in) :: motion(5)

      sums%carried(1:2) = sums%carried(1:2) + sign*mass_time*gravity
      sums%carried(3) = sums%carried(3) + sign*mass_time*(abs(gravity(1)) + abs(gravity(2)))
      sums%start(1) = sums%start(1) - sign*(motion(1) + motion(2))
      sums%start(2:4) = sums%start(2:4) - sign*motion(3:5)
   end subroutine carry

   !> Start the channels of bodies that enter, as those of bodies at time 0.
   subroutine start_entering(gravity, added, forces, entering)
      !> Acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      !> The bodies
      type(bodies_t), intent(in) :: added
      !> Sums of the forces on them
      type(force_sums_t), intent(in) :: forces
      !> Their channels
      type(energy_balance_t), intent(out) :: entering

      call allocate_channels(entering, added%n)
      call accumulate_all(entering, 0.5_wp, gravity, added, forces)
   end subroutine start_entering

   !> Add what bodies that enter bring. Collective.
   subroutine count_entering(sums, comm, dt, gravity, added)
      !> Running sums
      type(energy_balance_t), intent(inout) :: sums
      class(communicator_t), intent(inout) :: comm
      !> Time step [s]
      real(wp), intent(in) :: dt
      !> Acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      !> The bodies that enter
      type(bodies_t), intent(in) :: added
      type(exact_sum_t) :: partial(6)
      real(wp) :: motion(n_motions), total(6)
      integer(ip) :: k
      integer :: i

      do k = 1_ip, size(added%free, kind=ip)
         motion = motion_of(gravity, added, added%free(k))
         do i = 1, 5
            call partial(i)%add(motion(i))
         end do
         call partial(6)%add(added%mass(added%free(k)))
      end do
      call all_reduce_exact_sums(comm, partial)
      total = partial%value()
      sums%exchanged(1) = sums%exchanged(1) + (total(1) + total(2))
      call carry(sums, -1.0_wp, dt*total(6)*real(sums%steps, wp), gravity, total(1:5))
   end subroutine count_entering

end module polydem_changed_bodies
