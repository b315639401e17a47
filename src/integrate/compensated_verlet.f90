!> Velocity Verlet with compensated sums: positions and velocities have two parts, a rounded value and its rounding
!> error.
!>
!> Every addition to a position or velocity is split without error into the rounded sum and its rounding error
!> (D.E. Knuth, The Art of Computer Programming 2, Sec. 4.2.2, Theorem B). The error enters the next addition
!> (W. Kahan, Commun. ACM 8 (1965) 40). The rounding error of millions of steps is therefore no greater than that of
!> one. Only the rounded value is visible to other modules. The compiler must not reorder sums (no -ffast-math).
module polydem_compensated_verlet
   use polydem_bodies, only: bodies_t
   use polydem_integrator, only: clear_negligible, clear_negligible_motion
   use polydem_kinds, only: ip, wp
   use polydem_serializer, only: serializer_t
   use polydem_velocity_verlet, only: velocity_verlet_t
   implicit none
   private
   public :: compensated_verlet_t

   !> Velocity Verlet with compensated sums; its stability is that of the plain scheme
   type, extends(velocity_verlet_t) :: compensated_verlet_t
      private
      !> Rounding errors of positions and angle, to be added, (3, slot) [m, m, rad]
      real(wp), allocatable :: lost_place(:, :)
      !> Rounding errors of velocities, to be added: at the end of a step, or half a step earlier together with `half`,
      !> (3, slot) [m/s, m/s, rad/s]
      real(wp), allocatable :: lost_speed(:, :)
   contains
      procedure :: start
      procedure :: predict
      procedure :: correct
      procedure :: serialize
   end type compensated_verlet_t

contains

   !> Start with rounding errors of zero.
   subroutine start(self, bodies)
      class(compensated_verlet_t), intent(inout) :: self
      type(bodies_t), intent(in) :: bodies

      call self%velocity_verlet_t%start(bodies)
      if (allocated(self%lost_place)) deallocate (self%lost_place, self%lost_speed)
      allocate (self%lost_place(3, bodies%n), self%lost_speed(3, bodies%n))
      self%lost_place = 0.0_wp
      self%lost_speed = 0.0_wp
   end subroutine start

   !> Move to the end of the step and predict the velocities there.
   subroutine predict(self, dt, first, last, bodies)
      class(compensated_verlet_t), intent(inout) :: self
      real(wp), intent(in) :: dt
      integer(ip), intent(in) :: first, last
      !> Bodies; position, angle and velocities of these change
      type(bodies_t), intent(inout) :: bodies
      integer(ip) :: s

      call clear_negligible_motion(first, last, bodies)
      call clear_negligible(3_ip*(last - first + 1_ip), self%lost_speed(1, first))
      do s = first, last
         call move(dt, bodies%acceleration(1, s), bodies%position(1, s), bodies%velocity(1, s), self%half(1, s), &
                   self%lost_place(1, s), self%lost_speed(1, s))
         call move(dt, bodies%acceleration(2, s), bodies%position(2, s), bodies%velocity(2, s), self%half(2, s), &
                   self%lost_place(2, s), self%lost_speed(2, s))
         call move(dt, bodies%angular_acceleration(s), bodies%angle(s), bodies%angular_velocity(s), self%half_spin(s), &
                   self%lost_place(3, s), self%lost_speed(3, s))
      end do
   end subroutine predict

   !> Final velocities and accelerations from the forces at the end of the step.
   subroutine correct(self, dt, first, last, force, bodies)
      class(compensated_verlet_t), intent(inout) :: self
      real(wp), intent(in) :: dt
      integer(ip), intent(in) :: first, last
      !> Forces along x and y [N/m] and torques [N], (3, slot)
      real(wp), intent(in) :: force(3, first:last)
      !> Bodies; velocities and accelerations of these change
      type(bodies_t), intent(inout) :: bodies
      integer(ip) :: s
      real(wp) :: h

      h = 0.5_wp*dt
      do s = first, last
         bodies%acceleration(1, s) = force(1, s)*bodies%inverse_mass(s)
         bodies%acceleration(2, s) = force(2, s)*bodies%inverse_mass(s)
         bodies%angular_acceleration(s) = force(3, s)*bodies%inverse_inertia(s)
         bodies%velocity(:, s) = self%half(:, s)
         bodies%angular_velocity(s) = self%half_spin(s)
         call add(h*bodies%acceleration(1, s), bodies%velocity(1, s), self%lost_speed(1, s))
         call add(h*bodies%acceleration(2, s), bodies%velocity(2, s), self%lost_speed(2, s))
         call add(h*bodies%angular_acceleration(s), bodies%angular_velocity(s), self%lost_speed(3, s))
      end do
   end subroutine correct

   !> Serialize the rounding errors.
   subroutine serialize(self, serializer)
      class(compensated_verlet_t), intent(inout) :: self
      class(serializer_t), intent(inout) :: serializer

      call serializer%field('/bodies/lost_place', self%lost_place, 'm, rad', 'rounding errors of x, y and angle')
      call serializer%field('/bodies/lost_speed', self%lost_speed, 'm/s, rad/s', 'rounding errors of their velocities')
   end subroutine serialize

   !> Predict one coordinate: its velocity in the middle of the step, its position and velocity at the end.
   pure subroutine move(dt, acceleration, place, velocity, half, lost_place, lost_speed)
      real(wp), intent(in) :: dt, acceleration
      real(wp), intent(inout) :: place, velocity, half, lost_place, lost_speed
      real(wp) :: gain

      gain = 0.5_wp*dt*acceleration
      half = velocity
      call add(gain, half, lost_speed)
      call add(dt*half + dt*lost_speed, place, lost_place)
      velocity = half + gain
   end subroutine move

   !> Add a number and the previous rounding error to a total; `lost` becomes the rounding error of the new total.
   pure subroutine add(number, total, lost)
      real(wp), intent(in) :: number
      real(wp), intent(inout) :: total, lost
      real(wp) :: addend, rounded, received

      addend = number + lost
      rounded = total + addend
      received = rounded - total
      lost = (total - (rounded - received)) + (addend - received)
      total = rounded
   end subroutine add

end module polydem_compensated_verlet
