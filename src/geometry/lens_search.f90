!> Search without memory for what `polydem_feature_cache` can remember of two polygons: a lens or a separating edge.
module polydem_lens_search
   use polydem_kinds, only: ip, wp
   use polydem_overlap_tolerances, only: far, sure, surely_apart
   use polydem_feature_cache, only: lens_bits, most_lens_corners, packed_edge, packed_lens
   implicit none
   private
   public :: search_pair, cross_at

   !> A polygon in the coordinates of the kernel; the first vertex is repeated behind the last
   type :: placed_t
      !> Number of vertices
      integer(ip) :: n
      !> Vertices [m]
      real(wp) :: x(most_lens_corners + 1_ip), y(most_lens_corners + 1_ip)
      !> Edges from each vertex to the next [m]
      real(wp) :: edge(2, most_lens_corners)
      !> Whether the vertices are near enough for certain signs
      logical :: near(most_lens_corners + 1_ip)
   end type placed_t

   !> The proper crossings found so far
   type :: crossings_t
      !> Number of those where P enters Q, and of those where it leaves
      integer(ip) :: entering = 0_ip, leaving = 0_ip
      !> Edges of the last ones, as in `packed_lens`
      integer(ip) :: edges(4) = 0_ip
   end type crossings_t

contains

   !> Find the lens of two polygons, or an edge that surely separates them; 0 if there is neither.
   !>
   !> A lens has exactly one entering and one leaving crossing beyond rounding errors, with at most two corners of
   !> each polygon between them. It is not certified yet. Every lens that the kernel certifies is found, since both
   !> compute the same signs, and it has no other crossings. Edges of Q with a vertex that is not near are left out:
   !> no certified lens has them, and their signs are not certain. Complexity: O(n m) for n and m vertices
   pure subroutine search_pair(p, q, offset, radius_p, radius_q, features)
      !> Vertices of P and of Q, anticlockwise, each relative to its own centre, (2, n) and (2, m) [m]
      real(wp), intent(in), contiguous :: p(:, :), q(:, :)
      !> Centre of Q minus centre of P [m]
      real(wp), intent(in) :: offset(2)
      !> Radii of P and of Q, that of P not greater than that of Q [m]
      real(wp), intent(in) :: radius_p, radius_q
      !> What to remember
      integer(ip), intent(out) :: features
      type(placed_t) :: placed_p, placed_q
      type(crossings_t) :: found
      real(wp) :: half, centre_p(2)
      integer(ip) :: j

      features = 0_ip
      if (max(size(p, 2), size(q, 2)) > most_lens_corners) return
      half = merge(0.0_wp, 0.5_wp, radius_p < radius_q)
      centre_p = -half*offset
      call place(p, centre_p, (1.0_wp - half)*far*radius_p, placed_p)
      if (.not. all(placed_p%near(1:placed_p%n))) return
      call place(q, offset + centre_p, (1.0_wp - half)*far*radius_p, placed_q)

      do j = 1_ip, placed_q%n
         if (.not. (placed_q%near(j) .and. placed_q%near(j + 1_ip))) cycle
         call cross_line(placed_p, placed_q, j, radius_p, found, features)
         if (features /= 0_ip) return
      end do
      if (found%entering == 1_ip .and. found%leaving == 1_ip) then
         if (modulo(found%edges(2) - found%edges(1), placed_p%n) <= 2_ip .and. &
             modulo(found%edges(4) - found%edges(3), placed_q%n) <= 2_ip) features = packed_lens(found%edges)
      else if (found%entering + found%leaving == 0_ip .and. all(placed_q%near(1:placed_q%n))) then
         call find_separating_edge(placed_p, placed_q, radius_p, features)
      end if
   end subroutine search_pair

   !> Whether two polygons surely cross at the edges of a lens. Then no edge separates them, and the search finds this
   !> lens or, if they cross elsewhere too, none.
   pure logical function cross_at(p, q, offset, radius_p, radius_q, lens)
      !> Vertices of P and of Q, anticlockwise, each relative to its own centre, (2, n) and (2, m) [m]
      real(wp), intent(in), contiguous :: p(:, :), q(:, :)
      !> Centre of Q minus centre of P [m]
      real(wp), intent(in) :: offset(2)
      !> Radii of P and of Q, that of P not greater than that of Q [m]
      real(wp), intent(in) :: radius_p, radius_q
      !> The lens, any positive number
      integer(ip), intent(in) :: lens
      type(placed_t) :: placed_p, placed_q
      real(wp) :: half, centre_p(2), s
      integer(ip) :: edges(4), k

      edges = [(ibits(lens, k*lens_bits, lens_bits), k=0_ip, 3_ip)]
      cross_at = max(edges(1), edges(2)) < size(p, 2) .and. max(edges(3), edges(4)) < size(q, 2)
      if (.not. cross_at) return
      s = radius_p
      half = merge(0.0_wp, 0.5_wp, radius_p < radius_q)
      centre_p = -half*offset
      call place(ends_of(p, edges(1), edges(2)), centre_p, (1.0_wp - half)*far*s, placed_p)
      call place(ends_of(q, edges(3), edges(4)), offset + centre_p, (1.0_wp - half)*far*s, placed_q)
      cross_at = all(placed_p%near(1:4)) .and. all(placed_q%near(1:4))
      if (.not. cross_at) return
      cross_at = enters(placed_p, 1_ip, placed_q, 3_ip, s, 1.0_wp) &
         .and. enters(placed_q, 3_ip, placed_p, 1_ip, s, -1.0_wp) &
         .and. enters(placed_p, 3_ip, placed_q, 1_ip, s, -1.0_wp) &
         .and. enters(placed_q, 1_ip, placed_p, 3_ip, s, 1.0_wp)
   end function cross_at

   !> Ends of two edges of a polygon, which count from 0
   pure function ends_of(vertices, edge, other) result(ends)
      real(wp), intent(in), contiguous :: vertices(:, :)
      integer(ip), intent(in) :: edge, other
      real(wp) :: ends(2, 4)
      integer(ip) :: n

      n = size(vertices, 2, kind=ip)
      ends(:, 1) = vertices(:, edge + 1_ip)
      ends(:, 2) = vertices(:, merge(1_ip, edge + 2_ip, edge + 1_ip == n))
      ends(:, 3) = vertices(:, other + 1_ip)
      ends(:, 4) = vertices(:, merge(1_ip, other + 2_ip, other + 1_ip == n))
   end function ends_of

   !> Place a polygon.
   pure subroutine place(vertices, centre, limit, placed)
      real(wp), intent(in), contiguous :: vertices(:, :)
      real(wp), intent(in) :: centre(2)
      !> Greatest coordinate of a vertex that is near [m]
      real(wp), intent(in) :: limit
      type(placed_t), intent(out) :: placed
      integer(ip) :: k, n

      n = size(vertices, 2, kind=ip)
      placed%n = n
      do k = 1_ip, n
         placed%x(k) = vertices(1, k) + centre(1)
         placed%y(k) = vertices(2, k) + centre(2)
         placed%near(k) = max(abs(placed%x(k)), abs(placed%y(k))) <= limit
         placed%edge(:, k) = vertices(:, merge(1_ip, k + 1_ip, k == n)) - vertices(:, k)
      end do
      placed%x(n + 1_ip) = placed%x(1)
      placed%y(n + 1_ip) = placed%y(1)
      placed%near(n + 1_ip) = placed%near(1)
   end subroutine place

   !> Find the proper crossings of an edge of Q with the edges of P, or that it surely separates the polygons.
   pure subroutine cross_line(p, q, j, s, found, features)
      type(placed_t), intent(in) :: p, q
      !> The edge of Q
      integer(ip), intent(in) :: j
      !> Radius of P [m]
      real(wp), intent(in) :: s
      type(crossings_t), intent(inout) :: found
      !> The separating edge; not changed if it does not separate
      integer(ip), intent(inout) :: features
      real(wp) :: depth(most_lens_corners + 1_ip), length, highest
      integer(ip) :: i

      length = abs(q%edge(1, j)) + abs(q%edge(2, j))
      highest = -huge(1.0_wp)
      do i = 1_ip, p%n + 1_ip
         depth(i) = q%edge(1, j)*(p%y(i) - q%y(j)) - q%edge(2, j)*(p%x(i) - q%x(j))
         highest = max(highest, depth(i))
      end do
      if (highest < -surely_apart*s*length) then
         features = packed_edge(.true., j - 1_ip, int(maxloc(depth(1:p%n), dim=1), ip) - 1_ip)
         return
      end if
      do i = 1_ip, p%n
         if (.not. max(depth(i), depth(i + 1_ip)) > sure*s*length) cycle
         if (.not. min(depth(i), depth(i + 1_ip)) < -sure*s*length) cycle
         if (depth(i) < 0.0_wp) then
            if (.not. enters(q, j, p, i, s, -1.0_wp)) cycle
            found%entering = found%entering + 1_ip
            found%edges(1) = i - 1_ip
            found%edges(4) = j - 1_ip
         else
            if (.not. enters(q, j, p, i, s, 1.0_wp)) cycle
            found%leaving = found%leaving + 1_ip
            found%edges(2) = i - 1_ip
            found%edges(3) = j - 1_ip
         end if
      end do
   end subroutine cross_line

   !> Whether edge j of a polygon crosses the line of edge i of another, inwards (side 1) or outwards (side -1)
   pure logical function enters(a, j, b, i, s, side)
      type(placed_t), intent(in) :: a
      integer(ip), intent(in) :: j
      type(placed_t), intent(in) :: b
      integer(ip), intent(in) :: i
      real(wp), intent(in) :: s, side
      real(wp) :: limit, before, behind

      limit = sure*s*(abs(b%edge(1, i)) + abs(b%edge(2, i)))
      before = b%edge(1, i)*(a%y(j) - b%y(i)) - b%edge(2, i)*(a%x(j) - b%x(i))
      behind = b%edge(1, i)*(a%y(j + 1_ip) - b%y(i)) - b%edge(2, i)*(a%x(j + 1_ip) - b%x(i))
      enters = side*before < -limit .and. side*behind > limit
   end function enters

   !> Find the first edge of P that surely separates it from Q; all vertices must be near.
   pure subroutine find_separating_edge(p, q, s, features)
      type(placed_t), intent(in) :: p, q
      !> Radius of P [m]
      real(wp), intent(in) :: s
      !> The separating edge; not changed if there is none
      integer(ip), intent(inout) :: features
      real(wp) :: depth, highest
      integer(ip) :: i, j, nearest

      do i = 1_ip, p%n
         highest = -huge(1.0_wp)
         nearest = 1_ip
         do j = 1_ip, q%n
            depth = p%edge(1, i)*(q%y(j) - p%y(i)) - p%edge(2, i)*(q%x(j) - p%x(i))
            if (depth > highest) nearest = j
            highest = max(highest, depth)
         end do
         if (highest < -surely_apart*s*(abs(p%edge(1, i)) + abs(p%edge(2, i)))) then
            features = packed_edge(.false., i - 1_ip, nearest - 1_ip)
            return
         end if
      end do
   end subroutine find_separating_edge

end module polydem_lens_search
