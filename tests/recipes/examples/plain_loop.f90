!> The shortest finder: a plain loop over all pairs of boxes in every step.
module polydem_plain_loop
   use polydem_box_pairs, only: box_pairs_t, found_pairs_t, record_differences
   use polydem_boxes, only: boxes_t
   use polydem_finder, only: finder_t
   use polydem_kinds, only: ip, lp
   use polydem_pair_changes, only: pair_changes_t
   use polydem_finder_statistics, only: count_candidates, count_tests, phase_filter, phase_search
   implicit none
   private
   public :: plain_loop_t

   !> Finder that compares all boxes
   type, extends(finder_t) :: plain_loop_t
      private
      !> Pairs of overlapping boxes of the last step
      type(box_pairs_t) :: before
   contains
      procedure :: find
      procedure :: survey
   end type plain_loop_t

contains

   !> Record the differences between the pairs of this step and those of the last step.
   subroutine find(self, boxes, changes)
      class(plain_loop_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      type(pair_changes_t), intent(inout) :: changes
      type(box_pairs_t) :: now
      type(found_pairs_t) :: found(1)
      integer(ip) :: i, j

      if (.not. allocated(self%before%first)) call self%before%start(boxes%n)
      call now%start(boxes%n)
      call found(1)%reserve(1_ip)
      do i = 1_ip, boxes%n
         do j = i + 1_ip, boxes%n
            if (any(boxes%bounds(1:2, j) > boxes%bounds(3:4, i))) cycle
            if (any(boxes%bounds(1:2, i) > boxes%bounds(3:4, j))) cycle
            call found(1)%reserve(1_ip)
            found(1)%n = found(1)%n + 1_ip
            found(1)%box(:, found(1)%n) = [i, j]
         end do
      end do
      call found(1)%remove_invalid_pairs(boxes)
      call now%gather(found)
      call self%work%add(count_tests, int(boxes%n, lp)*int(boxes%n - 1_ip, lp)/2_lp)
      call self%work%lap(phase_search)
      call record_differences(self%before, now, 1_ip, boxes%n, boxes%piece, changes)
      self%before = now
      call self%work%lap(phase_filter)
   end subroutine find

   !> Record the number of stored pairs.
   subroutine survey(self)
      class(plain_loop_t), intent(inout) :: self

      self%work%value(count_candidates) = int(self%before%n(), lp)
   end subroutine survey

end module polydem_plain_loop
