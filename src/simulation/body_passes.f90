!> The two passes of a step over the bodies: prediction before the forces are computed, completion after it.
!>
!> Each pass does all that it can do for a block of bodies while the block is in the cache.
module polydem_body_passes
   use omp_lib, only: omp_get_max_threads
   use polydem_bodies, only: block_size, bodies_t
   use polydem_box_maker, only: have_boxes_within, turn_and_bound_block
   use polydem_clock, only: wall_seconds
   use polydem_energy_balance, only: accumulate_bodies, accumulate_walls, count_step
   use polydem_errors, only: error_t
   use polydem_extreme_corners, only: bound_block
   use polydem_force_sums, only: find_forces, force_sums_t, set_force, total_forces
   use polydem_guards, only: check_motion, check_poses, find_coasting, have_valid_poses, move_within_limit
   use polydem_integrator, only: drift
   use polydem_kinds, only: dp, ip, wp, min_parallel_size
   use polydem_prescribed_motion, only: move_bodies
   use polydem_simulation, only: simulation_t, time_of
   use polydem_thread_changes, only: part
   use polydem_timers, only: stage_decomposition, stage_integrate
   implicit none
   private
   public :: predict_bodies, complete_step, keep_forces, move_walls

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

   !> Predict the bodies of the border. They lie scattered: what they need not for the message, they get together with
   !> the bodies around them.
   subroutine predict_border(self)
      type(simulation_t), intent(inout) :: self
      integer(ip) :: low, n

      n = size(self%domain%halo%border, kind=ip)
      !$omp parallel do num_threads(number_of_parts(n)) schedule(static) default(none) shared(self, n) private(low)
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
      !$omp parallel do num_threads(n_parts) schedule(static, 1) default(none) shared(self, n, n_parts, seconds) &
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

   !> List those of some slots that are not excluded.
   pure subroutine list_others(n, slots, excluded, n_others, others)
      !> Number of slots
      integer(ip), intent(in) :: n
      !> The slots
      integer(ip), intent(in) :: slots(n)
      !> Whether each body is excluded, (slot)
      logical, intent(in), contiguous :: excluded(:)
      !> Number and slots of the others
      integer(ip), intent(out) :: n_others
      integer(ip), intent(inout) :: others(block_size)
      integer(ip) :: k

      n_others = 0_ip
      do k = 1_ip, n
         if (excluded(slots(k))) cycle
         n_others = n_others + 1_ip
         others(n_others) = slots(k)
      end do
   end subroutine list_others

   !> Number of parts of the free bodies, one per thread; a single part if they are few
   integer function number_of_parts(n)
      !> Number of free bodies
      integer(ip), intent(in) :: n

      number_of_parts = 1
      if (n > min_parallel_size) number_of_parts = omp_get_max_threads()
   end function number_of_parts

   !> Complete the step from the sums of the contact forces: total forces, final velocities, energy balance, and the
   !> guard of the motion, in one pass over the bodies. Of the total forces, only those on fixed bodies are kept.
   subroutine complete_step(self, error)
      !> The simulation with the sums of the contact forces
      type(simulation_t), intent(inout) :: self
      !> Names a body that moves too far
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: n, low, high, k, done
      integer :: n_parts, p
      logical :: good

      n = size(self%bodies%free, kind=ip)
      n_parts = number_of_parts(n)
      good = .true.
      !$omp parallel do num_threads(n_parts) schedule(static, 1) default(none) shared(self, n, n_parts) &
      !$omp    private(p, low, high) reduction(.and.:good)
      do p = 1, n_parts
         call part(n, n_parts, p, low, high)
         call complete_part(self, low, high, good)
      end do
      !$omp end parallel do
      done = 0_ip
      if (n > 0_ip) done = self%bodies%free(n)
      call keep_fixed(done + 1_ip, self%bodies%n, self%force_sums, self%bodies)
      if (self%settings%output%energy_balance) call count_step(self%energy_balance)
      do k = n + 1_ip, size(self%guard%moving, kind=ip)
         good = good .and. move_within_limit(self%guard, self%bodies, self%guard%moving(k), self%guard%moving(k), &
                                             self%dt)
      end do
      if (.not. good) call check_motion(self%guard, self%bodies, self%step, self%dt, error)
   end subroutine complete_step

   !> Complete the step of a part of the free bodies, block by block, and keep the forces on fixed bodies between them.
   subroutine complete_part(self, low, high, good)
      type(simulation_t), intent(inout) :: self
      !> Index of the first and of the last body in the list of free bodies
      integer(ip), intent(in) :: low, high
      !> Becomes false if a body moves too far
      logical, intent(inout) :: good
      integer(ip) :: k, end_of_block, next, done, first, last, n_chosen, chosen(block_size)

      if (high < low) return
      do k = low, high, block_size
         end_of_block = min(k + block_size - 1_ip, high)
         done = 0_ip
         if (k > 1_ip) done = self%bodies%free(k - 1_ip)
         next = k
         do while (next <= end_of_block)
            call find_run(self%bodies%free, end_of_block, next, first, last)
            call keep_fixed(done + 1_ip, first - 1_ip, self%force_sums, self%bodies)
            done = last
            if (.not. self%skips_coasting) call complete_run(self, first, last, good)
         end do
         if (.not. self%skips_coasting) cycle
         call choose_accelerated(end_of_block - k + 1_ip, self%bodies%free(k:end_of_block), self%coasts, &
                                 self%force_sums%has_terms, n_chosen, chosen)
         next = 1_ip
         do while (next <= n_chosen)
            call find_run(chosen, n_chosen, next, first, last)
            call complete_run(self, first, last, good)
            self%coasts(first:last) = .false.
         end do
      end do
      if (low > high .or. .not. self%settings%output%energy_balance) return
      call accumulate_walls(self%energy_balance, self%bodies, self%walk%walls, self%bodies%free(low), &
                            self%bodies%free(high))
   end subroutine complete_part

   !> Set the total forces on those bodies of a run that are fixed. The run has no free bodies of this rank.
   pure subroutine keep_fixed(first, last, sums, bodies)
      !> First and last slot
      integer(ip), intent(in) :: first, last
      !> Sums of the contact forces
      type(force_sums_t), intent(in) :: sums
      !> Bodies; `force` and `torque` of the fixed ones are set
      type(bodies_t), intent(inout) :: bodies
      integer(ip) :: s

      do s = first, last
         if (bodies%fixed(s)) call set_force(sums%value(:, s), s, bodies)
      end do
   end subroutine keep_fixed

   !> List the bodies that do not coast.
   pure subroutine choose_accelerated(n, slots, coasts, has_terms, n_chosen, chosen)
      !> Number of bodies
      integer(ip), intent(in) :: n
      !> Their slots
      integer(ip), intent(in) :: slots(n)
      !> Whether a body coasts unless a force acts on it, and whether one does, (slot)
      logical, intent(in), contiguous :: coasts(:), has_terms(:)
      !> Number and slots of the bodies that do not coast
      integer(ip), intent(out) :: n_chosen
      integer(ip), intent(inout) :: chosen(block_size)
      integer(ip) :: k

      n_chosen = 0_ip
      do k = 1_ip, n
         if (coasts(slots(k)) .and. .not. has_terms(slots(k))) cycle
         n_chosen = n_chosen + 1_ip
         chosen(n_chosen) = slots(k)
      end do
   end subroutine choose_accelerated

   !> Compute final velocities of a run of free bodies, accumulate their energy balance, and check their motion.
   subroutine complete_run(self, first, last, good)
      type(simulation_t), intent(inout) :: self
      !> First and last slot, at most `block_size` bodies
      integer(ip), intent(in) :: first, last
      !> Becomes false if a body moves too far
      logical, intent(inout) :: good
      real(wp) :: force(3, block_size)

      associate (bodies => self%bodies, gravity => self%settings%forces%gravity, sums => self%force_sums)
         call find_forces(gravity, first, last, bodies%mass, sums%value, sums%has_terms, force)
         call self%integrator%correct(self%dt, first, last, force, bodies)
         if (self%settings%output%energy_balance) &
            call accumulate_bodies(self%energy_balance, 1.0_wp, gravity, bodies, sums, first, last)
      end associate
      good = good .and. move_within_limit(self%guard, self%bodies, first, last, self%dt)
   end subroutine complete_run

   !> Set the total forces on all bodies at the end of a step, if only those on fixed bodies are known.
   subroutine keep_forces(self)
      type(simulation_t), intent(inout) :: self

      if (.not. self%has_forces) call total_forces(self%settings%forces%gravity, self%force_sums, 1_ip, &
                                                   self%bodies%n, self%bodies)
      self%has_forces = .true.
   end subroutine keep_forces

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
