!> Sorted ends of boxes along one axis, and the changes of pairs that follow from exchanges of ends. All sweeps use this
!> module.
!>
!> The lower and higher ends of all boxes form a list in the order (value, lower before higher, box). With this order,
!> touching boxes count as overlapping. A step sets the new values of the ends and sorts the list by exchanges of
!> neighbours, which is fast because the list is nearly sorted. Every change of a pair causes an exchange of a lower end
!> with a higher end:
!>
!>     a lower end moves below a higher end     the two boxes may begin to overlap
!>     a higher end moves below a lower end     they may cease to overlap
!>
!> The bounds of this step and of the previous step decide. If a change causes exchanges on both axes, only x reports
!> it: y reports the start of an overlap only if the boxes overlapped in x before, and the end only if they still
!> overlap in x.
!>
!> Two ends are exchanged once if their order has changed, and never otherwise, for any order of the exchanges. Parts of
!> the list may therefore be sorted in any order; the sum of their reports is the same.
module polydem_sweep_ends
   use polydem_boxes, only: boxes_t
   use polydem_finder_statistics, only: count_idle_swaps, count_swaps, count_tests, finder_statistics_t
   use polydem_kinds, only: ip, lp, wp
   use polydem_pair_changes, only: pair_changes_t
   use polydem_sort_reals, only: sort_reals
   implicit none
   private
   public :: ends_t, range_t, report_t, place_ends, refresh_ends, sort_ends, add_report, bytes_of

   !> Ends of all boxes along one axis
   type :: ends_t
      !> Value of each end in ascending order, (end) [m]
      real(wp), allocatable :: value(:)
      !> Code of each end, (end): twice the number of the box, plus one for a higher end
      integer(ip), allocatable :: code(:)
   end type ends_t

   !> Range of ends to sort; the ends before `first` must be sorted already
   type :: range_t
      !> 1 for x, 2 for y
      integer :: axis = 1
      !> First index of the range
      integer(ip) :: low = 1_ip
      !> Index of the first end that may move down
      integer(ip) :: first = 2_ip
      !> Last index of the range
      integer(ip) :: high = 0_ip
      !> Whether the ends from `first` on are sorted too. The sort then stops at the first end that does not move down,
      !> and the merge of two runs that hardly overlap is cheap
      logical :: two_runs = .false.
   end type range_t

   !> Changes and counts of the sort of a part of the ends in a step
   type :: report_t
      !> Changes of pairs
      type(pair_changes_t) :: changes
      !> Number of exchanges
      integer(lp) :: swaps = 0_lp
      !> Number of exchanges of a lower end with a higher end; each is a comparison of two boxes
      integer(lp) :: tests = 0_lp
      !> Number of exchanges of ends of boxes that do not overlap on the other axis, neither before nor after the step
      integer(lp) :: idle_swaps = 0_lp
   contains
      procedure :: clear
   end type report_t

contains

   !> Make the lists before the first step. No boxes overlap, so the two ends of each box are neighbours.
   subroutine place_ends(boxes, centres_first, ends, before)
      !> Boxes of the first step
      type(boxes_t), intent(in) :: boxes
      !> Whether the boxes are in the order of their centres (Krengel et al. 2026), not in the given order
      logical, intent(in) :: centres_first
      !> Ends in x and in y; `refresh_ends` sets their values
      type(ends_t), intent(inout) :: ends(2)
      !> Bounds of the previous step: empty boxes, (4, box) [m]
      real(wp), allocatable, intent(out) :: before(:, :)
      integer(ip), allocatable :: ranked(:)
      real(wp), allocatable :: centre(:)
      integer(ip) :: k
      integer :: a

      allocate (before(4, boxes%n))
      before(1:2, :) = huge(1.0_wp)
      before(3:4, :) = -huge(1.0_wp)
      ranked = [(k, k=1_ip, boxes%n)]
      do a = 1, 2
         if (centres_first) then
            centre = 0.5_wp*boxes%bounds(a, 1:boxes%n) + 0.5_wp*boxes%bounds(a + 2, 1:boxes%n)
            call sort_reals(centre, ranked)
         end if
         allocate (ends(a)%value(2_ip*boxes%n), ends(a)%code(2_ip*boxes%n))
         do k = 1_ip, boxes%n
            ends(a)%code(2_ip*k - 1_ip) = 2_ip*ranked(k)
            ends(a)%code(2_ip*k) = 2_ip*ranked(k) + 1_ip
         end do
      end do
   end subroutine place_ends

   !> Set the values of a range of ends to those of this step.
   pure subroutine refresh_ends(a, low, high, boxes, ends)
      !> 1 for x, 2 for y
      integer, intent(in) :: a
      !> First and last index of the range
      integer(ip), intent(in) :: low, high
      !> Boxes of this step
      type(boxes_t), intent(in) :: boxes
      !> Placed ends
      type(ends_t), intent(inout) :: ends

      call gather(a, low, high, boxes%n, boxes%bounds, 2_ip*boxes%n, ends%value, ends%code)
   end subroutine refresh_ends

   !> Kernel of `refresh_ends`. The bounds are an array of the lower and the higher corner of each box; the code of an
   !> end is the column of its corner. This saves a seventh of the time of a step.
   pure subroutine gather(a, low, high, n_boxes, corner, n_ends, value, code)
      integer, intent(in) :: a
      integer(ip), intent(in) :: low, high
      integer(ip), intent(in) :: n_boxes
      real(wp), intent(in) :: corner(2, 2_ip:2_ip*n_boxes + 1_ip)
      integer(ip), intent(in) :: n_ends
      real(wp), intent(inout) :: value(n_ends)
      integer(ip), intent(in) :: code(n_ends)
      integer(ip) :: k

      do k = low, high
         value(k) = corner(a, code(k))
      end do
   end subroutine gather

   !> Sort a range of ends by exchanges of neighbours.
   subroutine sort_ends(range, thorough, boxes, before, ends, report, moved)
      !> Range to sort
      type(range_t), intent(in) :: range
      !> Whether to count idle exchanges
      logical, intent(in) :: thorough
      !> Boxes of this step
      type(boxes_t), intent(in) :: boxes
      !> Bounds of the previous step, (4, box) [m]
      real(wp), intent(in) :: before(:, :)
      !> Ends with the values of this step
      type(ends_t), intent(inout) :: ends
      !> Report to which changes and counts are added
      type(report_t), intent(inout) :: report
      !> First and last index whose end was replaced; huge and 0 if there is none
      integer(ip), intent(out), optional :: moved(2)
      integer(ip) :: places(2)

      call insert(range, thorough, boxes, boxes%n, boxes%bounds, before, ends%value, ends%code, report, places)
      if (present(moved)) moved = places
   end subroutine sort_ends

   !> Kernel of `sort_ends` on arrays of explicit shape. Counts are local variables of the thread until the end.
   subroutine insert(range, thorough, boxes, n_boxes, now, before, value, code, report, moved)
      type(range_t), intent(in) :: range
      logical, intent(in) :: thorough
      type(boxes_t), intent(in) :: boxes
      integer(ip), intent(in) :: n_boxes
      real(wp), intent(in) :: now(4, n_boxes), before(4, n_boxes)
      real(wp), intent(inout) :: value(2_ip*n_boxes)
      integer(ip), intent(inout) :: code(2_ip*n_boxes)
      type(report_t), intent(inout) :: report
      integer(ip), intent(out) :: moved(2)
      real(wp) :: new
      integer(ip) :: k, place, buffer, other, lowest, highest, low, high
      integer(lp) :: swaps, tests
      integer :: a

      swaps = 0_lp
      tests = 0_lp
      lowest = huge(1_ip)
      highest = 0_ip
      a = range%axis
      low = range%low
      high = range%high
      k = max(range%first, low + 1_ip) - 1_ip
      do
         k = k + 1_ip
         if (.not. range%two_runs) k = next_unsorted(k, high, 2_ip*n_boxes, value)
         if (k > high) exit
         new = value(k)
         buffer = code(k)
         place = k
         do while (place > low)
            if (value(place - 1_ip) < new) exit
            other = code(place - 1_ip)
            if (.not. (value(place - 1_ip) > new)) then
               if (comes_before(other, buffer)) exit
            end if
            if (iand(ieor(buffer, other), 1_ip) == 1_ip) then
               tests = tests + 1_lp
               call record_change(a, buffer, other, boxes, n_boxes, now, before, report%changes)
            end if
            value(place) = value(place - 1_ip)
            code(place) = other
            place = place - 1_ip
         end do
         if (place == k) then
            if (range%two_runs) exit
            cycle
         end if
         value(place) = new
         code(place) = buffer
         swaps = swaps + int(k - place, lp)
         lowest = min(lowest, place)
         highest = k
         if (thorough) report%idle_swaps = report%idle_swaps + &
            idle(3 - a, buffer, code(place + 1_ip:k), n_boxes, now, before)
      end do
      report%swaps = report%swaps + swaps
      report%tests = report%tests + tests
      moved = [lowest, highest]
   end subroutine insert

   !> First index from k on whose end is not larger than the end before it; high + 1 if there is none
   pure integer(ip) function next_unsorted(k, high, n_ends, value)
      integer(ip), intent(in) :: k, high, n_ends
      real(wp), intent(in) :: value(n_ends)

      do next_unsorted = k, high
         if (.not. (value(next_unsorted - 1_ip) < value(next_unsorted))) return
      end do
   end function next_unsorted

   !> Order of ends of equal value: lower ends first, then by box
   pure logical function comes_before(one, other)
      integer(ip), intent(in) :: one, other

      comes_before = iand(one, 1_ip) < iand(other, 1_ip) .or. &
         (iand(one, 1_ip) == iand(other, 1_ip) .and. one < other)
   end function comes_before

   !> Record the change of a pair, if any, that follows if a lower end moves below a higher end or the reverse.
   subroutine record_change(a, buffer, other, boxes, n_boxes, now, before, changes)
      !> 1 for x, 2 for y
      integer, intent(in) :: a
      !> Code of the end that moves down, and code of the end that it passes
      integer(ip), intent(in) :: buffer, other
      type(boxes_t), intent(in) :: boxes
      integer(ip), intent(in) :: n_boxes
      real(wp), intent(in) :: now(4, n_boxes), before(4, n_boxes)
      type(pair_changes_t), intent(inout) :: changes
      integer(ip) :: i, j
      logical :: begins, changed

      i = shiftr(buffer, 1)
      j = shiftr(other, 1)
      begins = iand(buffer, 1_ip) == 0_ip
      if (begins) then
         changed = meet(now(:, i), now(:, j), 2)
         if (changed) changed = meet(now(:, i), now(:, j), 1)
         if (changed .and. a == 2) changed = meet(before(:, i), before(:, j), 1)
      else
         changed = meet(before(:, i), before(:, j), 2)
         if (changed) changed = meet(before(:, i), before(:, j), 1)
         if (changed .and. a == 2) changed = meet(now(:, i), now(:, j), 1)
      end if
      if (.not. changed) return
      if (.not. boxes%may_meet(i, j)) return
      call changes%record(boxes%piece(i), boxes%piece(j), merge(1_ip, -1_ip, begins))
   end subroutine record_change

   !> Whether two boxes overlap on an axis
   pure logical function meet(one, other, a)
      real(wp), intent(in) :: one(4), other(4)
      integer, intent(in) :: a

      meet = one(a) <= other(a + 2) .and. other(a) <= one(a + 2)
   end function meet

   !> Number of idle exchanges of an end with the ends that it has passed: their boxes do not overlap on an axis,
   !> neither in this step nor in the previous step
   pure integer(lp) function idle(axis, buffer, passed, n_boxes, now, before)
      integer, intent(in) :: axis
      integer(ip), intent(in) :: buffer, passed(:), n_boxes
      real(wp), intent(in) :: now(4, n_boxes), before(4, n_boxes)
      integer(ip) :: i, j, k

      idle = 0_lp
      i = shiftr(buffer, 1)
      do k = 1_ip, size(passed, kind=ip)
         j = shiftr(passed(k), 1)
         if (meet(now(:, i), now(:, j), axis) .or. meet(before(:, i), before(:, j), axis)) cycle
         idle = idle + 1_lp
      end do
   end function idle

   !> Clear the report without freeing memory.
   pure subroutine clear(self)
      class(report_t), intent(inout) :: self

      call self%changes%clear()
      self%swaps = 0_lp
      self%tests = 0_lp
      self%idle_swaps = 0_lp
   end subroutine clear

   !> Add the changes and counts of a report to those of the step.
   subroutine add_report(report, changes, work)
      !> Report of a part of the ends
      type(report_t), intent(in) :: report
      !> Changes of the step; those of the report are appended
      type(pair_changes_t), intent(inout) :: changes
      !> Statistics of the finder; the counts of the report are added
      type(finder_statistics_t), intent(inout) :: work

      call changes%append(report%changes)
      call work%add(count_swaps, report%swaps)
      call work%add(count_tests, report%tests)
      call work%add(count_idle_swaps, report%idle_swaps)
   end subroutine add_report

   !> Allocated memory of ends and bounds [B]
   pure integer(lp) function bytes_of(ends, before)
      !> Placed ends in x and in y
      type(ends_t), intent(in) :: ends(2)
      !> Bounds of the previous step, (4, box) [m]
      real(wp), intent(in) :: before(:, :)
      integer :: a

      bytes_of = size(before, kind=lp)*int(storage_size(before)/8, lp)
      do a = 1, 2
         bytes_of = bytes_of + &
            size(ends(a)%value, kind=lp)*int((storage_size(ends(a)%value) + storage_size(ends(a)%code))/8, lp)
      end do
   end function bytes_of

end module polydem_sweep_ends
