!> Folders and files of the operating system (POSIX): make, rename, remove, bring to disk.
module polydem_paths
   use, intrinsic :: iso_c_binding, only: c_char, c_f_pointer, c_int, c_null_char, c_ptr, c_size_t
   use polydem_errors, only: error_t, io_error, raise
   implicit none
   private
   public :: make_folder, exists, is_folder, rename_file, remove_file, sync_file, last_failure

   !> F_OK of access(2)
   integer(c_int), parameter :: existence = 0_c_int
   !> O_RDONLY of open(2)
   integer(c_int), parameter :: read_only = 0_c_int
   !> Permissions of a new folder before umask: rwxrwxrwx
   integer(c_int), parameter :: all_permissions = int(o'777', c_int)

   interface
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

      !> POSIX open(2) without the mode, which only new files need
      integer(c_int) function c_open(path, flags) bind(C, name='open')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value :: flags
      end function c_open

      !> POSIX fsync(2)
      integer(c_int) function c_fsync(descriptor) bind(C, name='fsync')
         import :: c_int
         integer(c_int), value :: descriptor
      end function c_fsync

      !> POSIX close(2)
      integer(c_int) function c_close(descriptor) bind(C, name='close')
         import :: c_int
         integer(c_int), value :: descriptor
      end function c_close

      !> Where errno stands (Linux)
      type(c_ptr) function errno_location() bind(C, name='__errno_location')
         import :: c_ptr
      end function errno_location

      !> POSIX strerror(3)
      type(c_ptr) function c_strerror(number) bind(C, name='strerror')
         import :: c_int, c_ptr
         integer(c_int), value :: number
      end function c_strerror

      !> C strlen
      integer(c_size_t) function c_strlen(text) bind(C, name='strlen')
         import :: c_ptr, c_size_t
         type(c_ptr), value :: text
      end function c_strlen
   end interface

contains

   !> Whether there is a file or folder of this name
   logical function exists(path)
      !> Path of the file or folder
      character(len=*), intent(in) :: path

      exists = c_access(path//c_null_char, existence) == 0_c_int
   end function exists

   !> Whether there is a folder of this name
   logical function is_folder(path)
      !> Path of the folder
      character(len=*), intent(in) :: path

      is_folder = exists(path//'/.')
   end function is_folder

   !> Make a folder and the folders above it; nothing happens if it is there.
   subroutine make_folder(path, error)
      !> Path of the folder
      character(len=*), intent(in) :: path
      !> Allocated if there is no such folder afterwards
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: reason
      integer :: k

      reason = ''
      do k = 2, len(path) + 1
         if (k <= len(path)) then
            if (path(k:k) /= '/') cycle
         end if
         if (exists(path(:k - 1))) cycle
         if (c_mkdir(path(:k - 1)//c_null_char, all_permissions) /= 0_c_int) reason = last_failure()
      end do
      if (is_folder(path)) return
      if (exists(path)) reason = 'it is a file'
      call raise(error, io_error, "cannot make the folder '"//path//"': "//reason)
   end subroutine make_folder

   !> Give a file another name in one indivisible step, replacing what had that name.
   subroutine rename_file(from, to, error)
      !> Present path
      character(len=*), intent(in) :: from
      !> New path, on the same file system
      character(len=*), intent(in) :: to
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error

      if (c_rename(from//c_null_char, to//c_null_char) == 0_c_int) return
      call raise(error, io_error, "cannot rename '"//from//"' to '"//to//"': "//last_failure())
   end subroutine rename_file

   !> Remove a file.
   subroutine remove_file(path, error)
      !> Path of the file
      character(len=*), intent(in) :: path
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error

      if (c_unlink(path//c_null_char) == 0_c_int) return
      call raise(error, io_error, "cannot remove '"//path//"': "//last_failure())
   end subroutine remove_file

   !> Wait until a closed file, or the list of names in a folder, is on the disk.
   subroutine sync_file(path, error)
      !> Path of the file or folder
      character(len=*), intent(in) :: path
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error
      integer(c_int) :: descriptor, status
      character(len=:), allocatable :: reason

      descriptor = c_open(path//c_null_char, read_only)
      if (descriptor < 0_c_int) then
         call raise(error, io_error, "cannot open '"//path//"' to bring it to disk: "//last_failure())
         return
      end if
      status = c_fsync(descriptor)
      if (status /= 0_c_int) reason = last_failure()
      if (c_close(descriptor) /= 0_c_int .and. status == 0_c_int) reason = last_failure()
      if (allocated(reason)) call raise(error, io_error, "cannot bring '"//path//"' to disk: "//reason)
   end subroutine sync_file

   !> Why the last call to the operating system failed, in its own words
   function last_failure() result(reason)
      character(len=:), allocatable :: reason
      integer(c_int), pointer :: number
      character(kind=c_char), pointer :: letters(:)
      type(c_ptr) :: text
      integer :: k

      call c_f_pointer(errno_location(), number)
      text = c_strerror(number)
      call c_f_pointer(text, letters, [c_strlen(text)])
      allocate (character(len=size(letters)) :: reason)
      do k = 1, size(letters)
         reason(k:k) = letters(k)
      end do
   end function last_failure

end module polydem_paths
