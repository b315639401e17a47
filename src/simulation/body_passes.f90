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
      integer(ip) :: low, high, first, last, k
      logical :: good

      good = .true.
      !$omp parallel do if (self%bodies%n > min_parallel_size) schedule(static) default(none) shared(self) &
      !$omp    private(low, high, first, last) reduction(.and.:good)
      do low = 1_ip, self%bodies%n, block_size
         high = min(low + block_size - 1_ip, self%bodies%n)
         last = low - 1_ip
         do
            call find_run(self%bodies, last + 1_ip, high, first, last)
            if (first > high) exit
            call self%integrator%predict(self%dt, first, last, self%bodies)
            good = good .and. have_valid_poses(self%bodies, first, last)
         end do
      end do
      !$omp end parallel do
      call move_walls(self, time_of(self))
      do k = size(self%bodies%free, kind=ip) + 1_ip, size(self%guard%moving, kind=ip)
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
      integer(ip) :: low, high, first, last, k
      logical :: good

      good = .true.
      !$omp parallel do if (self%bodies%n > min_parallel_size) schedule(static) default(none) shared(self) &
      !$omp    private(low, high, first, last) reduction(.and.:good)
      do low = 1_ip, self%bodies%n, block_size
         high = min(low + block_size - 1_ip, self%bodies%n)
         call total_forces(self%settings%forces%gravity, self%force_sums, low, high, self%bodies)
         last = low - 1_ip
         do
            call find_run(self%bodies, last + 1_ip, high, first, last)
            if (first > high) exit
            call self%integrator%correct(self%dt, first, last, self%bodies)
            good = good .and. move_within_limit(self%guard, self%bodies, first, last, self%dt)
         end do
         if (self%settings%output%energy_balance) &
            call accumulate_bodies(self%energy_balance, 1.0_wp, self%settings%forces%gravity, self%bodies, &
                                   self%force_sums, low, high)
      end do
      !$omp end parallel do
      if (self%settings%output%energy_balance) call accumulate_walls(self%energy_balance, self%bodies, self%walls)
      do k = size(self%bodies%free, kind=ip) + 1_ip, size(self%guard%moving, kind=ip)
         good = good .and. move_within_limit(self%guard, self%bodies, self%guard%moving(k), self%guard%moving(k), &
                                             self%dt)
      end do
      if (.not. good) call check_motion(self%guard, self%bodies, self%step, self%dt, error)
   end subroutine complete_step

   !> Find the next run of free bodies that this rank moves.
   pure subroutine find_run(bodies, low, high, first, last)
      type(bodies_t), intent(in) :: bodies
      !> First and last slot to search
      integer(ip), intent(in) :: low, high
      !> First and last slot of the run; `first` is greater than `high` if there is none
      integer(ip), intent(out) :: first, last

      do first = low, high
         if (.not. (bodies%fixed(first) .or. bodies%in_halo(first))) exit
      end do
      do last = first, high - 1_ip
         if (bodies%fixed(last + 1_ip) .or. bodies%in_halo(last + 1_ip)) exit
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
