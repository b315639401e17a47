!> Ends of boxes in order along one axis, and what their exchanges tell: the common part of all sweeps.
!>
!> The lower and higher ends of all boxes stand in a list ordered by (value, lower before higher, box), so
!> that touching boxes count as overlapping. A step gives the ends their new values and sorts by exchanging
!> neighbours, which is fast because the list is nearly sorted. Every change of a pair shows as an exchange
!> of a lower end with a higher one:
!>
!>     a lower end goes below a higher end     the two boxes may begin to overlap
!>     a higher end goes below a lower end     they may cease to overlap
!>
!> and the bounds of the step and of the step before decide. A change that shows on both axes is reported by
!> x only: y reports a beginning only if the boxes overlapped in x before, an end only if they still do.
!>
!> Two ends are exchanged if and only if their order has changed, and then once, whatever the order in which
!> the list is sorted. So any part of it may be sorted at any time: the reports together are the same.
module polydem_sweep_ends
   use polydem_boxes, only: boxes_t
   use polydem_kinds, only: ip, lp, wp
   use polydem_pair_changes, only: pair_changes_t
   use polydem_sort_reals, only: sort_reals
   use polydem_work, only: count_idle_swaps, count_swaps, count_tests, work_t
   implicit none
   private
   public :: ends_t, report_t, place_ends, refresh_ends, sort_ends, hand_over, bytes_of

   !> Ends of all boxes along one axis
   type :: ends_t
      !> Value of each end [m], ascending
      real(wp), allocatable :: value(:)
      !> Twice the box of each end, plus one if it is the higher end
      integer(ip), allocatable :: code(:)
   end type ends_t

   !> What the sorting of some ends reports in a step
   type :: report_t
      !> Changes that showed
      type(pair_changes_t) :: changes
      !> Exchanges
      integer(lp) :: swaps = 0_lp
      !> Exchanges of a lower with a higher end, each a comparison of two boxes
      integer(lp) :: tests = 0_lp
      !> Exchanges of ends of boxes that are apart on the other axis, before and after the step
      integer(lp) :: idle_swaps = 0_lp
   contains
      procedure :: clear
   end type report_t

contains

   !> Before the first step no box overlaps another: the two ends of each stand side by side.
   subroutine place_ends(boxes, centres_first, ends, before)
      !> Boxes of the first step
      type(boxes_t), intent(in) :: boxes
      !> Whether the boxes stand in the order of their centres (Krengel et al. 2026), or as they come
      logical, intent(in) :: centres_first
      !> Ends in x and in y; their values come with the step
      type(ends_t), intent(inout) :: ends(2)
      !> Bounds of the step before: empty boxes, (4, box) [m]
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

   !> Give the ends in some places their values of this step.
   pure subroutine refresh_ends(a, low, high, boxes, ends)
      !> 1 for x, 2 for y
      integer, intent(in) :: a
      !> First and last place
      integer(ip), intent(in) :: low, high
      !> Boxes of this step
      type(boxes_t), intent(in) :: boxes
      !> Ends whose boxes are known
      type(ends_t), intent(inout) :: ends

      call gather(a, low, high, boxes%n, boxes%bounds, 2_ip*boxes%n, ends%value, ends%code)
   end subroutine refresh_ends

   !> As `refresh_ends`, with the bounds seen as the lower and the higher corner of each box: the code of an end is its
   !> column, which saves a seventh of the whole step.
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

   !> Sort the ends in places low to high by exchanges of neighbours. Those before `first` are sorted already.
   subroutine sort_ends(a, low, first, high, two_runs, thorough, boxes, before, ends, report, moved)
      !> 1 for x, 2 for y
      integer, intent(in) :: a
      !> Lowest place, first place whose end may have to go down, highest place
      integer(ip), intent(in) :: low, first, high
      !> Whether those from `first` on are sorted too: then the first that need not go down is the last to be looked at,
      !> and runs that hardly overlap cost hardly anything
      logical, intent(in) :: two_runs
      !> Whether to count idle exchanges
      logical, intent(in) :: thorough
      !> Boxes of this step
      type(boxes_t), intent(in) :: boxes
      !> Bounds of the step before, (4, box) [m]
      real(wp), intent(in) :: before(:, :)
      !> Refreshed ends
      type(ends_t), intent(inout) :: ends
      !> Changes and counts are added to it
      type(report_t), intent(inout) :: report
      !> First and last place that have got another end; huge and 0 if none has
      integer(ip), intent(out), optional :: moved(2)
      integer(ip) :: places(2)

      call insert(a, low, max(first, low + 1_ip), high, two_runs, thorough, boxes, boxes%n, boxes%bounds, before, &
                  2_ip*boxes%n, ends%value, ends%code, report, places)
      if (present(moved)) moved = places
   end subroutine sort_ends

   !> As `sort_ends`, with all arrays in sight. What is counted stays in variables of the thread until the end.
   subroutine insert(a, low, first, high, two_runs, thorough, boxes, n_boxes, now, before, n_ends, value, code, &
                     report, moved)
      integer, intent(in) :: a
      integer(ip), intent(in) :: low, first, high
      logical, intent(in) :: two_runs, thorough
      type(boxes_t), intent(in) :: boxes
      integer(ip), intent(in) :: n_boxes
      real(wp), intent(in) :: now(4, n_boxes), before(4, n_boxes)
      integer(ip), intent(in) :: n_ends
      real(wp), intent(inout) :: value(n_ends)
      integer(ip), intent(inout) :: code(n_ends)
      type(report_t), intent(inout) :: report
      integer(ip), intent(out) :: moved(2)
      real(wp) :: new
      integer(ip) :: k, place, mover, other, lowest, highest
      integer(lp) :: swaps, tests

      swaps = 0_lp
      tests = 0_lp
      lowest = huge(1_ip)
      highest = 0_ip
      k = first - 1_ip
      do
         k = k + 1_ip
         if (.not. two_runs) k = next_suspect(k, high, n_ends, value)
         if (k > high) exit
         new = value(k)
         mover = code(k)
         place = k
         do while (place > low)
            if (value(place - 1_ip) < new) exit
            other = code(place - 1_ip)
            if (.not. (value(place - 1_ip) > new)) then
               if (comes_before(other, mover)) exit
            end if
            if (iand(ieor(mover, other), 1_ip) == 1_ip) then
               tests = tests + 1_lp
               call judge(a, mover, other, boxes, n_boxes, now, before, report%changes)
            end if
            value(place) = value(place - 1_ip)
            code(place) = other
            place = place - 1_ip
         end do
         if (place == k) then
            if (two_runs) exit
            cycle
         end if
         value(place) = new
         code(place) = mover
         swaps = swaps + int(k - place, lp)
         lowest = min(lowest, place)
         highest = k
         if (thorough) report%idle_swaps = report%idle_swaps + &
            idle(3 - a, mover, code(place + 1_ip:k), n_boxes, now, before)
      end do
      report%swaps = report%swaps + swaps
      report%tests = report%tests + tests
      moved = [lowest, highest]
   end subroutine insert

   !> First place from k on whose end is not greater than the one before it; high + 1 if there is none.
   pure integer(ip) function next_suspect(k, high, n_ends, value)
      integer(ip), intent(in) :: k, high, n_ends
      real(wp), intent(in) :: value(n_ends)

      do next_suspect = k, high
         if (.not. (value(next_suspect - 1_ip) < value(next_suspect))) return
      end do
   end function next_suspect

   !> Order of ends of equal value: lower ends first, then by box
   pure logical function comes_before(one, other)
      integer(ip), intent(in) :: one, other

      comes_before = iand(one, 1_ip) < iand(other, 1_ip) .or. &
         (iand(one, 1_ip) == iand(other, 1_ip) .and. one < other)
   end function comes_before

   !> Record the change, if any, that shows as one end going below another of the other sort.
   subroutine judge(a, mover, other, boxes, n_boxes, now, before, changes)
      !> 1 for x, 2 for y
      integer, intent(in) :: a
      !> End that goes down, end that it passes
      integer(ip), intent(in) :: mover, other
      type(boxes_t), intent(in) :: boxes
      integer(ip), intent(in) :: n_boxes
      real(wp), intent(in) :: now(4, n_boxes), before(4, n_boxes)
      type(pair_changes_t), intent(inout) :: changes
      integer(ip) :: i, j
      logical :: begins, changed

      i = shiftr(mover, 1)
      j = shiftr(other, 1)
      begins = iand(mover, 1_ip) == 0_ip
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
      if (boxes%body(i) == boxes%body(j) .or. (boxes%passive(i) .and. boxes%passive(j))) return
      call changes%record(boxes%body(i), boxes%body(j), merge(1_ip, -1_ip, begins))
   end subroutine judge

   !> Whether two boxes overlap on an axis
   pure logical function meet(one, other, a)
      real(wp), intent(in) :: one(4), other(4)
      integer, intent(in) :: a

      meet = one(a) <= other(a + 2) .and. other(a) <= one(a + 2)
   end function meet

   !> How many of the ends that one end has passed belong to boxes that are apart from its box on an axis, in this
   !> step and in the one before
   pure integer(lp) function idle(axis, mover, passed, n_boxes, now, before)
      integer, intent(in) :: axis
      integer(ip), intent(in) :: mover, passed(:), n_boxes
      real(wp), intent(in) :: now(4, n_boxes), before(4, n_boxes)
      integer(ip) :: i, j, k

      idle = 0_lp
      i = shiftr(mover, 1)
      do k = 1_ip, size(passed, kind=ip)
         j = shiftr(passed(k), 1)
         if (meet(now(:, i), now(:, j), axis) .or. meet(before(:, i), before(:, j), axis)) cycle
         idle = idle + 1_lp
      end do
   end function idle

   !> Forget what was reported, keeping the memory.
   pure subroutine clear(self)
      class(report_t), intent(inout) :: self

      call self%changes%clear()
      self%swaps = 0_lp
      self%tests = 0_lp
      self%idle_swaps = 0_lp
   end subroutine clear

   !> Pass on the changes and counts of a step.
   subroutine hand_over(report, changes, work)
      !> What was reported
      type(report_t), intent(in) :: report
      !> Changes of the step so far; those reported are appended
      type(pair_changes_t), intent(inout) :: changes
      !> Work of the finder so far; the counts are added
      type(work_t), intent(inout) :: work

      call changes%append(report%changes)
      call work%add(count_swaps, report%swaps)
      call work%add(count_tests, report%tests)
      call work%add(count_idle_swaps, report%idle_swaps)
   end subroutine hand_over

   !> Memory of ends and bounds [B]
   pure integer(lp) function bytes_of(ends, before)
      !> Placed ends in x and in y
      type(ends_t), intent(in) :: ends(2)
      !> Bounds of the step before [m]
      real(wp), intent(in) :: before(:, :)
      integer :: a

      bytes_of = size(before, kind=lp)*int(storage_size(before)/8, lp)
      do a = 1, 2
         bytes_of = bytes_of + &
            size(ends(a)%value, kind=lp)*int((storage_size(ends(a)%value) + storage_size(ends(a)%code))/8, lp)
      end do
   end function bytes_of

end module polydem_sweep_ends
