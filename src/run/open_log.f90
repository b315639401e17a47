!> The log of a run, and the state of previous starts, in a folder that the root rank has locked.
module polydem_open_log
   use polydem_bodies_reader, only: read_origin
   use polydem_claim_folder, only: check_overwrite, claim_folder
   use polydem_description, only: describe, list_overlaps
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, lp
   use polydem_log_tables, only: write_header
   use polydem_provenance, only: collect_provenance
   use polydem_restart, only: find_restart
   use polydem_result_files, only: overlaps_name
   use polydem_run, only: run_t
   use polydem_settings, only: settings_t
   use polydem_start_materials, only: material_names_text
   use polydem_start_origin, only: find_origin, origin_t
   use polydem_wall_names, only: wall_names_text
   implicit none
   private
   public :: open_log, write_overlaps, is_restart

contains

   !> Find the state of previous starts, claim the folder, open the log and describe the run, on the root rank only.
   subroutine open_log(settings, force, run, error)
      type(settings_t), intent(in) :: settings
      !> Whether to replace an existing result
      logical, intent(in) :: force
      type(run_t), intent(inout) :: run
      type(error_t), allocatable, intent(inout) :: error
      type(origin_t) :: origin

      ! Repeat the check: now no other run can write to the folder.
      call check_overwrite(run%folder, force .or. run%options%continues, run%manifest, error)
      if (allocated(error)) return
      call collect_provenance(run%provenance, settings%file, settings%text, settings%resolved, settings%scene%seed)
      call run%provenance%set('scene', run%scene_hash)
      call run%provenance%set('walls', wall_names_text(run%simulation%walls%wall))
      if (size(settings%material) > 0) call run%provenance%set('materials', material_names_text(settings))
      if (settings%scene%bodies_file /= '') call read_origin(settings%scene%bodies_file, run%provenance%origin, error)
      if (allocated(error)) return
      run%provenance%processes = run%comm%size
      if (allocated(run%options%threads%reason)) call run%provenance%set('thread_choice', run%options%threads%reason)
      if (run%manifest%is_found .and. run%options%continues) &
         call find_restart(run%folder, run%manifest, run%simulation, run%scene_hash, run%options%may_change, &
                           run%previous, error)
      if (allocated(error)) return
      call claim_folder(settings, run%measures%deep > 0_lp, run%folder, force, is_restart(run), &
                        run%comm%size > 1_ip, run%lock, run%folder_note, run%manifest, error)
      call run%provenance%set('run', run%manifest%run)
      if (.not. allocated(error)) call run%log%open(run%folder, error, appended=is_restart(run), &
         brief=run%options%is_brief, quiet=run%options%is_guest)
      if (allocated(error)) return
      call write_header(run%log, run%provenance, run%folder)
      if (run%oversubscription /= '') call run%log%write_line(run%oversubscription)
      if (allocated(run%folder_note)) call run%log%write_line(run%folder_note)
      if (settings%scene%name == 'result') then
         call find_origin(settings, origin, error)
         if (allocated(error)) return
         call run%log%write_line(origin%note)
      end if
      call describe(run%simulation, run%measures, run%log)
   end subroutine open_log

   !> Whether the run keeps files of previous starts
   pure logical function is_restart(run)
      type(run_t), intent(in) :: run

      is_restart = run%previous%checkpoint > 0_ip .or. run%previous%segments > 0_ip
   end function is_restart

   !> Write the deep initial contacts to the log and to a table. Collective; all ranks get the same error.
   subroutine write_overlaps(run, error)
      type(run_t), intent(inout) :: run
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error

      if (run%comm%is_root()) call run%manifest%reopen(run%folder//'/'//overlaps_name, error)
      call run%comm%all_reduce_error(error)
      if (.not. allocated(error)) call list_overlaps(run%simulation, run%measures, run%folder, run%log, error)
      if (run%comm%is_root()) call run%manifest%close_file(run%folder//'/'//overlaps_name, error)
      call run%comm%all_reduce_error(error)
   end subroutine write_overlaps

end module polydem_open_log
