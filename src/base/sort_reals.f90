!> Ranking of real numbers.
module polydem_sort_reals
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_sort, only: sort_keys
   implicit none
   private
   public :: sort_reals, ordered_bits

contains

   !> Indices of real numbers in ascending order, equal numbers in the order in which they stand.
   !> The numbers are compared in double precision.
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
         keys(k) = ordered_bits(numbers(k))
         ranked(k) = k
      end do
      call sort_keys(n, keys, ranked, spare_keys, spare_ranked)
   end subroutine sort_reals

   !> An integer that ascends with the number, in double precision.
   !>
   !> Read as integers, the bits of IEEE numbers ascend with positive numbers and, with all but the sign reversed, with
   !> negative ones.
   elemental integer(lp) function ordered_bits(number) result(bits)
      !> Any number
      real(wp), intent(in) :: number

      ! adding zero turns -0 into +0
      bits = transfer(real(number, dp) + 0.0_dp, 0_lp)
      if (bits < 0_lp) bits = ieor(bits, huge(0_lp))
   end function ordered_bits

end module polydem_sort_reals
