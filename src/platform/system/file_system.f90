!> Operations on files and folders (POSIX): create, rename, remove, reserve disk space, flush to disk.
module polydem_file_system
   use, intrinsic :: iso_c_binding, only: c_int, c_int64_t, c_null_char
   use, intrinsic :: iso_fortran_env, only: file_storage_size
   use polydem_errors, only: error_t, io_error, raise, raise_unread
   use polydem_kinds, only: lp
   use polydem_posix, only: c_access, c_close, c_fallocate, c_fsync, c_ftruncate, c_lseek, c_mkdir, c_open, c_rename, &
      c_strerror, c_unlink, error_number, existence, is_written, read_and_write, read_only, text_at, write_only
   use polydem_posix_processes, only: c_umask, c_user
   implicit none
   private
   public :: make_folder, exists, is_folder, rename_file, remove_file, reserve_space, release_space, sync_file
   public :: overwrite_start, check_access, decide_existence, find_length, folder_of, last_failure, errno_message
   public :: disk_hint

   !> Hint for messages about files that cannot be written
   character(len=*), parameter :: disk_hint = &
      '. Is the disk full, or the file size limited (ulimit -f)? Free space or choose another folder, and run '// &
      'again; files that were closed earlier are complete'

   !> R_OK of access(2)
   integer(c_int), parameter :: may_read = 4_c_int
   !> FALLOC_FL_KEEP_SIZE of fallocate(2): the length of the file does not change
   integer(c_int), parameter :: keep_size = 1_c_int
   !> SEEK_END of lseek(2)
   integer(c_int), parameter :: to_end = 2_c_int
   !> EIO, ENOSPC and EDQUOT of errno on Linux: disk fault, disk full, quota of the user exceeded
   integer(c_int), parameter :: no_space(3) = [5_c_int, 28_c_int, 122_c_int]
   !> ENOENT, ENOTDIR, ENAMETOOLONG and ELOOP of errno on Linux: there is no file of this path
   integer(c_int), parameter :: nothing_there(4) = [2_c_int, 20_c_int, 36_c_int, 40_c_int]
   !> Permissions of a new folder before umask: rwxrwxrwx
   integer(c_int), parameter :: all_permissions = int(o'777', c_int)
   !> Permissions of the owner: rwx------
   integer(c_int), parameter :: of_owner = int(o'700', c_int)
   !> User identifier of root, who may read and write everything
   integer(c_int), parameter :: superuser = 0_c_int

contains

   !> Whether a file or folder exists
   logical function exists(path, error)
      !> Path of the file or folder
      character(len=*), intent(in) :: path
      !> Allocated if the system does not tell; absent: such a file counts as existing, and whoever opens it learns why
      type(error_t), allocatable, intent(inout), optional :: error

      call decide_existence(path, c_access(path//c_null_char, existence), exists, error)
   end function exists

   !> Whether a folder exists
   logical function is_folder(path, error)
      !> Path of the folder
      character(len=*), intent(in) :: path
      !> Allocated if the system does not tell
      type(error_t), allocatable, intent(inout) :: error

      call decide_existence(path, c_access(path//'/.'//c_null_char, existence), is_folder, error)
   end function is_folder

   !> Find out from the status of a call of the system whether a file exists.
   subroutine decide_existence(path, status, there, error)
      !> Path of the file
      character(len=*), intent(in) :: path
      !> Status of the call, which was the last one; 0 on success
      integer(c_int), intent(in) :: status
      !> Whether the file exists
      logical, intent(out) :: there
      !> Allocated if the call failed for another reason than that there is no file; absent: the file then counts as
      !> existing
      type(error_t), allocatable, intent(inout), optional :: error

      there = status == 0_c_int
      if (there) return
      if (any(nothing_there == error_number())) return
      there = .not. present(error)
      if (present(error)) call raise_unread(error, path, last_failure())
   end subroutine decide_existence

   !> Create a folder and its missing parents, and flush their names to disk. An existing folder is not changed. If the
   !> umask removes any permission of the owner from new files and folders, nothing is created and the call fails.
   subroutine make_folder(path, error)
      !> Path of the folder
      character(len=*), intent(in) :: path
      !> Allocated if the folder does not exist afterwards
      type(error_t), allocatable, intent(inout) :: error
      type(error_t), allocatable :: failure
      character(len=:), allocatable :: reason
      integer :: k

      call check_umask(path, error)
      if (allocated(error)) return
      reason = ''
      do k = 2, len(path) + 1
         if (k <= len(path)) then
            if (path(k:k) /= '/') cycle
         end if
         if (exists(path(:k - 1), failure)) cycle
         if (allocated(failure)) exit
         if (c_mkdir(path(:k - 1)//c_null_char, all_permissions) /= 0_c_int) then
            reason = last_failure()
            if (.not. exists(path(:k - 1))) exit
         else
            call sync_folder_of(path(:k - 1), error)
         end if
      end do
      if (allocated(error)) return
      if (.not. allocated(failure)) then
         if (is_folder(path, failure)) return
         if (exists(path, failure)) reason = 'it is a file'
      end if
      if (allocated(failure)) reason = failure%message
      call raise(error, io_error, "cannot make the folder '"//path//"': "//reason)
   end subroutine make_folder

   !> Fail if the umask removes a permission of the owner.
   subroutine check_umask(path, error)
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(inout) :: error
      integer(c_int) :: mask, ignored
      character(len=4) :: digits

      ! The umask can only be read by setting it.
      mask = c_umask(0_c_int)
      ignored = c_umask(mask)
      if (iand(mask, of_owner) == 0_c_int) return
      if (c_user() == superuser) return
      write (digits, '(o4.4)') mask
      call raise(error, io_error, "'"//path//"': the umask "//digits//' removes your permission to read, write or '// &
                 'enter new files and folders; nothing is created. Call umask 022 and run again')
   end subroutine check_umask

   !> Flush the directory entry of a new folder to disk. If its parent cannot be read, this is left to the operating
   !> system.
   subroutine sync_folder_of(path, error)
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: above

      above = folder_of(path)
      if (c_access(above//c_null_char, may_read) == 0_c_int) call sync_file(above, error)
   end subroutine sync_folder_of

   !> Folder of a path, with the last slash; '.' if the path has none
   pure function folder_of(path) result(folder)
      !> Path of a file or folder
      character(len=*), intent(in) :: path
      character(len=:), allocatable :: folder

      folder = path(:index(path, '/', back=.true.))
      if (folder == '') folder = '.'
   end function folder_of

   !> Rename a file atomically. An existing file of the new name is replaced.
   subroutine rename_file(from, to, error)
      !> Current path
      character(len=*), intent(in) :: from
      !> New path, on the same file system
      character(len=*), intent(in) :: to
      type(error_t), allocatable, intent(inout) :: error

      if (c_rename(from//c_null_char, to//c_null_char) == 0_c_int) return
      call raise(error, io_error, "cannot rename '"//from//"' to '"//to//"': "//last_failure())
   end subroutine rename_file

   !> Remove a file.
   subroutine remove_file(path, error)
      !> Path of the file
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(inout) :: error

      if (c_unlink(path//c_null_char) == 0_c_int) return
      call raise(error, io_error, "cannot remove '"//path//"': "//last_failure())
   end subroutine remove_file

   !> Reserve disk space for a file. Later writes within this space do not find the disk full. If the file system does
   !> not support reservations, enough space is assumed.
   subroutine reserve_space(path, bytes, error)
      !> Path of the file, which must exist
      character(len=*), intent(in) :: path
      !> Space after the end of the file [B]; holes in the file are filled too
      integer(lp), intent(in) :: bytes
      !> Allocated if the space is not available
      type(error_t), allocatable, intent(inout) :: error
      integer(c_int) :: descriptor

      descriptor = c_open(path//c_null_char, write_only, 0_c_int)
      if (descriptor < 0_c_int) then
         call raise(error, io_error, "cannot open '"//path//"' for writing: "//last_failure())
         return
      end if
      if (c_fallocate(descriptor, keep_size, 0_c_int64_t, &
                      c_lseek(descriptor, 0_c_int64_t, to_end) + int(bytes, c_int64_t)) /= 0_c_int) then
         if (any(no_space == error_number())) call raise(error, io_error, path//': '//last_failure()//disk_hint)
      end if
      if (c_close(descriptor) /= 0_c_int) call raise(error, io_error, path//': '//last_failure()//disk_hint)
   end subroutine reserve_space

   !> Give back the disk space that was reserved after the end of a file, once no process writes to it.
   subroutine release_space(path, error)
      !> Path of the file
      character(len=*), intent(in) :: path
      !> Allocated if the file cannot be written
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: reason
      integer(c_int) :: descriptor

      descriptor = c_open(path//c_null_char, write_only, 0_c_int)
      if (descriptor < 0_c_int) then
         reason = last_failure()
      else
         if (c_ftruncate(descriptor, c_lseek(descriptor, 0_c_int64_t, to_end)) /= 0_c_int) reason = last_failure()
         if (c_close(descriptor) /= 0_c_int .and. .not. allocated(reason)) reason = last_failure()
      end if
      if (allocated(reason)) call raise(error, io_error, path//': cannot be written: '//reason//disk_hint)
   end subroutine release_space

   !> Check that a file can be opened for reading and writing.
   subroutine check_access(path, error)
      !> Path of the file
      character(len=*), intent(in) :: path
      !> Allocated if it cannot be opened
      type(error_t), allocatable, intent(inout) :: error
      integer(c_int) :: descriptor

      descriptor = c_open(path//c_null_char, read_and_write, 0_c_int)
      if (descriptor >= 0_c_int) then
         if (c_close(descriptor) == 0_c_int) return
      end if
      call raise(error, io_error, path//': cannot be opened: '//last_failure())
   end subroutine check_access

   !> Find the length of an open file. (INQUIRE gives -1 without a status if the system does not tell.)
   subroutine find_length(unit, bytes, status, reason)
      !> Unit of the file
      integer, intent(in) :: unit
      !> Length [B]
      integer(lp), intent(out) :: bytes
      !> 0 on success
      integer, intent(out) :: status
      !> Reason of a failure
      character(len=*), intent(inout) :: reason

      inquire (unit=unit, size=bytes, iostat=status, iomsg=reason)
      bytes = bytes*int(file_storage_size/8, lp)
      if (status /= 0 .or. bytes >= 0_lp) return
      status = 1
      reason = last_failure()
   end subroutine find_length

   !> Overwrite the first bytes of a file with a text, and wait until it is on the disk. Every call is checked. Fortran
   !> input/output does not report a failed flush.
   subroutine overwrite_start(path, text, error)
      !> Path of the file, which must exist
      character(len=*), intent(in) :: path
      !> The text
      character(len=*), intent(in) :: text
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: reason
      integer(c_int) :: descriptor

      descriptor = c_open(path//c_null_char, write_only, 0_c_int)
      if (descriptor < 0_c_int) then
         reason = last_failure()
      else if (.not. is_written(descriptor, text)) then
         reason = last_failure()
      end if
      if (.not. allocated(reason)) then
         if (c_fsync(descriptor) /= 0_c_int) reason = last_failure()
      end if
      if (descriptor >= 0_c_int) then
         if (c_close(descriptor) /= 0_c_int .and. .not. allocated(reason)) reason = last_failure()
      end if
      if (allocated(reason)) call raise(error, io_error, path//': cannot be written: '//reason//disk_hint)
   end subroutine overwrite_start

   !> Wait until a closed file, or the list of names of a folder, is on the disk.
   subroutine sync_file(path, error)
      !> Path of the file or folder
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(inout) :: error
      integer(c_int) :: descriptor, status
      character(len=:), allocatable :: reason

      descriptor = c_open(path//c_null_char, read_only, 0_c_int)
      if (descriptor < 0_c_int) then
         call raise(error, io_error, "cannot open '"//path//"' to flush it to disk: "//last_failure())
         return
      end if
      status = c_fsync(descriptor)
      if (status /= 0_c_int) reason = last_failure()
      if (c_close(descriptor) /= 0_c_int .and. status == 0_c_int) reason = last_failure()
      if (allocated(reason)) call raise(error, io_error, "cannot flush '"//path//"' to disk: "//reason)
   end subroutine sync_file

   !> Error message of the operating system for its last failed call
   function last_failure() result(reason)
      character(len=:), allocatable :: reason

      reason = errno_message(error_number())
   end function last_failure

   !> Error message of the operating system for a value of errno
   function errno_message(number) result(reason)
      !> Value of errno
      integer(c_int), intent(in) :: number
      character(len=:), allocatable :: reason

      reason = text_at(c_strerror(number))
   end function errno_message

end module polydem_file_system
