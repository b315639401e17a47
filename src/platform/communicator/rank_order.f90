!> Stable sort of items by their destination ranks.
module polydem_rank_order
   use polydem_kinds, only: ip
   implicit none
   private
   public :: sort_by_rank

contains

   !> Sort items by rank in O(items + ranks). The sort is stable.
   pure subroutine sort_by_rank(rank, n_ranks, counts, order)
      !> Destination rank of each item, 0 to n_ranks - 1, (item)
      integer(ip), intent(in) :: rank(:)
      !> Number of ranks
      integer(ip), intent(in) :: n_ranks
      !> Number of items per destination rank, (0:n_ranks - 1)
      integer(ip), allocatable, intent(out) :: counts(:)
      !> Indices of the items in the order of their ranks, (item)
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
