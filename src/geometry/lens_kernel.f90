!> Overlap of pairs of polygons P and Q whose outlines cross twice, for all lanes of a batch at a time.
!>
!> Such an overlap is a *lens*: its outline is one arc of P inside Q and one arc of Q inside P. P enters Q at the
!> first crossing X, where its edge from p0 to p1 meets the edge of Q from q2 to q3, and leaves it at the second
!> crossing Y, where its edge from p2 to p3 meets the edge of Q from q0 to q1. The corners between are p1 to p2 of P
!> and q1 to q2 of Q, none, one or two of each.
!>
!> Certificate. What is remembered may be wrong. A lane is certified if the signs of eight cross products beyond their
!> rounding errors show that both pairs of edges cross properly, and others show that the corners between are inside
!> the other polygon: inside its edges from q0 to q3, and inside the fan of these edges about its centre, where its
!> outline has no other edges. Each arc then is in the other polygon, since that is convex. So both arcs together
!> belong to the outline of the intersection, and since they close they are all of it. Hence there are no other
!> crossings, no other lens can be certified, and a search without memory finds this one: the result does not depend
!> on what is remembered.
!>
!> Symmetry. If the radii are equal, coordinates are relative to the middle between the centres, X is computed on the
!> entering edge of P and Y on that of Q, and sums run over the two arcs alike. To exchange P and Q then exchanges X and
!> Y and changes no bit but signs. A turn by a right angle and powers of two change no bit either. If the radii differ,
!> coordinates are relative to the centre of P, and both crossings are computed on the edges of P: errors scale with P.
!>
!> There are no branches, so that the compiler handles several lanes at a time. A division by a difference that is zero
!> or tiny only without a certificate has a least divisor, which changes no certified bit.
module polydem_lens_kernel
   use polydem_kinds, only: ip, wp
   use polydem_lens_effective_area, only: integrate_effective_area
   use polydem_overlap_batch, only: column_length, overlap_batch_t, overlap_columns_t
   use polydem_overlap_tolerances, only: far, no_length, sure, sure_area, sure_in_fan
   use polydem_pair_memory, only: lens_bits, most_lens_corners
   implicit none
   private
   public :: evaluate_batch

   !> Added to a number that does not count in a minimum
   real(wp), parameter :: huge_number = 2.0_wp**(maxexponent(1.0_wp)/2)
   real(wp), parameter :: third = 1.0_wp/3.0_wp

contains

   !> Evaluate some lanes.
   pure subroutine evaluate_batch(batch, from, to, turned, effective, columns)
      !> The batch
      type(overlap_batch_t), intent(inout) :: batch
      !> First lane
      integer(ip), intent(in) :: from
      !> Last lane
      integer(ip), intent(in) :: to
      !> Vertices of all polygons, anticlockwise, each relative to its own centre, (2, n) [m]
      real(wp), intent(in), contiguous :: turned(:, :)
      !> Whether to compute the effective area (see `polydem_effective_area`) instead of the area
      logical, intent(in) :: effective
      !> The overlaps; these lanes are written
      type(overlap_columns_t), intent(inout) :: columns

      call unpack_lenses(from, to, batch)
      call prepare(from, to, batch)
      call gather_corners(from, to, batch%vertex, size(turned, 2, kind=ip), turned, batch%corner)
      call cross_edges(from, to, batch%corner(:, :, :, 1), batch%centre(:, 1:2), batch%corner(:, :, :, 2), &
                       batch%centre(:, 3:4), batch%scale, batch%on_entering(:, 1), batch%crossing(:, :, 1), &
                       batch%certified)
      call cross_edges(from, to, batch%corner(:, :, :, 2), batch%centre(:, 3:4), batch%corner(:, :, :, 1), &
                       batch%centre(:, 1:2), batch%scale, batch%on_entering(:, 2), batch%crossing(:, :, 2), &
                       batch%certified)
      call test_corners(from, to, batch%corner(:, :, :, 1), batch%centre(:, 1:2), batch%corner(:, :, :, 2), &
                        batch%centre(:, 3:4), batch%radius(:, 1), batch%radius(:, 2), batch%ignored(:, :, 1), &
                        batch%certified)
      call test_corners(from, to, batch%corner(:, :, :, 2), batch%centre(:, 3:4), batch%corner(:, :, :, 1), &
                        batch%centre(:, 1:2), batch%radius(:, 1), batch%radius(:, 1), batch%ignored(:, :, 2), &
                        batch%certified)
      if (effective) then
         call integrate_effective_area(from, to, batch, columns)
      else
         call integrate_area(from, to, batch, columns)
      end if
   end subroutine evaluate_batch

   !> Find the vertices of the lenses that are remembered.
   !>
   !> These are whole numbers, and -1 is true, so that the compiler handles several lanes at a time. Where nothing is
   !> remembered that these polygons can have, the first edges are taken.
   pure subroutine unpack_lenses(from, to, batch)
      integer(ip), intent(in) :: from
      integer(ip), intent(in) :: to
      type(overlap_batch_t), intent(inout) :: batch
      integer(ip), parameter :: mask = 2_ip**lens_bits - 1_ip
      integer(ip) :: i, edge(4), inside_p, inside_q, possible

      do i = from, to
         edge(1) = iand(batch%memory(i), mask)
         edge(2) = iand(shiftr(batch%memory(i), lens_bits), mask)
         edge(3) = iand(shiftr(batch%memory(i), 2*lens_bits), mask)
         edge(4) = iand(shiftr(batch%memory(i), 3*lens_bits), mask)
         inside_p = edge(2) - edge(1)
         inside_p = inside_p + iand(shifta(inside_p, 31), batch%corners(i, 1))
         inside_q = edge(4) - edge(3)
         inside_q = inside_q + iand(shifta(inside_q, 31), batch%corners(i, 2))
         ! A lens has edges that exist, and at most two corners of each body inside the other. The search without
         ! memory leaves polygons with more corners than can be remembered to clipping.
         possible = iand(not(shifta(batch%memory(i), 31)), less(max(inside_p, inside_q), 3_ip))
         possible = iand(possible, iand(less(max(edge(1), edge(2)), batch%corners(i, 1)), &
                                        less(max(edge(3), edge(4)), batch%corners(i, 2))))
         possible = iand(possible, less(max(batch%corners(i, 1), batch%corners(i, 2)), most_lens_corners + 1_ip))
         batch%possible(i) = iand(1_ip, possible)
         batch%inner(i, 1) = iand(inside_p, possible)
         batch%inner(i, 2) = iand(inside_q, possible)
         batch%vertex(i, 1) = batch%start(i, 1) + iand(edge(1), possible)
         batch%vertex(i, 2) = batch%start(i, 1) + next(iand(edge(1), possible), batch%corners(i, 1))
         batch%vertex(i, 3) = batch%start(i, 1) + iand(edge(2), possible)
         batch%vertex(i, 4) = batch%start(i, 1) + next(iand(edge(2), possible), batch%corners(i, 1))
         batch%vertex(i, 5) = batch%start(i, 2) + iand(edge(3), possible)
         batch%vertex(i, 6) = batch%start(i, 2) + next(iand(edge(3), possible), batch%corners(i, 2))
         batch%vertex(i, 7) = batch%start(i, 2) + iand(edge(4), possible)
         batch%vertex(i, 8) = batch%start(i, 2) + next(iand(edge(4), possible), batch%corners(i, 2))
      end do
   end subroutine unpack_lenses

   !> -1 if the first number is less than the second one, otherwise 0; their difference must not overflow
   elemental integer(ip) function less(a, b)
      integer(ip), intent(in) :: a, b

      less = shifta(a - b, 31)
   end function less

   !> Corner behind another of n, counted from 0
   elemental integer(ip) function next(corner, n)
      integer(ip), intent(in) :: corner, n

      next = iand(corner + 1_ip, less(corner + 1_ip, n))
   end function next

   !> Prepare the numbers that the tests need.
   pure subroutine prepare(from, to, batch)
      integer(ip), intent(in) :: from
      integer(ip), intent(in) :: to
      type(overlap_batch_t), intent(inout) :: batch
      real(wp) :: equal, half, two_p, two_q
      integer(ip) :: i

      do i = from, to
         equal = merge(0.0_wp, 1.0_wp, batch%radius(i, 1) < batch%radius(i, 2))
         half = 0.5_wp*equal
         batch%centre(i, 1) = -half*batch%offset(i, 1)
         batch%centre(i, 2) = -half*batch%offset(i, 2)
         batch%centre(i, 3) = batch%offset(i, 1) + batch%centre(i, 1)
         batch%centre(i, 4) = batch%offset(i, 2) + batch%centre(i, 2)
         batch%on_entering(i, 1) = 1.0_wp
         batch%on_entering(i, 2) = equal
         batch%scale(i, 1) = batch%radius(i, 1)
         batch%scale(i, 2) = (1.0_wp - half)*far*batch%radius(i, 1)
         batch%some(i, 1) = real(min(1_ip, batch%inner(i, 1)), wp)
         batch%some(i, 2) = real(min(1_ip, batch%inner(i, 2)), wp)
         two_p = real(shiftr(batch%inner(i, 1), 1), wp)
         two_q = real(shiftr(batch%inner(i, 2), 1), wp)
         batch%ignored(i, 1, 1) = huge_number*(1.0_wp - batch%some(i, 1))
         batch%ignored(i, 2, 1) = huge_number*(1.0_wp - two_q)
         batch%ignored(i, 1, 2) = huge_number*(1.0_wp - batch%some(i, 2))
         batch%ignored(i, 2, 2) = huge_number*(1.0_wp - two_p)
         batch%certified(i) = real(batch%possible(i), wp)
      end do
   end subroutine prepare

   !> Copy the vertices that the lanes name.
   pure subroutine gather_corners(from, to, vertex, n, turned, corner)
      integer(ip), intent(in) :: from
      integer(ip), intent(in) :: to
      integer(ip), intent(in) :: vertex(column_length, 8)
      !> Number of vertices
      integer(ip), intent(in) :: n
      real(wp), intent(in) :: turned(2, n)
      real(wp), intent(inout) :: corner(column_length, 2, 8)
      integer(ip) :: lane, k

      do k = 1_ip, 8_ip
         do lane = from, to
            corner(lane, 1, k) = turned(1, vertex(lane, k))
            corner(lane, 2, k) = turned(2, vertex(lane, k))
         end do
      end do
   end subroutine gather_corners

   !> Find the crossing where polygon A enters polygon B, and how far the signs that show it exceed their errors.
   !>
   !> The edge of A begins outside that of B and ends inside, the edge of B begins inside that of A and ends outside.
   pure subroutine cross_edges(from, to, a, centre_a, b, centre_b, scale, on_entering, crossing, certified)
      integer(ip), intent(in) :: from
      integer(ip), intent(in) :: to
      !> Vertices of A; 1 to 2 is the entering edge
      real(wp), intent(in) :: a(column_length, 2, 4)
      real(wp), intent(in) :: centre_a(column_length, 2)
      !> Vertices of B; 3 to 4 is its edge that leaves A
      real(wp), intent(in) :: b(column_length, 2, 4)
      real(wp), intent(in) :: centre_b(column_length, 2)
      real(wp), intent(in) :: scale(column_length, 2)
      real(wp), intent(in) :: on_entering(column_length)
      real(wp), intent(inout) :: crossing(column_length, 2)
      !> Stays positive if the edges cross properly and are near
      real(wp), intent(inout) :: certified(column_length)
      real(wp) :: ex, ey, fx, fy, a1x, a1y, a2x, a2y, b1x, b1y, b2x, b2y, in_f(2), in_e(2), limit_e, limit_f
      real(wp) :: reach, on_e, on_f, inner, across, share
      integer(ip) :: i

      do i = from, to
         ex = a(i, 1, 2) - a(i, 1, 1)
         ey = a(i, 2, 2) - a(i, 2, 1)
         fx = b(i, 1, 4) - b(i, 1, 3)
         fy = b(i, 2, 4) - b(i, 2, 3)
         a1x = a(i, 1, 1) + centre_a(i, 1)
         a1y = a(i, 2, 1) + centre_a(i, 2)
         a2x = a(i, 1, 2) + centre_a(i, 1)
         a2y = a(i, 2, 2) + centre_a(i, 2)
         b1x = b(i, 1, 3) + centre_b(i, 1)
         b1y = b(i, 2, 3) + centre_b(i, 2)
         b2x = b(i, 1, 4) + centre_b(i, 1)
         b2y = b(i, 2, 4) + centre_b(i, 2)
         in_f(1) = fx*(a1y - b1y) - fy*(a1x - b1x)
         in_f(2) = fx*(a2y - b1y) - fy*(a2x - b1x)
         in_e(1) = ex*(b1y - a1y) - ey*(b1x - a1x)
         in_e(2) = ex*(b2y - a1y) - ey*(b2x - a1x)
         limit_e = sure*scale(i, 1)*(abs(ex) + abs(ey))
         limit_f = sure*scale(i, 1)*(abs(fx) + abs(fy))
         reach = max(max(max(abs(a1x), abs(a1y)), max(abs(a2x), abs(a2y))), &
                     max(max(abs(b1x), abs(b1y)), max(abs(b2x), abs(b2y))))
         certified(i) = min(min(certified(i), scale(i, 2) - reach), &
                            min(min(-in_f(1), in_f(2)) - limit_f, min(in_e(1), -in_e(2)) - limit_e))
         on_e = on_entering(i)
         on_f = 1.0_wp - on_e
         inner = on_e*in_f(2) + on_f*in_e(1)
         across = on_e*(in_f(2) - in_f(1)) + on_f*(in_e(1) - in_e(2))
         share = inner/max(across, max(abs(inner), tiny(1.0_wp)))
         crossing(i, 1) = (on_e*a2x + on_f*b1x) + share*(on_f*fx - on_e*ex)
         crossing(i, 2) = (on_e*a2y + on_f*b1y) + share*(on_f*fy - on_e*ey)
      end do
   end subroutine cross_edges

   !> Test whether the corners of polygon A between the crossings are inside polygon B.
   pure subroutine test_corners(from, to, a, centre_a, b, centre_b, scale, radius_b, ignored, certified)
      integer(ip), intent(in) :: from
      integer(ip), intent(in) :: to
      !> Vertices of A; 2 and 3 are the corners to test, the same one if there is only one
      real(wp), intent(in) :: a(column_length, 2, 4)
      real(wp), intent(in) :: centre_a(column_length, 2)
      !> Vertices of B; 2 to 3 is an edge if it has two corners inside A
      real(wp), intent(in) :: b(column_length, 2, 4)
      real(wp), intent(in) :: centre_b(column_length, 2)
      !> Radius of P
      real(wp), intent(in) :: scale(column_length)
      real(wp), intent(in) :: radius_b(column_length)
      !> Great if A has no such corners, and great if B does not have two of them inside A
      real(wp), intent(in) :: ignored(column_length, 2)
      !> Stays positive if they are inside
      real(wp), intent(inout) :: certified(column_length)
      real(wp) :: a2x, a2y, a3x, a3y, armx, army, in_edges, in_middle, in_fan, ex, ey, limit
      integer(ip) :: i

      do i = from, to
         a2x = a(i, 1, 2) + centre_a(i, 1)
         a2y = a(i, 2, 2) + centre_a(i, 2)
         a3x = a(i, 1, 3) + centre_a(i, 1)
         a3y = a(i, 2, 3) + centre_a(i, 2)
         limit = sure*scale(i)
         ! The crossings show the first corner inside the edge where B leaves, the last one inside that where B enters.
         ex = b(i, 1, 2) - b(i, 1, 1)
         ey = b(i, 2, 2) - b(i, 2, 1)
         in_edges = ex*(a2y - (b(i, 2, 1) + centre_b(i, 2))) - ey*(a2x - (b(i, 1, 1) + centre_b(i, 1))) &
                    - limit*(abs(ex) + abs(ey))
         ex = b(i, 1, 4) - b(i, 1, 3)
         ey = b(i, 2, 4) - b(i, 2, 3)
         in_edges = min(in_edges, ex*(a3y - (b(i, 2, 3) + centre_b(i, 2))) - ey*(a3x - (b(i, 1, 3) + centre_b(i, 1))) &
                        - limit*(abs(ex) + abs(ey)))
         ex = b(i, 1, 3) - b(i, 1, 2)
         ey = b(i, 2, 3) - b(i, 2, 2)
         armx = b(i, 1, 2) + centre_b(i, 1)
         army = b(i, 2, 2) + centre_b(i, 2)
         in_middle = min(ex*(a2y - army) - ey*(a2x - armx), ex*(a3y - army) - ey*(a3x - armx)) &
                     - limit*(abs(ex) + abs(ey))
         a2x = a2x - centre_b(i, 1)
         a2y = a2y - centre_b(i, 2)
         a3x = a3x - centre_b(i, 1)
         a3y = a3y - centre_b(i, 2)
         in_fan = min(min(b(i, 1, 1)*a2y - b(i, 2, 1)*a2x, a2x*b(i, 2, 4) - a2y*b(i, 1, 4)), &
                      min(b(i, 1, 1)*a3y - b(i, 2, 1)*a3x, a3x*b(i, 2, 4) - a3y*b(i, 1, 4))) &
                  - sure_in_fan*radius_b(i)*radius_b(i)
         certified(i) = min(certified(i), &
                            min(min(in_edges, in_fan), in_middle + ignored(i, 2)) + ignored(i, 1))
      end do
   end subroutine test_corners

   !> Area, its gradient, moments and centroid of all lenses.
   pure subroutine integrate_area(from, to, batch, columns)
      integer(ip), intent(in) :: from
      integer(ip), intent(in) :: to
      type(overlap_batch_t), intent(inout) :: batch
      type(overlap_columns_t), intent(inout) :: columns
      real(wp) :: zx, zy, mx, my, v1x, v1y, v2x, v2y, w1x, w1y, w2x, w2y, part(4), arc_p, arc_q, twice, wx, wy, scale
      integer(ip) :: i

      do i = from, to
         zx = batch%crossing(i, 1, 2) - batch%crossing(i, 1, 1)
         zy = batch%crossing(i, 2, 2) - batch%crossing(i, 2, 1)
         mx = 0.5_wp*(batch%crossing(i, 1, 1) + batch%crossing(i, 1, 2))
         my = 0.5_wp*(batch%crossing(i, 2, 1) + batch%crossing(i, 2, 2))
         v1x = batch%some(i, 1)*((batch%corner(i, 1, 2, 1) + batch%centre(i, 1)) - batch%crossing(i, 1, 1))
         v1y = batch%some(i, 1)*((batch%corner(i, 2, 2, 1) + batch%centre(i, 2)) - batch%crossing(i, 2, 1))
         v2x = batch%some(i, 1)*((batch%corner(i, 1, 3, 1) + batch%centre(i, 1)) - batch%crossing(i, 1, 1))
         v2y = batch%some(i, 1)*((batch%corner(i, 2, 3, 1) + batch%centre(i, 2)) - batch%crossing(i, 2, 1))
         w1x = batch%some(i, 2)*((batch%corner(i, 1, 2, 2) + batch%centre(i, 3)) - batch%crossing(i, 1, 2))
         w1y = batch%some(i, 2)*((batch%corner(i, 2, 2, 2) + batch%centre(i, 4)) - batch%crossing(i, 2, 2))
         w2x = batch%some(i, 2)*((batch%corner(i, 1, 3, 2) + batch%centre(i, 3)) - batch%crossing(i, 1, 2))
         w2y = batch%some(i, 2)*((batch%corner(i, 2, 3, 2) + batch%centre(i, 4)) - batch%crossing(i, 2, 2))
         ! Each arc with the chord, as a fan from its first crossing
         part(1) = v1x*v2y - v1y*v2x
         part(2) = v2x*zy - v2y*zx
         part(3) = w1x*w2y - w1y*w2x
         part(4) = w2y*zx - w2x*zy
         arc_p = part(1) + part(2)
         arc_q = part(3) + part(4)
         twice = arc_p + arc_q
         wx = (part(1)*(v1x + v2x) + part(2)*(v2x + zx)) + (part(3)*(w1x + w2x) + part(4)*(w2x - zx))
         wy = (part(1)*(v1y + v2y) + part(2)*(v2y + zy)) + (part(3)*(w1y + w2y) + part(4)*(w2y - zy))
         scale = 1.0_wp/max(twice, sure_area*batch%scale(i, 1)*batch%scale(i, 1))
         wx = mx + scale*(0.5_wp*(arc_q - arc_p)*zx + third*wx)
         wy = my + scale*(0.5_wp*(arc_q - arc_p)*zy + third*wy)
         columns%area(i) = 0.5_wp*twice
         columns%arm_first(i, 1) = wx - batch%centre(i, 1)
         columns%arm_first(i, 2) = wy - batch%centre(i, 2)
         columns%arm_second(i, 1) = wx - batch%centre(i, 3)
         columns%arm_second(i, 2) = wy - batch%centre(i, 4)
         columns%normal(i, 1) = zy
         columns%normal(i, 2) = -zx
         columns%length(i) = sqrt(zx*zx + zy*zy)
         columns%moment(i, 1) = -(zx*(mx - batch%centre(i, 1)) + zy*(my - batch%centre(i, 2)))
         columns%moment(i, 2) = -(zx*(mx - batch%centre(i, 3)) + zy*(my - batch%centre(i, 4)))
         batch%certified(i) = min(batch%certified(i), &
                                  min(columns%area(i) - sure_area*batch%scale(i, 1)*batch%scale(i, 1), &
                                      zx*zx + zy*zy - 4.0_wp*no_length**2*columns%area(i)))
      end do
   end subroutine integrate_area

end module polydem_lens_kernel
