!> Serial simulations of given bodies
module serial_simulation
   use polydem_bodies, only: bodies_t
   use polydem_communicator, only: communicator_t
   use polydem_errors, only: error_t
   use polydem_settings, only: settings_t
   use polydem_simulation, only: simulation_t
   use polydem_start_simulation, only: start_with_bodies
   use polydem_walls, only: walls_t
   implicit none
   private
   public :: start_simulation

contains

   !> Set up a serial simulation with given bodies, and compute the forces at time 0.
   subroutine start_simulation(settings, bodies, self, error, walls)
      !> Checked settings; the group &scene is not used
      type(settings_t), intent(in) :: settings
      !> Bodies at the start
      type(bodies_t), intent(in) :: bodies
      !> The simulation, ready to advance
      type(simulation_t), intent(out) :: self
      !> Allocated if bodies or settings are invalid
      type(error_t), allocatable, intent(inout) :: error
      !> Walls with prescribed motions; default: none
      type(walls_t), intent(in), optional :: walls

      self%bodies = bodies
      allocate (self%walls%wall(0), self%walls%motions(0))
      if (present(walls)) self%walls = walls
      call start_with_bodies(settings, communicator_t(), self, error)
   end subroutine start_simulation

end module serial_simulation
