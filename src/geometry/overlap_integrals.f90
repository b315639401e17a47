!> Area, centroid and outline integrals of the overlap of two polygons, from the closed loop around it.
!>
!> G is the part of the outline of a inside b, n its outward normal, and c_X the centre of X = a, b:
!>
!>     N   = integral over G of n ds               = sum over the edges in G of (dy, -dx)
!>     M_X = integral over G of (r - c_X) x n ds   = -sum of (e - s) . ((e + s)/2 - c_X), edges from s to e
!>     dA/dt = N . (v_a - v_b) + M_a w_a - M_b w_b
!>
!> N points from a to b. If the outlines cross twice, N is the chord between the crossings turned by a right angle.
!> (Volume-based contact: Y. T. Feng, Comput. Methods Appl. Mech. Eng. 373 (2021).) The loop is closed, and the
!> integrals over the part of b inside a therefore have the opposite sign. The code integrates over the clipper's
!> part: if the clipper contains the subject, the result is exactly 0.
module polydem_overlap_integrals
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: overlap_t, integrate_loop

   !> Overlap of two polygons a and b
   type :: overlap_t
      !> Area, 0 if the polygons are apart or touch, or the effective area (see `polydem_overlap_measure`) [m2]
      real(wp) :: area = 0.0_wp
      !> Centroid relative to the centre of a [m]
      real(wp) :: centroid(2) = 0.0_wp
      !> Centroid relative to the centre of b [m]
      real(wp) :: centroid_b(2) = 0.0_wp
      !> Integral of the outward normal of a over its outline inside b, with the weight of the measure; without division
      !> by a length it is the gradient of the area [m]
      real(wp) :: normal(2) = 0.0_wp
      !> Moment of that integral about the centre of a [m2]
      real(wp) :: moment_a = 0.0_wp
      !> Moment of that integral about the centre of b [m2]
      real(wp) :: moment_b = 0.0_wp
      !> Square L^2 of the length of the overlap; 0 if the measure does not contain it [m2]
      real(wp) :: length_square = 0.0_wp
      !> If the measure asks for it, the gradient of the true area (x, y) [m], its moment about the centroid, and the
      !> true area [m2]
      real(wp) :: of_area(4) = 0.0_wp
      !> Edge whose line separates the polygons: +k of a, -k of b; 0 if none is known or they overlap
      integer(ip) :: separating_edge = 0_ip
   end type overlap_t

contains

   !> Area and centroid of a loop, and the integrals over its edges on the clipper's outline
   !>
   !> `moment_a` is about the origin, `moment_b` about the clipper's centre.
   pure subroutine integrate_loop(n, corners, vertex, on_clipper, offset, overlap)
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
      !> The overlap; must be zero on entry
      type(overlap_t), intent(inout) :: overlap
      real(wp) :: twice_area, part, weighted(2), p(2), q(2), step(2), middle(2)
      integer(ip) :: i, j

      twice_area = 0.0_wp
      weighted = 0.0_wp
      do i = 1_ip, n
         j = merge(1_ip, i + 1_ip, i == n)
         p = vertex(i, :) - vertex(1, :)
         q = vertex(j, :) - vertex(1, :)
         part = p(1)*q(2) - p(2)*q(1)
         twice_area = twice_area + part
         weighted = weighted + part*(p + q)
         if (on_clipper(i)) then
            step = q - p
            middle = vertex(i, :) + 0.5_wp*step
            overlap%normal(1) = overlap%normal(1) + step(2)
            overlap%normal(2) = overlap%normal(2) - step(1)
            overlap%moment_a = overlap%moment_a - (step(1)*middle(1) + step(2)*middle(2))
            middle = middle - offset
            overlap%moment_b = overlap%moment_b - (step(1)*middle(1) + step(2)*middle(2))
         end if
      end do
      if (.not. twice_area > 0.0_wp) then
         overlap = overlap_t()
         return
      end if
      overlap%area = 0.5_wp*twice_area
      overlap%centroid = vertex(1, :) + weighted/(3.0_wp*twice_area)
   end subroutine integrate_loop

end module polydem_overlap_integrals
