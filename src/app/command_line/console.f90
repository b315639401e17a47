!> Lines of the program on standard output, and its messages on standard error.
module polydem_console
   use polydem_errors, only: error_t
   use polydem_line_writer, only: line_writer_t
   use polydem_strings, only: printable
   implicit none
   private
   public :: print_line, warn

contains

   !> Write one or several lines to standard output.
   subroutine print_line(text, error)
      !> Lines
      character(len=*), intent(in) :: text
      type(error_t), allocatable, intent(inout) :: error
      type(line_writer_t) :: screen

      call screen%open_screen()
      call screen%put_line(text)
      call screen%close(error)
   end subroutine print_line

   !> Write a message to standard error. A no-op if the message is empty.
   subroutine warn(message)
      !> Message
      character(len=*), intent(in) :: message
      type(line_writer_t) :: screen
      type(error_t), allocatable :: ignored

      if (message == '') return
      call screen%open_screen(errors=.true.)
      call screen%put_line('polydem: '//printable(message, keeps_lines=.true.))
      call screen%close(ignored)
   end subroutine warn

end module polydem_console
