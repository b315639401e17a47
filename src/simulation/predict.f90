!> The first pass of a step over the bodies: prediction before the forces are computed.
!>
!> The pass does all that it can do for a block of bodies while the block is in the cache.
module polydem_predict
   use polydem_bodies, only: block_size, bodies_t
   use polydem_body_runs, only: find_run, list_others, number_of_parts
   use polydem_bodies_in_cell, only: put_into_cell, wrap_bodies
   use polydem_boxes_within, only: have_boxes_within
   use polydem_energy_balance, only: energy_balance_t
   use polydem_errors, only: error_t
   use polydem_motion_check, only: check_poses, have_valid_poses
   use polydem_kinds, only: ip, wp
   use polydem_named_walls, only: named_walls_t
   use polydem_simulation, only: simulation_t, time_of
   use polydem_thread_changes, only: part
   use polydem_timers, only: block_clock_t
   use polydem_wall, only: move_wall, wall_t
   use polydem_wall_load, only: carry_walls, correct_loads, predict_loads, wall_load_t
   implicit none
   private
   public :: predict_border, predict_bodies, move_walls, yield_walls

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

      call self%flight%begin_step(self%neighbours%pairs, self%bodies%n)
      call predict_and_bound(self, good, has_left, clock)
      if (allocated(self%loads)) call predict_loads(self%dt, self%loads)
      call move_walls(self%walls, self%named, time_of(self), self%bodies, self%loads)
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
            call self%flight%predict(self%integrator, self%motion_check, self%dt, block, self%bodies)
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
            call predict_block(self, block, valid)
            call own_clock%end_part(1)
            if (valid) call bound_block(self, block, has_left)
            call own_clock%end_part(2)
         end associate
         good = good .and. valid
      end do
      if (is_first) clock = own_clock
   end subroutine predict_part

   !> Predict those of up to `block_size` bodies that are not in the border, and check the poses of all of them.
   subroutine predict_block(self, slots, valid)
      type(simulation_t), intent(inout) :: self
      !> Slots of the bodies, ascending
      integer(ip), intent(in), contiguous :: slots(:)
      !> Whether all have valid poses
      logical, intent(out) :: valid
      integer(ip) :: n, next, first, last, others(block_size)

      if (self%domain%has_halo()) then
         call list_others(size(slots, kind=ip), slots, self%domain%halo%in_border, n, others)
         if (self%bodies%cell%is_periodic) &
            call return_to_cell(self%dt, others(:n), self%bodies, self%energy_balance)
         call self%flight%predict(self%integrator, self%motion_check, self%dt, others(:n), self%bodies)
      else
         if (self%bodies%cell%is_periodic) &
            call return_to_cell(self%dt, slots, self%bodies, self%energy_balance)
         call self%flight%predict(self%integrator, self%motion_check, self%dt, slots, self%bodies)
      end if
      valid = .true.
      next = 1_ip
      do while (next <= size(slots, kind=ip))
         call find_run(slots, size(slots, kind=ip), next, first, last)
         valid = valid .and. have_valid_poses(self%bodies, first, last)
      end do
   end subroutine predict_block

   !> Return those of up to `block_size` bodies to the cell that have left it. What a sheared border changes of their
   !> momentum and kinetic energy is the work of the border, and counts as that of a wall.
   subroutine return_to_cell(dt, slots, bodies, balance)
      !> Time step [s]
      real(wp), intent(in) :: dt
      !> Slots of the bodies, ascending
      integer(ip), intent(in), contiguous :: slots(:)
      type(bodies_t), intent(inout) :: bodies
      !> Balance of energy; not started if the run computes none
      type(energy_balance_t), intent(inout) :: balance
      real(wp) :: former(block_size), change
      integer(ip) :: k

      if (bodies%cell%is_sheared) former(:size(slots)) = bodies%velocity(1, slots)
      call wrap_bodies(bodies, slots)
      if (.not. (bodies%cell%is_sheared .and. allocated(balance%wall_sum))) return
      do k = 1_ip, size(slots, kind=ip)
         associate (m => bodies%mass(slots(k)), v => bodies%velocity(1, slots(k)), &
                    wall_sum => balance%wall_sum(:, slots(k)))
            change = v - former(k)
            if (.not. abs(change) > 0.0_wp) cycle
            wall_sum(1) = wall_sum(1) + 0.5_wp*m*change*(v + former(k))/dt
            wall_sum(2) = wall_sum(2) + m*change/dt
            wall_sum(5) = wall_sum(5) + abs(m*change)/dt
         end associate
      end do
   end subroutine return_to_cell

   !> Turn the vertices of up to `block_size` bodies as far as they are needed, and update their boxes.
   subroutine bound_block(self, slots, has_left)
      type(simulation_t), intent(inout) :: self
      !> Slots of the bodies, ascending
      integer(ip), intent(in), contiguous :: slots(:)
      !> Becomes true if a box leaves the zone of this rank and its padded box of the last redistribution
      logical, intent(inout) :: has_left

      call self%flight%bound(self%maker, slots, self%neighbours%pairs, self%bodies, self%boxes)
      if (.not. allocated(self%domain%reference)) return
      has_left = has_left .or. .not. have_boxes_within(self%maker, slots, self%boxes, self%domain%rank_bounds%zone, &
                                                       self%domain%reference)
   end subroutine bound_block

   !> Move the bodies with prescribed motion to their poses at a given time, and displace them by loads.
   subroutine move_walls(walls, named, time, bodies, loads)
      !> Fixed bodies with prescribed motions or loads
      type(wall_t), intent(in) :: walls(:)
      !> Walls by name
      type(named_walls_t), intent(in) :: named
      !> Simulated time [s]
      real(wp), intent(in) :: time
      type(bodies_t), intent(inout) :: bodies
      !> Loads on named walls; absent or not allocated: none
      type(wall_load_t), intent(in), optional :: loads(:)
      integer :: k

      do k = 1, size(walls)
         call move_wall(walls(k), time, bodies)
         if (bodies%cell%is_periodic) call put_into_cell(bodies, walls(k)%slots)
      end do
      if (present(loads)) call carry_walls(loads, named, bodies)
   end subroutine move_walls

   !> Find the velocities of the walls that yield to loads from the contacts. Their places do not change. Collective.
   subroutine yield_walls(self, dt)
      !> The simulation with loads, and with the contacts of this step
      type(simulation_t), intent(inout) :: self
      !> Time step; 0 at the start [s]
      real(wp), intent(in) :: dt

      call correct_loads(self%loads, self%comm, dt, time_of(self), self%named, self%bodies, self%loop%walls)
      call move_walls(self%walls, self%named, time_of(self), self%bodies, self%loads)
   end subroutine yield_walls

end module polydem_predict
