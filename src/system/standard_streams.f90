!> Standard input, output and error of this process (POSIX).
module polydem_standard_streams
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_null_char
   implicit none
   private
   public :: open_closed_streams

   !> Descriptor of standard error, the last of the three
   integer(c_int), parameter :: standard_error = 2_c_int
   !> O_RDWR of open(2)
   integer(c_int), parameter :: read_and_write = 2_c_int

   interface
      !> POSIX open(2) of an existing file
      integer(c_int) function c_open(path, flags) bind(C, name='open')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value :: flags
      end function c_open

      !> POSIX close(2)
      integer(c_int) function c_close(descriptor) bind(C, name='close')
         import :: c_int
         integer(c_int), value :: descriptor
      end function c_close
   end interface

contains

   !> Open /dev/null for each of the three streams that is closed, as after `>&-`. Otherwise the next file gets the
   !> descriptor of standard output, and text for the screen is written into it. Call this before any file is opened.
   subroutine open_closed_streams()
      integer(c_int) :: descriptor, ignored

      descriptor = 0_c_int
      ! A new descriptor gets the lowest free number.
      do while (descriptor >= 0_c_int .and. descriptor <= standard_error)
         descriptor = c_open('/dev/null'//c_null_char, read_and_write)
      end do
      if (descriptor > standard_error) ignored = c_close(descriptor)
   end subroutine open_closed_streams

end module polydem_standard_streams
