!> Candidates in rows: one row per box with its candidates of higher number, in ascending order.
!>
!> A search in cells replaces all rows at once. The states of the pairs that are in both lists are copied; a pair that
!> overlapped and is no longer a candidate has separated.
module polydem_candidate_rows
   use polydem_box_pairs, only: box_pairs_t, found_pairs_t
   use polydem_boxes, only: boxes_t
   use polydem_candidates, only: candidates_t, index_list_t
   use polydem_kinds, only: bp, ip, lp, min_parallel_size
   use polydem_pair_changes, only: pair_changes_t
   use polydem_thread_changes, only: part
   implicit none
   private
   public :: candidate_rows_t

   !> Candidates in ascending order, lower box first; more candidates can follow the rows
   type, extends(candidates_t) :: candidate_rows_t
      !> Present and previous rows, in alternating order
      type(box_pairs_t), private :: list(2)
      !> Index of the present rows in `list`
      integer, private :: now = 1
      !> 1 if a candidate of the previous rows overlapped, else 0, (candidate)
      integer(bp), allocatable, private :: overlap_before(:)
      !> Place in `of_higher` of the first candidate in which each box is the higher one, and behind the last box,
      !> (boxes + 2); the last element is work space
      integer(ip), allocatable, private :: first_of_higher(:)
      !> Candidates of the rows in the order of their higher box
      integer(ip), allocatable, private :: of_higher(:)
   contains
      procedure :: start => start_rows
      procedure :: replace
      procedure :: append
      procedure :: list_by_higher
      procedure :: append_row_candidates_of
      procedure :: place_of
      procedure :: bytes => bytes_of_rows
   end type candidate_rows_t

contains

   !> Make empty rows.
   pure subroutine start_rows(self, n_boxes)
      class(candidate_rows_t), intent(inout) :: self
      !> Number of boxes
      integer(ip), intent(in) :: n_boxes

      call self%list(1)%start(n_boxes)
      call self%list(2)%start(n_boxes)
      self%n = 0_ip
      allocate (self%box(2, 0), self%overlap(0), self%overlap_before(0))
   end subroutine start_rows

   !> Replace all candidates. The pairs that were behind the rows must not overlap, or be carried over by the caller.
   subroutine replace(self, found, boxes, changes)
      class(candidate_rows_t), intent(inout) :: self
      !> New candidates as each thread of the search found them, lower box first, (thread)
      type(found_pairs_t), intent(in) :: found(:)
      !> Boxes; only their number and bodies are used
      type(boxes_t), intent(in) :: boxes
      !> Changes of each thread; pairs that overlapped and are no longer candidates are appended, (thread)
      type(pair_changes_t), intent(inout) :: changes(:)
      integer(bp), allocatable :: spare(:)
      integer(ip) :: low, high
      integer :: w

      self%now = 3 - self%now
      call self%list(self%now)%gather(found)
      call move_alloc(self%overlap_before, spare)
      call move_alloc(self%overlap, self%overlap_before)
      call move_alloc(spare, self%overlap)
      self%n = self%list(self%now)%n()
      call reserve(self)
      !$omp parallel do if (boxes%n > min_parallel_size) schedule(static, 1) default(none) &
      !$omp    shared(self, boxes, changes) private(w, low, high)
      do w = 1, size(changes)
         call part(boxes%n, size(changes), w, low, high)
         call self%list(self%now)%sort_rows(low, high)
         call carry_over(self%list(3 - self%now), self%overlap_before, self%list(self%now), low, high, boxes%body, &
                         self%box, self%overlap, changes(w))
      end do
      !$omp end parallel do
   end subroutine replace

   !> Fill a range of rows of the candidates. The state of a candidate is copied from the previous list; new candidates
   !> did not overlap. Pairs that overlapped and are no longer candidates are recorded as separated.
   pure subroutine carry_over(before, overlap_before, now, low, high, body, box, overlap, changes)
      !> Previous list, and 1 where its candidates overlapped
      type(box_pairs_t), intent(in) :: before
      integer(bp), intent(in) :: overlap_before(:)
      !> New list
      type(box_pairs_t), intent(in) :: now
      !> First and last row
      integer(ip), intent(in) :: low, high
      !> Body of each box, (box)
      integer(ip), intent(in) :: body(:)
      !> Candidates to fill, (2, candidate), and 1 where they overlapped
      integer(ip), intent(inout) :: box(:, :)
      integer(bp), intent(inout) :: overlap(:)
      type(pair_changes_t), intent(inout) :: changes
      integer(ip) :: row, old, k

      do row = low, high
         old = before%first(row)
         do k = now%first(row), now%first(row + 1_ip) - 1_ip
            box(1, k) = row
            box(2, k) = now%partner(k)
            overlap(k) = 0_bp
            do while (old < before%first(row + 1_ip))
               if (before%partner(old) >= now%partner(k)) exit
               if (overlap_before(old) /= 0_bp) call changes%record(body(row), body(before%partner(old)), -1_ip)
               old = old + 1_ip
            end do
            if (old == before%first(row + 1_ip)) cycle
            if (before%partner(old) /= now%partner(k)) cycle
            overlap(k) = overlap_before(old)
            old = old + 1_ip
         end do
         do old = old, before%first(row + 1_ip) - 1_ip
            if (overlap_before(old) /= 0_bp) call changes%record(body(row), body(before%partner(old)), -1_ip)
         end do
      end do
   end subroutine carry_over

   !> Append a candidate behind the rows.
   pure subroutine append(self, lower, higher, overlap)
      class(candidate_rows_t), intent(inout) :: self
      !> The lower and the higher of the two boxes
      integer(ip), intent(in) :: lower, higher
      !> Whether they overlap
      logical, intent(in) :: overlap
      integer(ip), allocatable :: box(:, :)
      integer(bp), allocatable :: longer(:)
      integer(ip) :: m

      m = self%n + self%n/4_ip + 64_ip
      if (size(self%overlap) == self%n) then
         allocate (longer(m))
         longer(1:self%n) = self%overlap(1:self%n)
         call move_alloc(longer, self%overlap)
      end if
      if (size(self%box, 2) == self%n) then
         allocate (box(2, m))
         box(:, 1:self%n) = self%box(:, 1:self%n)
         call move_alloc(box, self%box)
      end if
      self%n = self%n + 1_ip
      self%box(:, self%n) = [lower, higher]
      self%overlap(self%n) = merge(1_bp, 0_bp, overlap)
   end subroutine append

   !> List the candidates of the rows by their higher box, by counting.
   pure subroutine list_by_higher(self)
      class(candidate_rows_t), intent(inout) :: self
      integer(ip) :: k, j, n

      n = self%list(self%now)%n_rows
      if (.not. allocated(self%of_higher)) allocate (self%of_higher(0), self%first_of_higher(n + 2_ip))
      if (size(self%of_higher) < self%n) then
         deallocate (self%of_higher)
         allocate (self%of_higher(self%n + self%n/4_ip + 64_ip))
      end if
      associate (first => self%first_of_higher)
         first = 0_ip
         do k = 1_ip, self%n
            first(self%box(2, k) + 2_ip) = first(self%box(2, k) + 2_ip) + 1_ip
         end do
         first(1:2) = 1_ip
         do j = 1_ip, n
            first(j + 2_ip) = first(j + 1_ip) + first(j + 2_ip)
         end do
         ! first(j + 1) is the next free place of box j, and at the end the first place of the next box.
         do k = 1_ip, self%n
            j = self%box(2, k) + 1_ip
            self%of_higher(first(j)) = k
            first(j) = first(j) + 1_ip
         end do
      end associate
   end subroutine list_by_higher

   !> Append the candidates of a box in the rows to a list. `list_by_higher` must have been called.
   pure subroutine append_row_candidates_of(self, i, list)
      class(candidate_rows_t), intent(in) :: self
      !> Box
      integer(ip), intent(in) :: i
      !> Numbers of candidates
      type(index_list_t), intent(inout) :: list
      integer(ip) :: from, low, k, n_row, n_higher

      from = self%list(self%now)%first(i)
      n_row = self%list(self%now)%first(i + 1_ip) - from
      low = self%first_of_higher(i)
      n_higher = self%first_of_higher(i + 1_ip) - low
      call list%reserve(list%n + n_row + n_higher)
      do k = 1_ip, n_row
         list%at(list%n + k) = from + k - 1_ip
      end do
      list%n = list%n + n_row
      do k = 1_ip, n_higher
         list%at(list%n + k) = self%of_higher(low + k - 1_ip)
      end do
      list%n = list%n + n_higher
   end subroutine append_row_candidates_of

   !> Candidate of two boxes, 0 if the rows do not contain them
   pure integer(ip) function place_of(self, lower, higher)
      class(candidate_rows_t), intent(in) :: self
      !> The lower and the higher of the two boxes
      integer(ip), intent(in) :: lower, higher
      integer(ip) :: k

      place_of = 0_ip
      do k = self%list(self%now)%first(lower), self%list(self%now)%first(lower + 1_ip) - 1_ip
         if (self%box(2, k) == higher) place_of = k
      end do
   end function place_of

   !> Allocate memory for the candidates; their old values are lost.
   pure subroutine reserve(self)
      type(candidate_rows_t), intent(inout) :: self
      integer(ip) :: n

      n = self%n + self%n/4_ip + 64_ip
      if (size(self%overlap) < self%n) then
         deallocate (self%overlap)
         allocate (self%overlap(n))
      end if
      if (size(self%box, 2) >= self%n) return
      deallocate (self%box)
      allocate (self%box(2, n))
   end subroutine reserve

   !> Allocated memory [B]
   pure integer(lp) function bytes_of_rows(self) result(bytes)
      class(candidate_rows_t), intent(in) :: self

      bytes = 0_lp
      if (.not. allocated(self%box)) return
      bytes = self%list(1)%bytes() + self%list(2)%bytes() + &
         (int(storage_size(self%box), lp)*size(self%box, kind=lp) + &
          int(storage_size(self%overlap), lp)*(size(self%overlap, kind=lp) + size(self%overlap_before, kind=lp)))/8_lp
      if (allocated(self%of_higher)) bytes = bytes + int(storage_size(self%of_higher)/8, lp)* &
         (size(self%first_of_higher, kind=lp) + size(self%of_higher, kind=lp))
   end function bytes_of_rows

end module polydem_candidate_rows
