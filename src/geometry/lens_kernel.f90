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
!> Most lenses have at most one corner of each polygon, and near vertices. Loops over all lanes do what these need. The
!> other lanes are *rare*: loops over them alone do the rest.
!>
!> Loops over all lanes have no branches, so that the compiler handles several lanes at a time. A division by a
!> difference that is zero or tiny only without a certificate has a least divisor, which changes no certified bit.
module polydem_lens_kernel
   use polydem_gather_corners, only: gather_corners, less, next
   use polydem_kinds, only: ip, wp
   use polydem_lens_area, only: integrate_area
   use polydem_lens_effective_area, only: integrate_effective_area
   use polydem_lens_work, only: centre_of, cross, edge, from_centre, lens_work_t, placed
   use polydem_overlap_batch, only: column_length, overlap_batch_t, overlap_columns_t
   use polydem_overlap_measure, only: overlap_measure_t
   use polydem_overlap_tolerances, only: far, sure_at_edge, sure_in_fan
   use polydem_feature_cache, only: lens_bits, most_lens_corners
   implicit none
   private
   public :: evaluate_batch

   !> Added to a number that does not count in a minimum
   real(wp), parameter :: huge_number = 2.0_wp**(maxexponent(1.0_wp)/2)
   !> Coordinates up to this multiple of s are surely `far`
   real(wp), parameter :: near = far - 0.5_wp

contains

   !> Evaluate the first lanes of a batch.
   pure subroutine evaluate_batch(batch, n, turned, measure, columns)
      type(overlap_batch_t), intent(inout) :: batch
      !> Number of lanes
      integer(ip), intent(in) :: n
      !> Vertices of all polygons, anticlockwise, each relative to its own centre, (2, n) [m]
      real(wp), intent(in), contiguous :: turned(:, :)
      !> How the overlaps are measured
      type(overlap_measure_t), intent(in) :: measure
      !> The overlaps; these lanes are written
      type(overlap_columns_t), intent(inout) :: columns
      type(lens_work_t) :: lens

      call unpack_lenses(n, batch, lens)
      call prepare(n, batch, lens)
      call gather_corners(n, 8_ip, lens%vertex, size(turned, 2, kind=ip), turned, lens%corner)
      call find_crossings(n, lens)
      call test_corners(n, lens)
      call test_rare(lens)
      if (measure%has_moments) then
         call integrate_effective_area(n, measure, lens, columns)
      else
         call integrate_area(n, measure%with_area, lens, columns)
      end if
      batch%certified(:n) = lens%certified(:n)
   end subroutine evaluate_batch

   !> Find the vertices of the lenses that are remembered.
   !>
   !> These are whole numbers, and -1 is true, so that the compiler handles several lanes at a time. Where nothing is
   !> remembered that these polygons can have, the first edges are taken.
   pure subroutine unpack_lenses(n, batch, lens)
      integer(ip), intent(in) :: n
      type(overlap_batch_t), intent(in) :: batch
      type(lens_work_t), intent(inout) :: lens
      integer(ip), parameter :: mask = 2_ip**lens_bits - 1_ip
      integer(ip) :: i, edge(4), inside_p, inside_q, possible

      do i = 1_ip, n
         edge(1) = iand(batch%features(i), mask)
         edge(2) = iand(shiftr(batch%features(i), lens_bits), mask)
         edge(3) = iand(shiftr(batch%features(i), 2*lens_bits), mask)
         edge(4) = iand(shiftr(batch%features(i), 3*lens_bits), mask)
         inside_p = edge(2) - edge(1)
         inside_p = inside_p + iand(shifta(inside_p, 31), batch%corners(i, 1))
         inside_q = edge(4) - edge(3)
         inside_q = inside_q + iand(shifta(inside_q, 31), batch%corners(i, 2))
         ! A lens has edges that exist, and at most two corners of each body inside the other. The search without
         ! memory leaves polygons with more corners than can be remembered to clipping.
         possible = iand(not(shifta(batch%features(i), 31)), less(max(inside_p, inside_q), 3_ip))
         possible = iand(possible, iand(less(max(edge(1), edge(2)), batch%corners(i, 1)), &
                                        less(max(edge(3), edge(4)), batch%corners(i, 2))))
         possible = iand(possible, less(max(batch%corners(i, 1), batch%corners(i, 2)), most_lens_corners + 1_ip))
         lens%possible(i) = iand(1_ip, possible)
         lens%inner(i, 1) = iand(inside_p, possible)
         lens%inner(i, 2) = iand(inside_q, possible)
         edge = iand(edge, possible)
         lens%vertex(i, 1) = batch%start(i, 1) + edge(1)
         lens%vertex(i, 2) = batch%start(i, 1) + next(edge(1), batch%corners(i, 1))
         lens%vertex(i, 3) = batch%start(i, 1) + edge(2)
         lens%vertex(i, 4) = batch%start(i, 1) + next(edge(2), batch%corners(i, 1))
         lens%vertex(i, 5) = batch%start(i, 2) + edge(3)
         lens%vertex(i, 6) = batch%start(i, 2) + next(edge(3), batch%corners(i, 2))
         lens%vertex(i, 7) = batch%start(i, 2) + edge(4)
         lens%vertex(i, 8) = batch%start(i, 2) + next(edge(4), batch%corners(i, 2))
      end do
   end subroutine unpack_lenses

   !> Prepare the numbers that the tests need.
   pure subroutine prepare(n, batch, lens)
      integer(ip), intent(in) :: n
      type(overlap_batch_t), intent(in) :: batch
      type(lens_work_t), intent(inout) :: lens
      real(wp) :: half, usual(column_length)
      integer(ip) :: i

      do i = 1_ip, n
         lens%radius(i, 1) = batch%radius(i, 1)
         lens%radius(i, 2) = batch%radius(i, 2)
         lens%equal(i) = merge(0.0_wp, 1.0_wp, lens%radius(i, 1) < lens%radius(i, 2))
         half = 0.5_wp*lens%equal(i)
         lens%centre(i, 1) = -half*batch%offset(i, 1)
         lens%centre(i, 2) = -half*batch%offset(i, 2)
         lens%centre(i, 3) = batch%offset(i, 1) + lens%centre(i, 1)
         lens%centre(i, 4) = batch%offset(i, 2) + lens%centre(i, 2)
         lens%some(i, 1) = real(min(1_ip, lens%inner(i, 1)), wp)
         lens%some(i, 2) = real(min(1_ip, lens%inner(i, 2)), wp)
         lens%certified(i) = real(lens%possible(i), wp)
         usual(i) = min(real(1_ip - max(lens%inner(i, 1), lens%inner(i, 2)), wp), &
                        (1.0_wp - half)*near*lens%radius(i, 1) &
                        - (lens%radius(i, 2) + max(abs(lens%centre(i, 3)), abs(lens%centre(i, 4)))))
      end do
      lens%n_rare = 0_ip
      do i = 1_ip, n
         lens%rare(lens%n_rare + 1_ip) = i
         lens%n_rare = lens%n_rare + merge(1_ip, 0_ip, usual(i) < 0.0_wp)
      end do
   end subroutine prepare

   !> Find the crossings, and test whether the edges cross properly and are near.
   !>
   !> At a crossing, the edge of one polygon begins outside that of the other and ends inside, and the edge of the other
   !> begins inside that of the first and ends outside.
   pure subroutine find_crossings(n, lens)
      integer(ip), intent(in) :: n
      type(lens_work_t), intent(inout) :: lens
      complex(wp) :: p(4), q(4), e, f
      real(wp) :: x(2), y(2), in_e(2), in_f(2), of_p, of_q, on_q, on_p, inner, across, share
      integer(ip) :: i

      do i = 1_ip, n
         p(1) = placed(lens, i, 1, 1)
         p(2) = placed(lens, i, 2, 1)
         p(3) = placed(lens, i, 3, 1)
         p(4) = placed(lens, i, 4, 1)
         q(1) = placed(lens, i, 1, 2)
         q(2) = placed(lens, i, 2, 2)
         q(3) = placed(lens, i, 3, 2)
         q(4) = placed(lens, i, 4, 2)
         ! P enters Q.
         e = edge(lens, i, 1, 1)
         f = edge(lens, i, 3, 2)
         in_f = [cross(f, p(1) - q(3)), cross(f, p(2) - q(3))]
         in_e = [cross(e, q(3) - p(1)), cross(e, q(4) - p(1))]
         of_p = min(in_e(1), -in_e(2))
         of_q = min(-in_f(1), in_f(2))
         share = in_f(2)/max(in_f(2) - in_f(1), max(abs(in_f(2)), tiny(1.0_wp)))
         x(1) = real(p(2), wp) - share*real(e, wp)
         x(2) = aimag(p(2)) - share*aimag(e)
         ! Q enters P. The crossing is computed on the edge of P or, if the radii are equal, on that of Q.
         e = edge(lens, i, 3, 1)
         f = edge(lens, i, 1, 2)
         in_f = [cross(f, p(3) - q(1)), cross(f, p(4) - q(1))]
         in_e = [cross(e, q(1) - p(3)), cross(e, q(2) - p(3))]
         of_p = min(of_p, min(-in_e(1), in_e(2))) - sure_at_edge*lens%radius(i, 1)*lens%radius(i, 1)
         of_q = min(of_q, min(in_f(1), -in_f(2))) - sure_at_edge*lens%radius(i, 1)*lens%radius(i, 2)
         on_q = lens%equal(i)
         on_p = 1.0_wp - on_q
         inner = on_q*in_e(2) + on_p*in_f(1)
         across = on_q*(in_e(2) - in_e(1)) + on_p*(in_f(1) - in_f(2))
         share = inner/max(across, max(abs(inner), tiny(1.0_wp)))
         y(1) = (on_q*real(q(2), wp) + on_p*real(p(3), wp)) + share*(on_p*real(e, wp) - on_q*real(f, wp))
         y(2) = (on_q*aimag(q(2)) + on_p*aimag(p(3))) + share*(on_p*aimag(e) - on_q*aimag(f))
         lens%crossing(i, 1, 1) = x(1)
         lens%crossing(i, 2, 1) = x(2)
         lens%crossing(i, 1, 2) = y(1)
         lens%crossing(i, 2, 2) = y(2)
         lens%certified(i) = min(lens%certified(i), min(of_p, of_q))
      end do
   end subroutine find_crossings

   !> Greater magnitude of both coordinates
   pure real(wp) function extent(a)
      complex(wp), intent(in) :: a

      extent = max(abs(real(a, wp)), abs(aimag(a)))
   end function extent

   !> Test whether a corner between the crossings is inside the fan of the other polygon. If it is the only one of its
   !> polygon, the crossings show that it is inside the edges.
   pure subroutine test_corners(n, lens)
      integer(ip), intent(in) :: n
      type(lens_work_t), intent(inout) :: lens
      complex(wp) :: p, q
      real(wp) :: of_p, of_q
      integer(ip) :: i

      do i = 1_ip, n
         p = placed(lens, i, 2, 1) - centre_of(lens, i, 2)
         q = placed(lens, i, 2, 2) - centre_of(lens, i, 1)
         of_p = inside(from_centre(lens, i, 1, 2), p, from_centre(lens, i, 4, 2), lens%radius(i, 2))
         of_q = inside(from_centre(lens, i, 1, 1), q, from_centre(lens, i, 4, 1), lens%radius(i, 1))
         lens%certified(i) = min(lens%certified(i), min(of_p + ignored(lens%some(i, 1)), &
                                                        of_q + ignored(lens%some(i, 2))))
      end do
   end subroutine test_corners

   !> Positive if a point is surely between two vertices of a polygon, seen from its centre
   pure real(wp) function inside(first, point, last, radius)
      !> First vertex, point and last vertex relative to the centre
      complex(wp), intent(in) :: first, point, last
      !> Radius of the polygon
      real(wp), intent(in) :: radius

      inside = min(cross(first, point), cross(point, last)) - sure_in_fan*radius*radius
   end function inside

   !> Test what only rare lanes need: whether the vertices are near, and the corners where a polygon has two inside the
   !> other.
   pure subroutine test_rare(lens)
      type(lens_work_t), intent(inout) :: lens
      real(wp) :: reach
      integer(ip) :: i, k

      do k = 1_ip, lens%n_rare
         i = lens%rare(k)
         reach = max(max(max(extent(placed(lens, i, 1, 2)), extent(placed(lens, i, 2, 2))), &
                         max(extent(placed(lens, i, 3, 2)), extent(placed(lens, i, 4, 2)))), &
                     lens%radius(i, 1) + max(abs(lens%centre(i, 1)), abs(lens%centre(i, 2))))
         lens%certified(i) = min(lens%certified(i), (1.0_wp - 0.5_wp*lens%equal(i))*far*lens%radius(i, 1) - reach)
         if (lens%inner(i, 1) > 0_ip) call test_two(lens, i, 1, 2)
         if (lens%inner(i, 2) > 0_ip) call test_two(lens, i, 2, 1)
      end do
   end subroutine test_rare

   !> Test whether both corners of a body are inside the edges of the other, and the second one in its fan.
   pure subroutine test_two(lens, i, body, other)
      type(lens_work_t), intent(inout) :: lens
      !> The lane
      integer(ip), intent(in) :: i
      integer, intent(in) :: body, other
      complex(wp) :: p(2), f
      real(wp) :: edges

      p(1) = placed(lens, i, 2, body)
      p(2) = placed(lens, i, 3, body)
      ! The crossings show the first corner inside the edge where the other polygon leaves, the last one inside that
      ! where it enters.
      edges = min(cross(edge(lens, i, 1, other), p(1) - placed(lens, i, 1, other)), &
                  cross(edge(lens, i, 3, other), p(2) - placed(lens, i, 3, other)))
      f = edge(lens, i, 2, other)
      if (lens%inner(i, other) > 1_ip) edges = min(edges, min(cross(f, p(1) - placed(lens, i, 2, other)), &
                                                              cross(f, p(2) - placed(lens, i, 2, other))))
      edges = edges - sure_at_edge*lens%radius(i, 1)*lens%radius(i, other)
      lens%certified(i) = min(lens%certified(i), &
                              min(edges, inside(from_centre(lens, i, 1, other), p(2) - centre_of(lens, i, other), &
                                                from_centre(lens, i, 4, other), lens%radius(i, other))))
   end subroutine test_two

   !> A great number if a test of corners does not count
   pure real(wp) function ignored(counts)
      !> 1 or 0
      real(wp), intent(in) :: counts

      ignored = huge_number*(1.0_wp - counts)
   end function ignored

end module polydem_lens_kernel
