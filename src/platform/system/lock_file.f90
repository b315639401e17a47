!> A lock file (Linux): it is locked with flock(2) and holds a text of fixed length.
!>
!> A lock of flock(2) belongs to the open file. The kernel releases it when the last descriptor of the open file closes.
!> This happens at any end of the process, including kill -9, in every PID namespace, and even if the process stays a
!> zombie. Closing another descriptor of the same file does not release the lock (unlike a lock of fcntl(2)). All
!> descriptors are closed by exec(3).
module polydem_lock_file
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_int64_t, c_null_char, c_size_t
   use polydem_file_system, only: last_failure
   use polydem_posix, only: c_close, c_flock, c_open, c_pread, c_pwrite, close_on_exec, error_number, &
      read_and_write, read_only
   implicit none
   private
   public :: lock_file_t, read_record, record_length
   public :: is_granted, is_busy, is_unsupported

   !> Length of the text in the file [B]
   integer, parameter :: record_length = 512
   !> Results of `lock`: the lock is granted, another process holds it, or the file system has no locks
   integer, parameter :: is_granted = 0, is_busy = 1, is_unsupported = 2

   !> A lock file; it is closed if the descriptor is negative
   type :: lock_file_t
      !> File descriptor
      integer(c_int) :: descriptor = -1_c_int
   contains
      procedure :: open => open_file
      procedure :: lock
      procedure :: write => write_record
      procedure :: close => close_file
   end type lock_file_t

   !> O_CREAT, O_EXCL and O_DSYNC of open(2) on Linux. With O_DSYNC, a write returns when the data are on the disk or
   !> server, and a network file system writes only these bytes, not the whole page
   integer(c_int), parameter :: create = int(o'100', c_int), exclusive = int(o'200', c_int), &
      synchronous = int(o'10000', c_int)
   !> Permissions of a new file before umask: rw-rw-rw-
   integer(c_int), parameter :: permissions = int(o'666', c_int)
   !> LOCK_SH, LOCK_EX and LOCK_NB of flock(2)
   integer(c_int), parameter :: share = 1_c_int, exclude = 2_c_int, no_wait = 4_c_int
   !> ENOENT, EINTR, EWOULDBLOCK, EEXIST, ENOTDIR and ESTALE of errno on Linux
   integer(c_int), parameter :: no_entry = 2_c_int, interrupted = 4_c_int, would_block = 11_c_int, &
      exists_already = 17_c_int, no_folder = 20_c_int, stale = 116_c_int

contains

   !> Open a file. It is created if it does not exist.
   subroutine open_file(self, path, is_new, reason)
      class(lock_file_t), intent(inout) :: self
      !> Path of the file
      character(len=*), intent(in) :: path
      !> Whether this process created the file (atomically)
      logical, intent(out) :: is_new
      !> Reason of a failure; not allocated on success. It is also not allocated if the file has just been removed: the
      !> descriptor is then negative, and the caller tries again
      character(len=:), allocatable, intent(out) :: reason
      integer(c_int) :: flags, number

      call self%close()
      flags = ior(ior(read_and_write, synchronous), close_on_exec)
      self%descriptor = c_open(path//c_null_char, ior(flags, ior(create, exclusive)), permissions)
      is_new = self%descriptor >= 0_c_int
      if (is_new) return
      if (error_number() /= exists_already) then
         reason = last_failure()
         return
      end if
      self%descriptor = c_open(path//c_null_char, flags, 0_c_int)
      if (self%descriptor >= 0_c_int) return
      number = error_number()
      if (number /= no_entry .and. number /= stale) reason = last_failure()
   end subroutine open_file

   !> Try to lock the file without waiting. A lock that is already held changes its kind and may be lost meanwhile.
   integer function lock(self, is_shared)
      class(lock_file_t), intent(in) :: self
      !> Whether the lock is shared; else it is exclusive
      logical, intent(in) :: is_shared
      integer(c_int) :: status

      do
         status = c_flock(self%descriptor, ior(merge(share, exclude, is_shared), no_wait))
         if (status == 0_c_int) exit
         if (error_number() /= interrupted) exit
      end do
      lock = is_granted
      if (status == 0_c_int) return
      lock = is_unsupported
      if (error_number() == would_block) lock = is_busy
   end function lock

   !> Write a text into the file, and wait until it is on the disk.
   subroutine write_record(self, text, offset, is_written)
      class(lock_file_t), intent(in) :: self
      !> The text
      character(len=*, kind=c_char), intent(in) :: text
      !> Offset of its first byte in the file, counted from 0 [B]
      integer, intent(in) :: offset
      !> Whether the whole text was written
      logical, intent(out) :: is_written

      is_written = c_pwrite(self%descriptor, text, len(text, kind=c_size_t), int(offset, c_int64_t)) &
                   == len(text, kind=c_size_t)
   end subroutine write_record

   !> Close the file, which releases its lock. Nothing happens if it is already closed.
   subroutine close_file(self)
      class(lock_file_t), intent(inout) :: self
      integer(c_int) :: ignored

      if (self%descriptor >= 0_c_int) ignored = c_close(self%descriptor)
      self%descriptor = -1_c_int
   end subroutine close_file

   !> Read the text of a file through its path, as another process would.
   subroutine read_record(path, text, length, is_gone, number)
      !> Path of the file, terminated by a null character
      character(len=*, kind=c_char), intent(in) :: path
      !> The text, padded with blanks
      character(len=record_length, kind=c_char), intent(out) :: text
      !> Length of the text; negative if the file cannot be read
      integer, intent(out) :: length
      !> Whether the file does not exist
      logical, intent(out) :: is_gone
      !> Number of the error of the system if the file exists and cannot be read; else 0
      integer(c_int), intent(out), optional :: number
      integer(c_int) :: descriptor, ignored

      text = ''
      length = -1
      is_gone = .false.
      if (present(number)) number = 0_c_int
      descriptor = c_open(path, ior(read_only, close_on_exec), 0_c_int)
      if (descriptor < 0_c_int) then
         is_gone = any(error_number() == [no_entry, no_folder, stale])
         if (present(number) .and. .not. is_gone) number = error_number()
         return
      end if
      length = int(c_pread(descriptor, text, int(record_length, c_size_t), 0_c_int64_t))
      if (present(number) .and. length < 0) number = error_number()
      ignored = c_close(descriptor)
   end subroutine read_record

end module polydem_lock_file
