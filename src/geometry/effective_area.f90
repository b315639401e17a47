!> Effective area G of an overlap: the area of the parallelogram with the same determinant of second moments.
!>
!>     G^2 = 12 sqrt(det S),     S = integral of (x - c)(x - c)^T dA over the overlap, c its centroid
!>
!> Like the area A, G scales with the determinant of any linear map of the plane. G/A is therefore a constant of the
!> figure: 1 for all parallelograms, 1.0746 for all triangles, 0.9772 for all ellipses. Every convex figure lies between
!> the last two ((G/A)^2 is 12 times the square of the isotropy constant of convex geometry). Unlike A, G depends on
!> tilts: a strip of length w whose depth grows from d (1 - e) to d (1 + e) has
!>
!>     G = w d ((1 + e^2)(1 - e^2/3))^(1/4),     G^2 = w^2 d^2 (1 + e^2/3) + O(e^4)
!>
!> The second form is w^2 times the mean square depth, which is also the form of the energy of a bed of springs.
!>
!> If the outline moves outwards with speed u, S changes at the rate integral of (x - c)(x - c)^T u ds; the motion of c
!> has no influence. With G'/G = tr(S^-1 S')/4 follows
!>
!>     dG/dt = integral of (G/4) q u ds,     q(x) = (x - c)^T S^-1 (x - c)
!>
!> As for the area, the gradient is an integral over G_a, the part of the first polygon's outline inside the second,
!> here with the weight q G/4:
!>
!>     N = integral over G_a of (G/4) q n ds,     M_X = integral over G_a of (G/4) q (r - c_X) x n ds
!>     dG/dt = N . (v_a - v_b) + M_a w_a - M_b w_b
!>
!> Over the closed outline these integrals vanish: by the divergence theorem they equal the integrals of 2 S^-1 (x - c)
!> and 2 (x - c) x S^-1 (x - c) over the interior. The forces on the two bodies are therefore opposite. The weight is
!> never negative, and it stays continuous when corners appear or vanish. Along an edge the integrands are polynomials
!> of second and third degree, for which Simpson's rule is exact.
!>
!> Overlaps are slivers of depth d and length b. In coordinates at an angle to the sliver, det S would lose a factor
!> (d/b)^2 of its precision. In coordinates along the sliver, scaled to about 1 by 1, only the rounding errors of the
!> vertices remain.
module polydem_effective_area
   use polydem_kinds, only: ip, wp
   use polydem_overlap_integrals, only: overlap_t
   use polydem_overlap_measure, only: overlap_measure_t
   implicit none
   private
   public :: weigh_by_shape

contains

   !> Replace area, normal and moments of an overlap by those of a measure.
   !>
   !> `moment_a` is about the origin, `moment_b` about the clipper's centre. If rounding leaves the loop no area, the
   !> overlap becomes zero.
   pure subroutine weigh_by_shape(n, corners, vertex, on_clipper, offset, by, place, overlap)
      !> Number of vertices
      integer(ip), intent(in) :: n
      !> Capacity of the arrays, in vertices
      integer(ip), intent(in) :: corners
      !> Vertices, anticlockwise, (corner, x or y) [m]
      real(wp), intent(in) :: vertex(corners, 2)
      !> Whether the edge that starts at a vertex lies on the clipper's outline
      logical, intent(in) :: on_clipper(corners)
      !> Centre of the clipper [m]
      real(wp), intent(in) :: offset(2)
      !> How the overlap is measured, with moments
      type(overlap_measure_t), intent(in) :: by
      !> Work space: scaled coordinates, (corner, along or across)
      real(wp), intent(inout) :: place(corners, 2)
      !> The overlap with the true area; afterwards with that of the measure
      type(overlap_t), intent(inout) :: overlap
      real(wp) :: unit_area, square, moments(3), form(3), determinant, unit, even, moment
      real(wp) :: c(2), p(2), step(2), weight(3), along(2)
      integer(ip) :: i, j

      c = overlap%centroid
      call straighten(n, corners, vertex, place, square, unit_area)
      call measure(n, corners, place, moments)
      determinant = moments(1)*moments(3) - moments(2)**2
      if (.not. determinant > 0.0_wp) then
         overlap = overlap_t()
         return
      end if
      call find_weight(by, moments, determinant, square, unit_area, unit, form, even, overlap)
      overlap%normal = 0.0_wp
      moment = 0.0_wp
      do i = 1_ip, n
         if (.not. on_clipper(i)) cycle
         j = merge(1_ip, i + 1_ip, i == n)
         p = vertex(i, :) - c
         step = vertex(j, :) - vertex(i, :)
         ! Terms of Simpson's rule at both ends and in the middle (the latter four times as large)
         weight(1) = unit*level(place(i, 1), place(i, 2)) + even
         weight(2) = unit*level(place(j, 1), place(j, 2)) + even
         weight(3) = unit*level(place(i, 1) + place(j, 1), place(i, 2) + place(j, 2)) + 4.0_wp*even
         overlap%normal(1) = overlap%normal(1) + (weight(1) + weight(2) + weight(3))*step(2)
         overlap%normal(2) = overlap%normal(2) - (weight(1) + weight(2) + weight(3))*step(1)
         along(1) = step(1)*p(1) + step(2)*p(2)
         along(2) = along(1) + (step(1)*step(1) + step(2)*step(2))
         moment = moment - (weight(1)*along(1) + weight(2)*along(2) + weight(3)*0.5_wp*(along(1) + along(2)))
      end do
      overlap%moment_a = moment + (c(1)*overlap%normal(2) - c(2)*overlap%normal(1))
      overlap%moment_b = moment + ((c(1) - offset(1))*overlap%normal(2) - (c(2) - offset(2))*overlap%normal(1))

   contains

      !> The quadratic part of the weight at a point; that of the effective area is q times the determinant
      pure real(wp) function level(x, y)
         real(wp), intent(in) :: x, y

         level = form(3)*x*x - 2.0_wp*form(2)*x*y + form(1)*y*y
      end function level

   end subroutine weigh_by_shape

   !> Find area and length of an overlap, and the weight of its normal: a factor times a quadratic form, and a constant.
   pure subroutine find_weight(by, moments, determinant, square, unit_area, unit, form, even, overlap)
      type(overlap_measure_t), intent(in) :: by
      !> Second moments (xx, xy, yy) in scaled coordinates, and their determinant
      real(wp), intent(in) :: moments(3), determinant
      !> Square of the unit along the loop, and area of the unit square [m2]
      real(wp), intent(in) :: square, unit_area
      !> A sixth of the weight, as Simpson's rule needs it: factor and coefficients (yy, xy, xx) of the form, constant
      real(wp), intent(out) :: unit, form(3), even
      !> The overlap with the true area
      type(overlap_t), intent(inout) :: overlap
      real(wp) :: root, polar

      root = sqrt(12.0_wp*sqrt(determinant))
      unit = root/(24.0_wp*determinant)
      form = moments
      even = 0.0_wp
      if (by%per_length) then
         polar = square*moments(1) + unit_area*(unit_area/square)*moments(3)
         overlap%length_square = 12.0_wp*(unit_area*polar/overlap%area)
         root = overlap%area/unit_area
         even = 0.25_wp*(unit_area*root/overlap%area)
         polar = 1.0_wp/12.0_wp*(root/(unit*polar))
         form = -polar*[unit_area*(unit_area/square), 0.0_wp, square]
      end if
      overlap%area = unit_area*root
   end subroutine find_weight

   !> Coordinates of a loop along and across the line from its first vertex to the farthest one, scaled to about 1.
   pure subroutine straighten(n, corners, vertex, place, square, unit_area)
      integer(ip), intent(in) :: n, corners
      real(wp), intent(in) :: vertex(corners, 2)
      real(wp), intent(inout) :: place(corners, 2)
      !> Square of the unit along the line, and area of the unit square of the scaled coordinates [m2]
      real(wp), intent(out) :: square, unit_area
      real(wp) :: axis(2), arm(2), longest, scale
      integer(ip) :: i

      longest = 0.0_wp
      axis = 0.0_wp
      do i = 1_ip, n
         arm = vertex(i, :) - vertex(1, :)
         square = arm(1)*arm(1) + arm(2)*arm(2)
         if (square > longest) axis = arm
         longest = max(longest, square)
         place(i, :) = arm
      end do
      square = longest
      unit_area = 0.0_wp
      do i = 1_ip, n
         arm = place(i, :)
         place(i, 1) = axis(1)*arm(1) + axis(2)*arm(2)
         place(i, 2) = axis(1)*arm(2) - axis(2)*arm(1)
         unit_area = max(unit_area, abs(place(i, 2)))
      end do
      if (.not. unit_area > 0.0_wp) return
      scale = 1.0_wp/unit_area
      longest = 1.0_wp/longest
      do i = 1_ip, n
         place(i, 1) = place(i, 1)*longest
         place(i, 2) = place(i, 2)*scale
      end do
   end subroutine straighten

   !> Second moments (xx, xy, yy) of a loop about its centroid, 0 if it has no area. `place` becomes relative to the
   !> centroid.
   pure subroutine measure(n, corners, place, moments)
      integer(ip), intent(in) :: n, corners
      !> Scaled coordinates; the first vertex is at the origin
      real(wp), intent(inout) :: place(corners, 2)
      real(wp), intent(out) :: moments(3)
      real(wp) :: area, part, centre(2), p(2), q(2)
      integer(ip) :: i

      area = 0.0_wp
      centre = 0.0_wp
      do i = 2_ip, n - 1_ip
         p = place(i, :)
         q = place(i + 1_ip, :)
         part = p(1)*q(2) - p(2)*q(1)
         area = area + part
         centre = centre + part*(p + q)
      end do
      moments = 0.0_wp
      if (.not. area > 0.0_wp) return
      centre = centre/(3.0_wp*area)
      q = place(n, :) - centre
      do i = 1_ip, n
         p = q
         q = place(i, :) - centre
         place(i, :) = q
         part = (p(1)*q(2) - p(2)*q(1))/12.0_wp
         moments(1) = moments(1) + part*(p(1)*p(1) + p(1)*q(1) + q(1)*q(1))
         moments(2) = moments(2) + part*(p(1)*p(2) + q(1)*q(2) + 0.5_wp*(p(1)*q(2) + q(1)*p(2)))
         moments(3) = moments(3) + part*(p(2)*p(2) + p(2)*q(2) + q(2)*q(2))
      end do
   end subroutine measure

end module polydem_effective_area
