!> The state of a run that starts from a checkpoint of a result, beside its bodies.
!>
!> The run goes on from it as the run of the result would, at time 0: contact history, accelerations and state of the
!> integrator are those of the checkpoint. The forces at time 0 follow from a copy of the history, since evaluating them
!> changes it. Nothing is done for a run that does not start from a checkpoint.
module polydem_start_state
   use polydem_bodies, only: bodies_t
   use polydem_bodies_in_cell, only: set_cell
   use polydem_body_fields, only: serialize_bodies
   use polydem_changed_bodies, only: change_accelerations
   use polydem_checkpoint_fields, only: read_pairs
   use polydem_checkpoint_file, only: checkpoint_file_t
   use polydem_enter_and_leave, only: find_leaving
   use polydem_enter_cell, only: join_copies
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, lp
   use polydem_removed_bodies, only: rows_of
   use polydem_replace_bodies, only: rebuild_bodies
   use polydem_simulation, only: simulation_t
   use polydem_start_origin, only: blame, find_origin, origin_t
   use polydem_wall_removal, only: find_release
   implicit none
   private
   public :: recall_history, return_to_state

contains

   !> Let a simulation receive the contact history of the checkpoint from which it starts, before its forces are
   !> computed. Collective; all ranks get the same error.
   subroutine recall_history(simulation, error)
      !> The simulation after `place_bodies`
      type(simulation_t), intent(inout) :: simulation
      type(error_t), allocatable, intent(inout) :: error
      type(origin_t) :: origin
      type(checkpoint_file_t) :: file

      if (simulation%settings%scene%name /= 'result') return
      call open_start(simulation, file, origin, error)
      if (allocated(error) .or. origin%is_frame) return
      ! Here the state of the integrator is only tried.
      call file%choose_rows('/bodies/', rows_of(simulation%bodies%global_index, origin%removed))
      call simulation%motion%integrator%serialize(file)
      if (simulation%settings%integrate%scheme /= 'velocity_verlet') &
         call file%match('/run/time_step', simulation%dt, 's', 'time step, which this scheme keeps')
      call read_pairs(file, simulation, origin%around%most_pieces)
      call file%close(error)
      if (.not. allocated(error)) return
      error%message = error%message//'. The run of the result had other forces or another scheme; start from a '// &
         'frame of it (FOLDER:FRAME), which needs none of this'
      call blame(simulation%settings, error)
   end subroutine recall_history

   !> Open the checkpoint from which a simulation starts, unless it starts from a frame.
   subroutine open_start(simulation, file, origin, error)
      type(simulation_t), intent(inout) :: simulation
      type(checkpoint_file_t), intent(inout) :: file
      type(origin_t), intent(out) :: origin
      type(error_t), allocatable, intent(inout) :: error

      call find_origin(simulation%settings, origin, error)
      call simulation%comm%all_reduce_error(error)
      if (.not. (allocated(error) .or. origin%is_frame)) call file%open(origin%path, error, simulation%comm)
   end subroutine open_start

   !> Return to the state of the checkpoint from which a simulation starts, after its forces at time 0 were computed and
   !> used. Bodies enter the cell as they did then. Collective; all ranks get the same error.
   subroutine return_to_state(simulation, error)
      !> The simulation before its first step
      type(simulation_t), intent(inout) :: simulation
      type(error_t), allocatable, intent(inout) :: error
      type(origin_t) :: origin
      type(checkpoint_file_t) :: file
      type(bodies_t) :: before
      integer(ip) :: s

      if (simulation%settings%scene%name /= 'result') return
      call open_start(simulation, file, origin, error)
      if (allocated(error) .or. origin%is_frame) return
      associate (bodies => simulation%bodies)
         before = bodies
         call file%choose_rows('/bodies/', rows_of(bodies%global_index, origin%removed))
         ! The result may have had no cell, or one without shear.
         if (.not. origin%around%has_images .and. allocated(bodies%image)) deallocate (bodies%image)
         if (.not. origin%around%has_shear_offset .and. allocated(bodies%shear_offset)) deallocate (bodies%shear_offset)
         call serialize_bodies(file, bodies)
         call set_cell(bodies, before%cell)
         if (bodies%cell%is_periodic) call join_copies(simulation%settings%cell, bodies%free, bodies)
         call simulation%motion%integrator%serialize(file)
         call read_pairs(file, simulation, origin%around%most_pieces)
         do s = 1_ip, bodies%n
            if (.not. bodies%fixed(s)) cycle
            bodies%position(:, s) = before%position(:, s)
            if (allocated(bodies%image)) bodies%image(s, :) = before%image(s, :)
            bodies%angle(s) = before%angle(s)
            bodies%velocity(:, s) = before%velocity(:, s)
            bodies%angular_velocity(s) = before%angular_velocity(s)
            bodies%acceleration(:, s) = before%acceleration(:, s)
            bodies%angular_acceleration(s) = before%angular_acceleration(s)
         end do
         call change_accelerations(simulation%energy_balance, before, bodies)
      end associate
      call file%close(error)
      if (allocated(error)) return
      ! The forces at time 0 end here: the balance must know what leaves before the first step.
      call find_release(simulation)
      call find_leaving(simulation)
      simulation%loop%step = -1_lp
      call rebuild_bodies(simulation, error)
   end subroutine return_to_state

end module polydem_start_state
