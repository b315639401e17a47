!> How the size of an overlap is measured: by its area, or by an expression in its moments.
!>
!> With the area A, the centroid c, the second moments S about c, their sum J = tr S, the effective area G and the
!> length L of the overlap,
!>
!>     G^2 = 12 sqrt(det S),     L^2 = 12 J/A,
!>
!> a law of force has an energy in proportion to the square of X = B/L^s, where B is A or G. A strip of the length w and
!> the depth d has A = G = w d and L = w up to (d/w)^2. So A/L is a depth, whatever the length of the contact. At a
!> corner it is in proportion to the depth.
!>
!> If the outline moves outwards with speed u, A changes at the rate integral of u ds, and J at the rate integral of
!> |x - c|^2 u ds (`polydem_effective_area` has that of G). So (B/X) dX/dt is the integral of p u ds with the weight
!>
!>     p = (G/4) q + (s/2) (B/A - (B/J) |x - c|^2)                        B = G
!>     p =       1 + (s/2) (B/A - (B/J) |x - c|^2)                        B = A
!>
!> Area and gradient of an overlap are B and the integral N of p n over the outline of the first polygon inside the
!> second, and its moments likewise. Then B/|N| = X/|grad X|, and the gradient of X^2/2 is B N/L^(2 s).
module polydem_overlap_measure
   use polydem_kinds, only: wp
   implicit none
   private
   public :: overlap_measure_t, true_area, effective_area

   !> A measure of overlaps
   type :: overlap_measure_t
      !> Whether moments are needed; otherwise the measure is the true area
      logical :: has_moments = .false.
      !> 1 if B is the effective area, 0 if it is the true area
      real(wp) :: share_effective = 0.0_wp
      !> Power s of the length by which B is divided, 0, 1/2 or 1
      real(wp) :: power = 0.0_wp
      !> Whether the gradient of the true area is needed besides
      logical :: with_area = .false.
   contains
      procedure :: joins
   end type overlap_measure_t

   !> The true area, and the effective area
   type(overlap_measure_t), parameter :: true_area = overlap_measure_t()
   type(overlap_measure_t), parameter :: effective_area = overlap_measure_t(.true., 1.0_wp, 0.0_wp)

contains

   !> Whether overlaps with neighbouring pieces must count as one (`polydem_joined_overlaps`)
   elemental logical function joins(self)
      class(overlap_measure_t), intent(in) :: self

      joins = self%power >= 1.0_wp .and. .not. self%share_effective > 0.0_wp
   end function joins

end module polydem_overlap_measure
