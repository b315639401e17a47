!> Start of a simulation at time 0: its calls in their order. All ranks start alike, one or many.
module polydem_start_simulation
   use polydem_begin_stage, only: continue_stages, prepare_stages
   use polydem_bodies, only: bodies_t
   use polydem_check_entering, only: draw_sample
   use polydem_choose_instruction_set, only: choose_instruction_set
   use polydem_choose_methods, only: choose_methods
   use polydem_choose_step, only: choose_step
   use polydem_communicator, only: communicator_t
   use polydem_divide_bodies, only: bound_bodies, check_identifiers, divide_bodies
   use polydem_enter_cell, only: enter_cell
   use polydem_errors, only: error_t
   use polydem_guard, only: set_global_limits
   use polydem_kinds, only: wp
   use polydem_relaxation, only: relax_bodies
   use polydem_settings, only: settings_t
   use polydem_simulation, only: simulation_t
   use polydem_start_forces, only: start_forces
   use polydem_static_pressure, only: choose_stiffness, find_static_pressure
   implicit none
   private
   public :: start_with_bodies, place_bodies

contains

   !> Set up a simulation with the bodies that it has: all fixed bodies, and any share of the free bodies of the run.
   !> Then compute the forces at time 0. Collective; all ranks get the same error.
   subroutine start_with_bodies(settings, comm, self, error)
      !> Checked settings; the group &scene is not used
      type(settings_t), intent(in) :: settings
      class(communicator_t), intent(in) :: comm
      !> On entry with bodies and walls, and with a time step if it is not to be chosen; on return ready to advance
      type(simulation_t), intent(inout) :: self
      !> Allocated if bodies or settings are invalid
      type(error_t), allocatable, intent(inout) :: error

      call place_bodies(settings, comm, self, error)
      if (.not. allocated(error)) call start_forces(self, error)
   end subroutine start_with_bodies

   !> The first part of `start_with_bodies`: all but the forces. Collective; all ranks get the same error.
   subroutine place_bodies(settings, comm, self, error)
      !> Checked settings
      type(settings_t), intent(in) :: settings
      class(communicator_t), intent(in) :: comm
      !> On entry with bodies and walls
      type(simulation_t), intent(inout) :: self
      !> Allocated if bodies or settings are invalid
      type(error_t), allocatable, intent(inout) :: error
      type(bodies_t) :: sample

      call take_settings(settings, comm, self, error)
      if (.not. allocated(error)) call enter_cell(self, error)
      if (allocated(error)) return
      call prepare_stages(settings, self%stages, self%forces)
      call find_static_pressure(self)
      call choose_stiffness(self, error)
      if (.not. allocated(error)) call choose_methods(self, error)
      if (.not. allocated(error)) call draw_sample(self, sample, error)
      if (.not. allocated(error)) call check_identifiers(self, sample, error)
      if (.not. allocated(error)) call choose_step(self, sample, error)
      if (allocated(error)) return
      call self%body_forces%configure(self%forces)
      call divide_bodies(self, sample, error)
      if (allocated(error)) return
      call set_global_limits(self)
      call self%motion%integrator%start(self%bodies)
      if (settings%scene%remove_overlap > 0.0_wp) call relax_bodies(self, error)
      if (allocated(error)) return
      call continue_stages(self, error)
      call bound_bodies(self, error)
   end subroutine place_bodies

   !> Take settings, ranks and instruction set.
   subroutine take_settings(settings, comm, self, error)
      type(settings_t), intent(in) :: settings
      class(communicator_t), intent(in) :: comm
      type(simulation_t), intent(inout) :: self
      !> Names an instruction set that the processor does not have
      type(error_t), allocatable, intent(inout) :: error

      call choose_instruction_set(self%bodies%isa, error)
      if (allocated(error)) return
      allocate (self%comm, source=comm)
      self%settings = settings
      self%forces = settings%forces
   end subroutine take_settings

end module polydem_start_simulation
