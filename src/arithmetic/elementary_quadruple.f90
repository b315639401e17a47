!> Elementary functions of the working precision: in quadruple precision those of the compiler, which computes all
!> quadruple numbers in software.
module polydem_elementary
   use polydem_kinds, only: wp
   implicit none
   private
   public :: sine, cosine, sine_and_cosine, sines_and_cosines, tangent, arc_tangent, arc_cosine, exponential, &
      logarithm, hypotenuse

contains

   !> Compute the sines and cosines of a block of angles, with the bits of `sine_and_cosine`.
   pure subroutine sines_and_cosines(isa, angle, sine, cosine)
      !> Instruction set, isa_base or isa_avx2 (not used)
      integer, intent(in) :: isa
      !> Angles [rad]
      real(wp), intent(in) :: angle(:)
      !> Their sines and cosines
      real(wp), intent(out) :: sine(:), cosine(:)

      associate (unused_isa => isa)
      end associate
      sine = sin(angle)
      cosine = cos(angle)
   end subroutine sines_and_cosines

   !> Sine and cosine of an angle
   elemental subroutine sine_and_cosine(angle, sine, cosine)
      !> Angle [rad]
      real(wp), intent(in) :: angle
      !> Its sine and cosine
      real(wp), intent(out) :: sine, cosine

      sine = sin(angle)
      cosine = cos(angle)
   end subroutine sine_and_cosine

   !> Sine
   elemental real(wp) function sine(angle)
      !> Angle [rad]
      real(wp), intent(in) :: angle

      sine = sin(angle)
   end function sine

   !> Cosine
   elemental real(wp) function cosine(angle)
      !> Angle [rad]
      real(wp), intent(in) :: angle

      cosine = cos(angle)
   end function cosine

   !> Tangent
   elemental real(wp) function tangent(angle)
      !> Angle [rad]
      real(wp), intent(in) :: angle

      tangent = tan(angle)
   end function tangent

   !> Exponential function
   elemental real(wp) function exponential(x)
      !> Exponent
      real(wp), intent(in) :: x

      exponential = exp(x)
   end function exponential

   !> Natural logarithm
   elemental real(wp) function logarithm(x)
      !> Number, not negative
      real(wp), intent(in) :: x

      logarithm = log(x)
   end function logarithm

   !> Arc cosine, from 0 to pi [rad]
   elemental real(wp) function arc_cosine(x)
      !> Cosine, from -1 to 1
      real(wp), intent(in) :: x

      arc_cosine = acos(x)
   end function arc_cosine

   !> Angle of the vector (x, y) against the x axis, from -pi to pi [rad]
   elemental real(wp) function arc_tangent(y, x)
      !> Components of the vector
      real(wp), intent(in) :: y, x

      arc_tangent = atan2(y, x)
   end function arc_tangent

   !> Length of the vector (x, y)
   elemental real(wp) function hypotenuse(x, y)
      !> Components of the vector
      real(wp), intent(in) :: x, y

      hypotenuse = hypot(x, y)
   end function hypotenuse

end module polydem_elementary
