!> Simple outlines: corners of rectangles and rings, and how convex outlines lie relative to each other.
module polydem_outlines
   use polydem_elementary, only: hypotenuse, sine_and_cosine
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: rectangle, draw_ring, pi, are_apart, contains_all, distance_to, as_corners

   !> The number pi
   real(wp), parameter :: pi = 3.141592653589793238462643383279503_wp

contains

   !> Corners of an upright rectangle, anticlockwise, (2, 4) [m]
   pure function rectangle(left, right, bottom, top) result(corners)
      !> Bounds in x and in y [m]
      real(wp), intent(in) :: left, right, bottom, top
      real(wp) :: corners(2, 4)

      corners(:, 1) = [left, bottom]
      corners(:, 2) = [right, bottom]
      corners(:, 3) = [right, top]
      corners(:, 4) = [left, top]
   end function rectangle

   !> Compute the corners of a regular polygon around the origin, anticlockwise from the right.
   subroutine draw_ring(radius, n, corners)
      !> Distance of the corners from the origin [m]
      real(wp), intent(in) :: radius
      !> Number of corners
      integer(ip), intent(in) :: n
      !> Corners, (2, n) [m]
      real(wp), allocatable, intent(out) :: corners(:, :)
      real(wp) :: angle, c, s
      integer(ip) :: k

      allocate (corners(2, n))
      do k = 1_ip, n
         angle = 2.0_wp*pi*real(k - 1_ip, wp)/real(n, wp)
         call sine_and_cosine(angle, s, c)
         corners(:, k) = [radius*c, radius*s]
      end do
   end subroutine draw_ring

   !> Corners from a list x1, y1, x2, y2, ...; a last value without a partner is left out, (2, corner) [m]
   pure function as_corners(values) result(corners)
      !> Coordinates [m]
      real(wp), intent(in) :: values(:)
      real(wp) :: corners(2, size(values)/2)

      corners = reshape(values(:2*(size(values)/2)), shape(corners))
   end function as_corners

   !> Whether two convex outlines lie on both sides of a line along an edge of one of them, or overlap by less than
   !> `tolerance`
   pure logical function are_apart(a, b, tolerance)
      !> Corners, anticlockwise, (2, corner) [m]
      real(wp), intent(in) :: a(:, :), b(:, :)
      !> Depth of an overlap that does not count [m]
      real(wp), intent(in) :: tolerance

      ! b is a wall, which has few edges.
      are_apart = has_separating_edge(b, a, tolerance)
      if (.not. are_apart) are_apart = has_separating_edge(a, b, tolerance)
   end function are_apart

   !> Whether all corners of b are beyond an edge of a, or inside by less than `tolerance`
   pure logical function has_separating_edge(a, b, tolerance) result(has_one)
      real(wp), intent(in) :: a(:, :), b(:, :), tolerance
      integer :: k

      has_one = .true.
      do k = 1, size(a, 2)
         if (.not. has_deep_point(a, k, b, tolerance)) return
      end do
      has_one = .false.
   end function has_separating_edge

   !> Whether a point is farther than `depth` from the line of edge k of an outline, on its inner side
   pure logical function has_deep_point(outline, k, points, depth) result(has_one)
      real(wp), intent(in) :: outline(:, :), points(:, :), depth
      integer, intent(in) :: k
      real(wp) :: area, edge(2)
      integer :: j, next

      next = merge(1, k + 1, k == size(outline, 2))
      edge = outline(:, next) - outline(:, k)
      has_one = .true.
      do j = 1, size(points, 2)
         area = edge(1)*(points(2, j) - outline(2, k)) - edge(2)*(points(1, j) - outline(1, k))
         if (is_clear(area, edge, depth)) return
         if (area/hypotenuse(edge(1), edge(2)) > depth) return
      end do
      has_one = .false.
   end function has_deep_point

   !> Whether a convex outline contains all points with a clearance, which is negative if they may lie outside a little
   pure logical function contains_all(outline, points, clearance)
      !> Corners, anticlockwise, and points, (2, :) [m]
      real(wp), intent(in) :: outline(:, :), points(:, :)
      !> Least distance from the edges [m]
      real(wp), intent(in) :: clearance
      real(wp) :: area, edge(2)
      integer :: j, k, next

      contains_all = .false.
      do k = 1, size(outline, 2)
         next = merge(1, k + 1, k == size(outline, 2))
         edge = outline(:, next) - outline(:, k)
         do j = 1, size(points, 2)
            area = edge(1)*(points(2, j) - outline(2, k)) - edge(2)*(points(1, j) - outline(1, k))
            if (is_clear(area, edge, clearance)) cycle
            if (area < clearance*hypotenuse(edge(1), edge(2))) return
         end do
      end do
      contains_all = .true.
   end function contains_all

   !> Whether a point is farther from the line of an edge than a distance by so much that the length of the edge, which
   !> takes long to compute, need not be known
   pure logical function is_clear(area, edge, distance)
      !> Cross product of the edge and the arm of the point [m2]
      real(wp), intent(in) :: area
      !> The edge, (2) [m]
      real(wp), intent(in) :: edge(2)
      !> The distance, negative on the outer side [m]
      real(wp), intent(in) :: distance

      is_clear = area > max(0.0_wp, 2.0_wp*distance*(abs(edge(1)) + abs(edge(2))))
   end function is_clear

   !> Distance of a point from a convex polygon; 0 inside [m]
   pure real(wp) function distance_to(corners, point) result(distance)
      !> Corners, clockwise or anticlockwise, (2, corner) [m]
      real(wp), intent(in) :: corners(:, :)
      !> The point [m]
      real(wp), intent(in) :: point(2)
      real(wp) :: arm(2), edge(2), share, side
      logical :: is_left, is_right
      integer :: k

      distance = huge(1.0_wp)
      is_left = .true.
      is_right = .true.
      do k = 1, size(corners, 2)
         edge = corners(:, modulo(k, size(corners, 2)) + 1) - corners(:, k)
         arm = point - corners(:, k)
         side = edge(1)*arm(2) - edge(2)*arm(1)
         if (side > 0.0_wp) is_right = .false.
         if (side < 0.0_wp) is_left = .false.
         share = min(1.0_wp, max(0.0_wp, (arm(1)*edge(1) + arm(2)*edge(2))/(edge(1)**2 + edge(2)**2)))
         distance = min(distance, hypotenuse(arm(1) - share*edge(1), arm(2) - share*edge(2)))
      end do
      if (is_left .or. is_right) distance = 0.0_wp
   end function distance_to

end module polydem_outlines
