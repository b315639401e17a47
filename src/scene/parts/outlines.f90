!> Simple outlines: corners of rectangles and rings, and how convex outlines lie relative to each other.
module polydem_outlines
   use polydem_elementary, only: hypotenuse, sine_and_cosine, pi
   use polydem_kinds, only: ip, wp
   use polydem_polygon, only: cross, mass_properties
   implicit none
   private
   public :: rectangle, draw_ring, are_apart, inner_circle, inner_circle_t, lies, contains_point, distance_to, &
      as_corners, is_apart, is_inside, is_across

   !> How a polygon lies relative to an outline: beside it, inside, or across its border
   integer, parameter :: is_apart = 1, is_inside = 2, is_across = 3

   !> Circle inside a convex outline. The edge that a ray from its centre through a point crosses is found by bisection;
   !> mostly it alone tells where the point is, however many edges there are
   type :: inner_circle_t
      !> Centroid of the outline [m]
      real(wp) :: centre(2) = 0.0_wp
      !> Least distance of the centre from the lines of the edges [m]
      real(wp) :: radius = 0.0_wp
      !> Lengths that are below rounding errors [m]
      real(wp) :: rounding = 0.0_wp
   end type inner_circle_t

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

   !> Find the circle about the centroid of a convex outline.
   pure function inner_circle(outline) result(circle)
      !> Corners, anticlockwise, (2, corner) [m]
      real(wp), intent(in) :: outline(:, :)
      type(inner_circle_t) :: circle
      real(wp) :: area, second_moment, edge(2), length
      integer :: k

      call mass_properties(outline, area, circle%centre, second_moment)
      circle%radius = huge(1.0_wp)
      do k = 1, size(outline, 2)
         edge = edge_of(outline, k)
         length = hypotenuse(edge(1), edge(2))
         if (length > 0.0_wp) circle%radius = min(circle%radius, cross(edge, circle%centre - outline(:, k))/length)
      end do
      circle%rounding = 1.0e-9_wp*circle%radius + 64.0_wp*epsilon(1.0_wp)*maxval(abs(outline))
   end function inner_circle

   !> How a polygon lies relative to a convex outline
   pure integer function lies(polygon, outline, circle, tolerance)
      !> Corners of both, anticlockwise, (2, corner) [m]
      real(wp), intent(in) :: polygon(:, :), outline(:, :)
      !> Inner circle of the outline
      type(inner_circle_t), intent(in) :: circle
      !> Depth of an overlap that does not count [m]
      real(wp), intent(in) :: tolerance
      integer :: j

      lies = is_apart
      if (.not. has_deep_point(outline, facing_edge(outline, circle, polygon(:, 1)), polygon, tolerance)) return
      lies = is_inside
      do j = 1, size(polygon, 2)
         if (.not. is_deep(outline, circle, polygon(:, j), tolerance)) exit
      end do
      if (j > size(polygon, 2)) return
      if (are_apart(outline, polygon, tolerance)) then
         lies = is_apart
      else if (.not. contains_all(outline, polygon, -tolerance)) then
         lies = is_across
      end if
   end function lies

   !> Whether a convex outline contains a point with a clearance
   pure logical function contains_point(outline, circle, point, clearance)
      !> Corners, anticlockwise, (2, corner) [m]
      real(wp), intent(in) :: outline(:, :)
      !> Inner circle of the outline
      type(inner_circle_t), intent(in) :: circle
      !> The point [m]
      real(wp), intent(in) :: point(2)
      !> Least distance from the edges [m]
      real(wp), intent(in) :: clearance
      integer :: k
      ! Number of edges that are compared with a point as fast as one of them is found
      integer, parameter :: few = 16

      if (size(outline, 2) <= few) then
         contains_point = contains_all(outline, reshape(point, [2, 1]), clearance)
         return
      end if
      k = facing_edge(outline, circle, point)
      contains_point = .not. is_beyond(outline, k, point, clearance)
      if (.not. contains_point) return
      if (.not. is_deep(outline, circle, point, clearance)) &
         contains_point = contains_all(outline, reshape(point, [2, 1]), clearance)
   end function contains_point

   !> Whether a point is farther from all edges of a convex outline than a distance by so much that rounding errors do
   !> not matter. False says nothing.
   pure logical function is_deep(outline, circle, point, distance)
      real(wp), intent(in) :: outline(:, :)
      type(inner_circle_t), intent(in) :: circle
      real(wp), intent(in) :: point(2), distance
      real(wp) :: arm(2), edge(2)
      integer :: k

      k = facing_edge(outline, circle, point)
      edge = edge_of(outline, k)
      arm = point - circle%centre
      is_deep = .false.
      if (.not. circle%radius > 0.0_wp) return
      if (cross(outline(:, k) - circle%centre, arm) < 0.0_wp) return
      if (cross(outline(:, k) + edge - circle%centre, arm) > 0.0_wp) return
      ! The ray from the centre c meets the edge at q. The point p divides the line from c to q. It is the centre of a
      ! circle inside the outline whose radius is that of the inner circle times the share |pq|/|cq|.
      is_deep = cross(edge, point - outline(:, k))*circle%radius > &
                max(2.0_wp*distance, circle%rounding)*cross(edge, circle%centre - outline(:, k))
   end function is_deep

   !> The edge of a convex outline that the ray from the centre of its inner circle through a point crosses
   pure integer function facing_edge(outline, circle, point) result(k)
      real(wp), intent(in) :: outline(:, :)
      type(inner_circle_t), intent(in) :: circle
      real(wp), intent(in) :: point(2)
      real(wp) :: first(2), arm(2), ray(2)
      integer :: behind, middle
      logical :: is_second, is_reached

      first = outline(:, 1) - circle%centre
      ray = point - circle%centre
      ! Whether it is in the second half of a turn that begins at the first corner
      is_second = cross(first, ray) < 0.0_wp
      k = 1
      behind = size(outline, 2) + 1
      do while (behind - k > 1)
         middle = (k + behind)/2
         arm = outline(:, middle) - circle%centre
         is_reached = is_second
         if ((cross(first, arm) < 0.0_wp) .eqv. is_second) is_reached = cross(arm, ray) >= 0.0_wp
         if (is_reached) then
            k = middle
         else
            behind = middle
         end if
      end do
   end function facing_edge

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
      integer :: j

      edge = edge_of(outline, k)
      has_one = .true.
      ! Corners that are twice at a place have no edge between them.
      if (.not. any(abs(edge) > 0.0_wp)) return
      do j = 1, size(points, 2)
         area = cross(edge, points(:, j) - outline(:, k))
         if (is_clear(area, edge, depth)) return
         if (area/hypotenuse(edge(1), edge(2)) > depth) return
      end do
      has_one = .false.
   end function has_deep_point

   !> Whether a convex outline contains all points with a clearance, which is negative if they may lie outside a little
   pure logical function contains_all(outline, points, clearance)
      real(wp), intent(in) :: outline(:, :), points(:, :), clearance
      integer :: j, k

      contains_all = .false.
      do k = 1, size(outline, 2)
         do j = 1, size(points, 2)
            if (is_beyond(outline, k, points(:, j), clearance)) return
         end do
      end do
      contains_all = .true.
   end function contains_all

   !> Whether a point is beyond edge k of an outline, or nearer to its line than a clearance
   pure logical function is_beyond(outline, k, point, clearance)
      real(wp), intent(in) :: outline(:, :), point(2), clearance
      integer, intent(in) :: k
      real(wp) :: area, edge(2)

      edge = edge_of(outline, k)
      area = cross(edge, point - outline(:, k))
      is_beyond = .not. is_clear(area, edge, clearance)
      if (is_beyond) is_beyond = area < clearance*hypotenuse(edge(1), edge(2))
   end function is_beyond

   !> Edge k of an outline, from its corner k to the next [m]
   pure function edge_of(outline, k) result(edge)
      real(wp), intent(in) :: outline(:, :)
      integer, intent(in) :: k
      real(wp) :: edge(2)

      edge = outline(:, merge(1, k + 1, k == size(outline, 2))) - outline(:, k)
   end function edge_of

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
