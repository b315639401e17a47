!> Output of a run: frames, rows of the series and lines of the log.
module polydem_run_output
   use polydem_balance_values, only: name_terms
   use polydem_body_works, only: find_body_works
   use polydem_end_condition, only: condition_text, measure_condition, needs_for_stage => needs_contacts
   use polydem_end_warnings, only: warn_of_end
   use polydem_errors, only: error_t
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_monitor, only: check_step, needs_contacts
   use polydem_output_intervals, only: is_due, is_line_due
   use polydem_run, only: run_t
   use polydem_sample_columns, only: sample_text
   use polydem_series_row, only: collect_row
   use polydem_simulation, only: time_of, compute_balance
   use polydem_simulation_counters, only: count_contacts
   use polydem_strings, only: to_text
   use polydem_wall_forces, only: complete_wall_forces
   implicit none
   private
   public :: end_step, needs_table, write_stage, update_balance, write_frame

contains

   !> Check the guards, and write a frame and a line of the log if they are due; collective.
   subroutine end_step(run, error)
      type(run_t), intent(inout) :: run
      !> Allocated if the run must stop; the same on all ranks
      type(error_t), allocatable, intent(inout) :: error
      logical :: frame_due, line_due
      integer(ip) :: n_contacts
      character(len=:), allocatable :: text

      associate (s => run%simulation)
         frame_due = is_due(s%step, s%n_steps, run%frame_steps)
         line_due = is_line_due(run, s%step)
         call check_step(run%monitor, s, line_due, run%log, error)
         if (allocated(error)) return
         if (s%stages%number > 0_ip) call measure_condition(s)
         if (frame_due .or. line_due) call update_balance(run)
         if (line_due) then
            call count_contacts(s%comm, s%loop%n_contacts, n_contacts)
            if (s%settings%output%energy_balance) then
               call run%log%write_interval(s%step, s%n_steps, time_of(s), s%dt, n_contacts, &
                                           [run%balance%kinetic, run%balance%potential])
            else
               call run%log%write_interval(s%step, s%n_steps, time_of(s), s%dt, n_contacts)
            end if
            if (s%stages%value >= 0.0_wp) call run%log%write_line('           '//condition_text(s))
            if (run%series_steps > 0.0_dp) then
               call sample_text(s, text)
               call run%log%write_line(text)
            end if
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
         needs_table = run%options%tabulates
         needs_table = needs_table .or. s%settings%output%contacts .and. &
            is_due(s%step + 1_lp, s%n_steps, run%frame_steps)
         if (run%series_steps > 0.0_dp) needs_table = needs_table .or. &
            is_due(s%step + 1_lp, s%n_steps, run%series_steps) .or. is_line_due(run, s%step + 1_lp)
         if (s%stages%number > 0_ip) needs_table = needs_table .or. needs_for_stage(s, s%step + 1_lp)
         needs_table = needs_table .or. needs_contacts(s, s%step + 1_lp, is_line_due(run, s%step + 1_lp))
      end associate
   end function needs_table

   !> Write which stage begins or goes on, what changes in it, and what ends it.
   subroutine write_stage(run)
      !> The run at the start of a stage, or after a restart
      type(run_t), intent(inout) :: run
      character(len=:), allocatable :: text

      associate (s => run%simulation, number => run%simulation%stages%number)
         if (number == 0_ip) return
         associate (stage => s%settings%stage(number), gravity => s%forces%gravity)
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
            if (stage%drag > 0.0_wp) text = text//', drag '//to_text(s%forces%drag, 3)//' 1/s'
         end associate
      end associate
      call run%log%write_line(text)
      associate (s => run%simulation, number => run%simulation%stages%number)
         if (number > 1_ip .and. s%step == s%stages%first(number)) &
            call warn_of_end(s, number - 1_ip, s%step - s%stages%first(number - 1_ip), run%log)
      end associate
   end subroutine write_stage

   !> Evaluate the energy and momentum balance of this step if output.energy_balance is on; collective.
   subroutine update_balance(run)
      !> The run; `balance` and `row` are set
      type(run_t), intent(inout) :: run

      if (.not. run%simulation%settings%output%energy_balance) return
      call compute_balance(run%simulation, run%balance)
      call name_terms(run%balance, .not. run%simulation%bodies%cell%is_periodic, run%row)
   end subroutine update_balance

   !> Keep a row of the series if one is due, unless a file of a previous start has it; collective.
   subroutine record_row(run)
      type(run_t), intent(inout) :: run

      associate (s => run%simulation)
         if (.not. run%series_steps > 0.0_dp .or. s%step <= run%previous%last_frame) return
         if (.not. is_due(s%step, s%n_steps, run%series_steps)) return
         call collect_row(s)
         call s%series%keep_row(s%step, real(time_of(s), dp))
      end associate
   end subroutine record_row

   !> Write a frame, unless this or a previous start wrote it; collective.
   subroutine write_frame(run, error)
      type(run_t), intent(inout) :: run
      !> Allocated if it cannot be written
      type(error_t), allocatable, intent(inout) :: error

      if (run%simulation%step <= max(run%last_frame, run%previous%last_frame)) return
      if (.not. run%options%has_files) return
      associate (s => run%simulation, output => run%simulation%settings%output)
         if (output%body_works) call find_body_works(s%energy_balance, s%dt, s%forces%gravity, s%loop%force_sums, &
                                                     s%loop%walls, s%bodies)
         call complete_wall_forces(run%comm, s%search%neighbours%pairs%first, s%loop%walls, s%bodies)
         if (allocated(s%sources_and_sinks)) then
            call s%sources_and_sinks%departures%drop_rows(run%previous%last_frame)
            if (output%contacts) then
               call run%trajectory%write_frame(s%step, time_of(s), s%bodies, error, s%contacts, run%row, &
                                               run%manifest, s%series, s%sources_and_sinks%departures)
            else
               call run%trajectory%write_frame(s%step, time_of(s), s%bodies, error, row=run%row, &
                                               manifest=run%manifest, series=s%series, &
                                               departures=s%sources_and_sinks%departures)
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

end module polydem_run_output
