!> Test of a remembered separating edge.
module polydem_separation
   use polydem_edge_kernel_avx2, only: find_separated_with_avx2 => find_separated
   use polydem_edge_kernel_base, only: find_separated, lead
   use polydem_exact_cross, only: exact_cross
   use polydem_instruction_set, only: isa_avx2
   use polydem_kinds, only: ip, wp
   use polydem_overlap_batch, only: column_length, lanes, overlap_batch_t
   use polydem_overlap_tolerances, only: far, surely_apart
   use polydem_feature_cache, only: packed_edge, unpack_edge
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
   pure subroutine test_edges(batch, n, n_vertices, turned, isa, apart)
      !> The batch: an edge is remembered in each lane; its corner is brought up to date
      type(overlap_batch_t), intent(inout) :: batch
      !> Number of lanes
      integer(ip), intent(in) :: n
      !> Number of vertices in the array
      integer(ip), intent(in) :: n_vertices
      !> Vertices of all polygons, anticlockwise, each relative to its own centre [m]
      real(wp), intent(in) :: turned(2, n_vertices)
      !> Instruction set of the kernels
      integer, intent(in) :: isa
      !> Whether the polygons of a lane are apart
      logical, intent(out) :: apart(lanes)
      real(wp) :: sure(column_length)
      integer(ip) :: i

      if (n == 0_ip) return
      if (isa == isa_avx2) then
         call find_separated_with_avx2(batch, n, n_vertices, turned, sure)
      else
         call find_separated(batch, n, n_vertices, turned, sure)
      end if
      do i = 1_ip, n
         apart(i) = sure(i) > 0.0_wp
         if (apart(i)) cycle
         associate (from => batch%start(i, :), to => batch%start(i, :) + batch%corners(i, :) - 1_ip)
            call test_separation(turned(:, from(1):to(1)), turned(:, from(2):to(2)), batch%offset(i, :), &
                                 batch%radius(i, 1), batch%features(i), apart(i))
         end associate
      end do
   end subroutine test_edges

   !> Find whether a remembered edge still separates the polygons.
   !>
   !> This is decided at the remembered corner if both its neighbours are surely farther out; in a convex polygon no
   !> corner is nearer then. Otherwise all corners are tested. If the answer is yes, exact arithmetic finds the
   !> polygons apart, no lens is certified, and general clipping finds no overlap. So the answer saves time and
   !> changes no result.
   pure subroutine test_separation(p, q, offset, radius_p, features, apart)
      !> Vertices of P and of Q, anticlockwise, each relative to its own centre, (2, n) and (2, m) [m]
      real(wp), intent(in), contiguous :: p(:, :), q(:, :)
      !> Centre of Q minus centre of P [m]
      real(wp), intent(in) :: offset(2)
      !> Radius of P, not greater than that of Q [m]
      real(wp), intent(in) :: radius_p
      !> What is remembered, any integer; the corner is brought up to date
      integer(ip), intent(inout) :: features
      !> Whether the polygons are apart; false if no edge is remembered
      logical, intent(out) :: apart
      integer(ip) :: edge, corner
      logical :: of_q

      apart = .false.
      if (features >= 0_ip) return
      call unpack_edge(features, of_q, edge, corner)
      if (of_q) then
         if (edge >= size(q, 2) .or. corner >= size(p, 2)) return
         call test_line(line_of(q, edge + 1_ip, -offset, offset, radius_p), p, corner, apart)
      else
         if (edge >= size(p, 2) .or. corner >= size(q, 2)) return
         call test_line(line_of(p, edge + 1_ip, offset, [0.0_wp, 0.0_wp], radius_p), q, corner, apart)
      end if
      if (apart) features = packed_edge(of_q, edge, corner)
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

   !> Whether a point of B is surely deeper below a line than another
   pure logical function leads(line, point, other)
      type(line_t), intent(in) :: line
      real(wp), intent(in) :: point(2), other(2)

      leads = lead(line%edge(1), line%edge(2), point(1) - other(1), point(2) - other(2)) > 0.0_wp
   end function leads

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
      if (leads(line, b(:, v), b(:, merge(n, v - 1_ip, v == 1_ip)))) then
         if (leads(line, b(:, v), b(:, merge(1_ip, v + 1_ip, v == n)))) return
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
