!> Bodies in a periodic cell: which of them repeat, and how they return to the cell when they have left it.
!>
!> A fixed body that *spans* the cell, such as a straight floor, reaches beyond both of its borders. It does not repeat
!> along this axis, and vectors to it are as in the plane. A free body that has left the cell returns at the start of
!> the next step. Between two steps it may therefore be outside by the motion of one step.
!>
!> When the size of a cell changes, all places are stretched with it. Velocities are those relative to this motion. They
!> shrink as the size grows, so that the volume in phase space is constant (M. Parrinello & A. Rahman, J. Appl. Phys. 52
!> (1981) 7182): for a gas this is its work on the cell. A step first stretches, then moves: an error of first order
!> in the growth of one step, which does not accumulate.
module polydem_bodies_in_cell
   use polydem_bodies, only: bodies_t
   use polydem_cell, only: cell_t, grow_cell, shear_cell
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: set_cell, change_cell, find_periods, stretch_bodies, wrap_bodies, follow_shear, put_into_cell, &
             add_profile, path_of

contains

   !> Put bodies into a cell, without moving them. Nothing is allocated in the plane.
   pure subroutine set_cell(bodies, cell)
      type(bodies_t), intent(inout) :: bodies
      type(cell_t), intent(in) :: cell

      bodies%cell = cell
      if (cell%is_periodic .and. .not. allocated(bodies%image)) allocate (bodies%image(bodies%n, 2), source=0_ip)
      if (cell%is_sheared .and. .not. allocated(bodies%shear_offset)) &
         allocate (bodies%shear_offset(bodies%n), source=0.0_wp)
   end subroutine set_cell

   !> Change size and shear of the cell by a step.
   pure subroutine change_cell(dt, from, to, bodies)
      !> Time step [s]
      real(wp), intent(in) :: dt
      !> Simulated time at the start and at the end of the step [s]
      real(wp), intent(in) :: from, to
      !> Bodies; their cell and `inverse_period` change
      type(bodies_t), intent(inout) :: bodies
      integer(ip) :: s

      if (allocated(bodies%cell%load)) then
         call grow_cell(dt, bodies%cell)
         do s = 1_ip, bodies%n
            where (bodies%inverse_period(:, s) > 0.0_wp) bodies%inverse_period(:, s) = bodies%cell%inverse
         end do
      end if
      call shear_cell(bodies%cell, from, to)
   end subroutine change_cell

   !> Find out along which axes bodies repeat.
   pure subroutine find_periods(bodies)
      !> Bodies with turned vertices; `inverse_period` is set in a periodic cell
      type(bodies_t), intent(inout) :: bodies
      integer(ip) :: s

      if (.not. bodies%cell%is_periodic) return
      if (allocated(bodies%inverse_period)) deallocate (bodies%inverse_period)
      allocate (bodies%inverse_period(2, bodies%n))
      do s = 1_ip, bodies%n
         bodies%inverse_period(:, s) = bodies%cell%inverse
         if (.not. bodies%fixed(s)) cycle
         where (4.0_wp*reach_of(bodies, s) >= bodies%cell%size) bodies%inverse_period(:, s) = 0.0_wp
      end do
   end subroutine find_periods

   !> Greatest distance of a vertex of a body from its centre along each axis [m]
   pure function reach_of(bodies, s) result(reach)
      !> Bodies with turned vertices
      type(bodies_t), intent(in) :: bodies
      !> Slot of the body
      integer(ip), intent(in) :: s
      real(wp) :: reach(2)

      reach = maxval(abs(bodies%pieces%turned_polygon(s)), 2)
   end function reach_of

   !> Place of a body on its path through the copies of the cell, (2) [m]; its position in the plane
   pure function path_of(bodies, s) result(place)
      type(bodies_t), intent(in) :: bodies
      !> Slot of the body
      integer(ip), intent(in) :: s
      real(wp) :: place(2)

      place = bodies%position(:, s)
      if (allocated(bodies%image)) place = place + real(bodies%image(s, :), wp)*bodies%cell%size
      if (allocated(bodies%shear_offset)) place(1) = place(1) + bodies%shear_offset(s)
   end function path_of

   !> Stretch the places of some free bodies as the cell grows in this step. Several threads may call it for different
   !> bodies.
   pure subroutine stretch_bodies(bodies, slots)
      !> Bodies in a stress-controlled cell, at the start of a step; `position` and `velocity` change
      type(bodies_t), intent(inout) :: bodies
      !> Slots of the bodies
      integer(ip), intent(in), contiguous :: slots(:)
      integer(ip) :: k

      associate (load => bodies%cell%load)
         do k = 1_ip, size(slots, kind=ip)
            associate (s => slots(k))
               bodies%position(:, s) = load%centre + load%stretch*(bodies%position(:, s) - load%centre)
               bodies%velocity(:, s) = bodies%velocity(:, s)/load%stretch
            end associate
         end do
      end associate
   end subroutine stretch_bodies

   !> Let some free bodies keep their velocity relative to a shear that changes in this step. Several threads may call
   !> it for different bodies.
   pure subroutine follow_shear(bodies, slots)
      !> Bodies in the cell at the start of a step; `position` and `velocity` change along x
      type(bodies_t), intent(inout) :: bodies
      !> Slots of the bodies
      integer(ip), intent(in), contiguous :: slots(:)
      real(wp) :: height
      integer(ip) :: k

      associate (cell => bodies%cell)
         do k = 1_ip, size(slots, kind=ip)
            associate (s => slots(k))
               height = bodies%position(2, s) - (cell%low(2) + 0.5_wp*cell%size(2))
               bodies%position(1, s) = bodies%position(1, s) + cell%lag*height
               bodies%velocity(1, s) = bodies%velocity(1, s) + cell%kick*height
            end associate
         end do
      end associate
   end subroutine follow_shear

   !> Return those of some free bodies to the cell that have left it. Several threads may call it for different bodies.
   pure subroutine wrap_bodies(bodies, slots)
      !> Bodies at the end of a step; `position` and `image` change, in a sheared cell also `velocity` and
      !> `shear_offset`
      type(bodies_t), intent(inout) :: bodies
      !> Slots of the bodies
      integer(ip), intent(in), contiguous :: slots(:)
      integer(ip) :: k, crossed
      integer :: axis

      ! The border that is crossed along y decides on the place along x.
      do axis = 2, 1, -1
         associate (low => bodies%cell%low(axis), side => bodies%cell%size(axis))
            if (.not. side > 0.0_wp) cycle
            do k = 1_ip, size(slots, kind=ip)
               associate (x => bodies%position(axis, slots(k)), image => bodies%image(slots(k), axis))
                  crossed = merge(1_ip, 0_ip, x >= low + side) - merge(1_ip, 0_ip, x < low)
                  x = x - real(crossed, wp)*side
                  image = image + crossed
                  if (crossed /= 0_ip .and. axis == 2 .and. bodies%cell%is_sheared) &
                     call cross_sheared_border(bodies, slots(k), crossed)
               end associate
            end do
         end associate
      end do
   end subroutine wrap_bodies

   !> Move a body that crosses the upper or lower border of a sheared cell to the place and velocity of its copy: those
   !> at the start of the step.
   pure subroutine cross_sheared_border(bodies, s, crossed)
      type(bodies_t), intent(inout) :: bodies
      !> Slot of the body
      integer(ip), intent(in) :: s
      !> Number of cells by which it goes up, at most one within a step
      integer(ip), intent(in) :: crossed

      associate (cell => bodies%cell, times => real(crossed, wp))
         bodies%position(1, s) = bodies%position(1, s) - times*cell%former_shift
         bodies%velocity(1, s) = bodies%velocity(1, s) - times*cell%former_jump
         if (allocated(bodies%shear_offset)) bodies%shear_offset(s) = bodies%shear_offset(s) + times*cell%former_shift
      end associate
   end subroutine cross_sheared_border

   !> Put bodies that may be anywhere into the cell. Those that span it stay where they are.
   pure subroutine put_into_cell(bodies, slots)
      !> Bodies after `find_periods`; `position` and `image` change, in a sheared cell also `velocity` and
      !> `shear_offset`
      type(bodies_t), intent(inout) :: bodies
      !> Slots of the bodies
      integer(ip), intent(in) :: slots(:)
      integer(ip) :: k, crossed
      integer :: axis

      do k = 1_ip, size(slots, kind=ip)
         associate (s => slots(k), cell => bodies%cell)
            do axis = 2, 1, -1
               crossed = floor((bodies%position(axis, s) - cell%low(axis))*bodies%inverse_period(axis, s), ip)
               bodies%position(axis, s) = bodies%position(axis, s) - real(crossed, wp)*cell%size(axis)
               bodies%image(s, axis) = bodies%image(s, axis) + crossed
               if (crossed /= 0_ip .and. axis == 2) call cross_sheared_border(bodies, s, crossed)
            end do
         end associate
      end do
   end subroutine put_into_cell

   !> Give bodies the velocity of a shear at their height.
   pure subroutine add_profile(bodies, rate, slots)
      !> Bodies in the cell; `velocity` changes
      type(bodies_t), intent(inout) :: bodies
      !> Rate of the shear [1/s]
      real(wp), intent(in) :: rate
      !> Slots of the bodies
      integer(ip), intent(in) :: slots(:)
      integer(ip) :: k

      do k = 1_ip, size(slots, kind=ip)
         associate (s => slots(k), cell => bodies%cell)
            bodies%velocity(1, s) = bodies%velocity(1, s) + rate* &
               (bodies%position(2, s) - (cell%low(2) + 0.5_wp*cell%size(2)))
         end associate
      end do
   end subroutine add_profile

end module polydem_bodies_in_cell
