!> Failures of the running test: asserts throw them, the runner collects them.
!>
!> The list is module state on purpose, and only here: an assert stands in any procedure of a test and must
!> reach the runner without an argument, as it does with pFUnit.
module funit_exceptions
   implicit none
   private
   public :: SourceLocation, throw, catch, anyExceptions, pending, clear

   !> Where an assert stands
   type :: SourceLocation
      !> Name of the .pf file
      character(len=64) :: file_name = '<unknown file>'
      !> Line in it
      integer :: line_number = -1
   end type SourceLocation

   !> A failure
   type :: exception_t
      !> What went wrong
      character(len=:), allocatable :: message
      !> Where, as a line of the report; empty if that is not known
      character(len=:), allocatable :: place
   end type exception_t

   !> Failures of the running test, the oldest first
   type(exception_t), allocatable, save :: exceptions(:)

contains

   !> Record a failure.
   subroutine throw(message, location)
      !> What went wrong
      character(len=*), intent(in) :: message
      !> Where
      type(SourceLocation), intent(in), optional :: location
      type(exception_t) :: new
      character(len=12) :: line

      new%message = message
      new%place = ''
      if (present(location)) then
         write (line, '(i0)') location%line_number
         new%place = '  Location: ['//trim(location%file_name)//':'//trim(line)//']'//new_line('a')
      end if
      if (.not. allocated(exceptions)) call clear()
      exceptions = [exceptions, new]
   end subroutine throw

   !> Whether a failure is pending
   logical function anyExceptions()
      anyExceptions = .false.
      if (allocated(exceptions)) anyExceptions = size(exceptions) > 0
   end function anyExceptions

   !> Whether a failure was pending: the newest, or the oldest with a given message; only that one is forgotten.
   logical function catch(message)
      !> Its exact message; any if absent
      character(len=*), intent(in), optional :: message
      integer :: k

      catch = anyExceptions()
      if (.not. catch) return
      k = size(exceptions)
      if (present(message)) then
         do k = 1, size(exceptions)
            if (exceptions(k)%message == message) exit
         end do
      end if
      catch = k <= size(exceptions)
      if (catch) exceptions = [exceptions(:k - 1), exceptions(k + 1:)]
   end function catch

   !> Text of all pending failures
   function pending() result(text)
      character(len=:), allocatable :: text
      integer :: k

      text = ''
      if (.not. anyExceptions()) return
      do k = 1, size(exceptions)
         if (k > 1) text = text//new_line('a')
         text = text//exceptions(k)%place//exceptions(k)%message
      end do
   end function pending

   !> Forget all failures.
   subroutine clear()
      if (allocated(exceptions)) deallocate (exceptions)
      allocate (exceptions(0))
   end subroutine clear

end module funit_exceptions
