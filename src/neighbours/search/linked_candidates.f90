!> Candidates in linked lists: single candidates are added and removed in every step.
!>
!> The candidates of each box form a doubly linked list. Element (s, k) of `next` and `previous` belongs to box s (1 or
!> 2) of candidate k; its number 2(k - 1) + s is its *link*. Removing and adding a candidate cost O(1). A candidate that
!> is removed leaves a *hole*, a box with itself. A new candidate fills a hole near the other candidates of its box: the
!> list is divided into regions, and the holes of each form a linked list. When many candidates had to go elsewhere, the
!> list is sorted. So candidates of near boxes stay near each other, and threads that compare different parts of it
!> share few boxes.
module polydem_linked_candidates
   use polydem_candidates, only: candidates_t
   use polydem_grow, only: grow
   use polydem_index_list, only: index_list_t
   use polydem_kinds, only: bp, dp, ip, lp
   implicit none
   private
   public :: linked_candidates_t, meet

   !> Logarithm to base 2 of the number of candidates in a region
   integer, parameter :: region_bits = 11
   !> Logarithm to base 2 of the inverse share of candidates outside their region at which the list is sorted
   integer, parameter :: most_elsewhere = 4

   !> Candidates and holes 1..n
   type, extends(candidates_t) :: linked_candidates_t
      !> First link of each box, (box); 0: none
      integer(ip), allocatable, private :: first(:)
      !> Next link of the same box, (2, candidate), 0: none
      integer(ip), allocatable, private :: next(:, :)
      !> Previous link of the same box, (2, candidate), 0: none
      integer(ip), allocatable, private :: previous(:, :)
      !> Number of holes
      integer(ip), private :: n_holes = 0_ip
      !> Number of candidates that were added elsewhere than in their region since the list was sorted
      integer(ip), private :: n_elsewhere = 0_ip
      !> First hole of each region, (region), 0: none; the next one is in `next(1, hole)`
      integer(ip), allocatable, private :: first_hole(:)
   contains
      procedure :: start
      procedure :: add
      procedure :: drop
      procedure :: tidy
      procedure :: n_pairs
      procedure :: list_separated
      procedure :: append_candidates_of
      procedure :: bytes
   end type linked_candidates_t

contains

   !> Make an empty list.
   pure subroutine start(self, n_boxes)
      class(linked_candidates_t), intent(inout) :: self
      !> Number of boxes
      integer(ip), intent(in) :: n_boxes

      self%n = 0_ip
      allocate (self%first(n_boxes), source=0_ip)
      call reserve(self, 8_ip*n_boxes)
   end subroutine start

   !> Add a candidate.
   pure subroutine add(self, a, b, overlap, k)
      class(linked_candidates_t), intent(inout) :: self
      !> First and second box
      integer(ip), intent(in) :: a, b
      !> Whether they overlap
      logical, intent(in) :: overlap
      !> Its number
      integer(ip), intent(out) :: k
      integer(ip) :: wanted

      wanted = region(place(max(self%first(a), self%first(b), 1_ip)))
      if (self%n_holes > 0_ip) then
         call take_hole(self, wanted, k)
      else
         call reserve(self, self%n + 1_ip)
         self%n = self%n + 1_ip
         k = self%n
      end if
      if (region(k) /= wanted) self%n_elsewhere = self%n_elsewhere + 1_ip
      self%box(:, k) = [a, b]
      self%overlap(k) = merge(1_bp, 0_bp, overlap)
      call link_boxes(self, k)
   end subroutine add

   !> Put a candidate first in the lists of its boxes.
   pure subroutine link_boxes(self, k)
      class(linked_candidates_t), intent(inout) :: self
      integer(ip), intent(in) :: k
      integer(ip) :: s, link, other

      do s = 1_ip, 2_ip
         link = 2_ip*(k - 1_ip) + s
         other = self%first(self%box(s, k))
         self%next(s, k) = other
         self%previous(s, k) = 0_ip
         if (other /= 0_ip) self%previous(side(other), place(other)) = link
         self%first(self%box(s, k)) = link
      end do
   end subroutine link_boxes

   !> Sort the candidates by their lower box, without holes, if many are not in their region.
   pure subroutine tidy(self)
      class(linked_candidates_t), intent(inout) :: self
      integer(ip), allocatable :: box(:, :), end_of_row(:)
      integer(bp), allocatable :: overlap(:)
      integer(ip) :: n, k, i

      if (self%n_elsewhere <= shiftr(self%n, most_elsewhere)) return
      n = self%n
      call move_alloc(self%box, box)
      call move_alloc(self%overlap, overlap)
      allocate (self%box(2, size(overlap)), self%overlap(size(overlap)))
      allocate (end_of_row(0:size(self%first)), source=0_ip)
      do k = 1_ip, n
         i = min(box(1, k), box(2, k))
         end_of_row(i) = end_of_row(i) + merge(0_ip, 1_ip, box(1, k) == box(2, k))
      end do
      do i = 1_ip, size(self%first, kind=ip)
         end_of_row(i) = end_of_row(i - 1_ip) + end_of_row(i)
      end do
      self%n = end_of_row(size(self%first))
      do k = 1_ip, n
         if (box(1, k) == box(2, k)) cycle
         i = min(box(1, k), box(2, k))
         self%box(1, end_of_row(i)) = box(1, k)
         self%box(2, end_of_row(i)) = box(2, k)
         self%overlap(end_of_row(i)) = overlap(k)
         end_of_row(i) = end_of_row(i) - 1_ip
      end do
      self%first = 0_ip
      self%first_hole = 0_ip
      self%n_holes = 0_ip
      self%n_elsewhere = 0_ip
      do k = 1_ip, self%n
         call link_boxes(self, k)
      end do
   end subroutine tidy

   !> Number of candidates
   pure integer(ip) function n_pairs(self)
      class(linked_candidates_t), intent(in) :: self

      n_pairs = self%n - self%n_holes
   end function n_pairs

   !> Append the candidates of a box whose padded boxes do not overlap any longer to a list.
   pure subroutine list_separated(self, i, padded, list)
      class(linked_candidates_t), intent(in) :: self
      !> Box whose padded box changed
      integer(ip), intent(in) :: i
      !> Padded boxes, (4, box)
      real(dp), intent(in), contiguous :: padded(:, :)
      !> Numbers of candidates
      type(index_list_t), intent(inout) :: list
      integer(ip) :: link

      link = self%first(i)
      do while (link /= 0_ip)
         if (.not. meet(padded(:, i), padded(:, self%box(3_ip - side(link), place(link))))) call list%push(place(link))
         link = self%next(side(link), place(link))
      end do
   end subroutine list_separated

   !> Append the candidates of a box to a list.
   pure subroutine append_candidates_of(self, i, list)
      class(linked_candidates_t), intent(in) :: self
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
      class(linked_candidates_t), intent(in) :: self

      bytes = 0_lp
      if (.not. allocated(self%box)) return
      bytes = (int(storage_size(self%box), lp)*(3_lp*size(self%box, kind=lp) + size(self%first, kind=lp) + &
                                               size(self%first_hole, kind=lp)) + &
               int(storage_size(self%overlap), lp)*size(self%overlap, kind=lp))/8_lp
   end function bytes

   !> Remove a candidate, unless it is a hole.
   pure subroutine drop(self, k)
      class(linked_candidates_t), intent(inout) :: self
      !> Number of the candidate
      integer(ip), intent(in) :: k

      if (self%box(1, k) == self%box(2, k)) return
      call unlink(self, self%box(1, k), self%previous(1, k), self%next(1, k))
      call unlink(self, self%box(2, k), self%previous(2, k), self%next(2, k))
      self%box(2, k) = self%box(1, k)
      self%overlap(k) = 1_bp
      self%next(1, k) = self%first_hole(region(k))
      self%first_hole(region(k)) = k
      self%n_holes = self%n_holes + 1_ip
   end subroutine drop

   !> Take a hole from the region nearest to a given one that has any.
   pure subroutine take_hole(self, near, k)
      class(linked_candidates_t), intent(inout) :: self
      integer(ip), intent(in) :: near
      integer(ip), intent(out) :: k
      integer(ip) :: distance, r, last

      last = region(self%n)
      k = 0_ip
      do distance = 0_ip, last
         r = max(near - distance, 1_ip)
         if (self%first_hole(r) == 0_ip) r = min(near + distance, last)
         k = self%first_hole(r)
         if (k /= 0_ip) exit
      end do
      self%first_hole(r) = self%next(1, k)
      self%n_holes = self%n_holes - 1_ip
   end subroutine take_hole

   !> Region of a candidate
   pure integer(ip) function region(k)
      integer(ip), intent(in) :: k

      region = 1_ip + shiftr(k - 1_ip, region_bits)
   end function region

   !> Set the pointers of two neighbours in the linked list of a box to each other.
   pure subroutine unlink(self, box, previous, next)
      class(linked_candidates_t), intent(inout) :: self
      integer(ip), intent(in) :: box, previous, next

      if (previous == 0_ip) then
         self%first(box) = next
      else
         self%next(side(previous), place(previous)) = next
      end if
      if (next /= 0_ip) self%previous(side(next), place(next)) = previous
   end subroutine unlink

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

   !> Whether two padded boxes share a point
   pure logical function meet(a, b)
      !> Bounds xmin, ymin, xmax, ymax of both boxes
      real(dp), intent(in) :: a(4), b(4)

      meet = a(1) <= b(3) .and. b(1) <= a(3) .and. a(2) <= b(4) .and. b(2) <= a(4)
   end function meet

   !> Make room for n candidates.
   pure subroutine reserve(self, n)
      type(linked_candidates_t), intent(inout) :: self
      integer(ip), intent(in) :: n
      integer(ip) :: holes, m

      if (allocated(self%box)) then
         if (size(self%overlap) >= n) return
      end if
      m = n + n/2_ip + 64_ip
      holes = 0_ip
      if (self%n > 0_ip) holes = region(self%n)
      call grow(self%first_hole, holes, region(m), 0_ip)
      call grow(self%box, self%n, m)
      call grow(self%next, self%n, m)
      call grow(self%previous, self%n, m)
      call grow(self%overlap, self%n, m)
   end subroutine reserve

end module polydem_linked_candidates
