!> The list of pairs of bodies whose boxes overlap. It persists: a step changes it in place.
!>
!> Pairs stand in ascending order of (first, second). `apply` takes the ordered changes of a step, finds
!> each by bisection and moves the blocks between them, every block once and only if its place changes; a
!> step without changes does nothing. Whatever rides on a pair follows by `carry`, through the same moves.
!>
!> Blocks may be moved in place because they keep their order: those that go down are moved from the
!> front, those that go up from the back, and neither can run over a block that has yet to move.
module polydem_pair_list
   use polydem_kinds, only: ip, lp, wp
   use polydem_pair_changes, only: pair_changes_t, pair_key
   implicit none
   private
   public :: pair_list_t

   !> Pairs 1..n and what the last change did to them
   type :: pair_list_t
      !> Number of pairs
      integer(ip) :: n = 0_ip
      !> Lower slot of each pair; may be longer than n
      integer(ip), allocatable :: first(:)
      !> Higher slot of each pair; may be longer than n
      integer(ip), allocatable :: second(:)
      !> Number of pairs that began with the last change
      integer(ip) :: n_began = 0_ip
      !> Their places in the list as it is now, ascending
      integer(ip), allocatable :: began(:)
      !> Number of pairs that ended with the last change
      integer(ip) :: n_ended = 0_ip
      !> Their places in the list as it was before, ascending
      integer(ip), allocatable :: ended(:)
      !> Changes so far that contradict the list; not 0 only if a finder broke its contract
      integer(lp) :: contradictions = 0_lp
      !> Boxes of the two bodies that overlap; all 1, and not stored, unless some body has several boxes
      integer(ip), allocatable, private :: overlaps(:)
      !> Whether `overlaps` is kept
      logical, private :: counted = .false.
      !> Pairs that `forget` removed and the next change reports as ended
      integer(ip), private :: n_forgotten = 0_ip
      !> Number of blocks that the last change moved
      integer(ip), private :: n_blocks = 0_ip
      !> Old first place, old last place and way to go of each block, (3, block)
      integer(ip), allocatable, private :: block(:, :)
      !> Change by which each of `began` began
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

   !> Begin with an empty list.
   pure subroutine start(self, one_to_one)
      class(pair_list_t), intent(inout) :: self
      !> Whether every body has one box, so that overlaps of boxes need not be counted
      logical, intent(in) :: one_to_one

      self%n = 0_ip
      self%n_began = 0_ip
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

   !> Empty the list because the bodies are others now; the next change reports all its pairs as ended.
   pure subroutine forget(self, one_to_one)
      class(pair_list_t), intent(inout) :: self
      !> As for `start`
      logical, intent(in) :: one_to_one
      integer(ip) :: n
      integer(lp) :: contradictions

      n = self%n
      contradictions = self%contradictions
      call self%start(one_to_one)
      self%n_forgotten = n
      self%contradictions = contradictions
   end subroutine forget

   !> Bring the list up to date with the changes of a step.
   pure subroutine apply(self, changes)
      class(pair_list_t), intent(inout) :: self
      !> Changes after `order`
      type(pair_changes_t), intent(in) :: changes
      integer(ip) :: k, place
      integer(lp) :: key

      self%n_began = 0_ip
      self%n_ended = 0_ip
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
         self%first(place) = int(shiftr(key, 32), ip)
         self%second(place) = int(iand(key, int(huge(1_ip), lp)), ip)
         if (self%counted) self%overlaps(place) = changes%step(self%cause(k))
      end do
   end subroutine apply

   !> Decide which pairs begin and end, and which blocks between them move how far.
   pure subroutine plan(self, changes)
      type(pair_list_t), intent(inout) :: self
      type(pair_changes_t), intent(in) :: changes
      integer(ip) :: k, place, low, way, overlaps
      logical :: listed

      low = 1_ip
      way = 0_ip
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
            call add_block(self, low, place - 1_ip, way)
            self%n_ended = self%n_ended + 1_ip
            self%ended(self%n_ended) = place
            low = place + 1_ip
            way = way - 1_ip
         else
            call add_block(self, low, place - 1_ip, way)
            self%n_began = self%n_began + 1_ip
            self%began(self%n_began) = place + way
            self%cause(self%n_began) = k
            low = place
            way = way + 1_ip
         end if
      end do
      call add_block(self, low, self%n, way)
      self%n = self%n + way
   end subroutine plan

   !> First place, not before `from`, whose pair is not below a key
   pure integer(ip) function place_of(self, key, from)
      type(pair_list_t), intent(in) :: self
      integer(lp), intent(in) :: key
      integer(ip), intent(in) :: from
      integer(ip) :: high, middle

      place_of = from
      high = self%n + 1_ip
      do while (place_of < high)
         middle = place_of + (high - place_of)/2_ip
         if (pair_key(self%first(middle), self%second(middle)) < key) then
            place_of = middle + 1_ip
         else
            high = middle
         end if
      end do
   end function place_of

   pure integer(ip) function overlaps_at(self, place)
      type(pair_list_t), intent(in) :: self
      integer(ip), intent(in) :: place

      overlaps_at = 1_ip
      if (self%counted) overlaps_at = self%overlaps(place)
   end function overlaps_at

   pure subroutine add_block(self, low, high, way)
      type(pair_list_t), intent(inout) :: self
      integer(ip), intent(in) :: low, high, way

      if (way == 0_ip .or. high < low) return
      self%n_blocks = self%n_blocks + 1_ip
      self%block(:, self%n_blocks) = [low, high, way]
   end subroutine add_block

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

   !> Let real numbers that ride on the pairs follow the last change.
   pure subroutine carry_wp(self, values, fill)
      class(pair_list_t), intent(in) :: self
      !> One value per pair of the list before the change; afterwards per pair of the list now
      real(wp), allocatable, intent(inout) :: values(:)
      !> Value of pairs that began
      real(wp), intent(in) :: fill
      real(wp), allocatable :: longer(:)
      integer(ip) :: b, k

      if (self%n_began == 0_ip .and. self%n_ended == 0_ip) return
      if (size(values) < self%n) then
         allocate (longer(self%n + self%n/2_ip))
         longer(1:size(values)) = values
         call move_alloc(longer, values)
      end if
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

   !> Let integers that ride on the pairs follow the last change.
   pure subroutine carry_ip(self, values, fill)
      class(pair_list_t), intent(in) :: self
      !> One value per pair of the list before the change; afterwards per pair of the list now
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

   !> Move the blocks of the last change within an array.
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

   !> Make an array at least n long, keeping its values.
   pure subroutine resize(values, n)
      integer(ip), allocatable, intent(inout) :: values(:)
      integer(ip), intent(in) :: n
      integer(ip), allocatable :: longer(:)

      if (allocated(values)) then
         if (size(values) >= n) return
      end if
      allocate (longer(n + n/2_ip))
      if (allocated(values)) longer(1:size(values)) = values
      call move_alloc(longer, values)
   end subroutine resize

   !> Make room for a number of changes.
   pure subroutine reserve_events(self, n)
      type(pair_list_t), intent(inout) :: self
      integer(ip), intent(in) :: n

      call resize(self%began, n)
      call resize(self%ended, n)
      call resize(self%cause, n)
      if (allocated(self%block)) then
         if (size(self%block, 2) > n) return
         deallocate (self%block)
      end if
      allocate (self%block(3, 2_ip*n + 1_ip))
   end subroutine reserve_events

end module polydem_pair_list
