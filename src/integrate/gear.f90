!> Gear's predictor-corrector scheme with six values, as used by Matuttis & Chen (2014).
!>
!> C.W. Gear, Numerical Initial Value Problems in Ordinary Differential Equations (1971). The values are the scaled
!> derivatives r_k = x^(k) dt^k/k!. The Pascal triangle predicts them; the correction is c_k times the difference of
!> r_2, with c = 3/16, 251/360, 1, 11/18, 1/6, 1/60 for forces that depend on velocities. For other forces 3/20
!> replaces 3/16. There is one force evaluation per step, at the predicted state. The scheme starts from gravity
!> alone, with zero higher derivatives.
module polydem_gear
   use polydem_bodies, only: bodies_t
   use polydem_integrator, only: integrator_t, clear_negligible, clear_negligible_motion
   use polydem_kinds, only: ip, wp
   use polydem_serializer, only: serializer_t
   use polydem_stability_limit, only: stability_table_t
   implicit none
   private
   public :: gear_t, for_positions

   !> Corrector c_0 for forces that depend on velocities
   real(wp), parameter :: for_velocities = 3.0_wp/16.0_wp
   !> Corrector c_0 for forces that depend on positions alone
   real(wp), parameter :: for_positions = 3.0_wp/20.0_wp

   !> Gear's scheme of fifth order
   type, extends(integrator_t) :: gear_t
      !> Corrector c_0, that of the position
      real(wp) :: c0 = for_velocities
      !> Scaled third to fifth derivatives of x, y and angle, (3..5, 3, slot)
      real(wp), allocatable, private :: higher(:, :, :)
   contains
      procedure :: start
      procedure :: predict
      procedure :: correct
      procedure :: stability
      procedure :: serialize
   end type gear_t

   !> Corrector c_1, and those of the third to fifth derivatives
   real(wp), parameter :: c1 = 251.0_wp/360.0_wp
   real(wp), parameter :: c_higher(3:5) = [11.0_wp/18.0_wp, 1.0_wp/6.0_wp, 1.0_wp/60.0_wp]

contains

   !> Start with zero derivatives above the second.
   subroutine start(self, bodies)
      class(gear_t), intent(inout) :: self
      type(bodies_t), intent(in) :: bodies

      if (allocated(self%higher)) deallocate (self%higher)
      allocate (self%higher(3:5, 3, bodies%n))
      self%higher = 0.0_wp
   end subroutine start

   !> Predict by a Taylor expansion to the end of the step.
   subroutine predict(self, dt, first, last, bodies)
      class(gear_t), intent(inout) :: self
      real(wp), intent(in) :: dt
      integer(ip), intent(in) :: first, last
      !> Bodies; position, angle, velocities and accelerations of these change
      type(bodies_t), intent(inout) :: bodies
      integer(ip) :: s

      call clear_negligible_motion(first, last, bodies)
      call clear_negligible(9_ip*(last - first + 1_ip), self%higher(3, 1, first))
      do s = first, last
         call expand(dt, bodies%position(1, s), bodies%velocity(1, s), bodies%acceleration(1, s), self%higher(:, 1, s))
         call expand(dt, bodies%position(2, s), bodies%velocity(2, s), bodies%acceleration(2, s), self%higher(:, 2, s))
         call expand(dt, bodies%angle(s), bodies%angular_velocity(s), bodies%angular_acceleration(s), &
                     self%higher(:, 3, s))
      end do
   end subroutine predict

   !> Correct all derivatives by the difference between computed and predicted acceleration.
   subroutine correct(self, dt, first, last, force, bodies)
      class(gear_t), intent(inout) :: self
      real(wp), intent(in) :: dt
      integer(ip), intent(in) :: first, last
      !> Forces along x and y [N/m] and torques [N], (3, slot)
      real(wp), intent(in) :: force(3, first:last)
      !> Bodies; position, angle, velocities and accelerations of these change
      type(bodies_t), intent(inout) :: bodies
      integer(ip) :: s

      do s = first, last
         call adjust(self%c0, dt, force(1, s)*bodies%inverse_mass(s), bodies%position(1, s), &
                     bodies%velocity(1, s), bodies%acceleration(1, s), self%higher(:, 1, s))
         call adjust(self%c0, dt, force(2, s)*bodies%inverse_mass(s), bodies%position(2, s), &
                     bodies%velocity(2, s), bodies%acceleration(2, s), self%higher(:, 2, s))
         call adjust(self%c0, dt, force(3, s)*bodies%inverse_inertia(s), bodies%angle(s), &
                     bodies%angular_velocity(s), bodies%angular_acceleration(s), self%higher(:, 3, s))
      end do
   end subroutine correct

   !> Serialize the derivatives above the second.
   subroutine serialize(self, serializer)
      class(gear_t), intent(inout) :: self
      class(serializer_t), intent(inout) :: serializer

      call serializer%field('/bodies/gear_higher', self%higher, 'm, rad', &
                        'third to fifth derivatives of x, y and angle times dt^k/k!')
   end subroutine serialize

   !> Taylor expansion of one coordinate: the Pascal triangle applied to its scaled derivatives.
   pure subroutine expand(dt, x, v, a, r)
      real(wp), intent(in) :: dt
      real(wp), intent(inout) :: x, v, a, r(3:5)
      real(wp) :: r1, r2

      r1 = v*dt
      r2 = 0.5_wp*a*dt*dt
      x = x + r1 + r2 + r(3) + r(4) + r(5)
      r1 = r1 + 2.0_wp*r2 + 3.0_wp*r(3) + 4.0_wp*r(4) + 5.0_wp*r(5)
      r2 = r2 + 3.0_wp*r(3) + 6.0_wp*r(4) + 10.0_wp*r(5)
      r(3) = r(3) + 4.0_wp*r(4) + 10.0_wp*r(5)
      r(4) = r(4) + 5.0_wp*r(5)
      v = r1/dt
      a = 2.0_wp*r2/(dt*dt)
   end subroutine expand

   !> Correct one coordinate by the difference between computed and predicted acceleration.
   pure subroutine adjust(c0, dt, computed, x, v, a, r)
      real(wp), intent(in) :: c0, dt, computed
      real(wp), intent(inout) :: x, v, a, r(3:5)
      real(wp) :: difference

      difference = 0.5_wp*dt*dt*(computed - a)
      x = x + c0*difference
      v = v + c1*difference/dt
      a = computed
      r = r + c_higher*difference
   end subroutine adjust

   !> Stability limits for x'' + 2 z w x' + w^2 x = 0 with one force evaluation per step: beyond them the spectral
   !> radius exceeds 1.
   !>
   !> With c_0 = 3/20 an undamped oscillation grows at any time step: by 1e-6 per step at the limit given here, by 1e-9
   !> per step at w dt = 0.1.
   function stability(self) result(table)
      class(gear_t), intent(in) :: self
      type(stability_table_t) :: table

      table%damping_ratio = [0.0_wp, 0.0125_wp, 0.05_wp, 0.1_wp, 0.2_wp, 0.35_wp, 0.5_wp, 0.75_wp, 1.0_wp, 2.0_wp]
      if (self%c0 < for_velocities) then
         table%limit = [0.248_wp, 0.7879_wp, 0.6515_wp, 0.5127_wp, 0.3411_wp, 0.2177_wp, 0.1575_wp, 0.1071_wp, &
                        0.0809_wp, 0.0408_wp]
      else
         table%limit = [0.313_wp, 0.7516_wp, 0.6271_wp, 0.4986_wp, 0.3361_wp, 0.2163_wp, 0.157_wp, 0.107_wp, &
                        0.0809_wp, 0.0408_wp]
      end if
   end function stability

end module polydem_gear
