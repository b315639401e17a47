!> Prescribed motion of fixed bodies: base type of all kinds.
!>
!> A motion turns bodies about a pivot and then shifts them, by closed functions of time, never by sums over steps.
!> Every motion starts smoothly, and slows down in the same way before its end (`polydem_driven`). A kind is a type of
!> its own, which `polydem_motion_factory` creates.
module polydem_motion
   use polydem_bodies, only: bodies_t
   use polydem_elementary, only: sine_and_cosine
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, lp, wp
   use polydem_ramp, only: window_t
   use polydem_settings, only: settings_t
   implicit none
   private
   public :: motion_t, motion_item_t, motion_limits_t, placement_t, pose_bodies, carry_bodies, turn_about

   !> What a motion does to bodies at a time
   type :: placement_t
      !> Whether it turns bodies, and whether it shifts them
      logical :: turns = .false., shifts = .false.
      !> Angle [rad], angular velocity [rad/s] and angular acceleration [rad/s2]
      real(wp) :: turn(3) = 0.0_wp
      !> Displacement [m], velocity [m/s] and acceleration [m/s2], (2, 3)
      real(wp) :: shift(2, 3) = 0.0_wp
   end type placement_t

   !> Upper bounds over all times
   type :: motion_limits_t
      !> Angular velocity [rad/s]
      real(wp) :: spin = 0.0_wp
      !> Speed of the shift [m/s]
      real(wp) :: speed = 0.0_wp
      !> Displacement by the shift; huge: it grows with `speed` as long as the motion acts [m]
      real(wp) :: shift = 0.0_wp
      !> Whether places along x and along y, and angles, change
      logical :: moves(3) = .false.
   end type motion_limits_t

   !> Prescribed motion
   type, abstract, extends(window_t) :: motion_t
      !> Its kind, as in the namelist
      character(len=:), allocatable :: kind
      !> Point about which it turns bodies, (2) [m]
      real(wp) :: pivot(2) = 0.0_wp
      !> Whether the pivot means something
      logical :: has_pivot = .false.
      !> Whether the motion, if it is the first, takes bodies from their reference poses (`pose_bodies`) and not from
      !> where they are put at rest. It must not both turn and shift them. Zeros have other signs then
      logical :: starts_from_reference = .false.
      !> Time from its start from which the bodies rest before the motion ends, for a warning [s]
      real(wp) :: rests_after = huge(1.0_wp)
      !> Hash of what the motion has beside the entries of the namelist; 0 if there is nothing
      integer(lp) :: hash = 0_lp
   contains
      procedure(configure_motion), deferred :: configure
      procedure(find_placement), deferred :: placement
      procedure(find_limits), deferred :: limits
   end type motion_t

   !> A motion of any kind
   type :: motion_item_t
      !> The motion
      class(motion_t), allocatable :: motion
   end type motion_item_t

   abstract interface
      !> Take the parameters of the kind from the settings. Window and pivot are set.
      subroutine configure_motion(self, settings, number, error)
         import :: motion_t, settings_t, error_t
         class(motion_t), intent(inout) :: self
         !> All settings
         type(settings_t), intent(in) :: settings
         !> Number of the motion in them
         integer, intent(in) :: number
         !> Names the entry and what is wrong
         type(error_t), allocatable, intent(inout) :: error
      end subroutine configure_motion

      !> What the motion does at a time, not before its start
      function find_placement(self, time) result(placement)
         import :: motion_t, placement_t, wp
         class(motion_t), intent(in) :: self
         !> Time since the start of the run [s]
         real(wp), intent(in) :: time
         type(placement_t) :: placement
      end function find_placement

      !> Upper bounds of what the motion does
      pure function find_limits(self) result(limits)
         import :: motion_t, motion_limits_t
         class(motion_t), intent(in) :: self
         type(motion_limits_t) :: limits
      end function find_limits
   end interface

contains

   !> Set positions, angles, velocities and accelerations of bodies that one motion moves from their reference poses.
   subroutine pose_bodies(motion, time, slots, position, angle, bodies)
      !> A motion that starts from reference
      class(motion_t), intent(in) :: motion
      !> Time since the start of the run [s]
      real(wp), intent(in) :: time
      !> Slots of the bodies
      integer(ip), intent(in) :: slots(:)
      !> Their positions before the motion, (2, :) [m]
      real(wp), intent(in) :: position(:, :)
      !> Their angles before the motion [rad]
      real(wp), intent(in) :: angle(:)
      !> Bodies; position, angle, velocities and accelerations of the bodies in the slots change
      type(bodies_t), intent(inout) :: bodies
      type(placement_t) :: at
      integer(ip) :: k

      at = motion%placement(time)
      if (at%turns) then
         call rotate(motion%pivot, at%turn, slots, position, angle, bodies)
         return
      end if
      do k = 1_ip, size(slots, kind=ip)
         bodies%position(:, slots(k)) = position(:, k) + at%shift(:, 1)
         bodies%velocity(:, slots(k)) = at%shift(:, 2)
         bodies%acceleration(:, slots(k)) = at%shift(:, 3)
      end do
   end subroutine pose_bodies

   !> Turn bodies about a pivot, from their reference poses.
   subroutine rotate(pivot, rotation, slots, position, angle, bodies)
      real(wp), intent(in) :: pivot(2), rotation(3)
      integer(ip), intent(in) :: slots(:)
      real(wp), intent(in) :: position(:, :), angle(:)
      type(bodies_t), intent(inout) :: bodies
      real(wp) :: c, s, arm(2)
      integer(ip) :: k, slot

      call sine_and_cosine(rotation(1), s, c)
      associate (turn => rotation(1), rate => rotation(2), growth => rotation(3))
         do k = 1_ip, size(slots, kind=ip)
            slot = slots(k)
            arm = position(:, k) - pivot
            arm = [c*arm(1) - s*arm(2), s*arm(1) + c*arm(2)]
            bodies%position(:, slot) = pivot + arm
            bodies%angle(slot) = angle(k) + turn
            bodies%velocity(:, slot) = [-rate*arm(2), rate*arm(1)]
            bodies%angular_velocity(slot) = rate
            bodies%acceleration(:, slot) = [-growth*arm(2), growth*arm(1)] - rate**2*arm
            bodies%angular_acceleration(slot) = growth
         end do
      end associate
   end subroutine rotate

   !> Apply a motion to bodies that other motions have moved already: to their present positions, angles, velocities and
   !> accelerations.
   subroutine carry_bodies(motion, time, slots, bodies)
      class(motion_t), intent(in) :: motion
      !> Time since the start of the run [s]
      real(wp), intent(in) :: time
      !> Slots of the bodies
      integer(ip), intent(in) :: slots(:)
      !> Bodies; position, angle, velocities and accelerations of the bodies in the slots change
      type(bodies_t), intent(inout) :: bodies
      type(placement_t) :: at
      integer(ip) :: k

      at = motion%placement(time)
      if (at%turns) call turn_about(motion%pivot, at%turn, slots, bodies)
      if (.not. at%shifts) return
      do k = 1_ip, size(slots, kind=ip)
         associate (slot => slots(k))
            bodies%position(:, slot) = bodies%position(:, slot) + at%shift(:, 1)
            bodies%velocity(:, slot) = bodies%velocity(:, slot) + at%shift(:, 2)
            bodies%acceleration(:, slot) = bodies%acceleration(:, slot) + at%shift(:, 3)
         end associate
      end do
   end subroutine carry_bodies

   !> Turn bodies about a pivot, from their present positions, angles, velocities and accelerations: x = p + R (x0 - p)
   !> with moving x0. The velocity is R v0 + w x R (x0 - p), and the acceleration follows likewise.
   pure subroutine turn_about(pivot, rotation, slots, bodies)
      !> The pivot, (2) [m]
      real(wp), intent(in) :: pivot(2)
      !> Angle [rad], angular velocity [rad/s] and angular acceleration [rad/s2]
      real(wp), intent(in) :: rotation(3)
      !> Slots of the bodies
      integer(ip), intent(in) :: slots(:)
      !> Bodies; position, angle, velocities and accelerations of the bodies in the slots change
      type(bodies_t), intent(inout) :: bodies
      real(wp) :: c, s, arm(2), velocity(2), acceleration(2)
      integer(ip) :: k, slot

      call sine_and_cosine(rotation(1), s, c)
      associate (turn => rotation(1), rate => rotation(2), growth => rotation(3))
         do k = 1_ip, size(slots, kind=ip)
            slot = slots(k)
            arm = turned(bodies%position(:, slot) - pivot)
            velocity = turned(bodies%velocity(:, slot))
            acceleration = turned(bodies%acceleration(:, slot))
            bodies%position(:, slot) = pivot + arm
            bodies%angle(slot) = bodies%angle(slot) + turn
            bodies%velocity(:, slot) = velocity + rate*[-arm(2), arm(1)]
            bodies%angular_velocity(slot) = bodies%angular_velocity(slot) + rate
            bodies%acceleration(:, slot) = acceleration + 2.0_wp*rate*[-velocity(2), velocity(1)] &
                                           + growth*[-arm(2), arm(1)] - rate**2*arm
            bodies%angular_acceleration(slot) = bodies%angular_acceleration(slot) + growth
         end do
      end associate

   contains

      pure function turned(vector)
         real(wp), intent(in) :: vector(2)
         real(wp) :: turned(2)

         turned = [c*vector(1) - s*vector(2), s*vector(1) + c*vector(2)]
      end function turned

   end subroutine turn_about

end module polydem_motion
