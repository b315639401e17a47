!> What waiting costs on this machine: a barrier of all threads, and starting and joining them.
!>
!> The numbers enter the model of the parallel finders: a finder that waits k times in a step cannot take less than k
!> barriers. They are measured just before a sample, so that both see the same load.
module polydem_waiting_cost
   use omp_lib, only: omp_get_max_threads, omp_get_thread_num
   use polydem_clock, only: wall_seconds
   use polydem_kinds, only: dp
   use polydem_step_clock, only: median
   implicit none
   private
   public :: measure_waiting

   !> Number of batches, of which the median counts, and barriers or regions of one batch
   integer, parameter :: n_batches = 15, n_rounds = 20

contains

   !> Measure the cost of one barrier and of one parallel region with the present number of threads.
   subroutine measure_waiting(barrier, region)
      !> Time of a barrier, and of a parallel region in which threads do next to nothing; 0 with one thread [s]
      real(dp), intent(out) :: barrier, region
      real(dp) :: barriers(n_batches), regions(n_batches), since
      ! Last round of each thread, on a cache line of its own
      integer, allocatable :: last(:, :)
      integer :: b, k

      allocate (last(16, 0:omp_get_max_threads() - 1))
      last = 0
      do b = 1, n_batches
         since = wall_seconds()
         do k = 1, n_rounds
            !$omp parallel default(none) shared(last, k)
            last(1, omp_get_thread_num()) = k
            !$omp end parallel
         end do
         regions(b) = (wall_seconds() - since)/real(n_rounds, dp)
         since = wall_seconds()
         !$omp parallel default(none) private(k)
         do k = 1, n_rounds
            !$omp barrier
         end do
         !$omp end parallel
         barriers(b) = (wall_seconds() - since)/real(n_rounds, dp)
      end do
      region = 0.0_dp
      barrier = 0.0_dp
      if (count(last(1, :) == n_rounds) < 2) return
      region = median(regions)
      barrier = max(0.0_dp, median(barriers) - region/real(n_rounds, dp))
   end subroutine measure_waiting

end module polydem_waiting_cost
