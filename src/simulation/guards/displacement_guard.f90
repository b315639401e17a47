!> Guard of bodies that move so far in a step that they could pass through others. The step itself finds them
!> (`polydem_motion_check`), and stops the run at once if it must.
module polydem_displacement_guard
   use polydem_errors, only: error_t
   use polydem_guard, only: guard_t
   use polydem_simulation, only: simulation_t
   implicit none
   private
   public :: displacement_guard_t

   !> Guard of the displacement per step
   type, extends(guard_t) :: displacement_guard_t
   contains
      procedure :: start
      procedure :: look
   end type displacement_guard_t

contains

   !> Set what the guard says of itself.
   subroutine start(self, simulation)
      class(displacement_guard_t), intent(inout) :: self
      type(simulation_t), intent(inout) :: simulation

      self%noun = 'step'
      self%finding = 'in which a body moved too far'
      self%choice = simulation%settings%guards%displacement
   end subroutine start

   !> Take over the warning of the step.
   subroutine look(self, simulation, error)
      class(displacement_guard_t), intent(inout) :: self
      type(simulation_t), intent(inout) :: simulation
      type(error_t), allocatable, intent(inout) :: error

      if (allocated(error)) return
      call self%warning%absorb(simulation%motion%check%warning)
   end subroutine look

end module polydem_displacement_guard
