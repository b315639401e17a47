!> Arc cosine and hypotenuse in double precision, with the basic operations of IEEE 754 only.
!>
!> The bits do not depend on the processor, the library or the optimisation. Errors are below 1 ulp. An angle is the
!> tabulated arc tangent of a multiple of 1/8 and a Taylor series for the rest.
module polydem_arcs
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_is_nan, ieee_positive_inf, ieee_quiet_nan, ieee_value
   use polydem_double_double, only: add, multiply
   use polydem_kinds, only: dp
   implicit none
   private
   public :: arc_cosine, hypotenuse

   !> atan(j/8) as sums of two numbers, (part, j)
   real(dp), parameter :: known(2, 0:8) = reshape([ &
      0.0_dp, 0.0_dp, 0.12435499454676144_dp, -3.1253241424539383e-18_dp, &
      0.24497866312686414_dp, 1.0698755618734451e-17_dp, 0.35877067027057225_dp, -2.4623815582638635e-17_dp, &
      0.4636476090008061_dp, 2.2698777452961687e-17_dp, 0.5585993153435624_dp, -5.4556305485916264e-18_dp, &
      0.6435011087932844_dp, 1.5834785051444286e-17_dp, 0.7188299996216245_dp, -2.1478388444456983e-17_dp, &
      0.7853981633974483_dp, 3.061616997868383e-17_dp], [2, 9])
   !> pi/2 and pi as sums of two numbers
   real(dp), parameter :: right_angle(2) = [1.5707963267948966_dp, 6.123233995736766e-17_dp]
   real(dp), parameter :: straight_angle(2) = 2.0_dp*right_angle
   !> Taylor series (atan(u) - u)/u^3 in u^2. For u up to 1/16 the remainder is 2^-60 u.
   real(dp), parameter :: taylor(0:5) = &
      1.0_dp/[-3.0_dp, 5.0_dp, -7.0_dp, 9.0_dp, -11.0_dp, 13.0_dp]
   !> Below this quotient, as a power of 2, an angle is equal to its tangent
   integer, parameter :: small = -60
   !> A vector whose greater component is between this number and its reciprocal needs no scaling
   real(dp), parameter :: least_unscaled = 2.0_dp**(-200)

contains

   !> Arc cosine, from 0 to pi [rad]
   elemental real(dp) function arc_cosine(x)
      !> Cosine, from -1 to 1
      real(dp), intent(in) :: x
      real(dp) :: minus, of_minus, plus, of_plus, square, of_square, root, of_root, product, error

      arc_cosine = ieee_value(x, ieee_quiet_nan)
      if (ieee_is_nan(x)) return
      if (abs(x) > 1.0_dp) return
      ! The sine is the root of (1 - x)(1 + x), with its rounding error.
      call add(1.0_dp, -x, minus, of_minus)
      call add(1.0_dp, x, plus, of_plus)
      call multiply(minus, plus, square, of_square)
      of_square = of_square + (minus*of_plus + plus*of_minus)
      root = sqrt(square)
      of_root = 0.0_dp
      if (root > 0.0_dp) then
         call multiply(root, root, product, error)
         of_root = (((square - product) - error) + of_square)/(2.0_dp*root)
      end if
      arc_cosine = angle_above(root, of_root, x)
   end function arc_cosine

   !> Angle of the vector (x, y + rest), from 0 to pi [rad]
   pure real(dp) function angle_above(y, rest, x) result(angle)
      real(dp), intent(in) :: y, rest, x
      real(dp) :: part(2), sum, error
      logical :: is_steep

      is_steep = y > abs(x)
      if (is_steep) then
         call small_angle([abs(x), 0.0_dp], [y, rest], part)
         call add(right_angle(1), -part(1), sum, error)
         part = [sum, error + (right_angle(2) - part(2))]
      else
         call small_angle([y, rest], [abs(x), 0.0_dp], part)
      end if
      if (sign(1.0_dp, x) < 0.0_dp) then
         call add(straight_angle(1), -part(1), sum, error)
         part = [sum, error + (straight_angle(2) - part(2))]
      end if
      angle = part(1) + part(2)
   end function angle_above

   !> Arc tangent of a quotient n/d from 0 to 1, all in two parts
   pure subroutine small_angle(n, d, angle)
      real(dp), intent(in) :: n(2), d(2)
      real(dp), intent(out) :: angle(2)
      real(dp) :: above(2), below(2), u(2), product, error, z, series
      integer :: nearest, k, power

      angle = 0.0_dp
      if (.not. n(1) > 0.0_dp) return
      if (exponent(n(1)) - exponent(d(1)) < small) then
         angle(1) = n(1)/d(1)
         return
      end if
      power = -exponent(d(1))
      above = scale(n, power)
      below = scale(d, power)
      nearest = nint(8.0_dp*above(1)/below(1))
      if (nearest > 0) call turn_back(0.125_dp*real(nearest, dp), above, below)
      u(1) = above(1)/below(1)
      call multiply(u(1), below(1), product, error)
      u(2) = (((above(1) - product) - error) + (above(2) - u(1)*below(2)))/below(1)
      z = u(1)*u(1)
      series = taylor(5)
      do k = 4, 0, -1
         series = series*z + taylor(k)
      end do
      call add(known(1, nearest), u(1), angle(1), error)
      angle(2) = error + ((known(2, nearest) + u(2)) + u(1)*z*series)
   end subroutine small_angle

   !> Turn a vector (d, n) back by the angle of the tangent t, except for a factor: n - t d and d + t n.
   pure subroutine turn_back(t, n, d)
      real(dp), intent(in) :: t
      real(dp), intent(inout) :: n(2), d(2)
      real(dp) :: to_n(2), to_d(2), sum, error

      call multiply(t, d(1), to_n(1), to_n(2))
      call multiply(t, n(1), to_d(1), to_d(2))
      to_n(2) = to_n(2) + t*d(2)
      to_d(2) = to_d(2) + t*n(2)
      ! A sum must not share memory with its terms.
      call add(n(1), -to_n(1), sum, error)
      n = [sum, (n(2) - to_n(2)) + error]
      call add(d(1), to_d(1), sum, error)
      d = [sum, (d(2) + to_d(2)) + error]
   end subroutine turn_back

   !> Length of the vector (x, y)
   elemental real(dp) function hypotenuse(x, y)
      !> Components of the vector
      real(dp), intent(in) :: x, y
      integer :: power

      if (.not. (ieee_is_finite(x) .and. ieee_is_finite(y))) then
         ! An infinite component counts even beside one that is not a number.
         hypotenuse = ieee_value(x, ieee_positive_inf)
         if (ieee_is_finite(x) .or. ieee_is_finite(y) .or. (ieee_is_nan(x) .and. ieee_is_nan(y))) then
            if (ieee_is_nan(x) .or. ieee_is_nan(y)) hypotenuse = ieee_value(x, ieee_quiet_nan)
         end if
         return
      end if
      hypotenuse = max(abs(x), abs(y))
      if (hypotenuse > least_unscaled .and. hypotenuse < 1.0_dp/least_unscaled) then
         hypotenuse = root_of_squares(x, y)
      else if (hypotenuse > 0.0_dp) then
         power = exponent(hypotenuse)
         hypotenuse = scale(root_of_squares(scale(x, -power), scale(y, -power)), power)
      end if
   end function hypotenuse

   !> Root of x^2 + y^2 if no square overflows and the greater one does not underflow
   elemental real(dp) function root_of_squares(x, y) result(root)
      real(dp), intent(in) :: x, y
      real(dp) :: square(2), error(2), sum, of_sum, product, of_product

      call multiply([x, y], [x, y], square, error)
      call add(square(1), square(2), sum, of_sum)
      of_sum = of_sum + (error(1) + error(2))
      root = sqrt(sum)
      call multiply(root, root, product, of_product)
      root = root + (((sum - product) - of_product) + of_sum)/(2.0_dp*root)
   end function root_of_squares

end module polydem_arcs
