!> Reference finder: it compares every box with every other box at every step, with O(n^2) comparisons.
!>
!> The result is the list of overlapping boxes in ascending order. Its differences from the list of the previous step
!> are the changes. The finder makes no assumptions and stores nothing but that list.
!>
!> Each thread compares strips of boxes with all later boxes, block by block; strips are distributed cyclically over
!> threads. A block stays in the cache while it is compared with the whole strip. A single thread finds all partners of
!> a box, in ascending order, so gathering the pairs by their lower box gives the ordered list.
module polydem_all_pairs
   use omp_lib, only: omp_get_max_threads
   use polydem_box_pairs, only: box_pairs_t, found_pairs_t, record_differences
   use polydem_boxes, only: boxes_t
   use polydem_finder, only: finder_t
   use polydem_finder_statistics, only: count_bytes, count_candidates, count_tests, phase_filter, phase_search
   use polydem_kinds, only: ip, lp, wp, min_parallel_size
   use polydem_pair_changes, only: pair_changes_t
   implicit none
   private
   public :: all_pairs_t

   !> Number of boxes of a strip, and of a block with which it is compared at once
   integer(ip), parameter :: strip_size = 64_ip, block_size = 128_ip

   !> Finder that compares all pairs of boxes
   type, extends(finder_t) :: all_pairs_t
      private
      !> Overlapping boxes of this step and of the previous step, in alternating order
      type(box_pairs_t) :: list(2)
      !> Index of this step in `list`
      integer :: now = 1
      !> Unordered pairs of each thread, (thread)
      type(found_pairs_t), allocatable :: found(:)
      !> Bounds of the boxes, one array for each side, (box) [m]
      real(wp), allocatable :: xmin(:), ymin(:), xmax(:), ymax(:)
   contains
      procedure :: find
      procedure :: survey
   end type all_pairs_t

contains

   !> Record the differences between the pairs of this step and those of the previous step.
   subroutine find(self, boxes, changes)
      class(all_pairs_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      type(pair_changes_t), intent(inout) :: changes
      integer :: before, w

      if (.not. allocated(self%xmin)) then
         call self%list(1)%start(boxes%n)
         call self%list(2)%start(boxes%n)
      end if
      before = self%now
      self%now = 3 - before
      self%xmin = boxes%bounds(1, 1:boxes%n)
      self%ymin = boxes%bounds(2, 1:boxes%n)
      self%xmax = boxes%bounds(3, 1:boxes%n)
      self%ymax = boxes%bounds(4, 1:boxes%n)
      if (allocated(self%found)) deallocate (self%found)
      allocate (self%found(omp_get_max_threads()))
      !$omp parallel do if (boxes%n > min_parallel_size) schedule(static, 1) default(none) shared(self, boxes) &
      !$omp    private(w)
      do w = 1, size(self%found)
         call search_strips(self, boxes, int(w, ip), size(self%found, kind=ip), self%found(w))
      end do
      !$omp end parallel do
      call self%list(self%now)%gather(self%found)
      call self%work%add(count_tests, int(boxes%n, lp)*int(boxes%n - 1_ip, lp)/2_lp)
      call self%work%lap(phase_search)
      call record_differences(self%list(before), self%list(self%now), 1_ip, boxes%n, boxes%piece, changes)
      call self%work%lap(phase_filter)
   end subroutine find

   !> Find all pairs of a box in strip w, w + m, w + 2m, ... and a later box.
   subroutine search_strips(self, boxes, w, m, found)
      type(all_pairs_t), intent(in) :: self
      type(boxes_t), intent(in) :: boxes
      integer(ip), intent(in) :: w, m
      type(found_pairs_t), intent(inout) :: found
      type(found_pairs_t) :: mine
      integer(ip) :: first, last, low, i

      ! The local variable is on the stack of the thread. Those of other threads would be on the same cache lines.
      call mine%reserve(block_size)
      do first = (w - 1_ip)*strip_size + 1_ip, boxes%n, m*strip_size
         last = min(first + strip_size - 1_ip, boxes%n)
         do low = first + 1_ip, boxes%n, block_size
            do i = first, last
               call compare(self, i, max(low, i + 1_ip), min(low + block_size - 1_ip, boxes%n), mine)
            end do
         end do
      end do
      call mine%remove_invalid_pairs(boxes)
      call move_alloc(mine%box, found%box)
      found%n = mine%n
   end subroutine search_strips

   !> Compare box i with boxes low to high, at most a block. Boxes overlap if and only if the largest of the four gaps
   !> between their sides is not positive. Rounding does not matter because the sign of a floating-point difference is
   !> exact.
   subroutine compare(self, i, low, high, found)
      type(all_pairs_t), intent(in) :: self
      integer(ip), intent(in) :: i, low, high
      type(found_pairs_t), intent(inout) :: found
      integer(ip) :: j
      real(wp) :: xmin, ymin, xmax, ymax, gap(block_size), least

      xmin = self%xmin(i)
      ymin = self%ymin(i)
      xmax = self%xmax(i)
      ymax = self%ymax(i)
      least = huge(1.0_wp)
      do j = low, high
         gap(j - low + 1_ip) = max(max(xmin - self%xmax(j), self%xmin(j) - xmax), &
                                   max(ymin - self%ymax(j), self%ymin(j) - ymax))
         least = min(least, gap(j - low + 1_ip))
      end do
      if (least > 0.0_wp) return
      call found%reserve(block_size)
      do j = low, high
         if (gap(j - low + 1_ip) > 0.0_wp) cycle
         found%n = found%n + 1_ip
         found%box(:, found%n) = [i, j]
      end do
   end subroutine compare

   !> Set the counters: pairs stored between steps, and memory [B].
   subroutine survey(self)
      class(all_pairs_t), intent(inout) :: self
      integer(lp) :: bytes
      integer :: w

      if (.not. allocated(self%xmin)) return
      bytes = self%list(1)%bytes() + self%list(2)%bytes() + &
         4_lp*int(storage_size(self%xmin)/8, lp)*size(self%xmin, kind=lp)
      do w = 1, size(self%found)
         bytes = bytes + size(self%found(w)%box, kind=lp)*int(storage_size(self%found(w)%box)/8, lp)
      end do
      self%work%value(count_candidates) = int(self%list(self%now)%n(), lp)
      self%work%value(count_bytes) = bytes
   end subroutine survey

end module polydem_all_pairs
