!> Gaps between the lines of two boxes, and what follows for the pair (`polydem_line_filter`).
module polydem_line_gaps
   use polydem_kinds, only: bp, ip, wp
   implicit none
   private
   public :: pair_block, separate, overlapping, active, classify_pairs, class_of, is_close

   !> Largest number of candidates that are classified at once
   integer(ip), parameter :: pair_block = 128_ip
   !> Classes of candidates; the sure ones are also their states in `polydem_candidates`
   integer(bp), parameter :: separate = 0_bp, overlapping = 1_bp, active = 2_bp

contains

   !> Classify candidates from their gaps at the start and at the end of an interval. Both loops are without branches.
   pure subroutine classify_pairs(n, box, length, margin, n_boxes, line, kinds)
      !> Number of candidates, at most `pair_block`
      integer(ip), intent(in) :: n
      !> Boxes of each candidate, (2, n)
      integer(ip), intent(in) :: box(2, n)
      !> Length of the interval [steps], and margin of gaps [m]
      real(wp), intent(in) :: length, margin
      !> Number of boxes
      integer(ip), intent(in) :: n_boxes
      !> Lines of the boxes, (8, box)
      real(wp), intent(in) :: line(8, n_boxes)
      !> Class of each candidate: `separate`, `overlapping` or `active`
      integer(bp), intent(out) :: kinds(pair_block)
      real(wp) :: left, right, below, above, left_end, right_end, below_end, above_end
      real(wp) :: greatest(pair_block), least(pair_block)
      integer(ip) :: k, i, j

      do k = 1_ip, n
         i = box(1, k)
         j = box(2, k)
         left = line(1, i) - line(3, j)
         below = line(2, i) - line(4, j)
         right = line(1, j) - line(3, i)
         above = line(2, j) - line(4, i)
         left_end = left + (line(5, i) - line(7, j))*length
         below_end = below + (line(6, i) - line(8, j))*length
         right_end = right + (line(5, j) - line(7, i))*length
         above_end = above + (line(6, j) - line(8, i))*length
         greatest(k) = max(max(max(left, left_end), max(below, below_end)), &
                           max(max(right, right_end), max(above, above_end)))
         least(k) = max(max(min(left, left_end), min(below, below_end)), &
                        max(min(right, right_end), min(above, above_end)))
      end do
      do k = 1_ip, n
         kinds(k) = merge(overlapping, active, greatest(k) < -margin)
         kinds(k) = merge(separate, kinds(k), least(k) > margin)
      end do
   end subroutine classify_pairs

   !> Class of a pair from one step of an interval to another
   pure integer(bp) function class_of(a, b, from, to, margin)
      !> Lines of the two boxes
      real(wp), intent(in) :: a(8), b(8)
      !> First and last step
      real(wp), intent(in) :: from, to
      !> Margin of gaps [m]
      real(wp), intent(in) :: margin
      real(wp) :: gap(4), speed(4), first(4), last(4)

      gap = [a(1:2) - b(3:4), b(1:2) - a(3:4)]
      speed = [a(5:6) - b(7:8), b(5:6) - a(7:8)]
      first = gap + speed*from
      last = gap + speed*to
      class_of = active
      if (maxval(max(first, last)) < -margin) class_of = overlapping
      if (maxval(min(first, last)) > margin) class_of = separate
   end function class_of

   !> Whether the largest gap of two boxes is close to zero at the start of an interval
   pure logical function is_close(a, b, margin)
      !> Lines of the boxes
      real(wp), intent(in) :: a(8), b(8)
      !> Margin of gaps [m]
      real(wp), intent(in) :: margin

      is_close = abs(max(max(a(1) - b(3), a(2) - b(4)), max(b(1) - a(3), b(2) - a(4)))) <= margin
   end function is_close

end module polydem_line_gaps
