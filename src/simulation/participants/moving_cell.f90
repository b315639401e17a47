!> A periodic cell that is sheared or whose size is stress-controlled, as a participant of the steps.
module polydem_moving_cell
   use polydem_bodies_in_cell, only: change_cell
   use polydem_cell, only: shear_cell
   use polydem_cell_load, only: accelerate_cell, serialize_cell
   use polydem_energy_balance, only: balance_t
   use polydem_errors, only: error_t, raise, run_error
   use polydem_kinds, only: lp, wp
   use polydem_serializer, only: serializer_t
   use polydem_simulation, only: participant_t, simulation_t, time_of
   use polydem_strings, only: to_text
   use polydem_wall_energy, only: add_cell
   implicit none
   private
   public :: moving_cell_t

   !> A cell that moves; its state is `bodies%cell` of the simulation
   type, extends(participant_t) :: moving_cell_t
   contains
      procedure :: begin_step
      procedure :: follow_forces
      procedure :: serialize
      procedure :: add_energies
   end type moving_cell_t

contains

   !> Move the border to the end of the step, and check that the cell is large enough.
   subroutine begin_step(self, simulation, error)
      class(moving_cell_t), intent(inout) :: self
      type(simulation_t), intent(inout) :: simulation
      type(error_t), allocatable, intent(inout) :: error

      associate (unused => self)
      end associate
      associate (s => simulation)
         call change_cell(s%dt, real(s%step - 1_lp, wp)*s%dt, time_of(s), s%bodies)
         if (abs(s%bodies%cell%kick) > 0.0_wp) call s%motion%flight%forget_velocities()
         if (.not. allocated(s%bodies%cell%load)) return
         if (all(s%bodies%cell%size > s%bodies%cell%load%least)) return
         call raise(error, run_error, 'step '//to_text(s%step)//': the cell has shrunk to '// &
                    to_text(s%bodies%cell%size(1))//' x '//to_text(s%bodies%cell%size(2))//' m, but the largest '// &
                    'body needs more than '//to_text(s%bodies%cell%load%least)//' m, twice its diameter. Start '// &
                    'with more bodies, or reduce the stress in &cell')
      end associate
   end subroutine begin_step

   !> Let the stress of the contacts accelerate the size.
   subroutine follow_forces(self, simulation, dt)
      class(moving_cell_t), intent(inout) :: self
      type(simulation_t), intent(inout) :: simulation
      real(wp), intent(in) :: dt

      associate (unused => self)
      end associate
      if (allocated(simulation%bodies%cell%load)) call accelerate_cell(simulation%comm, dt, time_of(simulation), &
                                                              simulation%loop%virial, simulation%bodies%cell)
   end subroutine follow_forces

   !> Serialize the motion of the cell. That of a cell without a load follows from the time; it is written for runs that
   !> start from this one. Bodies may enter before the next step.
   subroutine serialize(self, simulation, serializer)
      class(moving_cell_t), intent(inout) :: self
      type(simulation_t), intent(inout) :: simulation
      class(serializer_t), intent(inout) :: serializer
      real(wp) :: shift, jump

      associate (unused => self, cell => simulation%bodies%cell)
         if (allocated(cell%load)) then
            call serialize_cell(cell, serializer)
         else if (serializer%is_reading) then
            call shear_cell(cell, time_of(simulation), time_of(simulation))
         end if
         if (.not. cell%is_sheared .or. serializer%is_reading) return
         shift = cell%shift
         jump = cell%jump
         call serializer%field('/run/shift', shift, 'm', 'displacement of the copy above a sheared cell, for a run '// &
                               'that starts from this one')
         call serializer%field('/run/jump', jump, 'm/s', 'its velocity')
      end associate
   end subroutine serialize

   !> Add the work of the contacts on the motion of the cell.
   subroutine add_energies(self, simulation, balance)
      class(moving_cell_t), intent(in) :: self
      type(simulation_t), intent(inout) :: simulation
      type(balance_t), intent(inout) :: balance

      associate (unused => self)
      end associate
      if (.not. allocated(simulation%bodies%cell%load)) return
      associate (load => simulation%bodies%cell%load)
         call add_cell(simulation%energy_balance, simulation%dt*(load%power_sum - 0.5_wp*load%power), &
                       simulation%loop%walls%energy_is_known, balance)
      end associate
   end subroutine add_energies

end module polydem_moving_cell
