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
      !> Velocity in the middle of the step, (2, slot) [m/s]
      real(wp), allocatable :: half(:, :)
      !> Angular velocity in the middle of the step [rad/s]
      real(wp), allocatable :: half_spin(:)
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

      if (allocated(self%half)) deallocate (self%half, self%half_spin)
      allocate (self%half(2, bodies%n), self%half_spin(bodies%n))
   end subroutine start

   !> Move the bodies to the end of the step and predict the velocities there.
   subroutine predict(self, dt, first, last, bodies)
      class(velocity_verlet_t), intent(inout) :: self
      real(wp), intent(in) :: dt
      integer(ip), intent(in) :: first, last
      !> Bodies; position, angle and velocities of these change
      type(bodies_t), intent(inout) :: bodies
      integer(ip) :: n

      n = last - first + 1_ip
      call move(dt, 2_ip*n, bodies%acceleration(1, first), bodies%velocity(1, first), self%half(1, first), &
                bodies%position(1, first))
      call move(dt, n, bodies%angular_acceleration(first), bodies%angular_velocity(first), self%half_spin(first), &
                bodies%angle(first))
   end subroutine predict

   !> Move some coordinates to the end of the step. What is too small to move a body becomes zero.
   pure subroutine move(dt, n, acceleration, velocity, half, place)
      !> Time step [s]
      real(wp), intent(in) :: dt
      !> Number of coordinates
      integer(ip), intent(in) :: n
      !> Their accelerations, and their velocities, which become those predicted at the end of the step
      real(wp), intent(inout) :: acceleration(n), velocity(n)
      !> Their velocities in the middle of the step
      real(wp), intent(inout) :: half(n)
      !> The coordinates
      real(wp), intent(inout) :: place(n)
      real(wp) :: gain
      integer(ip) :: k

      do k = 1_ip, n
         acceleration(k) = cleared(acceleration(k))
         gain = 0.5_wp*dt*acceleration(k)
         half(k) = cleared(velocity(k)) + gain
         place(k) = place(k) + dt*half(k)
         velocity(k) = half(k) + gain
      end do
   end subroutine move

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
      integer(ip) :: n

      n = last - first + 1_ip
      call accelerate(n, force, bodies%inverse_mass(first), bodies%inverse_inertia(first), &
                      bodies%acceleration(1, first), bodies%angular_acceleration(first))
      call add_second_half(dt, 2_ip*n, bodies%acceleration(1, first), self%half(1, first), bodies%velocity(1, first))
      call add_second_half(dt, n, bodies%angular_acceleration(first), self%half_spin(first), &
                           bodies%angular_velocity(first))
   end subroutine correct

   !> Compute the accelerations of some bodies.
   pure subroutine accelerate(n, force, inverse_mass, inverse_inertia, acceleration, angular_acceleration)
      !> Number of bodies
      integer(ip), intent(in) :: n
      !> Forces [N/m] and torques [N]
      real(wp), intent(in) :: force(3, n)
      !> Inverse masses [m/kg] and moments of inertia [1/(kg m)]
      real(wp), intent(in) :: inverse_mass(n), inverse_inertia(n)
      !> Accelerations [m/s2] and angular accelerations [rad/s2]
      real(wp), intent(inout) :: acceleration(2, n), angular_acceleration(n)
      integer(ip) :: s

      do s = 1_ip, n
         acceleration(1, s) = force(1, s)*inverse_mass(s)
         acceleration(2, s) = force(2, s)*inverse_mass(s)
         angular_acceleration(s) = force(3, s)*inverse_inertia(s)
      end do
   end subroutine accelerate

   !> Compute velocities at the end of the step from those in its middle.
   pure subroutine add_second_half(dt, n, acceleration, half, velocity)
      real(wp), intent(in) :: dt
      !> Number of coordinates
      integer(ip), intent(in) :: n
      !> Their accelerations at the end of the step, and their velocities in the middle
      real(wp), intent(in) :: acceleration(n), half(n)
      !> Their velocities at the end
      real(wp), intent(inout) :: velocity(n)
      integer(ip) :: k

      do k = 1_ip, n
         velocity(k) = half(k) + 0.5_wp*dt*acceleration(k)
      end do
   end subroutine add_second_half

   !> Serialize the velocities in the middle of the step.
   subroutine serialize_step(self, serializer)
      class(velocity_verlet_t), intent(inout) :: self
      class(serializer_t), intent(inout) :: serializer

      call self%serialize(serializer)
      call serializer%field('/bodies/half_velocity', self%half, 'm/s', 'velocities in the middle of the step')
      call serializer%field('/bodies/half_spin', self%half_spin, 'rad/s', &
                            'angular velocities in the middle of the step')
   end subroutine serialize_step

   !> Stability limits for x'' + 2 z w x' + w^2 x = 0 with the force at the predicted velocity: beyond them the spectral
   !> radius exceeds 1. It does so when velocity and acceleration change their signs in each step, where v = 0 and
   !> a = -4 x/dt^2: (w dt)^2 + 8 z w dt = 4, w dt = 2 (sqrt(1 + 4 z^2) - 2 z). So a strong dashpot c on a mass m,
   !> without a spring, allows c dt/m <= 1.
   function stability(self) result(table)
      class(velocity_verlet_t), intent(in) :: self
      type(stability_table_t) :: table

      associate (unused => self)
      end associate
      table%damping_ratio = [0.0_wp, 0.0125_wp, 0.05_wp, 0.1_wp, 0.2_wp, 0.35_wp, 0.5_wp, 0.75_wp, 1.0_wp, 1.2_wp, &
                             1.4_wp, 1.7_wp, 2.0_wp]
      table%limit = [2.0_wp, 1.9507_wp, 1.81_wp, 1.6397_wp, 1.3542_wp, 1.0413_wp, 0.8285_wp, 0.6056_wp, 0.4722_wp, &
                     0.4_wp, 0.3464_wp, 0.288_wp, 0.2462_wp]
   end function stability

end module polydem_velocity_verlet
