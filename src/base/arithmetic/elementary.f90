!> Elementary functions of the working precision, for all that results depend on: no other procedure of a run calls an
!> intrinsic sine, exponential and so on, whose bits would depend on the processor and its library.
!>
!> Single precision rounds the results of double precision. Quadruple precision uses the intrinsics: the compiler
!> computes all quadruple numbers in software.
module polydem_elementary
   use polydem_arcs, only: dp_arc_cosine => arc_cosine, dp_hypotenuse => hypotenuse
   use polydem_circular, only: dp_cosine => cosine, dp_sine => sine, dp_sine_and_cosine => sine_and_cosine, &
      dp_sines_and_cosines => sines_and_cosines, dp_tangent => tangent
   use polydem_exponential, only: dp_exponential => exponential, dp_logarithm => logarithm
   use polydem_kinds, only: dp, wp
   implicit none
   private
   public :: sine, cosine, sine_and_cosine, sines_and_cosines, tangent, arc_cosine, exponential, logarithm, hypotenuse
   public :: pi, two_pi

   real(wp), parameter :: pi = 3.14159265358979323846264338327950288_wp, two_pi = 2.0_wp*pi
   !> Whether the working precision is quadruple
   logical, parameter :: is_quadruple = precision(1.0_wp) > precision(1.0_dp)
   !> Number of angles of a block
   integer, parameter :: block_size = 64

contains

   !> Compute the sines and cosines of a block of angles, with the bits of `sine_and_cosine`.
   pure subroutine sines_and_cosines(isa, angle, sine, cosine)
      !> Instruction set, isa_base or isa_avx2
      integer, intent(in) :: isa
      !> Angles [rad]
      real(wp), intent(in) :: angle(:)
      !> Their sines and cosines
      real(wp), intent(out) :: sine(:), cosine(:)
      real(dp) :: a(block_size), s(block_size), c(block_size)
      integer :: done, n

      if (is_quadruple) then
         sine = sin(angle)
         cosine = cos(angle)
         return
      end if
      ! Arrays of constant size take no memory from the heap.
      do done = 0, size(angle) - 1, block_size
         n = min(block_size, size(angle) - done)
         a(:n) = real(angle(done + 1:done + n), dp)
         call dp_sines_and_cosines(isa, a(:n), s(:n), c(:n))
         sine(done + 1:done + n) = real(s(:n), wp)
         cosine(done + 1:done + n) = real(c(:n), wp)
      end do
   end subroutine sines_and_cosines

   !> Sine and cosine of an angle
   elemental subroutine sine_and_cosine(angle, sine, cosine)
      !> Angle [rad]
      real(wp), intent(in) :: angle
      !> Its sine and cosine
      real(wp), intent(out) :: sine, cosine
      real(dp) :: s, c

      if (is_quadruple) then
         sine = sin(angle)
         cosine = cos(angle)
      else
         call dp_sine_and_cosine(real(angle, dp), s, c)
         sine = real(s, wp)
         cosine = real(c, wp)
      end if
   end subroutine sine_and_cosine

   !> Sine
   elemental real(wp) function sine(angle)
      !> Angle [rad]
      real(wp), intent(in) :: angle

      sine = real(dp_sine(real(angle, dp)), wp)
      if (is_quadruple) sine = sin(angle)
   end function sine

   !> Cosine
   elemental real(wp) function cosine(angle)
      !> Angle [rad]
      real(wp), intent(in) :: angle

      cosine = real(dp_cosine(real(angle, dp)), wp)
      if (is_quadruple) cosine = cos(angle)
   end function cosine

   !> Tangent
   elemental real(wp) function tangent(angle)
      !> Angle [rad]
      real(wp), intent(in) :: angle

      tangent = real(dp_tangent(real(angle, dp)), wp)
      if (is_quadruple) tangent = tan(angle)
   end function tangent

   !> Exponential function
   elemental real(wp) function exponential(x)
      !> Exponent
      real(wp), intent(in) :: x

      exponential = real(dp_exponential(real(x, dp)), wp)
      if (is_quadruple) exponential = exp(x)
   end function exponential

   !> Natural logarithm
   elemental real(wp) function logarithm(x)
      !> Number, not negative
      real(wp), intent(in) :: x

      logarithm = real(dp_logarithm(real(x, dp)), wp)
      if (is_quadruple) logarithm = log(x)
   end function logarithm

   !> Arc cosine, from 0 to pi [rad]
   elemental real(wp) function arc_cosine(x)
      !> Cosine, from -1 to 1
      real(wp), intent(in) :: x

      arc_cosine = real(dp_arc_cosine(real(x, dp)), wp)
      if (is_quadruple) arc_cosine = acos(x)
   end function arc_cosine

   !> Length of the vector (x, y)
   elemental real(wp) function hypotenuse(x, y)
      !> Components of the vector
      real(wp), intent(in) :: x, y

      hypotenuse = real(dp_hypotenuse(real(x, dp), real(y, dp)), wp)
      if (is_quadruple) hypotenuse = hypot(x, y)
   end function hypotenuse

end module polydem_elementary
