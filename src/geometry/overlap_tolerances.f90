!> Tolerances of the overlap of two polygons P and Q; s is the radius of the smaller one, P, u = epsilon/2.
!>
!> All distances from lines are cross products e x (x - a) with an edge e from a, and are compared with multiples of s
!> (|e_x| + |e_y|). Let x and a be coordinates of at most 8 s that are off by at most 8 s u each (a sum with the
!> offset), and e off by u in relation. The difference is at most 9 s, hence off by at most 17 s u where one of both
!> is a corner of P. The cross product is then off by at most (17 + 9 + 9 + 9) u s (|e_x| + |e_y|) = 22 epsilon s
!> (|e_x| + |e_y|): from the difference, from e, from the products and from their difference. A sign beyond `sure` is
!> therefore that of exact arithmetic.
module polydem_overlap_tolerances
   use polydem_kinds, only: wp
   implicit none
   private
   public :: far, roundoff, separable_area, sure, sure_at_edge, sure_in_fan, sure_area, surely_apart
   public :: no_length, least_square

   !> Coordinates up to this multiple of s count as near. Beyond, line equations are formed without rounding
   real(wp), parameter :: far = 8.0_wp
   !> General clipping: a vertex this close to a line lies on the line. It is at least 4 epsilon times the greatest
   !> |x| + |y| of a vertex of P, which is at most sqrt(2) s
   real(wp), parameter :: roundoff = 6.0_wp*epsilon(1.0_wp)
   !> General clipping: greatest area of an overlap that an edge can still separate, as a fraction of s**2. Bodies
   !> that an edge separates up to roundoff overlap by a strip of length 2 s and depth sqrt(2) roundoff s at most
   real(wp), parameter :: separable_area = 128.0_wp*epsilon(1.0_wp)
   !> Lens: a sign beyond this is certain
   real(wp), parameter :: sure = 24.0_wp*epsilon(1.0_wp)
   !> Lens: the same in units of s R for every edge of a polygon of radius R, for which |e_x| + |e_y| is at most
   !> sqrt(2) 2 R
   real(wp), parameter :: sure_at_edge = 3.0_wp*sure
   !> Lens: the same for the cross product of a corner of a polygon with a point relative to its centre, in units of the
   !> square of its radius R. The point is at most R + sqrt(2) 8 s + s from the centre; the product with a corner of
   !> at most R is off by at most 4 u 13.4 sqrt(2) R**2
   real(wp), parameter :: sure_in_fan = 64.0_wp*epsilon(1.0_wp)
   !> Lens: least area as a fraction of s**2. General clipping never calls such bodies separate: an edge that separates
   !> them up to roundoff and up to the error of its line, together 28 epsilon s (|e_x| + |e_y|), leaves 80 epsilon s**2
   real(wp), parameter :: sure_area = 256.0_wp*epsilon(1.0_wp)
   !> Separating edge: beyond this, general clipping finds no overlap either. It is the sum of the error here (22
   !> epsilon) and of that of clipping (16 epsilon for the level of a centre up to 8 s away, 20 for the rest)
   real(wp), parameter :: surely_apart = 64.0_wp*epsilon(1.0_wp)
   !> Ratio of a length to the square root of the area below which the length is rounding error: the overlap then has no
   !> direction
   real(wp), parameter :: no_length = 4096.0_wp*epsilon(1.0_wp)
   !> Lens: least divisor for lengths and areas as a fraction of s**2. The square of a certified chord is at least four
   !> times as large, and so is the area of any figure with a certified area
   real(wp), parameter :: least_square = no_length**2*sure_area

end module polydem_overlap_tolerances
