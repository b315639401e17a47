!> Rotation of fixed bodies about a pivot.
module polydem_rotation
   use polydem_driven, only: along_angle
   use polydem_elementary, only: two_pi
   use polydem_errors, only: error_t
   use polydem_kinds, only: wp
   use polydem_motion, only: motion_limits_t, motion_t, placement_t
   use polydem_ramp, only: ramp_t
   use polydem_settings, only: settings_t
   implicit none
   private
   public :: rotation_t

   !> A rotation
   type, extends(motion_t) :: rotation_t
      !> Angular velocity, anticlockwise [rad/s]
      real(wp) :: rate = 0.0_wp
   contains
      procedure :: configure
      procedure :: placement
      procedure :: limits
   end type rotation_t

contains

   !> Take the rate; revolutions per second become radians per second.
   subroutine configure(self, settings, number, error)
      class(rotation_t), intent(inout) :: self
      type(settings_t), intent(in) :: settings
      integer, intent(in) :: number
      type(error_t), allocatable, intent(inout) :: error

      if (allocated(error)) return
      self%rate = two_pi*settings%motion(number)%rate
      self%has_pivot = .true.
      self%starts_from_reference = .true.
   end subroutine configure

   !> The turn at a time
   function placement(self, time) result(at)
      class(rotation_t), intent(in) :: self
      real(wp), intent(in) :: time
      type(placement_t) :: at
      type(ramp_t) :: ramp

      ramp = self%ramp_at(time)
      at%turns = .true.
      at%turn = self%rate*[ramp%elapsed, ramp%factor, ramp%growth]
   end function placement

   !> The greatest angular velocity
   pure function limits(self)
      class(rotation_t), intent(in) :: self
      type(motion_limits_t) :: limits

      limits%spin = abs(self%rate)
      limits%moves(along_angle) = limits%spin > 0.0_wp
   end function limits

end module polydem_rotation
