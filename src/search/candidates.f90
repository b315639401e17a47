!> Candidates: pairs of boxes that may overlap, and whether they overlapped at the last comparison.
!>
!> The list is unordered and dense, so the comparison of all candidates is one loop over plain arrays. The candidates of
!> each box also form a doubly linked list. Element (s, k) of `next` and `previous` belongs to box s (1 or 2) of
!> candidate k; its number 2(k - 1) + s is its *link*. Removing and adding a candidate cost O(1).
module polydem_candidates
   use polydem_kinds, only: bp, dp, ip, lp, wp
   use polydem_pair_changes, only: pair_changes_t
   implicit none
   private
   public :: candidates_t, index_list_t, meet, overlapping

   !> Number of candidates that are compared at once
   integer(ip), parameter :: block_size = 128_ip

   !> Candidates 1..n
   type :: candidates_t
      !> Number of candidates
      integer(ip) :: n = 0_ip
      !> Boxes of each candidate, (2, candidate)
      integer(ip), allocatable :: box(:, :)
      !> 1 if the boxes overlapped at the last comparison, else 0, (candidate)
      integer(bp), allocatable :: overlap(:)
      !> First link of each box, (box); 0: none
      integer(ip), allocatable :: first(:)
      !> Next link of the same box, (2, candidate), 0: none
      integer(ip), allocatable :: next(:, :)
      !> Previous link of the same box, (2, candidate), 0: none
      integer(ip), allocatable :: previous(:, :)
   contains
      procedure :: start
      procedure :: add
      procedure :: compare
      procedure :: drop
      procedure :: remove_separated
      procedure :: append_candidates_of
      procedure :: bytes
   end type candidates_t

   !> List of integers that grows
   type :: index_list_t
      !> Number of entries
      integer(ip) :: n = 0_ip
      !> Entries, (entry); may be longer than n
      integer(ip), allocatable :: at(:)
   contains
      procedure :: push
      procedure :: reserve => reserve_entries
   end type index_list_t

contains

   !> Make an empty list.
   pure subroutine start(self, n_boxes)
      class(candidates_t), intent(inout) :: self
      !> Number of boxes
      integer(ip), intent(in) :: n_boxes

      self%n = 0_ip
      allocate (self%first(n_boxes), source=0_ip)
      call reserve(self, 8_ip*n_boxes)
   end subroutine start

   !> Append a candidate.
   pure subroutine add(self, a, b, overlap)
      class(candidates_t), intent(inout) :: self
      !> First box
      integer(ip), intent(in) :: a
      !> Second box
      integer(ip), intent(in) :: b
      !> Whether they overlap
      logical, intent(in) :: overlap
      integer(ip) :: s, link, other

      call reserve(self, self%n + 1_ip)
      self%n = self%n + 1_ip
      self%box(:, self%n) = [a, b]
      self%overlap(self%n) = merge(1_bp, 0_bp, overlap)
      do s = 1_ip, 2_ip
         link = 2_ip*(self%n - 1_ip) + s
         other = self%first(self%box(s, self%n))
         self%next(s, self%n) = other
         self%previous(s, self%n) = 0_ip
         if (other /= 0_ip) self%previous(side(other), place(other)) = link
         self%first(self%box(s, self%n)) = link
      end do
   end subroutine add

   !> Compare the boxes of a range of candidates and record the pairs that begin or cease to overlap.
   subroutine compare(self, low, high, bounds, body, changes)
      class(candidates_t), intent(inout) :: self
      !> First candidate
      integer(ip), intent(in) :: low
      !> Last candidate
      integer(ip), intent(in) :: high
      !> Bounds of the boxes, (4, box) [m]
      real(wp), intent(in), contiguous :: bounds(:, :)
      !> Body of each box, (box)
      integer(ip), intent(in) :: body(:)
      !> List of changes; the new changes are appended
      type(pair_changes_t), intent(inout) :: changes
      integer(ip) :: from, to, k
      integer(bp) :: differ(block_size)
      logical :: any_differ

      do from = low, high, block_size
         to = min(from + block_size - 1_ip, high)
         call compare_block(to - from + 1_ip, self%box(:, from:to), self%overlap(from:to), &
                            size(bounds, 2, ip), bounds, differ, any_differ)
         if (.not. any_differ) cycle
         do k = from, to
            if (differ(k - from + 1_ip) == 0_bp) cycle
            self%overlap(k) = 1_bp - self%overlap(k)
            call changes%record(body(self%box(1, k)), body(self%box(2, k)), &
                                2_ip*int(self%overlap(k), ip) - 1_ip)
         end do
      end do
   end subroutine compare

   !> Inner loop of every step, on arrays of explicit shape and without branches.
   pure subroutine compare_block(n, box, overlap, n_boxes, bounds, differ, any_differ)
      integer(ip), intent(in) :: n, n_boxes
      integer(ip), intent(in) :: box(2, n)
      integer(bp), intent(in) :: overlap(n)
      real(wp), intent(in) :: bounds(4, n_boxes)
      !> 1 if the result changed, else 0
      integer(bp), intent(out) :: differ(n)
      logical, intent(out) :: any_differ
      integer(ip) :: k
      integer(bp) :: some

      do k = 1_ip, n
         differ(k) = merge(1_bp, 0_bp, overlapping(bounds(:, box(1, k)), bounds(:, box(2, k))))
      end do
      some = 0_bp
      do k = 1_ip, n
         differ(k) = ieor(differ(k), overlap(k))
         some = ior(some, differ(k))
      end do
      any_differ = some /= 0_bp
   end subroutine compare_block

   !> Remove the candidates of a box whose padded boxes do not overlap any longer.
   pure subroutine remove_separated(self, i, padded, n_dropped)
      class(candidates_t), intent(inout) :: self
      !> Box whose padded box changed
      integer(ip), intent(in) :: i
      !> Padded boxes, (4, box)
      real(dp), intent(in), contiguous :: padded(:, :)
      !> Number of candidates removed
      integer(ip), intent(out) :: n_dropped
      integer(ip) :: link, next, moved

      n_dropped = 0_ip
      link = self%first(i)
      do while (link /= 0_ip)
         next = self%next(side(link), place(link))
         if (.not. meet(padded(:, i), padded(:, self%box(3_ip - side(link), place(link))))) then
            ! The last candidate is moved to the place of this one, and may be the next candidate of the loop.
            moved = place(link)
            if (next /= 0_ip) then
               if (place(next) == self%n) next = 2_ip*(moved - 1_ip) + side(next)
            end if
            call self%drop(moved)
            n_dropped = n_dropped + 1_ip
         end if
         link = next
      end do
   end subroutine remove_separated

   !> Append the candidates of a box to a list.
   pure subroutine append_candidates_of(self, i, list)
      class(candidates_t), intent(in) :: self
      !> Box
      integer(ip), intent(in) :: i
      !> Numbers of candidates
      type(index_list_t), intent(inout) :: list
      integer(ip) :: link

      link = self%first(i)
      do while (link /= 0_ip)
         call list%push(place(link))
         link = self%next(side(link), place(link))
      end do
   end subroutine append_candidates_of

   !> Allocated memory [B]
   pure integer(lp) function bytes(self)
      class(candidates_t), intent(in) :: self

      bytes = 0_lp
      if (.not. allocated(self%box)) return
      bytes = (int(storage_size(self%box), lp)*(3_lp*size(self%box, kind=lp) + size(self%first, kind=lp)) + &
               int(storage_size(self%overlap), lp)*size(self%overlap, kind=lp))/8_lp
   end function bytes

   !> Remove one candidate; the last candidate is moved to its place.
   pure subroutine drop(self, k)
      class(candidates_t), intent(inout) :: self
      !> Number of the candidate
      integer(ip), intent(in) :: k
      integer(ip) :: s

      do s = 1_ip, 2_ip
         call point_at(self, self%box(s, k), self%previous(s, k), self%next(s, k), 0_ip)
      end do
      if (k /= self%n) then
         do s = 1_ip, 2_ip
            self%box(s, k) = self%box(s, self%n)
            self%next(s, k) = self%next(s, self%n)
            self%previous(s, k) = self%previous(s, self%n)
            call point_at(self, self%box(s, k), self%previous(s, k), self%next(s, k), 2_ip*(k - 1_ip) + s)
         end do
         self%overlap(k) = self%overlap(self%n)
      end if
      self%n = self%n - 1_ip
   end subroutine drop

   !> Set the pointers of two neighbours in the linked list of a box to a link between them, or to each other if the
   !> link is 0.
   pure subroutine point_at(self, box, previous, next, link)
      class(candidates_t), intent(inout) :: self
      integer(ip), intent(in) :: box, previous, next, link

      if (previous == 0_ip) then
         self%first(box) = merge(next, link, link == 0_ip)
      else
         self%next(side(previous), place(previous)) = merge(next, link, link == 0_ip)
      end if
      if (next /= 0_ip) self%previous(side(next), place(next)) = merge(previous, link, link == 0_ip)
   end subroutine point_at

   !> Box of the candidate to which a link belongs: 1 or 2
   pure integer(ip) function side(link)
      integer(ip), intent(in) :: link

      side = 2_ip - iand(link, 1_ip)
   end function side

   !> Candidate of a link
   pure integer(ip) function place(link)
      integer(ip), intent(in) :: link

      place = shiftr(link + 1_ip, 1)
   end function place

   !> Whether two boxes share a point. The function has no branches because the result is hard to predict
   pure logical function overlapping(a, b)
      !> Bounds xmin, ymin, xmax, ymax of the first box [m]
      real(wp), intent(in) :: a(4)
      !> Bounds of the second box [m]
      real(wp), intent(in) :: b(4)

      overlapping = min(min(b(3) - a(1), a(3) - b(1)), min(b(4) - a(2), a(4) - b(2))) >= 0.0_wp
   end function overlapping

   !> Whether two padded boxes share a point
   pure logical function meet(a, b)
      !> Bounds xmin, ymin, xmax, ymax of the first box
      real(dp), intent(in) :: a(4)
      !> Bounds of the second box
      real(dp), intent(in) :: b(4)

      meet = a(1) <= b(3) .and. b(1) <= a(3) .and. a(2) <= b(4) .and. b(2) <= a(4)
   end function meet

   !> Make room for n candidates.
   pure subroutine reserve(self, n)
      type(candidates_t), intent(inout) :: self
      integer(ip), intent(in) :: n
      integer(ip), allocatable :: box(:, :), next(:, :), previous(:, :)
      integer(bp), allocatable :: overlap(:)
      integer(ip) :: m

      if (allocated(self%box)) then
         if (size(self%overlap) >= n) return
      end if
      m = n + n/2_ip + 64_ip
      allocate (box(2, m), next(2, m), previous(2, m), overlap(m))
      if (self%n > 0_ip) then
         box(:, 1:self%n) = self%box(:, 1:self%n)
         next(:, 1:self%n) = self%next(:, 1:self%n)
         previous(:, 1:self%n) = self%previous(:, 1:self%n)
         overlap(1:self%n) = self%overlap(1:self%n)
      end if
      call move_alloc(box, self%box)
      call move_alloc(next, self%next)
      call move_alloc(previous, self%previous)
      call move_alloc(overlap, self%overlap)
   end subroutine reserve

   !> Make room for n entries.
   pure subroutine reserve_entries(self, n)
      class(index_list_t), intent(inout) :: self
      !> Number of entries
      integer(ip), intent(in) :: n
      integer(ip), allocatable :: longer(:)

      if (allocated(self%at)) then
         if (size(self%at) >= n) return
      end if
      allocate (longer(n + n/4_ip + 64_ip))
      if (self%n > 0_ip) longer(1:self%n) = self%at(1:self%n)
      call move_alloc(longer, self%at)
   end subroutine reserve_entries

   !> Append an entry.
   pure subroutine push(self, entry)
      class(index_list_t), intent(inout) :: self
      !> Entry to append
      integer(ip), intent(in) :: entry
      integer(ip), allocatable :: longer(:)

      if (.not. allocated(self%at)) allocate (self%at(64))
      if (self%n == size(self%at)) then
         allocate (longer(2_ip*self%n))
         longer(1:self%n) = self%at
         call move_alloc(longer, self%at)
      end if
      self%n = self%n + 1_ip
      self%at(self%n) = entry
   end subroutine push

end module polydem_candidates
