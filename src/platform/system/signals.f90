!> Signals (POSIX): INT, TERM, USR1 and HUP, which ask a run to end, and the signals of failed writes.
!>
!> The first signal of a kind is only recorded; the second one ends the program at once. The operating system keeps the
!> record, not a variable: an empty handler is installed for one call, after which the signal has its default action
!> again. The program can query this action at any time. A signal that is ignored, such as INT in background jobs, stays
!> ignored.
!>
!> USR1 also comes from queues and from mpirun, at any time. A program that holds it from its start on learns of it when
!> it awaits signals. A rank that ended while it starts could make mpirun hang.
module polydem_signals
   use, intrinsic :: iso_c_binding, only: c_associated, c_funloc, c_funptr, c_int, c_intptr_t, c_loc, c_long, &
      c_null_funptr, c_null_ptr
   use polydem_posix_processes, only: c_sigaction, pthread_sigmask
   implicit none
   private
   public :: await_signals, caught_signal, hold_usr1, ignore_write_signals, release_signals

   !> SIGINT, SIGTERM, SIGUSR1, and SIGHUP, when the terminal closes (POSIX, Linux)
   integer(c_int), parameter :: numbers(4) = [2_c_int, 15_c_int, 10_c_int, 1_c_int]
   !> SIGUSR1
   integer(c_int), parameter :: usr1 = numbers(3)
   !> Names of these signals
   character(len=*), parameter :: names(4) = [character(len=4) :: 'INT', 'TERM', 'USR1', 'HUP']
   !> SIGPIPE and SIGXFSZ (Linux): the reader has closed the pipe; the file would exceed the limit of ulimit -f
   integer(c_int), parameter :: write_signals(2) = [13_c_int, 25_c_int]
   !> Bits of SA_RESTART (interrupted calls continue) and SA_RESETHAND (the handler serves one call) of Linux
   integer, parameter :: restart_bit = 28, one_call_bit = 31
   !> SIG_BLOCK and SIG_UNBLOCK (Linux)
   integer(c_int), parameter :: block_set = 0_c_int, unblock_set = 1_c_int
   !> Longs in a sigset_t of the GNU C library, 1024 bits
   integer, parameter :: set_size = 1024/storage_size(0_c_long)

   !> struct sigaction of the GNU C library
   type, bind(C) :: sigaction_t
      !> Handler; null is the default action
      type(c_funptr) :: handler
      !> Signals that are blocked during the handler
      integer(c_long) :: mask(set_size)
      !> SA_... bits
      integer(c_int) :: flags
      !> Reserved for the library
      type(c_funptr) :: restorer
   end type sigaction_t

contains

   !> Ignore the signals of failed writes. A write to a closed pipe or beyond the file size limit then returns an error
   !> status and does not end the program.
   subroutine ignore_write_signals()
      integer :: k

      do k = 1, size(write_signals)
         call set_action(write_signals(k), ignore_action())
      end do
   end subroutine ignore_write_signals

   !> Hold USR1 back until `await_signals` or `release_signals`. Called before there are other threads.
   subroutine hold_usr1()
      call mask_usr1(block_set)
   end subroutine hold_usr1

   !> Record the first signal of each kind from now on, and a USR1 that was held back.
   subroutine await_signals()
      integer :: k

      do k = 1, size(numbers)
         if (is_default(numbers(k))) call set_action(numbers(k), handler_address())
      end do
      call mask_usr1(unblock_set)
   end subroutine await_signals

   !> Name of a signal received since `await_signals`; empty if there was none. After a received signal, the next one
   !> ends the program at once.
   function caught_signal() result(name)
      character(len=:), allocatable :: name
      integer :: k

      name = ''
      do k = size(numbers), 1, -1
         if (is_default(numbers(k))) name = trim(names(k))
      end do
      if (name /= '') call release_signals()
   end function caught_signal

   !> Restore the default action of all awaited signals, which is to end the program, and let USR1 through.
   subroutine release_signals()
      integer :: k

      do k = 1, size(numbers)
         if (is_awaited(numbers(k))) call set_action(numbers(k), c_null_funptr)
      end do
      call mask_usr1(unblock_set)
   end subroutine release_signals

   !> The handler. It does nothing; its call alone resets the action of the signal.
   subroutine empty_handler(signal) bind(C)
      integer(c_int), value :: signal

      associate (unused => signal)
      end associate
   end subroutine empty_handler

   !> Address of the handler
   type(c_funptr) function handler_address()
      handler_address = c_funloc(empty_handler)
   end function handler_address

   !> SIG_IGN: the signal is ignored
   type(c_funptr) function ignore_action()
      ignore_action = transfer(1_c_intptr_t, c_null_funptr)
   end function ignore_action

   !> Whether a signal has its default action
   logical function is_default(signal)
      integer(c_int), intent(in) :: signal

      is_default = .not. c_associated(handler_of(signal))
   end function is_default

   !> Whether the handler of this module is installed for a signal
   logical function is_awaited(signal)
      integer(c_int), intent(in) :: signal

      is_awaited = c_associated(handler_of(signal), handler_address())
   end function is_awaited

   !> Block or unblock USR1 in this thread and in those that it makes afterwards.
   subroutine mask_usr1(how)
      integer(c_int), intent(in) :: how
      integer(c_long), target :: set(set_size)
      integer(c_int) :: status

      set = 0_c_long
      set(1) = ibset(set(1), usr1 - 1_c_int)
      status = pthread_sigmask(how, c_loc(set), c_null_ptr)
   end subroutine mask_usr1

   !> Current handler of a signal
   function handler_of(signal) result(handler)
      integer(c_int), intent(in) :: signal
      type(c_funptr) :: handler
      type(sigaction_t), target :: action
      integer(c_int) :: status

      action%handler = c_null_funptr
      status = c_sigaction(signal, c_null_ptr, c_loc(action))
      handler = action%handler
   end function handler_of

   !> Install a handler for a signal.
   subroutine set_action(signal, handler)
      integer(c_int), intent(in) :: signal
      type(c_funptr), intent(in) :: handler
      type(sigaction_t), target :: action
      integer(c_int) :: status

      action%handler = handler
      action%mask = 0_c_long
      action%flags = ibset(ibset(0_c_int, restart_bit), one_call_bit)
      action%restorer = c_null_funptr
      status = c_sigaction(signal, c_loc(action), c_null_ptr)
   end subroutine set_action

end module polydem_signals
