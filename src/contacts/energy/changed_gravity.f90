!> A change of gravity between two steps, in the energy balance.
!>
!> The potential energy of gravity and its impulse are those of the present acceleration, as if it had always acted. So
!> the values at the start change with it: by the jump of the potential energy, and by the impulse that the former
!> acceleration gave in place of the new one. The former one still acts in the first half of the next step, as velocity
!> Verlet has it: this changes the kinetic energy by m dt/2 (g' - g).v + m dt^2/8 (g' - g)^2 more than the potential
!> explains. So the residuals do not change. Like the potential energy, its jump counts the whole path through the
!> copies of a cell.
module polydem_changed_gravity
   use polydem_bodies, only: bodies_t
   use polydem_bodies_in_cell, only: path_of
   use polydem_communicator, only: communicator_t
   use polydem_energy_balance, only: energy_balance_t
   use polydem_exact_all_reduce, only: all_reduce_exact_sums
   use polydem_exact_sum, only: exact_sum_t
   use polydem_kinds, only: ip, lp, wp
   implicit none
   private
   public :: change_gravity, last_gravity, undo_change

contains

   !> Change the values at the start at the end of a step, after which another acceleration of gravity acts. Collective.
   subroutine change_gravity(sums, comm, dt, former, gravity, bodies)
      !> Running sums
      type(energy_balance_t), intent(inout) :: sums
      class(communicator_t), intent(inout) :: comm
      !> Time step [s]
      real(wp), intent(in) :: dt
      !> Former and new acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: former(2), gravity(2)
      !> Bodies at the end of the step
      type(bodies_t), intent(in) :: bodies

      if (.not. is_new(sums)) sums%former_gravity = [former, real(sums%steps, wp)]
      call change_start(sums, comm, dt, gravity - former, bodies, bodies%free, 1.0_wp)
   end subroutine change_gravity

   !> Whether gravity has changed since the last accumulated step
   pure logical function is_new(sums)
      !> Running sums
      type(energy_balance_t), intent(in) :: sums

      is_new = nint(sums%former_gravity(3), lp) == sums%steps
   end function is_new

   !> Gravity of the last accumulated step, which bodies have felt that leave before the next one (2) [m/s2]
   pure function last_gravity(sums, gravity) result(last)
      !> Running sums
      type(energy_balance_t), intent(in) :: sums
      !> Present acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      real(wp) :: last(2)

      last = gravity
      if (is_new(sums)) last = sums%former_gravity(:2)
   end function last_gravity

   !> Undo a change of gravity since the last accumulated step for bodies that leave before the next one. Collective.
   subroutine undo_change(sums, comm, dt, gravity, bodies, leaves)
      !> Running sums
      type(energy_balance_t), intent(inout) :: sums
      class(communicator_t), intent(inout) :: comm
      !> Time step [s]
      real(wp), intent(in) :: dt
      !> Present acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      !> Bodies at the end of the step
      type(bodies_t), intent(in) :: bodies
      !> Whether each body leaves, (slot)
      logical, intent(in) :: leaves(:)

      if (is_new(sums)) call change_start(sums, comm, dt, gravity - last_gravity(sums, gravity), bodies, &
                                          pack(bodies%free, leaves(bodies%free)), -1.0_wp)
   end subroutine undo_change

   !> Change the values at the start by a jump of gravity that acts on some bodies. Collective.
   subroutine change_start(sums, comm, dt, jump, bodies, slots, sign)
      !> Running sums
      type(energy_balance_t), intent(inout) :: sums
      class(communicator_t), intent(inout) :: comm
      !> Time step [s], and the jump [m/s2]
      real(wp), intent(in) :: dt, jump(2)
      !> Bodies at the end of a step
      type(bodies_t), intent(in) :: bodies
      !> Slots of the bodies
      integer(ip), intent(in) :: slots(:)
      !> 1, or -1 to undo it
      real(wp), intent(in) :: sign
      type(exact_sum_t) :: partial(5)
      real(wp) :: total(5), elapsed
      integer(ip) :: k

      do k = 1_ip, size(slots, kind=ip)
         associate (m => bodies%mass(slots(k)), x => path_of(bodies, slots(k)), v => bodies%velocity(:, slots(k)))
            call partial(1)%add(m)
            call partial(2)%add(m*x(1))
            call partial(3)%add(m*x(2))
            call partial(4)%add(m*v(1))
            call partial(5)%add(m*v(2))
         end associate
      end do
      call all_reduce_exact_sums(comm, partial)
      total = sign*partial%value()
      ! The rate of a step counts half before its end and half after it.
      elapsed = dt*(real(sums%steps, wp) + 0.5_wp)
      sums%start(1) = sums%start(1) - jump(1)*total(2) - jump(2)*total(3) &
         - 0.5_wp*dt*(jump(1)*total(4) + jump(2)*total(5)) + 0.125_wp*dt*dt*total(1)*(jump(1)**2 + jump(2)**2)
      sums%start(2:3) = sums%start(2:3) - elapsed*total(1)*jump
   end subroutine change_start

end module polydem_changed_gravity
