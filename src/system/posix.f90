!> C library functions that several modules of this room call.
module polydem_posix
   use, intrinsic :: iso_c_binding, only: c_char, c_f_pointer, c_int, c_ptr, c_size_t
   implicit none
   private
   public :: c_open, c_write, c_close, c_strlen, c_free, error_number

   interface
      !> open(2): a descriptor, or -1
      integer(c_int) function c_open(path, flags, mode) bind(C, name='open')
         import :: c_char, c_int
         !> Path, null-terminated
         character(kind=c_char), intent(in) :: path(*)
         !> Flags, and the permissions of a file that is created
         integer(c_int), value :: flags, mode
      end function c_open

      !> write(2): number of bytes written, or -1
      integer(c_size_t) function c_write(descriptor, bytes, length) bind(C, name='write')
         import :: c_int, c_ptr, c_size_t
         integer(c_int), value :: descriptor
         !> Address of the bytes
         type(c_ptr), value :: bytes
         !> Their number
         integer(c_size_t), value :: length
      end function c_write

      !> close(2): 0, or -1
      integer(c_int) function c_close(descriptor) bind(C, name='close')
         import :: c_int
         integer(c_int), value :: descriptor
      end function c_close

      !> Address of errno
      type(c_ptr) function errno_location() bind(C, name='__errno_location')
         import :: c_ptr
      end function errno_location

      !> strlen(3): length of a null-terminated text
      integer(c_size_t) function c_strlen(text) bind(C, name='strlen')
         import :: c_ptr, c_size_t
         type(c_ptr), value :: text
      end function c_strlen

      !> free(3)
      subroutine c_free(memory) bind(C, name='free')
         import :: c_ptr
         type(c_ptr), value :: memory
      end subroutine c_free
   end interface

contains

   !> Value of errno
   integer(c_int) function error_number()
      integer(c_int), pointer :: number

      call c_f_pointer(errno_location(), number)
      error_number = number
   end function error_number

end module polydem_posix
