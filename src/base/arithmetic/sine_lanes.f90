!> Sine and cosine of many angles: a kernel, compiled for several instruction sets (`cmake/polydem_kernel.cmake`).
!>
!> An angle x is reduced to r = x - k pi/2 in [-pi/4, pi/4] with pi/2 in four parts, of which three have 33 bits each:
!> their products with k < 2^20 are exact (W.J. Cody & W. Waite, Software Manual for the Elementary Functions, 1980).
!> The remainder is the sum of two numbers, r + rest, with more than 100 bits. The polynomials in r^2 are minimax fits
!> of (sin(r)/r - 1)/r^2 and (cos(r) - 1 + r^2/2)/r^4 by the exchange of E.Ya. Remez (1934), in 300 bits; each
!> coefficient was rounded before those after it were fitted. The relative errors of sine and cosine are 2^-57.9 and
!> 2^-63.9.
!>
!> There are no branches, so a compiler computes several angles at once. All operations are those of IEEE 754.
module polydem_sine_lanes
   use polydem_kinds, only: dp, lp
   implicit none
   private
   public :: greatest_angle, sine_lanes, turned_sine, sine_series, cosine_series

   !> Greatest magnitude of an angle that a kernel takes [rad]
   real(dp), parameter :: greatest_angle = 2.0_dp**20
   !> 2/pi
   real(dp), parameter :: quadrants_per_radian = 0.6366197723675814_dp
   !> Parts of pi/2
   real(dp), parameter :: part(4) = [1.5707963267341256_dp, 6.077100506303966e-11_dp, 2.0222662487111665e-21_dp, &
                                     8.4784276603689e-32_dp]
   !> A sum with this number is rounded to a whole number, which is in its last bits
   real(dp), parameter :: rounder = 6755399441055744.0_dp
   !> Coefficients of the polynomial for the sine
   real(dp), parameter :: s(6) = [-0.1666666666666663_dp, 0.00833333333332184_dp, -0.00019841269829358528_dp, &
                                  2.7557313538514158e-06_dp, -2.5050734389219493e-08_dp, 1.589543328477822e-10_dp]
   !> Coefficients of the polynomial for the cosine
   real(dp), parameter :: c(6) = [0.041666666666666595_dp, -0.0013888888888873342_dp, 2.480158728900208e-05_dp, &
                                  -2.755731421703886e-07_dp, 2.087570539602888e-09_dp, -1.1358749239876326e-11_dp]

contains

   !> Compute the sines and cosines of angles of magnitude up to `greatest_angle`. Those of others have no meaning.
   pure subroutine sine_lanes(n, angle, sine, cosine)
      !> Number of angles
      integer, intent(in) :: n
      !> Angles [rad]
      real(dp), intent(in) :: angle(n)
      !> Their sines and cosines
      real(dp), intent(out) :: sine(n), cosine(n)
      real(dp) :: x, k, whole, r, rest, first, second, lost, also_lost, product, part_of_it
      integer(lp) :: sign
      integer :: l

      do l = 1, n
         x = min(abs(angle(l)), greatest_angle)
         sign = ieor(transfer(abs(angle(l)), sign), transfer(angle(l), sign))
         whole = x*quadrants_per_radian + rounder
         k = whole - rounder
         first = x - k*part(1)
         ! Differences with their rounding errors (D.E. Knuth, The Art of Computer Programming, vol. 2)
         product = k*part(2)
         second = first - product
         part_of_it = second - first
         lost = (first - (second - part_of_it)) - (product + part_of_it)
         product = k*part(3)
         first = second - product
         part_of_it = first - second
         also_lost = (second - (first - part_of_it)) - (product + part_of_it)
         rest = (lost + also_lost) - k*part(4)
         r = first + rest
         rest = (first - r) + rest
         call turned_sine(transfer(whole, sign), sign, r, rest, sine(l), cosine(l))
      end do
   end subroutine sine_lanes

   !> Sine and cosine of k pi/2 + r + rest
   elemental subroutine turned_sine(k, sign, r, rest, sine, cosine)
      !> Its last two bits count: 0 to 3
      integer(lp), intent(in) :: k
      !> A number whose highest bit is set if the sine changes its sign; its other bits are 0
      integer(lp), intent(in) :: sign
      !> Remainder, of magnitude up to about pi/4 [rad]
      real(dp), intent(in) :: r
      !> What the remainder lacks, less than its rounding error [rad]
      real(dp), intent(in) :: rest
      !> Sine and cosine
      real(dp), intent(out) :: sine, cosine
      real(dp) :: z, half, near_one
      integer(lp) :: sine_bits, cosine_bits, swapped

      z = r*r
      half = 0.5_dp*z
      near_one = 1.0_dp - half
      sine_bits = transfer(r + (r*sine_series(z) + rest*near_one), sine_bits)
      cosine_bits = transfer(near_one + (((1.0_dp - near_one) - half) + (cosine_series(z) - r*rest)), cosine_bits)
      ! Odd quadrants exchange sine and cosine.
      swapped = iand(ieor(sine_bits, cosine_bits), -iand(k, 1_lp))
      sine = transfer(ieor(ieor(sine_bits, swapped), ieor(sign, ishft(iand(k, 2_lp), 62))), sine)
      cosine = transfer(ieor(ieor(cosine_bits, swapped), ishft(iand(k + 1_lp, 2_lp), 62)), cosine)
   end subroutine turned_sine

   !> sin(r)/r - 1
   elemental real(dp) function sine_series(z)
      !> r^2
      real(dp), intent(in) :: z

      sine_series = z*(s(1) + z*(s(2) + z*(s(3) + z*(s(4) + z*(s(5) + z*s(6))))))
   end function sine_series

   !> cos(r) - 1 + r^2/2
   elemental real(dp) function cosine_series(z)
      !> r^2
      real(dp), intent(in) :: z

      cosine_series = z*z*(c(1) + z*(c(2) + z*(c(3) + z*(c(4) + z*(c(5) + z*c(6))))))
   end function cosine_series

end module polydem_sine_lanes
