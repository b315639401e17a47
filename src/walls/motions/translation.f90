!> Translation of fixed bodies.
module polydem_translation
   use polydem_elementary, only: hypotenuse
   use polydem_errors, only: error_t
   use polydem_kinds, only: wp
   use polydem_motion, only: motion_limits_t, motion_t, placement_t
   use polydem_ramp, only: ramp_t
   use polydem_settings, only: settings_t
   implicit none
   private
   public :: translation_t

   !> A translation
   type, extends(motion_t) :: translation_t
      !> Velocity, (2) [m/s]
      real(wp) :: velocity(2) = 0.0_wp
   contains
      procedure :: configure
      procedure :: placement
      procedure :: limits
   end type translation_t

contains

   !> Take the velocity.
   subroutine configure(self, settings, number, error)
      class(translation_t), intent(inout) :: self
      type(settings_t), intent(in) :: settings
      integer, intent(in) :: number
      type(error_t), allocatable, intent(inout) :: error

      if (allocated(error)) return
      self%velocity = settings%motion(number)%velocity
      self%starts_from_reference = .true.
   end subroutine configure

   !> The shift at a time
   function placement(self, time) result(at)
      class(translation_t), intent(in) :: self
      real(wp), intent(in) :: time
      type(placement_t) :: at
      type(ramp_t) :: ramp

      ramp = self%ramp_at(time)
      at%shifts = .true.
      at%shift(:, 1) = self%velocity*ramp%elapsed
      at%shift(:, 2) = self%velocity*ramp%factor
      at%shift(:, 3) = self%velocity*ramp%growth
   end function placement

   !> The greatest speed; the displacement has no bound of its own.
   pure function limits(self)
      class(translation_t), intent(in) :: self
      type(motion_limits_t) :: limits

      limits%speed = hypotenuse(self%velocity(1), self%velocity(2))
      limits%shift = huge(1.0_wp)
      limits%moves(:2) = abs(self%velocity) > 0.0_wp
   end function limits

end module polydem_translation
