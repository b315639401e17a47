!> The result that a run with `--force` replaces: the run removes it after its own first frame, and restores it if it
!> fails earlier.
module polydem_replacement
   use polydem_errors, only: error_t
   use polydem_log, only: log_t
   use polydem_replaced_result, only: drop_replaced, recover, replaced_name
   use polydem_run, only: run_t
   implicit none
   private
   public :: remove_replaced, say, restore_replaced

contains

   !> Remove the replaced result after the first frame of this run; collective.
   subroutine remove_replaced(run, error)
      type(run_t), intent(inout) :: run
      !> Allocated on all ranks if it cannot be removed
      type(error_t), allocatable, intent(inout) :: error

      if (run%manifest%owns(replaced_name)) then
         call run%trajectory%flush_to_disk(error)
         if (.not. allocated(error)) call drop_replaced(run%manifest, run%folder, error)
      end if
      call run%comm%all_reduce_error(error)
   end subroutine remove_replaced

   !> Restore the replaced result if the run failed before its first frame was on disk.
   subroutine restore_replaced(folder)
      !> Result folder; this run holds its lock
      character(len=*), intent(in) :: folder
      character(len=:), allocatable :: note
      type(error_t), allocatable :: ignored

      call recover(folder, note, ignored)
      if (allocated(note)) call say(note)
   end subroutine restore_replaced

   !> Write a line to the screen.
   subroutine say(line)
      !> The line
      character(len=*), intent(in) :: line
      type(log_t) :: log
      type(error_t), allocatable :: ignored

      call log%open('', ignored)
      call log%write_line(line)
      call log%close()
   end subroutine say

end module polydem_replacement
