!> Conveyor: the surface of fixed bodies has a velocity, the bodies stay. Friction and dampings see it.
module polydem_conveyor
   use polydem_driven, only: ramp_t
   use polydem_elementary, only: hypotenuse
   use polydem_errors, only: error_t
   use polydem_kinds, only: wp
   use polydem_motion, only: motion_t, placement_t
   use polydem_settings, only: motion_settings_t, settings_t
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
      procedure :: add_bounds
      procedure :: moves
   end type conveyor_t

contains

   !> Take the velocity.
   subroutine configure(self, settings, given, error)
      class(conveyor_t), intent(inout) :: self
      type(settings_t), intent(in) :: settings
      type(motion_settings_t), intent(in) :: given
      type(error_t), allocatable, intent(inout) :: error

      associate (unused => settings)
      end associate
      if (allocated(error)) return
      self%velocity = given%velocity
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

   !> Add the speed of the surface.
   pure subroutine add_bounds(self, arm, duration, speed, reach)
      class(conveyor_t), intent(in) :: self
      real(wp), intent(in) :: arm, duration
      real(wp), intent(inout) :: speed, reach

      associate (unused_arm => arm, unused_duration => duration, unused_reach => reach)
      end associate
      speed = speed + hypotenuse(self%velocity(1), self%velocity(2))
   end subroutine add_bounds

   !> The bodies stay.
   pure logical function moves(self, direction)
      class(conveyor_t), intent(in) :: self
      integer, intent(in) :: direction

      associate (unused_self => self, unused_direction => direction)
      end associate
      moves = .false.
   end function moves

end module polydem_conveyor
