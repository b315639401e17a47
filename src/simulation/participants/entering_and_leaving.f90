!> Sources and sinks as a participant of the steps.
module polydem_entering_and_leaving
   use polydem_added_and_removed, only: removed_after
   use polydem_changed_bodies, only: expect_changes
   use polydem_enter_and_leave, only: enter_and_leave, find_leaving
   use polydem_errors, only: error_t
   use polydem_serializer, only: serializer_t
   use polydem_simulation, only: participant_t, simulation_t
   implicit none
   private
   public :: entering_and_leaving_t

   !> Bodies enter and leave; the state is `sources_and_sinks` of the simulation
   type, extends(participant_t) :: entering_and_leaving_t
   contains
      procedure :: start
      procedure :: change_bodies
      procedure :: needs_table
      procedure :: serialize
   end type entering_and_leaving_t

contains

   !> Prepare the balance for bodies that enter and leave.
   subroutine start(self, simulation)
      class(entering_and_leaving_t), intent(inout) :: self
      type(simulation_t), intent(inout) :: simulation

      associate (unused => self)
      end associate
      call expect_changes(simulation%energy_balance)
   end subroutine start

   !> Let bodies leave and enter.
   subroutine change_bodies(self, simulation, error)
      class(entering_and_leaving_t), intent(inout) :: self
      type(simulation_t), intent(inout) :: simulation
      type(error_t), allocatable, intent(inout) :: error

      associate (unused => self)
      end associate
      call enter_and_leave(simulation, error)
   end subroutine change_bodies

   !> Whether bodies leave behind this step: the elastic energy of their contacts leaves with them
   pure logical function needs_table(self, simulation)
      class(entering_and_leaving_t), intent(in) :: self
      type(simulation_t), intent(in) :: simulation

      associate (unused => self)
      end associate
      needs_table = simulation%sources_and_sinks%has_departures(simulation%step)
      if (allocated(simulation%actions)) needs_table = needs_table .or. &
         size(removed_after(simulation%actions, simulation%step)) > 0
   end function needs_table

   !> Serialize the state of all sources and sinks.
   subroutine serialize(self, simulation, serializer)
      class(entering_and_leaving_t), intent(inout) :: self
      type(simulation_t), intent(inout) :: simulation
      class(serializer_t), intent(inout) :: serializer

      associate (unused => self)
      end associate
      if (.not. serializer%is_reading) call find_leaving(simulation)
      call simulation%sources_and_sinks%serialize(simulation%step, serializer)
   end subroutine serialize

end module polydem_entering_and_leaving
