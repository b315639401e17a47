!> Communicator for tests in one process, which acts as one rank after the other.
module posed_communicator
   use polydem_communicator, only: communicator_t
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_partition, only: partition_t
   use polydem_random, only: new_random, random_t
   implicit none
   private
   public :: posed_communicator_t, pose, divided, strew, shares, owners_of

   !> A rank of a communicator. In a first round it records the lists of the ranks; the other ranks seem to have no
   !> bodies. In a second round it returns the lists of all ranks.
   type, extends(communicator_t) :: posed_communicator_t
      !> Whether the lists of all ranks are recorded
      logical :: is_complete = .false.
      !> Lists of the ranks, one after the other
      integer(lp), allocatable :: lists(:)
      !> Their lengths, (0:size - 1)
      integer(ip), allocatable :: lengths(:)
   contains
      procedure :: gather_longs
   end type posed_communicator_t

contains

   !> Make rank 0 of a communicator.
   subroutine pose(comm, size)
      type(posed_communicator_t), intent(out) :: comm
      integer(ip), intent(in) :: size

      comm%size = size
      allocate (comm%lists(0), comm%lengths(0:size - 1_ip))
      comm%lengths = 0_ip
   end subroutine pose

   !> Record the list of this rank unless all are recorded, and return the recorded lists.
   subroutine gather_longs(self, mine, all_of_them, counts)
      class(posed_communicator_t), intent(inout) :: self
      integer(lp), intent(in), contiguous :: mine(:)
      integer(lp), allocatable, intent(out) :: all_of_them(:)
      integer(ip), allocatable, intent(out) :: counts(:)

      if (.not. self%is_complete) then
         self%lists = [self%lists, mine]
         self%lengths(self%rank) = size(mine, kind=ip)
      end if
      all_of_them = self%lists
      allocate (counts(0:self%size - 1_ip))
      counts = self%lengths
   end subroutine gather_longs

   !> Partition of bodies that are all on rank 0
   subroutine divided(partition, size, position, weight)
      type(partition_t), intent(out) :: partition
      !> Number of ranks
      integer(ip), intent(in) :: size
      real(wp), intent(in) :: position(:, :)
      real(dp), intent(in) :: weight(:)
      type(posed_communicator_t) :: comm

      call pose(comm, size)
      call partition%divide(comm, position, weight)
   end subroutine divided

   !> Owner of each body
   pure function owners_of(partition, position) result(owner)
      type(partition_t), intent(in) :: partition
      real(wp), intent(in) :: position(:, :)
      integer(ip) :: owner(size(position, 2))
      integer :: k

      do k = 1, size(owner)
         owner(k) = partition%owner_of(position(:, k))
      end do
   end function owners_of

   !> Weight of each rank, (0:size - 1)
   pure function shares(partition, size, position, weight) result(share)
      type(partition_t), intent(in) :: partition
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

   !> Random positions in a rectangle, with weights between 0.5 and 1
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

end module posed_communicator
