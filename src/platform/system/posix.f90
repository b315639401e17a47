!> Functions of the C library and the operating system for files, folders and texts (POSIX, GNU C library on Linux).
module polydem_posix
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_f_pointer, c_int, c_int64_t, c_ptr, c_size_t
   implicit none
   private
   public :: c_access, c_close, c_closedir, c_creat, c_faccessat, c_fallocate, c_flock, c_fsync, c_ftruncate, c_lseek, &
      c_mkdir, c_open, c_opendir, c_pread, c_pwrite, c_readdir, c_realpath, c_rename, c_strerror, c_strlen, c_unlink, &
      c_write, clear_error_number, error_number, is_written, text_at
   public :: close_on_exec, existence, read_and_write, read_only, standard_error, standard_output, write_only

   !> Descriptors of standard output and standard error
   integer(c_int), parameter :: standard_output = 1_c_int, standard_error = 2_c_int
   !> F_OK of access(2)
   integer(c_int), parameter :: existence = 0_c_int
   !> O_RDONLY, O_WRONLY, O_RDWR and O_CLOEXEC of open(2) on Linux
   integer(c_int), parameter :: read_only = 0_c_int, write_only = 1_c_int, read_and_write = 2_c_int, &
      close_on_exec = int(o'2000000', c_int)

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
         import :: c_char, c_int, c_size_t
         integer(c_int), value :: descriptor
         !> The bytes
         character(kind=c_char), intent(in) :: bytes(*)
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

      !> POSIX access(2)
      integer(c_int) function c_access(path, mode) bind(C, name='access')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value :: mode
      end function c_access

      !> POSIX mkdir(2)
      integer(c_int) function c_mkdir(path, mode) bind(C, name='mkdir')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value :: mode
      end function c_mkdir

      !> POSIX rename(2)
      integer(c_int) function c_rename(from, to) bind(C, name='rename')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: from(*), to(*)
      end function c_rename

      !> POSIX unlink(2)
      integer(c_int) function c_unlink(path) bind(C, name='unlink')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
      end function c_unlink

      !> POSIX fsync(2)
      integer(c_int) function c_fsync(descriptor) bind(C, name='fsync')
         import :: c_int
         integer(c_int), value :: descriptor
      end function c_fsync

      !> POSIX lseek(2) with 64-bit offsets (GNU C library)
      integer(c_int64_t) function c_lseek(descriptor, offset, from) bind(C, name='lseek64')
         import :: c_int, c_int64_t
         integer(c_int), value :: descriptor
         integer(c_int64_t), value :: offset
         integer(c_int), value :: from
      end function c_lseek

      !> POSIX ftruncate(2) with 64-bit lengths (GNU C library)
      integer(c_int) function c_ftruncate(descriptor, length) bind(C, name='ftruncate64')
         import :: c_int, c_int64_t
         integer(c_int), value :: descriptor
         integer(c_int64_t), value :: length
      end function c_ftruncate

      !> Linux fallocate(2) with 64-bit offsets
      integer(c_int) function c_fallocate(descriptor, mode, offset, length) bind(C, name='fallocate64')
         import :: c_int, c_int64_t
         integer(c_int), value :: descriptor, mode
         integer(c_int64_t), value :: offset, length
      end function c_fallocate

      !> POSIX strerror(3)
      type(c_ptr) function c_strerror(number) bind(C, name='strerror')
         import :: c_int, c_ptr
         integer(c_int), value :: number
      end function c_strerror

      !> POSIX faccessat(2)
      integer(c_int) function c_faccessat(folder, path, mode, flags) bind(C, name='faccessat')
         import :: c_char, c_int
         integer(c_int), value :: folder
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value :: mode, flags
      end function c_faccessat

      !> POSIX opendir(3)
      type(c_ptr) function c_opendir(path) bind(C, name='opendir')
         import :: c_char, c_ptr
         character(kind=c_char), intent(in) :: path(*)
      end function c_opendir

      !> POSIX readdir(3)
      type(c_ptr) function c_readdir(stream) bind(C, name='readdir')
         import :: c_ptr
         type(c_ptr), value :: stream
      end function c_readdir

      !> POSIX closedir(3)
      integer(c_int) function c_closedir(stream) bind(C, name='closedir')
         import :: c_int, c_ptr
         type(c_ptr), value :: stream
      end function c_closedir

      !> POSIX realpath(3), which allocates its result if `resolved` is null
      type(c_ptr) function c_realpath(path, resolved) bind(C, name='realpath')
         import :: c_char, c_ptr
         character(kind=c_char), intent(in) :: path(*)
         type(c_ptr), value :: resolved
      end function c_realpath

      !> POSIX creat(2)
      integer(c_int) function c_creat(path, mode) bind(C, name='creat')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value :: mode
      end function c_creat

      !> flock(2)
      integer(c_int) function c_flock(descriptor, operation) bind(C, name='flock')
         import :: c_int
         integer(c_int), value :: descriptor, operation
      end function c_flock

      !> POSIX pread(2); ssize_t is as wide as size_t
      integer(c_size_t) function c_pread(descriptor, bytes, length, offset) bind(C, name='pread64')
         import :: c_char, c_int, c_int64_t, c_size_t
         integer(c_int), value :: descriptor
         character(kind=c_char), intent(inout) :: bytes(*)
         integer(c_size_t), value :: length
         integer(c_int64_t), value :: offset
      end function c_pread

      !> POSIX pwrite(2)
      integer(c_size_t) function c_pwrite(descriptor, bytes, length, offset) bind(C, name='pwrite64')
         import :: c_char, c_int, c_int64_t, c_size_t
         integer(c_int), value :: descriptor
         character(kind=c_char), intent(in) :: bytes(*)
         integer(c_size_t), value :: length
         integer(c_int64_t), value :: offset
      end function c_pwrite
   end interface

contains

   !> Value of errno
   integer(c_int) function error_number()
      integer(c_int), pointer :: number

      call c_f_pointer(errno_location(), number)
      error_number = number
   end function error_number

   !> Set errno to 0, before a call that sets it only on failure
   subroutine clear_error_number()
      integer(c_int), pointer :: number

      call c_f_pointer(errno_location(), number)
      number = 0_c_int
   end subroutine clear_error_number

   !> Text at an address; empty if the address is null
   function text_at(address) result(text)
      !> Address of a null-terminated text
      type(c_ptr), intent(in) :: address
      character(len=:), allocatable :: text
      character(kind=c_char), pointer :: letters(:)
      integer :: k

      text = ''
      if (.not. c_associated(address)) return
      call c_f_pointer(address, letters, [c_strlen(address)])
      deallocate (text)
      allocate (character(len=size(letters)) :: text)
      do k = 1, size(letters)
         text(k:k) = letters(k)
      end do
   end function text_at

   !> Write a whole text to a file; false if a call fails, the reason of which is in `error_number`
   logical function is_written(descriptor, text)
      !> Descriptor of the open file
      integer(c_int), intent(in) :: descriptor
      !> The text
      character(len=*), intent(in) :: text
      integer(c_size_t) :: written
      integer :: n

      n = 0
      is_written = .true.
      do while (n < len(text) .and. is_written)
         written = c_write(descriptor, text(n + 1:), int(len(text) - n, c_size_t))
         is_written = written > 0_c_size_t
         n = n + int(written)
      end do
   end function is_written

end module polydem_posix
