!> Functions of the C library and the operating system for processes, threads, signals, timers and facts about the host
!> (POSIX, GNU C library on Linux).
module polydem_posix_processes
   use, intrinsic :: iso_c_binding, only: c_char, c_funptr, c_int, c_int64_t, c_intptr_t, c_long, c_ptr, c_size_t
   implicit none
   private
   public :: c_attributes_init, c_attributes_stack, c_exit, c_exit_now, c_free, c_getaffinity, c_getpid, &
      c_getrlimit, c_pipe2, c_poll, c_read, c_sigaction, c_strdup, c_time, c_umask, &
      c_user, event_t, gethostname, gmtime, isatty, limit_t, pthread_create, pthread_join, pthread_sigmask, strftime, &
      sysconf, timer_create, timer_delete, timer_settime, times_t

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
      !> free(3)
      subroutine c_free(memory) bind(C, name='free')
         import :: c_ptr
         type(c_ptr), value :: memory
      end subroutine c_free

      !> POSIX umask(2)
      integer(c_int) function c_umask(mask) bind(C, name='umask')
         import :: c_int
         integer(c_int), value :: mask
      end function c_umask

      !> POSIX geteuid(2)
      integer(c_int) function c_user() bind(C, name='geteuid')
         import :: c_int
      end function c_user

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

      !> POSIX pthread_sigmask(3)
      integer(c_int) function pthread_sigmask(how, set, old) bind(C, name='pthread_sigmask')
         import :: c_int, c_ptr
         integer(c_int), value :: how
         type(c_ptr), value :: set, old
      end function pthread_sigmask

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

      !> exit(3): flush and close files, and end the process without a message
      subroutine c_exit(code) bind(C, name='exit')
         import :: c_int
         integer(c_int), value :: code
      end subroutine c_exit

      !> _exit(2): end the process at once
      subroutine c_exit_now(code) bind(C, name='_exit')
         import :: c_int
         integer(c_int), value :: code
      end subroutine c_exit_now
   end interface

end module polydem_posix_processes
