!> The beginning of a run: its calls in their order. All ranks build the scene alike; the root rank manages the folder.
module polydem_begin_run
   use polydem_action_record, only: take_record, write_record
   use polydem_broadcaster, only: broadcaster_t
   use polydem_check_ranks, only: check_ranks
   use polydem_claim_folder, only: check_overwrite
   use polydem_errors, only: error_t
   use polydem_file_system, only: make_folder
   use polydem_initial_warnings, only: warn_of_risks
   use polydem_kinds, only: dp, ip, lp
   use polydem_monitor, only: new_monitor
   use polydem_open_log, only: is_restart, open_log, write_overlaps
   use polydem_output_intervals, only: choose_intervals, frames_per_segment
   use polydem_oversubscription, only: oversubscription
   use polydem_recorder, only: check_recording
   use polydem_restart, only: remove_surplus_files, restore, serialize_previous
   use polydem_result_files, only: checkpoint_path, n_checkpoints
   use polydem_run, only: run_t
   use polydem_series_row, only: collect_row
   use polydem_settings, only: settings_t
   use polydem_start, only: build_start
   use polydem_strings, only: to_text
   implicit none
   private
   public :: begin_run

contains

   !> Build the scene, lock the folder, open the log, describe the run, restore the state of previous starts, and open
   !> the output files; without files only the scene and the guards. Collective; all ranks get the same error.
   subroutine begin_run(settings, force, run, error)
      type(settings_t), intent(in) :: settings
      !> Whether to replace an existing result
      logical, intent(in) :: force
      !> The run with its options and ranks
      type(run_t), intent(inout) :: run
      !> Allocated if the run cannot start
      type(error_t), allocatable, intent(inout) :: error

      call check_ranks(settings, run%comm, error)
      if (.not. (allocated(error) .or. run%options%has_files)) then
         call build_start(settings, run, error)
         if (.not. allocated(error)) call take_record(run, 0_lp)
         if (.not. allocated(error)) call start_monitor(run)
         return
      end if
      if (.not. allocated(error)) call check_folder(run, force, error)
      if (.not. allocated(error)) call build_start(settings, run, error)
      if (.not. allocated(error)) call lock_folder(run, error)
      if (.not. allocated(error)) call describe_run(settings, force, run, error)
      if (allocated(error)) return
      call write_overlaps(run, error)
      call start_monitor(run)
      if (.not. allocated(error)) call recall(run, error)
      if (.not. allocated(error)) call finish_restart(run, error)
      if (.not. allocated(error)) call open_output(run, error)
   end subroutine begin_run

   !> Refuse to overwrite a result. Collective; all ranks get the same error.
   subroutine check_folder(run, force, error)
      type(run_t), intent(inout) :: run
      logical, intent(in) :: force
      type(error_t), allocatable, intent(inout) :: error

      if (run%comm%is_root()) call check_overwrite(run%folder, force .or. run%options%continues, &
         run%manifest, error)
      call run%comm%all_reduce_error(error)
   end subroutine check_folder

   !> Lock the folder. Collective; all ranks get the same error.
   subroutine lock_folder(run, error)
      type(run_t), intent(inout) :: run
      type(error_t), allocatable, intent(inout) :: error

      if (run%comm%is_root()) then
         call make_folder(run%folder, error)
         if (.not. allocated(error)) call run%lock%acquire(run%folder, run%folder_note, error, run%comm%size > 1_ip)
      end if
      call run%comm%all_reduce_error(error)
   end subroutine lock_folder

   !> Open the log, and describe the run there. Collective; all ranks get the same error.
   subroutine describe_run(settings, force, run, error)
      type(settings_t), intent(in) :: settings
      logical, intent(in) :: force
      type(run_t), intent(inout) :: run
      type(error_t), allocatable, intent(inout) :: error
      integer(lp) :: step(1)

      run%oversubscription = oversubscription(run%comm)
      if (run%comm%is_root()) then
         call open_log(settings, force, run, error)
      else
         call run%lock%join(run%folder)
      end if
      ! The root alone has looked for a checkpoint.
      step = run%previous%step
      call run%comm%broadcast(step)
      if (.not. allocated(error)) call take_record(run, step(1))
      if (run%comm%is_root()) call write_record(run, error)
      call run%comm%all_reduce_error(error)
   end subroutine describe_run

   !> Start the guards, warn of risks of the initial state, and choose when output is due. Collective.
   subroutine start_monitor(run)
      type(run_t), intent(inout) :: run

      call new_monitor(run%monitor, run%simulation)
      if (run%comm%is_root()) call warn_of_risks(run%simulation, run%measures, run%log, run%monitor%at_start)
      call choose_intervals(run)
      ! A checkpoint has rows of the series without their columns.
      if (run%series_steps > 0.0_dp) call collect_row(run%simulation)
   end subroutine start_monitor

   !> Broadcast which checkpoint the root rank has chosen, start the schedule of checkpoints, and restore the checkpoint
   !> if there is one. Collective; all ranks get the same error.
   subroutine recall(run, error)
      !> The run, after `find_restart`
      type(run_t), intent(inout) :: run
      !> Allocated if the checkpoint cannot be restored
      type(error_t), allocatable, intent(inout) :: error
      type(broadcaster_t) :: broadcaster

      allocate (broadcaster%comm, source=run%comm)
      broadcaster%is_reading = .not. run%comm%is_root()
      call serialize_previous(broadcaster, run%previous)
      call run%checkpoints%open(run%simulation%settings%checkpoint, run%simulation%dt, run%began, &
                                merge(run%options%limit, 0.0_dp, run%comm%is_root()), .not. run%options%is_guest)
      if (allocated(run%previous%note)) call run%log%write_line(run%previous%note)
      if (run%previous%checkpoint == 0_ip) return
      call run%provenance%set('parent', checkpoint_path(run%folder, run%previous%checkpoint)//', step '// &
                              to_text(run%previous%step))
      call restore(run%folder, run%previous, run%provenance%text_of('revision'), run%simulation, run%restarts, &
                   run%log, error)
      if (allocated(error)) return
      run%checkpoints%last_step = run%previous%step
      run%checkpoints%next = modulo(run%previous%checkpoint, n_checkpoints) + 1_ip
   end subroutine recall

   !> Check the recording, and remove the files of previous starts that the run does not keep. Collective; all ranks get
   !> the same error.
   subroutine finish_restart(run, error)
      type(run_t), intent(inout) :: run
      type(error_t), allocatable, intent(inout) :: error

      if (run%comm%is_root()) then
         call check_recording(run%simulation, run%folder, error)
         if (is_restart(run) .and. .not. allocated(error)) &
            call remove_surplus_files(run%folder, run%manifest, run%previous, error)
      end if
      call run%comm%all_reduce_error(error)
   end subroutine finish_restart

   !> Open the output files that the ranks share; collective.
   subroutine open_output(run, error)
      !> The run, prepared
      type(run_t), intent(inout) :: run
      !> Allocated on failure; the same on all ranks
      type(error_t), allocatable, intent(inout) :: error

      call run%trajectory%open(run%folder, frames_per_segment(run%simulation), run%provenance, error, &
                               run%previous%segments, run%comm, allocated(run%simulation%sources_and_sinks))
      if (run%comm%size == 1_ip .and. .not. allocated(error)) &
         call run%recorder%open(run%simulation, run%folder, run%provenance, run%log, run%manifest, error)
   end subroutine open_output

end module polydem_begin_run
