!> Ranges of consecutive pairs for threads.
module polydem_pair_ranges
   use polydem_kinds, only: dp, ip
   use polydem_pieces, only: pieces_t
   implicit none
   private
   public :: divide_pairs, balance_ranges, most_ranges

   !> Largest number of ranges
   integer(ip), parameter :: most_ranges = 256_ip
   !> Smallest number of pairs for which a thread saves time
   integer(ip), parameter :: least_pairs = 64_ip
   !> Part of the way to ends at which all ranges would have taken equal times, by which `balance_ranges` moves the
   !> ends: little, since a thread that was interrupted for a moment is no reason to move much
   real(dp), parameter :: balance_rate = 0.02_dp

contains

   !> Divide the pairs into ranges. All pairs with the same lower slot are in one range.
   pure subroutine divide_pairs(n_pairs, first, pieces, n_ranges, upto, ends)
      !> Number of pairs
      integer(ip), intent(in) :: n_pairs
      !> Lower piece of each pair, ascending, (n_pairs) or longer
      integer(ip), intent(in) :: first(:)
      !> Pieces of the bodies: a range ends with the last pair of a body
      type(pieces_t), intent(in) :: pieces
      !> Largest number of ranges; afterwards the number of ranges, at least 1
      integer(ip), intent(inout) :: n_ranges
      !> Part of all pairs up to the end of each range, (0:n_ranges). Equal parts if it is not allocated or for another
      !> number of ranges
      real(dp), allocatable, intent(inout) :: upto(:)
      !> Index of the last pair of each range; the first range begins after ends(0) = 0
      integer(ip), intent(inout) :: ends(0:)
      integer(ip) :: r, p

      n_ranges = max(1_ip, min(n_ranges, n_pairs/least_pairs))
      if (allocated(upto)) then
         if (size(upto) /= n_ranges + 1_ip) deallocate (upto)
      end if
      if (.not. allocated(upto)) then
         allocate (upto(0:n_ranges))
         upto(:) = [(real(r, dp)/real(n_ranges, dp), r=0_ip, n_ranges)]
      end if
      ends(0) = 0_ip
      do r = 1_ip, n_ranges - 1_ip
         p = max(ends(r - 1_ip), int(real(n_pairs, dp)*upto(r), ip))
         do while (p > 0_ip .and. p < n_pairs)
            if (pieces%body_of(first(p)) < pieces%body_of(first(p + 1_ip))) exit
            p = p + 1_ip
         end do
         ends(r) = p
      end do
      ends(n_ranges) = n_pairs
   end subroutine divide_pairs

   !> Move the ends of the ranges such that all take more equal times.
   pure subroutine balance_ranges(seconds, upto)
      !> Time that each range took, greater than 0, (at most `most_ranges`) [s]
      real(dp), intent(in) :: seconds(:)
      !> Part of all pairs up to the end of each range, from 0 to 1
      real(dp), intent(inout) :: upto(0:)
      real(dp) :: ends(0:most_ranges), passed, share
      integer :: r, k

      ends(:size(seconds)) = upto
      passed = 0.0_dp
      k = 1
      do r = 1, size(seconds) - 1
         share = sum(seconds)*real(r, dp)/real(size(seconds), dp)
         do while (passed + seconds(k) < share .and. k < size(seconds))
            passed = passed + seconds(k)
            k = k + 1
         end do
         share = ends(k - 1) + (ends(k) - ends(k - 1))*(share - passed)/seconds(k)
         upto(r) = upto(r) + balance_rate*(share - upto(r))
      end do
   end subroutine balance_ranges

end module polydem_pair_ranges
