!> Walls with loads, as a participant of the steps.
module polydem_loaded_walls
   use polydem_energy_balance, only: balance_t
   use polydem_kinds, only: wp
   use polydem_serializer, only: serializer_t
   use polydem_simulation, only: participant_t, present_gravity, simulation_t, time_of
   use polydem_wall_energy, only: add_loads
   use polydem_wall_load, only: serialize_loads
   implicit none
   private
   public :: loaded_walls_t

   !> Walls with loads; their state is `walls%loads` of the simulation
   type, extends(participant_t) :: loaded_walls_t
   contains
      procedure :: follow_forces
      procedure :: serialize
      procedure :: add_energies
   end type loaded_walls_t

contains

   !> Let the contacts and the loads accelerate the walls.
   subroutine follow_forces(self, simulation, dt)
      class(loaded_walls_t), intent(inout) :: self
      type(simulation_t), intent(inout) :: simulation
      real(wp), intent(in) :: dt

      associate (unused => self)
      end associate
      call simulation%walls%accelerate(simulation%comm, dt, time_of(simulation), present_gravity(simulation), &
                                  simulation%bodies, simulation%loop%walls)
   end subroutine follow_forces

   !> Serialize displacements, velocities and works.
   subroutine serialize(self, simulation, serializer)
      class(loaded_walls_t), intent(inout) :: self
      type(simulation_t), intent(inout) :: simulation
      class(serializer_t), intent(inout) :: serializer

      associate (unused => self)
      end associate
      call serialize_loads(simulation%walls%loads, serializer)
   end subroutine serialize

   !> Add the works of the loads and of the damping of the walls, and their kinetic energy.
   subroutine add_energies(self, simulation, balance)
      class(loaded_walls_t), intent(in) :: self
      type(simulation_t), intent(inout) :: simulation
      type(balance_t), intent(inout) :: balance

      associate (unused => self)
      end associate
      call add_loads(simulation%energy_balance, simulation%walls%energies(simulation%dt), balance)
   end subroutine add_energies

end module polydem_loaded_walls
