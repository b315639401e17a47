!> Overlap of two convex polygons: area, centroid, and the integrals over its outline that the forces need.
!>
!> Outlines that cross twice are evaluated by the kernel of `polydem_lens_kernel`, all others by clipping. Which of both
!> depends on the polygons alone. So does the result: what is remembered from the last step only saves time.
module polydem_convex_overlap
   use polydem_clipping, only: clip_overlap
   use polydem_evaluate_batch, only: evaluate_batch
   use polydem_instruction_set, only: isa_base
   use polydem_kinds, only: ip, wp
   use polydem_lens_search, only: cross_at, search_pair
   use polydem_overlap_batch, only: add_lane, overlap_batch_t, overlap_columns_t
   use polydem_overlap_integrals, only: overlap_t
   use polydem_overlap_measure, only: overlap_measure_t, true_area
   use polydem_feature_cache, only: most_lens_corners, unpack_edge
   use polydem_polygon, only: greatest_radius
   use polydem_separation, only: remembered_edge, test_separation
   implicit none
   private
   public :: overlap_t, find_overlap, overlap_polygons

contains

   !> Overlap of polygons P and Q without memory, and what to remember.
   !>
   !> A lens that is not certified often lasts for many steps, for example where equal squares rest on each other. The
   !> caller may remember it as `rejected`. While the polygons cross there, a search can find no other lens, and only
   !> clipping remains.
   pure subroutine find_overlap(p, q, offset, radius_p, radius_q, measure, overlap, features, rejected)
      !> Vertices of P and of Q, anticlockwise, each relative to its own centre, which is inside, (2, n) and (2, m) [m]
      real(wp), intent(in), contiguous :: p(:, :), q(:, :)
      !> Centre of Q minus centre of P [m]
      real(wp), intent(in) :: offset(2)
      !> Greatest distance of a vertex from the centre, of P and of Q, that of P not greater than that of Q [m]
      real(wp), intent(in) :: radius_p, radius_q
      !> How the overlap is measured
      type(overlap_measure_t), intent(in) :: measure
      !> The overlap; a is P, b is Q
      type(overlap_t), intent(out) :: overlap
      !> What to remember: a certified lens (positive), a separating edge (negative), or nothing (0)
      integer(ip), intent(out) :: features
      !> A lens that the kernel has not certified for these polygons, or 0; on return the one that it does not certify
      integer(ip), intent(inout) :: rejected
      logical :: certified, searched

      searched = .true.
      if (rejected > 0_ip) searched = .not. cross_at(p, q, offset, radius_p, radius_q, rejected)
      if (searched) then
         rejected = 0_ip
         call search_pair(p, q, offset, radius_p, radius_q, features)
         if (features < 0_ip) return
         if (features > 0_ip) then
            call evaluate_lens(p, q, offset, radius_p, radius_q, measure, features, overlap, certified)
            if (certified) return
            rejected = features
         end if
      end if
      call clip_overlap(p, q, offset, radius_p, radius_q, measure, overlap)
      features = remembered_edge(p, q, overlap%separating_edge)
   end subroutine find_overlap

   !> Evaluate one lens.
   pure subroutine evaluate_lens(p, q, offset, radius_p, radius_q, measure, features, overlap, certified)
      real(wp), intent(in), contiguous :: p(:, :), q(:, :)
      real(wp), intent(in) :: offset(2), radius_p, radius_q
      type(overlap_measure_t), intent(in) :: measure
      !> The lens
      integer(ip), intent(in) :: features
      !> The overlap; not changed if it is not certified
      type(overlap_t), intent(inout) :: overlap
      logical, intent(out) :: certified
      real(wp) :: vertices(2, 2*most_lens_corners)
      type(overlap_batch_t) :: batch
      type(overlap_columns_t) :: columns
      integer(ip) :: n, m

      n = size(p, 2, kind=ip)
      m = size(q, 2, kind=ip)
      vertices(:, 1:n) = p
      vertices(:, n + 1_ip:n + m) = q
      call add_lane(batch, 1_ip, features, [1_ip, n, n + 1_ip, n + m], offset, radius_p, radius_q)
      call evaluate_batch(batch, 1_ip, vertices(:, 1:n + m), measure, isa_base, columns)
      certified = batch%certified(1) > 0.0_wp
      if (.not. certified) return
      overlap%area = columns%area(1)
      overlap%centroid = columns%arm_first(1, :)
      overlap%centroid_b = columns%arm_second(1, :)
      overlap%normal = columns%normal(1, :)
      overlap%moment_a = columns%moment(1, 1)
      overlap%moment_b = columns%moment(1, 2)
      overlap%length_square = columns%length_square(1)
      if (measure%with_area) overlap%of_area = columns%of_area(1, :)
   end subroutine evaluate_lens

   !> Overlap of two convex polygons in any order.
   pure subroutine overlap_polygons(a, b, offset, separating_edge, overlap, measure)
      !> Vertices of both polygons, anticlockwise, each relative to its own centre inside it, (2, n) and (2, m) [m]
      real(wp), intent(in), contiguous :: a(:, :), b(:, :)
      !> Centre of b minus centre of a [m]
      real(wp), intent(in) :: offset(2)
      !> Edge to try first: +k from vertex k of a, -k from vertex k of b, 0 none
      integer(ip), intent(in) :: separating_edge
      type(overlap_t), intent(out) :: overlap
      !> How the overlap is measured; default: by its true area
      type(overlap_measure_t), intent(in), optional :: measure
      real(wp) :: radius_a, radius_b
      type(overlap_measure_t) :: by

      by = true_area
      if (present(measure)) by = measure
      radius_a = greatest_radius(a)
      radius_b = greatest_radius(b)
      if (radius_a <= radius_b) then
         call overlap_in_roles(a, b, offset, radius_a, radius_b, separating_edge, by, overlap)
      else
         call overlap_in_roles(b, a, -offset, radius_b, radius_a, -separating_edge, by, overlap)
         overlap = overlap_t(area=overlap%area, centroid=overlap%centroid_b, centroid_b=overlap%centroid, &
                             normal=-overlap%normal, moment_a=-overlap%moment_b, moment_b=-overlap%moment_a, &
                             length_square=overlap%length_square, &
                             of_area=[-overlap%of_area(:3), overlap%of_area(4)], &
                             separating_edge=-overlap%separating_edge)
      end if
   end subroutine overlap_polygons

   !> As `overlap_polygons`, in the roles of P and Q
   pure subroutine overlap_in_roles(p, q, offset, radius_p, radius_q, separating_edge, measure, overlap)
      real(wp), intent(in), contiguous :: p(:, :), q(:, :)
      real(wp), intent(in) :: offset(2), radius_p, radius_q
      !> +k from vertex k of P, -k from vertex k of Q, 0 none
      integer(ip), intent(in) :: separating_edge
      type(overlap_measure_t), intent(in) :: measure
      type(overlap_t), intent(out) :: overlap
      integer(ip) :: features, rejected, edge, corner
      logical :: apart, of_q

      features = remembered_edge(p, q, separating_edge)
      call test_separation(p, q, offset, radius_p, features, apart)
      rejected = 0_ip
      if (.not. apart) call find_overlap(p, q, offset, radius_p, radius_q, measure, overlap, features, rejected)
      if (features >= 0_ip) return
      call unpack_edge(features, of_q, edge, corner)
      overlap%separating_edge = merge(-edge - 1_ip, edge + 1_ip, of_q)
   end subroutine overlap_in_roles

end module polydem_convex_overlap
