!> What waiting costs on this machine: a barrier of all threads, and starting and joining them.
!>
!> The numbers enter the model of the parallel finders: a finder that waits k times in a step cannot take less than k
!> barriers. They are measured just before a sample, so that both see the same load.
module polydem_waiting_cost
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
      !> Time of a barrier, and of a parallel region in which nothing is done [s]
      real(dp), intent(out) :: barrier, region
      real(dp) :: barriers(n_batches), regions(n_batches), since
      integer :: b, k

      do b = 1, n_batches
         since = wall_seconds()
         do k = 1, n_rounds
            !$omp parallel default(none)
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
      region = median(regions)
      barrier = max(0.0_dp, median(barriers) - region/real(n_rounds, dp))
   end subroutine measure_waiting

end module polydem_waiting_cost
