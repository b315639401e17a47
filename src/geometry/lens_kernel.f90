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
   use polydem_overlap_batch, only: column_length, overlap_batch_t
   use polydem_overlap_tolerances, only: far, no_length, sure, sure_area, sure_in_fan
   implicit none
   private
   public :: evaluate_batch

   !> Added to a number that does not count in a minimum
   real(wp), parameter :: huge_number = 2.0_wp**(maxexponent(1.0_wp)/2)
   real(wp), parameter :: third = 1.0_wp/3.0_wp

contains

   !> Evaluate some lanes.
   pure subroutine evaluate_batch(batch, from, to, turned, effective)
      !> The batch; its results are written
      type(overlap_batch_t), intent(inout) :: batch
      !> First lane
      integer(ip), intent(in) :: from
      !> Last lane
      integer(ip), intent(in) :: to
      !> Vertices of all polygons, anticlockwise, each relative to its own centre, (2, n) [m]
      real(wp), intent(in), contiguous :: turned(:, :)
      !> Whether to compute the effective area (see `polydem_effective_area`) instead of the area
      logical, intent(in) :: effective

      integer(ip) :: lane

      call gather_corners(from, to, batch%vertex, size(turned, 2, kind=ip), turned, batch%corner)
      call cross_edges(from, to, batch%corner(:, :, :, 1), batch%centre(:, 1:2), batch%corner(:, :, :, 2), &
                       batch%centre(:, 3:4), batch%scale, batch%on_entering(:, 1), batch%crossing(:, :, 1), &
                       batch%crossed(:, 1))
      call cross_edges(from, to, batch%corner(:, :, :, 2), batch%centre(:, 3:4), batch%corner(:, :, :, 1), &
                       batch%centre(:, 1:2), batch%scale, batch%on_entering(:, 2), batch%crossing(:, :, 2), &
                       batch%crossed(:, 2))
      call test_corners(from, to, batch%corner(:, :, :, 1), batch%centre(:, 1:2), batch%corner(:, :, :, 2), &
                        batch%centre(:, 3:4), batch%scale, batch%radius(:, 2), batch%two(:, 2), batch%inside(:, 1))
      call test_corners(from, to, batch%corner(:, :, :, 2), batch%centre(:, 3:4), batch%corner(:, :, :, 1), &
                        batch%centre(:, 1:2), batch%scale, batch%radius(:, 1), batch%two(:, 1), batch%inside(:, 2))
      do lane = from, to
         batch%certified(lane) = min(min(batch%crossed(lane, 1), batch%crossed(lane, 2)), &
                                     min(batch%inside(lane, 1) + huge_number*(1.0_wp - batch%some(lane, 1)), &
                                         batch%inside(lane, 2) + huge_number*(1.0_wp - batch%some(lane, 2))))
      end do
      if (effective) then
         call integrate_effective_area(from, to, batch)
      else
         call integrate_area(from, to, batch)
      end if
   end subroutine evaluate_batch

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
   pure subroutine cross_edges(from, to, a, centre_a, b, centre_b, scale, on_entering, crossing, crossed)
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
      !> Positive if the edges cross properly and are near
      real(wp), intent(inout) :: crossed(column_length)
      real(wp) :: ex, ey, fx, fy, a1x, a1y, a2x, a2y, b1x, b1y, b2x, b2y, in_f(2), in_e(2), limit_e, limit_f
      real(wp) :: share_e, share_f, reach
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
         crossed(i) = min(min(min(-in_f(1), in_f(2)) - limit_f, min(in_e(1), -in_e(2)) - limit_e), scale(i, 2) - reach)
         share_e = in_f(2)/max(in_f(2) - in_f(1), max(abs(in_f(2)), tiny(1.0_wp)))
         share_f = in_e(1)/max(in_e(1) - in_e(2), max(abs(in_e(1)), tiny(1.0_wp)))
         crossing(i, 1) = on_entering(i)*(a2x - share_e*ex) + (1.0_wp - on_entering(i))*(b1x + share_f*fx)
         crossing(i, 2) = on_entering(i)*(a2y - share_e*ey) + (1.0_wp - on_entering(i))*(b1y + share_f*fy)
      end do
   end subroutine cross_edges

   !> Find whether the corners of polygon A between the crossings are inside polygon B: `inside` is positive then.
   pure subroutine test_corners(from, to, a, centre_a, b, centre_b, scale, radius_b, two_of_b, inside)
      integer(ip), intent(in) :: from
      integer(ip), intent(in) :: to
      !> Vertices of A; 2 and 3 are the corners to test, the same one if there is only one
      real(wp), intent(in) :: a(column_length, 2, 4)
      real(wp), intent(in) :: centre_a(column_length, 2)
      !> Vertices of B; 2 to 3 is an edge if it has two corners inside A
      real(wp), intent(in) :: b(column_length, 2, 4)
      real(wp), intent(in) :: centre_b(column_length, 2)
      real(wp), intent(in) :: scale(column_length, 2)
      real(wp), intent(in) :: radius_b(column_length)
      real(wp), intent(in) :: two_of_b(column_length)
      real(wp), intent(inout) :: inside(column_length)
      real(wp) :: a2x, a2y, a3x, a3y, armx, army, in_edges, in_middle, in_fan, ex, ey, limit
      integer(ip) :: i

      do i = from, to
         a2x = a(i, 1, 2) + centre_a(i, 1)
         a2y = a(i, 2, 2) + centre_a(i, 2)
         a3x = a(i, 1, 3) + centre_a(i, 1)
         a3y = a(i, 2, 3) + centre_a(i, 2)
         limit = sure*scale(i, 1)
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
         inside(i) = min(min(in_edges, in_fan), in_middle + huge_number*(1.0_wp - two_of_b(i)))
      end do
   end subroutine test_corners

   !> Area, its gradient, moments and centroid of all lenses.
   pure subroutine integrate_area(from, to, batch)
      integer(ip), intent(in) :: from
      integer(ip), intent(in) :: to
      type(overlap_batch_t), intent(inout) :: batch
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
         batch%area(i) = 0.5_wp*twice
         batch%centroid(i, 1) = wx - batch%centre(i, 1)
         batch%centroid(i, 2) = wy - batch%centre(i, 2)
         batch%centroid(i, 3) = wx - batch%centre(i, 3)
         batch%centroid(i, 4) = wy - batch%centre(i, 4)
         batch%normal(i, 1) = zy
         batch%normal(i, 2) = -zx
         batch%length(i) = sqrt(zx*zx + zy*zy)
         batch%moment(i, 1) = -(zx*(mx - batch%centre(i, 1)) + zy*(my - batch%centre(i, 2)))
         batch%moment(i, 2) = -(zx*(mx - batch%centre(i, 3)) + zy*(my - batch%centre(i, 4)))
         batch%certified(i) = min(batch%certified(i), &
                                  min(batch%area(i) - sure_area*batch%scale(i, 1)*batch%scale(i, 1), &
                                      zx*zx + zy*zy - 4.0_wp*no_length**2*batch%area(i)))
      end do
   end subroutine integrate_area

end module polydem_lens_kernel
