!> Prescribed motion of fixed bodies: rotation about a pivot, translation, oscillation.
!>
!> The displacement is a closed function of time, never a sum over steps. Every motion starts smoothly: during
!> the ramp the rate rises as s(u) = u^2 (3 - 2 u) with u = (t - start)/ramp; the integral of s is u^3 - u^4/2.
module polydem_prescribed_motion
   use polydem_bodies, only: bodies_t
   use polydem_elementary, only: sine_and_cosine
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: motion_t, new_motion, move_bodies

   !> Prescribed motion of a set of fixed bodies
   type :: motion_t
      !> 'rotation', 'translation' or 'oscillation', as in the namelist
      character(len=11) :: kind = ''
      !> Centre of a rotation, (2) [m]
      real(wp) :: pivot(2) = 0.0_wp
      !> Angular velocity of a rotation, anticlockwise [rad/s]
      real(wp) :: rate = 0.0_wp
      !> Velocity of a translation, (2) [m/s]
      real(wp) :: velocity(2) = 0.0_wp
      !> Amplitude of an oscillation, (2) [m]
      real(wp) :: amplitude(2) = 0.0_wp
      !> Angular frequency of an oscillation [rad/s]
      real(wp) :: frequency = 0.0_wp
      !> Time at which the motion begins [s]
      real(wp) :: start = 0.0_wp
      !> Time from the start to the full rate [s]
      real(wp) :: ramp = 0.0_wp
      !> Slots of the bodies that it moves
      integer(ip), allocatable :: slots(:)
      !> Their positions before the motion, (2, :) [m]
      real(wp), allocatable :: position(:, :)
      !> Their angles before the motion [rad]
      real(wp), allocatable :: angle(:)
   end type motion_t

   !> Ramp of a motion, which rises smoothly from rest to the full rate
   type :: ramp_t
      !> Integral of the factor from the start of the motion [s]
      real(wp) :: elapsed = 0.0_wp
      !> Fraction of the full rate
      real(wp) :: factor = 0.0_wp
      !> Derivative of the factor [1/s]
      real(wp) :: growth = 0.0_wp
   end type ramp_t

contains

   !> Make a motion of some bodies from their present positions and angles.
   subroutine new_motion(motion, prescription, bodies, slots)
      !> The motion with slots, positions and angles of its bodies
      type(motion_t), intent(out) :: motion
      !> Parameters of the motion; its `slots`, `position` and `angle` are ignored
      type(motion_t), intent(in) :: prescription
      !> All bodies
      type(bodies_t), intent(in) :: bodies
      !> Slots of the bodies to move
      integer(ip), intent(in) :: slots(:)

      motion = prescription
      motion%slots = slots
      motion%position = bodies%position(:, slots)
      motion%angle = bodies%angle(slots)
   end subroutine new_motion

   !> Set positions, angles, velocities and accelerations of the bodies of a motion at a time.
   subroutine move_bodies(motion, time, bodies)
      type(motion_t), intent(in) :: motion
      !> Time since the start of the run [s]
      real(wp), intent(in) :: time
      !> Bodies; position, angle, velocities and accelerations of the bodies of the motion change
      type(bodies_t), intent(inout) :: bodies
      type(ramp_t) :: ramp

      ramp = ramp_at(motion, time)
      select case (motion%kind)
      case ('rotation')
         call rotate(motion, ramp, bodies)
      case ('translation')
         call shift(motion, motion%velocity, ramp%elapsed, ramp%factor, ramp%growth, bodies)
      case default
         call oscillate(motion, ramp, bodies)
      end select
   end subroutine move_bodies

   subroutine rotate(motion, ramp, bodies)
      type(motion_t), intent(in) :: motion
      type(ramp_t), intent(in) :: ramp
      type(bodies_t), intent(inout) :: bodies
      real(wp) :: turn, rate, growth, c, s, arm(2)
      integer(ip) :: k, slot

      turn = motion%rate*ramp%elapsed
      rate = motion%rate*ramp%factor
      growth = motion%rate*ramp%growth
      call sine_and_cosine(turn, s, c)
      do k = 1_ip, size(motion%slots, kind=ip)
         slot = motion%slots(k)
         arm = motion%position(:, k) - motion%pivot
         arm = [c*arm(1) - s*arm(2), s*arm(1) + c*arm(2)]
         bodies%position(:, slot) = motion%pivot + arm
         bodies%angle(slot) = motion%angle(k) + turn
         bodies%velocity(:, slot) = [-rate*arm(2), rate*arm(1)]
         bodies%angular_velocity(slot) = rate
         bodies%acceleration(:, slot) = [-growth*arm(2), growth*arm(1)] - rate**2*arm
         bodies%angular_acceleration(slot) = growth
      end do
   end subroutine rotate

   !> x = x0 + a sin(w e(t)) with the ramped time e. The amplitude is full from the start; the frequency rises.
   subroutine oscillate(motion, ramp, bodies)
      type(motion_t), intent(in) :: motion
      type(ramp_t), intent(in) :: ramp
      type(bodies_t), intent(inout) :: bodies
      real(wp) :: rate, c, s

      rate = motion%frequency*ramp%factor
      call sine_and_cosine(motion%frequency*ramp%elapsed, s, c)
      call shift(motion, motion%amplitude, s, rate*c, motion%frequency*ramp%growth*c - rate**2*s, bodies)
   end subroutine oscillate

   !> Shift the bodies of a motion along a vector.
   subroutine shift(motion, vector, place, speed, change, bodies)
      type(motion_t), intent(in) :: motion
      !> The vector, and the multiples of it that are the displacement, the velocity and the acceleration
      real(wp), intent(in) :: vector(2), place, speed, change
      type(bodies_t), intent(inout) :: bodies
      integer(ip) :: k

      do k = 1_ip, size(motion%slots, kind=ip)
         associate (slot => motion%slots(k))
            bodies%position(:, slot) = motion%position(:, k) + vector*place
            bodies%velocity(:, slot) = vector*speed
            bodies%acceleration(:, slot) = vector*change
         end associate
      end do
   end subroutine shift

   !> The ramp of a motion at a time
   pure type(ramp_t) function ramp_at(motion, time) result(ramp)
      type(motion_t), intent(in) :: motion
      !> Time since the start of the run [s]
      real(wp), intent(in) :: time
      real(wp) :: u

      if (time < motion%start) return
      if (time - motion%start >= motion%ramp) then
         ramp = ramp_t(time - motion%start - 0.5_wp*motion%ramp, 1.0_wp, 0.0_wp)
      else
         u = (time - motion%start)/motion%ramp
         ramp = ramp_t(motion%ramp*u*u*u*(1.0_wp - 0.5_wp*u), u*u*(3.0_wp - 2.0_wp*u), &
                       6.0_wp*u*(1.0_wp - u)/motion%ramp)
      end if
   end function ramp_at

end module polydem_prescribed_motion
