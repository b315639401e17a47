!> Exponential function and natural logarithm in double precision, with the basic operations of IEEE 754 only.
!>
!> The bits do not depend on the processor, the library or the optimisation. Errors are below 1 ulp. Both follow
!> W.J. Cody & W. Waite, Software Manual for the Elementary Functions (1980): reduction by multiples of ln 2, then a
!> Taylor series with a remainder below 2^-60. Leading terms are summed with their rounding errors.
module polydem_exponential
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_negative_inf, ieee_quiet_nan, ieee_value
   use polydem_double_double, only: add, multiply
   use polydem_kinds, only: dp
   implicit none
   private
   public :: exponential, logarithm

   !> ln 2 in two parts; multiples of the first up to 2^11 are exact
   real(dp), parameter :: ln2(2) = [0.6931471805598903_dp, 5.497923018708371e-14_dp]
   !> 1/ln 2
   real(dp), parameter :: powers_per_unit = 1.4426950408889634_dp
   !> No double is above the exponential of this number, or above 0 and below that of its negative
   real(dp), parameter :: far = 750.0_dp
   !> Square root of 1/2
   real(dp), parameter :: least_fraction = 0.7071067811865476_dp
   !> 1/j! for j = 2 to 14
   real(dp), parameter :: inverse_factorial(2:14) = 1.0_dp/[2.0_dp, 6.0_dp, 24.0_dp, 120.0_dp, 720.0_dp, 5040.0_dp, &
      40320.0_dp, 362880.0_dp, 3628800.0_dp, 39916800.0_dp, 479001600.0_dp, 6227020800.0_dp, 87178291200.0_dp]
   !> 2/(2 j + 1): log((1 + s)/(1 - s)) = 2 s + s (2/3 s^2 + 2/5 s^4 + ...)
   real(dp), parameter :: odd(10) = 2.0_dp/[3.0_dp, 5.0_dp, 7.0_dp, 9.0_dp, 11.0_dp, 13.0_dp, 15.0_dp, 17.0_dp, &
                                            19.0_dp, 21.0_dp]

contains

   !> Exponential function
   elemental real(dp) function exponential(x)
      !> Exponent
      real(dp), intent(in) :: x
      real(dp) :: nearest, r, rest, series, error
      integer :: k

      exponential = x
      if (ieee_is_nan(x)) return
      nearest = anint(max(-far, min(far, x))*powers_per_unit)
      call add(max(-far, min(far, x)) - nearest*ln2(1), -nearest*ln2(2), r, rest)
      series = inverse_factorial(14)
      do k = 13, 2, -1
         series = series*r + inverse_factorial(k)
      end do
      call add(1.0_dp, r, exponential, error)
      exponential = scale(exponential + (error + (rest + r*r*series)), int(nearest))
   end function exponential

   !> Natural logarithm
   elemental real(dp) function logarithm(x)
      !> Number, not negative
      real(dp), intent(in) :: x
      real(dp) :: f, s, z, series, half_square, square, of_square, power, high, low, lost
      integer :: k

      logarithm = x
      if (ieee_is_nan(x)) return
      if (x > huge(x)) return
      if (x <= 0.0_dp) then
         logarithm = ieee_value(x, ieee_quiet_nan)
         if (.not. x < 0.0_dp) logarithm = ieee_value(x, ieee_negative_inf)
         return
      end if
      f = fraction(x)
      power = real(exponent(x), dp)
      if (f < least_fraction) then
         f = 2.0_dp*f
         power = power - 1.0_dp
      end if
      ! log(1 + f) = f - f^2/2 + s (f^2/2 + series) with s = f/(2 + f)
      f = f - 1.0_dp
      s = f/(2.0_dp + f)
      z = s*s
      series = odd(10)
      do k = 9, 1, -1
         series = series*z + odd(k)
      end do
      call multiply(f, f, square, of_square)
      half_square = 0.5_dp*square
      call add(power*ln2(1), f, high, low)
      call add(high, -half_square, logarithm, lost)
      logarithm = logarithm + ((low + lost) + ((s*(half_square + z*series) - 0.5_dp*of_square) + power*ln2(2)))
   end function logarithm

end module polydem_exponential
