!> Shapes and sizes of the grains of a group.
!>
!> The usual grains are irregular convex polygons inscribed in ellipses. All ellipses have the same short axis. The long
!> axis, the number of corners, the positions of the corners and the orientation are random. A polygon inscribed in an
!> ellipse is convex for any positions of its corners. Other groups have regular or random polygons, rectangles or given
!> outlines. A grain may have several convex pieces, as a cross has. If grains differ in size, all lengths are
!> multiplied by the size factor of the grain.
module polydem_grains
   use polydem_body_list, only: body_list_t
   use polydem_elementary, only: hypotenuse, sine_and_cosine, pi
   use polydem_grain_list, only: area_of_grain, grain_t, grains_t
   use polydem_kinds, only: ip, lp, wp
   use polydem_outlines, only: as_corners, rectangle
   use polydem_random, only: random_t
   use polydem_random_polygon, only: draw_random_polygon
   use polydem_settings, only: grains_settings_t
   use polydem_sizes, only: draw_sizes, sizes_of
   use polydem_sort_reals, only: sort_reals
   implicit none
   private
   public :: draw_grains, append_grains, settled_area, greatest_length, most_corners_of, most_pieces_of, &
             corners_of_polygons, pieces_of_outlines

   !> Total area of the ellipses around the grains of a settled bed over the area of the bed
   real(wp), parameter :: settled_fraction = 0.895_wp

   !> Number of the piece of each corner of a cross
   integer(ip), parameter :: pieces_of_cross(12) = [spread(0_ip, 1, 4), spread(1_ip, 1, 4), spread(2_ip, 1, 4)]

contains

   !> Draw grains of random shape and orientation, in descending order of size.
   subroutine draw_grains(group, random, n, grains)
      !> Shape, sizes and angles
      type(grains_settings_t), intent(in) :: group
      type(random_t), intent(inout) :: random
      !> Number of grains
      integer(ip), intent(in) :: n
      !> Grains to draw
      type(grains_t), intent(out) :: grains
      type(grain_t) :: grain
      real(wp), allocatable :: sizes(:)
      integer(ip) :: k

      call grains%start(n, int(most_corners_of(group), ip))
      sizes = sizes_of(group, n)
      do k = 1_ip, n
         if (allocated(grain%piece)) deallocate (grain%piece)
         associate (length => grain%length)
            select case (group%shape)
            case ('regular')
               call draw_regular(group, sizes(k), random, grain%corners, length)
            case ('random')
               length = sizes(k)*random%between(group%diameter(1), group%diameter(2))
               call draw_random_polygon(random, random%whole(group%corners(1), group%corners(2)), length, &
                                        length/group%elongation, grain%corners)
               call turn_at_random(group, random, grain%corners)
               length = 2.0_wp*maxval(hypotenuse(grain%corners(1, :), grain%corners(2, :)))
            case ('rectangle', 'cross', 'outline')
               call choose_outline(group, random, k, grain)
               grain%corners = sizes(k)*grain%corners
               length = sizes(k)*greatest_length(group)
               call turn_at_random(group, random, grain%corners)
            case default
               call draw_corners(group, sizes(k), random, grain%corners, length)
            end select
         end associate
         grain%area = area_of_grain(grain)
         call grains%append(grain)
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
      integer :: first, k

      most_corners_of = max(4_lp, int(group%corners(2), lp))
      if (group%shape == 'cross') most_corners_of = 12_lp
      if (group%shape == 'outline') then
         associate (corners => corners_of_polygons(group), pieces => pieces_of_outlines(group))
            first = 0
            do k = 1, size(pieces)
               most_corners_of = max(most_corners_of, sum(int(corners(first + 1:first + pieces(k)), lp)))
               first = first + pieces(k)
            end do
         end associate
      end if
   end function most_corners_of

   !> Greatest number of pieces of a grain
   pure integer(ip) function most_pieces_of(group)
      !> Shape of the grains
      type(grains_settings_t), intent(in) :: group

      most_pieces_of = 1_ip
      if (group%shape == 'cross') most_pieces_of = 3_ip
      if (group%shape == 'outline') most_pieces_of = maxval(pieces_of_outlines(group))
   end function most_pieces_of

   !> Number of corners of each convex polygon of the outlines of a group
   pure function corners_of_polygons(group) result(corners)
      !> The group
      type(grains_settings_t), intent(in) :: group
      integer(ip), allocatable :: corners(:)

      if (size(group%outline_corners) > 0) then
         corners = group%outline_corners
      else
         corners = [size(group%outline, kind=ip)/2_ip]
      end if
   end function corners_of_polygons

   !> Number of convex polygons of each outline of a group
   pure function pieces_of_outlines(group) result(pieces)
      !> The group
      type(grains_settings_t), intent(in) :: group
      integer(ip), allocatable :: pieces(:)

      if (size(group%outline_pieces) > 0) then
         pieces = group%outline_pieces
      else
         allocate (pieces(max(1, size(group%outline_corners))), source=1_ip)
      end if
   end function pieces_of_outlines

   !> Choose the outline of a grain: the only one, a random one, or the next one.
   subroutine choose_outline(group, random, k, grain)
      type(grains_settings_t), intent(in) :: group
      type(random_t), intent(inout) :: random
      !> Number of the grain
      integer(ip), intent(in) :: k
      !> Its corners and pieces are set
      type(grain_t), intent(inout) :: grain
      integer(ip) :: choice, first, n, p

      select case (group%shape)
      case ('rectangle')
         grain%corners = rectangle(-0.5_wp*group%width, 0.5_wp*group%width, -0.5_wp*group%height, 0.5_wp*group%height)
      case ('cross')
         grain%corners = cross(group%width, group%arm)
         grain%piece = pieces_of_cross
      case default
         associate (pieces => pieces_of_outlines(group), corners => corners_of_polygons(group))
            n = size(pieces, kind=ip)
            choice = 1_ip + modulo(k - 1_ip, n)
            if (group%outline_choice == 'random' .and. size(group%outline_corners) > 0) choice = random%whole(1_ip, n)
            first = sum(pieces(:choice - 1_ip))
            associate (mine => corners(first + 1_ip:first + pieces(choice)), before => 2_ip*sum(corners(:first)))
               grain%corners = as_corners(group%outline(before + 1_ip:before + 2_ip*sum(mine)))
               if (size(mine) > 1) grain%piece = [(spread(p - 1_ip, 1, mine(p)), p=1_ip, size(mine, kind=ip))]
            end associate
         end associate
      end select
   end subroutine choose_outline

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
      list%most_pieces = max(list%most_pieces, grains%most_pieces())
      do j = 1_ip, size(order, kind=ip)
         k = order(j)
         if (list%leaves_next()) then
            call list%skip()
            cycle
         end if
         corners = grains%polygon(k)
         corners(1, :) = corners(1, :) + centres(1, k)
         corners(2, :) = corners(2, :) + centres(2, k)
         call list%append(corners, density=density, velocity=velocities(:, k), angular_velocity=spins(k), &
                          material=material, piece=grains%pieces_of(k))
      end do
   end subroutine append_grains

   !> Corners of the pieces of a cross: a bar from end to end, and an arm on either side of it, (2, 12) [m]
   pure function cross(width, arm) result(corners)
      !> Distance of opposite ends, and width of the arms [m]
      real(wp), intent(in) :: width, arm
      real(wp) :: corners(2, 12)
      real(wp) :: w, a

      w = 0.5_wp*width
      a = 0.5_wp*arm
      corners(:, 1:4) = rectangle(-w, w, -a, a)
      corners(:, 5:8) = rectangle(-a, a, a, w)
      corners(:, 9:12) = rectangle(-a, a, -w, -a)
   end function cross

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
