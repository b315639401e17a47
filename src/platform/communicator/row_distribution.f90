!> Redistribution of table rows into global order: each rank gets one block of the globally sorted table.
!>
!> A row has a key: the global index of its body, and the number of the row among the rows of that body. The block of
!> rank r of P contains the rows of bodies n r/P + 1 to n (r + 1)/P in ascending order of keys, where n is the number of
!> bodies of the run. The blocks of all ranks, one after the other, are equal to the table of a serial run.
module polydem_row_distribution
   use polydem_communicator, only: communicator_t
   use polydem_kinds, only: dp, ip, lp
   use polydem_pair_keys, only: first_of
   use polydem_rank_order, only: sort_by_rank
   use polydem_sort, only: ascending_order
   implicit none
   private
   public :: row_distribution_t, component, vector

   !> Communication plan that brings rows into blocks; `to_blocks` applies it to a column
   type :: row_distribution_t
      !> Number of rows in the block of this rank
      integer(ip) :: n = 0_ip
      !> Number of rows in the blocks of all lower ranks
      integer(lp) :: first = 0_lp
      !> Number of rows in all blocks
      integer(lp) :: total = 0_lp
      !> Local indices of the rows that this rank owns, in the order of their destination ranks
      integer(ip), allocatable, private :: slot(:)
      !> Number of rows to send to each rank, (0:size - 1)
      integer(ip), allocatable, private :: counts(:)
      !> Index of the received row for each row of the block, (n)
      integer(ip), allocatable, private :: source(:)
      !> Whether there is only one rank, and its rows are already in order: there is nothing to send
      logical, private :: is_in_order = .false.
   contains
      procedure :: lay_out
      !> Bring a column into blocks: to_blocks(comm, values, block)
      generic :: to_blocks => longs_to_blocks, doubles_to_blocks
      procedure, private :: longs_to_blocks, doubles_to_blocks
   end type row_distribution_t

contains

   !> Set up the communication plan; collective.
   subroutine lay_out(self, comm, n_bodies, key, slot)
      class(row_distribution_t), intent(inout) :: self
      class(communicator_t), intent(inout) :: comm
      !> Number of bodies of the run
      integer(ip), intent(in) :: n_bodies
      !> Keys of the rows that this rank owns, in any order; each row has one owner
      integer(lp), intent(in) :: key(:)
      !> Indices of these rows in the local columns
      integer(ip), intent(in) :: slot(:)
      integer(lp), allocatable :: sent(:, :), received(:, :), sizes(:)
      integer(ip), allocatable :: destinations(:), counts(:), counts_received(:)
      integer(ip) :: k

      self%is_in_order = comm%size == 1_ip .and. all(key(2:) > key(:size(key) - 1))
      if (self%is_in_order) then
         self%slot = slot
         self%n = size(key, kind=ip)
         self%first = 0_lp
         self%total = int(self%n, lp)
         return
      end if
      destinations = destination_of(key, n_bodies, comm%size)
      call sort_by_rank(destinations, comm%size, self%counts, self%slot)
      allocate (sent(1, size(key)))
      do k = 1_ip, size(key, kind=ip)
         sent(1, k) = key(self%slot(k))
      end do
      self%slot = slot(self%slot)
      call comm%all_to_all(sent, self%counts, received, counts_received)
      self%n = size(received, 2, kind=ip)
      self%source = ascending_order(received(1, :))
      call comm%gather([int(self%n, lp)], sizes, counts)
      self%first = sum(sizes(:comm%rank))
      self%total = sum(sizes)
   end subroutine lay_out

   !> Bring a column of integers into blocks; collective.
   subroutine longs_to_blocks(self, comm, values, block)
      class(row_distribution_t), intent(in) :: self
      class(communicator_t), intent(inout) :: comm
      !> The local column, (width, row)
      integer(lp), intent(in) :: values(:, :)
      !> The block of this rank, (width, n)
      integer(lp), allocatable, intent(out) :: block(:, :)
      integer(lp), allocatable :: sent(:, :), received(:, :)
      integer(ip), allocatable :: counts(:)
      integer(ip) :: k

      allocate (sent(size(values, 1), size(self%slot)))
      do k = 1_ip, size(self%slot, kind=ip)
         sent(:, k) = values(:, self%slot(k))
      end do
      if (self%is_in_order) then
         call move_alloc(sent, block)
         return
      end if
      call comm%all_to_all(sent, self%counts, received, counts)
      allocate (block(size(values, 1), self%n))
      do k = 1_ip, self%n
         block(:, k) = received(:, self%source(k))
      end do
   end subroutine longs_to_blocks

   !> Bring a column of real numbers into blocks without changing a bit; collective.
   subroutine doubles_to_blocks(self, comm, values, block)
      class(row_distribution_t), intent(in) :: self
      class(communicator_t), intent(inout) :: comm
      !> The local column, (width, row)
      real(dp), intent(in) :: values(:, :)
      !> The block of this rank, (width, n)
      real(dp), allocatable, intent(out) :: block(:, :)
      integer(lp), allocatable :: words(:, :), words_of_block(:, :)
      integer :: k

      if (self%is_in_order) then
         allocate (block(size(values, 1), self%n))
         do k = 1, size(block, 2)
            block(:, k) = values(:, self%slot(k))
         end do
         return
      end if
      allocate (words(size(values, 1), size(values, 2)))
      do k = 1, size(values, 2)
         words(:, k) = transfer(values(:, k), 0_lp, size(values, 1))
      end do
      call self%to_blocks(comm, words, words_of_block)
      allocate (block(size(values, 1), self%n))
      do k = 1, size(block, 2)
         block(:, k) = transfer(words_of_block(:, k), 0.0_dp, size(block, 1))
      end do
   end subroutine doubles_to_blocks

   !> One component of each row of a block
   pure function component(block, k)
      !> The block, (width, row)
      real(dp), intent(in) :: block(:, :)
      !> Index of the component
      integer, intent(in) :: k
      real(dp) :: component(size(block, 2))

      component = block(k, :)
   end function component

   !> Two consecutive components of each row of a block
   pure function vector(block, k)
      !> The block, (width, row)
      real(dp), intent(in) :: block(:, :)
      !> Index of the first component
      integer, intent(in) :: k
      real(dp) :: vector(2, size(block, 2))

      vector = block(k:k + 1, :)
   end function vector

   !> Rank whose block contains the row of a key, from 0
   elemental integer(ip) function destination_of(key, n_bodies, n_ranks)
      integer(lp), intent(in) :: key
      integer(ip), intent(in) :: n_bodies, n_ranks

      ! The largest integer r below body P/n.
      destination_of = int((int(first_of(key), lp)*int(n_ranks, lp) - 1_lp)/int(n_bodies, lp), ip)
   end function destination_of

end module polydem_row_distribution
