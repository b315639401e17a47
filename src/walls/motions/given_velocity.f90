!> Motion of a wall with a velocity that an action gives it, from a step of the run on.
module polydem_given_velocity
   use polydem_elementary, only: hypotenuse
   use polydem_errors, only: error_t
   use polydem_kinds, only: wp
   use polydem_motion, only: motion_limits_t, motion_t, placement_t
   use polydem_settings, only: settings_t
   implicit none
   private
   public :: given_velocity_t

   !> A steady velocity: the wall turns about a pivot that it takes along
   type, extends(motion_t) :: given_velocity_t
      !> Velocity, (2) [m/s], and angular velocity [rad/s]
      real(wp) :: velocity(2) = 0.0_wp, spin = 0.0_wp
   contains
      procedure :: configure
      procedure :: placement
      procedure :: limits
   end type given_velocity_t

contains

   !> There are no entries for it.
   subroutine configure(self, settings, number, error)
      class(given_velocity_t), intent(inout) :: self
      type(settings_t), intent(in) :: settings
      integer, intent(in) :: number
      type(error_t), allocatable, intent(inout) :: error

      associate (unused_self => self, unused_settings => settings, unused_number => number)
      end associate
      if (allocated(error)) return
   end subroutine configure

   !> The turn and the shift since its start
   function placement(self, time) result(at)
      class(given_velocity_t), intent(in) :: self
      real(wp), intent(in) :: time
      type(placement_t) :: at

      at%turns = abs(self%spin) > 0.0_wp
      at%turn(:2) = [self%spin*(time - self%start), self%spin]
      at%shifts = .true.
      at%shift(:, 1) = self%velocity*(time - self%start)
      at%shift(:, 2) = self%velocity
   end function placement

   !> Both speeds; the displacement has no bound.
   pure function limits(self)
      class(given_velocity_t), intent(in) :: self
      type(motion_limits_t) :: limits

      limits%speed = hypotenuse(self%velocity(1), self%velocity(2))
      limits%spin = abs(self%spin)
      limits%shift = huge(1.0_wp)
      limits%moves = [abs(self%velocity) > 0.0_wp, abs(self%spin) > 0.0_wp]
   end function limits

end module polydem_given_velocity
