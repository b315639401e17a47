!> Output of a run: frames, lines of the log, and the profile and summary at the end.
module polydem_run_output
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use polydem_balance_values, only: name_terms
   use polydem_counters, only: counters_t
   use polydem_end_condition, only: condition_text, measure_condition, needs_for_stage => needs_contacts
   use polydem_energy_report, only: write_energy_report
   use polydem_errors, only: error_t, run_error
   use polydem_global_hash, only: hash_all_bodies
   use polydem_hash, only: hexadecimal
   use polydem_host, only: resident_memory
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_log, only: log_t
   use polydem_log_tables, only: write_counters, write_hash, write_ranks, write_timings
   use polydem_monitor, only: check_step, needs_contacts, report_pending_warnings, write_warning_counts
   use polydem_profile_file, only: write_profile
   use polydem_result_files, only: profile_name, series_name
   use polydem_run, only: run_t
   use polydem_series_csv, only: write_series_csv
   use polydem_series_row, only: collect_row
   use polydem_simulation, only: simulation_t, time_of, compute_balance
   use polydem_simulation_counters, only: count_contacts, report_counters
   use polydem_strings, only: to_text
   use polydem_time_step, only: tabulate_contacts
   use polydem_timers, only: n_stages
   use polydem_wall_forces, only: complete_wall_forces
   implicit none
   private
   public :: choose_intervals, count_frames, end_step, finish, frames_per_segment, needs_table, write_stage

   !> Limits of the automatic number of frames per segment, and of its product with the number of bodies
   integer(lp), parameter :: least_frames = 20_lp, most_frames = 200_lp, most_poses = 200000_lp

   !> Number of lines of the log if the settings give no interval
   real(dp), parameter :: default_lines = 20.0_dp

contains

   !> Check the guards, and write a frame and a line of the log if they are due; collective.
   subroutine end_step(run, error)
      type(run_t), intent(inout) :: run
      !> Allocated if the run must stop; the same on all ranks
      type(error_t), allocatable, intent(inout) :: error
      logical :: frame_due, line_due
      integer(ip) :: n_contacts

      associate (s => run%simulation)
         frame_due = is_due(s%step, s%n_steps, run%frame_steps)
         line_due = is_line_due(run, s%step)
         call check_step(run%monitor, s, line_due, run%log, error)
         if (allocated(error)) return
         if (s%stages%number > 0_ip) call measure_condition(s)
         if (frame_due .or. line_due) call update_balance(run)
         if (line_due) then
            call count_contacts(s, n_contacts)
            if (s%settings%output%energy_balance) then
               call run%log%write_interval(s%step, s%n_steps, time_of(s), s%dt, n_contacts, &
                                           [run%balance%kinetic, run%balance%potential])
            else
               call run%log%write_interval(s%step, s%n_steps, time_of(s), s%dt, n_contacts)
            end if
            if (s%stages%value >= 0.0_wp) call run%log%write_line('           '//condition_text(s))
         end if
         call record_row(run)
         if (frame_due) call write_frame(run, error)
         if (s%stages%number == 0_ip) then
            call run%log%show_progress(s%step, s%n_steps)
         else
            call run%log%show_progress(s%step, s%n_steps, s%settings%stage(s%stages%number)%name)
         end if
      end associate
   end subroutine end_step

   !> Whether output or the monitor needs the table of contacts of the next step
   pure logical function needs_table(run)
      type(run_t), intent(in) :: run

      associate (s => run%simulation)
         needs_table = s%settings%output%contacts .and. is_due(s%step + 1_lp, s%n_steps, run%frame_steps)
         if (run%series_steps > 0.0_dp) needs_table = needs_table .or. &
            is_due(s%step + 1_lp, s%n_steps, run%series_steps)
         if (s%stages%number > 0_ip) needs_table = needs_table .or. needs_for_stage(s, s%step + 1_lp)
         needs_table = needs_table .or. needs_contacts(run%monitor, s%step + 1_lp, is_line_due(run, s%step + 1_lp))
      end associate
   end function needs_table

   !> Whether the log gets a line after a step
   pure logical function is_line_due(run, step)
      type(run_t), intent(in) :: run
      integer(lp), intent(in) :: step

      is_line_due = is_due(step, run%simulation%n_steps, run%log_steps)
      associate (stages => run%simulation%stages)
         if (stages%number == 0_ip .or. run%simulation%settings%output%log_interval > 0.0_wp) return
         ! As many lines in each stage
         is_line_due = is_due(step - stages%first(stages%number), stages%last - stages%first(stages%number), &
                              max(1.0_dp, real(stages%last - stages%first(stages%number), dp)/default_lines))
      end associate
   end function is_line_due

   !> Write which stage begins or goes on, what changes in it, and what ends it.
   subroutine write_stage(run)
      !> The run at the start of a stage, or after a restart
      type(run_t), intent(inout) :: run
      character(len=:), allocatable :: text

      associate (s => run%simulation, number => run%simulation%stages%number)
         if (number == 0_ip) return
         associate (stage => s%settings%stage(number), gravity => s%settings%forces%gravity)
            text = 'stage      '//stage%name//', '//to_text(number)//' of '// &
               to_text(size(s%settings%stage, kind=ip))//', from step '//to_text(s%stages%first(number))
            if (stage%until == 'duration') text = text//' for '//to_text(stage%duration)//' s'
            if (stage%until /= 'duration') text = text//' until '//trim(stage%until)//' is '// &
               trim(merge('above', 'below', stage%above > 0.0_wp))//' '//to_text(max(stage%above, stage%below), 4)// &
               ', at most '//to_text(stage%longest)//' s'
            if (size(stage%gravity) == 2) text = text//', gravity '//to_text(gravity(1), 3)//', '// &
               to_text(gravity(2), 3)//' m/s2'
            if (abs(stage%friction_scale - 1.0_wp) > 0.0_wp) text = text//', friction times '// &
               to_text(stage%friction_scale, 3)
            if (stage%drag > 0.0_wp) text = text//', drag '//to_text(s%settings%forces%drag, 3)//' 1/s'
         end associate
      end associate
      call run%log%write_line(text)
   end subroutine write_stage

   !> Evaluate the energy and momentum balance of this step if output.energy_balance is on; collective.
   subroutine update_balance(run)
      type(run_t), intent(inout) :: run

      if (.not. run%simulation%settings%output%energy_balance) return
      call compute_balance(run%simulation, run%balance)
      call name_terms(run%balance, .not. run%simulation%bodies%cell%is_periodic, run%row)
   end subroutine update_balance

   !> Keep a row of the series if one is due, unless a file of an earlier attempt has it; collective.
   subroutine record_row(run)
      type(run_t), intent(inout) :: run

      associate (s => run%simulation)
         if (.not. run%series_steps > 0.0_dp .or. s%step <= run%earlier%last_frame) return
         if (.not. is_due(s%step, s%n_steps, run%series_steps)) return
         call collect_row(s)
         call s%series%keep_row(s%step, real(time_of(s), dp))
      end associate
   end subroutine record_row

   !> Write a frame, unless an earlier attempt wrote it; collective.
   subroutine write_frame(run, error)
      type(run_t), intent(inout) :: run
      type(error_t), allocatable, intent(inout) :: error

      if (run%simulation%step <= run%earlier%last_frame) return
      associate (s => run%simulation, output => run%simulation%settings%output)
         call complete_wall_forces(run%comm, s%loop%walls, s%bodies)
         if (allocated(s%traffic)) then
            call s%traffic%departures%drop_rows(run%earlier%last_frame)
            if (output%contacts) then
               call run%trajectory%write_frame(s%step, time_of(s), s%bodies, error, s%contacts, run%row, &
                                               run%manifest, s%series, s%traffic%departures)
            else
               call run%trajectory%write_frame(s%step, time_of(s), s%bodies, error, row=run%row, &
                                               manifest=run%manifest, series=s%series, &
                                               departures=s%traffic%departures)
            end if
            run%last_frame = s%step
            return
         end if
         ! The row has no entries if the run computes no energy balance.
         if (output%contacts) then
            call run%trajectory%write_frame(s%step, time_of(s), s%bodies, error, s%contacts, run%row, run%manifest, &
                                            s%series)
         else
            call run%trajectory%write_frame(s%step, time_of(s), s%bodies, error, row=run%row, manifest=run%manifest, &
                                            series=s%series)
         end if
         run%last_frame = s%step
      end associate
   end subroutine write_frame

   !> After a numerical failure, write the state at which the run stopped as a last frame, unless the state of a body is
   !> not finite; collective.
   subroutine write_last_frame(run, code, error)
      type(run_t), intent(inout) :: run
      !> Exit code of the failure
      integer, intent(in) :: code
      type(error_t), allocatable, intent(inout) :: error
      integer(lp) :: is_not_finite(1)

      associate (s => run%simulation, bodies => run%simulation%bodies)
         if (code /= run_error .or. run%last_frame == s%step) return
         is_not_finite = merge(0_lp, 1_lp, all(ieee_is_finite(bodies%position)) &
                               .and. all(ieee_is_finite(bodies%velocity)) .and. all(ieee_is_finite(bodies%angle)) &
                               .and. all(ieee_is_finite(bodies%angular_velocity)))
         call run%comm%all_reduce_max(is_not_finite)
         if (is_not_finite(1) == 1_lp) return
         call update_balance(run)
         call tabulate_contacts(s)
      end associate
      call write_frame(run, error)
   end subroutine write_last_frame

   !> End a run, also after a failure: close the trajectory, write the profile and the summary of the log; collective.
   subroutine finish(run, seconds, error)
      type(run_t), intent(inout) :: run
      !> Elapsed time of all attempts [s]
      real(dp), intent(in) :: seconds
      !> On entry the reason why the run did not finish; on return that, or a failure to write the end
      type(error_t), allocatable, intent(inout) :: error
      type(error_t), allocatable :: write_error
      type(counters_t) :: counters
      character(len=:), allocatable :: status
      integer(lp) :: hash, memory

      memory = resident_memory()
      status = 'finished'
      if (allocated(error)) status = error%message
      associate (s => run%simulation)
         call hash_all_bodies(run%comm, s%bodies, hash)
         call report_counters(s, counters)
         call report_pending_warnings(run%monitor, s, run%log)
         if (allocated(error)) call write_last_frame(run, error%code, write_error)
         call run%trajectory%close(write_error, run%manifest)
         if (s%settings%output%csv .and. run%comm%is_root()) call write_csv(run, write_error)
         call run%recorder%close(run%log, run%manifest, write_error)
         call run%checkpoints%close(run%log)
         call write_timings(run%log, s%timers, seconds, s%step, s%bodies%n_all)
         call write_rank_times(run, run%log)
         call write_counters(run%log, counters)
         if (s%settings%output%energy_balance) call write_energy_report(s, run%log)
         call write_warning_counts(run%monitor, run%log)
         if (allocated(error)) call run%log%write_line('stopped: '//status)
         call write_hash(run%log, hexadecimal(hash))
         ! The profile comes last: a result with a profile has the whole log.
         if (run%comm%is_root()) call write_profile(run%folder, s%timers, seconds, counters, run%provenance, hash, &
                                                  status, write_error, memory)
         call run%manifest%close_file(run%folder//'/'//profile_name, write_error)
      end associate
      call run%log%close(write_error)
      if (.not. allocated(error) .and. allocated(write_error)) call move_alloc(write_error, error)
      call run%comm%all_reduce_error(error)
   end subroutine finish

   !> Write the series as comma-separated values. Called by the root rank only.
   subroutine write_csv(run, error)
      type(run_t), intent(inout) :: run
      type(error_t), allocatable, intent(inout) :: error

      if (allocated(error)) return
      call run%manifest%reopen(run%folder//'/'//series_name, error)
      call write_series_csv(run%folder//'/'//series_name, run%folder, run%trajectory%number, &
                            run%simulation%series%row, error)
      call run%manifest%close_file(run%folder//'/'//series_name, error)
   end subroutine write_csv

   !> Write the distribution of the time of each stage over the ranks; collective.
   subroutine write_rank_times(run, log)
      type(run_t), intent(inout) :: run
      type(log_t), intent(inout) :: log
      real(dp), allocatable :: total(:)
      integer(ip), allocatable :: counts(:)

      if (run%comm%size == 1_ip) return
      call run%comm%gather(run%simulation%timers%total, total, counts)
      call write_ranks(log, reshape(total, [n_stages, int(run%comm%size)]))
   end subroutine write_rank_times

   !> Convert the intervals of frames and log lines to steps.
   subroutine choose_intervals(run)
      !> The run; `frame_steps`, `log_steps` and `series_steps` are set
      type(run_t), intent(inout) :: run
      real(dp) :: deviation

      associate (s => run%simulation, output => run%simulation%settings%output)
         run%frame_steps = in_steps(output%frame_interval, s%dt)
         run%log_steps = in_steps(output%log_interval, s%dt)
         run%series_steps = in_steps(output%series_interval, s%dt)
         if (.not. run%log_steps > 0.0_dp) run%log_steps = max(1.0_dp, real(s%n_steps, dp)/default_lines)
         deviation = abs(run%frame_steps - anint(run%frame_steps))
         if (real(output%frame_interval, dp) < real(s%dt, dp)*(1.0_dp - 1.0e-6_dp) .and. run%frame_steps > 0.0_dp) then
            call run%log%write_line('frames     every step, since frame_interval is less than dt')
         else if (deviation > 1.0e-6_dp*run%frame_steps) then
            call run%log%write_line('frames     at the step nearest to each multiple of '// &
                                    to_text(output%frame_interval)//' s, '//to_text(real(run%frame_steps, wp))// &
                                    ' steps')
         end if
      end associate
   end subroutine choose_intervals

   !> Number of frames of a complete run
   pure integer(lp) function count_frames(simulation)
      type(simulation_t), intent(in) :: simulation
      real(dp) :: interval

      associate (n => simulation%n_steps)
         interval = in_steps(simulation%settings%output%frame_interval, simulation%dt)
         ! The first and the last step always have a frame.
         count_frames = 2_lp
         if (interval > 0.0_dp) count_frames = 1_lp + max(1_lp, ceiling(last_multiple(n)/interval, lp))
      end associate
   end function count_frames

   !> Number of frames per segment. Segments of few bodies have many frames, since each has all constant data; all
   !> segments of a complete run have about as many.
   pure integer(ip) function frames_per_segment(simulation)
      type(simulation_t), intent(in) :: simulation
      integer(lp) :: most, total

      frames_per_segment = simulation%settings%output%frames_per_segment
      if (frames_per_segment > 0_ip) return
      most = max(least_frames, min(most_frames, most_poses/max(1_lp, int(simulation%bodies%n_all, lp))))
      total = count_frames(simulation)
      ! The number of segments is the quotient rounded up.
      frames_per_segment = int(min(most, 1_lp + (total - 1_lp)/(1_lp + (total - 1_lp)/most)), ip)
   end function frames_per_segment

   !> An interval in steps, at least one; 0: no interval
   pure real(dp) function in_steps(interval, dt)
      real(wp), intent(in) :: interval, dt

      in_steps = 0.0_dp
      if (interval > 0.0_wp) in_steps = max(1.0_dp, min(real(interval, dp)/real(dt, dp), 1.0e15_dp))
   end function in_steps

   !> Whether a step is the first one, the last one, or the nearest to a multiple of the interval. It deviates from the
   !> multiple by half a step at most. A multiple within half a step of the end belongs to the last step.
   pure logical function is_due(step, n_steps, interval)
      !> The step, and the last step
      integer(lp), intent(in) :: step, n_steps
      !> Steps between two multiples, at least one; 0: none
      real(dp), intent(in) :: interval
      real(dp) :: multiple

      is_due = step == 0_lp .or. step == n_steps
      if (is_due .or. .not. interval > 0.0_dp) return
      multiple = anint(real(step, dp)/interval)*interval
      is_due = nint(multiple, lp) == step .and. multiple < last_multiple(n_steps)
   end function is_due

   !> Multiples of an interval from here on belong to the last step. Rounding does not separate a multiple from the end.
   pure real(dp) function last_multiple(n_steps)
      integer(lp), intent(in) :: n_steps

      last_multiple = real(n_steps, dp)*(1.0_dp - 1.0e-9_dp) - 0.5_dp
   end function last_multiple

end module polydem_run_output
