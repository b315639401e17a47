!> The two passes of a step over the bodies: prediction before the forces are computed, completion after it.
!>
!> Each pass does all that it can do for a block of bodies while the block is in the cache.
module polydem_body_passes
   use polydem_bodies, only: block_size
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
      integer(ip) :: n, k, next, high, first, last
      logical :: good

      n = size(self%bodies%free, kind=ip)
      good = .true.
      !$omp parallel do if (n > min_parallel_size) schedule(static) default(none) shared(self, n) &
      !$omp    private(next, high, first, last) reduction(.and.:good)
      do k = 1_ip, n, block_size
         high = min(k + block_size - 1_ip, n)
         next = k
         do while (next <= high)
            call find_run(self%bodies%free, high, next, first, last)
            call self%integrator%predict(self%dt, first, last, self%bodies)
            good = good .and. have_valid_poses(self%bodies, first, last)
         end do
      end do
      !$omp end parallel do
      call move_walls(self, time_of(self))
      do k = n + 1_ip, size(self%guard%moving, kind=ip)
         good = good .and. have_valid_poses(self%bodies, self%guard%moving(k), self%guard%moving(k))
      end do
      if (.not. good) call check_poses(self%guard, self%bodies, self%step, error)
   end subroutine predict_bodies

   !> Complete the step from the sums of the contact forces: total forces, final velocities, energy balance, and the
   !> guard of the motion, in one pass over the bodies.
   subroutine complete_step(self, error)
      !> The simulation with the sums of the contact forces
      type(simulation_t), intent(inout) :: self
      !> Names a body that moves too far
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: n, k, high, next, done, first, last
      logical :: good

      n = size(self%bodies%free, kind=ip)
      good = .true.
      !$omp parallel do if (n > min_parallel_size) schedule(static) default(none) shared(self, n) &
      !$omp    private(high, next, done, first, last) reduction(.and.:good)
      do k = 1_ip, n, block_size
         high = min(k + block_size - 1_ip, n)
         done = 0_ip
         if (k > 1_ip) done = self%bodies%free(k - 1_ip)
         next = k
         do while (next <= high)
            call find_run(self%bodies%free, high, next, first, last)
            call total_forces(self%settings%forces%gravity, self%force_sums, done + 1_ip, last, self%bodies)
            call self%integrator%correct(self%dt, first, last, self%bodies)
            good = good .and. move_within_limit(self%guard, self%bodies, first, last, self%dt)
            if (self%settings%output%energy_balance) &
               call accumulate_bodies(self%energy_balance, 1.0_wp, self%settings%forces%gravity, self%bodies, &
                                      self%force_sums, first, last)
            done = last
         end do
      end do
      !$omp end parallel do
      done = 0_ip
      if (n > 0_ip) done = self%bodies%free(n)
      call total_forces(self%settings%forces%gravity, self%force_sums, done + 1_ip, self%bodies%n, self%bodies)
      if (self%settings%output%energy_balance) call accumulate_walls(self%energy_balance, self%bodies, self%walk%walls)
      do k = n + 1_ip, size(self%guard%moving, kind=ip)
         good = good .and. move_within_limit(self%guard, self%bodies, self%guard%moving(k), self%guard%moving(k), &
                                             self%dt)
      end do
      if (.not. good) call check_motion(self%guard, self%bodies, self%step, self%dt, error)
   end subroutine complete_step

   !> Find the next run of consecutive slots in a list.
   pure subroutine find_run(slots, high, next, first, last)
      !> Ascending slots
      integer(ip), intent(in) :: slots(:)
      !> Index of the last slot that may belong to the run
      integer(ip), intent(in) :: high
      !> Index of the first slot of the run; on return that of the slot after the run
      integer(ip), intent(inout) :: next
      !> First and last slot of the run
      integer(ip), intent(out) :: first, last

      first = slots(next)
      last = first
      if (slots(high) - first == high - next) then
         last = slots(high)
         next = high + 1_ip
         return
      end if
      do next = next + 1_ip, high
         if (slots(next) /= last + 1_ip) exit
         last = slots(next)
      end do
   end subroutine find_run

   !> Move the bodies with prescribed motion to their poses at a given time.
   subroutine move_walls(self, time)
      type(simulation_t), intent(inout) :: self
      !> Simulated time [s]
      real(wp), intent(in) :: time
      integer :: k

      do k = 1, size(self%motions)
         if (time >= self%motions(k)%start) call move_bodies(self%motions(k), time, self%bodies)
      end do
   end subroutine move_walls

end module polydem_body_passes
