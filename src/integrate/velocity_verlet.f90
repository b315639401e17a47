!> Velocity Verlet: second order, symplectic, one force evaluation per step.
!>
!> x' = x + dt v + dt^2/2 a; forces at x' with the velocity v + dt a; v' = v + dt/2 (a + a')
!> (W.C. Swope, H.C. Andersen, P.H. Berens & K.R. Wilson, J. Chem. Phys. 76 (1982) 637).
module polydem_velocity_verlet
   use polydem_bodies, only: bodies_t
   use polydem_integrator, only: integrator_t, negligible
   use polydem_kinds, only: ip, wp
   use polydem_serializer, only: serializer_t
   use polydem_stability_limit, only: stability_table_t
   implicit none
   private
   public :: velocity_verlet_t

   !> Velocity Verlet
   type, extends(integrator_t) :: velocity_verlet_t
      !> Velocity and angular velocity in the middle of the step, (3, slot) [m/s, m/s, rad/s]
      real(wp), allocatable :: half(:, :)
   contains
      procedure :: start
      procedure :: predict
      procedure :: correct
      procedure :: stability
      procedure :: serialize_step
   end type velocity_verlet_t

contains

   !> Make room for the velocities in the middle of the step.
   subroutine start(self, bodies)
      class(velocity_verlet_t), intent(inout) :: self
      type(bodies_t), intent(in) :: bodies

      if (allocated(self%half)) deallocate (self%half)
      allocate (self%half(3, bodies%n))
   end subroutine start

   !> Move the bodies to the end of the step and predict the velocities there.
   subroutine predict(self, dt, first, last, bodies)
      class(velocity_verlet_t), intent(inout) :: self
      real(wp), intent(in) :: dt
      integer(ip), intent(in) :: first, last
      !> Bodies; position, angle and velocities of these change
      type(bodies_t), intent(inout) :: bodies
      integer(ip) :: s
      real(wp) :: h, half(3), gain(3), rate(3)

      h = 0.5_wp*dt
      do s = first, last
         rate(1) = cleared(bodies%acceleration(1, s))
         rate(2) = cleared(bodies%acceleration(2, s))
         rate(3) = cleared(bodies%angular_acceleration(s))
         gain = h*rate
         half(1) = cleared(bodies%velocity(1, s)) + gain(1)
         half(2) = cleared(bodies%velocity(2, s)) + gain(2)
         half(3) = cleared(bodies%angular_velocity(s)) + gain(3)
         bodies%position(1, s) = bodies%position(1, s) + dt*half(1)
         bodies%position(2, s) = bodies%position(2, s) + dt*half(2)
         bodies%angle(s) = bodies%angle(s) + dt*half(3)
         bodies%velocity(1, s) = half(1) + gain(1)
         bodies%velocity(2, s) = half(2) + gain(2)
         bodies%angular_velocity(s) = half(3) + gain(3)
         bodies%acceleration(1, s) = rate(1)
         bodies%acceleration(2, s) = rate(2)
         bodies%angular_acceleration(s) = rate(3)
         self%half(:, s) = half
      end do
   end subroutine predict

   !> A velocity or an acceleration, or zero if it is too small to move a body, as in `clear_negligible_motion`
   elemental real(wp) function cleared(value)
      real(wp), intent(in) :: value

      cleared = merge(0.0_wp, value, abs(value) < negligible)
   end function cleared

   !> Compute final velocities and accelerations from the forces at the end of the step.
   subroutine correct(self, dt, first, last, force, bodies)
      class(velocity_verlet_t), intent(inout) :: self
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
         bodies%velocity(1, s) = self%half(1, s) + h*bodies%acceleration(1, s)
         bodies%velocity(2, s) = self%half(2, s) + h*bodies%acceleration(2, s)
         bodies%angular_velocity(s) = self%half(3, s) + h*bodies%angular_acceleration(s)
      end do
   end subroutine correct

   !> Serialize the velocities in the middle of the step.
   subroutine serialize_step(self, serializer)
      class(velocity_verlet_t), intent(inout) :: self
      class(serializer_t), intent(inout) :: serializer

      call self%serialize(serializer)
      call serializer%field('/bodies/half_velocity', self%half, 'm/s, rad/s', 'velocities in the middle of the step')
   end subroutine serialize_step

   !> Stability limits for x'' + 2 z w x' + w^2 x = 0 with the force at the predicted velocity: beyond them the spectral
   !> radius exceeds 1.
   function stability(self) result(table)
      class(velocity_verlet_t), intent(in) :: self
      type(stability_table_t) :: table

      associate (unused => self)
      end associate
      table%damping_ratio = [0.0_wp, 0.0125_wp, 0.05_wp, 0.1_wp, 0.2_wp, 0.35_wp, 0.5_wp, 0.75_wp, 1.0_wp, 2.0_wp]
      table%limit = [2.0_wp, 1.9507_wp, 1.81_wp, 1.6397_wp, 1.3542_wp, 1.0413_wp, 0.8285_wp, 0.6056_wp, 0.4722_wp, &
                     0.2462_wp]
   end function stability

end module polydem_velocity_verlet
