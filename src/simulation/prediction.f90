!> The first pass of a step over the bodies: prediction before the forces are computed.
!>
!> The pass does all that it can do for a block of bodies while the block is in the cache.
module polydem_prediction
   use polydem_bodies, only: block_size
   use polydem_body_runs, only: find_run, list_others, number_of_parts
   use polydem_box_maker, only: have_boxes_within, turn_and_bound_block
   use polydem_clock, only: wall_seconds
   use polydem_errors, only: error_t
   use polydem_extreme_corners, only: bound_block
   use polydem_guards, only: check_poses, find_coasting, have_valid_poses
   use polydem_integrator, only: drift
   use polydem_kinds, only: dp, ip, wp
   use polydem_simulation, only: simulation_t, time_of
   use polydem_thread_changes, only: part
   use polydem_timers, only: stage_decomposition, stage_integrate
   use polydem_wall, only: move_wall
   implicit none
   private
   public :: predict_bodies, move_walls

   !> One of so many blocks of the first thread is timed
   integer(ip), parameter :: timed_blocks = 8_ip
   !> A scene is dilute if at most one of so many bodies has pairs. Otherwise reading all vertices in sequence is faster
   integer(ip), parameter :: dilution = 4_ip

contains

   !> Predict the free bodies at the end of the step, turn their vertices and update their boxes, in one pass over the
   !> bodies. Move those with prescribed motion, and check all poses. In a run on several ranks, the bodies of the
   !> border are predicted first, and sent to other ranks while the rest is computed.
   subroutine predict_bodies(self, boxes_share, error)
      !> The simulation at the start of a step
      type(simulation_t), intent(inout) :: self
      !> Share of the time spent in vertices and boxes, in the pass over all bodies, of which some blocks were timed
      real(dp), intent(out) :: boxes_share
      !> Names a body with an invalid pose
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: k
      real(dp) :: seconds(2)
      logical :: good

      self%is_dilute = self%is_weightless .and. self%neighbours%pairs%n_paired <= self%bodies%n/dilution
      if (allocated(self%domain%halo%border)) then
         call predict_border(self)
         call self%timers%lap(stage_integrate)
         call self%domain%send_border(self%comm, self%bodies)
         call self%timers%lap(stage_decomposition)
      end if
      call predict_and_bound(self, good, seconds)
      boxes_share = 0.0_dp
      if (sum(seconds) > 0.0_dp) boxes_share = seconds(2)/sum(seconds)
      call move_walls(self, time_of(self))
      do k = size(self%bodies%free, kind=ip) + 1_ip, size(self%guard%moving, kind=ip)
         good = good .and. have_valid_poses(self%bodies, self%guard%moving(k), self%guard%moving(k))
      end do
      if (.not. good) call check_poses(self%guard, self%bodies, self%step, error)
   end subroutine predict_bodies

   !> Predict the bodies of the border. The message does not need their vertices and boxes. These are updated later
   !> together with those of the bodies around them, since bodies of the border lie scattered in memory.
   subroutine predict_border(self)
      type(simulation_t), intent(inout) :: self
      integer(ip) :: low, n

      n = size(self%domain%halo%border, kind=ip)
      !$omp parallel do if (number_of_parts(n) > 1) schedule(static) default(none) shared(self, n) private(low)
      do low = 1_ip, n, block_size
         call predict_list(self, self%domain%halo%border(low:min(low + block_size - 1_ip, n)))
      end do
      !$omp end parallel do
   end subroutine predict_border

   !> Predict all free bodies that are not in the border, and turn the vertices and update the boxes of all free bodies.
   subroutine predict_and_bound(self, good, seconds)
      type(simulation_t), intent(inout) :: self
      !> Whether all bodies have valid poses
      logical, intent(out) :: good
      !> Time of the prediction, and of vertices and boxes, in the timed blocks [s]
      real(dp), intent(out) :: seconds(2)
      integer(ip) :: n, low, high
      integer :: n_parts, p
      logical :: has_left

      n = size(self%bodies%free, kind=ip)
      n_parts = number_of_parts(n)
      good = .true.
      has_left = .false.
      seconds = 0.0_dp
      !$omp parallel do if (n_parts > 1) schedule(static, 1) default(none) shared(self, n, n_parts, seconds) &
      !$omp    private(p, low, high) reduction(.and.:good) reduction(.or.:has_left)
      do p = 1, n_parts
         call part(n, n_parts, p, low, high)
         call predict_part(self, self%bodies%free(low:high), p == 1, good, has_left, seconds)
      end do
      !$omp end parallel do
      self%domain%has_left = self%domain%has_left .or. has_left
   end subroutine predict_and_bound

   !> Predict a part of the free bodies, turn their vertices and update their boxes, block by block.
   subroutine predict_part(self, slots, is_first, good, has_left, seconds)
      type(simulation_t), intent(inout) :: self
      !> Slots of the bodies, ascending
      integer(ip), intent(in), contiguous :: slots(:)
      !> Whether this is the part of the first thread, of which some blocks are timed
      logical, intent(in) :: is_first
      !> Becomes false if a body has an invalid pose
      logical, intent(inout) :: good
      !> Becomes true if a box leaves the zone of this rank and its padded box of the last redistribution
      logical, intent(inout) :: has_left
      !> Time of the prediction, and of vertices and boxes, in the timed blocks [s]
      real(dp), intent(inout) :: seconds(2)
      integer(ip) :: k
      real(dp) :: clock(3)
      logical :: valid, timed

      do k = 1_ip, size(slots, kind=ip), block_size
         timed = is_first .and. mod(k, timed_blocks*block_size) == 1_ip
         if (timed) clock(1) = wall_seconds()
         associate (block => slots(k:min(k + block_size - 1_ip, size(slots, kind=ip))))
            call predict_block(self, block, valid)
            if (timed) clock(2) = wall_seconds()
            if (valid) call bound(self, block, has_left)
         end associate
         good = good .and. valid
         if (.not. timed) cycle
         clock(3) = wall_seconds()
         seconds = seconds + (clock(2:3) - clock(1:2))
      end do
   end subroutine predict_part

   !> Predict those of up to `block_size` bodies that are not in the border, and check the poses of all of them.
   subroutine predict_block(self, slots, valid)
      type(simulation_t), intent(inout) :: self
      !> Slots of the bodies, ascending
      integer(ip), intent(in), contiguous :: slots(:)
      !> Whether all have valid poses
      logical, intent(out) :: valid
      integer(ip) :: n, next, first, last, others(block_size)

      if (allocated(self%domain%halo%border)) then
         call list_others(size(slots, kind=ip), slots, self%domain%halo%in_border, n, others)
         call predict_list(self, others(:n))
      else
         call predict_list(self, slots)
      end if
      valid = .true.
      next = 1_ip
      do while (next <= size(slots, kind=ip))
         call find_run(slots, size(slots, kind=ip), next, first, last)
         valid = valid .and. have_valid_poses(self%bodies, first, last)
      end do
   end subroutine predict_block

   !> Predict up to `block_size` bodies. Those that have coasted since the last step only drift.
   subroutine predict_list(self, slots)
      type(simulation_t), intent(inout) :: self
      !> Slots of the bodies, ascending
      integer(ip), intent(in), contiguous :: slots(:)
      integer(ip) :: n, next, first, last, others(block_size)

      if (.not. self%skips_coasting) then
         next = 1_ip
         do while (next <= size(slots, kind=ip))
            call find_run(slots, size(slots, kind=ip), next, first, last)
            call self%integrator%predict(self%dt, first, last, self%bodies)
         end do
         return
      end if
      call list_others(size(slots, kind=ip), slots, self%coasts, n, others)
      if (n < size(slots, kind=ip)) call drift_list(self, slots)
      next = 1_ip
      do while (next <= n)
         call find_run(others, n, next, first, last)
         call self%integrator%predict(self%dt, first, last, self%bodies)
         call find_coasting(self%guard, self%bodies, first, last, self%dt, self%coasts)
      end do
   end subroutine predict_list

   !> Move those of some bodies that have coasted since the last step.
   subroutine drift_list(self, slots)
      type(simulation_t), intent(inout) :: self
      !> Slots of the bodies, ascending
      integer(ip), intent(in), contiguous :: slots(:)
      integer(ip) :: next, first, last

      next = 1_ip
      do while (next <= size(slots, kind=ip))
         call find_run(slots, size(slots, kind=ip), next, first, last)
         associate (bodies => self%bodies)
            call drift(self%dt, last - first + 1_ip, self%coasts(first), bodies%velocity(1, first), &
                       bodies%angular_velocity(first), bodies%position(1, first), bodies%angle(first))
         end associate
      end do
   end subroutine drift_list

   !> Turn the vertices of up to `block_size` bodies as far as they are needed, and update their boxes.
   subroutine bound(self, slots, has_left)
      type(simulation_t), intent(inout) :: self
      !> Slots of the bodies, ascending
      integer(ip), intent(in), contiguous :: slots(:)
      !> Becomes true if a box leaves the zone of this rank and its padded box of the last redistribution
      logical, intent(inout) :: has_left

      if (self%is_dilute) then
         call bound_block(self%extreme_corners, self%maker, slots, self%neighbours%pairs%pairs_of, self%isa, &
                          self%bodies, self%boxes)
      else
         call turn_and_bound_block(self%maker, slots, self%isa, self%bodies, self%boxes)
      end if
      if (.not. allocated(self%domain%reference)) return
      has_left = has_left .or. .not. have_boxes_within(self%maker, slots, self%boxes, self%domain%rank_bounds%zone, &
                                                       self%domain%reference)
   end subroutine bound

   !> Move the bodies with prescribed motion to their poses at a given time.
   subroutine move_walls(self, time)
      type(simulation_t), intent(inout) :: self
      !> Simulated time [s]
      real(wp), intent(in) :: time
      integer :: k

      do k = 1, size(self%walls)
         call move_wall(self%walls(k), time, self%bodies)
      end do
   end subroutine move_walls

end module polydem_prediction
