!> Finding out where an interrupted run can go on, and bringing its simulation there.
module polydem_resume
   use polydem_changed_entries, only: changed_entries
   use polydem_checkpoint_contents, only: history_t, keep_progress, keep_run
   use polydem_checkpoint_file, only: checkpoint_file_t
   use polydem_checked_files, only: check_closed, find_segments, read_frames
   use polydem_errors, only: error_t, input_error, io_error, raise
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_kinds, only: ip, lp
   use polydem_log, only: log_t
   use polydem_manifest, only: manifest_t
   use polydem_paths, only: exists
   use polydem_result_folder, only: checkpoint_path, n_checkpoints, name_in, profile_path, segment_path, trace_path
   use polydem_settings, only: settings_t
   use polydem_simulation, only: simulation_t
   use polydem_strings, only: to_text
   use polydem_watch, only: watch_t
   implicit none
   private
   public :: past_t, find_finished, look_back, go_on, clear_surplus

   !> What former attempts left
   type :: past_t
      !> Number of the checkpoint to go on from; 0: there is none, the run begins with its first step
      integer(ip) :: checkpoint = 0_ip
      !> Its step
      integer(lp) :: step = 0_lp
      !> Closed segments of the trajectory that stay
      integer(ip) :: segments = 0_ip
      !> Closed segments behind these that do not stay, as their frames are of former settings
      integer(ip), private :: surplus = 0_ip
      !> Step of the last frame in those that stay; negative if there is none. Frames up to it are not written again.
      integer(lp) :: last_frame = -1_lp
      !> What is to be said about it, for the log
      character(len=:), allocatable :: remark
      !> Frames, first and last step of the last segment that has its name, if it is not closed in the manifest; else 0
      integer(lp), private :: unlisted(3) = 0_lp
      !> Closed segments when the checkpoint was written
      integer(lp), private :: segments_then = 0_lp
      !> Commit of the program that wrote the checkpoint, and the settings in force then
      character(len=:), allocatable, private :: revision, former
   end type past_t

   !> What is said of another scene
   character(len=*), parameter :: other_bodies = 'the bodies at the start are others'

contains

   !> Look for the finished result of the same settings and bodies.
   subroutine find_finished(folder, settings, scene, manifest, last_state, error)
      !> Folder of the result
      character(len=*), intent(in) :: folder
      !> Settings of the run
      type(settings_t), intent(in) :: settings
      !> Hash of its bodies at the start, as in the provenance of results
      character(len=*), intent(in) :: scene
      !> Good manifest of the folder, which lists a closed profile
      type(manifest_t), intent(in) :: manifest
      !> Hash of its last state; not allocated if the folder holds no such result
      character(len=:), allocatable, intent(out) :: last_state
      !> Says that it is finished, but not whole any more
      type(error_t), allocatable, intent(inout) :: error
      type(hdf5_file_t) :: file
      character(len=:), allocatable :: path, status, text

      path = profile_path(folder)
      call check_closed(manifest, folder, error, only=name_in(path))
      if (.not. allocated(error)) call file%open(path, error)
      if (.not. allocated(error)) call file%read('/status', status, error)
      if (.not. allocated(error)) call file%read('/state_hash', text, error)
      call file%close(error)
      if (allocated(error)) return
      if (status /= 'finished') return
      if (origin_of(path, 'scene') /= scene) return
      if (changed_entries(origin_of(path, 'resolved_input'), settings%resolved) /= '') return
      call check_closed(manifest, folder, error)
      if (.not. allocated(error)) call move_alloc(text, last_state)
   end subroutine find_finished

   !> Choose the newest good checkpoint, and see to it that the settings are as they were.
   subroutine look_back(folder, manifest, settings, scene, may_change, past, error)
      !> Folder of the result, which nobody else writes to
      character(len=*), intent(in) :: folder
      !> Good manifest of the folder
      type(manifest_t), intent(in) :: manifest
      !> Settings of the run
      type(settings_t), intent(in) :: settings
      !> Hash of its bodies at the start, as in the provenance of results
      character(len=*), intent(in) :: scene
      !> Whether the settings may be others
      logical, intent(in) :: may_change
      !> What was found
      type(past_t), intent(out) :: past
      !> Why the run cannot go on
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: changes

      call check_closed(manifest, folder, error)
      if (.not. allocated(error)) call choose_checkpoint(folder, past, error)
      if (allocated(error)) return
      if (past%checkpoint == 0_ip) then
         call look_without_checkpoint(folder, manifest, settings, scene, past, error)
         return
      end if
      changes = changed_entries(past%former, settings%resolved)
      if (changes /= '' .and. .not. may_change) then
         call raise(error, input_error, 'the settings are not those of the run in '//folder//': '//changes// &
                    '. Undo that, or give --changed to go on with them from step '//to_text(past%step))
      else if (origin_of(checkpoint_path(folder, past%checkpoint), 'scene') /= scene) then
         call raise(error, input_error, folder//' holds the result of another run: '//other_bodies//'. Undo that '// &
                    '(has a bodies file changed?), or give --force instead of --continue to overwrite it')
      end if
      if (allocated(error)) return
      if (changes /= '') past%remark = past%remark//new_line('a')//'changed    '//changes
      call count_segments(folder, manifest, scene, changes /= '', past, error)
   end subroutine look_back

   !> Begin with the first step, but keep the closed segments of a run of the same scene and settings.
   subroutine look_without_checkpoint(folder, manifest, settings, scene, past, error)
      character(len=*), intent(in) :: folder, scene
      type(manifest_t), intent(in) :: manifest
      type(settings_t), intent(in) :: settings
      type(past_t), intent(inout) :: past
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: path, changes, former

      past%remark = 'there is no checkpoint in '//folder//': the run begins with its first step'
      path = segment_path(folder, 1_ip)
      if (.not. exists(path)) path = profile_path(folder)
      if (.not. exists(path)) return
      changes = changed_entries(origin_of(path, 'resolved_input'), settings%resolved)
      former = origin_of(path, 'scene')
      if (changes == '' .and. former /= scene) changes = other_bodies
      if (changes == '') then
         call count_segments(folder, manifest, scene, .false., past, error)
      else
         call raise(error, input_error, folder//' holds the result of another run, and no checkpoint: '//changes// &
                    '. Give --force instead of --continue to overwrite it')
      end if
   end subroutine look_without_checkpoint

   !> Look at all checkpoints, and take the one of the greatest step.
   subroutine choose_checkpoint(folder, past, error)
      character(len=*), intent(in) :: folder
      type(past_t), intent(inout) :: past
      type(error_t), allocatable, intent(inout) :: error
      type(error_t), allocatable :: problem
      type(past_t) :: candidate
      character(len=:), allocatable :: damage
      integer(ip) :: k

      damage = ''
      do k = 1_ip, n_checkpoints
         if (.not. exists(checkpoint_path(folder, k))) cycle
         candidate = past_t(checkpoint=k)
         call read_progress(checkpoint_path(folder, k), candidate, problem)
         if (allocated(problem)) then
            damage = damage//problem%message//new_line('a')
            deallocate (problem)
         else if (past%checkpoint == 0_ip .or. candidate%step > past%step) then
            past = candidate
         end if
      end do
      if (past%checkpoint > 0_ip) then
         past%remark = 'continued  from '//checkpoint_path(folder, past%checkpoint)//', step '//to_text(past%step)
         if (damage /= '') past%remark = 'warning: '//damage//past%remark//', the newest good one'
      else if (damage /= '') then
         call raise(error, io_error, folder//': no checkpoint can be used. '//damage//'The run can only begin '// &
                    'anew, with --force instead of --continue')
      end if
   end subroutine choose_checkpoint

   subroutine read_progress(path, past, error)
      character(len=*), intent(in) :: path
      type(past_t), intent(inout) :: past
      type(error_t), allocatable, intent(inout) :: error
      type(checkpoint_file_t) :: file
      type(history_t) :: history

      call file%open(path, error)
      if (allocated(error)) return
      call keep_progress(file, past%step, history)
      past%segments_then = history%segments
      call file%read_origin(past%revision, past%former, error)
      call file%close(error)
   end subroutine read_progress

   !> An entry in the provenance of a file; empty if it cannot be read
   function origin_of(path, entry) result(text)
      character(len=*), intent(in) :: path, entry
      character(len=:), allocatable :: text
      type(hdf5_file_t) :: file
      type(error_t), allocatable :: error

      text = ''
      call file%open(path, error)
      if (.not. allocated(error)) call file%read('/provenance/'//entry, text, error)
      call file%close(error)
      if (allocated(error)) text = ''
   end function origin_of

   !> Find the last frame in closed segments. With other settings, segments after the checkpoint do not stay.
   subroutine count_segments(folder, manifest, scene, is_changed, past, error)
      character(len=*), intent(in) :: folder, scene
      type(manifest_t), intent(in) :: manifest
      logical, intent(in) :: is_changed
      type(past_t), intent(inout) :: past
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: path, problem
      integer, allocatable :: places(:)
      integer(lp) :: steps(2)

      call find_segments(manifest, folder, places, problem)
      past%segments = size(places, kind=ip)
      call find_unlisted(folder, manifest, scene, places, past, error)
      if (int(past%segments, lp) < past%segments_then) then
         call raise(error, io_error, segment_path(folder, past%segments + 1_ip)//' is missing, though it was there '// &
                    'at the checkpoint of step '//to_text(past%step)//'. Bring it back, or begin anew with --force '// &
                    'instead of --continue')
      end if
      do while (past%segments > 0_ip .and. .not. allocated(error))
         path = segment_path(folder, past%segments)
         steps = past%unlisted(2:)
         if (past%segments <= size(places)) steps = manifest%entry(places(past%segments))%frames(2:)
         past%last_frame = steps(2)
         if (.not. is_changed .or. past%last_frame <= past%step) return
         if (steps(1) <= past%step) then
            call raise(error, input_error, path//' holds frames before and after step '//to_text(past%step)// &
                       ', at which the settings would change. Go on without changes until step '// &
                       to_text(past%last_frame)//' is passed')
         else
            past%surplus = past%surplus + 1_ip
            past%remark = past%remark//new_line('a')//'removed    '//path//', whose frames are of former settings'
         end if
         past%segments = past%segments - 1_ip
         past%last_frame = -1_lp
      end do
   end subroutine count_segments

   !> Look for a segment that has its name, but is not closed in the manifest, since a kill came between. It was whole
   !> before it got its name.
   subroutine find_unlisted(folder, manifest, scene, places, past, error)
      character(len=*), intent(in) :: folder, scene
      type(manifest_t), intent(in) :: manifest
      integer, intent(in) :: places(:)
      type(past_t), intent(inout) :: past
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: path
      integer(lp) :: last

      path = segment_path(folder, past%segments + 1_ip)
      if (.not. manifest%owns(name_in(path))) return
      if (.not. exists(path)) return
      call read_frames(path, past%unlisted, error)
      if (allocated(error)) return
      last = -1_lp
      if (size(places) > 0) last = manifest%entry(places(size(places)))%frames(3)
      if (past%unlisted(2) <= last) call raise(error, io_error, path//' does not follow the segment before, which '// &
         'ends with step '//to_text(last)//'. Move it away; its frames are computed again')
      if (origin_of(path, 'scene') /= scene) call raise(error, io_error, path//' is a segment of another run: '// &
         other_bodies//'. Move it away; its frames are computed again')
      past%segments = past%segments + 1_ip
   end subroutine find_unlisted

   !> Remove what former attempts left and the run does not keep: what is unfinished, the end of a finished run, and
   !> segments of former settings. To be called when nothing can keep the run from going on.
   subroutine clear_surplus(folder, manifest, past, error)
      !> Folder of the result
      character(len=*), intent(in) :: folder
      !> Its manifest, which is written to
      type(manifest_t), intent(inout) :: manifest
      !> What was found there
      type(past_t), intent(in) :: past
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: number
      integer :: k

      call manifest%empty(profile_path(folder), error)
      do k = 1, manifest%n
         if (.not. allocated(error)) call manifest%empty(trim(manifest%entry(k)%name), error, stays=.true.)
      end do
      do number = past%segments + past%surplus, past%segments + 1_ip, -1_ip
         call manifest%empty(segment_path(folder, number), error)
         call manifest%forget(segment_path(folder, number), error)
      end do
      if (past%unlisted(1) > 0_lp .and. past%surplus == 0_ip) &
         call manifest%close_file(segment_path(folder, past%segments), error, past%unlisted)
      k = manifest%place_of(name_in(trace_path(folder)))
      if (k == 0) return
      if (.not. manifest%entry(k)%is_closed) call manifest%close_file(trace_path(folder), error)
   end subroutine clear_surplus

   !> Bring a simulation to the state of the checkpoint.
   subroutine go_on(folder, past, revision, simulation, history, watch, log, error)
      !> Folder of the result
      character(len=*), intent(in) :: folder
      !> What was found there, with a checkpoint
      type(past_t), intent(in) :: past
      !> Commit that this program was built from
      character(len=*), intent(in) :: revision
      !> A simulation of the same scene at its start
      type(simulation_t), intent(inout) :: simulation
      !> The scene, to which the former attempts are added
      type(history_t), intent(inout) :: history
      !> Guards as at the start
      type(watch_t), intent(inout) :: watch
      !> Log
      type(log_t), intent(inout) :: log
      !> Why the checkpoint does not fit
      type(error_t), allocatable, intent(inout) :: error
      type(checkpoint_file_t) :: file

      call file%open(checkpoint_path(folder, past%checkpoint), error)
      if (allocated(error)) return
      call keep_run(file, simulation, history, watch)
      call file%close(error)
      if (allocated(error)) then
         error%message = checkpoint_path(folder, past%checkpoint)//' does not fit this run: '//error%message
         return
      end if
      history%attempts = history%attempts + 1_lp
      call log%write_line('attempt    '//to_text(history%attempts))
      if (revision /= past%revision) call log%write_line('warning: the checkpoint was written by another revision ('// &
         past%revision//') of this program; the same bits are not promised')
   end subroutine go_on

end module polydem_resume
