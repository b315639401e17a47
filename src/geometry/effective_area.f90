!> The effective area G of an overlap, that of the parallelogram with the same determinant of second moments:
!>
!>     G^2 = 12 sqrt(det S),     S = integral of (x - c)(x - c)^T dA over the overlap, c its centroid
!>
!> Like the area A it scales with the determinant of any linear map of the plane, so that G/A is one number each for
!> all parallelograms, 1, for all triangles, 1.0746, and for all ellipses, 0.9772; no convex figure is outside the last
!> two ((G/A)^2 is 12 times the square of the isotropy constant of convex geometry). Unlike A it feels tilts: a strip of
!> length w whose depth grows from d (1 - e) to d (1 + e) has
!>
!>     G = w d ((1 + e^2)(1 - e^2/3))^(1/4),     G^2 = w^2 d^2 (1 + e^2/3) + O(e^4)
!>
!> and the second form is w^2 times the mean square depth, as the energy of a bed of springs is.
!>
!> Where the outline moves outwards with speed u, S changes by the integral of (x - c)(x - c)^T u ds (the motion of c
!> does not matter), so that with G'/G = tr(S^-1 S')/4
!>
!>     dG/dt = integral of (G/4) q u ds,     q(x) = (x - c)^T S^-1 (x - c)
!>
!> As for the area, the first polygon's outline G_a inside the second gives the gradient, with q G/4 as weight:
!>
!>     N = integral over G_a of (G/4) q n ds,     M_X = integral over G_a of (G/4) q (r - c_X) x n ds
!>     dG/dt = N . (v_a - v_b) + M_a w_a - M_b w_b
!>
!> Over the closed outline these integrals vanish, being those of 2 S^-1 (x - c) and 2 (x - c) x S^-1 (x - c) over the
!> inside: the two bodies feel opposite forces. The weight is never negative, and continuous when corners come and go.
!> Along an edge the integrands are polynomials of second and third degree, for which Simpson's rule is exact.
!>
!> Overlaps are slivers, of depth d and length b. In coordinates at an angle to them det S would lose (d/b)^2 of its
!> digits; along them, and scaled to about 1 by 1, nothing is lost beyond what the vertices have lost.
module polydem_effective_area
   use polydem_kinds, only: ip, wp
   use polydem_overlap_integrals, only: overlap_t
   implicit none
   private
   public :: weigh_by_shape

contains

   !> Replace area, normal and moments of an overlap by the effective area and its own.
   !>
   !> `moment_a` is about the origin, `moment_b` about the clipper's centre. A loop lost in rounding leaves none.
   pure subroutine weigh_by_shape(n, corners, vertex, on_clipper, offset, overlap)
      !> Number of vertices
      integer(ip), intent(in) :: n
      !> Room for vertices
      integer(ip), intent(in) :: corners
      !> Vertices, anticlockwise, (corner, x or y) [m]
      real(wp), intent(in) :: vertex(corners, 2)
      !> Whether the edge that starts at a vertex lies on the clipper's outline
      logical, intent(in) :: on_clipper(corners)
      !> Centre of the clipper [m]
      real(wp), intent(in) :: offset(2)
      !> The overlap, as for the area
      type(overlap_t), intent(inout) :: overlap
      real(wp) :: place(2, n), unit_area, moments(3), determinant, root, weight(3), c(2), p(2), step(2)
      real(wp) :: moment, along(2), share
      integer(ip) :: i, j

      c = overlap%centroid
      call straighten(n, vertex(:n, :), place, unit_area)
      call measure(n, place, moments)
      determinant = moments(1)*moments(3) - moments(2)**2
      if (.not. determinant > 0.0_wp) then
         overlap = overlap_t()
         return
      end if
      root = sqrt(12.0_wp*sqrt(determinant))
      overlap%area = unit_area*root
      overlap%normal = 0.0_wp
      moment = 0.0_wp
      do i = 1_ip, n
         if (.not. on_clipper(i)) cycle
         j = merge(1_ip, i + 1_ip, i == n)
         p = vertex(i, :) - c
         step = vertex(j, :) - vertex(i, :)
         ! Simpson's weights at both ends and, fourfold, in the middle
         weight(1) = level(place(:, i))
         weight(2) = level(place(:, j))
         weight(3) = 4.0_wp*level(0.5_wp*(place(:, i) + place(:, j)))
         weight = weight*(root/(24.0_wp*determinant))
         share = weight(1) + weight(2) + weight(3)
         overlap%normal(1) = overlap%normal(1) + share*step(2)
         overlap%normal(2) = overlap%normal(2) - share*step(1)
         along(1) = step(1)*p(1) + step(2)*p(2)
         along(2) = along(1) + (step(1)*step(1) + step(2)*step(2))
         moment = moment - (weight(1)*along(1) + weight(2)*along(2) + weight(3)*0.5_wp*(along(1) + along(2)))
      end do
      overlap%moment_a = moment + (c(1)*overlap%normal(2) - c(2)*overlap%normal(1))
      c = c - offset
      overlap%moment_b = moment + (c(1)*overlap%normal(2) - c(2)*overlap%normal(1))

   contains

      !> The form q at a place, times the determinant
      pure real(wp) function level(x)
         real(wp), intent(in) :: x(2)

         level = moments(3)*x(1)*x(1) - 2.0_wp*moments(2)*x(1)*x(2) + moments(1)*x(2)*x(2)
      end function level

   end subroutine weigh_by_shape

   !> Coordinates of a loop along and across the line from its first vertex to the farthest from it, scaled to about 1.
   pure subroutine straighten(n, vertex, place, unit_area)
      integer(ip), intent(in) :: n
      real(wp), intent(in) :: vertex(n, 2)
      !> Scaled coordinates, (along or across, vertex)
      real(wp), intent(out) :: place(2, n)
      !> Area of the unit square of the scaled coordinates [m2]
      real(wp), intent(out) :: unit_area
      real(wp) :: axis(2), square, longest, height
      integer(ip) :: i

      longest = 0.0_wp
      axis = 0.0_wp
      do i = 1_ip, n
         place(1, i) = vertex(i, 1) - vertex(1, 1)
         place(2, i) = vertex(i, 2) - vertex(1, 2)
         square = place(1, i)*place(1, i) + place(2, i)*place(2, i)
         if (square > longest) axis = place(:, i)
         longest = max(longest, square)
      end do
      height = 0.0_wp
      do i = 1_ip, n
         place(:, i) = [axis(1)*place(1, i) + axis(2)*place(2, i), axis(1)*place(2, i) - axis(2)*place(1, i)]
         height = max(height, abs(place(2, i)))
      end do
      unit_area = height
      if (.not. height > 0.0_wp) return
      do i = 1_ip, n
         place(1, i) = place(1, i)/longest
         place(2, i) = place(2, i)/height
      end do
   end subroutine straighten

   !> Second moments (xx, xy, yy) of a loop about its centroid; its places are then relative to that.
   pure subroutine measure(n, place, moments)
      integer(ip), intent(in) :: n
      real(wp), intent(inout) :: place(2, n)
      real(wp), intent(out) :: moments(3)
      real(wp) :: area, part, centre(2)
      integer(ip) :: i, j

      area = 0.0_wp
      centre = 0.0_wp
      do i = 2_ip, n - 1_ip
         associate (p => place(:, i), q => place(:, i + 1_ip))
            part = p(1)*q(2) - p(2)*q(1)
            area = area + part
            centre = centre + part*(p + q)
         end associate
      end do
      moments = 0.0_wp
      if (.not. area > 0.0_wp) return
      centre = centre/(3.0_wp*area)
      do i = 1_ip, n
         place(:, i) = place(:, i) - centre
      end do
      do i = 1_ip, n
         j = merge(1_ip, i + 1_ip, i == n)
         associate (p => place(:, i), q => place(:, j))
            part = p(1)*q(2) - p(2)*q(1)
            moments(1) = moments(1) + part*(p(1)*p(1) + p(1)*q(1) + q(1)*q(1))
            moments(2) = moments(2) + part*(p(1)*p(2) + q(1)*q(2) + 0.5_wp*(p(1)*q(2) + q(1)*p(2)))
            moments(3) = moments(3) + part*(p(2)*p(2) + p(2)*q(2) + q(2)*q(2))
         end associate
      end do
      moments = moments/12.0_wp
   end subroutine measure

end module polydem_effective_area
