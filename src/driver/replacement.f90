!> What becomes of the result that a run with `--force` replaces: it goes when the run has a frame, and comes back if
!> the run fails before.
module polydem_replacement
   use polydem_errors, only: error_t
   use polydem_log, only: log_t
   use polydem_replaced, only: drop_replaced, recover, replaced_name
   use polydem_run_output, only: run_t
   implicit none
   private
   public :: give_up_replaced, say, undo_replacement

contains

   !> Remove the result that this one replaces, now that it has a frame; collective.
   subroutine give_up_replaced(run, error)
      !> The run
      type(run_t), intent(inout) :: run
      !> Allocated if it cannot be removed; the same on all processes
      type(error_t), allocatable, intent(inout) :: error

      if (run%manifest%owns(replaced_name)) then
         call run%trajectory%bring_to_disk(error)
         if (.not. allocated(error)) call drop_replaced(run%manifest, run%folder, error)
      end if
      call run%team%agree(error)
   end subroutine give_up_replaced

   !> Put a result back that a run was to replace, if the run failed before it got over its first frame.
   subroutine undo_replacement(folder)
      !> Folder of the result, which is locked
      character(len=*), intent(in) :: folder
      character(len=:), allocatable :: note
      type(error_t), allocatable :: ignored

      call recover(folder, note, ignored)
      if (allocated(note)) call say(note)
   end subroutine undo_replacement

   !> Write a line on the screen.
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
