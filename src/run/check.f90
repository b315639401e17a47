!> The verb `check`: builds a simulation, describes it and reports its warnings, without running it.
module polydem_check
   use polydem_initial_warnings, only: warn_of_risks
   use polydem_description, only: describe, list_overlaps
   use polydem_errors, only: error_t
   use polydem_guard, only: respond_to_motion
   use polydem_host, only: resident_memory
   use polydem_kinds, only: lp, wp
   use polydem_log, only: log_t
   use polydem_monitor, only: check_step, new_monitor, monitor_t
   use polydem_output_intervals, only: count_frames
   use polydem_settings, only: settings_t
   use polydem_simulation, only: simulation_t
   use polydem_start, only: new_simulation
   use polydem_start_state, only: return_to_state
   use polydem_strings, only: counted, to_text
   use polydem_scene_measures, only: measure_scene, scene_measures_t
   use polydem_thread_choice, only: thread_choice_t
   use polydem_time_step, only: advance
   implicit none
   private
   public :: check_simulation

contains

   !> Build the scene and print the resolved settings, the models in use, sizes, masses, speeds, time step, memory and
   !> the warnings of a run at its start; the last line is the answer. A condition that stops a run at its first step is
   !> an error here, too.
   subroutine check_simulation(settings, error, oversubscription, threads)
      type(settings_t), intent(in) :: settings
      !> Allocated for bad input, or if a run stops at its first step
      type(error_t), allocatable, intent(inout) :: error
      !> Warning if the ranks have more threads than there are processors; none if absent or empty
      character(len=*), intent(in), optional :: oversubscription
      !> How the number of threads is determined; default: it is set already
      type(thread_choice_t), intent(inout), optional :: threads
      type(simulation_t) :: simulation
      type(scene_measures_t) :: measures
      type(log_t) :: log
      integer(lp) :: before, after, frames

      before = resident_memory()
      call new_simulation(settings, simulation, error, threads=threads)
      if (allocated(error)) return
      after = resident_memory()
      call log%open('', error)
      if (allocated(error)) return
      ! The log adds the last line end.
      call log%write_line(settings%resolved(:len(settings%resolved) - 1))
      call measure_scene(simulation, measures)
      call describe(simulation, measures, log)
      call list_overlaps(simulation, measures, '', log, error)
      if (present(oversubscription)) then
         if (oversubscription /= '') call log%write_line(oversubscription)
      end if
      call log%write_line('memory     '//to_text(after)//' KiB resident, including '//to_text(after - before)// &
                          ' KiB for the scene, boxes, pairs and contacts')
      frames = count_frames(simulation)
      call log%write_line('frames     '//to_text(frames)//' of '//to_text(frame_size(simulation)/1024_lp + 1_lp)// &
                          ' KiB each, '// &
                          to_text(real(frames, wp)*real(frame_size(simulation), wp)/1048576.0_wp, 3)//' MiB in total')
      call warn_at_start(simulation, measures, log, error)
      if (.not. allocated(error)) call log%write_line(answer(simulation, measures%free, log%warnings))
      call log%close(error)
   end subroutine check_simulation

   !> The last line: what would run, and whether something above it needs a look
   pure function answer(simulation, free, warnings) result(text)
      type(simulation_t), intent(in) :: simulation
      !> Number of free bodies, and of warnings
      integer(lp), intent(in) :: free, warnings
      character(len=:), allocatable :: text

      text = 'answer     this scene can run: '
      if (simulation%stages%number > 0) text = text//'at most '
      text = text//counted(simulation%n_steps, 'step')//' of '//to_text(free)//' free '// &
         trim(merge('body  ', 'bodies', free == 1_lp))//', '
      if (warnings == 0_lp) text = text//'no warnings'
      if (warnings > 0_lp) text = text//counted(warnings, 'warning')//' above'
   end function answer

   !> Write the warnings about the initial state, then apply the guards of a run at step 0, and do the first step: loads
   !> and gravity may make bodies too fast only then.
   subroutine warn_at_start(simulation, measures, log, error)
      type(simulation_t), intent(inout) :: simulation
      type(scene_measures_t), intent(in) :: measures
      type(log_t), intent(inout) :: log
      type(error_t), allocatable, intent(inout) :: error
      type(monitor_t) :: monitor

      call new_monitor(monitor, simulation)
      call warn_of_risks(simulation, measures, log, monitor%at_start)
      ! A body that is too fast at the start moves too far in the first step.
      call respond_to_motion(simulation, error)
      call check_step(monitor, simulation, .true., log, error)
      if (.not. allocated(error)) call return_to_state(simulation, error)
      if (.not. allocated(error)) call advance(simulation, error)
      if (.not. allocated(error)) call check_step(monitor, simulation, .false., log, error)
   end subroutine warn_at_start

   !> Size of a frame [B]: bodies, and the initial contacts if contacts are written
   pure integer(lp) function frame_size(simulation)
      type(simulation_t), intent(in) :: simulation

      frame_size = 48_lp*int(simulation%bodies%n, lp)
      if (simulation%settings%output%contacts) frame_size = frame_size + 72_lp*int(simulation%contacts%n, lp)
   end function frame_size

end module polydem_check
