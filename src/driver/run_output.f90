!> A run under way, and what it writes: frames, lines of the log, the end.
module polydem_run_output
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use polydem_books, only: count_contacts, fill_row, write_books
   use polydem_checkpoint, only: checkpoints_t
   use polydem_checkpoint_contents, only: history_t
   use polydem_common_hash, only: hash_all_bodies
   use polydem_counters, only: counters_t
   use polydem_errors, only: error_t, run_error
   use polydem_hash, only: hexadecimal
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_ledger, only: balance_t
   use polydem_ledger_row, only: ledger_row_t
   use polydem_log, only: log_t
   use polydem_log_tables, only: write_counters, write_hash, write_ranks, write_timings
   use polydem_machine, only: resident_memory
   use polydem_manifest, only: manifest_t
   use polydem_profile, only: write_profile
   use polydem_provenance, only: provenance_t
   use polydem_recorder, only: recorder_t
   use polydem_result_folder, only: profile_path
   use polydem_resume, only: past_t
   use polydem_run_lock, only: run_lock_t
   use polydem_simulation, only: report_counters, simulation_t, time_of
   use polydem_strings, only: to_text
   use polydem_team, only: team_t
   use polydem_timers, only: n_stages
   use polydem_trajectory, only: trajectory_t
   use polydem_wall_forces, only: complete_wall_forces
   use polydem_watch, only: look, sum_up, tell_pending, watch_t
   implicit none
   private
   public :: run_t, attempt_t, choose_intervals, count_frames, end_step, finish

   !> Lines of the log if no interval is given
   integer(lp), parameter :: default_lines = 20_lp

   !> How to deal with what former attempts left, and when to end
   type :: attempt_t
      !> Whether to go on from the last checkpoint
      logical :: continues = .false.
      !> Whether the settings may be others than at that checkpoint
      logical :: may_change = .false.
      !> Elapsed time after which the attempt must have ended [s]; 0: none
      real(dp) :: limit = 0.0_dp
   end type attempt_t

   !> A run under way
   type :: run_t
      !> Processes that run it
      class(team_t), allocatable :: team
      !> How it was asked for
      type(attempt_t) :: attempt
      !> A warning if processes have more threads than processors, else empty
      character(len=:), allocatable :: crowding
      !> When it began, by the clock [s]
      real(dp) :: began = 0.0_dp
      !> What former attempts left
      type(past_t) :: past
      !> Former attempts, and this one
      type(history_t) :: history
      !> Checkpoints
      type(checkpoints_t) :: checkpoints
      !> What is simulated
      type(simulation_t) :: simulation
      !> Frames
      type(trajectory_t) :: trajectory
      !> Boxes, and times of every step
      type(recorder_t) :: recorder
      !> Log on the screen and in the folder
      type(log_t) :: log
      !> Where the result comes from
      type(provenance_t) :: provenance
      !> Ledger of the last frame or line
      type(ledger_row_t) :: row
      !> Energy and momentum at the last frame or line
      type(balance_t) :: balance
      !> Folder of the result
      character(len=:), allocatable :: folder
      !> List of its files, kept by the leader
      type(manifest_t) :: manifest
      !> Its lock, which the leader holds
      type(run_lock_t) :: lock
      !> Whether another run has taken the folder over; the same on all processes
      logical :: has_lost_folder = .false.
      !> Steps between two frames, 0 for none
      integer(lp) :: frame_steps = 0_lp
      !> Steps between two lines of the log
      integer(lp) :: log_steps = 0_lp
      !> Guards
      type(watch_t) :: watch
      !> Step of the last frame, negative if there is none
      integer(lp) :: last_frame = -1_lp
      !> Why the run must end early, known to the leader; unallocated as long as it need not
      character(len=:), allocatable :: reason
   end type run_t

contains

   !> Guards, frame and line, when it is time for them; collective, like all procedures here.
   subroutine end_step(run, error)
      !> The run
      type(run_t), intent(inout) :: run
      !> Why it cannot go on; the same on all processes
      type(error_t), allocatable, intent(inout) :: error
      logical :: frame_due, line_due
      integer(ip) :: n_contacts

      associate (s => run%simulation)
         frame_due = s%step == s%n_steps .or. is_due(s%step, run%frame_steps)
         line_due = s%step == s%n_steps .or. is_due(s%step, run%log_steps)
         call look(run%watch, s, line_due, run%log, error)
         if (allocated(error)) return
         if ((frame_due .or. line_due) .and. s%settings%output%ledger) call fill_row(s, run%balance, run%row)
         if (line_due) then
            call count_contacts(s, n_contacts)
            call run%log%write_interval(s%step, s%n_steps, time_of(s), s%dt, run%balance%kinetic, &
                                        run%balance%potential, n_contacts)
         end if
         if (frame_due) call write_frame(run, error)
         call run%log%show_progress(s%step, s%n_steps)
      end associate
   end subroutine end_step

   subroutine write_frame(run, error)
      type(run_t), intent(inout) :: run
      type(error_t), allocatable, intent(inout) :: error

      if (run%simulation%step <= run%past%last_frame) return
      associate (s => run%simulation, output => run%simulation%settings%output)
         call complete_wall_forces(run%team, s%bodies, s%contacts)
         if (output%contacts .and. output%ledger) then
            call run%trajectory%write_frame(s%step, time_of(s), s%bodies, error, contacts=s%contacts, row=run%row, &
                                            manifest=run%manifest)
         else if (output%contacts) then
            call run%trajectory%write_frame(s%step, time_of(s), s%bodies, error, contacts=s%contacts, &
                                            manifest=run%manifest)
         else if (output%ledger) then
            call run%trajectory%write_frame(s%step, time_of(s), s%bodies, error, row=run%row, &
                                            manifest=run%manifest)
         else
            call run%trajectory%write_frame(s%step, time_of(s), s%bodies, error, manifest=run%manifest)
         end if
         run%last_frame = s%step
      end associate
   end subroutine write_frame

   !> After a numerical failure, write the state in which the run stopped, if every body is somewhere; else the last
   !> frame stays the one that was due before.
   subroutine write_last_frame(run, code, error)
      type(run_t), intent(inout) :: run
      !> Exit code of the failure
      integer, intent(in) :: code
      type(error_t), allocatable, intent(inout) :: error

      integer(lp) :: nowhere(1)

      associate (s => run%simulation, bodies => run%simulation%bodies)
         if (code /= run_error .or. run%last_frame == s%step) return
         nowhere = merge(0_lp, 1_lp, all(ieee_is_finite(bodies%position)) .and. all(ieee_is_finite(bodies%velocity)) &
                         .and. all(ieee_is_finite(bodies%angle)) .and. all(ieee_is_finite(bodies%angular_velocity)))
         call run%team%maximise(nowhere)
         if (nowhere(1) == 1_lp) return
         if (s%settings%output%ledger) call fill_row(s, run%balance, run%row)
      end associate
      call write_frame(run, error)
   end subroutine write_last_frame

   !> Close the trajectory, write the profile and the end of the log, also after a failure; nothing if the folder
   !> belongs to another run now.
   subroutine finish(run, seconds, error)
      !> The run
      type(run_t), intent(inout) :: run
      !> Elapsed time of all attempts [s]
      real(dp), intent(in) :: seconds
      !> Why it did not come to its end; or why that could not be written
      type(error_t), allocatable, intent(inout) :: error
      type(error_t), allocatable :: late_error
      type(counters_t) :: counters
      character(len=:), allocatable :: status
      integer(lp) :: hash, memory

      if (run%has_lost_folder) return
      memory = resident_memory()
      status = 'finished'
      if (allocated(error)) status = error%message
      associate (s => run%simulation)
         call hash_all_bodies(run%team, s%bodies, hash)
         call report_counters(s, counters)
         call tell_pending(run%watch, s, run%log)
         if (allocated(error)) call write_last_frame(run, error%code, late_error)
         call run%trajectory%close(late_error, run%manifest)
         call run%recorder%close(run%log, run%manifest, late_error)
         call run%checkpoints%close(run%log)
         if (run%team%leads()) call write_profile(run%folder, s%timers, seconds, counters, run%provenance, hash, &
                                                  status, late_error, memory)
         call run%manifest%close_file(profile_path(run%folder), late_error)
         call write_timings(run%log, s%timers, seconds, s%step, s%bodies%n_all)
         call write_spread(run, run%log)
         call write_counters(run%log, counters)
         if (s%settings%output%ledger) call write_books(s, run%log)
         call sum_up(run%watch, s, run%log)
      end associate
      if (allocated(error)) call run%log%write_line('stopped: '//status)
      call write_hash(run%log, hexadecimal(hash))
      call run%log%close(late_error)
      if (.not. allocated(error) .and. allocated(late_error)) call move_alloc(late_error, error)
      call run%team%agree(error)
   end subroutine finish

   !> Write how the time of each stage is spread over processes; collective.
   subroutine write_spread(run, log)
      type(run_t), intent(inout) :: run
      type(log_t), intent(inout) :: log
      real(dp), allocatable :: total(:)
      integer(ip), allocatable :: counts(:)

      if (run%team%size == 1_ip) return
      call run%team%gather(run%simulation%timers%total, total, counts)
      call write_ranks(log, reshape(total, [n_stages, int(run%team%size)]))
   end subroutine write_spread

   !> Turn the intervals of frames and lines into steps.
   subroutine choose_intervals(run)
      !> The run; `frame_steps` and `log_steps` are set
      type(run_t), intent(inout) :: run

      associate (s => run%simulation, output => run%simulation%settings%output)
         run%frame_steps = in_steps(output%frame_interval, s%dt)
         run%log_steps = in_steps(output%log_interval, s%dt)
         if (run%log_steps == 0_lp) run%log_steps = max(1_lp, s%n_steps/default_lines)
         if (abs(real(run%frame_steps, wp)*s%dt - output%frame_interval) > 1.0e-2_wp*output%frame_interval) then
            call run%log%write_line('frames     every '//to_text(run%frame_steps)//' steps, '// &
                                    to_text(real(run%frame_steps, wp)*s%dt)//' s')
         end if
      end associate
   end subroutine choose_intervals

   !> Frames of a whole run
   pure integer(lp) function count_frames(simulation)
      !> The simulation
      type(simulation_t), intent(in) :: simulation
      integer(lp) :: interval

      associate (n => simulation%n_steps)
         interval = in_steps(simulation%settings%output%frame_interval, simulation%dt)
         if (interval == 0_lp) interval = n
         ! The last step has one in any case.
         count_frames = 1_lp + (n + interval - 1_lp)/interval
      end associate
   end function count_frames

   !> An interval in steps, at least one; 0 for none
   pure integer(lp) function in_steps(interval, dt)
      real(wp), intent(in) :: interval, dt

      in_steps = 0_lp
      if (interval > 0.0_wp) in_steps = max(1_lp, nint(min(interval/dt, 1.0e15_wp), lp))
   end function in_steps

   pure logical function is_due(step, interval)
      integer(lp), intent(in) :: step, interval

      is_due = step == 0_lp
      if (interval > 0_lp) is_due = mod(step, interval) == 0_lp
   end function is_due

end module polydem_run_output
