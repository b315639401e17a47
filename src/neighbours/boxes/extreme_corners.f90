!> Boxes of bodies without pairs from their extreme corners: the four corners that bound the box of a body.
!>
!> While a body turns within a certain range of angles, its extreme corners are the same. Its other vertices are then
!> neither read nor turned: in a large dilute scene, they would take most of the memory that a step reads and writes.
!> Beyond the range, the extreme corners are found by walking along the outline. Bodies are convex, so a corner is
!> extreme if it is so compared with its two neighbours. `clean_polygon` leaves no corner that is closer to the line of
!> its neighbours than 1e-9 of the size, which is far above all rounding errors here.
module polydem_extreme_corners
   use polydem_bodies, only: block_size, bodies_t, find_directions
   use polydem_box_maker, only: box_maker_t, place_boxes, place_in_cell, turn_and_bound_block, turn_and_bound_in_cell
   use polydem_boxes, only: boxes_t
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: extreme_corners_t, forget_corners, bound_block

   !> Allowance for rounding, in units of epsilon times the radius of a body
   real(wp), parameter :: roundings = 64.0_wp

   !> Extreme corners of a body; none are known at first
   type :: known_corners_t
      !> Least and greatest angle at which they are known [rad]
      real(wp) :: from = huge(1.0_wp), to = -huge(1.0_wp)
      !> Corners with the least x and y and the greatest x and y, in the body frame, (2, 4) [m]
      real(wp) :: corner(2, 4)
   end type known_corners_t

   !> Extreme corners of all bodies
   type :: extreme_corners_t
      private
      !> What is known of each body, (slot)
      type(known_corners_t), allocatable :: known(:)
      !> Index of each extreme corner among those of the body when last found, 0 if never, (4, slot)
      integer(ip), allocatable :: place(:, :)
   end type extreme_corners_t

contains

   !> Start with nothing known.
   subroutine forget_corners(self, n)
      type(extreme_corners_t), intent(out) :: self
      !> Number of bodies
      integer(ip), intent(in) :: n

      allocate (self%known(n))
      allocate (self%place(4, n), source=0_ip)
   end subroutine forget_corners

   !> Update the boxes of up to `block_size` bodies to their poses, and turn those that have pairs. Turned vertices of
   !> the others may not be up to date afterwards. Several threads may call it for different bodies.
   subroutine bound_block(self, maker, slots, pairs_of, bodies, boxes)
      !> Extreme corners; those of these bodies may change
      type(extreme_corners_t), intent(inout) :: self
      type(box_maker_t), intent(in) :: maker
      !> Slots of the bodies
      integer(ip), intent(in), contiguous :: slots(:)
      !> Number of pairs of each body, (slot)
      integer(ip), intent(in), contiguous :: pairs_of(:)
      !> Bodies; only `turned` changes
      type(bodies_t), intent(inout) :: bodies
      !> Boxes; only `bounds` changes
      type(boxes_t), intent(inout) :: boxes
      integer(ip) :: single(block_size), others(block_size), k, n, n_single, n_others, n_known
      real(wp) :: direction(2, block_size), extent(4, block_size)

      n = size(slots, kind=ip)
      call divide_by_pairs(n, slots, pairs_of, single, n_single, others, n_others)
      call find_directions(bodies, single(:n_single), direction)
      n_known = 0_ip
      do k = 1_ip, n_single
         associate (s => single(k))
            if (.not. is_known(self%known(s), bodies%angle(s))) &
               call update_corners(bodies, s, direction(:, k), self%place(:, s), self%known(s))
            if (.not. is_known(self%known(s), bodies%angle(s))) then
               n_others = n_others + 1_ip
               others(n_others) = s
               cycle
            end if
         end associate
         n_known = n_known + 1_ip
         single(n_known) = single(k)
         direction(:, n_known) = direction(:, k)
         extent(:, n_known) = extent_of(self%known(single(k))%corner, direction(:, k))
      end do
      if (bodies%cell%is_periodic) then
         call place_in_cell(maker, single(:n_known), extent, direction, bodies, boxes)
      else
         call place_boxes(maker, single(:n_known), extent, direction, bodies, boxes)
      end if
      if (n_others == 0_ip) return
      if (bodies%cell%is_periodic) then
         call turn_and_bound_in_cell(maker, others(:n_others), bodies, boxes)
      else
         call turn_and_bound_block(maker, others(:n_others), bodies, boxes)
      end if
   end subroutine bound_block

   !> Divide bodies into those without pairs and the others. Which are which, a processor cannot predict; there is no
   !> branch.
   pure subroutine divide_by_pairs(n, slots, pairs_of, single, n_single, others, n_others)
      !> Number of bodies
      integer(ip), intent(in) :: n
      !> Their slots
      integer(ip), intent(in) :: slots(n)
      !> Number of pairs of each body, (slot)
      integer(ip), intent(in), contiguous :: pairs_of(:)
      !> Slots of either kind, and their numbers
      integer(ip), intent(inout) :: single(n), others(n)
      integer(ip), intent(out) :: n_single, n_others
      integer(ip) :: k

      n_single = 0_ip
      do k = 1_ip, n
         single(n_single + 1_ip) = slots(k)
         others(k - n_single) = slots(k)
         n_single = n_single + merge(1_ip, 0_ip, pairs_of(slots(k)) == 0_ip)
      end do
      n_others = n - n_single
   end subroutine divide_by_pairs

   !> Whether the extreme corners of a body are known at an angle
   pure logical function is_known(known, angle)
      type(known_corners_t), intent(in) :: known
      !> The angle [rad]
      real(wp), intent(in) :: angle

      is_known = angle >= known%from .and. angle <= known%to
   end function is_known

   !> Extent of the turned vertices of a body from its extreme corners: least x and y and greatest x and y. The bits are
   !> those of turning all vertices [m]
   pure function extent_of(corner, direction) result(extent)
      !> Extreme corners in the body frame, (2, 4) [m]
      real(wp), intent(in) :: corner(2, 4)
      !> Cosine and sine of the angle
      real(wp), intent(in) :: direction(2)
      real(wp) :: extent(4)

      extent(1) = direction(1)*corner(1, 1) - direction(2)*corner(2, 1)
      extent(2) = direction(1)*corner(2, 2) + direction(2)*corner(1, 2)
      extent(3) = direction(1)*corner(1, 3) - direction(2)*corner(2, 3)
      extent(4) = direction(1)*corner(2, 4) + direction(2)*corner(1, 4)
   end function extent_of

   !> Find the extreme corners of a body at its angle.
   pure subroutine update_corners(bodies, s, direction, place, known)
      type(bodies_t), intent(in) :: bodies
      !> Slot of the body
      integer(ip), intent(in) :: s
      !> Cosine and sine of its angle
      real(wp), intent(in) :: direction(2)
      !> Index of each corner
      integer(ip), intent(inout) :: place(4)
      type(known_corners_t), intent(inout) :: known

      associate (first => bodies%pieces%vertex_start(s), last => bodies%pieces%vertex_start(s + 1_ip) - 1_ip)
         call find_corners(last - first + 1_ip, bodies%pieces%vertex(:, first:last), bodies%radius(s), &
                           bodies%angle(s), direction, place, known)
      end associate
   end subroutine update_corners

   !> Find the extreme corners of a body at an angle, and a range of angles in which they are extreme.
   !>
   !> In each of the four directions, let a neighbour of the extreme corner lag behind it by g, and let the lag change
   !> at the rate h when the body turns. After turning by an angle a it is g cos(a) + h sin(a). For 0 <= a <= 1 this is
   !> at least g - (g/2 - h) a if h < 0, and at least g/2 otherwise. The range ends before a lag is as small as the
   !> rounding errors: those of turning both corners (twice), of the rate, and of sine and cosine are together below
   !> 16 epsilon times the radius.
   pure subroutine find_corners(n, shape, radius, angle, direction, place, known)
      !> Number of corners
      integer(ip), intent(in) :: n
      !> Corners in the body frame, anticlockwise, (2, corner) [m]
      real(wp), intent(in) :: shape(2, n)
      !> Greatest distance of a corner from the centre of mass [m]
      real(wp), intent(in) :: radius
      !> Angle of the body [rad]
      real(wp), intent(in) :: angle
      !> Its cosine and sine
      real(wp), intent(in) :: direction(2)
      !> Index of each extreme corner; on entry where to begin, any number
      integer(ip), intent(inout) :: place(4)
      !> The range is empty if a neighbour is as extreme, except for rounding errors
      type(known_corners_t), intent(inout) :: known
      !> Directions in the body frame, against -y, x, y, -x and again -y; a corner is extreme if its projection is least
      real(wp) :: axis(2, 0:4)
      real(wp) :: lag(2, 4), rate(2, 4), forward, backward, rounding_of_angle
      integer :: d

      axis(:, 1) = [direction(1), -direction(2)]
      axis(:, 2) = [direction(2), direction(1)]
      axis(:, 3) = -axis(:, 1)
      axis(:, 4) = -axis(:, 2)
      axis(:, 0) = axis(:, 4)
      do d = 1, 4
         call walk(n, shape, axis(:, d), axis(:, d - 1), place(d), lag(:, d), rate(:, d))
         known%corner(:, d) = shape(:, place(d))
      end do
      call limit_range(lag, rate, roundings*epsilon(1.0_wp)*radius, forward, backward)
      rounding_of_angle = 4.0_wp*epsilon(1.0_wp)*abs(angle)
      known%from = angle - (backward - rounding_of_angle)
      known%to = angle + (forward - rounding_of_angle)
   end subroutine find_corners

   !> Walk along the outline to the corner with the least projection on an axis, and compare its neighbours with it.
   pure subroutine walk(n, shape, axis, turning_axis, place, lag, rate)
      !> Number of corners
      integer(ip), intent(in) :: n
      real(wp), intent(in) :: shape(2, n)
      !> The axis, and its rate of change when the body turns
      real(wp), intent(in) :: axis(2), turning_axis(2)
      !> Index of the corner; on entry any number
      integer(ip), intent(inout) :: place
      !> How far the neighbours lag behind [m], and the rates of change [m/rad]
      real(wp), intent(out) :: lag(2), rate(2)
      integer(ip) :: neighbour(2), k
      integer :: side

      if (place < 1_ip .or. place > n) place = 1_ip
      do k = 1_ip, n
         neighbour(1) = merge(n, place - 1_ip, place == 1_ip)
         neighbour(2) = merge(1_ip, place + 1_ip, place == n)
         do side = 1, 2
            lag(side) = axis(1)*(shape(1, neighbour(side)) - shape(1, place)) &
                        + axis(2)*(shape(2, neighbour(side)) - shape(2, place))
         end do
         if (min(lag(1), lag(2)) >= 0.0_wp) exit
         place = merge(neighbour(1), neighbour(2), lag(1) < lag(2))
      end do
      do side = 1, 2
         rate(side) = turning_axis(1)*(shape(1, neighbour(side)) - shape(1, place)) &
                      + turning_axis(2)*(shape(2, neighbour(side)) - shape(2, place))
      end do
   end subroutine walk

   !> Find the angles by which a body may turn forward and backward until a neighbour catches up with an extreme corner.
   pure subroutine limit_range(lag, rate, allowance, forward, backward)
      !> Lag of each neighbour [m] and its rate of change [m/rad]
      real(wp), intent(in) :: lag(8), rate(8)
      !> Least lag that is certain [m]
      real(wp), intent(in) :: allowance
      !> Angles; negative if there is none [rad]
      real(wp), intent(out) :: forward, backward
      real(wp) :: angle(8)

      if (minval(lag) < 2.0_wp*allowance) then
         forward = -1.0_wp
         backward = -1.0_wp
         return
      end if
      angle = (lag - allowance)/(0.5_wp*lag + abs(rate))
      forward = min(1.0_wp, minval(merge(angle, 1.0_wp, rate <= 0.0_wp)))
      backward = min(1.0_wp, minval(merge(angle, 1.0_wp, rate >= 0.0_wp)))
   end subroutine limit_range

end module polydem_extreme_corners
