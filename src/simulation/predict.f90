!> The first pass of a step over the bodies: prediction before the forces are computed.
!>
!> The pass does all that it can do for a block of bodies while the block is in the cache.
module polydem_predict
   use polydem_bodies, only: block_size, bodies_t
   use polydem_body_motion, only: body_motion_t
   use polydem_body_runs, only: find_run, list_others, number_of_parts
   use polydem_bodies_in_cell, only: follow_shear, stretch_bodies, wrap_bodies
   use polydem_boxes_within, only: have_boxes_within
   use polydem_domain, only: domain_t
   use polydem_energy_balance, only: energy_balance_t
   use polydem_errors, only: error_t
   use polydem_free_flight, only: free_flight_t
   use polydem_kinds, only: ip, wp
   use polydem_motion_tests, only: check_poses, have_valid_poses
   use polydem_neighbour_search, only: neighbour_search_t
   use polydem_simulation, only: simulation_t, time_of
   use polydem_thread_changes, only: part
   use polydem_timers, only: block_clock_t
   implicit none
   private
   public :: predict_border, predict_bodies

contains

   !> Predict the free bodies at the end of the step, turn their vertices and update their boxes, in one pass over the
   !> bodies. Move those with prescribed motion, and check all poses. Bodies of the border are predicted already.
   subroutine predict_bodies(self, has_left, clock, error)
      !> The simulation at the start of a step
      type(simulation_t), intent(inout) :: self
      !> Whether a box has left the zone of this rank and its padded box of the last redistribution
      logical, intent(out) :: has_left
      !> Clock of the blocks of the first thread: prediction, then vertices and boxes
      type(block_clock_t), intent(out) :: clock
      !> Names a body with an invalid pose
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: k
      logical :: good

      call self%motion%flight%begin_step(self%search%neighbours%pairs, self%bodies%n)
      call predict_and_bound(self, good, has_left, clock)
      call self%walls%predict(self%dt, time_of(self), self%bodies)
      do k = size(self%bodies%free, kind=ip) + 1_ip, self%n_moving
         good = good .and. have_valid_poses(self%bodies, self%moving(k), self%moving(k))
      end do
      if (.not. good) call check_poses(self%bodies, self%moving(:self%n_moving), self%step, error)
   end subroutine predict_bodies

   !> Predict the bodies of the border, which other ranks wait for. The message does not need their vertices and boxes.
   !> These are updated later together with those of the bodies around them, since bodies of the border lie scattered in
   !> memory.
   subroutine predict_border(self)
      !> The simulation at the start of a step
      type(simulation_t), intent(inout) :: self
      integer(ip) :: low, n

      n = size(self%domain%halo%border, kind=ip)
      !$omp parallel do if (number_of_parts(n) > 1) schedule(static) default(none) shared(self, n) private(low)
      do low = 1_ip, n, block_size
         associate (block => self%domain%halo%border(low:min(low + block_size - 1_ip, n)))
            if (self%bodies%cell%is_periodic) call return_to_cell(self%dt, block, self%bodies, self%energy_balance)
            call self%motion%predict(self%dt, block, self%bodies)
         end associate
      end do
      !$omp end parallel do
   end subroutine predict_border

   !> Predict all free bodies that are not in the border, and turn the vertices and update the boxes of all free bodies.
   subroutine predict_and_bound(self, good, has_left, clock)
      type(simulation_t), intent(inout) :: self
      !> Whether all bodies have valid poses
      logical, intent(out) :: good
      !> Whether a box leaves the zone of this rank and its padded box of the last redistribution
      logical, intent(out) :: has_left
      !> Clock of the blocks of the first thread
      type(block_clock_t), intent(inout) :: clock
      integer(ip) :: n, low, high
      integer :: n_parts, p

      n = size(self%bodies%free, kind=ip)
      n_parts = number_of_parts(n)
      good = .true.
      has_left = .false.
      !$omp parallel do if (n_parts > 1) schedule(static, 1) default(none) shared(self, n, n_parts, clock) &
      !$omp    private(p, low, high) reduction(.and.:good) reduction(.or.:has_left)
      do p = 1, n_parts
         call part(n, n_parts, p, low, high)
         call predict_part(self, self%bodies%free(low:high), p == 1, good, has_left, clock)
      end do
      !$omp end parallel do
   end subroutine predict_and_bound

   !> Predict a part of the free bodies, turn their vertices and update their boxes, block by block.
   subroutine predict_part(self, slots, is_first, good, has_left, clock)
      type(simulation_t), intent(inout) :: self
      !> Slots of the bodies, ascending
      integer(ip), intent(in), contiguous :: slots(:)
      !> Whether this is the part of the first thread
      logical, intent(in) :: is_first
      !> Becomes false if a body has an invalid pose
      logical, intent(inout) :: good
      !> Becomes true if a box leaves the zone of this rank and its padded box of the last redistribution
      logical, intent(inout) :: has_left
      !> Clock of the blocks of the first thread
      type(block_clock_t), intent(inout) :: clock
      type(block_clock_t) :: own_clock
      integer(ip) :: k
      logical :: valid

      do k = 1_ip, size(slots, kind=ip), block_size
         call own_clock%begin_block()
         associate (block => slots(k:min(k + block_size - 1_ip, size(slots, kind=ip))))
            call predict_block(self%dt, self%domain, block, self%motion, self%bodies, self%energy_balance, valid)
            call own_clock%end_part(1)
            if (valid) call bound_block(block, self%domain, self%motion%flight, self%search, self%bodies, has_left)
            call own_clock%end_part(2)
         end associate
         good = good .and. valid
      end do
      if (is_first) clock = own_clock
   end subroutine predict_part

   !> Predict those of up to `block_size` bodies that are not in the border, and check the poses of all of them.
   subroutine predict_block(dt, domain, slots, motion, bodies, balance, valid)
      !> Time step [s]
      real(wp), intent(in) :: dt
      type(domain_t), intent(in) :: domain
      !> Slots of the bodies, ascending
      integer(ip), intent(in), contiguous :: slots(:)
      type(body_motion_t), intent(inout) :: motion
      type(bodies_t), intent(inout) :: bodies
      !> Balance of energy; not started if the run computes none
      type(energy_balance_t), intent(inout) :: balance
      !> Whether all have valid poses
      logical, intent(out) :: valid
      integer(ip) :: n, next, first, last, others(block_size)

      if (domain%has_halo()) then
         call list_others(size(slots, kind=ip), slots, domain%halo%in_border, n, others)
         if (bodies%cell%is_periodic) call return_to_cell(dt, others(:n), bodies, balance)
         call motion%predict(dt, others(:n), bodies)
      else
         if (bodies%cell%is_periodic) call return_to_cell(dt, slots, bodies, balance)
         call motion%predict(dt, slots, bodies)
      end if
      valid = .true.
      next = 1_ip
      do while (next <= size(slots, kind=ip))
         call find_run(slots, size(slots, kind=ip), next, first, last)
         valid = valid .and. have_valid_poses(bodies, first, last)
      end do
   end subroutine predict_block

   !> Return those of up to `block_size` bodies to the cell that have left it, and stretch their places with a
   !> stress-controlled cell, and let them follow a shear that changes. What this changes of their momentum and kinetic
   !> energy is the work of the cell, and counts as that of a wall.
   subroutine return_to_cell(dt, slots, bodies, balance)
      !> Time step [s]
      real(wp), intent(in) :: dt
      !> Slots of the bodies, ascending
      integer(ip), intent(in), contiguous :: slots(:)
      type(bodies_t), intent(inout) :: bodies
      !> Balance of energy; not started if the run computes none
      type(energy_balance_t), intent(inout) :: balance
      real(wp) :: former(2, block_size), change(2)
      integer(ip) :: k
      logical :: changes

      changes = bodies%cell%is_sheared .or. allocated(bodies%cell%load)
      if (changes) former(:, :size(slots)) = bodies%velocity(:, slots)
      if (allocated(bodies%cell%load)) call stretch_bodies(bodies, slots)
      call wrap_bodies(bodies, slots)
      if (abs(bodies%cell%kick) > 0.0_wp) call follow_shear(bodies, slots)
      if (.not. (changes .and. allocated(balance%wall_sum))) return
      do k = 1_ip, size(slots, kind=ip)
         associate (m => bodies%mass(slots(k)), v => bodies%velocity(:, slots(k)), &
                    wall_sum => balance%wall_sum(:, slots(k)))
            change = v - former(:, k)
            if (.not. any(abs(change) > 0.0_wp)) cycle
            wall_sum(1) = wall_sum(1) + (0.5_wp*m*change(1)*(v(1) + former(1, k)) &
                                         + 0.5_wp*m*change(2)*(v(2) + former(2, k)))/dt
            wall_sum(2:3) = wall_sum(2:3) + m*change/dt
            wall_sum(5) = wall_sum(5) + (abs(m*change(1)) + abs(m*change(2)))/dt
         end associate
      end do
   end subroutine return_to_cell

   !> Turn the vertices of up to `block_size` bodies as far as they are needed, and update their boxes.
   subroutine bound_block(slots, domain, flight, search, bodies, has_left)
      !> Slots of the bodies, ascending
      integer(ip), intent(in), contiguous :: slots(:)
      type(domain_t), intent(in) :: domain
      type(free_flight_t), intent(inout) :: flight
      !> Search; only the bounds of the boxes change
      type(neighbour_search_t), intent(inout) :: search
      !> Bodies; only `turned` changes
      type(bodies_t), intent(inout) :: bodies
      !> Becomes true if a box leaves the zone of this rank and its padded box of the last redistribution
      logical, intent(inout) :: has_left

      call flight%bound(slots, search, bodies)
      if (.not. allocated(domain%reference)) return
      has_left = has_left .or. .not. have_boxes_within(search%maker, slots, search%boxes, domain%rank_bounds%zone, &
                                                       domain%reference)
   end subroutine bound_block

end module polydem_predict
