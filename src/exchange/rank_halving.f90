!> Divisions that halve the ranks again and again, and the bodies with them.
!>
!> If a group has an odd number of ranks its halves are of unequal numbers and get weights in proportion. What
!> distinguishes the divisions is the order in which a group is cut. As a cut is off by half a body at most, and each
!> goes to twice as many ranks as the one after it, no rank is off by much more than the weight of one body: at most
!> by the greatest weight times (1/1 + 1/2 + 1/3 + 1/5 + 1/9 + ...)/2 = 1.2.
module polydem_rank_halving
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_partition, only: partition_t
   use polydem_rank_groups, only: rank_groups_t
   use polydem_team, only: team_t
   use polydem_weighted_cut, only: cut_groups, is_below
   implicit none
   private
   public :: rank_halving_t

   !> A division by halves
   type, abstract, extends(partition_t) :: rank_halving_t
      !> Number of ranks
      integer(ip) :: n_ranks = 1_ip
      !> Last keys below each cut, which is named after the first rank above it, (2, n_ranks - 1)
      integer(lp), allocatable :: cut(:, :)
   contains
      procedure :: divide
      procedure :: owner_of
      procedure(choose_order), deferred :: choose_order
      procedure(keys_of), deferred :: keys_of
   end type rank_halving_t

   abstract interface
      !> Choose in which order the groups of a level are cut.
      pure subroutine choose_order(self, groups, bounds)
         import :: dp, rank_groups_t, rank_halving_t
         class(rank_halving_t), intent(inout) :: self
         !> The groups
         type(rank_groups_t), intent(in) :: groups
         !> Least x and y, greatest x and y of the bodies of each group; without any its sides are
         !> negative, (4, group) [m]
         real(dp), intent(in) :: bounds(:, :)
      end subroutine choose_order

      !> Place in the order in which a group is cut: the second number decides between equal first ones
      pure function keys_of(self, middle, position) result(keys)
         import :: ip, lp, rank_halving_t, wp
         class(rank_halving_t), intent(in) :: self
         !> Middle rank of the group
         integer(ip), intent(in) :: middle
         !> Where, (2) [m]
         real(wp), intent(in) :: position(2)
         integer(lp) :: keys(2)
      end function keys_of
   end interface

   !> The greatest weight as a whole number: up to 2^33 of them have a sum
   integer(lp), parameter :: heaviest = 2_lp**30

contains

   !> Divide space anew.
   subroutine divide(self, team, position, weight)
      class(rank_halving_t), intent(inout) :: self
      class(team_t), intent(inout) :: team
      real(wp), intent(in) :: position(:, :)
      real(dp), intent(in) :: weight(:)
      type(rank_groups_t) :: groups
      integer(lp), allocatable :: keys(:, :), whole(:), cut(:, :)
      real(dp), allocatable :: bounds(:, :)
      integer(ip), allocatable :: group(:)
      integer(ip) :: k

      self%n_ranks = team%size
      if (allocated(self%cut)) deallocate (self%cut)
      allocate (self%cut(2, team%size - 1_ip), keys(2, size(weight)), whole(size(weight)), group(size(weight)))
      call weigh(team, weight, whole)
      call groups%start(team%size)
      group = groups%at_rank(0)
      do while (groups%n > 0_ip)
         call bound_groups(team, groups%n, position, group, bounds)
         call self%choose_order(groups, bounds)
         do k = 1_ip, size(group, kind=ip)
            if (group(k) > 0_ip) keys(:, k) = self%keys_of(groups%middle(group(k)), position(:, k))
         end do
         if (allocated(cut)) deallocate (cut)
         allocate (cut(2, groups%n))
         call cut_groups(team, keys, whole, group, groups%middle - groups%first, groups%beyond - groups%first, cut)
         self%cut(:, groups%middle) = cut
         call part(groups, keys, cut, group)
      end do
   end subroutine divide

   !> Go on to the next level, with groups and with bodies.
   pure subroutine part(groups, keys, cut, group)
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
   end subroutine part

   !> Rank of the process that owns a place
   pure integer(ip) function owner_of(self, position)
      class(rank_halving_t), intent(in) :: self
      real(wp), intent(in) :: position(2)
      integer(ip) :: beyond, middle

      owner_of = 0_ip
      beyond = self%n_ranks
      do while (beyond - owner_of > 1_ip)
         middle = (owner_of + beyond)/2_ip
         if (is_below(self%keys_of(middle, position), self%cut(:, middle))) then
            beyond = middle
         else
            owner_of = middle
         end if
      end do
   end function owner_of

   !> Weights as whole numbers, whose sums do not depend on their order.
   subroutine weigh(team, weight, whole)
      class(team_t), intent(inout) :: team
      real(dp), intent(in) :: weight(:)
      integer(lp), intent(out) :: whole(:)
      real(dp) :: most(1)

      most = 0.0_dp
      if (size(weight) > 0) most = maxval(weight)
      call team%maximise(most)
      whole = 1_lp
      if (most(1) > 0.0_dp) whole = nint(weight/most(1)*real(heaviest, dp), lp)
   end subroutine weigh

   !> Bounds of the bodies of all groups.
   subroutine bound_groups(team, n, position, group, bounds)
      class(team_t), intent(inout) :: team
      integer(ip), intent(in) :: n
      real(wp), intent(in) :: position(:, :)
      integer(ip), intent(in) :: group(:)
      real(dp), allocatable, intent(out) :: bounds(:, :)
      real(dp) :: extremes(4*n), place(2)
      integer(ip) :: k, g

      ! so far off that a group without bodies has sides below zero, which are numbers still
      extremes = -0.25_dp*huge(1.0_dp)
      do k = 1_ip, size(group, kind=ip)
         if (group(k) == 0_ip) cycle
         g = 4_ip*group(k)
         place = real(position(:, k), dp)
         extremes(g - 3_ip:g) = max(extremes(g - 3_ip:g), [-place, place])
      end do
      call team%maximise(extremes)
      bounds = reshape(extremes, [4, int(n)])
      bounds(1:2, :) = -bounds(1:2, :)
   end subroutine bound_groups

end module polydem_rank_halving
