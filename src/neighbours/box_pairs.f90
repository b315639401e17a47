!> The overlapping boxes of a step in ascending order, and how two such lists differ.
!>
!> The list has a row for each box: the boxes above it that it overlaps, ascending. Finders that look for all
!> pairs at every step put them in order here; the differences to the list of the step before are the
!> changes. Rows are short, so that sorting by row is cheap: pairs are counted by their lower box, moved to
!> its row, and each row is sorted by insertion. What threads found is joined by this, and the list does
!> not depend on how many they were.
module polydem_box_pairs
   use polydem_kinds, only: ip, lp
   use polydem_pair_changes, only: pair_changes_t
   use polydem_sort, only: sort_keys
   implicit none
   private
   public :: box_pairs_t, found_t, record_differences

   !> Rows longer than this are not sorted by insertion
   integer(ip), parameter :: long_row = 48_ip

   !> Pairs of boxes in the order in which one thread found them
   type :: found_t
      !> Number of pairs
      integer(ip) :: n = 0_ip
      !> Boxes of each pair, (2, pair); may be longer than n
      integer(ip), allocatable :: box(:, :)
   contains
      procedure :: reserve => reserve_found
      procedure :: keep_valid
   end type found_t

   !> Ascending list of pairs of boxes
   type :: box_pairs_t
      !> Number of rows (boxes)
      integer(ip) :: n_rows = 0_ip
      !> Place in `partner` at which each row begins, and the place behind the last row, (rows + 2); the last is spare
      integer(ip), allocatable :: first(:)
      !> Higher box of each pair; may be longer than the list
      integer(ip), allocatable :: partner(:)
   contains
      procedure :: start
      procedure :: n => number_of_pairs
      procedure :: gather
      procedure :: sort_rows
      procedure :: bytes
   end type box_pairs_t

contains

   !> Make room for more pairs.
   pure subroutine reserve_found(self, more)
      class(found_t), intent(inout) :: self
      !> Number of pairs that may be added
      integer(ip), intent(in) :: more
      integer(ip), allocatable :: longer(:, :)

      if (allocated(self%box)) then
         if (size(self%box, 2) >= self%n + more) return
      end if
      allocate (longer(2, 2_ip*(self%n + more) + 64_ip))
      if (self%n > 0_ip) longer(:, 1:self%n) = self%box(:, 1:self%n)
      call move_alloc(longer, self%box)
   end subroutine reserve_found

   !> Put the lower box of each pair first, and drop pairs of one body or of two passive ones.
   pure subroutine keep_valid(self, body, passive)
      class(found_t), intent(inout) :: self
      !> Body of each box
      integer(ip), intent(in), contiguous :: body(:)
      !> Whether that body is passive
      logical, intent(in), contiguous :: passive(:)
      integer(ip) :: k, kept, a, b

      kept = 0_ip
      do k = 1_ip, self%n
         a = min(self%box(1, k), self%box(2, k))
         b = max(self%box(1, k), self%box(2, k))
         self%box(1, kept + 1_ip) = a
         self%box(2, kept + 1_ip) = b
         kept = kept + merge(1_ip, 0_ip, body(a) /= body(b) .and. .not. (passive(a) .and. passive(b)))
      end do
      self%n = kept
   end subroutine keep_valid

   !> Begin with an empty list.
   pure subroutine start(self, n_rows)
      class(box_pairs_t), intent(inout) :: self
      !> Number of boxes
      integer(ip), intent(in) :: n_rows

      self%n_rows = n_rows
      allocate (self%first(n_rows + 2_ip), source=1_ip)
      allocate (self%partner(4_ip*n_rows + 64_ip))
   end subroutine start

   !> Number of pairs
   pure integer(ip) function number_of_pairs(self)
      class(box_pairs_t), intent(in) :: self

      number_of_pairs = 0_ip
      if (allocated(self%first)) number_of_pairs = self%first(self%n_rows + 1_ip) - 1_ip
   end function number_of_pairs

   !> Make the list anew from what threads found; the rows remain to be sorted.
   pure subroutine gather(self, found)
      class(box_pairs_t), intent(inout) :: self
      !> Pairs with the lower box first
      type(found_t), intent(in) :: found(:)
      integer(ip) :: k, row, place, total
      integer :: w

      total = 0_ip
      self%first = 0_ip
      do w = 1, size(found)
         do k = 1_ip, found(w)%n
            row = found(w)%box(1, k)
            self%first(row + 2_ip) = self%first(row + 2_ip) + 1_ip
         end do
         total = total + found(w)%n
      end do
      call reserve(self, total)
      self%first(1:2) = 1_ip
      do row = 1_ip, self%n_rows
         self%first(row + 2_ip) = self%first(row + 1_ip) + self%first(row + 2_ip)
      end do
      ! Entry row + 1 is the next free place of the row, and in the end the place behind it.
      do w = 1, size(found)
         do k = 1_ip, found(w)%n
            row = found(w)%box(1, k) + 1_ip
            place = self%first(row)
            self%partner(place) = found(w)%box(2, k)
            self%first(row) = place + 1_ip
         end do
      end do
   end subroutine gather

   !> Sort some rows.
   pure subroutine sort_rows(self, low, high)
      class(box_pairs_t), intent(inout) :: self
      !> First row
      integer(ip), intent(in) :: low
      !> Last row
      integer(ip), intent(in) :: high
      integer(ip) :: row

      do row = low, high
         if (self%first(row + 1_ip) - self%first(row) <= long_row) then
            call sort_by_insertion(self%partner, self%first(row), self%first(row + 1_ip) - 1_ip)
         else
            call sort_long(self%partner(self%first(row):self%first(row + 1_ip) - 1_ip))
         end if
      end do
   end subroutine sort_rows

   pure subroutine sort_by_insertion(values, low, high)
      integer(ip), intent(inout), contiguous :: values(:)
      integer(ip), intent(in) :: low, high
      integer(ip) :: k, place, value

      do k = low + 1_ip, high
         value = values(k)
         place = k
         do while (place > low)
            if (values(place - 1_ip) < value) exit
            values(place) = values(place - 1_ip)
            place = place - 1_ip
         end do
         values(place) = value
      end do
   end subroutine sort_by_insertion

   pure subroutine sort_long(values)
      integer(ip), intent(inout) :: values(:)
      integer(lp) :: keys(size(values)), spare_keys(size(values))
      integer(ip) :: spare(size(values))

      keys = int(values, lp)
      call sort_keys(size(values, kind=ip), keys, values, spare_keys, spare)
   end subroutine sort_long

   !> Walk through some rows of two lists side by side and record what only one of them has.
   pure subroutine record_differences(before, now, low, high, body, changes)
      !> List of the step before
      type(box_pairs_t), intent(in) :: before
      !> List of this step
      type(box_pairs_t), intent(in) :: now
      !> First row
      integer(ip), intent(in) :: low
      !> Last row
      integer(ip), intent(in) :: high
      !> Body of each box
      integer(ip), intent(in) :: body(:)
      !> Changes, appended to what is there
      type(pair_changes_t), intent(inout) :: changes
      integer(ip) :: row, a, b, end_a, end_b, order

      do row = low, high
         a = before%first(row)
         b = now%first(row)
         end_a = before%first(row + 1_ip)
         end_b = now%first(row + 1_ip)
         do while (a < end_a .or. b < end_b)
            if (a == end_a) then
               order = 1_ip
            else if (b == end_b) then
               order = -1_ip
            else
               order = before%partner(a) - now%partner(b)
            end if
            if (order < 0_ip) call changes%record(body(row), body(before%partner(a)), -1_ip)
            if (order > 0_ip) call changes%record(body(row), body(now%partner(b)), 1_ip)
            if (order <= 0_ip) a = a + 1_ip
            if (order >= 0_ip) b = b + 1_ip
         end do
      end do
   end subroutine record_differences

   !> Memory held [B]
   pure integer(lp) function bytes(self)
      class(box_pairs_t), intent(in) :: self

      bytes = 0_lp
      if (allocated(self%first)) bytes = int(storage_size(self%first)/8, lp)* &
         (size(self%first, kind=lp) + size(self%partner, kind=lp))
   end function bytes

   !> Make `partner` long enough; its values are not needed any more.
   pure subroutine reserve(self, n)
      type(box_pairs_t), intent(inout) :: self
      integer(ip), intent(in) :: n

      if (size(self%partner) >= n) return
      deallocate (self%partner)
      allocate (self%partner(n + n/2_ip))
   end subroutine reserve

end module polydem_box_pairs
