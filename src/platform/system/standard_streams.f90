!> Standard input, output and error of this process (POSIX).
module polydem_standard_streams
   use, intrinsic :: iso_c_binding, only: c_int, c_null_char
   use polydem_posix, only: c_close, c_open, read_and_write, standard_error
   implicit none
   private
   public :: open_closed_streams

contains

   !> Open /dev/null for each of the three streams that is closed, as after `>&-`. Otherwise the next file gets the
   !> descriptor of standard output, and text for the screen is written into it. Call this before any file is opened.
   subroutine open_closed_streams()
      integer(c_int) :: descriptor, ignored

      descriptor = 0_c_int
      ! A new descriptor gets the lowest free number; that of standard error is the last of the three.
      do while (descriptor >= 0_c_int .and. descriptor <= standard_error)
         descriptor = c_open('/dev/null'//c_null_char, read_and_write, 0_c_int)
      end do
      if (descriptor > standard_error) ignored = c_close(descriptor)
   end subroutine open_closed_streams

end module polydem_standard_streams
