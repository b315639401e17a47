!> Folders and files of the operating system (POSIX): make, rename, remove, reserve room, bring to disk.
module polydem_paths
   use, intrinsic :: iso_c_binding, only: c_char, c_f_pointer, c_int, c_int64_t, c_loc, c_null_char, c_ptr, c_size_t
   use polydem_errors, only: error_t, io_error, raise
   use polydem_kinds, only: lp
   implicit none
   private
   public :: make_folder, exists, is_folder, rename_file, remove_file, reserve_room, sync_file, write_start
   public :: check_access, last_failure, failure_text, disk_hint

   !> What to do if a file cannot be written
   character(len=*), parameter :: disk_hint = &
      '. Is the disk full, or the length of files limited (ulimit -f)? Make room, or choose another folder, and run'// &
      ' again; files that were closed before are whole'

   !> F_OK of access(2)
   integer(c_int), parameter :: existence = 0_c_int
   !> R_OK of access(2)
   integer(c_int), parameter :: may_read = 4_c_int
   !> O_RDONLY of open(2)
   integer(c_int), parameter :: read_only = 0_c_int
   !> O_WRONLY and O_RDWR of open(2)
   integer(c_int), parameter :: write_only = 1_c_int, read_and_write = 2_c_int
   !> FALLOC_FL_KEEP_SIZE of fallocate(2): the file does not get longer
   integer(c_int), parameter :: keep_size = 1_c_int
   !> SEEK_END of lseek(2)
   integer(c_int), parameter :: to_end = 2_c_int
   !> EIO, ENOSPC and EDQUOT of errno on Linux: a fault of the disk, no room on it, or none of the share of the user
   integer(c_int), parameter :: no_room(3) = [5_c_int, 28_c_int, 122_c_int]
   !> Permissions of a new folder before umask: rwxrwxrwx
   integer(c_int), parameter :: all_permissions = int(o'777', c_int)
   !> Those of them that are the owner's
   integer(c_int), parameter :: of_owner = int(o'700', c_int)
   !> The user who may read and write everything
   integer(c_int), parameter :: superuser = 0_c_int

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

      !> POSIX umask(2)
      integer(c_int) function c_umask(mask) bind(C, name='umask')
         import :: c_int
         integer(c_int), value :: mask
      end function c_umask

      !> POSIX geteuid(2)
      integer(c_int) function c_user() bind(C, name='geteuid')
         import :: c_int
      end function c_user

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

      !> POSIX write(2), whose ssize_t is as wide as size_t
      integer(c_size_t) function c_write(descriptor, bytes, length) bind(C, name='write')
         import :: c_int, c_ptr, c_size_t
         integer(c_int), value :: descriptor
         type(c_ptr), value :: bytes
         integer(c_size_t), value :: length
      end function c_write

      !> POSIX fsync(2)
      integer(c_int) function c_fsync(descriptor) bind(C, name='fsync')
         import :: c_int
         integer(c_int), value :: descriptor
      end function c_fsync

      !> POSIX lseek(2) of the GNU C library, with 64 bits
      integer(c_int64_t) function c_lseek(descriptor, offset, from) bind(C, name='lseek64')
         import :: c_int, c_int64_t
         integer(c_int), value :: descriptor
         integer(c_int64_t), value :: offset
         integer(c_int), value :: from
      end function c_lseek

      !> Linux fallocate(2) with 64 bits
      integer(c_int) function c_fallocate(descriptor, mode, offset, length) bind(C, name='fallocate64')
         import :: c_int, c_int64_t
         integer(c_int), value :: descriptor, mode
         integer(c_int64_t), value :: offset, length
      end function c_fallocate

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

   !> Make a folder and the folders above it, and bring their names to disk; none is made if it is there. It is an
   !> error, and nothing is made, if the umask takes from the owner any right to files and folders that are made.
   subroutine make_folder(path, error)
      !> Path of the folder
      character(len=*), intent(in) :: path
      !> Allocated if there is no such folder afterwards
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: reason
      integer :: k

      call check_umask(path, error)
      if (allocated(error)) return
      reason = ''
      do k = 2, len(path) + 1
         if (k <= len(path)) then
            if (path(k:k) /= '/') cycle
         end if
         if (exists(path(:k - 1))) cycle
         if (c_mkdir(path(:k - 1)//c_null_char, all_permissions) /= 0_c_int) then
            reason = last_failure()
         else
            call sync_folder_of(path(:k - 1), error)
         end if
      end do
      if (allocated(error)) return
      if (is_folder(path)) return
      if (exists(path)) reason = 'it is a file'
      call raise(error, io_error, "cannot make the folder '"//path//"': "//reason)
   end subroutine make_folder

   subroutine check_umask(path, error)
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(inout) :: error
      integer(c_int) :: mask, ignored
      character(len=4) :: digits

      ! To read it is to set it.
      mask = c_umask(0_c_int)
      ignored = c_umask(mask)
      if (iand(mask, of_owner) == 0_c_int) return
      if (c_user() == superuser) return
      write (digits, '(o4.4)') mask
      call raise(error, io_error, "'"//path//"': the umask "//digits//' takes from you the right to read, write or '// &
                 'enter what is made there; nothing is made. Call umask 022 and run again')
   end subroutine check_umask

   !> Bring the list of names in which a new folder stands to disk. A folder whose list nobody may read is left to the
   !> system.
   subroutine sync_folder_of(path, error)
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: above

      above = path(:index(path, '/', back=.true.))
      if (above == '') above = '.'
      if (c_access(above//c_null_char, may_read) == 0_c_int) call sync_file(above, error)
   end subroutine sync_folder_of

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

   !> Make the disk keep room for a file, so that nobody who then writes to it finds the disk full. File systems that
   !> cannot do so are believed to have room.
   subroutine reserve_room(path, bytes, error)
      !> Path of the file, which must be there
      character(len=*), intent(in) :: path
      !> By how much it may get longer [B]; holes in it get room, too
      integer(lp), intent(in) :: bytes
      !> Allocated if there is no room
      type(error_t), allocatable, intent(inout) :: error
      integer(c_int) :: descriptor
      integer(c_int), pointer :: number

      descriptor = c_open(path//c_null_char, write_only)
      if (descriptor < 0_c_int) then
         call raise(error, io_error, "cannot open '"//path//"' to write to it: "//last_failure())
         return
      end if
      call c_f_pointer(errno_location(), number)
      if (c_fallocate(descriptor, keep_size, 0_c_int64_t, &
                      c_lseek(descriptor, 0_c_int64_t, to_end) + int(bytes, c_int64_t)) /= 0_c_int) then
         if (any(no_room == number)) call raise(error, io_error, path//': '//last_failure()//disk_hint)
      end if
      if (c_close(descriptor) /= 0_c_int) call raise(error, io_error, path//': '//last_failure()//disk_hint)
   end subroutine reserve_room

   !> See to it that a file can be opened to read and write.
   subroutine check_access(path, error)
      !> Path of the file
      character(len=*), intent(in) :: path
      !> Allocated if it cannot
      type(error_t), allocatable, intent(inout) :: error
      integer(c_int) :: descriptor

      descriptor = c_open(path//c_null_char, read_and_write)
      if (descriptor >= 0_c_int) then
         if (c_close(descriptor) == 0_c_int) return
      end if
      call raise(error, io_error, path//': cannot be opened: '//last_failure())
   end subroutine check_access

   !> Write a text over the first bytes of a file, and wait until it is on the disk. Every call is checked; Fortran
   !> would not tell if what it wrote cannot be flushed.
   subroutine write_start(path, text, error)
      !> Path of the file, which must be there
      character(len=*), intent(in) :: path
      !> The text
      character(len=*), intent(in) :: text
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error
      character(kind=c_char), target :: bytes(len(text))
      character(len=:), allocatable :: reason
      integer(c_int) :: descriptor
      integer(c_size_t) :: written
      integer :: k, n

      do k = 1, len(text)
         bytes(k) = text(k:k)
      end do
      descriptor = c_open(path//c_null_char, write_only)
      if (descriptor < 0_c_int) reason = last_failure()
      n = 0
      do while (n < len(text) .and. .not. allocated(reason))
         written = c_write(descriptor, c_loc(bytes(n + 1)), int(len(text) - n, c_size_t))
         if (written <= 0_c_size_t) reason = last_failure()
         n = n + int(written)
      end do
      if (.not. allocated(reason)) then
         if (c_fsync(descriptor) /= 0_c_int) reason = last_failure()
      end if
      if (descriptor >= 0_c_int) then
         if (c_close(descriptor) /= 0_c_int .and. .not. allocated(reason)) reason = last_failure()
      end if
      if (allocated(reason)) call raise(error, io_error, path//': cannot be written: '//reason//disk_hint)
   end subroutine write_start

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

      call c_f_pointer(errno_location(), number)
      reason = failure_text(number)
   end function last_failure

   !> A number of errno in the words of the operating system
   function failure_text(number) result(reason)
      !> The number
      integer(c_int), intent(in) :: number
      character(len=:), allocatable :: reason
      character(kind=c_char), pointer :: letters(:)
      type(c_ptr) :: text
      integer :: k

      text = c_strerror(number)
      call c_f_pointer(text, letters, [c_strlen(text)])
      allocate (character(len=size(letters)) :: reason)
      do k = 1, size(letters)
         reason(k:k) = letters(k)
      end do
   end function failure_text

end module polydem_paths
