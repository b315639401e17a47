!> Signals (POSIX): INT, TERM and USR1, which ask a run to end, and those of a write that fails.
!>
!> The first one is only noted, the second one of its kind ends the program at once. The note is kept by the operating
!> system and not by a variable: a handler that does nothing is installed for one call, after which the
!> signal has its default action again, and that can be asked for at any time. A signal that is ignored, as INT is
!> in background jobs, stays so.
module polydem_signals
   use, intrinsic :: iso_c_binding, only: c_associated, c_funloc, c_funptr, c_int, c_intptr_t, c_loc, c_long, &
      c_null_funptr, c_null_ptr, c_ptr
   implicit none
   private
   public :: await_signals, caught_signal, release_signals, survive_failed_writes

   !> SIGINT, SIGTERM and SIGUSR1 (POSIX, Linux)
   integer(c_int), parameter :: numbers(3) = [2_c_int, 15_c_int, 10_c_int]
   !> Their names
   character(len=*), parameter :: names(3) = [character(len=4) :: 'INT', 'TERM', 'USR1']
   !> SIGPIPE and SIGXFSZ (Linux): nobody reads the pipe any more, the file would be longer than ulimit -f allows
   integer(c_int), parameter :: of_writes(2) = [13_c_int, 25_c_int]
   !> Bits of SA_RESTART (calls that were interrupted go on) and SA_RESETHAND (for one call) of Linux
   integer, parameter :: restart_bit = 28, one_call_bit = 31
   !> Longs in a sigset_t of the GNU C library, 1024 bits
   integer, parameter :: set_size = 1024/storage_size(0_c_long)

   !> struct sigaction of the GNU C library
   type, bind(C) :: sigaction_t
      !> What is called; null stands for the default action
      type(c_funptr) :: handler
      !> Signals that wait meanwhile
      integer(c_long) :: mask(set_size)
      !> SA_... bits
      integer(c_int) :: flags
      !> For the library
      type(c_funptr) :: restorer
   end type sigaction_t

   interface
      !> POSIX sigaction(2)
      integer(c_int) function c_sigaction(signal, new, old) bind(C, name='sigaction')
         import :: c_int, c_ptr
         integer(c_int), value :: signal
         type(c_ptr), value :: new, old
      end function c_sigaction
   end interface

contains

   !> From now on, a write to a pipe that nobody reads or beyond the greatest length of a file fails as others do, with
   !> a status, and does not end the program.
   subroutine survive_failed_writes()
      integer :: k

      do k = 1, size(of_writes)
         call set_action(of_writes(k), address_of_nothing())
      end do
   end subroutine survive_failed_writes

   !> From now on, note the first signal of each kind.
   subroutine await_signals()
      integer :: k

      do k = 1, size(numbers)
         if (is_default(numbers(k))) call set_action(numbers(k), address_of_note())
      end do
   end subroutine await_signals

   !> Name of a signal that came since `await_signals`; empty if there was none. Once one came, any other ends the
   !> program at once.
   function caught_signal() result(name)
      character(len=:), allocatable :: name
      integer :: k

      name = ''
      do k = size(numbers), 1, -1
         if (is_default(numbers(k))) name = trim(names(k))
      end do
      if (name /= '') call release_signals()
   end function caught_signal

   !> Give all signals that are awaited their default action, which is to end the program.
   subroutine release_signals()
      integer :: k

      do k = 1, size(numbers)
         if (is_awaited(numbers(k))) call set_action(numbers(k), c_null_funptr)
      end do
   end subroutine release_signals

   !> The handler: that it was called is all that there is to know.
   subroutine note(signal) bind(C)
      integer(c_int), value :: signal

      associate (unused => signal)
      end associate
   end subroutine note

   type(c_funptr) function address_of_note()
      address_of_note = c_funloc(note)
   end function address_of_note

   !> SIG_IGN: the signal is ignored
   type(c_funptr) function address_of_nothing()
      address_of_nothing = transfer(1_c_intptr_t, c_null_funptr)
   end function address_of_nothing

   !> Whether a signal has its default action
   logical function is_default(signal)
      integer(c_int), intent(in) :: signal

      is_default = .not. c_associated(handler_of(signal))
   end function is_default

   logical function is_awaited(signal)
      integer(c_int), intent(in) :: signal

      is_awaited = c_associated(handler_of(signal), address_of_note())
   end function is_awaited

   function handler_of(signal) result(handler)
      integer(c_int), intent(in) :: signal
      type(c_funptr) :: handler
      type(sigaction_t), target :: action
      integer(c_int) :: status

      action%handler = c_null_funptr
      status = c_sigaction(signal, c_null_ptr, c_loc(action))
      handler = action%handler
   end function handler_of

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
