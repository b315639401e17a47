!> Symplectic Euler: first order, one force evaluation per step.
!>
!> x' = x + dt v; forces at x' with the velocity v + dt a; v' = v + dt a' (R. de Vogelaere, report 4, Notre Dame 1956).
module polydem_symplectic_euler
   use polydem_bodies, only: bodies_t
   use polydem_integrator, only: clear_negligible_motion, integrator_t
   use polydem_kinds, only: ip, wp
   use polydem_stability_limit, only: stability_table_t
   implicit none
   private
   public :: symplectic_euler_t

   !> Symplectic Euler, without a state of its own
   type, extends(integrator_t) :: symplectic_euler_t
   contains
      procedure :: start
      procedure :: predict
      procedure :: correct
      procedure :: stability
   end type symplectic_euler_t

contains

   !> There is nothing to prepare.
   subroutine start(self, bodies)
      class(symplectic_euler_t), intent(inout) :: self
      type(bodies_t), intent(in) :: bodies

      associate (unused_self => self, unused_bodies => bodies)
      end associate
   end subroutine start

   !> Move the bodies to the end of the step and predict the velocities there.
   subroutine predict(self, dt, first, last, bodies)
      class(symplectic_euler_t), intent(inout) :: self
      real(wp), intent(in) :: dt
      integer(ip), intent(in) :: first, last
      type(bodies_t), intent(inout) :: bodies
      integer(ip) :: s

      associate (unused => self)
      end associate
      call clear_negligible_motion(first, last, bodies)
      do s = first, last
         bodies%position(:, s) = bodies%position(:, s) + dt*bodies%velocity(:, s)
         bodies%angle(s) = bodies%angle(s) + dt*bodies%angular_velocity(s)
         bodies%velocity(:, s) = bodies%velocity(:, s) + dt*bodies%acceleration(:, s)
         bodies%angular_velocity(s) = bodies%angular_velocity(s) + dt*bodies%angular_acceleration(s)
      end do
   end subroutine predict

   !> Replace the former accelerations in the velocities by those of the forces at the end of the step.
   subroutine correct(self, dt, first, last, force, bodies)
      class(symplectic_euler_t), intent(inout) :: self
      real(wp), intent(in) :: dt
      integer(ip), intent(in) :: first, last
      real(wp), intent(in) :: force(3, first:last)
      type(bodies_t), intent(inout) :: bodies
      real(wp) :: acceleration(2), growth
      integer(ip) :: s

      associate (unused => self)
      end associate
      do s = first, last
         acceleration = force(:2, s)*bodies%inverse_mass(s)
         growth = force(3, s)*bodies%inverse_inertia(s)
         bodies%velocity(:, s) = bodies%velocity(:, s) + dt*(acceleration - bodies%acceleration(:, s))
         bodies%angular_velocity(s) = bodies%angular_velocity(s) + dt*(growth - bodies%angular_acceleration(s))
         bodies%acceleration(:, s) = acceleration
         bodies%angular_acceleration(s) = growth
      end do
   end subroutine correct

   !> Velocity and acceleration change their signs in each step where (w dt)^2 + 12 z w dt = 4.
   function stability(self) result(table)
      class(symplectic_euler_t), intent(in) :: self
      type(stability_table_t) :: table

      associate (unused => self)
      end associate
      table%damping_ratio = [0.0_wp, 0.05_wp, 0.1_wp, 0.2_wp, 0.35_wp, 0.5_wp, 0.75_wp, 1.0_wp, 1.5_wp, 2.0_wp]
      table%limit = 2.0_wp*(sqrt(9.0_wp*table%damping_ratio**2 + 1.0_wp) - 3.0_wp*table%damping_ratio)
   end function stability

end module polydem_symplectic_euler
