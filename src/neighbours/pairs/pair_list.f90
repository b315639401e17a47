!> List of the pairs of pieces whose boxes overlap. The list persists, and each step changes it in place.
!>
!> Pairs are in ascending order of (first, second). `apply` takes the ordered changes of a step and finds each by
!> bisection. It then moves the blocks of pairs between the changes, each block once and only if its position changes. A
!> step without changes costs nothing. `carry` applies the same moves to an array with one value per pair.
!>
!> Blocks can move in place because they keep their order. Blocks that move down are moved from the front, blocks that
!> move up from the back. No block overwrites another one that has yet to move.
module polydem_pair_list
   use polydem_grow, only: grow
   use polydem_kinds, only: ip, lp, wp
   use polydem_pair_changes, only: pair_changes_t
   use polydem_pair_keys, only: first_of, pair_key, second_of
   implicit none
   private
   public :: pair_list_t

   !> Pairs 1..n, and the changes of the last step
   type :: pair_list_t
      !> Number of pairs
      integer(ip) :: n = 0_ip
      !> Lower slot of each pair; may be longer than n
      integer(ip), allocatable :: first(:)
      !> Higher slot of each pair; may be longer than n
      integer(ip), allocatable :: second(:)
      !> Number of pairs that began in the last step
      integer(ip) :: n_began = 0_ip
      !> Their indices in the present list, ascending
      integer(ip), allocatable :: began(:)
      !> Number of pairs that ended in the last step
      integer(ip) :: n_ended = 0_ip
      !> Their indices in the previous list, ascending
      integer(ip), allocatable :: ended(:)
      !> Number of pairs of each piece, (piece)
      integer(ip), allocatable :: pairs_of(:)
      !> Number of pieces with pairs
      integer(ip) :: n_paired = 0_ip
      !> Number of pieces without a pair, or whose pairs all ended in the last step, of which a pair began in that step
      integer(ip) :: n_joined = 0_ip
      !> Their slots, each once; may be longer than `n_joined`
      integer(ip), allocatable :: joined(:)
      !> Number of changes so far that contradict the list; greater than 0 only if a finder broke its contract
      integer(lp) :: contradictions = 0_lp
      !> Number of overlapping pairs of boxes of each pair; all 1, and not stored, if every piece has one box
      integer(ip), allocatable, private :: overlaps(:)
      !> Whether `overlaps` is stored
      logical, private :: counted = .false.
      !> Number of pairs that `forget` removed; the next `apply` reports them as ended
      integer(ip), private :: n_forgotten = 0_ip
      !> Number of blocks that moved in the last step
      integer(ip), private :: n_blocks = 0_ip
      !> Old first index, old last index and displacement of each block, (3, block)
      integer(ip), allocatable, private :: block(:, :)
      !> Index of the change that began each pair of `began`
      integer(ip), allocatable, private :: cause(:)
   contains
      procedure :: start
      procedure :: forget
      procedure :: apply
      generic :: carry => carry_wp, carry_ip
      procedure, private :: carry_wp
      procedure, private :: carry_ip
   end type pair_list_t

contains

   !> Start with an empty list.
   pure subroutine start(self, one_to_one, n_pieces)
      class(pair_list_t), intent(inout) :: self
      !> Whether every piece has one box; then overlaps of boxes need not be counted
      logical, intent(in) :: one_to_one
      !> Number of pieces
      integer(ip), intent(in) :: n_pieces

      if (allocated(self%pairs_of)) deallocate (self%pairs_of)
      allocate (self%pairs_of(n_pieces), source=0_ip)
      self%n = 0_ip
      self%n_began = 0_ip
      self%n_paired = 0_ip
      self%n_joined = 0_ip
      self%n_ended = 0_ip
      self%n_blocks = 0_ip
      self%n_forgotten = 0_ip
      self%contradictions = 0_lp
      self%counted = .not. one_to_one
      call reserve_events(self, 16_ip)
      call resize(self%first, 16_ip)
      call resize(self%second, 16_ip)
      if (self%counted) call resize(self%overlaps, 16_ip)
   end subroutine start

   !> Empty the list, because the set of bodies has changed. The next `apply` reports all its pairs as ended.
   pure subroutine forget(self, one_to_one, n_pieces)
      class(pair_list_t), intent(inout) :: self
      !> Whether every piece has one box
      logical, intent(in) :: one_to_one
      !> Number of pieces
      integer(ip), intent(in) :: n_pieces
      integer(ip) :: n
      integer(lp) :: contradictions

      n = self%n
      contradictions = self%contradictions
      call self%start(one_to_one, n_pieces)
      self%n_forgotten = n
      self%contradictions = contradictions
   end subroutine forget

   !> Apply the changes of a step to the list.
   pure subroutine apply(self, changes)
      class(pair_list_t), intent(inout) :: self
      !> Changes after `order`
      type(pair_changes_t), intent(in) :: changes
      integer(ip) :: k, place
      integer(lp) :: key

      self%n_began = 0_ip
      self%n_ended = 0_ip
      self%n_joined = 0_ip
      self%n_blocks = 0_ip
      if (self%n_forgotten > 0_ip) call end_forgotten(self)
      if (changes%n == 0_ip) return
      call reserve_events(self, changes%n)
      call plan(self, changes)
      call resize(self%first, self%n)
      call resize(self%second, self%n)
      call move_blocks(self, self%first)
      call move_blocks(self, self%second)
      if (self%counted) then
         call resize(self%overlaps, self%n)
         call move_blocks(self, self%overlaps)
      end if
      do k = 1_ip, self%n_began
         place = self%began(k)
         key = changes%key(self%cause(k))
         self%first(place) = first_of(key)
         self%second(place) = second_of(key)
         call join(self, self%first(place))
         call join(self, self%second(place))
         if (self%counted) self%overlaps(place) = changes%step(self%cause(k))
      end do
   end subroutine apply

   !> Find the pairs that begin and end, and the blocks between them with their displacements.
   pure subroutine plan(self, changes)
      type(pair_list_t), intent(inout) :: self
      type(pair_changes_t), intent(in) :: changes
      integer(ip) :: k, place, low, displacement, overlaps
      logical :: listed

      low = 1_ip
      displacement = 0_ip
      place = 1_ip
      do k = 1_ip, changes%n
         place = place_of(self, changes%key(k), place)
         listed = .false.
         if (place <= self%n) listed = pair_key(self%first(place), self%second(place)) == changes%key(k)
         overlaps = changes%step(k)
         if (listed) overlaps = overlaps + overlaps_at(self, place)
         if (overlaps < 0_ip .or. (overlaps > 1_ip .and. .not. self%counted)) then
            self%contradictions = self%contradictions + 1_lp
         else if (listed .and. overlaps > 0_ip) then
            self%overlaps(place) = overlaps
         else if (listed) then
            call add_block(self, low, place - 1_ip, displacement)
            call leave(self, self%first(place))
            call leave(self, self%second(place))
            self%n_ended = self%n_ended + 1_ip
            self%ended(self%n_ended) = place
            low = place + 1_ip
            displacement = displacement - 1_ip
         else
            call add_block(self, low, place - 1_ip, displacement)
            self%n_began = self%n_began + 1_ip
            self%began(self%n_began) = place + displacement
            self%cause(self%n_began) = k
            low = place
            displacement = displacement + 1_ip
         end if
      end do
      call add_block(self, low, self%n, displacement)
      self%n = self%n + displacement
   end subroutine plan

   !> Count a pair of a piece that begins.
   pure subroutine join(self, piece)
      type(pair_list_t), intent(inout) :: self
      integer(ip), intent(in) :: piece

      if (self%pairs_of(piece) == 0_ip) then
         self%n_paired = self%n_paired + 1_ip
         self%n_joined = self%n_joined + 1_ip
         self%joined(self%n_joined) = piece
      end if
      self%pairs_of(piece) = self%pairs_of(piece) + 1_ip
   end subroutine join

   !> Count a pair of a piece that ends.
   pure subroutine leave(self, piece)
      type(pair_list_t), intent(inout) :: self
      integer(ip), intent(in) :: piece

      self%pairs_of(piece) = self%pairs_of(piece) - 1_ip
      if (self%pairs_of(piece) == 0_ip) self%n_paired = self%n_paired - 1_ip
   end subroutine leave

   !> Least index, not below `from`, of a pair whose key is not below `key`
   pure integer(ip) function place_of(self, key, from)
      type(pair_list_t), intent(in) :: self
      integer(lp), intent(in) :: key
      integer(ip), intent(in) :: from
      integer(ip) :: high, middle, first, second

      first = first_of(key)
      second = second_of(key)
      place_of = from
      high = self%n + 1_ip
      do while (place_of < high)
         middle = place_of + (high - place_of)/2_ip
         if (self%first(middle) < first .or. (self%first(middle) == first .and. self%second(middle) < second)) then
            place_of = middle + 1_ip
         else
            high = middle
         end if
      end do
   end function place_of

   !> Number of overlapping pairs of boxes of a pair in the list
   pure integer(ip) function overlaps_at(self, place)
      type(pair_list_t), intent(in) :: self
      integer(ip), intent(in) :: place

      overlaps_at = 1_ip
      if (self%counted) overlaps_at = self%overlaps(place)
   end function overlaps_at

   !> Append a block of pairs to move, unless it is empty or its displacement is zero.
   pure subroutine add_block(self, low, high, displacement)
      type(pair_list_t), intent(inout) :: self
      integer(ip), intent(in) :: low, high, displacement

      if (displacement == 0_ip .or. high < low) return
      self%n_blocks = self%n_blocks + 1_ip
      self%block(:, self%n_blocks) = [low, high, displacement]
   end subroutine add_block

   !> List the pairs that `forget` removed as ended.
   pure subroutine end_forgotten(self)
      type(pair_list_t), intent(inout) :: self
      integer(ip) :: k

      call reserve_events(self, self%n_forgotten)
      do k = 1_ip, self%n_forgotten
         self%ended(k) = k
      end do
      self%n_ended = self%n_forgotten
      self%n_forgotten = 0_ip
   end subroutine end_forgotten

   !> Apply the moves of the last step to an array with one real number per pair.
   pure subroutine carry_wp(self, values, fill)
      class(pair_list_t), intent(in) :: self
      !> One value per pair of the previous list; afterwards per pair of the present list
      real(wp), allocatable, intent(inout) :: values(:)
      !> Value of pairs that began
      real(wp), intent(in) :: fill
      integer(ip) :: b, k

      if (self%n_began == 0_ip .and. self%n_ended == 0_ip) return
      if (size(values) < self%n) call grow(values, size(values, kind=ip), self%n + self%n/2_ip)
      do b = 1_ip, self%n_blocks
         if (self%block(3, b) > 0_ip) cycle
         do k = self%block(1, b), self%block(2, b)
            values(k + self%block(3, b)) = values(k)
         end do
      end do
      do b = self%n_blocks, 1_ip, -1_ip
         if (self%block(3, b) < 0_ip) cycle
         do k = self%block(2, b), self%block(1, b), -1_ip
            values(k + self%block(3, b)) = values(k)
         end do
      end do
      do k = 1_ip, self%n_began
         values(self%began(k)) = fill
      end do
   end subroutine carry_wp

   !> Apply the moves of the last step to an array with one integer per pair.
   pure subroutine carry_ip(self, values, fill)
      class(pair_list_t), intent(in) :: self
      !> One value per pair of the previous list; afterwards per pair of the present list
      integer(ip), allocatable, intent(inout) :: values(:)
      !> Value of pairs that began
      integer(ip), intent(in) :: fill
      integer(ip) :: k

      if (self%n_began == 0_ip .and. self%n_ended == 0_ip) return
      call resize(values, self%n)
      call move_blocks(self, values)
      do k = 1_ip, self%n_began
         values(self%began(k)) = fill
      end do
   end subroutine carry_ip

   !> Move the blocks of the last step within an array.
   pure subroutine move_blocks(self, values)
      class(pair_list_t), intent(in) :: self
      integer(ip), intent(inout) :: values(:)
      integer(ip) :: b, k

      do b = 1_ip, self%n_blocks
         if (self%block(3, b) > 0_ip) cycle
         do k = self%block(1, b), self%block(2, b)
            values(k + self%block(3, b)) = values(k)
         end do
      end do
      do b = self%n_blocks, 1_ip, -1_ip
         if (self%block(3, b) < 0_ip) cycle
         do k = self%block(2, b), self%block(1, b), -1_ip
            values(k + self%block(3, b)) = values(k)
         end do
      end do
   end subroutine move_blocks

   !> Make an array at least n long and keep its values.
   pure subroutine resize(values, n)
      integer(ip), allocatable, intent(inout) :: values(:)
      integer(ip), intent(in) :: n

      if (.not. allocated(values)) allocate (values(0))
      if (size(values) < n) call grow(values, size(values, kind=ip), n + n/2_ip)
   end subroutine resize

   !> Make room for a number of changes.
   pure subroutine reserve_events(self, n)
      type(pair_list_t), intent(inout) :: self
      integer(ip), intent(in) :: n

      call resize(self%began, n)
      call resize(self%ended, n)
      call resize(self%cause, n)
      call resize(self%joined, 2_ip*n)
      if (allocated(self%block)) then
         if (size(self%block, 2) > n) return
         deallocate (self%block)
      end if
      allocate (self%block(3, 2_ip*n + 1_ip))
   end subroutine reserve_events

end module polydem_pair_list
