!> Errors as values: an allocated `error_t` means failure, and only the program itself stops.
!>
!> Use in a procedure:      call raise(error, input_error, 'drum.nml:7: dt must be positive'); return
!> Use at the call:         call read(..., error); if (allocated(error)) return
module polydem_errors
   use polydem_kinds, only: lp
   implicit none
   private
   public :: error_t, raise, run_error, input_error, io_error, stopped_early

   !> Exit code of a run that failed numerically or at run time
   integer, parameter :: run_error = 1
   !> Exit code of bad input: namelist, bodies file, trace, command line
   integer, parameter :: input_error = 2
   !> Exit code of files and folders that cannot be read or written
   integer, parameter :: io_error = 3
   !> Exit code of a run that was asked to end before its time and can go on from a checkpoint (EX_TEMPFAIL of sysexits)
   integer, parameter :: stopped_early = 75

   !> What went wrong
   type :: error_t
      !> Exit code: run_error, input_error, io_error or stopped_early
      integer :: code = run_error
      !> What is wrong, where (file and line, or body, position and step), and what to do
      character(len=:), allocatable :: message
      !> Of several processes that fail in the same step, the one with the least place speaks; that of the body or pair
      !> among all of the run makes it the one that a single process would name
      integer(lp) :: place = huge(0_lp)
   end type error_t

contains

   !> Report a failure; the first one stands if `error` is already allocated.
   pure subroutine raise(error, code, message)
      !> Error to allocate
      type(error_t), allocatable, intent(inout) :: error
      !> run_error, input_error, io_error or stopped_early
      integer, intent(in) :: code
      !> What is wrong, where, and what to do
      character(len=*), intent(in) :: message

      if (allocated(error)) return
      allocate (error)
      error%code = code
      error%message = message
   end subroutine raise

end module polydem_errors
