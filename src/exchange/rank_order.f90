!> Putting things into the order of the processes that they go to.
module polydem_rank_order
   use polydem_kinds, only: ip
   implicit none
   private
   public :: sort_by_rank

contains

   !> Order things by their processes; those of one process stay in the order they have.
   pure subroutine sort_by_rank(rank, n_ranks, counts, order)
      !> Process that each goes to, 0 to n_ranks - 1, (thing)
      integer(ip), intent(in) :: rank(:)
      !> Number of processes
      integer(ip), intent(in) :: n_ranks
      !> Things that go to each process, (0:n_ranks - 1)
      integer(ip), allocatable, intent(out) :: counts(:)
      !> Things in the order of their processes, (thing)
      integer(ip), allocatable, intent(out) :: order(:)
      integer(ip) :: next(0:n_ranks), k

      next = 0_ip
      do k = 1_ip, size(rank, kind=ip)
         next(rank(k) + 1_ip) = next(rank(k) + 1_ip) + 1_ip
      end do
      allocate (counts(0:n_ranks - 1_ip), order(size(rank)))
      counts = next(1:)
      do k = 1_ip, n_ranks
         next(k) = next(k) + next(k - 1_ip)
      end do
      do k = 1_ip, size(rank, kind=ip)
         next(rank(k)) = next(rank(k)) + 1_ip
         order(next(rank(k))) = k
      end do
   end subroutine sort_by_rank

end module polydem_rank_order
