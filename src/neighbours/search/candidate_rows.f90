!> Candidates in rows: one row per box with the candidates that its search in cells found, in the order of the cells.
!>
!> A search replaces all rows at once. Before it, all former candidates are compared, which records their changes. A
!> pair that overlaps and was no candidate has then begun. One of its boxes has left its padded box, since all boxes
!> inside theirs overlap only candidates. So only the pairs of those boxes are looked up in the former rows.
module polydem_candidate_rows
   use polydem_box_pairs, only: found_pairs_t
   use polydem_boxes, only: boxes_t
   use polydem_candidates, only: candidates_t, overlapping
   use polydem_grow, only: grow
   use polydem_index_list, only: index_list_t
   use polydem_kinds, only: bp, ip, lp, wp, min_parallel_size
   use polydem_pair_changes, only: pair_changes_t
   use polydem_thread_changes, only: part
   implicit none
   private
   public :: candidate_rows_t, lies_inside

   !> Number of boxes whose rows are read at once
   integer(ip), parameter :: at_once = 64_ip

   !> Candidates in rows, the box of the row first; more candidates can follow the rows
   type, extends(candidates_t) :: candidate_rows_t
      !> First candidate and number of candidates of the row of each box, (2, box)
      integer(ip), allocatable, private :: row(:, :)
      !> Place in `of_second` of the first candidate in which each box is the second one, and behind the last box,
      !> (boxes + 2); the last element is work space
      integer(ip), allocatable, private :: first_of_second(:)
      !> Candidates of the rows in the order of their second box
      integer(ip), allocatable, private :: of_second(:)
      !> 1 if a box was outside its padded box when the states were last updated, else 0, (box)
      integer(bp), allocatable, private :: outside(:)
   contains
      procedure :: start
      procedure :: update_states
      procedure :: replace
      procedure :: append
      procedure :: list_by_second
      procedure :: append_candidates_of => append_row_candidates_of
      procedure :: append_candidates_of_all => append_row_candidates_of_all
      procedure :: bytes => bytes_of_rows
   end type candidate_rows_t

contains

   !> Make empty rows.
   pure subroutine start(self, n_boxes)
      class(candidate_rows_t), intent(inout) :: self
      !> Number of boxes
      integer(ip), intent(in) :: n_boxes

      self%n = 0_ip
      allocate (self%box(2, 0), self%overlap(0), self%of_second(0))
      allocate (self%row(2, n_boxes), source=0_ip)
      allocate (self%first_of_second(n_boxes + 2_ip), source=1_ip)
      allocate (self%outside(n_boxes))
   end subroutine start

   !> Compare all candidates before they are replaced, and find the boxes outside their padded boxes.
   subroutine update_states(self, boxes, padded, changes)
      class(candidate_rows_t), intent(inout) :: self
      !> Boxes of this step
      type(boxes_t), intent(in) :: boxes
      !> Padded boxes, (4, box) [m]
      real(wp), intent(in), contiguous :: padded(:, :)
      !> Changes of each thread; appended, (thread)
      type(pair_changes_t), intent(inout) :: changes(:)
      integer(ip) :: low, high, i
      integer :: w

      !$omp parallel do if (boxes%n > min_parallel_size) schedule(static, 1) default(none) &
      !$omp    shared(self, boxes, padded, changes) private(w, low, high, i)
      do w = 1, size(changes)
         call part(self%n, size(changes), w, low, high)
         call self%compare(low, high, boxes%bounds, boxes%piece, changes(w))
         call part(boxes%n, size(changes), w, low, high)
         do i = low, high
            self%outside(i) = merge(0_bp, 1_bp, lies_inside(boxes%bounds(:, i), padded(:, i)))
         end do
      end do
      !$omp end parallel do
   end subroutine update_states

   !> Whether a box lies inside another one; false for NaN
   pure logical function lies_inside(box, other)
      !> Bounds xmin, ymin, xmax, ymax of the box [m]
      real(wp), intent(in) :: box(4)
      !> Bounds of the other one [m]
      real(wp), intent(in) :: other(4)

      lies_inside = box(1) >= other(1) .and. box(2) >= other(2) .and. box(3) <= other(3) .and. box(4) <= other(4)
   end function lies_inside

   !> Replace all candidates, and record the pairs that begin to overlap. `update_states` must have been called.
   subroutine replace(self, found, boxes, changes, with_states)
      class(candidate_rows_t), intent(inout) :: self
      !> New candidates as each thread of the search found them, row by row, (thread)
      type(found_pairs_t), intent(in) :: found(:)
      !> Boxes of this step
      type(boxes_t), intent(in) :: boxes
      !> Changes of each thread; appended, (thread)
      type(pair_changes_t), intent(inout) :: changes(:)
      !> Whether to find the states of the new candidates; else they are undefined
      logical, intent(in) :: with_states
      integer :: w

      if (any(self%outside /= 0_bp)) then
         !$omp parallel do if (boxes%n > min_parallel_size) schedule(static, 1) default(none) &
         !$omp    shared(self, found, boxes, changes) private(w)
         do w = 1, size(found)
            call record_begun(self, found(w), boxes, changes(w))
         end do
         !$omp end parallel do
      end if
      self%n = sum(found%n)
      call reserve(self)
      self%row = 0_ip
      !$omp parallel do if (boxes%n > min_parallel_size) schedule(static, 1) default(none) &
      !$omp    shared(self, found, boxes, with_states) private(w)
      do w = 1, size(found)
         call fill_rows(self, sum(found(1:w - 1)%n), found(w), boxes%bounds, with_states)
      end do
      !$omp end parallel do
   end subroutine replace

   !> Record the pairs found that overlap and were no candidates.
   subroutine record_begun(self, found, boxes, changes)
      class(candidate_rows_t), intent(in) :: self
      type(found_pairs_t), intent(in) :: found
      type(boxes_t), intent(in) :: boxes
      type(pair_changes_t), intent(inout) :: changes
      type(index_list_t) :: known
      integer(ip) :: m, i, j

      do m = 1_ip, found%n
         i = found%box(1, m)
         j = found%box(2, m)
         if (max(self%outside(i), self%outside(j)) == 0_bp) cycle
         if (.not. overlapping(boxes%bounds(:, i), boxes%bounds(:, j))) cycle
         if (self%n > 0_ip) then
            known%n = 0_ip
            call self%append_candidates_of(i, known)
            call self%append_candidates_of(j, known)
            if (any(sum(self%box(:, known%at(1:known%n)), 1) == i + j .and. &
                    abs(self%box(1, known%at(1:known%n)) - self%box(2, known%at(1:known%n))) == abs(i - j))) cycle
         end if
         call changes%record(boxes%piece(i), boxes%piece(j), 1_ip)
      end do
   end subroutine record_begun

   !> Copy the pairs of a thread to their rows, with their states on request.
   pure subroutine fill_rows(self, offset, found, bounds, with_states)
      type(candidate_rows_t), intent(inout) :: self
      !> Number of candidates before those of this thread
      integer(ip), intent(in) :: offset
      type(found_pairs_t), intent(in) :: found
      !> Bounds of the boxes, (4, box) [m]
      real(wp), intent(in), contiguous :: bounds(:, :)
      logical, intent(in) :: with_states
      integer(ip) :: m, i, last

      last = 0_ip
      do m = 1_ip, found%n
         i = found%box(1, m)
         self%box(1, offset + m) = i
         self%box(2, offset + m) = found%box(2, m)
         if (i /= last) self%row(1, i) = offset + m
         last = i
         self%row(2, i) = self%row(2, i) + 1_ip
      end do
      if (with_states) call self%find_states_of(found%n, self%box(:, offset + 1_ip:offset + found%n), bounds, &
                                                self%overlap(offset + 1_ip:offset + found%n))
   end subroutine fill_rows

   !> Append a candidate behind the rows.
   pure subroutine append(self, lower, higher, overlap)
      class(candidate_rows_t), intent(inout) :: self
      !> The lower and the higher of the two boxes
      integer(ip), intent(in) :: lower, higher
      !> Whether they overlap
      logical, intent(in) :: overlap
      integer(ip) :: m

      if (size(self%overlap) == self%n) then
         m = self%n + self%n/4_ip + 64_ip
         call grow(self%box, self%n, m)
         call grow(self%overlap, self%n, m)
      end if
      self%n = self%n + 1_ip
      self%box(:, self%n) = [lower, higher]
      self%overlap(self%n) = merge(1_bp, 0_bp, overlap)
   end subroutine append

   !> List the candidates of the rows by their second box, by counting.
   pure subroutine list_by_second(self)
      class(candidate_rows_t), intent(inout) :: self
      integer(ip) :: k, j

      if (size(self%of_second) < self%n) then
         deallocate (self%of_second)
         allocate (self%of_second(self%n + self%n/4_ip + 64_ip))
      end if
      associate (first => self%first_of_second)
         first = 0_ip
         do k = 1_ip, self%n
            first(self%box(2, k) + 2_ip) = first(self%box(2, k) + 2_ip) + 1_ip
         end do
         first(1:2) = 1_ip
         do j = 1_ip, size(self%row, 2, ip)
            first(j + 2_ip) = first(j + 1_ip) + first(j + 2_ip)
         end do
         ! first(j + 1) is the next free place of box j, and at the end the first place of the next box.
         do k = 1_ip, self%n
            j = self%box(2, k) + 1_ip
            self%of_second(first(j)) = k
            first(j) = first(j) + 1_ip
         end do
      end associate
   end subroutine list_by_second

   !> Append the candidates of a box in the rows to a list, without those in other rows before `list_by_second`.
   pure subroutine append_row_candidates_of(self, i, list)
      class(candidate_rows_t), intent(in) :: self
      !> Box
      integer(ip), intent(in) :: i
      !> Numbers of candidates
      type(index_list_t), intent(inout) :: list
      integer(ip) :: low, k, n_row, n_second

      n_row = self%row(2, i)
      low = self%first_of_second(i)
      n_second = self%first_of_second(i + 1_ip) - low
      call list%reserve(list%n + n_row + n_second)
      do k = 1_ip, n_row
         list%at(list%n + k) = self%row(1, i) + k - 1_ip
      end do
      list%n = list%n + n_row
      do k = 1_ip, n_second
         list%at(list%n + k) = self%of_second(low + k - 1_ip)
      end do
      list%n = list%n + n_second
   end subroutine append_row_candidates_of

   !> Append the candidates of several boxes in the rows to a list. The rows of many boxes are read at the same time.
   pure subroutine append_row_candidates_of_all(self, boxes, list)
      class(candidate_rows_t), intent(in) :: self
      !> The boxes
      type(index_list_t), intent(in) :: boxes
      !> Numbers of candidates
      type(index_list_t), intent(inout) :: list
      integer(ip) :: row(2, at_once), second(2, at_once), from, n, m, k, i

      do from = 1_ip, boxes%n, at_once
         n = min(boxes%n - from + 1_ip, at_once)
         do m = 1_ip, n
            i = boxes%at(from + m - 1_ip)
            row(1, m) = self%row(1, i)
            row(2, m) = self%row(2, i)
            second(1, m) = self%first_of_second(i)
            second(2, m) = self%first_of_second(i + 1_ip) - self%first_of_second(i)
         end do
         call list%reserve(list%n + sum(row(2, 1:n)) + sum(second(2, 1:n)))
         do m = 1_ip, n
            do k = 1_ip, row(2, m)
               list%at(list%n + k) = row(1, m) + k - 1_ip
            end do
            list%n = list%n + row(2, m)
            do k = 1_ip, second(2, m)
               list%at(list%n + k) = self%of_second(second(1, m) + k - 1_ip)
            end do
            list%n = list%n + second(2, m)
         end do
      end do
   end subroutine append_row_candidates_of_all

   !> Allocate memory for the candidates; their old values are lost.
   pure subroutine reserve(self)
      type(candidate_rows_t), intent(inout) :: self
      integer(ip) :: n

      if (size(self%overlap) >= self%n) return
      n = self%n + self%n/4_ip + 64_ip
      deallocate (self%box, self%overlap)
      allocate (self%box(2, n), self%overlap(n))
   end subroutine reserve

   !> Allocated memory [B]
   pure integer(lp) function bytes_of_rows(self) result(bytes)
      class(candidate_rows_t), intent(in) :: self

      bytes = 0_lp
      if (.not. allocated(self%box)) return
      bytes = (int(storage_size(self%box), lp)*(size(self%box, kind=lp) + size(self%row, kind=lp) + &
                                                size(self%first_of_second, kind=lp) + size(self%of_second, kind=lp)) + &
               int(storage_size(self%overlap), lp)*(size(self%overlap, kind=lp) + size(self%outside, kind=lp)))/8_lp
   end function bytes_of_rows

end module polydem_candidate_rows
