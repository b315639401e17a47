!> The two passes of a step over the bodies: prediction before the forces are computed, completion after it.
!>
!> Each pass does all that it can do for a block of bodies while the block is in the cache.
module polydem_body_passes
   use polydem_bodies, only: bodies_t, block_size
   use polydem_energy_balance, only: accumulate_bodies, accumulate_walls
   use polydem_errors, only: error_t
   use polydem_force_sums, only: total_forces
   use polydem_guards, only: check_motion, check_poses, have_valid_poses, move_within_limit
   use polydem_kinds, only: ip, wp, min_parallel_size
   use polydem_prescribed_motion, only: move_bodies
   use polydem_simulation, only: simulation_t, time_of
   implicit none
   private
   public :: predict_bodies, complete_step, move_walls

contains

   !> Predict the free bodies at the end of the step, move those with prescribed motion there, and check their poses.
   subroutine predict_bodies(self, error)
      !> The simulation at the start of a step
      type(simulation_t), intent(inout) :: self
      !> Names a body with an invalid pose
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: low, high, n
      logical :: good

      n = size(self%bodies%free, kind=ip)
      good = .true.
      !$omp parallel do if (n > min_parallel_size) schedule(static) default(none) shared(self, n) private(low, high) &
      !$omp    reduction(.and.:good)
      do low = 1_ip, n, block_size
         high = min(low + block_size - 1_ip, n)
         call self%integrator%predict(self%dt, self%bodies%free(low:high), self%bodies)
         good = good .and. have_valid_poses(self%bodies, self%bodies%free(low:high))
      end do
      !$omp end parallel do
      call move_walls(self, time_of(self))
      good = good .and. have_valid_poses(self%bodies, moving_walls(self))
      if (.not. good) call check_poses(self%guard, self%bodies, self%step, error)
   end subroutine predict_bodies

   !> Complete the step from the sums of the contact forces: total forces, final velocities, energy balance, and the
   !> guard of the motion, in one pass over the bodies.
   subroutine complete_step(self, error)
      !> The simulation with the sums of the contact forces
      type(simulation_t), intent(inout) :: self
      !> Names a body that moves too far
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: low, high, n, slots(block_size)
      logical :: good

      good = .true.
      !$omp parallel do if (self%bodies%n > min_parallel_size) schedule(static) default(none) shared(self) &
      !$omp    private(low, high, n, slots) reduction(.and.:good)
      do low = 1_ip, self%bodies%n, block_size
         high = min(low + block_size - 1_ip, self%bodies%n)
         call total_forces(self%settings%forces%gravity, self%force_sums, low, high, self%bodies)
         call list_free(self%bodies, low, high, n, slots)
         call self%integrator%correct(self%dt, slots(1:n), self%bodies)
         if (self%settings%output%energy_balance) &
            call accumulate_bodies(self%energy_balance, 1.0_wp, self%settings%forces%gravity, self%bodies, &
                                   self%force_sums, slots(1:n))
         good = good .and. move_within_limit(self%guard, self%bodies, slots(1:n), self%dt)
      end do
      !$omp end parallel do
      if (self%settings%output%energy_balance) call accumulate_walls(self%energy_balance, self%bodies, self%walls)
      good = good .and. move_within_limit(self%guard, self%bodies, moving_walls(self), self%dt)
      if (.not. good) call check_motion(self%guard, self%bodies, self%step, self%dt, error)
   end subroutine complete_step

   !> Slots of the bodies with prescribed motion
   pure function moving_walls(self) result(slots)
      type(simulation_t), intent(in) :: self
      integer(ip), allocatable :: slots(:)

      slots = self%guard%moving(size(self%bodies%free) + 1:)
   end function moving_walls

   !> List the free bodies of some slots.
   pure subroutine list_free(bodies, low, high, n, slots)
      type(bodies_t), intent(in) :: bodies
      !> First and last slot
      integer(ip), intent(in) :: low, high
      !> Number of free bodies that this rank moves
      integer(ip), intent(out) :: n
      !> Their slots
      integer(ip), intent(out) :: slots(block_size)
      integer(ip) :: s

      n = 0_ip
      do s = low, high
         if (bodies%fixed(s) .or. bodies%in_halo(s)) cycle
         n = n + 1_ip
         slots(n) = s
      end do
   end subroutine list_free

   !> Move the bodies with prescribed motion to their poses at a given time.
   subroutine move_walls(self, time)
      !> The simulation
      type(simulation_t), intent(inout) :: self
      !> Simulated time [s]
      real(wp), intent(in) :: time
      integer :: k

      do k = 1, size(self%motions)
         if (time >= self%motions(k)%start) call move_bodies(self%motions(k), time, self%bodies)
      end do
   end subroutine move_walls

end module polydem_body_passes
