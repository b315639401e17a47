!> The record of the walls for the series, as a participant of the steps.
module polydem_recorded_walls
   use polydem_serializer, only: serializer_t
   use polydem_simulation, only: participant_t, simulation_t
   implicit none
   private
   public :: recorded_walls_t

   !> The record; its state is `walls%record` of the simulation
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

      associate (unused => self, walls => simulation%walls)
         call walls%record%start(walls%named, simulation%bodies, simulation%loop%walls)
      end associate
   end subroutine start

   !> Add a step.
   subroutine end_step(self, simulation)
      class(recorded_walls_t), intent(inout) :: self
      type(simulation_t), intent(inout) :: simulation

      associate (unused => self)
      end associate
      call simulation%walls%accumulate(simulation%bodies, simulation%loop%walls)
   end subroutine end_step

   !> Serialize the record, and the rows of the series that no file has yet.
   subroutine serialize(self, simulation, serializer)
      class(recorded_walls_t), intent(inout) :: self
      type(simulation_t), intent(inout) :: simulation
      class(serializer_t), intent(inout) :: serializer

      associate (unused => self)
      end associate
      call simulation%walls%record%serialize(serializer)
      call simulation%series%serialize(serializer)
   end subroutine serialize

end module polydem_recorded_walls
