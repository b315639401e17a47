!> Translation of fixed bodies.
module polydem_translation
   use polydem_driven, only: along_angle, ramp_t
   use polydem_elementary, only: hypotenuse
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, wp
   use polydem_motion, only: motion_t, placement_t
   use polydem_settings, only: motion_settings_t, settings_t
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
      procedure :: add_bounds
      procedure :: moves
      procedure :: starts_from_reference
   end type translation_t

contains

   !> Take the velocity.
   subroutine configure(self, settings, given, error)
      class(translation_t), intent(inout) :: self
      type(settings_t), intent(in) :: settings
      type(motion_settings_t), intent(in) :: given
      type(error_t), allocatable, intent(inout) :: error

      associate (unused => settings)
      end associate
      if (allocated(error)) return
      self%velocity = given%velocity
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

   !> Add the speed, and the displacement until the end of the run. The start in a stage is not known yet.
   pure subroutine add_bounds(self, arm, duration, speed, reach)
      class(translation_t), intent(in) :: self
      real(wp), intent(in) :: arm, duration
      real(wp), intent(inout) :: speed, reach

      associate (unused => arm)
      end associate
      speed = speed + hypotenuse(self%velocity(1), self%velocity(2))
      reach = reach + hypotenuse(self%velocity(1), self%velocity(2)) &
              *max(0.0_wp, min(duration, self%end) - merge(0.0_wp, self%start, self%stage > 0_ip))
   end subroutine add_bounds

   !> Whether it has a velocity along an axis
   pure logical function moves(self, direction)
      class(translation_t), intent(in) :: self
      integer, intent(in) :: direction

      moves = .false.
      if (direction /= along_angle) moves = abs(self%velocity(direction)) > 0.0_wp
   end function moves

   !> It can start from reference.
   pure logical function starts_from_reference(self)
      class(translation_t), intent(in) :: self

      associate (unused => self)
      end associate
      starts_from_reference = .true.
   end function starts_from_reference

end module polydem_translation
