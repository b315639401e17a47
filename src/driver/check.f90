!> What a run would do, without running it.
module polydem_check
   use polydem_dangers, only: warn_of_dangers
   use polydem_description, only: describe, list_overlaps
   use polydem_errors, only: error_t
   use polydem_guards, only: check_motion
   use polydem_kinds, only: lp, wp
   use polydem_log, only: log_t
   use polydem_machine, only: resident_memory
   use polydem_run_output, only: count_frames
   use polydem_settings, only: settings_t
   use polydem_simulation, only: new_simulation, simulation_t
   use polydem_strings, only: to_text
   use polydem_watch, only: look, new_watch, tell_pending, watch_t
   implicit none
   private
   public :: check_simulation

contains

   !> Build the scene, and print the settings in force, the parts in use, sizes, masses, speeds and steps, the memory,
   !> and the warnings with which a run would begin. What would stop a run at once is an error here, too.
   subroutine check_simulation(settings, error, crowding)
      !> Checked settings
      type(settings_t), intent(in) :: settings
      !> Bad input, or what would stop a run at its first step
      type(error_t), allocatable, intent(inout) :: error
      !> A warning if processes have more threads than processors; none if absent or empty
      character(len=*), intent(in), optional :: crowding
      type(simulation_t) :: simulation
      type(log_t) :: log
      integer(lp) :: before, after, frames

      before = resident_memory()
      call new_simulation(settings, simulation, error)
      if (allocated(error)) return
      after = resident_memory()
      call log%open('', error)
      if (allocated(error)) return
      call write_lines(log, settings%resolved)
      call describe(simulation, log)
      call list_overlaps(simulation, '', log, error)
      if (present(crowding)) then
         if (crowding /= '') call log%write_line(crowding)
      end if
      call log%write_line('memory     '//to_text(after)//' KiB resident, of which '//to_text(after - before)// &
                          ' KiB for the scene, its boxes, pairs and contacts')
      frames = count_frames(simulation)
      call log%write_line('frames     '//to_text(frames)//' of '//to_text(frame_size(simulation)/1024_lp + 1_lp)// &
                          ' KiB each, '// &
                          to_text(real(frames, wp)*real(frame_size(simulation), wp)/1048576.0_wp, 3)//' MiB in all')
      call warn_at_start(simulation, log, error)
      call log%close(error)
   end subroutine check_simulation

   !> Write what is dangerous about the scene, and look at it as a run does before and after its first step.
   subroutine warn_at_start(simulation, log, error)
      type(simulation_t), intent(inout) :: simulation
      type(log_t), intent(inout) :: log
      type(error_t), allocatable, intent(inout) :: error
      type(watch_t) :: watch

      call new_watch(watch, simulation)
      call warn_of_dangers(simulation, log, watch%at_start)
      call look(watch, simulation, .true., log, error)
      if (allocated(error)) return
      ! What moves too far at the start still does so in the first step.
      call check_motion(simulation%guard, simulation%bodies, simulation%step, simulation%dt, error)
      call tell_pending(watch, simulation, log)
   end subroutine warn_at_start

   !> Bytes of a frame: bodies, and the contacts that there are at the start if they are written
   pure integer(lp) function frame_size(simulation)
      type(simulation_t), intent(in) :: simulation

      frame_size = 48_lp*int(simulation%bodies%n, lp)
      if (simulation%settings%output%contacts) frame_size = frame_size + 72_lp*int(simulation%contacts%n, lp)
   end function frame_size

   subroutine write_lines(log, text)
      type(log_t), intent(inout) :: log
      character(len=*), intent(in) :: text
      integer :: first, length

      first = 1
      do while (first <= len(text))
         length = index(text(first:), new_line('a')) - 1
         if (length < 0) length = len(text) - first + 1
         call log%write_line(text(first:first + length - 1))
         first = first + length + 1
      end do
   end subroutine write_lines

end module polydem_check
