!> A run from its settings to its result.
module polydem_run
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use polydem_checked_files, only: check_manifest
   use polydem_checkpoint_contents, only: history_t, keep_whole, scene_hash
   use polydem_claim_folder, only: claim_folder
   use polydem_clock, only: wall_seconds
   use polydem_crowding, only: crowding
   use polydem_dangers, only: warn_of_dangers
   use polydem_description, only: describe, list_overlaps
   use polydem_errors, only: error_t, input_error, raise, stopped_early
   use polydem_hash, only: hexadecimal
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_log, only: log_t
   use polydem_log_tables, only: write_hash, write_header
   use polydem_lone_team, only: lone_team_t
   use polydem_paths, only: make_folder
   use polydem_provenance, only: collect_provenance
   use polydem_replaced, only: recover, replaced_name
   use polydem_replacement, only: give_up_replaced, say, undo_replacement
   use polydem_result_folder, only: checkpoint_path, default_folder, n_checkpoints, name_in, overlaps_path, profile_path
   use polydem_recorder, only: check_recording
   use polydem_resume, only: clear_surplus, find_finished, go_on, look_back
   use polydem_share_scene, only: check_team, share_scene, sharer_t
   use polydem_settings, only: settings_t
   use polydem_simulation, only: advance, new_simulation
   use polydem_strings, only: to_text
   use polydem_team, only: team_t
   use polydem_timers, only: stage_exchange, stage_output, timers_t
   use polydem_watch, only: look, new_watch, set_warning_counts, tell_pending, warning_counts
   use polydem_run_output, only: attempt_t, choose_intervals, end_step, finish, run_t
   implicit none
   private
   public :: run_simulation, result_folder, attempt_t

contains

   !> Run a simulation, and leave trajectory, profile and log in its folder. Collective.
   subroutine run_simulation(settings, force, error, attempt, team)
      !> Checked settings
      type(settings_t), intent(in) :: settings
      !> Whether an older result may be overwritten
      logical, intent(in) :: force
      !> Why the run could not start or go on, or that it ended early
      type(error_t), allocatable, intent(inout) :: error
      !> How to deal with former attempts; a new run without a limit if absent
      type(attempt_t), intent(in), optional :: attempt
      !> Processes that run it, of which only the leader writes anything but shared files; this one alone if absent
      class(team_t), intent(in), optional :: team
      type(run_t) :: run
      character(len=:), allocatable :: last_state

      run%began = wall_seconds()
      if (present(attempt)) run%attempt = attempt
      if (present(team)) allocate (run%team, source=team)
      if (.not. allocated(run%team)) allocate (lone_team_t :: run%team)
      run%folder = result_folder(settings)
      if (run%team%leads() .and. run%attempt%continues) call look_for_end(settings, run, last_state, error)
      if (is_over(run, last_state)) return
      run%crowding = crowding(run%team)
      call check_team(settings, run%team, error)
      if (run%team%leads() .and. .not. allocated(error)) call begin(settings, force, run, last_state, error)
      call run%team%agree(error)
      if (.not. allocated(error)) then
         if (is_over(run, last_state)) then
            call run%lock%release()
            return
         end if
         if (.not. run%team%leads()) call run%lock%join(run%folder)
      end if
      if (.not. allocated(error)) call join(settings, run, error)
      if (.not. allocated(error)) call go(run, error)
      if (run%lock%is_held() .and. allocated(error) .and. .not. run%has_lost_folder) call undo_replacement(run%folder)
      call run%lock%release()
   end subroutine run_simulation

   !> Look whether there is nothing left to do, without changing anything.
   subroutine look_for_end(settings, run, last_state, error)
      type(settings_t), intent(in) :: settings
      type(run_t), intent(inout) :: run
      !> Hash of the last state, if the run is finished
      character(len=:), allocatable, intent(out) :: last_state
      type(error_t), allocatable, intent(inout) :: error
      integer :: k

      call run%manifest%read(run%folder)
      k = run%manifest%place_of(name_in(profile_path(run%folder)))
      if (k == 0 .or. allocated(run%manifest%problem) .or. run%manifest%owns(replaced_name)) return
      if (.not. run%manifest%entry(k)%is_closed) return
      call build_scene(settings, run, error)
      if (.not. allocated(error)) call find_finished(run%folder, settings, run%provenance%scene, run%manifest, &
                                                     last_state, error)
   end subroutine look_for_end

   !> Make the simulation at its start, unless that was done before.
   subroutine build_scene(settings, run, error)
      type(settings_t), intent(in) :: settings
      type(run_t), intent(inout) :: run
      type(error_t), allocatable, intent(inout) :: error

      if (allocated(run%provenance%scene)) return
      call new_simulation(settings, run%simulation, error)
      if (allocated(error)) return
      run%history%scene = scene_hash(run%simulation%bodies)
      run%provenance%scene = hexadecimal(run%history%scene)
   end subroutine build_scene

   !> Whether the leader found that there is nothing left to do, which it then says; collective.
   logical function is_over(run, last_state)
      type(run_t), intent(inout) :: run
      !> Hash of the last state, allocated if the leader found so
      character(len=:), allocatable, intent(in) :: last_state
      integer(lp) :: found(1)

      found = merge(1_lp, 0_lp, allocated(last_state))
      call run%team%share(found)
      is_over = found(1) == 1_lp
      if (is_over .and. run%team%leads()) call tell_finished(run%folder, last_state)
   end function is_over

   !> What the leader does alone: the scene, the folder, and what former attempts left there.
   subroutine begin(settings, force, run, last_state, error)
      type(settings_t), intent(in) :: settings
      logical, intent(in) :: force
      type(run_t), intent(inout) :: run
      !> Hash of the last state, if it turns out that the run is finished
      character(len=:), allocatable, intent(inout) :: last_state
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: note, restored

      call check_wanted(run, force, error)
      if (.not. allocated(error)) call build_scene(settings, run, error)
      if (.not. allocated(error)) call make_folder(run%folder, error)
      if (.not. allocated(error)) call run%lock%acquire(run%folder, note, error, run%team%size > 1_ip)
      if (.not. allocated(error)) call recover(run%folder, restored, error)
      if (allocated(error)) return
      if (allocated(restored)) call say(restored)
      if (allocated(restored) .and. run%attempt%continues) call look_for_end(settings, run, last_state, error)
      if (.not. allocated(last_state) .and. .not. allocated(error)) call prepare(settings, force, note, run, error)
   end subroutine begin

   !> Let all processes know what the leader knows, and open what they write together.
   subroutine join(settings, run, error)
      type(settings_t), intent(in) :: settings
      type(run_t), intent(inout) :: run
      type(error_t), allocatable, intent(inout) :: error
      type(sharer_t) :: sharer
      integer(lp) :: longs(6)
      real(dp) :: stored(1)

      call share_scene(settings, run%team, run%simulation, error)
      call run%team%agree(error)
      if (allocated(error)) return
      if (run%team%size > 1_ip) then
         longs = [run%history%scene, int(run%past%checkpoint, lp), run%past%step, int(run%past%segments, lp), &
                  run%past%last_frame, int(run%checkpoints%next, lp)]
         stored = real(run%watch%energy%stored, dp)
         call run%team%share(longs)
         call run%team%share(stored)
         if (.not. run%team%leads()) then
            run%history%scene = longs(1)
            run%past%checkpoint = int(longs(2), ip)
            run%past%step = longs(3)
            run%past%segments = int(longs(4), ip)
            run%past%last_frame = longs(5)
            call run%checkpoints%open(settings%checkpoint, run%simulation%dt, run%began, 0.0_dp)
            if (run%past%checkpoint > 0_ip) run%checkpoints%last_step = run%past%step
            run%checkpoints%next = int(longs(6), ip)
            run%watch%energy%stored = real(stored(1), wp)
            call choose_intervals(run)
         end if
         allocate (sharer%team, source=run%team)
         sharer%gives_back = .not. run%team%leads()
         call keep_whole(sharer, run%simulation, run%history, run%watch)
         if (allocated(sharer%error)) call move_alloc(sharer%error, error)
         call run%team%agree(error)
         if (allocated(error)) return
         if (.not. run%team%leads()) then
            run%simulation%sums = 0_lp
            run%simulation%timers = timers_t()
         end if
      end if
      call run%trajectory%open(run%folder, settings%output%frames_per_segment, run%provenance, error, &
                               run%past%segments, run%team)
      if (run%team%size == 1_ip .and. .not. allocated(error)) &
         call run%recorder%open(run%simulation, run%folder, run%provenance, run%log, run%manifest, error)
   end subroutine join

   !> The first frame, unless a former attempt wrote it, all steps, and the end.
   subroutine go(run, error)
      type(run_t), intent(inout) :: run
      type(error_t), allocatable, intent(inout) :: error
      logical :: is_due, must_stop

      if (run%past%checkpoint == 0_ip) then
         call end_step(run, error)
         if (.not. allocated(error)) call give_up_replaced(run, error)
      end if
      do while (run%simulation%step < run%simulation%n_steps .and. .not. allocated(error))
         call advance(run%simulation, error)
         call agree_on_step(run, is_due, must_stop, error)
         if (.not. allocated(error)) call end_step(run, error)
         call run%simulation%timers%lap(stage_output)
         call run%simulation%timers%end_step()
         if (.not. allocated(error)) call run%recorder%record(run%simulation, run%manifest, error)
         if (.not. allocated(error)) call save(run, is_due, must_stop, error)
      end do
      call finish(run, run%history%seconds + (wall_seconds() - run%began), error)
   end subroutine go

   !> Let all processes know how the step went, and what the clock, the signals and the log of the leader say.
   subroutine agree_on_step(run, is_due, must_stop, error)
      type(run_t), intent(inout) :: run
      !> Whether a checkpoint is due, and whether the run must end after it
      logical, intent(out) :: is_due, must_stop
      type(error_t), allocatable, intent(inout) :: error
      integer(lp) :: flags(6)

      is_due = .false.
      if (run%team%leads()) then
         call run%checkpoints%look(run%simulation%step, is_due, run%reason)
         call run%lock%check(run%has_lost_folder, error)
      end if
      must_stop = allocated(run%reason)
      call run%log%check(error)
      if (run%team%size == 1_ip) return
      flags = [merge(1_lp, 0_lp, is_due), merge(1_lp, 0_lp, must_stop), merge(1_lp, 0_lp, run%has_lost_folder), &
               warning_counts(run%watch, run%simulation)]
      call run%team%agree(error, flags)
      is_due = flags(1) == 1_lp
      must_stop = flags(2) == 1_lp
      run%has_lost_folder = flags(3) == 1_lp
      call set_warning_counts(run%watch, run%simulation, flags(4:))
      call run%simulation%timers%lap(stage_exchange)
   end subroutine agree_on_step

   !> Refuse to overwrite a result unless that is wanted, and to go on with one whose manifest is damaged.
   subroutine check_wanted(run, force, error)
      type(run_t), intent(inout) :: run
      logical, intent(in) :: force
      type(error_t), allocatable, intent(inout) :: error

      call run%manifest%read(run%folder)
      call check_manifest(run%manifest, error)
      if (force .or. run%attempt%continues .or. .not. run%manifest%is_found) return
      ! What an interrupted --force left is brought in order first.
      if (run%manifest%owns(replaced_name)) return
      call raise(error, input_error, run%folder//' holds a result; give --continue '// &
                 'to go on with it, --force to overwrite it, or another folder with --set output.folder=NAME')
   end subroutine check_wanted

   !> Say that there is nothing to do, and how the run ended.
   subroutine tell_finished(folder, last_state)
      character(len=*), intent(in) :: folder, last_state
      type(log_t) :: log
      type(error_t), allocatable :: ignored

      call log%open('', ignored)
      call log%write_line(folder//' holds the finished result of these settings: nothing to do')
      call write_hash(log, last_state)
      call log%close()
   end subroutine tell_finished

   !> Log, description and guards, and what former attempts left, in a folder that belongs to this run.
   subroutine prepare(settings, force, note, run, error)
      type(settings_t), intent(in) :: settings
      logical, intent(in) :: force
      !> A remark on how the folder was locked, if there is one
      character(len=:), allocatable, intent(in) :: note
      type(run_t), intent(inout) :: run
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: scene
      logical :: goes_on

      ! Again, now that nobody else can write there.
      call check_wanted(run, force, error)
      if (allocated(error)) return
      scene = run%provenance%scene
      call collect_provenance(run%provenance, settings%file, settings%text, settings%resolved, settings%scene%seed)
      run%provenance%scene = scene
      run%provenance%processes = run%team%size
      if (run%manifest%is_found .and. run%attempt%continues) &
         call look_back(run%folder, run%manifest, settings, scene, run%attempt%may_change, run%past, error)
      if (allocated(error)) return
      goes_on = run%past%checkpoint > 0_ip .or. run%past%segments > 0_ip
      call claim_folder(run%simulation, run%folder, force, goes_on, run%manifest, error)
      if (.not. allocated(error)) call run%log%open(run%folder, error, appended=goes_on)
      if (allocated(error)) return
      call write_header(run%log, run%provenance, run%folder)
      if (run%crowding /= '') call run%log%write_line(run%crowding)
      if (allocated(note)) call run%log%write_line(note)
      call describe(run%simulation, run%log)
      call write_overlaps(run, error)
      call new_watch(run%watch, run%simulation)
      call warn_of_dangers(run%simulation, run%log, run%watch%at_start)
      call choose_intervals(run)
      if (.not. allocated(error)) call recall(run, error)
      if (.not. allocated(error)) call check_recording(run%simulation, run%folder, error)
      if (goes_on .and. .not. allocated(error)) call clear_surplus(run%folder, run%manifest, run%past, error)
   end subroutine prepare

   !> Write what is said of deep contacts at the start, and the table of them.
   subroutine write_overlaps(run, error)
      type(run_t), intent(inout) :: run
      type(error_t), allocatable, intent(inout) :: error

      call run%manifest%reopen(overlaps_path(run%folder), error)
      if (.not. allocated(error)) call list_overlaps(run%simulation, run%folder, run%log, error)
      call run%manifest%close_file(overlaps_path(run%folder), error)
   end subroutine write_overlaps

   !> Look after checkpoints from now on, and go on from one if that is wanted.
   subroutine recall(run, error)
      type(run_t), intent(inout) :: run
      type(error_t), allocatable, intent(inout) :: error

      call run%checkpoints%open(run%simulation%settings%checkpoint, run%simulation%dt, run%began, run%attempt%limit)
      if (allocated(run%past%remark)) call run%log%write_line(run%past%remark)
      if (run%past%checkpoint == 0_ip) return
      run%provenance%parent = checkpoint_path(run%folder, run%past%checkpoint)//', step '//to_text(run%past%step)
      call go_on(run%folder, run%past, run%provenance%revision, run%simulation, run%history, run%watch, run%log, error)
      run%checkpoints%last_step = run%past%step
      run%checkpoints%next = modulo(run%past%checkpoint, n_checkpoints) + 1_ip
   end subroutine recall

   !> Write a checkpoint when it is time for one, and end the run early if that is wanted.
   subroutine save(run, is_due, must_stop, error)
      type(run_t), intent(inout) :: run
      logical, intent(in) :: is_due, must_stop
      type(error_t), allocatable, intent(inout) :: error
      type(history_t) :: history

      associate (s => run%simulation)
         if (s%step == s%n_steps) return
         if (is_due) then
            call s%timers%start()
            ! Warnings are not kept but their number.
            call tell_pending(run%watch, s, run%log)
            ! The frames up to the checkpoint are safe before it is.
            call run%trajectory%close(error, run%manifest)
            if (allocated(error)) return
            history = run%history
            history%segments = int(run%trajectory%number, lp)
            history%seconds = history%seconds + (wall_seconds() - run%began)
            call run%checkpoints%write(run%folder, run%provenance, run%team, s, history, run%watch, error)
            call s%timers%add_rest(stage_output)
         end if
         if (.not. must_stop) return
         if (.not. allocated(run%reason)) run%reason = 'the leader'
         call raise(error, stopped_early, 'stopped early by '//run%reason//' after step '// &
                    to_text(s%step)//' of '//to_text(s%n_steps)//'; the same command with --continue goes on')
      end associate
   end subroutine save

   !> The folder of the settings, or results/<name of the input without path and suffix>
   pure function result_folder(settings) result(folder)
      !> Settings of a run
      type(settings_t), intent(in) :: settings
      character(len=:), allocatable :: folder

      folder = settings%output%folder
      if (folder == '') folder = default_folder(settings%file)
   end function result_folder

end module polydem_run
