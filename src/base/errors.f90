!> Errors as values: an allocated `error_t` means failure. Only the main program stops.
!>
!> In a procedure that fails:   call raise(error, input_error, 'drum.nml:7: dt must be positive'); return
!> After a call:                call read(..., error); if (allocated(error)) return
module polydem_errors
   use polydem_kinds, only: lp
   implicit none
   private
   public :: error_t, raise, raise_unread, run_error, input_error, io_error, stopped_early

   !> Exit code of a run that failed numerically or at run time
   integer, parameter :: run_error = 1
   !> Exit code of bad input: namelist, bodies file, trace, command line
   integer, parameter :: input_error = 2
   !> Exit code if a file or folder cannot be read or written
   integer, parameter :: io_error = 3
   !> Exit code of a run that was interrupted and can be resumed from a checkpoint (EX_TEMPFAIL of sysexits)
   integer, parameter :: stopped_early = 75

   !> A failure
   type :: error_t
      !> Exit code: run_error, input_error, io_error or stopped_early
      integer :: code = run_error
      !> Message: where (file and line, or body, position and step), what is wrong, and what to do
      character(len=:), allocatable :: message
      !> Priority among ranks that fail in the same step: the error with the smallest place is reported. If the place is
      !> the global index of the body or pair, a parallel run reports the same error as a serial run.
      integer(lp) :: place = huge(0_lp)
      !> Whether the system refused to read a file: nothing is known of its contents, which may be good
      logical :: is_unread = .false.
   end type error_t

contains

   !> Report a failure. An error that is already allocated is kept.
   pure subroutine raise(error, code, message)
      type(error_t), allocatable, intent(inout) :: error
      !> run_error, input_error, io_error or stopped_early
      integer, intent(in) :: code
      !> Message: where, what is wrong, and what to do
      character(len=*), intent(in) :: message

      if (allocated(error)) return
      allocate (error)
      error%code = code
      error%message = message
   end subroutine raise

   !> Report that the system refused to read a file. An error that is already allocated is kept.
   pure subroutine raise_unread(error, path, cause)
      type(error_t), allocatable, intent(inout) :: error
      !> Path of the file
      character(len=*), intent(in) :: path
      !> Error message of the system
      character(len=*), intent(in) :: cause

      if (allocated(error)) return
      call raise(error, io_error, path//': cannot be read: '//trim(cause))
      error%is_unread = .true.
   end subroutine raise_unread

end module polydem_errors
