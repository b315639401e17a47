!> Sorting permutation of real numbers.
module polydem_sort_reals
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_sort, only: sort_keys
   implicit none
   private
   public :: sort_reals, ordered_bits

contains

   !> Indices of real numbers in ascending order of the numbers. The sort is stable and compares in double precision.
   pure subroutine sort_reals(numbers, ranked)
      !> The numbers, (n)
      real(wp), intent(in) :: numbers(:)
      !> Indices into `numbers`, that of the smallest number first, (n)
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

   !> A 64-bit integer that increases with the number (in double precision).
   !>
   !> The bits of positive IEEE numbers, read as integers, have the order of the numbers. For negative numbers all bits
   !> but the sign are inverted.
   elemental integer(lp) function ordered_bits(number) result(bits)
      !> Any number
      real(wp), intent(in) :: number

      ! Adding zero turns -0 into +0.
      bits = transfer(real(number, dp) + 0.0_dp, 0_lp)
      if (bits < 0_lp) bits = ieor(bits, huge(0_lp))
   end function ordered_bits

end module polydem_sort_reals
