!> How the size of an overlap is measured: by its area, its effective area, or its area over its length.
!>
!> With the area A, the centroid c, the second moments S about c, their sum J = tr S, the effective area G
!> (`polydem_effective_area`) and the length L of the overlap, L^2 = 12 J/A, a law with a potential has an energy in
!> proportion to X^2, where X is G or A/L. A strip of the length w and the depth d has A = G = w d and L = w up to
!> (d/w)^2. So A/L is a depth, whatever the length of the contact. At a corner it is in proportion to the depth.
!>
!> If the outline moves outwards with speed u, A changes at the rate integral of u ds, and J at the rate integral of
!> |x - c|^2 u ds. So (A/X) dX/dt of X = A/L is the integral of p u ds with the weight
!>
!>     p = 3/2 - (A/(2 J)) |x - c|^2
!>
!> For G the weight is (G/4) q, for A it is 1. Normal and moments of an overlap are the integral N of p n over the
!> outline of the first polygon inside the second, and its moments likewise. Its area is G or A. Then with A/L, too, the
!> area over |N| is X/|grad X|, and the gradient of X^2/2 is A N/L^2.
module polydem_overlap_measure
   implicit none
   private
   public :: overlap_measure_t, true_area, effective_area, area_per_length

   !> A measure of overlaps
   type :: overlap_measure_t
      !> Whether moments are needed; otherwise the measure is the true area
      logical :: has_moments = .false.
      !> Whether it is the area over the length, not the effective area. Overlaps with neighbouring pieces must then
      !> count as one (`polydem_joined_overlaps`)
      logical :: per_length = .false.
      !> Whether the gradient of the true area is needed besides
      logical :: with_area = .false.
   end type overlap_measure_t

   !> All measures
   type(overlap_measure_t), parameter :: true_area = overlap_measure_t()
   type(overlap_measure_t), parameter :: effective_area = overlap_measure_t(has_moments=.true.)
   type(overlap_measure_t), parameter :: area_per_length = overlap_measure_t(has_moments=.true., per_length=.true.)

end module polydem_overlap_measure
