!> What a run would do, without running it.
module polydem_check
   use polydem_description, only: describe, list_overlaps
   use polydem_errors, only: error_t
   use polydem_kinds, only: lp, wp
   use polydem_log, only: log_t
   use polydem_machine, only: resident_memory
   use polydem_settings, only: settings_t
   use polydem_simulation, only: check_stability, new_simulation, simulation_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: check_simulation

contains

   !> Build the scene, and print the settings in force, the parts in use, the bound of the step and the memory.
   subroutine check_simulation(settings, error)
      !> Checked settings
      type(settings_t), intent(in) :: settings
      !> Bad input
      type(error_t), allocatable, intent(inout) :: error
      type(simulation_t) :: simulation
      type(log_t) :: log
      character(len=:), allocatable :: warning
      real(wp) :: stable
      integer(lp) :: before, after

      before = resident_memory()
      call new_simulation(settings, simulation, error)
      if (allocated(error)) return
      after = resident_memory()
      call log%open('', error)
      if (allocated(error)) return
      call write_lines(log, settings%resolved)
      call describe(simulation, log)
      call list_overlaps(simulation, '', log, error)
      call check_stability(simulation, stable, warning, error)
      if (allocated(warning)) call log%write_line('warning: '//warning)
      call log%write_line('memory     '//to_text(after)//' KiB resident, of which '//to_text(after - before)// &
                          ' KiB for the scene, its boxes, pairs and contacts')
      call log%write_line('frames     '//to_text(48_lp*int(simulation%bodies%n, lp)/1024_lp + 1_lp)//' KiB each')
      call log%close(error)
   end subroutine check_simulation

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
