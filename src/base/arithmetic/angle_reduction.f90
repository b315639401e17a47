!> Exact reduction of an angle of any size to a quadrant (M.H. Payne & R.N. Hanek, SIGNUM Newsletter 18 (1983) 19).
!>
!> The angle is a whole number times a power of 2. It is multiplied by those digits of 2/pi that do not only contribute
!> whole turns to the product, in whole numbers. No double is nearer to a multiple of pi/2 than 2^-62 of a quadrant; the
!> digits used leave an error of 2^-140.
module polydem_angle_reduction
   use polydem_double_double, only: multiply
   use polydem_kinds, only: dp, lp
   implicit none
   private
   public :: reduce_angle

   !> Bits of a digit
   integer, parameter :: bits = 24
   !> The least number that has more bits
   integer(lp), parameter :: base = 2_lp**bits
   !> Digits of 2/pi, digit i in units of 2^(-24 i)
   integer(lp), parameter :: digit(-3:49) = [ &
      0_lp, 0_lp, 0_lp, 0_lp, 10680707_lp, 7228996_lp, 1387004_lp, 2578385_lp, 16069853_lp, 12639074_lp, &
      9804092_lp, 4427841_lp, 16666979_lp, 11263675_lp, 12935607_lp, 2387514_lp, 4345298_lp, 14681673_lp, &
      3074569_lp, 13734428_lp, 16653803_lp, 1880361_lp, 10960616_lp, 8533493_lp, 3062596_lp, 8710556_lp, &
      7349940_lp, 6258241_lp, 3772886_lp, 3769171_lp, 3798172_lp, 8675211_lp, 12450088_lp, 3874808_lp, &
      9961438_lp, 366607_lp, 15675153_lp, 9132554_lp, 7151469_lp, 3571407_lp, 2607881_lp, 12013382_lp, &
      4155038_lp, 6285869_lp, 7677882_lp, 13102053_lp, 15825725_lp, 473591_lp, 9065106_lp, 15363067_lp, &
      6271263_lp, 9264392_lp, 5636912_lp]
   !> pi/2 as a sum of two numbers
   real(dp), parameter :: right_angle = 1.5707963267948966_dp, of_right_angle = 6.123233995736766e-17_dp

contains

   !> Divide an angle by pi/2: the nearest whole number, modulo 4, and the remainder.
   elemental subroutine reduce_angle(angle, quadrant, r, rest)
      !> Finite angle, at least 1/2 [rad]
      real(dp), intent(in) :: angle
      !> Whole number, 0 to 3
      integer(lp), intent(out) :: quadrant
      !> Remainder, of magnitude up to pi/4 [rad]
      real(dp), intent(out) :: r
      !> What the rounded remainder lacks [rad]
      real(dp), intent(out) :: rest
      !> Digits of the product, the last first; digit 9 has the quadrants
      integer(lp) :: product(0:13)
      integer(lp) :: factor, factors(0:3)
      integer :: first, shift, a, k

      ! angle = factor 2^(24 first), with the whole number `factor` in up to four digits
      shift = modulo(exponent(angle) - digits(angle), bits)
      first = (exponent(angle) - digits(angle) - shift)/bits
      factor = int(scale(fraction(angle), digits(angle)), lp)
      factors(0) = ishft(iand(factor, 2_lp**(bits - shift) - 1_lp), shift)
      factor = ishft(factor, shift - bits)
      do a = 1, 3
         factors(a) = iand(factor, base - 1_lp)
         factor = ishft(factor, -bits)
      end do
      product = 0_lp
      do k = 0, 9
         product(k:k + 3) = product(k:k + 3) + factors*digit(first + 9 - k)
      end do
      do k = 0, 12
         product(k + 1) = product(k + 1) + ishft(product(k), -bits)
         product(k) = iand(product(k), base - 1_lp)
      end do
      quadrant = iand(product(9), 3_lp)
      if (product(8) < base/2_lp) then
         call multiply_by_right_angle(product(0:8), r, rest)
      else
         quadrant = iand(quadrant + 1_lp, 3_lp)
         call multiply_by_right_angle(base - 1_lp - product(0:8), r, rest)
         r = -r
         rest = -rest
      end if
   end subroutine reduce_angle

   !> Fraction of a quadrant in radians
   pure subroutine multiply_by_right_angle(fraction, r, rest)
      !> Digits of the fraction, the last first
      integer(lp), intent(in) :: fraction(0:8)
      real(dp), intent(out) :: r, rest
      real(dp) :: part(3), high, low, error
      integer :: k

      do k = 1, 3
         part(k) = scale(real(fraction(10 - 2*k)*base + fraction(9 - 2*k), dp), -2*k*bits)
      end do
      high = part(1) + part(2)
      low = ((part(1) - high) + part(2)) + part(3)
      call multiply(high, right_angle, r, error)
      error = error + (high*of_right_angle + low*right_angle)
      rest = r
      r = rest + error
      rest = (rest - r) + error
   end subroutine multiply_by_right_angle

end module polydem_angle_reduction
