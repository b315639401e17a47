!> Sums and products of two numbers without rounding: the result is a rounded value and its error, which is exact.
!>
!> T.J. Dekker, Numer. Math. 18 (1971) 224; D.E. Knuth, The Art of Computer Programming, vol. 2. The error of a product
!> is exact if neither it nor the product underflows or overflows.
module polydem_double_double
   use polydem_kinds, only: dp
   implicit none
   private
   public :: add, multiply

contains

   !> Sum and its rounding error
   elemental subroutine add(a, b, rounded, error)
      !> Summands
      real(dp), intent(in) :: a, b
      !> Their rounded sum
      real(dp), intent(out) :: rounded
      !> The sum less its rounded value
      real(dp), intent(out) :: error
      real(dp) :: b_in_it

      rounded = a + b
      b_in_it = rounded - a
      error = (a - (rounded - b_in_it)) + (b - b_in_it)
   end subroutine add

   !> Product and its rounding error
   elemental subroutine multiply(a, b, rounded, error)
      !> Factors
      real(dp), intent(in) :: a, b
      !> Their rounded product
      real(dp), intent(out) :: rounded
      !> The product less its rounded value
      real(dp), intent(out) :: error
      real(dp), parameter :: splitter = 134217729.0_dp
      real(dp) :: a_high, a_low, b_high, b_low

      rounded = a*b
      a_high = splitter*a - (splitter*a - a)
      a_low = a - a_high
      b_high = splitter*b - (splitter*b - b)
      b_low = b - b_high
      error = ((a_high*b_high - rounded) + a_high*b_low + a_low*b_high) + a_low*b_low
   end subroutine multiply

end module polydem_double_double
