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

   character(len=:), allocatable, save :: messages
   integer, save :: n_messages = 0

contains

   !> Record a failure.
   subroutine throw(message, location)
      !> What went wrong
      character(len=*), intent(in) :: message
      !> Where
      type(SourceLocation), intent(in), optional :: location
      character(len=12) :: line

      if (.not. allocated(messages)) messages = ''
      if (n_messages > 0) messages = messages//new_line('a')
      n_messages = n_messages + 1
      if (present(location)) then
         write (line, '(i0)') location%line_number
         messages = messages//'  Location: ['//trim(location%file_name)//':'//trim(line)//']'//new_line('a')
      end if
      messages = messages//message
   end subroutine throw

   !> Whether a failure is pending
   logical function anyExceptions()
      anyExceptions = n_messages > 0
   end function anyExceptions

   !> Whether a failure was pending, which is forgotten
   logical function catch(message)
      !> Its exact message; any if absent
      character(len=*), intent(in), optional :: message

      catch = n_messages > 0
      if (catch .and. present(message)) catch = messages == message
      if (catch) call clear()
   end function catch

   !> Text of all pending failures
   function pending() result(text)
      character(len=:), allocatable :: text

      text = ''
      if (n_messages > 0) text = messages
   end function pending

   !> Forget all failures.
   subroutine clear()
      messages = ''
      n_messages = 0
   end subroutine clear

end module funit_exceptions
