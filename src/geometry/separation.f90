!> Test of a remembered separating edge.
module polydem_separation
   use polydem_exact_cross, only: exact_cross
   use polydem_gather_corners, only: gather_corners
   use polydem_kinds, only: ip, wp
   use polydem_overlap_batch, only: column_length, lanes, overlap_batch_t
   use polydem_overlap_tolerances, only: far, surely_apart
   use polydem_pair_memory, only: edge_bits, packed_edge, unpack_edge
   implicit none
   private
   public :: test_separation, test_edges, remembered_edge

   !> Line of an edge of polygon A, for depths of points of polygon B
   type :: line_t
      !> Edge from start to end, relative to the centre of A [m]
      real(wp) :: start(2), end(2), edge(2)
      !> Centre of B minus centre of A [m]
      real(wp) :: offset(2)
      !> Start, and centre of B, relative to the centre of P [m]
      real(wp) :: from(2), centre_b(2)
      !> Greatest coordinate relative to the centre of P for plain arithmetic [m]
      real(wp) :: limit
      !> Depth of a point that is surely outside, times the length of the edge [m2]
      real(wp) :: level
      !> Whether the start is near
      logical :: plain
   end type line_t

contains

   !> Find which remembered edges of a batch still separate the polygons.
   !>
   !> Nearly always the remembered corner decides. That is tested without branches; `test_separation` tests the rest.
   pure subroutine test_edges(batch, n, n_vertices, turned, apart)
      !> The batch: an edge is remembered in each lane; its corner is brought up to date
      type(overlap_batch_t), intent(inout) :: batch
      !> Number of lanes
      integer(ip), intent(in) :: n
      !> Number of vertices in the array
      integer(ip), intent(in) :: n_vertices
      !> Vertices of all polygons, anticlockwise, each relative to its own centre [m]
      real(wp), intent(in) :: turned(2, n_vertices)
      !> Whether the polygons of a lane are apart
      logical, intent(out) :: apart(lanes)
      real(wp) :: sure(column_length), vertex(column_length, 2, 5)
      integer(ip) :: place(column_length, 5), i

      if (n == 0_ip) return
      call unpack_edges(batch, n, place, sure)
      call gather_corners(n, 5_ip, place, n_vertices, turned, vertex)
      call test_corners(batch, n, vertex, sure)
      do i = 1_ip, n
         apart(i) = sure(i) > 0.0_wp
         if (apart(i)) cycle
         associate (from => batch%start(i, :), to => batch%start(i, :) + batch%corners(i, :) - 1_ip)
            call test_separation(turned(:, from(1):to(1)), turned(:, from(2):to(2)), batch%offset(i, :), &
                                 batch%radius(i, 1), batch%memory(i), apart(i))
         end associate
      end do
   end subroutine test_edges

   !> Find the vertices of the remembered edges and corners.
   pure subroutine unpack_edges(batch, n, vertex, sure)
      type(overlap_batch_t), intent(in) :: batch
      integer(ip), intent(in) :: n
      !> Places of start and end of the edge, of the remembered corner, the one before, and the one behind
      integer(ip), intent(inout) :: vertex(column_length, 5)
      !> Positive if they exist; otherwise the vertices are others
      real(wp), intent(inout) :: sure(column_length)
      integer(ip) :: i, edge, corner, start(2), last(2), of_q, exchange

      do i = 1_ip, n
         ! As in `unpack_edge`; all bits of `of_q` are set if the edge is one of Q. Then P and Q change places.
         of_q = -iand(not(batch%memory(i)), 1_ip)
         edge = ibits(not(batch%memory(i)), 1, edge_bits)
         corner = ibits(not(batch%memory(i)), 1 + edge_bits, edge_bits)
         exchange = iand(of_q, ieor(batch%start(i, 1), batch%start(i, 2)))
         start = ieor(batch%start(i, :), exchange)
         exchange = iand(of_q, ieor(batch%corners(i, 1), batch%corners(i, 2)))
         last = ieor(batch%corners(i, :), exchange) - 1_ip
         sure(i) = merge(1.0_wp, -1.0_wp, edge <= last(1) .and. corner <= last(2))
         edge = min(edge, last(1))
         corner = min(corner, last(2))
         vertex(i, 1) = start(1) + edge
         vertex(i, 2) = start(1) + merge(0_ip, edge + 1_ip, edge == last(1))
         vertex(i, 3) = start(2) + corner
         vertex(i, 4) = start(2) + merge(last(2), corner - 1_ip, corner == 0_ip)
         vertex(i, 5) = start(2) + merge(0_ip, corner + 1_ip, corner == last(2))
      end do
   end subroutine unpack_edges

   !> Test the remembered corners: `sure` stays positive if the corner is near, outside of the edge, and nearer to its
   !> line than both its neighbours.
   pure subroutine test_corners(batch, n, vertex, sure)
      type(overlap_batch_t), intent(in) :: batch
      integer(ip), intent(in) :: n
      !> Vertices as in `unpack_edges`, (lane, x or y, vertex)
      real(wp), intent(in) :: vertex(column_length, 2, 5)
      real(wp), intent(inout) :: sure(column_length)
      real(wp) :: edge(2), from(2), to(2), of_p, of_q, nearer
      integer(ip) :: i

      do i = 1_ip, n
         of_q = real(iand(not(batch%memory(i)), 1_ip), wp)
         of_p = 1.0_wp - of_q
         edge(1) = vertex(i, 1, 2) - vertex(i, 1, 1)
         edge(2) = vertex(i, 2, 2) - vertex(i, 2, 1)
         from(1) = vertex(i, 1, 1) + of_q*batch%offset(i, 1)
         from(2) = vertex(i, 2, 1) + of_q*batch%offset(i, 2)
         to(1) = vertex(i, 1, 3) + of_p*batch%offset(i, 1)
         to(2) = vertex(i, 2, 3) + of_p*batch%offset(i, 2)
         nearer = min(lead(edge, vertex(i, :, 3), vertex(i, :, 4)), lead(edge, vertex(i, :, 3), vertex(i, :, 5)))
         sure(i) = min(min(sure(i), nearer), &
                       min(far*batch%radius(i, 1) - max(max(abs(from(1)), abs(from(2))), max(abs(to(1)), abs(to(2)))), &
                           -surely_apart*batch%radius(i, 1)*(abs(edge(1)) + abs(edge(2))) &
                           - (edge(1)*(to(2) - from(2)) - edge(2)*(to(1) - from(1)))))
      end do
   end subroutine test_corners

   !> Find whether a remembered edge still separates the polygons.
   !>
   !> This is decided at the remembered corner if both its neighbours are surely farther out; in a convex polygon no
   !> corner is nearer then. Otherwise all corners are tested. If the answer is yes, exact arithmetic finds the
   !> polygons apart, no lens is certified, and general clipping finds no overlap. So the answer saves time and
   !> changes no result.
   pure subroutine test_separation(p, q, offset, radius_p, memory, apart)
      !> Vertices of P and of Q, anticlockwise, each relative to its own centre, (2, n) and (2, m) [m]
      real(wp), intent(in), contiguous :: p(:, :), q(:, :)
      !> Centre of Q minus centre of P [m]
      real(wp), intent(in) :: offset(2)
      !> Radius of P, not greater than that of Q [m]
      real(wp), intent(in) :: radius_p
      !> What is remembered, any integer; the corner is brought up to date
      integer(ip), intent(inout) :: memory
      !> Whether the polygons are apart; false if no edge is remembered
      logical, intent(out) :: apart
      integer(ip) :: edge, corner
      logical :: of_q

      apart = .false.
      if (memory >= 0_ip) return
      call unpack_edge(memory, of_q, edge, corner)
      if (of_q) then
         if (edge >= size(q, 2) .or. corner >= size(p, 2)) return
         call test_line(line_of(q, edge + 1_ip, -offset, offset, radius_p), p, corner, apart)
      else
         if (edge >= size(p, 2) .or. corner >= size(q, 2)) return
         call test_line(line_of(p, edge + 1_ip, offset, [0.0_wp, 0.0_wp], radius_p), q, corner, apart)
      end if
      if (apart) memory = packed_edge(of_q, edge, corner)
   end subroutine test_separation

   !> Line of an edge of polygon A, for depths of corners of polygon B.
   pure type(line_t) function line_of(a, k, offset, centre, s) result(line)
      real(wp), intent(in), contiguous :: a(:, :)
      !> The edge, from 1
      integer(ip), intent(in) :: k
      !> Centre of B minus centre of A
      real(wp), intent(in) :: offset(2)
      !> Centre of A minus centre of P
      real(wp), intent(in) :: centre(2)
      !> Radius of P
      real(wp), intent(in) :: s

      line%start = a(:, k)
      line%end = a(:, merge(1_ip, k + 1_ip, k == size(a, 2, kind=ip)))
      line%edge = line%end - line%start
      line%limit = far*s
      line%level = -surely_apart*s*(abs(line%edge(1)) + abs(line%edge(2)))
      line%offset = offset
      ! One of both centres is that of P, so these sums are exact up to one rounding.
      line%from = line%start + centre
      line%centre_b = centre + offset
      line%plain = max(abs(line%from(1)), abs(line%from(2))) <= line%limit
   end function line_of

   !> Depth of a point of B below a line, times the length of the edge
   pure real(wp) function depth_of(line, point)
      type(line_t), intent(in) :: line
      real(wp), intent(in) :: point(2)
      real(wp) :: place(2)

      place = point + line%centre_b
      if (line%plain .and. max(abs(place(1)), abs(place(2))) <= line%limit) then
         depth_of = line%edge(1)*(place(2) - line%from(2)) - line%edge(2)*(place(1) - line%from(1))
      else
         depth_of = exact_cross(line%start, line%end, line%offset, point)
      end if
   end function depth_of

   !> How much deeper one point is than another beyond rounding errors, which are 4 u of each product at most
   pure real(wp) function lead(edge, point, other)
      real(wp), intent(in) :: edge(2), point(2), other(2)
      real(wp) :: plus, minus

      plus = edge(1)*(point(2) - other(2))
      minus = edge(2)*(point(1) - other(1))
      lead = plus - minus - 4.0_wp*epsilon(1.0_wp)*(abs(plus) + abs(minus))
   end function lead

   !> Find whether all corners of polygon B are outside of a line.
   pure subroutine test_line(line, b, corner, apart)
      type(line_t), intent(in) :: line
      real(wp), intent(in), contiguous :: b(:, :)
      !> The corner to test first, from 0; the deepest one afterwards if all were tested
      integer(ip), intent(inout) :: corner
      logical, intent(out) :: apart
      real(wp) :: highest, depth
      integer(ip) :: n, v

      n = size(b, 2, kind=ip)
      v = corner + 1_ip
      apart = depth_of(line, b(:, v)) < line%level
      if (.not. apart) return
      if (lead(line%edge, b(:, v), b(:, merge(n, v - 1_ip, v == 1_ip))) > 0.0_wp) then
         if (lead(line%edge, b(:, v), b(:, merge(1_ip, v + 1_ip, v == n))) > 0.0_wp) return
      end if
      highest = -huge(1.0_wp)
      do v = 1_ip, n
         depth = depth_of(line, b(:, v))
         if (depth > highest) corner = v - 1_ip
         highest = max(highest, depth)
      end do
      apart = highest < line%level
   end subroutine test_line

   !> Memory of an edge that general clipping has found to separate the polygons
   pure integer(ip) function remembered_edge(p, q, separating_edge)
      !> Vertices of P and of Q, (2, n) and (2, m)
      real(wp), intent(in), contiguous :: p(:, :), q(:, :)
      !> +k from vertex k of P, -k from vertex k of Q, 0 none
      integer(ip), intent(in) :: separating_edge

      remembered_edge = 0_ip
      if (separating_edge > size(p, 2) .or. -separating_edge > size(q, 2)) return
      if (separating_edge > 0_ip) then
         remembered_edge = packed_edge(.false., separating_edge - 1_ip, nearest_corner(p, separating_edge, q))
      else if (separating_edge < 0_ip) then
         remembered_edge = packed_edge(.true., -separating_edge - 1_ip, nearest_corner(q, -separating_edge, p))
      end if
   end function remembered_edge

   !> Corner of polygon B, from 0, that is farthest on the inner side of an edge of polygon A
   pure integer(ip) function nearest_corner(a, k, b)
      real(wp), intent(in), contiguous :: a(:, :), b(:, :)
      integer(ip), intent(in) :: k
      real(wp) :: edge(2), depth, highest
      integer(ip) :: v

      edge = a(:, merge(1_ip, k + 1_ip, k == size(a, 2, kind=ip))) - a(:, k)
      highest = -huge(1.0_wp)
      nearest_corner = 0_ip
      do v = 1_ip, size(b, 2, kind=ip)
         depth = edge(1)*b(2, v) - edge(2)*b(1, v)
         if (depth > highest) nearest_corner = v - 1_ip
         highest = max(highest, depth)
      end do
   end function nearest_corner

end module polydem_separation
