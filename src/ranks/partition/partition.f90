!> Partition of space among the ranks of a communicator, by weighted recursive coordinate bisection: M. J. Berger &
!> S. H. Bokhari, IEEE Trans. Comput. C-36 (1987) 570.
!>
!> A group of ranks and its bodies are cut across the longer side of the bounding box of the bodies, until each group
!> has one rank. If the cut meets a line of bodies with the same coordinate, as in a lattice, it has a step: the other
!> coordinate separates the bodies on this line.
!>
!> All ranks have the whole partition, with the same bits. The owner of a body depends on all positions and weights, but
!> not on the previous owners: ranks exchange only extremes and sums of integers, which do not depend on the order of
!> the bodies.
!>
!> If a group has an odd number of ranks, its halves have different numbers of ranks and weights in proportion. A cut is
!> off by at most half a body. The ranks on each side share this error, and their number halves from level to level. The
!> weight of a rank is therefore off by at most the greatest weight of a body times
!> (1/1 + 1/2 + 1/3 + 1/5 + 1/9 + ...)/2 = 1.2.
module polydem_partition
   use polydem_communicator, only: communicator_t
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_rank_groups, only: rank_groups_t
   use polydem_sort_reals, only: ordered_bits
   use polydem_weighted_median, only: split_groups, is_below
   implicit none
   private
   public :: partition_t

   !> A partition of space; before the first call of `divide` rank 0 owns all of it
   type :: partition_t
      private
      !> Number of ranks
      integer(ip) :: n_ranks = 1_ip
      !> Greatest keys below each cut, (2, n_ranks - 1); the index of a cut is the first rank above it
      integer(lp), allocatable :: cut(:, :)
      !> Axis perpendicular to each cut, 1 or 2, (n_ranks - 1)
      integer, allocatable :: axis(:)
   contains
      procedure :: divide
      procedure :: owner_of
   end type partition_t

   !> The greatest weight as an integer; sums of up to 2^33 weights do not overflow
   integer(lp), parameter :: greatest_weight = 2_lp**30

contains

   !> Compute the partition such that all ranks have about the same weight. Collective.
   subroutine divide(self, comm, position, weight)
      class(partition_t), intent(inout) :: self
      class(communicator_t), intent(inout) :: comm
      !> Positions of the bodies of this rank, possibly none, (2, body) [m]
      real(wp), intent(in) :: position(:, :)
      !> Work of each body, >= 0, in any unit, (body); if all weights are 0, all bodies have the same weight
      real(dp), intent(in) :: weight(:)
      type(rank_groups_t) :: groups
      integer(lp), allocatable :: keys(:, :), whole(:), cut(:, :)
      real(dp), allocatable :: bounds(:, :)
      integer(ip), allocatable :: group(:)
      integer(ip) :: k

      self%n_ranks = comm%size
      if (allocated(self%cut)) deallocate (self%cut, self%axis)
      allocate (self%cut(2, comm%size - 1_ip), self%axis(comm%size - 1_ip))
      allocate (keys(2, size(weight)), whole(size(weight)))
      call weigh(comm, weight, whole)
      call groups%start(comm%size)
      allocate (group(size(weight)), source=groups%at_rank(0))
      do while (groups%n > 0_ip)
         call bound_groups(comm, groups%n, position, group, bounds)
         self%axis(groups%middle) = merge(1, 2, bounds(3, :) - bounds(1, :) >= bounds(4, :) - bounds(2, :))
         do k = 1_ip, size(group, kind=ip)
            if (group(k) > 0_ip) keys(:, k) = keys_of(self%axis(groups%middle(group(k))), position(:, k))
         end do
         if (allocated(cut)) deallocate (cut)
         allocate (cut(2, groups%n))
         call split_groups(comm, keys, whole, group, groups%middle - groups%first, groups%beyond - groups%first, cut)
         self%cut(:, groups%middle) = cut
         call descend(groups, keys, cut, group)
      end do
   end subroutine divide

   !> Keys of a position in the order along an axis: its coordinate there, then the other one
   pure function keys_of(axis, position) result(keys)
      integer, intent(in) :: axis
      real(wp), intent(in) :: position(2)
      integer(lp) :: keys(2)

      keys = ordered_bits(position)
      if (axis == 2) keys = keys([2, 1])
   end function keys_of

   !> Continue with the next level: halve the groups, and assign each body to a half.
   pure subroutine descend(groups, keys, cut, group)
      type(rank_groups_t), intent(inout) :: groups
      integer(lp), intent(in) :: keys(:, :), cut(:, :)
      !> Group of each body, (body)
      integer(ip), intent(inout) :: group(:)
      integer(ip), allocatable :: first(:)
      integer(ip) :: k

      allocate (first(size(group)))
      do k = 1_ip, size(group, kind=ip)
         if (group(k) == 0_ip) cycle
         first(k) = merge(groups%first(group(k)), groups%middle(group(k)), is_below(keys(:, k), cut(:, group(k))))
      end do
      call groups%halve()
      do k = 1_ip, size(group, kind=ip)
         if (group(k) > 0_ip) group(k) = groups%at_rank(first(k))
      end do
   end subroutine descend

   !> Rank that owns a position: 0 to size - 1 for any position, even far from all bodies
   pure integer(ip) function owner_of(self, position)
      class(partition_t), intent(in) :: self
      !> The position, (2) [m]
      real(wp), intent(in) :: position(2)
      integer(ip) :: beyond, middle

      owner_of = 0_ip
      beyond = self%n_ranks
      do while (beyond - owner_of > 1_ip)
         middle = (owner_of + beyond)/2_ip
         if (is_below(keys_of(self%axis(middle), position), self%cut(:, middle))) then
            beyond = middle
         else
            owner_of = middle
         end if
      end do
   end function owner_of

   !> Weights as integers; their sums do not depend on the order of summation.
   subroutine weigh(comm, weight, whole)
      class(communicator_t), intent(inout) :: comm
      real(dp), intent(in) :: weight(:)
      integer(lp), intent(out) :: whole(:)
      real(dp) :: most(1)

      most = 0.0_dp
      if (size(weight) > 0) most = maxval(weight)
      call comm%all_reduce_max(most)
      whole = 1_lp
      if (most(1) > 0.0_dp) whole = nint(weight/most(1)*real(greatest_weight, dp), lp)
   end subroutine weigh

   !> Bounding boxes of the bodies of all groups.
   subroutine bound_groups(comm, n, position, group, bounds)
      class(communicator_t), intent(inout) :: comm
      integer(ip), intent(in) :: n
      real(wp), intent(in) :: position(:, :)
      integer(ip), intent(in) :: group(:)
      real(dp), allocatable, intent(out) :: bounds(:, :)
      real(dp) :: extremes(4*n), place(2)
      integer(ip) :: k, g

      ! For a group without bodies the lower bounds exceed the upper ones; their differences do not overflow.
      extremes = -0.25_dp*huge(1.0_dp)
      do k = 1_ip, size(group, kind=ip)
         if (group(k) == 0_ip) cycle
         g = 4_ip*group(k)
         place = real(position(:, k), dp)
         extremes(g - 3_ip:g) = max(extremes(g - 3_ip:g), [-place, place])
      end do
      call comm%all_reduce_max(extremes)
      bounds = reshape(extremes, [4, int(n)])
      bounds(1:2, :) = -bounds(1:2, :)
   end subroutine bound_groups

end module polydem_partition
