!> Preparation of a run by the root rank: the scene, the result folder, and the state of earlier attempts.
module polydem_prepare
   use polydem_checked_files, only: check_manifest
   use polydem_claim_folder, only: claim_folder
   use polydem_initial_warnings, only: warn_of_risks
   use polydem_description, only: describe, list_overlaps
   use polydem_errors, only: error_t, input_error, raise
   use polydem_file_system, only: make_folder
   use polydem_finished_result, only: find_finished_result
   use polydem_kinds, only: ip
   use polydem_log_tables, only: write_header
   use polydem_monitor, only: new_monitor
   use polydem_provenance, only: collect_provenance
   use polydem_recorder, only: check_recording
   use polydem_replaced_result, only: recover, replaced_name
   use polydem_replacement, only: say
   use polydem_restart, only: remove_surplus_files, find_restart
   use polydem_result_files, only: overlaps_name
   use polydem_run, only: run_t
   use polydem_run_output, only: choose_intervals
   use polydem_settings, only: settings_t
   use polydem_start, only: build_start, recall
   implicit none
   private
   public :: begin

contains

   !> Prepare a run on the root rank: build the scene, lock the folder, and restore the state of earlier attempts.
   subroutine begin(settings, force, run, last_state, error)
      !> Checked settings
      type(settings_t), intent(in) :: settings
      !> Whether to replace an existing result
      logical, intent(in) :: force
      !> The run
      type(run_t), intent(inout) :: run
      !> Hash of the last state; allocated if the run is finished
      character(len=:), allocatable, intent(inout) :: last_state
      !> Allocated if the run cannot start
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: lock_note, recovery_note

      call check_overwrite(run, force, error)
      if (.not. allocated(error)) call build_start(settings, run, error)
      if (.not. allocated(error)) call make_folder(run%folder, error)
      if (.not. allocated(error)) call run%lock%acquire(run%folder, lock_note, error, run%comm%size > 1_ip)
      if (.not. allocated(error)) call recover(run%folder, recovery_note, error)
      if (allocated(error)) return
      if (allocated(recovery_note)) call say(recovery_note)
      if (allocated(recovery_note) .and. run%attempt%continues) call find_finished_result(settings, run, last_state, &
         error)
      if (.not. allocated(last_state) .and. .not. allocated(error)) &
         call open_and_restore(settings, force, lock_note, run, error)
   end subroutine begin

   !> Refuse to overwrite a result without --force, and to use a folder whose manifest is damaged.
   subroutine check_overwrite(run, force, error)
      type(run_t), intent(inout) :: run
      logical, intent(in) :: force
      type(error_t), allocatable, intent(inout) :: error

      call run%manifest%read(run%folder)
      call check_manifest(run%manifest, error)
      if (force .or. run%attempt%continues .or. .not. run%manifest%is_found) return
      ! `recover` first restores the result that an interrupted --force moved aside.
      if (run%manifest%owns(replaced_name)) return
      call raise(error, input_error, run%folder//' already holds a result; add --continue '// &
                 'to resume it or --force to overwrite it, or choose another folder with --set output.folder=NAME')
   end subroutine check_overwrite

   !> Open the log, describe the run, and restore the state of earlier attempts, in a folder that this run has locked.
   subroutine open_and_restore(settings, force, lock_note, run, error)
      type(settings_t), intent(in) :: settings
      logical, intent(in) :: force
      !> Remark on how the folder was locked; unallocated if there is none
      character(len=:), allocatable, intent(in) :: lock_note
      type(run_t), intent(inout) :: run
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: scene
      logical :: is_restart

      ! Repeat the check: now no other run can write to the folder.
      call check_overwrite(run, force, error)
      if (allocated(error)) return
      scene = run%provenance%scene
      call collect_provenance(run%provenance, settings%file, settings%text, settings%resolved, settings%scene%seed)
      run%provenance%scene = scene
      run%provenance%processes = run%comm%size
      if (run%manifest%is_found .and. run%attempt%continues) &
         call find_restart(run%folder, run%manifest, settings, scene, run%attempt%may_change, run%earlier, error)
      if (allocated(error)) return
      is_restart = run%earlier%checkpoint > 0_ip .or. run%earlier%segments > 0_ip
      call claim_folder(run%simulation, run%folder, force, is_restart, run%manifest, error)
      if (.not. allocated(error)) call run%log%open(run%folder, error, appended=is_restart)
      if (allocated(error)) return
      call write_header(run%log, run%provenance, run%folder)
      if (run%oversubscription /= '') call run%log%write_line(run%oversubscription)
      if (allocated(lock_note)) call run%log%write_line(lock_note)
      call describe(run%simulation, run%log)
      call write_overlaps(run, error)
      call new_monitor(run%monitor, run%simulation)
      call warn_of_risks(run%simulation, run%log, run%monitor%at_start)
      call choose_intervals(run)
      if (.not. allocated(error)) call recall(run, error)
      if (.not. allocated(error)) call check_recording(run%simulation, run%folder, error)
      if (is_restart .and. .not. allocated(error)) call remove_surplus_files(run%folder, run%manifest, run%earlier, &
         error)
   end subroutine open_and_restore

   !> Write the deep initial contacts to the log and to a table.
   subroutine write_overlaps(run, error)
      type(run_t), intent(inout) :: run
      type(error_t), allocatable, intent(inout) :: error

      call run%manifest%reopen(run%folder//'/'//overlaps_name, error)
      if (.not. allocated(error)) call list_overlaps(run%simulation, run%folder, run%log, error)
      call run%manifest%close_file(run%folder//'/'//overlaps_name, error)
   end subroutine write_overlaps

end module polydem_prepare
