!> Prescribed motion of fixed bodies: rotation about a pivot, translation, oscillation, conveyor, table of poses.
!>
!> The displacement is a closed function of time, never a sum over steps. Every motion starts smoothly, and slows down
!> in the same way before its end (`polydem_driven`).
!>
!> A conveyor gives the surface of bodies a velocity without moving them: friction and dampings see it.
module polydem_prescribed_motion
   use polydem_bodies, only: bodies_t
   use polydem_driven, only: ramp_t, window_t
   use polydem_elementary, only: sine_and_cosine
   use polydem_kinds, only: ip, wp
   use polydem_motion_table, only: evaluate_table, motion_table_t
   implicit none
   private
   public :: motion_t, pose_bodies, carry_bodies, starts_from_reference, turn_about

   !> Prescribed motion
   type, extends(window_t) :: motion_t
      !> 'rotation', 'translation', 'oscillation', 'conveyor' or 'table', as in the namelist
      character(len=11) :: kind = ''
      !> Centre of the rotation, also of that of a table, (2) [m]
      real(wp) :: pivot(2) = 0.0_wp
      !> Angular velocity of a rotation, anticlockwise [rad/s]
      real(wp) :: rate = 0.0_wp
      !> Velocity of a translation, or of the surface of a conveyor, (2) [m/s]
      real(wp) :: velocity(2) = 0.0_wp
      !> Amplitude of an oscillation, (2) [m]
      real(wp) :: amplitude(2) = 0.0_wp
      !> Angular frequency of an oscillation [rad/s]
      real(wp) :: frequency = 0.0_wp
      !> Poses of a table
      type(motion_table_t), allocatable :: table
   end type motion_t

   !> Displacement along a vector: multiples of it that are displacement, velocity and acceleration
   type :: shift_t
      !> The vector, (2)
      real(wp) :: vector(2) = 0.0_wp
      !> The multiples
      real(wp) :: place = 0.0_wp, speed = 0.0_wp, change = 0.0_wp
   end type shift_t

contains

   !> Set positions, angles, velocities and accelerations of bodies that one motion moves from their reference poses.
   subroutine pose_bodies(motion, time, slots, position, angle, bodies)
      type(motion_t), intent(in) :: motion
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
      type(ramp_t) :: ramp
      type(shift_t) :: shift
      integer(ip) :: k

      ramp = motion%ramp_at(time)
      if (motion%kind == 'rotation') then
         call rotate(motion, ramp, slots, position, angle, bodies)
         return
      end if
      shift = shift_at(motion, ramp)
      do k = 1_ip, size(slots, kind=ip)
         bodies%position(:, slots(k)) = position(:, k) + shift%vector*shift%place
         bodies%velocity(:, slots(k)) = shift%vector*shift%speed
         bodies%acceleration(:, slots(k)) = shift%vector*shift%change
      end do
   end subroutine pose_bodies

   subroutine rotate(motion, ramp, slots, position, angle, bodies)
      type(motion_t), intent(in) :: motion
      type(ramp_t), intent(in) :: ramp
      integer(ip), intent(in) :: slots(:)
      real(wp), intent(in) :: position(:, :), angle(:)
      type(bodies_t), intent(inout) :: bodies
      real(wp) :: turn, rate, growth, c, s, arm(2)
      integer(ip) :: k, slot

      turn = motion%rate*ramp%elapsed
      rate = motion%rate*ramp%factor
      growth = motion%rate*ramp%growth
      call sine_and_cosine(turn, s, c)
      do k = 1_ip, size(slots, kind=ip)
         slot = slots(k)
         arm = position(:, k) - motion%pivot
         arm = [c*arm(1) - s*arm(2), s*arm(1) + c*arm(2)]
         bodies%position(:, slot) = motion%pivot + arm
         bodies%angle(slot) = angle(k) + turn
         bodies%velocity(:, slot) = [-rate*arm(2), rate*arm(1)]
         bodies%angular_velocity(slot) = rate
         bodies%acceleration(:, slot) = [-growth*arm(2), growth*arm(1)] - rate**2*arm
         bodies%angular_acceleration(slot) = growth
      end do
   end subroutine rotate

   !> Apply a motion to bodies that other motions have moved already: to their present positions, angles, velocities and
   !> accelerations.
   subroutine carry_bodies(motion, time, slots, bodies)
      type(motion_t), intent(in) :: motion
      !> Time since the start of the run [s]
      real(wp), intent(in) :: time
      !> Slots of the bodies
      integer(ip), intent(in) :: slots(:)
      !> Bodies; position, angle, velocities and accelerations of the bodies in the slots change
      type(bodies_t), intent(inout) :: bodies
      type(ramp_t) :: ramp
      type(shift_t) :: shift
      integer(ip) :: k

      if (motion%kind == 'table') then
         call follow_table(motion, time, slots, bodies)
         return
      end if
      ramp = motion%ramp_at(time)
      if (motion%kind == 'rotation') then
         call rotate_further(motion%pivot, ramp_t(motion%rate*ramp%elapsed, motion%rate*ramp%factor, &
                                                  motion%rate*ramp%growth), slots, bodies)
         return
      end if
      shift = shift_at(motion, ramp)
      do k = 1_ip, size(slots, kind=ip)
         associate (slot => slots(k))
            bodies%position(:, slot) = bodies%position(:, slot) + shift%vector*shift%place
            bodies%velocity(:, slot) = bodies%velocity(:, slot) + shift%vector*shift%speed
            bodies%acceleration(:, slot) = bodies%acceleration(:, slot) + shift%vector*shift%change
         end associate
      end do
   end subroutine carry_bodies

   !> Turn bodies about a pivot, from their present positions, angles, velocities and accelerations.
   pure subroutine turn_about(pivot, angle, rate, growth, slots, bodies)
      !> The pivot, (2) [m]
      real(wp), intent(in) :: pivot(2)
      !> Angle [rad], angular velocity [rad/s] and angular acceleration [rad/s2]
      real(wp), intent(in) :: angle, rate, growth
      !> Slots of the bodies
      integer(ip), intent(in) :: slots(:)
      !> Bodies; position, angle, velocities and accelerations of the bodies in the slots change
      type(bodies_t), intent(inout) :: bodies

      call rotate_further(pivot, ramp_t(angle, rate, growth), slots, bodies)
   end subroutine turn_about

   !> x = p + R (x0 - p) with moving x0: the velocity is R v0 + w x R (x0 - p), and the acceleration follows likewise.
   pure subroutine rotate_further(pivot, rotation, slots, bodies)
      real(wp), intent(in) :: pivot(2)
      !> Angle [rad], angular velocity [rad/s] and angular acceleration [rad/s2]
      type(ramp_t), intent(in) :: rotation
      integer(ip), intent(in) :: slots(:)
      type(bodies_t), intent(inout) :: bodies
      real(wp) :: turn, rate, growth, c, s, arm(2), velocity(2), acceleration(2)
      integer(ip) :: k, slot

      turn = rotation%elapsed
      rate = rotation%factor
      growth = rotation%growth
      call sine_and_cosine(turn, s, c)
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

   contains

      pure function turned(vector)
         real(wp), intent(in) :: vector(2)
         real(wp) :: turned(2)

         turned = [c*vector(1) - s*vector(2), s*vector(1) + c*vector(2)]
      end function turned

   end subroutine rotate_further

   !> Turn bodies by the angle of a table, then shift them.
   subroutine follow_table(motion, time, slots, bodies)
      type(motion_t), intent(in) :: motion
      real(wp), intent(in) :: time
      integer(ip), intent(in) :: slots(:)
      type(bodies_t), intent(inout) :: bodies
      real(wp) :: value(3), rate(3), growth(3)
      integer(ip) :: k

      call evaluate_table(motion%table, min(time, motion%end) - motion%start, value, rate, growth)
      if (time >= motion%end) then
         rate = 0.0_wp
         growth = 0.0_wp
      end if
      if (any(abs(motion%table%value(3, :)) > 0.0_wp)) &
         call rotate_further(motion%pivot, ramp_t(value(3), rate(3), growth(3)), slots, bodies)
      do k = 1_ip, size(slots, kind=ip)
         associate (slot => slots(k))
            bodies%position(:, slot) = bodies%position(:, slot) + value(:2)
            bodies%velocity(:, slot) = bodies%velocity(:, slot) + rate(:2)
            bodies%acceleration(:, slot) = bodies%acceleration(:, slot) + growth(:2)
         end associate
      end do
   end subroutine follow_table

   !> Whether a motion can set the poses of bodies from their reference poses (`pose_bodies`)
   pure logical function starts_from_reference(motion)
      type(motion_t), intent(in) :: motion

      starts_from_reference = motion%kind /= 'table' .and. motion%kind /= 'conveyor'
   end function starts_from_reference

   !> Displacement of a translation, or of an oscillation x = x0 + a sin(w e(t)) with the ramped time e. The amplitude
   !> of an oscillation is full from the start; the frequency rises. A conveyor has no displacement.
   type(shift_t) function shift_at(motion, ramp) result(shift)
      type(motion_t), intent(in) :: motion
      type(ramp_t), intent(in) :: ramp
      real(wp) :: rate, c, s

      if (motion%kind == 'translation') then
         shift = shift_t(motion%velocity, ramp%elapsed, ramp%factor, ramp%growth)
      else if (motion%kind == 'conveyor') then
         shift = shift_t(motion%velocity, 0.0_wp, ramp%factor, ramp%growth)
      else
         rate = motion%frequency*ramp%factor
         call sine_and_cosine(motion%frequency*ramp%elapsed, s, c)
         shift = shift_t(motion%amplitude, s, rate*c, motion%frequency*ramp%growth*c - rate**2*s)
      end if
   end function shift_at

end module polydem_prescribed_motion
