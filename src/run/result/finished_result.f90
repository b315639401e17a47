!> Detection of a finished result: a restart of a finished run does nothing.
module polydem_finished_result
   use polydem_changed_entries, only: changed_entries
   use polydem_checked_files, only: check_closed, find_problem, find_segments
   use polydem_errors, only: error_t
   use polydem_finish, only: write_csv
   use polydem_folder_lock, only: lock_path
   use polydem_folders, only: link_exists
   use polydem_kinds, only: ip, lp
   use polydem_log, only: log_t
   use polydem_log_tables, only: write_hash
   use polydem_manifest, only: manifest_t
   use polydem_profile_file, only: read_final_status
   use polydem_provenance, only: origin_of
   use polydem_open_log, only: write_overlaps
   use polydem_result_files, only: name_in, overlaps_name, profile_name, series_name
   use polydem_run, only: run_t
   use polydem_settings, only: settings_t
   use polydem_start, only: build_start
   use polydem_series_row, only: collect_row
   implicit none
   private
   public :: find_finished_result, is_finished

contains

   !> Whether the folder may hold a finished result, as the root rank sees it; collective.
   logical function may_be_finished(run)
      !> The run; its manifest is read on the root rank
      type(run_t), intent(inout) :: run
      integer(lp) :: found(1)
      integer :: k

      found = 0_lp
      if (run%comm%is_root() .and. run%options%continues) then
         call run%manifest%read(run%folder)
         k = run%manifest%place_of(profile_name)
         if (k > 0 .and. .not. allocated(run%manifest%problem)) &
            found = merge(1_lp, 0_lp, run%manifest%entry(max(1, k))%is_closed)
      end if
      call run%comm%broadcast(found)
      may_be_finished = found(1) == 1_lp
   end function may_be_finished

   !> Check on the root rank whether the folder holds the finished result of this run. Nothing changes but what a run
   !> left behind that ended while it wrote its last checkpoint. Collective; all ranks get the same error.
   subroutine find_finished_result(settings, run, last_state, error)
      type(settings_t), intent(in) :: settings
      !> The run; its manifest is read, and its simulation built if needed
      type(run_t), intent(inout) :: run
      !> Hash of the last state; unallocated unless the run is finished
      character(len=:), allocatable, intent(out) :: last_state
      !> Allocated if the finished result is damaged or the scene cannot be built
      type(error_t), allocatable, intent(inout) :: error

      if (.not. may_be_finished(run)) return
      call build_start(settings, run, error)
      if (allocated(error)) return
      if (run%comm%is_root()) call find_finished(run%folder, settings, run%scene_hash, run%manifest, &
                                                  last_state, error)
      if (allocated(last_state) .and. .not. allocated(error)) call remove_remains(run, error)
      call run%comm%all_reduce_error(error)
      if (.not. allocated(error)) call renew_tables(run, allocated(last_state), error)
   end subroutine find_finished_result

   !> Make the tables of a finished result again that are missing or damaged. Collective; all ranks get the same error.
   subroutine renew_tables(run, is_finished, error)
      !> The run at time 0, with the valid manifest of its folder
      type(run_t), intent(inout) :: run
      !> Whether the root rank has found a finished result
      logical, intent(in) :: is_finished
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: note, problem
      integer, allocatable :: places(:)
      integer(lp) :: is_wrong(2)

      is_wrong = 0_lp
      if (is_finished) is_wrong = merge(1_lp, 0_lp, [is_damaged(series_name), is_damaged(overlaps_name)])
      call run%comm%broadcast(is_wrong)
      if (all(is_wrong == 0_lp)) return
      if (run%comm%is_root()) then
         call run%lock%acquire(run%folder, note, error)
         call run%log%open('', error)
         if (.not. allocated(error)) call run%manifest%continue_writing()
         call find_segments(run%manifest, run%folder, places, problem)
         run%trajectory%number = size(places, kind=ip)
      end if
      call run%comm%all_reduce_error(error)
      if (is_wrong(1) == 1_lp .and. .not. allocated(error)) then
         call collect_row(run%simulation)
         if (run%comm%is_root()) call write_csv(run, error)
         call run%log%write_line(run%folder//'/'//series_name//' was missing or damaged, and is made again')
         call run%comm%all_reduce_error(error)
      end if
      if (is_wrong(2) == 1_lp .and. .not. allocated(error)) then
         call run%log%write_line(run%folder//'/'//overlaps_name//' was missing or damaged, and is made again')
         call write_overlaps(run, error)
      end if
      call run%log%close()
      call run%lock%release()

   contains

      !> Whether the result has a table that is missing or damaged
      logical function is_damaged(name)
         character(len=*), intent(in) :: name
         type(error_t), allocatable :: failure
         integer :: k

         k = run%manifest%place_of(name)
         is_damaged = .false.
         if (k == 0) return
         call find_problem(run%folder, run%manifest%entry(k), problem, failure)
         is_damaged = allocated(problem) .or. .not. run%manifest%entry(k)%is_closed
      end function is_damaged

   end subroutine renew_tables

   !> Remove lock and unfinished files of a run that is dead; nothing happens if it released its lock.
   subroutine remove_remains(run, error)
      type(run_t), intent(inout) :: run
      !> Allocated if the run still lives, or if a file cannot be removed
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: note

      if (.not. link_exists(lock_path(run%folder), error)) return
      call run%lock%acquire(run%folder, note, error)
      if (allocated(error)) return
      call run%manifest%continue_writing()
      call run%manifest%remove_unfinished(error)
      call run%lock%release()
   end subroutine remove_remains

   !> Find the finished result of the same settings and initial bodies.
   subroutine find_finished(folder, settings, scene, manifest, last_state, error)
      !> Result folder
      character(len=*), intent(in) :: folder
      type(settings_t), intent(in) :: settings
      !> Hash of the initial bodies, as in the provenance of results
      character(len=*), intent(in) :: scene
      !> Valid manifest of the folder, with a closed profile
      type(manifest_t), intent(in) :: manifest
      !> Hash of the last state; unallocated if the folder holds no such result
      character(len=:), allocatable, intent(out) :: last_state
      !> Allocated if the result is finished but damaged
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: path, status, text, former, former_settings

      path = folder//'/'//profile_name
      call check_closed(manifest, folder, error, only=name_in(path))
      if (.not. allocated(error)) call read_final_status(path, status, text, error)
      if (allocated(error)) return
      if (status /= 'finished') return
      former = origin_of(path, 'scene', error)
      former_settings = origin_of(path, 'resolved_input', error)
      if (allocated(error) .or. former /= scene) return
      if (changed_entries(former_settings, settings%resolved) /= '') return
      call check_closed(manifest, folder, error)
      if (.not. allocated(error)) call move_alloc(text, last_state)
   end subroutine find_finished

   !> Whether the root rank found a finished result, which it then reports; collective.
   logical function is_finished(run, last_state)
      type(run_t), intent(inout) :: run
      !> Hash of the last state; allocated on the root rank if the result is finished
      character(len=:), allocatable, intent(in) :: last_state
      integer(lp) :: found(1)

      found = merge(1_lp, 0_lp, allocated(last_state))
      call run%comm%broadcast(found)
      is_finished = found(1) == 1_lp
      if (is_finished .and. run%comm%is_root() .and. .not. run%options%is_guest) &
         call report_finished(run%folder, last_state)
   end function is_finished

   !> Report on the screen that the result is finished, and its state hash.
   subroutine report_finished(folder, last_state)
      character(len=*), intent(in) :: folder, last_state
      type(log_t) :: log
      type(error_t), allocatable :: ignored

      call log%open('', ignored)
      call log%write_line(folder//' holds the finished result of these settings: nothing to do')
      call write_hash(log, last_state)
      call log%close()
   end subroutine report_finished

end module polydem_finished_result
