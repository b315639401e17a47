!> The functions of the C library and the operating system that this room calls (POSIX, GNU C library on Linux).
module polydem_posix
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_f_pointer, c_funptr, c_int, c_int64_t, c_intptr_t, &
      c_long, c_ptr, c_size_t
   implicit none
   private
   public :: c_access, c_attributes_init, c_attributes_stack, c_close, c_closedir, c_creat, c_exit_now, c_faccessat, &
      c_fallocate, c_flock, c_free, c_fsync, c_getaffinity, c_getpid, c_getrandom, c_getrlimit, c_kill, c_lseek, &
      c_malloc, c_mkdir, c_open, c_opendir, c_pipe, c_pipe2, c_poll, c_pread, c_pwrite, c_read, c_readdir, &
      c_realpath, c_rename, c_rmdir, c_sigaction, c_strdup, c_strerror, c_strlen, c_time, c_umask, c_unlink, c_user, &
      c_write, error_number, event_t, gethostname, gmtime, isatty, limit_t, pthread_create, pthread_join, strftime, &
      sysconf, timer_create, timer_delete, timer_settime, times_t, &
      text_at, is_written

   !> struct rlimit. Its numbers are unsigned in C: a negative value here means unlimited
   type, bind(C) :: limit_t
      !> Current limit, and maximum to which it may be raised [B]
      integer(c_int64_t) :: soft, hard
   end type limit_t

   !> struct sigevent of the GNU C library, 64 bytes
   type, bind(C) :: event_t
      !> Argument of the procedure
      type(c_ptr) :: value
      !> Number of a signal; not used
      integer(c_int) :: signal
      !> Kind of the notification, here a thread
      integer(c_int) :: notify
      !> Procedure that is called when the timer expires
      type(c_funptr) :: procedure
      !> Attributes of the thread
      type(c_ptr) :: attributes
      !> Reserved for the library
      integer(c_int) :: rest(8)
   end type event_t

   !> POSIX struct itimerspec
   type, bind(C) :: times_t
      !> Period of a repeated timer [s, ns]; zero here
      integer(c_long) :: period(2)
      !> Time until the timer expires [s, ns]
      integer(c_long) :: first(2)
   end type times_t

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

      !> free(3)
      subroutine c_free(memory) bind(C, name='free')
         import :: c_ptr
         type(c_ptr), value :: memory
      end subroutine c_free

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

      !> POSIX rmdir(2)
      integer(c_int) function c_rmdir(path) bind(C, name='rmdir')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
      end function c_rmdir

      !> POSIX realpath(3), which allocates its result if `resolved` is null
      type(c_ptr) function c_realpath(path, resolved) bind(C, name='realpath')
         import :: c_char, c_ptr
         character(kind=c_char), intent(in) :: path(*)
         type(c_ptr), value :: resolved
      end function c_realpath

      !> pthread_create(3); pthread_t is as wide as an address on Linux
      integer(c_int) function pthread_create(thread, attributes, routine, argument) bind(C, name='pthread_create')
         import :: c_funptr, c_int, c_intptr_t, c_ptr
         integer(c_intptr_t), intent(out) :: thread
         type(c_ptr), value :: attributes
         type(c_funptr), value :: routine
         type(c_ptr), value :: argument
      end function pthread_create

      !> pthread_join(3)
      integer(c_int) function pthread_join(thread, result_of_it) bind(C, name='pthread_join')
         import :: c_int, c_intptr_t, c_ptr
         integer(c_intptr_t), value :: thread
         type(c_ptr), value :: result_of_it
      end function pthread_join

      !> pipe2(2)
      integer(c_int) function c_pipe2(ends, flags) bind(C, name='pipe2')
         import :: c_int
         integer(c_int), intent(out) :: ends(2)
         integer(c_int), value :: flags
      end function c_pipe2

      !> C malloc
      type(c_ptr) function c_malloc(size) bind(C, name='malloc')
         import :: c_ptr, c_size_t
         integer(c_size_t), value :: size
      end function c_malloc

      !> POSIX gethostname(2)
      integer(c_int) function gethostname(name, length) bind(C, name='gethostname')
         import :: c_char, c_int, c_size_t
         character(kind=c_char), intent(out) :: name(*)
         integer(c_size_t), value :: length
      end function gethostname

      !> POSIX isatty(3)
      integer(c_int) function isatty(descriptor) bind(C, name='isatty')
         import :: c_int
         integer(c_int), value :: descriptor
      end function isatty

      !> POSIX sysconf(3)
      integer(c_long) function sysconf(name) bind(C, name='sysconf')
         import :: c_int, c_long
         integer(c_int), value :: name
      end function sysconf

      !> C time
      integer(c_long) function c_time(place) bind(C, name='time')
         import :: c_long, c_ptr
         type(c_ptr), value :: place
      end function c_time

      !> C gmtime
      type(c_ptr) function gmtime(seconds) bind(C, name='gmtime')
         import :: c_long, c_ptr
         integer(c_long), intent(in) :: seconds
      end function gmtime

      !> C strftime
      integer(c_size_t) function strftime(text, length, form, broken_down) bind(C, name='strftime')
         import :: c_char, c_ptr, c_size_t
         character(kind=c_char), intent(out) :: text(*)
         integer(c_size_t), value :: length
         character(kind=c_char), intent(in) :: form(*)
         type(c_ptr), value :: broken_down
      end function strftime

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

      !> getrandom(2)
      integer(c_size_t) function c_getrandom(word, length, flags) bind(C, name='getrandom')
         import :: c_int, c_int64_t, c_size_t
         integer(c_int64_t), intent(inout) :: word
         integer(c_size_t), value :: length
         integer(c_int), value :: flags
      end function c_getrandom

      !> POSIX getrlimit(2) with 64-bit limits
      integer(c_int) function c_getrlimit(resource, limit) bind(C, name='getrlimit64')
         import :: c_int, limit_t
         integer(c_int), value :: resource
         type(limit_t), intent(out) :: limit
      end function c_getrlimit

      !> Linux sched_getaffinity(2)
      integer(c_int) function c_getaffinity(process, length, mask) bind(C, name='sched_getaffinity')
         import :: c_int, c_long, c_size_t
         integer(c_int), value :: process
         integer(c_size_t), value :: length
         integer(c_long), intent(out) :: mask(*)
      end function c_getaffinity

      !> POSIX pthread_attr_init(3)
      integer(c_int) function c_attributes_init(attributes) bind(C, name='pthread_attr_init')
         import :: c_int, c_long
         integer(c_long), intent(inout) :: attributes(*)
      end function c_attributes_init

      !> POSIX pthread_attr_setstacksize(3)
      integer(c_int) function c_attributes_stack(attributes, bytes) bind(C, name='pthread_attr_setstacksize')
         import :: c_int, c_long, c_size_t
         integer(c_long), intent(inout) :: attributes(*)
         integer(c_size_t), value :: bytes
      end function c_attributes_stack

      !> POSIX pipe(2)
      integer(c_int) function c_pipe(ends) bind(C, name='pipe')
         import :: c_int
         integer(c_int), intent(out) :: ends(2)
      end function c_pipe

      !> POSIX read(2); ssize_t is as wide as size_t
      integer(c_size_t) function c_read(descriptor, bytes, length) bind(C, name='read')
         import :: c_char, c_int, c_size_t
         integer(c_int), value :: descriptor
         character(kind=c_char), intent(out) :: bytes(*)
         integer(c_size_t), value :: length
      end function c_read

      !> POSIX getpid(2)
      integer(c_int) function c_getpid() bind(C, name='getpid')
         import :: c_int
      end function c_getpid

      !> POSIX kill(2)
      integer(c_int) function c_kill(process, signal) bind(C, name='kill')
         import :: c_int
         integer(c_int), value :: process, signal
      end function c_kill

      !> POSIX poll(2), here without files; nfds_t is as wide as size_t on Linux
      integer(c_int) function c_poll(files, n, milliseconds) bind(C, name='poll')
         import :: c_int, c_ptr, c_size_t
         type(c_ptr), value :: files
         integer(c_size_t), value :: n
         integer(c_int), value :: milliseconds
      end function c_poll

      !> POSIX sigaction(2)
      integer(c_int) function c_sigaction(signal, new, old) bind(C, name='sigaction')
         import :: c_int, c_ptr
         integer(c_int), value :: signal
         type(c_ptr), value :: new, old
      end function c_sigaction

      !> POSIX timer_create(2)
      integer(c_int) function timer_create(clock, event, timer) bind(C, name='timer_create')
         import :: c_int, c_ptr, event_t
         integer(c_int), value :: clock
         type(event_t), intent(in) :: event
         type(c_ptr), intent(out) :: timer
      end function timer_create

      !> POSIX timer_settime(2)
      integer(c_int) function timer_settime(timer, flags, new, old) bind(C, name='timer_settime')
         import :: c_int, c_ptr, times_t
         type(c_ptr), value :: timer
         integer(c_int), value :: flags
         type(times_t), intent(in) :: new
         type(c_ptr), value :: old
      end function timer_settime

      !> POSIX timer_delete(2)
      integer(c_int) function timer_delete(timer) bind(C, name='timer_delete')
         import :: c_int, c_ptr
         type(c_ptr), value :: timer
      end function timer_delete

      !> POSIX strdup(3)
      type(c_ptr) function c_strdup(text) bind(C, name='strdup')
         import :: c_char, c_ptr
         character(kind=c_char), intent(in) :: text(*)
      end function c_strdup

      !> POSIX _exit(2)
      subroutine c_exit_now(code) bind(C, name='_exit')
         import :: c_int
         integer(c_int), value :: code
      end subroutine c_exit_now
   end interface

contains

   !> Value of errno
   integer(c_int) function error_number()
      integer(c_int), pointer :: number

      call c_f_pointer(errno_location(), number)
      error_number = number
   end function error_number

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
