!> Ranges of consecutive pairs for threads.
module polydem_pair_ranges
   use polydem_kinds, only: ip, lp
   implicit none
   private
   public :: divide_pairs, most_ranges

   !> Largest number of ranges
   integer(ip), parameter :: most_ranges = 256_ip
   !> Smallest number of pairs for which a thread saves time
   integer(ip), parameter :: least_pairs = 64_ip

contains

   !> Divide the pairs into ranges of about equal length. All pairs with the same lower slot are in one range.
   pure subroutine divide_pairs(n_pairs, first, n_ranges, ends)
      !> Number of pairs
      integer(ip), intent(in) :: n_pairs
      !> Lower slot of each pair, ascending, (n_pairs) or longer
      integer(ip), intent(in) :: first(:)
      !> Largest number of ranges; afterwards the number of ranges, at least 1
      integer(ip), intent(inout) :: n_ranges
      !> Index of the last pair of each range; the first range begins after ends(0) = 0
      integer(ip), intent(inout) :: ends(0:)
      integer(ip) :: r, p

      n_ranges = max(1_ip, min(n_ranges, n_pairs/least_pairs))
      ends(0) = 0_ip
      do r = 1_ip, n_ranges - 1_ip
         p = max(ends(r - 1_ip), int(int(n_pairs, lp)*int(r, lp)/int(n_ranges, lp), ip))
         do while (p > 0_ip .and. p < n_pairs)
            if (first(p) < first(p + 1_ip)) exit
            p = p + 1_ip
         end do
         ends(r) = p
      end do
      ends(n_ranges) = n_pairs
   end subroutine divide_pairs

end module polydem_pair_ranges
