!> Groups of ranks that are halved again and again until every rank is alone.
!>
!> A group of ranks first to beyond - 1 is cut in front of its middle rank, (first + beyond)/2. So the groups follow
!> from the number of ranks alone, and their cuts are told apart by their middle ranks: 1 to size - 1, each of them
!> once.
module polydem_rank_groups
   use polydem_kinds, only: ip
   implicit none
   private
   public :: rank_groups_t

   !> The groups of one level that are to be halved
   type :: rank_groups_t
      !> Number of groups
      integer(ip) :: n = 0_ip
      !> First rank of each
      integer(ip), allocatable :: first(:)
      !> First rank of its upper half
      integer(ip), allocatable :: middle(:)
      !> One more than its last rank
      integer(ip), allocatable :: beyond(:)
      !> The group that begins with a rank; 0 if none does, or if that rank is alone, (0:ranks - 1)
      integer(ip), allocatable :: at_rank(:)
      !> Whether ranks up to this one and those from it on are parted, (0:ranks)
      logical, allocatable, private :: parted(:)
   contains
      procedure :: start
      procedure :: halve
   end type rank_groups_t

contains

   !> One group of all ranks.
   pure subroutine start(self, n_ranks)
      class(rank_groups_t), intent(inout) :: self
      !> Number of ranks
      integer(ip), intent(in) :: n_ranks

      if (allocated(self%parted)) deallocate (self%parted)
      allocate (self%parted(0:n_ranks), source=.false.)
      self%parted(0) = .true.
      self%parted(n_ranks) = .true.
      call list(self, n_ranks)
   end subroutine start

   !> Go on to the halves of all groups.
   pure subroutine halve(self)
      class(rank_groups_t), intent(inout) :: self
      integer(ip) :: g

      do g = 1_ip, self%n
         self%parted(self%middle(g)) = .true.
      end do
      call list(self, ubound(self%parted, 1, kind=ip))
   end subroutine halve

   !> List the groups that have several ranks.
   pure subroutine list(self, n_ranks)
      class(rank_groups_t), intent(inout) :: self
      integer(ip), intent(in) :: n_ranks
      integer(ip) :: first(n_ranks/2_ip), beyond(n_ranks/2_ip), rank, start, n

      if (allocated(self%at_rank)) deallocate (self%at_rank)
      allocate (self%at_rank(0:n_ranks - 1_ip), source=0_ip)
      n = 0_ip
      start = 0_ip
      do rank = 1_ip, n_ranks
         if (.not. self%parted(rank)) cycle
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
