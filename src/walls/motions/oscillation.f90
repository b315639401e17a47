!> Oscillation of fixed bodies: x = x0 + a sin(w e(t)) with the ramped time e. The amplitude is full from the start; the
!> frequency rises.
module polydem_oscillation
   use polydem_driven, only: along_angle, ramp_t
   use polydem_elementary, only: hypotenuse, sine_and_cosine, two_pi
   use polydem_errors, only: error_t
   use polydem_kinds, only: wp
   use polydem_motion, only: motion_t, placement_t
   use polydem_settings, only: motion_settings_t, settings_t
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
      procedure :: add_bounds
      procedure :: moves
      procedure :: starts_from_reference
   end type oscillation_t

contains

   !> Take amplitude and frequency; hertz become radians per second.
   subroutine configure(self, settings, given, error)
      class(oscillation_t), intent(inout) :: self
      type(settings_t), intent(in) :: settings
      type(motion_settings_t), intent(in) :: given
      type(error_t), allocatable, intent(inout) :: error

      associate (unused => settings)
      end associate
      if (allocated(error)) return
      self%amplitude = given%amplitude
      self%frequency = two_pi*given%frequency
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

   !> Add the greatest speed, and the amplitude.
   pure subroutine add_bounds(self, arm, duration, speed, reach)
      class(oscillation_t), intent(in) :: self
      real(wp), intent(in) :: arm, duration
      real(wp), intent(inout) :: speed, reach

      associate (unused_arm => arm, unused_duration => duration)
      end associate
      speed = speed + self%frequency*hypotenuse(self%amplitude(1), self%amplitude(2))
      reach = reach + hypotenuse(self%amplitude(1), self%amplitude(2))
   end subroutine add_bounds

   !> Whether it has an amplitude along an axis
   pure logical function moves(self, direction)
      class(oscillation_t), intent(in) :: self
      integer, intent(in) :: direction

      moves = .false.
      if (direction /= along_angle) moves = abs(self%amplitude(direction)) > 0.0_wp
   end function moves

   !> It can start from reference.
   pure logical function starts_from_reference(self)
      class(oscillation_t), intent(in) :: self

      associate (unused => self)
      end associate
      starts_from_reference = .true.
   end function starts_from_reference

end module polydem_oscillation
