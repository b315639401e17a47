!> Shapes and sizes of the grains of a group.
!>
!> The usual grains are irregular convex polygons inscribed in ellipses. All ellipses have the same short axis. The long
!> axis, the number of corners, the positions of the corners and the orientation are random. A polygon inscribed in an
!> ellipse is convex for any positions of its corners. Other groups have regular or random polygons, rectangles or given
!> outlines. If grains differ in size, all lengths are multiplied by the size factor of the grain.
module polydem_grains
   use polydem_body_list, only: body_list_t
   use polydem_elementary, only: hypotenuse, sine_and_cosine
   use polydem_kinds, only: ip, lp, wp
   use polydem_outlines, only: as_corners, pi, rectangle
   use polydem_polygon, only: mass_properties
   use polydem_polygon_list, only: polygon_list_t
   use polydem_random, only: random_t
   use polydem_random_polygon, only: draw_random_polygon
   use polydem_settings, only: grains_settings_t
   use polydem_sizes, only: draw_sizes, sizes_of
   use polydem_sort_reals, only: sort_reals
   implicit none
   private
   public :: grain_t, grains_t, draw_grains, append_grains, settled_area, greatest_length, most_corners_of

   !> Total area of the ellipses around the grains of a settled bed over the area of the bed
   real(wp), parameter :: settled_fraction = 0.895_wp

   !> One grain without a position
   type :: grain_t
      !> Corners relative to an inner point (the centre of the ellipse), anticlockwise, (2, corner) [m]
      real(wp), allocatable :: corners(:, :)
      !> Upper bound of twice the distance of a corner from that point, such as the long axis of the ellipse [m]
      real(wp) :: length = 0.0_wp
      !> Area of the polygon [m2]
      real(wp) :: area = 0.0_wp
   end type grain_t

   !> Grains without positions, in little memory: a list of their corners
   type, extends(polygon_list_t) :: grains_t
      !> As in `grain_t`, (grain)
      real(wp), allocatable :: length(:), area(:)
   contains
      procedure :: start
      procedure :: append
   end type grains_t

   !> Number of the piece of each corner of a cross
   integer(ip), parameter :: pieces_of_cross(12) = [spread(0_ip, 1, 4), spread(1_ip, 1, 4), spread(2_ip, 1, 4)]

contains

   !> Make room for all grains.
   subroutine start(self, n, most_corners)
      class(grains_t), intent(inout) :: self
      !> Number of grains
      integer(ip), intent(in) :: n
      !> Greatest number of corners of a grain
      integer(ip), intent(in) :: most_corners

      allocate (self%length(n), self%area(n))
      call self%reserve(n, int(n, lp)*int(most_corners, lp))
   end subroutine start

   !> Append a grain.
   pure subroutine append(self, corners, length, area)
      class(grains_t), intent(inout) :: self
      !> Corners, length and area as in `grain_t`
      real(wp), intent(in) :: corners(:, :), length, area

      call self%append_polygon(corners)
      self%length(self%n) = length
      self%area(self%n) = area
   end subroutine append

   !> Draw grains of random shape and orientation, in descending order of size.
   subroutine draw_grains(group, random, n, grains)
      !> Shape, sizes and angles
      type(grains_settings_t), intent(in) :: group
      type(random_t), intent(inout) :: random
      !> Number of grains
      integer(ip), intent(in) :: n
      !> Grains to draw
      type(grains_t), intent(out) :: grains
      real(wp), allocatable :: corners(:, :), sizes(:)
      real(wp) :: length, area, centroid(2), second_moment
      integer(ip) :: k

      call grains%start(n, int(most_corners_of(group), ip))
      sizes = sizes_of(group, n)
      do k = 1_ip, n
         select case (group%shape)
         case ('regular')
            call draw_regular(group, sizes(k), random, corners, length)
         case ('random')
            length = sizes(k)*random%between(group%diameter(1), group%diameter(2))
            call draw_random_polygon(random, random%whole(group%corners(1), group%corners(2)), length, &
                                     length/group%elongation, corners)
            call turn_at_random(group, random, corners)
            length = 2.0_wp*maxval(hypotenuse(corners(1, :), corners(2, :)))
         case ('rectangle')
            corners = sizes(k)*rectangle(-0.5_wp*group%width, 0.5_wp*group%width, -0.5_wp*group%height, &
                                         0.5_wp*group%height)
            length = sizes(k)*greatest_length(group)
            call turn_at_random(group, random, corners)
         case ('cross')
            corners = sizes(k)*hull_of_cross(group%width, group%arm)
            length = sizes(k)*greatest_length(group)
            call turn_at_random(group, random, corners)
         case ('outline')
            corners = sizes(k)*chosen_outline(group, random, k)
            length = sizes(k)*greatest_length(group)
            call turn_at_random(group, random, corners)
         case default
            call draw_corners(group, sizes(k), random, corners, length)
         end select
         call mass_properties(corners, area, centroid, second_moment)
         if (group%shape == 'cross') area = sizes(k)**2*group%arm*(2.0_wp*group%width - group%arm)
         call grains%append(corners, length, area)
      end do
   end subroutine draw_grains

   !> Greatest length of a grain whose size factor is 1: twice the greatest distance of a corner from the origin [m]
   pure real(wp) function greatest_length(group)
      !> Shape of the grains
      type(grains_settings_t), intent(in) :: group

      select case (group%shape)
      case ('regular')
         greatest_length = group%diameter(2)
      case ('random')
         greatest_length = hypotenuse(group%diameter(2), group%diameter(2)/group%elongation)
      case ('rectangle')
         greatest_length = hypotenuse(group%width, group%height)
      case ('cross')
         greatest_length = hypotenuse(group%width, group%arm)
      case ('outline')
         associate (corners => as_corners(group%outline))
            greatest_length = 2.0_wp*maxval(hypotenuse(corners(1, :), corners(2, :)))
         end associate
      case default
         greatest_length = group%long_axis(2)
      end select
   end function greatest_length

   !> Greatest number of corners of a grain
   pure integer(lp) function most_corners_of(group)
      !> Shape of the grains
      type(grains_settings_t), intent(in) :: group

      most_corners_of = max(4_lp, int(group%corners(2), lp))
      if (size(group%outline_corners) > 0) then
         most_corners_of = max(most_corners_of, int(maxval(group%outline_corners), lp))
      else
         most_corners_of = max(most_corners_of, size(group%outline, kind=lp)/2_lp)
      end if
   end function most_corners_of

   !> The outline of a grain: the only one, a random one, or the next one
   function chosen_outline(group, random, k) result(corners)
      type(grains_settings_t), intent(in) :: group
      type(random_t), intent(inout) :: random
      !> Number of the grain
      integer(ip), intent(in) :: k
      real(wp), allocatable :: corners(:, :)
      integer(ip) :: choice, first, n

      n = size(group%outline_corners, kind=ip)
      if (n == 0_ip) then
         corners = as_corners(group%outline)
         return
      end if
      choice = 1_ip + modulo(k - 1_ip, n)
      if (group%outline_choice == 'random') choice = random%whole(1_ip, n)
      first = 2_ip*sum(group%outline_corners(:choice - 1_ip))
      corners = as_corners(group%outline(first + 1_ip:first + 2_ip*group%outline_corners(choice)))
   end function chosen_outline

   !> Append grains to the list of bodies in the given order or, if the order is 'descending', from right to left.
   !>
   !> The order 'descending' is the worst start of a sweep that exchanges neighbours in lists of box ends: all pairs of
   !> boxes are in the wrong order on x, and half of them on y. No other order has a larger total. Each box has two
   !> ends, so n grains that hardly overlap need about 2 n**2 exchanges on x and n**2 on y.
   subroutine append_grains(list, group, density, material, grains, centres, velocities, spins)
      type(body_list_t), intent(inout) :: list
      !> Order
      type(grains_settings_t), intent(in) :: group
      !> Density [kg/m3]
      real(wp), intent(in) :: density
      !> Number of the material
      integer(ip), intent(in) :: material
      type(grains_t), intent(in) :: grains
      !> Position of the origin of the corners of each grain, (2, grain) [m]
      real(wp), intent(in) :: centres(:, :)
      !> Velocities, (2, grain) [m/s]
      real(wp), intent(in) :: velocities(:, :)
      !> Angular velocities, (grain) [rad/s]
      real(wp), intent(in) :: spins(:)
      real(wp), allocatable :: corners(:, :)
      integer(ip), allocatable :: order(:)
      integer(ip) :: j, k

      allocate (order(size(centres, 2)))
      order = [(k, k=1_ip, size(order, kind=ip))]
      if (group%order == 'descending') call sort_reals(-centres(1, :), order)
      if (group%shape == 'cross') list%most_pieces = max(list%most_pieces, 3_ip)
      do j = 1_ip, size(order, kind=ip)
         k = order(j)
         if (list%leaves_next()) then
            call list%skip()
            cycle
         end if
         corners = grains%polygon(k)
         corners(1, :) = corners(1, :) + centres(1, k)
         corners(2, :) = corners(2, :) + centres(2, k)
         if (group%shape == 'cross') then
            call list%append(cross_in(corners, group%arm/group%width), density=density, velocity=velocities(:, k), &
                             angular_velocity=spins(k), material=material, piece=pieces_of_cross)
            cycle
         end if
         call list%append(corners, density=density, velocity=velocities(:, k), angular_velocity=spins(k), &
                          material=material)
      end do
   end subroutine append_grains

   !> Convex hull of a cross, (2, 8) [m]
   pure function hull_of_cross(width, arm) result(corners)
      !> Distance of opposite ends, and width of the arms [m]
      real(wp), intent(in) :: width, arm
      real(wp) :: corners(2, 8)
      real(wp) :: w, a

      w = 0.5_wp*width
      a = 0.5_wp*arm
      corners = reshape([w, -a, w, a, a, w, -a, w, -w, a, -w, -a, -a, -w, a, -w], [2, 8])
   end function hull_of_cross

   !> The pieces of a cross with a given hull: a bar from end to end, and an arm on either side of it
   pure function cross_in(hull, ratio) result(corners)
      !> Corners of the hull as `hull_of_cross` makes them, turned and moved (2, 8) [m]
      real(wp), intent(in) :: hull(:, :)
      !> Width of the arms over the width of the cross
      real(wp), intent(in) :: ratio
      real(wp) :: corners(2, 12)
      real(wp) :: near, far

      near = 0.5_wp*(1.0_wp - ratio)
      far = 0.5_wp*(1.0_wp + ratio)
      corners(:, 1:4) = hull(:, [1, 2, 5, 6])
      corners(:, 5) = hull(:, 2) + near*(hull(:, 5) - hull(:, 2))
      corners(:, 6:7) = hull(:, 3:4)
      corners(:, 8) = hull(:, 2) + far*(hull(:, 5) - hull(:, 2))
      corners(:, 9) = hull(:, 6) + near*(hull(:, 1) - hull(:, 6))
      corners(:, 10:11) = hull(:, 7:8)
      corners(:, 12) = hull(:, 6) + far*(hull(:, 1) - hull(:, 6))
   end function cross_in

   !> Area of a settled bed of grains, voids included [m2]
   pure real(wp) function settled_area(group, n)
      !> Axes of the ellipses, size ratio
      type(grains_settings_t), intent(in) :: group
      !> Number of grains
      integer(ip), intent(in) :: n
      real(wp) :: mean_ellipse

      mean_ellipse = 0.25_wp*pi*group%short_axis*0.5_wp*(group%long_axis(1) + group%long_axis(2))
      settled_area = real(n, wp)*mean_ellipse/settled_fraction
      if (group%size_ratio > 1.0_wp) settled_area = settled_area*sum(draw_sizes(group%size_ratio, n)**2)/real(n, wp)
   end function settled_area

   !> Draw the corners of a regular polygon.
   subroutine draw_regular(group, factor, random, corners, length)
      type(grains_settings_t), intent(in) :: group
      real(wp), intent(in) :: factor
      type(random_t), intent(inout) :: random
      real(wp), allocatable, intent(out) :: corners(:, :)
      real(wp), intent(out) :: length
      real(wp) :: c, s, turn
      integer(ip) :: k, n

      n = random%whole(group%corners(1), group%corners(2))
      length = factor*random%between(group%diameter(1), group%diameter(2))
      turn = angle_of(group, random)
      allocate (corners(2, n))
      do k = 1_ip, n
         call sine_and_cosine(turn + 2.0_wp*pi*real(k - 1_ip, wp)/real(n, wp), s, c)
         corners(:, k) = 0.5_wp*length*[c, s]
      end do
   end subroutine draw_regular

   !> An angle between both bounds of a group [rad]
   real(wp) function angle_of(group, random)
      type(grains_settings_t), intent(in) :: group
      type(random_t), intent(inout) :: random

      angle_of = random%between(2.0_wp*pi*(group%angle(1)/360.0_wp), 2.0_wp*pi*(group%angle(2)/360.0_wp))
   end function angle_of

   !> Turn an outline about the origin, unless its angle is 0.
   subroutine turn_at_random(group, random, corners)
      type(grains_settings_t), intent(in) :: group
      type(random_t), intent(inout) :: random
      real(wp), intent(inout) :: corners(:, :)
      real(wp) :: c, s
      integer :: k

      if (.not. any(abs(group%angle) > 0.0_wp)) return
      call sine_and_cosine(angle_of(group, random), s, c)
      do k = 1, size(corners, 2)
         corners(:, k) = [c*corners(1, k) - s*corners(2, k), s*corners(1, k) + c*corners(2, k)]
      end do
   end subroutine turn_at_random

   !> Draw the corners of one grain inscribed in an ellipse.
   !>
   !> The ellipse is the affine image of a circle. The gaps between neighbouring corners are angles on that circle; the
   !> ratio of any two gaps is between one half and two. No edge is very short, and no gap reaches half a turn, so the
   !> centre lies inside the polygon.
   subroutine draw_corners(group, factor, random, corners, length)
      type(grains_settings_t), intent(in) :: group
      real(wp), intent(in) :: factor
      type(random_t), intent(inout) :: random
      real(wp), allocatable, intent(out) :: corners(:, :)
      real(wp), intent(out) :: length
      real(wp), allocatable :: gaps(:)
      real(wp) :: long_half, short_half, turn, place, total, x, y, c, s
      integer(ip) :: k, n

      n = random%whole(group%corners(1), group%corners(2))
      length = factor*random%between(group%long_axis(1), group%long_axis(2))
      long_half = 0.5_wp*length
      short_half = 0.5_wp*factor*group%short_axis
      turn = angle_of(group, random)
      place = random%between(0.0_wp, 2.0_wp*pi)
      allocate (gaps(n), corners(2, n))
      total = 0.0_wp
      do k = 1_ip, n
         gaps(k) = random%between(2.0_wp/3.0_wp, 4.0_wp/3.0_wp)
         total = total + gaps(k)
      end do
      do k = 1_ip, n
         call sine_and_cosine(place, s, c)
         x = long_half*c
         y = short_half*s
         call sine_and_cosine(turn, s, c)
         corners(1, k) = c*x - s*y
         corners(2, k) = s*x + c*y
         place = place + 2.0_wp*pi*gaps(k)/total
      end do
   end subroutine draw_corners

end module polydem_grains
