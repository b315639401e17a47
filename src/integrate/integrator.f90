!> Interface of all integration schemes.
!>
!> A time step has three parts. `predict` extrapolates positions, angles and velocities of the free bodies to the end of
!> the step. The forces are computed there, once. `correct` computes the final state from the forces. While the forces
!> are computed, velocity - dt/2 acceleration is the velocity in the middle of the step to second order. An integration
!> scheme changes neither turned vertices nor fixed bodies.
module polydem_integrator
   use polydem_bodies, only: bodies_t
   use polydem_kinds, only: ip, wp
   use polydem_serializer, only: serializer_t
   use polydem_stability_limit, only: stability_table_t
   implicit none
   private
   public :: integrator_t, drift, clear_negligible, clear_negligible_motion, negligible

   !> An integration scheme and its state
   type, abstract :: integrator_t
      !> Whether the scheme starts from the forces at time 0; otherwise it starts from gravity alone
      logical :: starts_from_forces = .true.
      !> Whether a body without acceleration coasts until a force acts on it: its prediction is final, `correct` would
      !> change no bit, and the next prediction changes nothing but its place, as `drift` does
      logical :: coasts_exactly = .false.
   contains
      !> Prepare for bodies whose accelerations are known
      procedure(start), deferred :: start
      !> Predict bodies at the end of the step
      procedure(predict), deferred :: predict
      !> Compute the final state of bodies from the forces
      procedure(correct), deferred :: correct
      !> Greatest stable products of angular frequency and time step
      procedure(stability), deferred :: stability
      procedure :: start_accelerations
      procedure :: serialize
      procedure :: serialize_step
   end type integrator_t

   abstract interface
      !> Prepare for bodies whose accelerations are known.
      subroutine start(self, bodies)
         import :: bodies_t, integrator_t
         class(integrator_t), intent(inout) :: self
         !> Bodies at the start
         type(bodies_t), intent(in) :: bodies
      end subroutine start

      !> Predict a run of bodies. Several threads may call it for different runs.
      subroutine predict(self, dt, first, last, bodies)
         import :: bodies_t, integrator_t, ip, wp
         class(integrator_t), intent(inout) :: self
         !> Time step [s]
         real(wp), intent(in) :: dt
         !> First and last slot of a run of free bodies
         integer(ip), intent(in) :: first, last
         !> Bodies; only these change
         type(bodies_t), intent(inout) :: bodies
      end subroutine predict

      !> Correct a run of bodies. Several threads may call it for different runs.
      subroutine correct(self, dt, first, last, force, bodies)
         import :: bodies_t, integrator_t, ip, wp
         class(integrator_t), intent(inout) :: self
         !> Time step [s]
         real(wp), intent(in) :: dt
         !> First and last slot of a run of free bodies
         integer(ip), intent(in) :: first, last
         !> Forces along x and y [N/m] and torques [N] at the end of the step, (3, slot)
         real(wp), intent(in) :: force(3, first:last)
         !> Bodies; only these change
         type(bodies_t), intent(inout) :: bodies
      end subroutine correct

      !> Greatest stable product of angular frequency and time step against the damping ratio.
      function stability(self) result(table)
         import :: integrator_t, stability_table_t
         class(integrator_t), intent(in) :: self
         type(stability_table_t) :: table
      end function stability
   end interface

   !> Velocities [m/s, rad/s], accelerations [m/s^2, rad/s^2] and scaled derivatives [m, rad] below this become zero.
   !> Their squares are below the least normal number, and they move no body. Left alone, decaying motion becomes
   !> subnormal; arithmetic with subnormal numbers takes a hundred times as long on many processors.
   real(wp), parameter :: negligible = sqrt(tiny(1.0_wp))

contains

   !> Move those bodies of a run that have coasted since the last prediction. The scheme coasts exactly. Velocities
   !> stay; accelerations and the state of the scheme are not read.
   pure subroutine drift(dt, n, coasts, velocity, spin, position, angle)
      !> Time step [s]
      real(wp), intent(in) :: dt
      !> Number of bodies
      integer(ip), intent(in) :: n
      !> Which bodies coast; the others are left alone
      logical, intent(in) :: coasts(n)
      !> Velocities [m/s] and angular velocities [rad/s]
      real(wp), intent(in) :: velocity(2, n), spin(n)
      !> Positions [m] and angles [rad]
      real(wp), intent(inout) :: position(2, n), angle(n)
      integer(ip) :: s

      do s = 1_ip, n
         position(1, s) = merge(position(1, s) + dt*velocity(1, s), position(1, s), coasts(s))
         position(2, s) = merge(position(2, s) + dt*velocity(2, s), position(2, s), coasts(s))
         angle(s) = merge(angle(s) + dt*spin(s), angle(s), coasts(s))
      end do
   end subroutine drift

   !> Set velocities and accelerations of a run of bodies to zero that are too small to move them. Schemes begin their
   !> prediction with it.
   pure subroutine clear_negligible_motion(first, last, bodies)
      !> First and last slot of the run
      integer(ip), intent(in) :: first, last
      !> Bodies; velocities and accelerations of these change
      type(bodies_t), intent(inout) :: bodies
      integer(ip) :: n

      n = last - first + 1_ip
      call clear_negligible(2_ip*n, bodies%velocity(1, first))
      call clear_negligible(2_ip*n, bodies%acceleration(1, first))
      call clear_negligible(n, bodies%angular_velocity(first))
      call clear_negligible(n, bodies%angular_acceleration(first))
   end subroutine clear_negligible_motion

   !> Set values to zero that are too small to move a body.
   pure subroutine clear_negligible(n, values)
      !> Number of values
      integer(ip), intent(in) :: n
      !> Values
      real(wp), intent(inout) :: values(n)
      integer(ip) :: k

      do k = 1_ip, n
         values(k) = merge(0.0_wp, values(k), abs(values(k)) < negligible)
      end do
   end subroutine clear_negligible

   !> Set the accelerations with which free bodies start: from their forces, or from gravity alone.
   pure subroutine start_accelerations(self, gravity, bodies)
      class(integrator_t), intent(in) :: self
      !> Acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      !> Bodies with their forces; accelerations of free bodies change
      type(bodies_t), intent(inout) :: bodies
      integer(ip) :: k

      do k = 1_ip, size(bodies%free, kind=ip)
         associate (s => bodies%free(k))
            if (self%starts_from_forces) then
               bodies%acceleration(:, s) = bodies%force(:, s)*bodies%inverse_mass(s)
               bodies%angular_acceleration(s) = bodies%torque(s)*bodies%inverse_inertia(s)
            else
               bodies%acceleration(:, s) = gravity
               bodies%angular_acceleration(s) = 0.0_wp
            end if
         end associate
      end do
   end subroutine start_accelerations

   !> Serialize the state of the scheme between steps. Schemes with such a state override this.
   subroutine serialize(self, serializer)
      class(integrator_t), intent(inout) :: self
      !> Serializer, which reads or writes columns over /bodies
      class(serializer_t), intent(inout) :: serializer

      associate (no_state => self, unused => serializer)
      end associate
   end subroutine serialize

   !> Serialize the state of the scheme in the middle of a step: that of `serialize`, and values that last from predict
   !> to correct. Schemes with such values override this.
   subroutine serialize_step(self, serializer)
      class(integrator_t), intent(inout) :: self
      !> Serializer, which reads or writes columns over /bodies
      class(serializer_t), intent(inout) :: serializer

      call self%serialize(serializer)
   end subroutine serialize_step

end module polydem_integrator
