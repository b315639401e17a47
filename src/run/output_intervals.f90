!> When a run writes frames, rows of the series and lines of the log.
module polydem_output_intervals
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_run, only: run_t
   use polydem_simulation, only: simulation_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: choose_intervals, count_frames, frames_per_segment, is_due, is_line_due

   !> Limits of the automatic number of frames per segment, and of its product with the number of bodies
   integer(lp), parameter :: least_frames = 20_lp, most_frames = 200_lp, most_poses = 200000_lp

   !> Number of lines of the log if the settings give no interval
   real(dp), parameter :: default_lines = 20.0_dp

contains

   !> Whether the log gets a line after a step
   pure logical function is_line_due(run, step)
      type(run_t), intent(in) :: run
      !> The step
      integer(lp), intent(in) :: step

      is_line_due = is_due(step, run%simulation%n_steps, run%log_steps)
      associate (stages => run%simulation%stages)
         if (stages%number == 0_ip .or. run%simulation%settings%output%log_interval > 0.0_wp) return
         ! As many lines in each stage
         is_line_due = is_due(step - stages%first(stages%number), stages%last - stages%first(stages%number), &
                              max(1.0_dp, real(stages%last - stages%first(stages%number), dp)/default_lines))
      end associate
   end function is_line_due

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

end module polydem_output_intervals
