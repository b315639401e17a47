!> List of the overlapping boxes of a step in ascending order, and the differences between two such lists.
!>
!> The list has one row per box: the overlapping boxes with higher numbers, in ascending order. Finders that search for
!> all pairs at every step sort them here; the differences from the list of the previous step are the changes. The sort
!> counts pairs by their lower box, moves them to the row of this box, and sorts each row by insertion. It is cheap
!> because rows are short. It also joins the pairs of all threads, and the list does not depend on the number of
!> threads.
module polydem_box_pairs
   use polydem_boxes, only: boxes_t
   use polydem_grow, only: grow
   use polydem_kinds, only: ip, lp
   use polydem_pair_changes, only: pair_changes_t
   use polydem_sort, only: sort_keys
   implicit none
   private
   public :: box_pairs_t, found_pairs_t, record_differences

   !> Largest length of a row that is sorted by insertion
   integer(ip), parameter :: long_row = 48_ip

   !> Pairs of boxes that one thread found, in this order
   type :: found_pairs_t
      !> Number of pairs
      integer(ip) :: n = 0_ip
      !> Boxes of each pair, (2, pair); may have more than n columns
      integer(ip), allocatable :: box(:, :)
   contains
      procedure :: reserve => reserve_found
      procedure :: remove_invalid_pairs
   end type found_pairs_t

   !> Ascending list of pairs of boxes
   type :: box_pairs_t
      !> Number of rows (boxes)
      integer(ip) :: n_rows = 0_ip
      !> Index in `partner` of the first element of each row, and the index behind the last row, (rows + 2); the last
      !> element is work space
      integer(ip), allocatable :: first(:)
      !> Higher box of each pair, (pair); may be longer than the list
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
      class(found_pairs_t), intent(inout) :: self
      !> Number of pairs to make room for
      integer(ip), intent(in) :: more

      if (allocated(self%box)) then
         if (size(self%box, 2) >= self%n + more) return
      end if
      call grow(self%box, self%n, 2_ip*(self%n + more) + 64_ip)
   end subroutine reserve_found

   !> Remove pairs of boxes that cannot form a pair.
   pure subroutine remove_invalid_pairs(self, boxes)
      class(found_pairs_t), intent(inout) :: self
      !> All boxes
      type(boxes_t), intent(in) :: boxes
      integer(ip) :: k, kept, a, b

      kept = 0_ip
      do k = 1_ip, self%n
         a = self%box(1, k)
         b = self%box(2, k)
         self%box(1, kept + 1_ip) = a
         self%box(2, kept + 1_ip) = b
         kept = kept + merge(1_ip, 0_ip, boxes%may_meet(a, b))
      end do
      self%n = kept
   end subroutine remove_invalid_pairs

   !> Make an empty list.
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

   !> Replace the list by the pairs of all threads. The rows are not sorted yet.
   pure subroutine gather(self, found)
      class(box_pairs_t), intent(inout) :: self
      !> Pairs of each thread, (thread)
      type(found_pairs_t), intent(in) :: found(:)
      integer(ip) :: k, row, place, total
      integer :: w

      total = 0_ip
      self%first = 0_ip
      do w = 1, size(found)
         do k = 1_ip, found(w)%n
            row = minval(found(w)%box(:, k))
            self%first(row + 2_ip) = self%first(row + 2_ip) + 1_ip
         end do
         total = total + found(w)%n
      end do
      call reserve(self, total)
      self%first(1:2) = 1_ip
      do row = 1_ip, self%n_rows
         self%first(row + 2_ip) = self%first(row + 1_ip) + self%first(row + 2_ip)
      end do
      ! first(row + 1) is the next free index of the row, and at the end the index behind the row.
      do w = 1, size(found)
         do k = 1_ip, found(w)%n
            row = minval(found(w)%box(:, k)) + 1_ip
            place = self%first(row)
            self%partner(place) = maxval(found(w)%box(:, k))
            self%first(row) = place + 1_ip
         end do
      end do
   end subroutine gather

   !> Sort a range of rows.
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

   !> Sort values(low:high) by insertion.
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

   !> Sort a long row by merge sort.
   pure subroutine sort_long(values)
      integer(ip), intent(inout) :: values(:)
      integer(lp) :: keys(size(values)), spare_keys(size(values))
      integer(ip) :: spare(size(values))

      keys = int(values, lp)
      call sort_keys(size(values, kind=ip), keys, values, spare_keys, spare)
   end subroutine sort_long

   !> Compare a range of rows of two lists and record the pairs that only one of them contains.
   pure subroutine record_differences(before, now, low, high, piece, changes)
      !> List of the previous step
      type(box_pairs_t), intent(in) :: before
      !> List of this step
      type(box_pairs_t), intent(in) :: now
      !> First row
      integer(ip), intent(in) :: low
      !> Last row
      integer(ip), intent(in) :: high
      !> Body of each box, (box)
      integer(ip), intent(in) :: piece(:)
      !> List of changes; the new changes are appended
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
            if (order < 0_ip) call changes%record(piece(row), piece(before%partner(a)), -1_ip)
            if (order > 0_ip) call changes%record(piece(row), piece(now%partner(b)), 1_ip)
            if (order <= 0_ip) a = a + 1_ip
            if (order >= 0_ip) b = b + 1_ip
         end do
      end do
   end subroutine record_differences

   !> Allocated memory [B]
   pure integer(lp) function bytes(self)
      class(box_pairs_t), intent(in) :: self

      bytes = 0_lp
      if (allocated(self%first)) bytes = int(storage_size(self%first)/8, lp)* &
         (size(self%first, kind=lp) + size(self%partner, kind=lp))
   end function bytes

   !> Make `partner` long enough for n pairs; its values are lost.
   pure subroutine reserve(self, n)
      type(box_pairs_t), intent(inout) :: self
      integer(ip), intent(in) :: n

      if (size(self%partner) >= n) return
      deallocate (self%partner)
      allocate (self%partner(n + n/2_ip))
   end subroutine reserve

end module polydem_box_pairs
