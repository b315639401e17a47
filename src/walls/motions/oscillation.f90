!> Oscillation of fixed bodies: x = x0 + a sin(w e(t)) with the ramped time e. The amplitude is full from the start; the
!> frequency rises.
module polydem_oscillation
   use polydem_elementary, only: hypotenuse, sine_and_cosine, two_pi
   use polydem_errors, only: error_t
   use polydem_kinds, only: wp
   use polydem_motion, only: motion_limits_t, motion_t, placement_t
   use polydem_ramp, only: ramp_t
   use polydem_settings, only: settings_t
   implicit none
   private
   public :: oscillation_t

   !> An oscillation
   type, extends(motion_t) :: oscillation_t
      !> Amplitude, (2) [m]
      real(wp) :: amplitude(2) = 0.0_wp
      !> Angular frequency [rad/s]
      real(wp) :: frequency = 0.0_wp
   contains
      procedure :: configure
      procedure :: placement
      procedure :: limits
   end type oscillation_t

contains

   !> Take amplitude and frequency; hertz become radians per second.
   subroutine configure(self, settings, number, error)
      class(oscillation_t), intent(inout) :: self
      type(settings_t), intent(in) :: settings
      integer, intent(in) :: number
      type(error_t), allocatable, intent(inout) :: error

      if (allocated(error)) return
      self%amplitude = settings%motion(number)%amplitude
      self%frequency = two_pi*settings%motion(number)%frequency
      self%starts_from_reference = .true.
   end subroutine configure

   !> The shift at a time
   function placement(self, time) result(at)
      class(oscillation_t), intent(in) :: self
      real(wp), intent(in) :: time
      type(placement_t) :: at
      type(ramp_t) :: ramp
      real(wp) :: rate, c, s

      ramp = self%ramp_at(time)
      rate = self%frequency*ramp%factor
      call sine_and_cosine(self%frequency*ramp%elapsed, s, c)
      at%shifts = .true.
      at%shift(:, 1) = self%amplitude*s
      at%shift(:, 2) = self%amplitude*(rate*c)
      at%shift(:, 3) = self%amplitude*(self%frequency*ramp%growth*c - rate**2*s)
   end function placement

   !> The greatest speed, and the amplitude
   pure function limits(self)
      class(oscillation_t), intent(in) :: self
      type(motion_limits_t) :: limits

      limits%speed = self%frequency*hypotenuse(self%amplitude(1), self%amplitude(2))
      limits%shift = hypotenuse(self%amplitude(1), self%amplitude(2))
      limits%moves(:2) = abs(self%amplitude) > 0.0_wp
   end function limits

end module polydem_oscillation
