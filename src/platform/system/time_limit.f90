!> A time limit for calls that may never return (Linux).
!>
!> Ranks that write a file in parallel wait for each other inside HDF5 and MPI. If one rank fails there without
!> returning, for example because only this rank cannot open the file, the others wait for ever. Only a timer can detect
!> this. The operating system runs the timer. When it expires, a thread prints a message and ends this process; MPI then
!> ends the other ranks.
module polydem_time_limit
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_f_pointer, c_funloc, c_int, c_long, c_new_line, &
      c_null_char, c_null_ptr, c_ptr, c_size_t
   use polydem_errors, only: io_error
   use polydem_kinds, only: dp, ip, lp
   use polydem_posix, only: c_strlen, c_write, standard_error
   use polydem_posix_processes, only: c_exit_now, c_free, c_strdup, event_t, timer_create, timer_delete, &
      timer_settime, times_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: time_limit_t

   !> Name of the environment variable that sets the time limit without the time for writing [s]
   character(len=*), parameter :: patience_variable = 'POLYDEM_PATIENCE'
   !> Default of that time [s]; it is longer than file systems need to recover from the loss of a server
   real(dp), parameter :: default_patience = 600.0_dp
   !> Minimum write rate of any disk [B/s]
   real(dp), parameter :: min_rate = 1.0e6_dp
   !> CLOCK_MONOTONIC and SIGEV_THREAD of Linux
   integer(c_int), parameter :: monotonic_clock = 1_c_int, by_thread = 2_c_int

   !> A time limit, which may be set or not
   type :: time_limit_t
      private
      !> The timer of the operating system
      type(c_ptr) :: timer = c_null_ptr
      !> The message as a C string; null if no limit is set
      type(c_ptr) :: message = c_null_ptr
   contains
      procedure :: set
      procedure :: lift
   end type time_limit_t

contains

   !> Start the time limit. It ends this process unless `lift` is called in time.
   subroutine set(self, path, rank, bytes)
      class(time_limit_t), intent(inout) :: self
      !> Path of the file that will be written
      character(len=*), intent(in) :: path
      !> Rank of this process
      integer(ip), intent(in) :: rank
      !> Maximum number of bytes that will be written [B]
      integer(lp), intent(in) :: bytes
      real(dp) :: patience
      character(len=32) :: text
      integer :: status
      integer(lp) :: seconds

      call self%lift()
      call get_environment_variable(patience_variable, text)
      read (text, *, iostat=status) patience
      if (status /= 0) patience = default_patience
      seconds = ceiling(min(max(1.0_dp, patience) + real(bytes, dp)/min_rate, 1.0e9_dp), lp)
      self%message = c_strdup('polydem: '//path//': rank '//to_text(rank)//' has not finished writing this file '// &
                              'after '//to_text(seconds)//' s: the disk or another rank does not respond. This '// &
                              'rank ends the run. Check that all ranks can write there. Run the same command with '// &
                              '--continue to resume; set '//patience_variable//'=SECONDS in the environment to '// &
                              'wait longer'//c_new_line//c_null_char)
      if (timer_create(monotonic_clock, event_t(value=self%message, signal=0_c_int, notify=by_thread, &
                                                procedure=c_funloc(end_process), attributes=c_null_ptr, &
                                                rest=0_c_int), self%timer) == 0_c_int) then
         if (timer_settime(self%timer, 0_c_int, times_t(period=0_c_long, first=[int(seconds, c_long), 0_c_long]), &
                           c_null_ptr) == 0_c_int) return
         if (timer_delete(self%timer) /= 0_c_int) self%timer = c_null_ptr
      end if
      ! If no timer is available, the run continues without a limit.
      call c_free(self%message)
      self%message = c_null_ptr
   end subroutine set

   !> Cancel the time limit; nothing happens if none is set.
   subroutine lift(self)
      class(time_limit_t), intent(inout) :: self

      if (.not. c_associated(self%message)) return
      if (timer_delete(self%timer) == 0_c_int) self%timer = c_null_ptr
      call c_free(self%message)
      self%message = c_null_ptr
   end subroutine lift

   !> Print the message and end this process.
   subroutine end_process(message) bind(C)
      type(c_ptr), value :: message
      character(kind=c_char), pointer :: letters(:)
      integer(c_size_t) :: written

      call c_f_pointer(message, letters, [c_strlen(message)])
      written = c_write(standard_error, letters, size(letters, kind=c_size_t))
      call c_exit_now(int(io_error, c_int))
   end subroutine end_process

end module polydem_time_limit
