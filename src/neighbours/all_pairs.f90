!> The oracle: every box is compared with every other at every step.
!>
!> The list of overlapping boxes comes out in ascending order; its differences to the list of the step
!> before are the changes. Nothing is assumed, nothing is kept but that list.
module polydem_all_pairs
   use polydem_boxes, only: boxes_t
   use polydem_counters, only: counters_t
   use polydem_finder, only: finder_t
   use polydem_kinds, only: ip, lp, wp
   use polydem_pair_changes, only: pair_changes_t
   implicit none
   private
   public :: all_pairs_t

   !> Boxes that are compared in one go
   integer(ip), parameter :: block_size = 128_ip

   !> Ascending list of overlapping boxes
   type :: box_pairs_t
      !> Number of pairs
      integer(ip) :: n = 0_ip
      !> Boxes of each pair, lower first, (2, pair)
      integer(ip), allocatable :: box(:, :)
   end type box_pairs_t

   !> Finder that compares all
   type, extends(finder_t) :: all_pairs_t
      private
      type(box_pairs_t) :: now, before
      real(wp), allocatable :: xmin(:), ymin(:), xmax(:), ymax(:)
      integer(lp) :: steps = 0_lp, tests = 0_lp
   contains
      procedure :: find
      procedure :: report
   end type all_pairs_t

contains

   !> Record the differences between the pairs of this step and those of the step before.
   subroutine find(self, boxes, changes)
      class(all_pairs_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      type(pair_changes_t), intent(inout) :: changes
      type(box_pairs_t) :: swap
      integer(ip) :: i

      call move_alloc(self%before%box, swap%box)
      call move_alloc(self%now%box, self%before%box)
      call move_alloc(swap%box, self%now%box)
      self%before%n = self%now%n
      self%now%n = 0_ip
      if (.not. allocated(self%before%box)) allocate (self%before%box(2, 0))
      if (.not. allocated(self%now%box)) allocate (self%now%box(2, 4_ip*boxes%n + block_size))
      self%xmin = boxes%bounds(1, 1:boxes%n)
      self%ymin = boxes%bounds(2, 1:boxes%n)
      self%xmax = boxes%bounds(3, 1:boxes%n)
      self%ymax = boxes%bounds(4, 1:boxes%n)
      do i = 1_ip, boxes%n - 1_ip
         call partners_of(self, boxes, i)
      end do
      self%steps = self%steps + 1_lp
      self%tests = self%tests + int(boxes%n, lp)*int(boxes%n - 1_ip, lp)/2_lp
      call record_differences(self%before, self%now, boxes%body, changes)
   end subroutine find

   !> Append the pairs of box i with all later boxes.
   subroutine partners_of(self, boxes, i)
      type(all_pairs_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      integer(ip), intent(in) :: i
      integer(ip) :: j, low, high, hit(block_size)
      real(wp) :: xmin, ymin, xmax, ymax

      xmin = self%xmin(i)
      ymin = self%ymin(i)
      xmax = self%xmax(i)
      ymax = self%ymax(i)
      do low = i + 1_ip, boxes%n, block_size
         high = min(low + block_size - 1_ip, boxes%n)
         hit = 0_ip
         do j = low, high
            hit(j - low + 1_ip) = merge(1_ip, 0_ip, xmin <= self%xmax(j) .and. self%xmin(j) <= xmax .and. &
               ymin <= self%ymax(j) .and. self%ymin(j) <= ymax)
         end do
         if (sum(hit) == 0_ip) cycle
         call reserve(self%now, self%now%n + block_size)
         do j = low, high
            if (hit(j - low + 1_ip) == 0_ip) cycle
            if (boxes%body(i) == boxes%body(j) .or. (boxes%fixed(i) .and. boxes%fixed(j))) cycle
            self%now%n = self%now%n + 1_ip
            self%now%box(:, self%now%n) = [i, j]
         end do
      end do
   end subroutine partners_of

   !> Walk through two ascending lists side by side and record what only one of them has.
   subroutine record_differences(before, now, body, changes)
      type(box_pairs_t), intent(in) :: before, now
      integer(ip), intent(in) :: body(:)
      type(pair_changes_t), intent(inout) :: changes
      integer(ip) :: a, b, order

      a = 1_ip
      b = 1_ip
      do while (a <= before%n .or. b <= now%n)
         if (a > before%n) then
            order = 1_ip
         else if (b > now%n) then
            order = -1_ip
         else
            order = before%box(1, a) - now%box(1, b)
            if (order == 0_ip) order = before%box(2, a) - now%box(2, b)
         end if
         if (order < 0_ip) call changes%record(body(before%box(1, a)), body(before%box(2, a)), -1_ip)
         if (order > 0_ip) call changes%record(body(now%box(1, b)), body(now%box(2, b)), 1_ip)
         if (order <= 0_ip) a = a + 1_ip
         if (order >= 0_ip) b = b + 1_ip
      end do
   end subroutine record_differences

   subroutine reserve(pairs, n)
      type(box_pairs_t), intent(inout) :: pairs
      integer(ip), intent(in) :: n
      integer(ip), allocatable :: longer(:, :)

      if (size(pairs%box, 2) >= n) return
      allocate (longer(2, 2_ip*n))
      longer(:, 1:pairs%n) = pairs%box(:, 1:pairs%n)
      call move_alloc(longer, pairs%box)
   end subroutine reserve

   !> Set the counters all_pairs_steps and all_pairs_tests.
   subroutine report(self, counters)
      class(all_pairs_t), intent(in) :: self
      type(counters_t), intent(inout) :: counters

      call counters%set('all_pairs_steps', self%steps)
      call counters%set('all_pairs_tests', self%tests)
   end subroutine report

end module polydem_all_pairs
