!> Motion of fixed bodies on a circle without a turn, as of an orbital shaker: x = x0 + a (cos(w e(t)) - 1,
!> sin(w e(t))), with the ramped time e.
module polydem_orbit
   use polydem_elementary, only: sine_and_cosine, two_pi
   use polydem_errors, only: error_t
   use polydem_kinds, only: wp
   use polydem_motion, only: motion_limits_t, motion_t, placement_t
   use polydem_ramp, only: ramp_t
   use polydem_settings, only: settings_t
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
      procedure :: limits
   end type orbit_t

contains

   !> Take radius and rate.
   subroutine configure(self, settings, number, error)
      class(orbit_t), intent(inout) :: self
      type(settings_t), intent(in) :: settings
      integer, intent(in) :: number
      type(error_t), allocatable, intent(inout) :: error

      if (allocated(error)) return
      self%radius = settings%motion(number)%amplitude(1)
      self%rate = two_pi*settings%motion(number)%frequency
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

   !> The speed, and the diameter of the circle; places change, but no angle.
   pure function limits(self)
      class(orbit_t), intent(in) :: self
      type(motion_limits_t) :: limits

      limits%speed = self%rate*abs(self%radius)
      limits%shift = 2.0_wp*abs(self%radius)
      limits%moves(:2) = abs(self%radius) > 0.0_wp
   end function limits

end module polydem_orbit
