!> A complete run, from settings to result.
module polydem_run_simulation
   use polydem_action_record, only: close_record, read_record
   use polydem_begin_run, only: begin_run
   use polydem_checkpoint_fields, only: restarts_t
   use polydem_clock, only: wall_seconds
   use polydem_communicator, only: choose_communicator, communicator_t
   use polydem_end_condition, only: decide_end, is_at_limit, pass_end
   use polydem_errors, only: error_t, raise, stopped_early
   use polydem_finished_result, only: find_finished_result, is_finished
   use polydem_kinds, only: ip, lp
   use polydem_monitor, only: asks_all, most_guards, set_warning_counts, report_pending_warnings, warning_counts
   use polydem_perform_actions, only: perform_actions
   use polydem_run, only: run_options_t, run_t, result_folder
   use polydem_finish, only: finish
   use polydem_run_output, only: end_step, needs_table, update_balance, write_frame, write_stage
   use polydem_settings, only: settings_t
   use polydem_start_state, only: return_to_state
   use polydem_strings, only: to_text
   use polydem_time_step, only: advance
   use polydem_timers, only: stage_decomposition, stage_output
   implicit none
   private
   public :: run_simulation, start_run, is_over, take_step, interrupt_run, end_run

contains

   !> Run a simulation, and write trajectory, profile and log to its result folder; collective.
   subroutine run_simulation(settings, force, error, options, comm)
      type(settings_t), intent(in) :: settings
      !> Whether to replace an existing result (--force)
      logical, intent(in) :: force
      !> Allocated if the run fails, or if a signal or the time limit ends it early
      type(error_t), allocatable, intent(inout) :: error
      !> Options of this start; absent: a new run without a time limit
      type(run_options_t), intent(in), optional :: options
      !> Communicator of the run, absent: a serial one. Only its root rank writes files that the ranks do not share
      class(communicator_t), intent(in), optional :: comm
      type(run_t) :: run

      if (present(options)) run%options = options
      call start_run(settings, force, run, error, comm)
      do while (.not. (is_over(run) .or. allocated(error)))
         call take_step(run, error)
      end do
      call end_run(run, error)
   end subroutine run_simulation

   !> Prepare a run up to its first step, and write the first frame unless a previous start wrote it. Nothing is left
   !> to do if a previous start finished the run. Collective; all ranks get the same error.
   subroutine start_run(settings, force, run, error, comm)
      type(settings_t), intent(in) :: settings
      !> As in `run_simulation`
      logical, intent(in) :: force
      !> The run, with its options; `has_begun` says whether there are steps to do, and files to close
      type(run_t), intent(inout) :: run
      type(error_t), allocatable, intent(inout) :: error
      class(communicator_t), intent(in), optional :: comm
      character(len=:), allocatable :: last_state

      run%began = wall_seconds()
      call choose_communicator(run%comm, comm)
      run%folder = result_folder(settings)
      call read_record(run, error)
      if (run%options%continues .and. .not. allocated(error)) &
         call find_finished_result(settings, run, last_state, error)
      if (is_finished(run, last_state)) return
      if (.not. allocated(error)) call begin_run(settings, force, run, error)
      if (allocated(error)) return
      run%has_begun = .true.
      call begin_steps(run, error)
   end subroutine start_run

   !> Write the stage and, unless a previous start wrote it, the first frame; collective.
   subroutine begin_steps(run, error)
      type(run_t), intent(inout) :: run
      type(error_t), allocatable, intent(inout) :: error
      logical :: begins

      if (run%previous%checkpoint > 0_ip) call pass_end(run%simulation, begins, error)
      call write_stage(run)
      run%first_step = run%simulation%step
      if (run%previous%checkpoint > 0_ip) return
      call end_step(run, error)
      if (.not. allocated(error)) call return_to_state(run%simulation, error)
   end subroutine begin_steps

   !> Whether all steps of a run are done
   pure logical function is_over(run)
      type(run_t), intent(in) :: run

      is_over = .not. run%has_begun .or. run%simulation%step >= run%simulation%n_steps
   end function is_over

   !> Let actions take effect, do a step, and write what is due after it; collective. Another stage may begin. The
   !> checkpoint of a guest is due before the next step, so that it knows the actions after this one.
   subroutine take_step(run, error)
      !> A run that is not over
      type(run_t), intent(inout) :: run
      !> Allocated if the run must stop
      type(error_t), allocatable, intent(inout) :: error
      logical :: is_due, must_stop

      if (run%owes_checkpoint) call write_due_checkpoint(run, .true., .false., error)
      run%owes_checkpoint = .false.
      call perform_actions(run%simulation, error)
      if (.not. allocated(error)) call advance(run%simulation, error, needs_table(run))
      call synchronise_ranks(run, is_due, must_stop, error)
      if (.not. allocated(error)) call end_step(run, error)
      call run%simulation%timers%lap(stage_output)
      call run%simulation%timers%end_step()
      if (.not. allocated(error)) call run%recorder%record(run%simulation, run%manifest, error)
      if (run%simulation%stages%number > 0_ip .and. .not. allocated(error)) call change_stage(run, error)
      run%owes_checkpoint = run%options%is_guest .and. is_due .and. .not. must_stop
      if (.not. (allocated(error) .or. run%owes_checkpoint)) call write_due_checkpoint(run, is_due, must_stop, error)
   end subroutine take_step

   !> End a run, also after an error or before all steps are done: write its end, and release the folder; collective.
   subroutine end_run(run, error)
      type(run_t), intent(inout) :: run
      !> On entry the reason why the run did not finish
      type(error_t), allocatable, intent(inout) :: error

      if (run%has_begun .and. run%options%has_files) then
         call close_record(run, error)
         call finish(run, run%restarts%seconds + (wall_seconds() - run%began), error)
         ! The result is complete without it. Before its first step a continued run has no pairs that it could write;
         ! the checkpoint from which it came is that of its end.
         if (run%simulation%settings%checkpoint%at_end .and. .not. allocated(error)) then
            if (run%simulation%step > run%first_step .or. run%previous%checkpoint == 0_ip) &
               call write_checkpoint(run, error)
         end if
         call run%comm%all_reduce_error(error)
      end if
      run%has_begun = .false.
      call run%lock%release()
   end subroutine end_run

   !> Interrupt a run between two steps, so that --continue resumes it; collective. Nothing happens if it is over.
   subroutine interrupt_run(run, reason, error)
      type(run_t), intent(inout) :: run
      !> What interrupts it, for its log
      character(len=*), intent(in) :: reason
      !> Becomes `stopped_early`, or why the checkpoint cannot be written
      type(error_t), allocatable, intent(inout) :: error

      if (is_over(run)) return
      run%reason = reason
      call write_due_checkpoint(run, run%checkpoints%last_step /= run%simulation%step, .true., error)
   end subroutine interrupt_run

   !> All-reduce the error of a step, and broadcast whether a checkpoint is due and whether the run must end, which the
   !> root rank decides from its clock and signals; collective.
   subroutine synchronise_ranks(run, is_due, must_stop, error)
      type(run_t), intent(inout) :: run
      !> Whether a checkpoint is due, and whether the run must end after it; the same on all ranks
      logical, intent(out) :: is_due, must_stop
      type(error_t), allocatable, intent(inout) :: error
      integer(lp) :: flags(3 + most_guards)

      is_due = .false.
      if (run%comm%is_root() .and. run%options%has_files) &
         call run%checkpoints%decide(run%simulation%step, is_due, run%reason)
      must_stop = allocated(run%reason)
      call run%log%check(error)
      if (run%comm%size == 1_ip) return
      flags = [merge(1_lp, 0_lp, is_due), merge(1_lp, 0_lp, must_stop), &
               merge(1_lp, 0_lp, asks_all(run%simulation)), warning_counts(run%simulation)]
      call run%comm%all_reduce_error(error, flags)
      is_due = flags(1) == 1_lp
      must_stop = flags(2) == 1_lp
      run%monitor%is_asked = flags(3) == 1_lp
      call set_warning_counts(run%simulation, flags(4:))
      call run%simulation%timers%lap(stage_decomposition)
   end subroutine synchronise_ranks

   !> Write a checkpoint if one is due, and end the run early if it must stop; collective. The last step has none, so
   !> that a run that is killed before its report repeats this step.
   subroutine write_due_checkpoint(run, is_due, must_stop, error)
      type(run_t), intent(inout) :: run
      logical, intent(in) :: is_due, must_stop
      type(error_t), allocatable, intent(inout) :: error

      associate (s => run%simulation)
         if (s%step == s%n_steps) return
         if (is_due) call write_checkpoint(run, error)
         if (allocated(error) .or. .not. must_stop) return
         if (.not. allocated(run%reason)) run%reason = 'the root rank'
         call raise(error, stopped_early, 'interrupted by '//run%reason//' at step '//to_text(s%step)//' of '// &
                    to_text(s%n_steps)//'; add --continue to resume')
      end associate
   end subroutine write_due_checkpoint

   !> Decide whether the present stage of the run ends, and begin the next one after its last step; collective. Before a
   !> stage that has lasted too long stops the run, the last frame and a checkpoint are written, so that it can go on
   !> with other settings.
   subroutine change_stage(run, error)
      type(run_t), intent(inout) :: run
      type(error_t), allocatable, intent(inout) :: error
      logical :: begins

      call decide_end(run%simulation)
      if (is_at_limit(run%simulation) .and. run%options%has_files) then
         call update_balance(run)
         call write_frame(run, error)
         if (.not. allocated(error)) call write_checkpoint(run, error)
      end if
      if (allocated(error)) return
      call pass_end(run%simulation, begins, error)
      if (begins) call write_stage(run)
   end subroutine change_stage

   !> Write a checkpoint; collective.
   subroutine write_checkpoint(run, error)
      type(run_t), intent(inout) :: run
      type(error_t), allocatable, intent(inout) :: error
      type(restarts_t) :: restarts

      associate (s => run%simulation)
         call s%timers%start()
         ! A checkpoint holds the number of warnings, not their text.
         call report_pending_warnings(s, run%log)
         call close_record(run, error)
         ! The frames up to the checkpoint are on disk before the checkpoint is.
         call run%trajectory%close(error, run%manifest)
         if (allocated(error)) return
         restarts = run%restarts
         restarts%segments = int(run%trajectory%number, lp)
         restarts%seconds = restarts%seconds + (wall_seconds() - run%began)
         call run%checkpoints%write(run%folder, run%provenance, run%comm, s, restarts, error)
         call s%timers%add_to_total(stage_output)
      end associate
   end subroutine write_checkpoint

end module polydem_run_simulation
