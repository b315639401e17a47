!> Rotation of fixed bodies about a pivot.
module polydem_rotation
   use polydem_driven, only: along_angle, ramp_t
   use polydem_elementary, only: two_pi
   use polydem_errors, only: error_t
   use polydem_kinds, only: wp
   use polydem_motion, only: motion_t, placement_t
   use polydem_settings, only: motion_settings_t, settings_t
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
      procedure :: add_bounds
      procedure :: moves
      procedure :: has_pivot
      procedure :: starts_from_reference
   end type rotation_t

contains

   !> Take the rate; revolutions per second become radians per second.
   subroutine configure(self, settings, given, error)
      class(rotation_t), intent(inout) :: self
      type(settings_t), intent(in) :: settings
      type(motion_settings_t), intent(in) :: given
      type(error_t), allocatable, intent(inout) :: error

      associate (unused => settings)
      end associate
      if (allocated(error)) return
      self%rate = two_pi*given%rate
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

   !> Add speed and displacement of the farthest point. It can be on the other side of the pivot.
   pure subroutine add_bounds(self, arm, duration, speed, reach)
      class(rotation_t), intent(in) :: self
      real(wp), intent(in) :: arm, duration
      real(wp), intent(inout) :: speed, reach

      associate (unused => duration)
      end associate
      speed = speed + abs(self%rate)*(arm + reach)
      reach = reach + 2.0_wp*(arm + reach)
   end subroutine add_bounds

   !> It changes angles; in a periodic cell, where places matter, there is none.
   pure logical function moves(self, direction)
      class(rotation_t), intent(in) :: self
      integer, intent(in) :: direction

      associate (unused => self)
      end associate
      moves = direction == along_angle
   end function moves

   !> It turns about its pivot.
   pure logical function has_pivot(self)
      class(rotation_t), intent(in) :: self

      associate (unused => self)
      end associate
      has_pivot = .true.
   end function has_pivot

   !> It can start from reference.
   pure logical function starts_from_reference(self)
      class(rotation_t), intent(in) :: self

      associate (unused => self)
      end associate
      starts_from_reference = .true.
   end function starts_from_reference

end module polydem_rotation
