!> Clocks: elapsed (wall) time, and processor time of the calling thread.
module polydem_clock
   use, intrinsic :: iso_c_binding, only: c_int, c_long
   use polydem_kinds, only: dp, lp
   implicit none
   private
   public :: wall_seconds, thread_cpu_seconds

   !> POSIX struct timespec
   type, bind(C) :: timespec_t
      !> Whole seconds
      integer(c_long) :: seconds
      !> Nanoseconds within the second
      integer(c_long) :: nanoseconds
   end type timespec_t

   !> CLOCK_THREAD_CPUTIME_ID of Linux
   integer(c_int), parameter :: thread_clock = 3_c_int

   interface
      !> POSIX clock_gettime
      integer(c_int) function clock_gettime(clock, time) bind(C, name='clock_gettime')
         import :: c_int, timespec_t
         !> Identifier of the clock
         integer(c_int), value :: clock
         !> Time of that clock
         type(timespec_t), intent(out) :: time
      end function clock_gettime
   end interface

contains

   !> Elapsed time from an arbitrary origin, monotonic [s]
   real(dp) function wall_seconds()
      integer(lp) :: ticks, rate

      call system_clock(ticks, rate)
      wall_seconds = real(ticks, dp)/real(rate, dp)
   end function wall_seconds

   !> Processor time used by the calling thread [s]
   real(dp) function thread_cpu_seconds()
      type(timespec_t) :: time

      thread_cpu_seconds = 0.0_dp
      if (clock_gettime(thread_clock, time) == 0_c_int) then
         thread_cpu_seconds = real(time%seconds, dp) + 1.0e-9_dp*real(time%nanoseconds, dp)
      end if
   end function thread_cpu_seconds

end module polydem_clock
