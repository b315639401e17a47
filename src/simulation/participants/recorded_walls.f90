!> The record of the walls for the series, as a participant of the steps.
module polydem_recorded_walls
   use polydem_serializer, only: serializer_t
   use polydem_simulation, only: participant_t, simulation_t
   use polydem_wall_record, only: add_step, serialize_record, start_record
   implicit none
   private
   public :: recorded_walls_t

   !> The record; its state is `walls%sums` of the simulation
   type, extends(participant_t) :: recorded_walls_t
   contains
      procedure :: start
      procedure :: end_step
      procedure :: serialize
   end type recorded_walls_t

contains

   !> Start the record.
   subroutine start(self, simulation)
      class(recorded_walls_t), intent(inout) :: self
      type(simulation_t), intent(inout) :: simulation

      associate (unused => self)
      end associate
      call start_record(simulation%walls, simulation%bodies, simulation%loop%walls)
   end subroutine start

   !> Add a step.
   subroutine end_step(self, simulation)
      class(recorded_walls_t), intent(inout) :: self
      type(simulation_t), intent(inout) :: simulation

      associate (unused => self)
      end associate
      call add_step(simulation%walls, simulation%bodies, simulation%loop%walls)
   end subroutine end_step

   !> Serialize the record, and the rows of the series that no file has yet.
   subroutine serialize(self, simulation, serializer)
      class(recorded_walls_t), intent(inout) :: self
      type(simulation_t), intent(inout) :: simulation
      class(serializer_t), intent(inout) :: serializer

      associate (unused => self)
      end associate
      call serialize_record(simulation%walls, serializer)
      call simulation%series%serialize(serializer)
   end subroutine serialize

end module polydem_recorded_walls
