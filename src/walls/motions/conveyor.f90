!> Conveyor: the surface of fixed bodies has a velocity, the bodies stay. Friction and dampings see it.
module polydem_conveyor
   use polydem_elementary, only: hypotenuse
   use polydem_errors, only: error_t
   use polydem_kinds, only: wp
   use polydem_motion, only: motion_limits_t, motion_t, placement_t
   use polydem_ramp, only: ramp_t
   use polydem_settings, only: settings_t
   implicit none
   private
   public :: conveyor_t

   !> A conveyor
   type, extends(motion_t) :: conveyor_t
      !> Velocity of the surface, (2) [m/s]
      real(wp) :: velocity(2) = 0.0_wp
   contains
      procedure :: configure
      procedure :: placement
      procedure :: limits
   end type conveyor_t

contains

   !> Take the velocity.
   subroutine configure(self, settings, number, error)
      class(conveyor_t), intent(inout) :: self
      type(settings_t), intent(in) :: settings
      integer, intent(in) :: number
      type(error_t), allocatable, intent(inout) :: error

      if (allocated(error)) return
      self%velocity = settings%motion(number)%velocity
   end subroutine configure

   !> The shift at a time, without displacement
   function placement(self, time) result(at)
      class(conveyor_t), intent(in) :: self
      real(wp), intent(in) :: time
      type(placement_t) :: at
      type(ramp_t) :: ramp

      ramp = self%ramp_at(time)
      at%shifts = .true.
      at%shift(:, 2) = self%velocity*ramp%factor
      at%shift(:, 3) = self%velocity*ramp%growth
   end function placement

   !> The greatest speed of the surface; the bodies stay.
   pure function limits(self)
      class(conveyor_t), intent(in) :: self
      type(motion_limits_t) :: limits

      limits%speed = hypotenuse(self%velocity(1), self%velocity(2))
   end function limits

end module polydem_conveyor
