!> Rows that processes own, brought into ascending order over all of them: into blocks, one for each process.
!>
!> A row has a key: the number of its body among all bodies of the run, and its number among the rows of that body. The
!> block of process r of P are the rows of bodies n r/P + 1 to n (r + 1)/P, in ascending order of keys. So the blocks
!> of all processes, one after the other, are what a process on its own would have.
module polydem_row_blocks
   use polydem_kinds, only: dp, ip, lp
   use polydem_rank_order, only: sort_by_rank
   use polydem_sort, only: sort_keys
   use polydem_team, only: team_t
   implicit none
   private
   public :: row_blocks_t, row_key, component, vector

   !> How some rows get into blocks; columns follow by `bring`
   type :: row_blocks_t
      !> Rows in the block of this process
      integer(ip) :: n = 0_ip
      !> Rows in the blocks before it
      integer(lp) :: first = 0_lp
      !> Rows in all blocks
      integer(lp) :: total = 0_lp
      !> Rows that this process knows, its own ones among them: places in the columns that will be brought
      integer(ip) :: n_known = 0_ip
      !> Places of the rows that this process owns, in the order of the processes they go to
      integer(ip), allocatable, private :: slot(:)
      !> Rows that go to each process, (0:size - 1)
      integer(ip), allocatable, private :: counts(:)
      !> Which of the received rows becomes each row of the block
      integer(ip), allocatable, private :: source(:)
      !> Whether the rows are in the block already
      logical, private :: is_settled = .false.
   contains
      procedure :: lay_out
      !> Bring a column into blocks: bring(team, values, block)
      generic :: bring => bring_longs, bring_doubles
      procedure, private :: bring_longs, bring_doubles
   end type row_blocks_t

contains

   !> Key of a row
   elemental integer(lp) function row_key(body, k)
      !> Number of its body among all bodies of the run, from 1
      integer(ip), intent(in) :: body
      !> Its number among the rows of that body
      integer(ip), intent(in) :: k

      row_key = ior(shiftl(int(body, lp), 32), int(k, lp))
   end function row_key

   !> Find out where rows go; collective.
   subroutine lay_out(self, team, n_bodies, n_known, key, slot)
      class(row_blocks_t), intent(inout) :: self
      !> Processes
      class(team_t), intent(inout) :: team
      !> Bodies of the run
      integer(ip), intent(in) :: n_bodies
      !> Rows that this process knows: places in the columns that will be brought
      integer(ip), intent(in) :: n_known
      !> Keys of the rows that this process owns, in any order; each has one owner
      integer(lp), intent(in) :: key(:)
      !> Places of these rows among those it knows
      integer(ip), intent(in) :: slot(:)
      integer(lp), allocatable :: sent(:, :), received(:, :), sizes(:)
      integer(ip), allocatable :: home(:), counts(:)
      integer(ip) :: k

      self%n_known = n_known
      home = home_of(key, n_bodies, team%size)
      call sort_by_rank(home, team%size, self%counts, self%slot)
      allocate (sent(1, size(key)))
      do k = 1_ip, size(key, kind=ip)
         sent(1, k) = key(self%slot(k))
      end do
      self%slot = slot(self%slot)
      call team%trade(sent, self%counts, received, counts)
      self%n = size(received, 2, kind=ip)
      call rank_keys(received(1, :), self%source)
      self%is_settled = team%size == 1_ip .and. all(self%source(2:) > self%source(:self%n - 1_ip))
      call team%gather([int(self%n, lp)], sizes, counts)
      self%first = sum(sizes(:team%rank))
      self%total = sum(sizes)
   end subroutine lay_out

   !> Bring a column of whole numbers into blocks; collective.
   subroutine bring_longs(self, team, values, block)
      class(row_blocks_t), intent(in) :: self
      !> Processes, as in `lay_out`
      class(team_t), intent(inout) :: team
      !> The column, (width, place)
      integer(lp), intent(in) :: values(:, :)
      !> The rows of this process' block, (width, row)
      integer(lp), allocatable, intent(out) :: block(:, :)
      integer(lp), allocatable :: sent(:, :), received(:, :)
      integer(ip), allocatable :: counts(:)
      integer(ip) :: k

      allocate (sent(size(values, 1), size(self%slot)))
      do k = 1_ip, size(self%slot, kind=ip)
         sent(:, k) = values(:, self%slot(k))
      end do
      if (self%is_settled) then
         call move_alloc(sent, block)
         return
      end if
      call team%trade(sent, self%counts, received, counts)
      allocate (block(size(values, 1), self%n))
      do k = 1_ip, self%n
         block(:, k) = received(:, self%source(k))
      end do
   end subroutine bring_longs

   !> Bring a column of real numbers into blocks, with all their bits; collective.
   subroutine bring_doubles(self, team, values, block)
      class(row_blocks_t), intent(in) :: self
      !> Processes, as in `lay_out`
      class(team_t), intent(inout) :: team
      !> The column, (width, place)
      real(dp), intent(in) :: values(:, :)
      !> The rows of this process' block, (width, row)
      real(dp), allocatable, intent(out) :: block(:, :)
      integer(lp), allocatable :: words(:, :), words_of_block(:, :)
      integer :: k

      if (self%is_settled) then
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
      call self%bring(team, words, words_of_block)
      allocate (block(size(values, 1), self%n))
      do k = 1, size(block, 2)
         block(:, k) = transfer(words_of_block(:, k), 0.0_dp, size(block, 1))
      end do
   end subroutine bring_doubles

   !> One number of each row of a block
   pure function component(block, k)
      !> The block, (width, row)
      real(dp), intent(in) :: block(:, :)
      !> Which of the numbers of a row
      integer, intent(in) :: k
      real(dp) :: component(size(block, 2))

      component = block(k, :)
   end function component

   !> Two numbers of each row of a block
   pure function vector(block, k)
      !> The block, (width, row)
      real(dp), intent(in) :: block(:, :)
      !> The first of the two
      integer, intent(in) :: k
      real(dp) :: vector(2, size(block, 2))

      vector = block(k:k + 1, :)
   end function vector

   !> The process whose block the row of a key is in, from 0
   elemental integer(ip) function home_of(key, n_bodies, n_processes)
      integer(lp), intent(in) :: key
      integer(ip), intent(in) :: n_bodies, n_processes

      ! The greatest r below body P/n.
      home_of = int((shiftr(key, 32)*int(n_processes, lp) - 1_lp)/int(n_bodies, lp), ip)
   end function home_of

   !> Places of keys in their ascending order
   pure subroutine rank_keys(keys, ranked)
      integer(lp), intent(in) :: keys(:)
      integer(ip), allocatable, intent(out) :: ranked(:)
      integer(lp), allocatable :: sorted(:), spare_keys(:)
      integer(ip), allocatable :: spare(:)
      integer(ip) :: k, n

      n = size(keys, kind=ip)
      allocate (ranked(n))
      do k = 1_ip, n
         ranked(k) = k
      end do
      if (all(keys(2:) > keys(:n - 1_ip))) return
      allocate (sorted(n), spare_keys(n), spare(n))
      sorted = keys
      call sort_keys(n, sorted, ranked, spare_keys, spare)
   end subroutine rank_keys

end module polydem_row_blocks
