!> Motion of fixed bodies on a circle without a turn, as of an orbital shaker: x = x0 + a (cos(w e(t)) - 1,
!> sin(w e(t))), with the ramped time e.
module polydem_orbit
   use polydem_driven, only: along_angle, ramp_t
   use polydem_elementary, only: sine_and_cosine, two_pi
   use polydem_errors, only: error_t
   use polydem_kinds, only: wp
   use polydem_motion, only: motion_t, placement_t
   use polydem_settings, only: motion_settings_t, settings_t
   implicit none
   private
   public :: orbit_t

   !> Motion on a circle
   type, extends(motion_t) :: orbit_t
      !> Radius of the circle [m], and angular velocity [rad/s]
      real(wp) :: radius = 0.0_wp, rate = 0.0_wp
   contains
      procedure :: configure
      procedure :: placement
      procedure :: add_bounds
      procedure :: moves
   end type orbit_t

contains

   !> Take radius and rate.
   subroutine configure(self, settings, given, error)
      class(orbit_t), intent(inout) :: self
      type(settings_t), intent(in) :: settings
      type(motion_settings_t), intent(in) :: given
      type(error_t), allocatable, intent(inout) :: error

      associate (unused => settings)
      end associate
      if (allocated(error)) return
      self%radius = given%amplitude(1)
      self%rate = two_pi*given%frequency
   end subroutine configure

   !> The shift at a time
   function placement(self, time) result(at)
      class(orbit_t), intent(in) :: self
      real(wp), intent(in) :: time
      type(placement_t) :: at
      type(ramp_t) :: ramp
      real(wp) :: rate, c, s

      ramp = self%ramp_at(time)
      rate = self%rate*ramp%factor
      call sine_and_cosine(self%rate*ramp%elapsed, s, c)
      at%shifts = .true.
      at%shift(:, 1) = self%radius*[c - 1.0_wp, s]
      at%shift(:, 2) = self%radius*rate*[-s, c]
      at%shift(:, 3) = self%radius*(self%rate*ramp%growth*[-s, c] - rate**2*[c, s])
   end function placement

   !> Add the speed, and the diameter of the circle.
   pure subroutine add_bounds(self, arm, duration, speed, reach)
      class(orbit_t), intent(in) :: self
      real(wp), intent(in) :: arm, duration
      real(wp), intent(inout) :: speed, reach

      associate (unused_arm => arm, unused_duration => duration)
      end associate
      speed = speed + self%rate*abs(self%radius)
      reach = reach + 2.0_wp*abs(self%radius)
   end subroutine add_bounds

   !> It changes both places, but no angle.
   pure logical function moves(self, direction)
      class(orbit_t), intent(in) :: self
      integer, intent(in) :: direction

      moves = direction /= along_angle .and. abs(self%radius) > 0.0_wp
   end function moves

end module polydem_orbit
