!> The lock of a result folder: the file `running.lock`, which the run locks with flock(2) until it ends. The file names
!> process and machine of the run:
!>
!>     4711 node07                       process identifier and machine
!>     since 2026-11-21T12:00:00Z
!>     kernel 3e1f8a52-...               identity of the kernel of the process; - if unknown
!>
!> *The kernel decides* about runs of one machine. It releases the lock at any end of the process, kill -9 included. A
!> killed run leaves an unlocked file, which the next run takes over. Identifiers of processes are only shown.
!>
!> *Another machine* may not share the locks of this kernel, and some file systems have none. A lock file of another
!> machine, or one that nobody can lock, therefore keeps every run out until a person removes the file. Of two machines
!> without common locks that start a run in the same folder at the same moment, both may succeed.
!>
!> *Creation and removal.* Only the process that holds the lock removes the file. A process that has locked the file
!> checks that the path still names it; else the file was removed before it was locked, and the process starts again.
!> The ranks of a run share its lock: a rank that outlives the root rank keeps other runs out until it ends. Another run
!> may get the lock while an exclusive lock changes to a shared one; this run is then refused.
!>
!> Nothing is written through a symbolic link, and a file with several names is replaced by a new one.
module polydem_folder_lock
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_int64_t, c_new_line, c_null_char, c_size_t
   use polydem_errors, only: error_t, input_error, io_error, raise, raise_unread
   use polydem_file_status, only: is_link, is_name_of, is_shared
   use polydem_file_system, only: last_failure, remove_file
   use polydem_host, only: boot_identity, host_name, utc_now
   use polydem_kinds, only: ip
   use polydem_posix, only: c_close, c_flock, c_open, c_pread, c_pwrite, close_on_exec, error_number, read_and_write, &
      read_only
   use polydem_posix_processes, only: c_getpid
   use polydem_strings, only: to_text
   implicit none
   private
   public :: folder_lock_t, lock_path

   !> Length of the text in the file [B]
   integer, parameter :: text_length = 256
   !> Answers of the kernel: the lock is granted, another process holds it, or the file cannot be locked
   integer, parameter :: is_granted = 0, is_busy = 1, is_unsupported = 2
   !> O_CREAT, O_EXCL and O_DSYNC of open(2) on Linux; with O_DSYNC, a write returns when the data are on disk or server
   integer(c_int), parameter :: create = int(o'100', c_int), exclusive = int(o'200', c_int), &
      synchronous = int(o'10000', c_int)
   !> Permissions of a new file before umask: rw-rw-rw-
   integer(c_int), parameter :: permissions = int(o'666', c_int)
   !> LOCK_SH, LOCK_EX and LOCK_NB of flock(2)
   integer(c_int), parameter :: share = 1_c_int, exclude = 2_c_int, no_wait = 4_c_int
   !> ENOENT, EINTR, EWOULDBLOCK, EEXIST and ESTALE of errno on Linux
   integer(c_int), parameter :: no_entry = 2_c_int, interrupted = 4_c_int, would_block = 11_c_int, &
      exists_already = 17_c_int, stale = 116_c_int

   !> The lock of a result folder, held or not
   type :: folder_lock_t
      private
      !> Path of the lock; not allocated if this process is not the owner
      character(len=:), allocatable :: path
      !> Descriptor of the locked file; negative if it is closed
      integer(c_int) :: descriptor = -1_c_int
   contains
      procedure :: acquire
      procedure :: join
      procedure :: is_held
      procedure :: release
   end type folder_lock_t

   !> The owner of a lock, as its file says
   type :: owner_t
      !> Process identifier; 0 if the file does not tell
      integer(ip) :: process = 0_ip
      !> Name of the machine
      character(len=text_length) :: host = ''
      !> Identity of the kernel of the process; '-' if unknown
      character(len=text_length) :: kernel = '-'
      !> Whether the file is empty: its process has not written its text, or was killed before
      logical :: is_empty = .false.
   end type owner_t

contains

   !> Path of the lock file
   pure function lock_path(folder) result(path)
      !> Result folder
      character(len=*), intent(in) :: folder
      character(len=:), allocatable :: path

      path = folder//'/running.lock'
   end function lock_path

   !> Acquire the lock of a folder, which keeps other runs out until `release`.
   subroutine acquire(self, folder, note, error, shares)
      class(folder_lock_t), intent(inout) :: self
      !> Result folder, which must exist
      character(len=*), intent(in) :: folder
      !> Line for the log if the lock of a dead run was taken over; else not allocated
      character(len=:), allocatable, intent(out) :: note
      !> Allocated if another run holds the lock, or if the lock file cannot be created
      type(error_t), allocatable, intent(inout) :: error
      !> Whether other ranks of this run will `join`; false if absent
      logical, intent(in), optional :: shares
      logical :: is_held, is_shared

      is_shared = .false.
      if (present(shares)) is_shared = shares
      is_held = .false.
      do while (.not. is_held .and. .not. allocated(error))
         call try(self, folder, is_shared, note, is_held, error)
         if (.not. is_held) call close_lock(self)
      end do
      if (is_held) self%path = lock_path(folder)
   end subroutine acquire

   !> Share the lock that the root rank of the run has acquired. This matters only after the root rank has ended, so a
   !> file system without locks is no failure.
   subroutine join(self, folder)
      class(folder_lock_t), intent(inout) :: self
      !> Result folder
      character(len=*), intent(in) :: folder

      self%descriptor = c_open(lock_path(folder)//c_null_char, ior(read_only, close_on_exec), 0_c_int)
      if (self%descriptor < 0_c_int) return
      if (lock_file(self%descriptor, share) /= is_granted) call close_lock(self)
   end subroutine join

   !> Whether this process has acquired the lock
   pure logical function is_held(self)
      class(folder_lock_t), intent(in) :: self

      is_held = allocated(self%path)
   end function is_held

   !> Release the lock; nothing happens if it is not held.
   subroutine release(self, folder)
      class(folder_lock_t), intent(inout) :: self
      !> Folder of the lock, if it was renamed since
      character(len=*), intent(in), optional :: folder
      type(error_t), allocatable :: ignored

      if (allocated(self%path)) then
         if (present(folder)) self%path = lock_path(folder)
         if (is_name_of(self%path, self%descriptor)) call remove_file(self%path, ignored)
         deallocate (self%path)
      end if
      call close_lock(self)
   end subroutine release

   !> Try once to get the lock. Neither held nor an error: the file was removed or replaced in between; try again.
   subroutine try(self, folder, shares, note, is_held, error)
      class(folder_lock_t), intent(inout) :: self
      character(len=*), intent(in) :: folder
      logical, intent(in) :: shares
      character(len=:), allocatable, intent(inout) :: note
      logical, intent(inout) :: is_held
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: path
      type(owner_t) :: owner
      integer :: answer
      logical :: is_mine, is_new

      path = lock_path(folder)
      call open_lock(path, self%descriptor, is_new, error)
      if (self%descriptor < 0_c_int) return
      answer = lock_file(self%descriptor, exclude)
      owner = owner_of(self%descriptor, path, error)
      if (allocated(error)) return
      if (answer == is_busy) then
         call raise(error, input_error, folder//': another run ('//name_of(owner)//') writes to this folder; wait '// &
                    'until it ends or choose another folder with --set output.folder=NAME')
         return
      end if
      if (.not. is_name_of(path, self%descriptor)) return
      is_mine = is_new
      if (.not. is_new) is_mine = may_take(owner, answer)
      if (.not. is_mine) then
         call raise(error, input_error, folder//': another run ('//name_of(owner)//') may write to this folder; if '// &
                    'it has ended, remove '//path//' and run again, or choose another folder with --set '// &
                    'output.folder=NAME')
         return
      end if
      if (.not. (is_new .or. owner%is_empty)) note = 'took over '//path//' of '//name_of(owner)//', which has ended'
      if (is_shared(path)) then
         call remove_file(path, error)
         return
      end if
      call write_owner(self%descriptor, path, error)
      if (allocated(error)) then
         if (is_new) call remove_file(path, error)
         return
      end if
      is_held = .true.
      if (.not. shares .or. answer /= is_granted) return
      is_held = lock_file(self%descriptor, share) == is_granted
      if (is_held) is_held = is_name_of(path, self%descriptor)
   end subroutine try

   !> Open the lock file, or create it. The descriptor is negative without an error if the file has just been removed.
   subroutine open_lock(path, descriptor, is_new, error)
      character(len=*), intent(in) :: path
      integer(c_int), intent(out) :: descriptor
      !> Whether this process created the file (atomically)
      logical, intent(out) :: is_new
      type(error_t), allocatable, intent(inout) :: error
      integer(c_int) :: flags

      flags = ior(ior(read_and_write, synchronous), close_on_exec)
      descriptor = c_open(path//c_null_char, ior(flags, ior(create, exclusive)), permissions)
      is_new = descriptor >= 0_c_int
      if (is_new) return
      if (error_number() == exists_already) then
         if (is_link(path)) then
            call raise(error, input_error, path//' is a link, through which no run writes; remove it and run again')
            return
         end if
         descriptor = c_open(path//c_null_char, flags, 0_c_int)
         if (descriptor >= 0_c_int) return
         if (any(error_number() == [no_entry, stale])) return
      end if
      call raise(error, io_error, path//': cannot be created: '//last_failure())
   end subroutine open_lock

   !> Try to lock a file without waiting: is_granted, is_busy or is_unsupported
   integer function lock_file(descriptor, how)
      integer(c_int), intent(in) :: descriptor
      !> share or exclude
      integer(c_int), intent(in) :: how
      integer(c_int) :: status

      do
         status = c_flock(descriptor, ior(how, no_wait))
         if (status == 0_c_int) exit
         if (error_number() /= interrupted) exit
      end do
      lock_file = is_granted
      if (status == 0_c_int) return
      lock_file = is_unsupported
      if (error_number() == would_block) lock_file = is_busy
   end function lock_file

   !> Close the file, which releases its lock.
   subroutine close_lock(self)
      class(folder_lock_t), intent(inout) :: self
      integer(c_int) :: ignored

      if (self%descriptor >= 0_c_int) ignored = c_close(self%descriptor)
      self%descriptor = -1_c_int
   end subroutine close_lock

   !> Whether the owner of an unlocked file has surely ended: this kernel, which would know of its lock, denies it
   logical function may_take(owner, answer)
      type(owner_t), intent(in) :: owner
      !> Answer of the kernel: is_granted or is_unsupported
      integer, intent(in) :: answer
      character(len=:), allocatable :: host, kernel

      host = host_name()
      kernel = boot_identity()
      may_take = answer == is_granted .and. (owner%is_empty .or. owner%host == host .or. &
                                             (owner%kernel == kernel .and. kernel /= '-'))
   end function may_take

   !> Write process and machine into the file.
   subroutine write_owner(descriptor, path, error)
      integer(c_int), intent(in) :: descriptor
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(inout) :: error
      character(len=text_length, kind=c_char) :: text

      text = to_text(int(c_getpid(), ip))//' '//host_name()//c_new_line//'since '//utc_now()//c_new_line//'kernel '// &
             boot_identity()//c_new_line
      text(text_length:) = c_new_line
      if (c_pwrite(descriptor, text, int(text_length, c_size_t), 0_c_int64_t) /= int(text_length, c_size_t)) &
         call raise(error, io_error, path//': cannot be written: '//last_failure())
   end subroutine write_owner

   !> Read the owner of a lock.
   function owner_of(descriptor, path, error) result(owner)
      integer(c_int), intent(in) :: descriptor
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(inout) :: error
      type(owner_t) :: owner
      character(len=text_length, kind=c_char) :: text
      character(len=:), allocatable :: line
      integer :: length, first, status

      text = ''
      length = int(c_pread(descriptor, text, int(text_length, c_size_t), 0_c_int64_t))
      if (length < 0) call raise_unread(error, path, last_failure())
      owner%is_empty = length == 0
      line = text(:index(text//c_new_line, c_new_line) - 1)
      read (line, *, iostat=status) owner%process, owner%host
      if (status /= 0) owner%process = 0_ip
      first = index(text, c_new_line//'kernel ')
      if (first > 0) owner%kernel = text(first + 8:first + 6 + index(text(first + 8:)//c_new_line, c_new_line))
   end function owner_of

   !> Description of an owner for messages
   function name_of(owner) result(name)
      type(owner_t), intent(in) :: owner
      character(len=:), allocatable :: name

      name = 'an unknown process'
      if (owner%process < 1_ip) return
      name = 'process '//to_text(owner%process)
      if (owner%host /= host_name()) name = name//' on the machine '//trim(owner%host)
   end function name_of

end module polydem_folder_lock
