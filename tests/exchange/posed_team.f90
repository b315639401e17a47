!> Teams for tests of one process, which plays one rank after the other.
module posed_team
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_lone_team, only: lone_team_t
   use polydem_partition, only: partition_t
   use polydem_partition_factory, only: new_partition
   use polydem_errors, only: error_t
   use polydem_random, only: new_random, random_t
   implicit none
   private
   public :: posed_team_t, pose, divided, strew, shares, owners_of

   !> A rank of a team of which nobody else has any body; or one that is told what all ranks have gathered before
   type, extends(lone_team_t) :: posed_team_t
      !> Whether lists of the others are told
      logical :: told = .false.
      !> Lists that were gathered, one after the other, (rank)
      integer(lp), allocatable :: lists(:)
      !> Their lengths, (0:size - 1)
      integer(ip), allocatable :: lengths(:)
   contains
      procedure :: gather_longs
   end type posed_team_t

contains

   !> Rank 0 of a team.
   subroutine pose(team, size)
      type(posed_team_t), intent(out) :: team
      integer(ip), intent(in) :: size

      team%size = size
      allocate (team%lists(0), team%lengths(0:size - 1_ip))
      team%lengths = 0_ip
   end subroutine pose

   !> Keep the list of this rank, or give the lists of all.
   subroutine gather_longs(self, mine, all_of_them, counts)
      class(posed_team_t), intent(inout) :: self
      integer(lp), intent(in), contiguous :: mine(:)
      integer(lp), allocatable, intent(out) :: all_of_them(:)
      integer(ip), allocatable, intent(out) :: counts(:)

      if (.not. self%told) then
         self%lists = [self%lists, mine]
         self%lengths(self%rank) = size(mine, kind=ip)
      end if
      all_of_them = self%lists
      allocate (counts(0:self%size - 1_ip))
      counts = self%lengths
   end subroutine gather_longs

   !> Division of bodies that are all on rank 0.
   subroutine divided(partition, name, size, position, weight)
      class(partition_t), allocatable, intent(out) :: partition
      character(len=*), intent(in) :: name
      !> Number of ranks
      integer(ip), intent(in) :: size
      real(wp), intent(in) :: position(:, :)
      real(dp), intent(in) :: weight(:)
      type(posed_team_t) :: team
      type(error_t), allocatable :: error

      call pose(team, size)
      call new_partition(partition, name, error)
      if (.not. allocated(error)) call partition%divide(team, position, weight)
   end subroutine divided

   !> Owner of each body
   pure function owners_of(partition, position) result(owner)
      class(partition_t), intent(in) :: partition
      real(wp), intent(in) :: position(:, :)
      integer(ip) :: owner(size(position, 2))
      integer :: k

      do k = 1, size(owner)
         owner(k) = partition%owner_of(position(:, k))
      end do
   end function owners_of

   !> Weight of each rank, (0:size - 1)
   pure function shares(partition, size, position, weight) result(share)
      class(partition_t), intent(in) :: partition
      integer(ip), intent(in) :: size
      real(wp), intent(in) :: position(:, :)
      real(dp), intent(in) :: weight(:)
      real(dp) :: share(0:size - 1_ip)
      integer(ip) :: k, owner

      share = 0.0_dp
      do k = 1_ip, ubound(position, 2, kind=ip)
         owner = partition%owner_of(position(:, k))
         share(owner) = share(owner) + weight(k)
      end do
   end function shares

   !> Bodies strewn over a rectangle, of weights between 0.5 and 1.
   subroutine strew(seed, width, height, position, weight)
      integer(ip), intent(in) :: seed
      real(wp), intent(in) :: width, height
      real(wp), intent(out) :: position(:, :)
      real(dp), intent(out) :: weight(:)
      type(random_t) :: random
      integer :: k

      random = new_random(seed)
      do k = 1, size(weight)
         position(1, k) = random%between(-width, 0.0_wp)
         position(2, k) = random%between(0.0_wp, height)
         weight(k) = real(random%between(0.5_wp, 1.0_wp), dp)
      end do
   end subroutine strew

end module posed_team
