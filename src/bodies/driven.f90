!> What drives walls and cells: a degree of freedom that a force accelerates in a window of time.
!>
!> It obeys M d2q/dt2 = F - c dq/dt while its window is open; before and afterwards it is at rest where it is. It is
!> integrated by velocity Verlet as bodies are; the damping is implicit in the velocity at the end of the step, so it is
!> stable for any coefficient.
module polydem_driven
   use polydem_kinds, only: wp
   use polydem_ramp, only: window_t
   implicit none
   private
   public :: driven_t, along_angle

   !> Direction of a turn; 1 and 2 are x and y
   integer, parameter :: along_angle = 3

   !> Degree of freedom that a force accelerates
   type, extends(window_t) :: driven_t
      !> Mass [kg/m], or moment of inertia of an angle [kg m]; 0: not known yet
      real(wp) :: mass = 0.0_wp
      !> Damping over the critical one, and the coefficient of the damping [kg/(m s)], of an angle [kg m/s]
      real(wp) :: damping_ratio = 1.0_wp, damping = 0.0_wp
      !> Length [m] or angle [rad], and its derivatives
      real(wp) :: place = 0.0_wp, speed = 0.0_wp, change = 0.0_wp
      !> Velocity in the middle of the step
      real(wp) :: half = 0.0_wp
   contains
      procedure, non_overridable :: set_mass
      procedure, non_overridable :: predict
      procedure, non_overridable :: correct
   end type driven_t

contains

   !> Set a mass that is not given, and the damping, which is in proportion to that of a spring as stiff as contacts.
   elemental subroutine set_mass(self, usual, stiffness, square)
      class(driven_t), intent(inout) :: self
      !> Mass without one of its own [kg/m]
      real(wp), intent(in) :: usual
      !> Stiffness E of the contacts [N/m2]
      real(wp), intent(in) :: stiffness
      !> Moment of inertia over mass of an angle [m2]; 1 of a length
      real(wp), intent(in) :: square

      if (.not. self%mass > 0.0_wp) self%mass = usual
      self%damping = self%damping_ratio*2.0_wp*sqrt(stiffness*self%mass)*square
      self%mass = self%mass*square
   end subroutine set_mass

   !> Move to the end of the step, and predict the velocity there.
   elemental subroutine predict(self, dt)
      class(driven_t), intent(inout) :: self
      !> Time step [s]
      real(wp), intent(in) :: dt

      self%half = self%speed + 0.5_wp*dt*self%change
      self%place = self%place + dt*self%half
      self%speed = self%half + 0.5_wp*dt*self%change
   end subroutine predict

   !> Find acceleration and velocity at the end of the step.
   elemental subroutine correct(self, dt, time, force)
      class(driven_t), intent(inout) :: self
      !> Time step; 0 at the start of the run [s]
      real(wp), intent(in) :: dt
      !> Time at the end of the step [s]
      real(wp), intent(in) :: time
      !> Force without the damping [N/m], of an angle the torque [N]
      real(wp), intent(in) :: force

      if (.not. self%is_open(time)) then
         self%speed = 0.0_wp
         self%change = 0.0_wp
      else if (.not. dt > 0.0_wp .or. time - dt < self%start) then
         ! The first force acts at rest.
         self%speed = 0.0_wp
         self%change = force/self%mass
      else
         self%speed = (self%half + 0.5_wp*dt*force/self%mass)/(1.0_wp + 0.5_wp*dt*self%damping/self%mass)
         self%change = (force - self%damping*self%speed)/self%mass
      end if
   end subroutine correct

end module polydem_driven
