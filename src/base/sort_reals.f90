!> Ranking of real numbers.
module polydem_sort_reals
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_sort, only: sort_keys
   implicit none
   private
   public :: sort_reals

contains

   !> Indices of real numbers in ascending order, equal numbers in the order in which they stand.
   !>
   !> The numbers are compared in double precision, by their bits: read as integers, the bits of IEEE
   !> numbers ascend with positive numbers and, with all but the sign reversed, with negative ones.
   pure subroutine sort_reals(numbers, ranked)
      !> Numbers to rank
      real(wp), intent(in) :: numbers(:)
      !> Index of the least number first, same size
      integer(ip), intent(out) :: ranked(:)
      integer(lp), allocatable :: keys(:), spare_keys(:)
      integer(ip), allocatable :: spare_ranked(:)
      integer(ip) :: k, n

      n = size(numbers, kind=ip)
      allocate (keys(n), spare_keys(n), spare_ranked(n))
      do k = 1_ip, n
         ! adding zero turns -0 into +0
         keys(k) = transfer(real(numbers(k), dp) + 0.0_dp, 0_lp)
         if (keys(k) < 0_lp) keys(k) = ieor(keys(k), huge(0_lp))
         ranked(k) = k
      end do
      call sort_keys(n, keys, ranked, spare_keys, spare_ranked)
   end subroutine sort_reals

end module polydem_sort_reals
