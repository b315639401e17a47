!> A limit for the time that this process spends in calls from which it might never return (Linux).
!>
!> Processes that write a file together wait for each other inside HDF5 and MPI. If one of them fails there without
!> coming back, as when it alone cannot open the file, nobody notices but the clock. The timer and what it knows are
!> kept by the operating system; when it ends, a thread says why and ends this process, and so MPI ends the others.
module polydem_time_limit
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_funloc, c_funptr, c_int, c_long, c_new_line, &
      c_null_char, c_null_ptr, c_ptr, c_size_t
   use polydem_errors, only: io_error
   use polydem_kinds, only: dp, ip, lp
   use polydem_strings, only: to_text
   implicit none
   private
   public :: time_limit_t, patience_variable

   !> Environment variable with the time that may pass without a byte [s]
   character(len=*), parameter :: patience_variable = 'POLYDEM_PATIENCE'
   !> That time if the variable is not set: longer than file systems take to recover from the loss of a server [s]
   real(dp), parameter :: usual_patience = 600.0_dp
   !> What every disk writes at least [B/s]
   real(dp), parameter :: least_rate = 1.0e6_dp
   !> CLOCK_MONOTONIC and SIGEV_THREAD of Linux, and the descriptor of standard error
   integer(c_int), parameter :: monotonic_clock = 1_c_int, by_thread = 2_c_int, standard_error = 2_c_int

   !> A time limit that is set or not
   type :: time_limit_t
      private
      !> The timer of the operating system
      type(c_ptr) :: timer = c_null_ptr
      !> What will be said, as C has it; null if no limit is set
      type(c_ptr) :: message = c_null_ptr
   contains
      procedure :: set
      procedure :: lift
   end type time_limit_t

   !> struct sigevent of the GNU C library, 64 bytes
   type, bind(C) :: event_t
      !> Argument of the procedure that is called
      type(c_ptr) :: value
      !> Number of a signal; not used
      integer(c_int) :: signal
      !> How the end is told
      integer(c_int) :: notify
      !> The procedure
      type(c_funptr) :: procedure
      !> Attributes of the thread
      type(c_ptr) :: attributes
      !> For the library
      integer(c_int) :: rest(8)
   end type event_t

   !> POSIX struct itimerspec: period and time to the end
   type, bind(C) :: times_t
      !> Seconds and nanoseconds between later ends; none
      integer(c_long) :: period(2)
      !> Seconds and nanoseconds to the end
      integer(c_long) :: first(2)
   end type times_t

   interface
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

      !> C strlen
      integer(c_size_t) function c_strlen(text) bind(C, name='strlen')
         import :: c_ptr, c_size_t
         type(c_ptr), value :: text
      end function c_strlen

      !> C free
      subroutine c_free(memory) bind(C, name='free')
         import :: c_ptr
         type(c_ptr), value :: memory
      end subroutine c_free

      !> POSIX write(2), whose ssize_t is as wide as size_t
      integer(c_size_t) function c_write(descriptor, bytes, length) bind(C, name='write')
         import :: c_int, c_ptr, c_size_t
         integer(c_int), value :: descriptor
         type(c_ptr), value :: bytes
         integer(c_size_t), value :: length
      end function c_write

      !> POSIX _exit(2)
      subroutine c_exit_now(code) bind(C, name='_exit')
         import :: c_int
         integer(c_int), value :: code
      end subroutine c_exit_now
   end interface

contains

   !> From now on, end this process unless `lift` is called in time.
   subroutine set(self, path, rank, bytes)
      class(time_limit_t), intent(inout) :: self
      !> Path of the file that is going to be written
      character(len=*), intent(in) :: path
      !> Number of this process
      integer(ip), intent(in) :: rank
      !> What is going to be written at most [B]
      integer(lp), intent(in) :: bytes
      real(dp) :: patience
      character(len=32) :: text
      integer :: status
      integer(lp) :: seconds

      call self%lift()
      call get_environment_variable(patience_variable, text)
      read (text, *, iostat=status) patience
      if (status /= 0) patience = usual_patience
      seconds = ceiling(min(max(1.0_dp, patience) + real(bytes, dp)/least_rate, 1.0e9_dp), lp)
      self%message = c_strdup('polydem: '//path//': rank '//to_text(rank)//' has been busy with this file for '// &
                              to_text(seconds)//' s, waiting for the disk or the other ranks, and ends the run. '// &
                              'Can all ranks write there? The same command with --continue goes on; with '// &
                              patience_variable//'=SECONDS in the environment ranks wait longer'//c_new_line// &
                              c_null_char)
      if (timer_create(monotonic_clock, event_t(value=self%message, signal=0_c_int, notify=by_thread, &
                                                procedure=c_funloc(end_process), attributes=c_null_ptr, &
                                                rest=0_c_int), self%timer) == 0_c_int) then
         if (timer_settime(self%timer, 0_c_int, times_t(period=0_c_long, first=[int(seconds, c_long), 0_c_long]), &
                           c_null_ptr) == 0_c_int) return
         if (timer_delete(self%timer) /= 0_c_int) self%timer = c_null_ptr
      end if
      ! Without a timer the run goes on without a limit.
      call c_free(self%message)
      self%message = c_null_ptr
   end subroutine set

   !> Everything went well in time; nothing happens if no limit is set.
   subroutine lift(self)
      class(time_limit_t), intent(inout) :: self

      if (.not. c_associated(self%message)) return
      if (timer_delete(self%timer) == 0_c_int) self%timer = c_null_ptr
      call c_free(self%message)
      self%message = c_null_ptr
   end subroutine lift

   !> Say what was the matter, and end this process.
   subroutine end_process(message) bind(C)
      type(c_ptr), value :: message
      integer(c_size_t) :: written

      written = c_write(standard_error, message, c_strlen(message))
      call c_exit_now(int(io_error, c_int))
   end subroutine end_process

end module polydem_time_limit
