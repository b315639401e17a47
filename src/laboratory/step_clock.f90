!> Elapsed time and processor time of one step, corrected for the cost of reading the clocks.
!>
!> Reading the processor time can take a microsecond, some per cent of a small step. The clock measures this cost with
!> empty steps and subtracts it.
module polydem_step_clock
   use polydem_clock, only: thread_cpu_seconds, wall_seconds
   use polydem_kinds, only: dp
   implicit none
   private
   public :: step_clock_t, median

   !> Number of empty steps of a calibration
   integer, parameter :: n_trials = 101

   !> A clock for steps
   type :: step_clock_t
      !> Cost of reading elapsed time, and processor time [s]
      real(dp) :: elapsed_cost = 0.0_dp, processor_cost = 0.0_dp
      !> Start of the step on both clocks [s]
      real(dp), private :: elapsed = 0.0_dp, processor = 0.0_dp
   contains
      procedure :: calibrate
      procedure :: start
      procedure :: stop => stop_clock
   end type step_clock_t

contains

   !> Measure the cost of reading the clocks: the median over empty steps.
   subroutine calibrate(self)
      class(step_clock_t), intent(inout) :: self
      real(dp) :: elapsed(n_trials), processor(n_trials)
      integer :: k

      self%elapsed_cost = 0.0_dp
      self%processor_cost = 0.0_dp
      do k = 1, n_trials
         call self%start()
         call self%stop(elapsed(k), processor(k))
      end do
      self%elapsed_cost = median(elapsed)
      self%processor_cost = median(processor)
   end subroutine calibrate

   !> Start the clocks of a step.
   subroutine start(self)
      class(step_clock_t), intent(inout) :: self

      self%processor = thread_cpu_seconds()
      self%elapsed = wall_seconds()
   end subroutine start

   !> Stop the clocks of a step.
   subroutine stop_clock(self, elapsed, processor)
      class(step_clock_t), intent(in) :: self
      !> Elapsed time [s]
      real(dp), intent(out) :: elapsed
      !> Processor time of the calling thread [s]
      real(dp), intent(out) :: processor

      elapsed = max(0.0_dp, wall_seconds() - self%elapsed - self%elapsed_cost)
      processor = max(0.0_dp, thread_cpu_seconds() - self%processor - self%processor_cost)
   end subroutine stop_clock

   !> Median of some numbers: the middle one, or the mean of the middle two
   pure real(dp) function median(values)
      !> The numbers, in any order; at least one
      real(dp), intent(in) :: values(:)
      real(dp) :: ordered(size(values)), value
      integer :: j, k, n

      ordered = values
      n = size(values)
      do k = 2, n
         value = ordered(k)
         do j = k - 1, 1, -1
            if (ordered(j) <= value) exit
            ordered(j + 1) = ordered(j)
         end do
         ordered(j + 1) = value
      end do
      median = 0.5_dp*(ordered((n + 1)/2) + ordered(n/2 + 1))
   end function median

end module polydem_step_clock
