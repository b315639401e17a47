!> Restart of an interrupted run: finds the newest valid checkpoint and restores the simulation from it.
module polydem_restart
   use polydem_changed_entries, only: changed_entries, is_extension
   use polydem_checked_files, only: check_closed, find_segments, find_stranger, read_frames
   use polydem_checkpoint_fields, only: restarts_t, serialize_progress, serialize_run
   use polydem_checkpoint_file, only: checkpoint_file_t
   use polydem_domain, only: new_domain
   use polydem_errors, only: error_t, input_error, io_error, raise
   use polydem_file_system, only: exists
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_log, only: log_t
   use polydem_manifest, only: manifest_t
   use polydem_provenance, only: origin_of
   use polydem_result_files, only: checkpoint_path, n_checkpoints, name_in, profile_name, segment_path, trace_name
   use polydem_serializer, only: serializer_t
   use polydem_settings, only: settings_t
   use polydem_simulation, only: simulation_t
   use polydem_strings, only: quoted, to_text
   use polydem_timers, only: timers_t
   use polydem_wall_places, only: check_places
   use polydem_wall_record, only: clear_record
   implicit none
   private
   public :: restart_state_t, find_restart, restore, remove_surplus_files, serialize_previous

   !> State of the result folder after previous starts
   type :: restart_state_t
      !> Number of the checkpoint to restart from; 0: there is none, the run starts at step 0
      integer(ip) :: checkpoint = 0_ip
      !> Step of the checkpoint
      integer(lp) :: step = 0_lp
      !> Number of closed segments of the trajectory that the run keeps
      integer(ip) :: segments = 0_ip
      !> Number of later closed segments, which the run removes since their frames belong to earlier settings
      integer(ip), private :: surplus = 0_ip
      !> Step of the last frame that the run keeps; negative if there is none. Frames up to it are not written again
      integer(lp) :: last_frame = -1_lp
      !> Lines for the log
      character(len=:), allocatable :: note
      !> Number of frames, first and last step of a last segment that has its final name but is not closed in the
      !> manifest; 0 if there is none
      integer(lp), private :: unlisted(3) = 0_lp
      !> Number of closed segments when the checkpoint was written
      integer(lp), private :: segments_at_checkpoint = 0_lp
      !> Whether entries differ from those of the checkpoint by more than a longer run
      logical, private :: is_changed = .false.
      !> Commit of the program that wrote the checkpoint, and its resolved settings
      character(len=:), allocatable, private :: revision, former_settings
   end type restart_state_t

   !> Message about a different scene
   character(len=*), parameter :: other_bodies = 'the initial bodies differ'

contains

   !> Choose the newest valid checkpoint, and check that settings and initial bodies are unchanged.
   subroutine find_restart(folder, manifest, simulation, scene, may_change, previous, error)
      !> Result folder; this run holds its lock
      character(len=*), intent(in) :: folder
      !> Valid manifest of the folder
      type(manifest_t), intent(in) :: manifest
      !> The simulation at time 0, with the settings of this run
      type(simulation_t), intent(in) :: simulation
      !> Hash of the initial bodies, as in the provenance of results
      character(len=*), intent(in) :: scene
      !> Whether the settings may differ from those of the checkpoint
      logical, intent(in) :: may_change
      !> State of the folder after previous starts
      type(restart_state_t), intent(out) :: previous
      !> Allocated if the run cannot restart
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: changes, former
      logical :: is_longer

      call check_closed(manifest, folder, error)
      if (.not. allocated(error)) call choose_checkpoint(folder, manifest, previous, error)
      if (allocated(error)) return
      associate (settings => simulation%settings)
         if (previous%checkpoint == 0_ip) then
            call restart_without_checkpoint(folder, manifest, settings, scene, previous, error)
            return
         end if
         changes = changed_entries(previous%former_settings, settings%resolved)
         is_longer = is_extension(previous%former_settings, settings%resolved)
         former = origin_of(checkpoint_path(folder, previous%checkpoint), 'scene', error)
         if (allocated(error)) return
         if (changes /= '' .and. .not. (may_change .or. is_longer)) then
            call raise(error, input_error, 'the settings differ from those of the run in '//folder//': '//changes// &
                       '. Restore them, or add --changed to resume with the new settings from step '// &
                       to_text(previous%step))
         else if (former /= scene) then
            call raise(error, input_error, folder//' holds the result of another run: '// &
                       why_other(settings, changes)//'. Restore it, or use --force instead of --continue to '// &
                       'start again')
         else if (previous%step > simulation%n_steps) then
            call raise(error, input_error, checkpoint_path(folder, previous%checkpoint)//' is of step '// &
                       to_text(previous%step)//', behind the end of the run at step '//to_text(simulation%n_steps)// &
                       ': increase duration in &integrate')
         end if
         if (allocated(error)) return
         previous%is_changed = changes /= '' .and. .not. is_longer
         if (changes /= '') previous%note = previous%note//new_line('a')// &
            trim(merge('extended  ', 'changed   ', is_longer))//repeat(' ', merge(3, 4, is_longer))//changes
         if (is_longer .and. .not. settings%integrate%dt > 0.0_wp) previous%note = previous%note//new_line('a')// &
            '           dt as before; a run that begins with integrate.dt = '//to_text(simulation%dt, 17)// &
            ' has the same bits'
      end associate
      call count_segments(folder, manifest, changes /= '' .and. .not. is_longer, simulation%n_steps, previous, error)
   end subroutine find_restart

   !> Why the initial bodies differ from those of the earlier run: by entries, or by the contents of a file
   function why_other(settings, changes) result(text)
      type(settings_t), intent(in) :: settings
      !> Entries that differ; empty if none does
      character(len=*), intent(in) :: changes
      character(len=:), allocatable :: text

      associate (scene => settings%scene)
         if (changes /= '') then
            text = other_bodies//' by '//changes
         else if (scene%bodies_file /= '') then
            text = other_bodies//', though no entry does: the contents of bodies_file = '// &
               quoted(trim(scene%bodies_file))//' changed'
         else if (scene%name == 'result') then
            text = other_bodies//', though no entry does: the result in start_from = '// &
               quoted(trim(scene%start_from))//' changed'
         else if (packing_of(settings) /= '') then
            text = other_bodies//', though no entry does: the contents of packing = '// &
               quoted(packing_of(settings))//' changed'
         else
            text = other_bodies//', though no entry does: another revision of this program made them'
         end if
      end associate
   end function why_other

   !> Path of the first packing from which the scene is made; empty if there is none
   pure function packing_of(settings) result(path)
      type(settings_t), intent(in) :: settings
      character(len=:), allocatable :: path
      integer :: k

      path = trim(settings%scene%packing)
      do k = 1, size(settings%grains)
         if (path == '') path = trim(settings%grains(k)%packing)
      end do
   end function packing_of

   !> Restart at step 0 without a checkpoint; keep the closed segments of a run of the same scene and settings.
   subroutine restart_without_checkpoint(folder, manifest, settings, scene, previous, error)
      character(len=*), intent(in) :: folder, scene
      type(manifest_t), intent(in) :: manifest
      type(settings_t), intent(in) :: settings
      type(restart_state_t), intent(inout) :: previous
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: path, changes, former, former_settings

      previous%note = 'there is no checkpoint in '//folder//': the run starts at step 0'
      path = segment_path(folder, 1_ip)
      if (.not. exists(path, error)) path = folder//'/'//profile_name
      if (.not. exists(path, error)) return
      former_settings = origin_of(path, 'resolved_input', error)
      former = origin_of(path, 'scene', error)
      if (allocated(error)) return
      changes = changed_entries(former_settings, settings%resolved)
      if (changes == '' .and. former /= scene) changes = why_other(settings, changes)
      if (changes == '') then
         call count_segments(folder, manifest, .false., huge(1_lp), previous, error)
      else
         call raise(error, input_error, folder//' has no checkpoint from which a run with other settings could '// &
                    'continue: '//changes//'. Choose another folder with --set output.folder=NAME, or use --force '// &
                    'instead of --continue to start again')
      end if
   end subroutine restart_without_checkpoint

   !> Read all checkpoints and choose the valid one with the greatest step. One that the system refuses to read may be
   !> good and newer, so it is an error.
   subroutine choose_checkpoint(folder, manifest, previous, error)
      character(len=*), intent(in) :: folder
      type(manifest_t), intent(in) :: manifest
      type(restart_state_t), intent(inout) :: previous
      type(error_t), allocatable, intent(inout) :: error
      type(error_t), allocatable :: problem
      type(restart_state_t) :: candidate
      character(len=:), allocatable :: damage
      integer(ip) :: k

      damage = ''
      do k = 1_ip, n_checkpoints
         if (.not. exists(checkpoint_path(folder, k), error)) cycle
         candidate = restart_state_t(checkpoint=k)
         call read_progress(checkpoint_path(folder, k), manifest%run, candidate, problem)
         if (allocated(problem)) then
            if (problem%is_unread) then
               problem%message = problem%message//'. Try again; if this remains, move the file away, and the run '// &
                  'continues from an earlier step'
               call move_alloc(problem, error)
               return
            end if
            damage = damage//problem%message//new_line('a')
            deallocate (problem)
         else if (previous%checkpoint == 0_ip .or. candidate%step > previous%step) then
            previous = candidate
         end if
      end do
      if (allocated(error)) return
      if (previous%checkpoint > 0_ip) then
         previous%note = 'continued  from '//checkpoint_path(folder, &
            previous%checkpoint)//', step '//to_text(previous%step)
         if (damage /= '') previous%note = 'warning: '//damage//previous%note//', the newest valid checkpoint'
      else if (damage /= '') then
         call raise(error, io_error, folder//': no checkpoint can be used. '//damage//'Start the run '// &
                    'again with --force instead of --continue')
      end if
   end subroutine choose_checkpoint

   !> Read step, restarts and settings of a checkpoint.
   subroutine read_progress(path, run, previous, error)
      character(len=*), intent(in) :: path, run
      type(restart_state_t), intent(inout) :: previous
      type(error_t), allocatable, intent(inout) :: error
      type(checkpoint_file_t) :: file
      type(restarts_t) :: restarts
      character(len=:), allocatable :: stranger

      call file%open(path, error)
      if (allocated(error)) return
      call serialize_progress(file, previous%step, restarts)
      previous%segments_at_checkpoint = restarts%segments
      if (.not. allocated(file%error)) call file%read_origin(previous%revision, previous%former_settings, error)
      call file%close(error)
      if (.not. allocated(error)) call find_stranger(path, run, stranger, error)
      if (allocated(stranger)) call raise(error, io_error, path//' '//stranger)
   end subroutine read_progress

   !> Find the last frame in closed segments. With changed settings, the run removes segments after the checkpoint, and
   !> always those after its end, which a start with a longer duration has left.
   subroutine count_segments(folder, manifest, is_changed, last_step, previous, error)
      character(len=*), intent(in) :: folder
      type(manifest_t), intent(in) :: manifest
      logical, intent(in) :: is_changed
      !> Last step of the run
      integer(lp), intent(in) :: last_step
      type(restart_state_t), intent(inout) :: previous
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: path, problem
      integer, allocatable :: places(:)
      integer(lp) :: steps(2)

      call find_segments(manifest, folder, places, problem)
      previous%segments = size(places, kind=ip)
      call find_unlisted(folder, manifest, places, previous, error)
      if (allocated(error)) return
      if (int(previous%segments, lp) < previous%segments_at_checkpoint) then
         call raise(error, io_error, segment_path(folder, previous%segments + 1_ip)//' is missing, but it existed '// &
                    'at the checkpoint of step '//to_text(previous%step)//'. Put the file back, or start the run '// &
                    'again with --force instead of --continue')
      end if
      do while (previous%segments > 0_ip .and. .not. allocated(error))
         path = segment_path(folder, previous%segments)
         steps = previous%unlisted(2:)
         if (previous%segments <= size(places)) steps = manifest%entry(places(previous%segments))%frames(2:)
         previous%last_frame = steps(2)
         if (previous%last_frame <= merge(previous%step, last_step, is_changed)) return
         if (steps(1) <= previous%step) then
            call raise(error, input_error, path//' holds frames before and after step '//to_text(previous%step)// &
                       ', at which the settings would change. Resume with the old settings until '// &
                       'after step '//to_text(previous%last_frame))
         else
            previous%surplus = previous%surplus + 1_ip
            previous%note = previous%note//new_line('a')//'to remove  '//path// &
               ', whose frames belong to other settings'
         end if
         previous%segments = previous%segments - 1_ip
         previous%last_frame = -1_lp
      end do
   end subroutine count_segments

   !> Find a segment that has its final name but is not closed in the manifest, because a kill came in between. A
   !> segment gets its final name only when it is complete.
   subroutine find_unlisted(folder, manifest, places, previous, error)
      character(len=*), intent(in) :: folder
      type(manifest_t), intent(in) :: manifest
      integer, intent(in) :: places(:)
      type(restart_state_t), intent(inout) :: previous
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: path, problem
      integer(lp) :: last

      path = segment_path(folder, previous%segments + 1_ip)
      if (.not. manifest%owns(name_in(path))) return
      if (.not. exists(path, error)) return
      call read_frames(path, previous%unlisted, error)
      if (allocated(error)) return
      call find_stranger(path, manifest%run, problem, error)
      last = -1_lp
      if (size(places) > 0) last = manifest%entry(places(size(places)))%frames(3)
      if (previous%unlisted(2) <= last .and. .not. allocated(problem)) &
         problem = 'does not follow the previous segment, which ends at step '//to_text(last)
      if (allocated(problem)) call raise(error, io_error, path//' '//problem//'. Move the file away; the run '// &
         'writes its frames again')
      previous%segments = previous%segments + 1_ip
   end subroutine find_unlisted

   !> Remove the files of previous starts that the run does not keep: unfinished files, the profile of an ended run,
   !> and segments of earlier settings. Call this only after all checks of the restart have passed.
   subroutine remove_surplus_files(folder, manifest, previous, error)
      !> Result folder
      character(len=*), intent(in) :: folder
      !> Manifest of the folder, which is updated
      type(manifest_t), intent(inout) :: manifest
      !> State of the folder after previous starts
      type(restart_state_t), intent(in) :: previous
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: number
      integer :: k

      call manifest%remove_file(folder//'/'//profile_name, error)
      call manifest%remove_unfinished(error)
      do number = previous%segments + previous%surplus, previous%segments + 1_ip, -1_ip
         call manifest%remove_file(segment_path(folder, number), error)
         call manifest%remove_entry(segment_path(folder, number), error)
      end do
      if (previous%unlisted(1) > 0_lp .and. previous%surplus == 0_ip) &
         call manifest%close_file(segment_path(folder, previous%segments), error, previous%unlisted)
      k = manifest%place_of(trace_name)
      if (k == 0) return
      if (.not. manifest%entry(k)%is_closed) call manifest%close_file(folder//'/'//trace_name, error)
   end subroutine remove_surplus_files

   !> Serialize what all ranks must know of the previous starts.
   subroutine serialize_previous(serializer, previous)
      class(serializer_t), intent(inout) :: serializer
      !> State of the folder after previous starts
      type(restart_state_t), intent(inout) :: previous
      integer(ip) :: numbers(2)

      numbers = [previous%checkpoint, previous%segments]
      call serializer%field('/run/files', numbers, '1', 'number of the checkpoint, number of segments')
      previous%checkpoint = numbers(1)
      previous%segments = numbers(2)
      call serializer%field('/run/step', previous%step, '1', 'step of the checkpoint')
      call serializer%field('/run/last_frame', previous%last_frame, '1', 'step of the last frame')
   end subroutine serialize_previous

   !> Restore the simulation from the checkpoint. Collective; all ranks get the same error.
   subroutine restore(folder, previous, revision, simulation, restarts, log, error)
      !> Result folder
      character(len=*), intent(in) :: folder
      !> State of the folder, with a checkpoint
      type(restart_state_t), intent(in) :: previous
      !> Commit of this program
      character(len=*), intent(in) :: revision
      !> A simulation of the same scene at time 0
      type(simulation_t), intent(inout) :: simulation
      !> On entry the scene hash, on return all restarts including this one
      type(restarts_t), intent(inout) :: restarts
      !> Monitor at time 0
      type(log_t), intent(inout) :: log
      !> Allocated if the checkpoint does not fit this run
      type(error_t), allocatable, intent(inout) :: error
      type(checkpoint_file_t) :: file

      call file%open(checkpoint_path(folder, previous%checkpoint), error, simulation%comm)
      if (allocated(error)) return
      call serialize_run(file, simulation, restarts)
      call file%close(error)
      if (allocated(error)) then
         if (error%is_unread) return
         error%message = checkpoint_path(folder, previous%checkpoint)//' does not fit this run: '//error%message
         if (index(error%message, '/run/time_step') > 0) error%message = error%message// &
            '. Set dt in &integrate to the saved value, or omit it'
         return
      end if
      if (previous%is_changed) call check_places(simulation, error)
      if (allocated(error)) return
      ! The first step distributes the bodies again. The sums over all ranks continue on the root rank.
      associate (s => simulation, median_diameter => simulation%domain%median_diameter)
         call new_domain(s%domain, s%settings%decomposition, (median_diameter), s%comm, s%bodies%cell)
         if (.not. s%comm%is_root()) then
            s%sums = 0_lp
            call clear_record(s%walls)
            s%timers = timers_t()
            s%search%neighbours%finder%work%value = 0_lp
            s%search%neighbours%finder%work%seconds = 0.0_dp
         end if
      end associate
      ! Segments behind the checkpoint have some of its rows.
      call simulation%series%drop_rows(previous%last_frame)
      restarts%number = restarts%number + 1_lp
      call log%write_line('restart    '//to_text(restarts%number))
      if (revision /= previous%revision) call log%write_line('warning: another revision of this program ('// &
         previous%revision//') wrote the checkpoint; results may differ from those of an uninterrupted run')
   end subroutine restore

end module polydem_restart
