!> Measures of the whole run from values of the bodies or contacts of each rank. All results are the same on all ranks
!> and do not depend on their number. Collective.
module polydem_global_reductions
   use polydem_communicator, only: communicator_t
   use polydem_exact_all_reduce, only: all_reduce_exact_sums
   use polydem_exact_sum, only: exact_sum_t
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_sort_reals, only: ordered_bits
   use polydem_weighted_median, only: split_groups
   implicit none
   private
   public :: reduce_to_least, reduce_to_greatest, keep_greatest, sum_exactly, find_median

contains

   !> Replace values by the least ones of all ranks, element by element.
   subroutine reduce_to_least(comm, values)
      class(communicator_t), intent(inout) :: comm
      !> Values of this rank
      real(wp), intent(inout) :: values(:)

      values = -values
      call reduce_to_greatest(comm, values)
      values = -values
   end subroutine reduce_to_least

   !> Replace values by the greatest ones of all ranks, element by element.
   subroutine reduce_to_greatest(comm, values)
      class(communicator_t), intent(inout) :: comm
      !> Values of this rank
      real(wp), intent(inout) :: values(:)
      real(dp) :: extremes(size(values))

      if (comm%size == 1_ip) return
      extremes = real(values, dp)
      call comm%all_reduce_max(extremes)
      values = real(extremes, wp)
   end subroutine reduce_to_greatest

   !> Keep the greatest value of all ranks with its place and text. Among equal values, that with the least place is
   !> kept.
   subroutine keep_greatest(comm, value, place, text)
      class(communicator_t), intent(inout) :: comm
      !> Value of this rank
      real(wp), intent(inout) :: value
      !> Number of the body or pair that has it, such as an identifier; not huge
      integer(lp), intent(inout) :: place
      !> Text about it; the same on all ranks afterwards
      character(len=:), allocatable, intent(inout), optional :: text
      real(wp) :: greatest(1)
      integer(lp) :: least(1)

      greatest = value
      call reduce_to_greatest(comm, greatest)
      least = -huge(0_lp)
      if (value >= greatest(1)) least = -place
      call comm%all_reduce_max(least)
      if (present(text)) then
         if (allocated(text) .and. (value < greatest(1) .or. place /= -least(1))) deallocate (text)
         call comm%all_reduce_text(text)
      end if
      value = greatest(1)
      place = -least(1)
   end subroutine keep_greatest

   !> Sum terms of all ranks, rounded once.
   subroutine sum_exactly(comm, terms, total)
      class(communicator_t), intent(inout) :: comm
      !> Terms of this rank, in any order
      real(wp), intent(in) :: terms(:)
      !> Their sum
      real(wp), intent(out) :: total
      type(exact_sum_t) :: sums(1)
      integer :: k

      do k = 1, size(terms)
         call sums(1)%add(terms(k))
      end do
      call all_reduce_exact_sums(comm, sums)
      total = sums(1)%value()
   end subroutine sum_exactly

   !> Find the median of values of all ranks: the least value such that at least half of the values do not exceed it.
   subroutine find_median(comm, values, median)
      class(communicator_t), intent(inout) :: comm
      !> Values of this rank
      real(wp), intent(in) :: values(:)
      !> The median; huge if there is no value
      real(wp), intent(out) :: median
      integer(lp), allocatable :: keys(:, :), weight(:)
      integer(ip), allocatable :: group(:)
      integer(lp) :: cut(2, 1)
      real(wp) :: found(1)
      integer :: k

      allocate (keys(2, size(values)), source=0_lp)
      keys(1, :) = ordered_bits(values)
      allocate (weight(size(values)), source=2_lp)
      allocate (group(size(values)), source=1_ip)
      call split_groups(comm, keys, weight, group, [1_ip], [2_ip], cut)
      found = -huge(1.0_wp)
      do k = 1, size(values)
         if (keys(1, k) == cut(1, 1)) found = values(k)
      end do
      call reduce_to_greatest(comm, found)
      median = found(1)
      if (median <= -huge(1.0_wp)) median = huge(1.0_wp)
   end subroutine find_median

end module polydem_global_reductions
