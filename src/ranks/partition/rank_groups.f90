!> Groups of ranks for recursive bisection: groups are halved until each has one rank.
!>
!> A group of the ranks first to beyond - 1 is cut in front of its middle rank, (first + beyond)/2. The groups depend on
!> the number of ranks only. The middle rank identifies a cut: each of 1 to size - 1 is the middle rank of one cut.
module polydem_rank_groups
   use polydem_kinds, only: ip
   implicit none
   private
   public :: rank_groups_t

   !> The groups of one level with more than one rank
   type :: rank_groups_t
      !> Number of groups
      integer(ip) :: n = 0_ip
      !> First rank of each group
      integer(ip), allocatable :: first(:)
      !> First rank of the upper half of each group
      integer(ip), allocatable :: middle(:)
      !> One more than the last rank of each group
      integer(ip), allocatable :: beyond(:)
      !> Group that begins with each rank; 0 if there is none, or if the group has one rank, (0:ranks - 1)
      integer(ip), allocatable :: at_rank(:)
      !> Whether there is a cut in front of each rank, (0:ranks)
      logical, allocatable, private :: is_cut(:)
   contains
      procedure :: start
      procedure :: halve
   end type rank_groups_t

contains

   !> Start with one group of all ranks.
   pure subroutine start(self, n_ranks)
      class(rank_groups_t), intent(inout) :: self
      !> Number of ranks
      integer(ip), intent(in) :: n_ranks

      if (allocated(self%is_cut)) deallocate (self%is_cut)
      allocate (self%is_cut(0:n_ranks), source=.false.)
      self%is_cut(0) = .true.
      self%is_cut(n_ranks) = .true.
      call list(self, n_ranks)
   end subroutine start

   !> Replace all groups by their halves.
   pure subroutine halve(self)
      class(rank_groups_t), intent(inout) :: self
      integer(ip) :: g

      do g = 1_ip, self%n
         self%is_cut(self%middle(g)) = .true.
      end do
      call list(self, ubound(self%is_cut, 1, kind=ip))
   end subroutine halve

   !> List the groups with more than one rank.
   pure subroutine list(self, n_ranks)
      class(rank_groups_t), intent(inout) :: self
      integer(ip), intent(in) :: n_ranks
      integer(ip) :: first(n_ranks/2_ip), beyond(n_ranks/2_ip), rank, start, n

      if (allocated(self%at_rank)) deallocate (self%at_rank)
      allocate (self%at_rank(0:n_ranks - 1_ip), source=0_ip)
      n = 0_ip
      start = 0_ip
      do rank = 1_ip, n_ranks
         if (.not. self%is_cut(rank)) cycle
         if (rank - start > 1_ip) then
            n = n + 1_ip
            first(n) = start
            beyond(n) = rank
            self%at_rank(start) = n
         end if
         start = rank
      end do
      self%n = n
      self%first = first(1:n)
      self%beyond = beyond(1:n)
      self%middle = (self%first + self%beyond)/2_ip
   end subroutine list

end module polydem_rank_groups
