!> Sine, cosine and tangent in double precision, with the basic operations of IEEE 754 only.
!>
!> The bits do not depend on the processor, the library or the optimisation. Errors are below 1 ulp for angles of any
!> size.
module polydem_circular
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_quiet_nan, ieee_value
   use polydem_angle_reduction, only: reduce_angle
   use polydem_double_double, only: add, multiply
   use polydem_instruction_set, only: isa_avx2
   use polydem_kinds, only: dp, lp
   use polydem_sine_lanes_avx2, only: sine_lanes_avx2 => sine_lanes
   use polydem_sine_lanes_base, only: cosine_series, greatest_angle, sine_lanes, sine_series, turned_sine
   implicit none
   private
   public :: sines_and_cosines, sine_and_cosine, sine, cosine, tangent

   !> Angles up to pi/4 need no reduction [rad]
   real(dp), parameter :: half_right_angle = 0.7853981633974483_dp

contains

   !> Compute the sines and cosines of many angles, with the bits of `sine_and_cosine`.
   pure subroutine sines_and_cosines(isa, angle, sine, cosine)
      !> Instruction set, isa_base or isa_avx2
      integer, intent(in) :: isa
      !> Angles [rad]
      real(dp), intent(in), contiguous :: angle(:)
      !> Their sines and cosines
      real(dp), intent(out), contiguous :: sine(:), cosine(:)
      integer :: k

      if (isa == isa_avx2) then
         call sine_lanes_avx2(size(angle), angle, sine, cosine)
      else
         call sine_lanes(size(angle), angle, sine, cosine)
      end if
      do k = 1, size(angle)
         if (.not. abs(angle(k)) <= greatest_angle) call sine_and_cosine(angle(k), sine(k), cosine(k))
      end do
   end subroutine sines_and_cosines

   !> Sine and cosine of an angle
   elemental subroutine sine_and_cosine(angle, sine, cosine)
      !> Angle [rad]
      real(dp), intent(in) :: angle
      !> Its sine and cosine
      real(dp), intent(out) :: sine, cosine
      real(dp) :: r, rest, sines(1), cosines(1)
      integer(lp) :: quadrant, sign

      if (.not. ieee_is_finite(angle)) then
         sine = ieee_value(sine, ieee_quiet_nan)
         cosine = sine
      else if (abs(angle) <= greatest_angle) then
         call sine_lanes(1, [angle], sines, cosines)
         sine = sines(1)
         cosine = cosines(1)
      else
         call reduce_angle(abs(angle), quadrant, r, rest)
         sign = ieor(transfer(abs(angle), sign), transfer(angle, sign))
         call turned_sine(quadrant, sign, r, rest, sine, cosine)
      end if
   end subroutine sine_and_cosine

   !> Sine of an angle
   elemental real(dp) function sine(angle)
      !> Angle [rad]
      real(dp), intent(in) :: angle
      real(dp) :: cosine

      call sine_and_cosine(angle, sine, cosine)
   end function sine

   !> Cosine of an angle
   elemental real(dp) function cosine(angle)
      !> Angle [rad]
      real(dp), intent(in) :: angle
      real(dp) :: sine

      call sine_and_cosine(angle, sine, cosine)
   end function cosine

   !> Tangent of an angle: quotient of sine and cosine, both with their rounding errors
   elemental real(dp) function tangent(angle)
      !> Angle [rad]
      real(dp), intent(in) :: angle
      real(dp) :: r, rest, z, of_z, near_one, s(2), c(2), swapped(2), product, error
      integer(lp) :: quadrant

      tangent = ieee_value(tangent, ieee_quiet_nan)
      if (.not. ieee_is_finite(angle)) return
      tangent = angle
      ! The cube is below a third of the rounding error.
      if (abs(angle) < 2.0_dp**(-27)) return
      quadrant = 0_lp
      r = abs(angle)
      rest = 0.0_dp
      if (r > half_right_angle) call reduce_angle(abs(angle), quadrant, r, rest)
      call multiply(r, r, z, of_z)
      call add(1.0_dp, -0.5_dp*z, near_one, error)
      call add(near_one, error + (cosine_series(z) - (r*rest + 0.5_dp*of_z)), c(1), c(2))
      call add(r, r*sine_series(z) + rest*near_one, s(1), s(2))
      if (iand(quadrant, 1_lp) == 1_lp) then
         swapped = s
         s = -c
         c = swapped
      end if
      tangent = s(1)/c(1)
      call multiply(tangent, c(1), product, error)
      tangent = sign(1.0_dp, angle)*(tangent + (((s(1) - product) - error) + (s(2) - tangent*c(2)))/c(1))
   end function tangent

end module polydem_circular
