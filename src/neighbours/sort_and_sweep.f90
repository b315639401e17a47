!> Incremental sort-and-sweep on two axes.
!>
!> Each axis has a list of the lower and higher ends of all boxes, ordered by (value, lower before higher,
!> box), so that touching boxes count as overlapping. A step sorts the lists again by pairwise exchange,
!> which is fast because they are nearly sorted. Every change of a pair shows as an exchange of a lower end
!> with a higher one:
!>
!>     a lower end goes below a higher end     the two boxes may begin to overlap
!>     a higher end goes below a lower end     they may cease to overlap
!>
!> and the bounds of the step and of the step before decide. A change that shows on both axes is reported by
!> x only: y reports a beginning only if the boxes overlapped in x before, an end only if they still do.
!>
!> Krengel et al. (2026) drop parted pairs in a second loop over the list of pairs. Here ends come from
!> exchanges just as beginnings do, so that a step without exchanges does no work on pairs at all.
!> As there, the first lists are made by sorting the centres of the boxes with a fast sort; both ends of a
!> box start at the rank of its centre, and the first incremental sort then reports the first pairs.
!>
!> The axes share nothing that is written and run on two threads.
module polydem_sort_and_sweep
   use polydem_boxes, only: boxes_t
   use polydem_counters, only: counters_t
   use polydem_finder, only: finder_t
   use polydem_kinds, only: ip, lp, wp, worth_threads
   use polydem_pair_changes, only: pair_changes_t
   use polydem_sort_reals, only: sort_reals
   implicit none
   private
   public :: sort_and_sweep_t

   !> Ends of all boxes along one axis
   type :: ends_t
      !> Value of each end [m], ascending
      real(wp), allocatable :: value(:)
      !> Twice the box of each end, plus one if it is the higher end
      integer(ip), allocatable :: code(:)
   end type ends_t

   !> What one axis reports
   type :: axis_t
      !> Changes that this axis reported in the step
      type(pair_changes_t) :: changes
      !> Exchanges so far
      integer(lp) :: exchanges = 0_lp
      !> Exchanges of a lower with a higher end so far
      integer(lp) :: events = 0_lp
      !> Beginnings reported so far
      integer(lp) :: begins = 0_lp
      !> Ends reported so far
      integer(lp) :: ends = 0_lp
   end type axis_t

   !> Finder that keeps the ends of boxes sorted
   type, extends(finder_t) :: sort_and_sweep_t
      private
      !> Ends of all boxes in x and in y
      type(ends_t) :: ends(2)
      !> Reports of x and of y
      type(axis_t) :: axis(2)
      !> Bounds of the step before, (4, box) [m]
      real(wp), allocatable :: before(:, :)
      integer(lp) :: steps = 0_lp
   contains
      procedure :: find
      procedure :: report
   end type sort_and_sweep_t

contains

   !> Sort the ends again and record the changes that their exchanges show.
   subroutine find(self, boxes, changes)
      class(sort_and_sweep_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      type(pair_changes_t), intent(inout) :: changes
      integer :: a

      if (.not. allocated(self%before)) call start(self, boxes)
      !$omp parallel do if (boxes%n > worth_threads) schedule(static, 1) default(none) shared(self, boxes) private(a)
      do a = 1, 2
         call self%axis(a)%changes%clear()
         call sort_axis(a, boxes, boxes%n, boxes%bounds, self%before, 2_ip*boxes%n, &
                        self%ends(a)%value, self%ends(a)%code, self%axis(a))
      end do
      !$omp end parallel do
      self%before(:, 1:boxes%n) = boxes%bounds(:, 1:boxes%n)
      self%steps = self%steps + 1_lp
      do a = 1, 2
         call changes%append(self%axis(a)%changes)
      end do
   end subroutine find

   !> Place both ends of each box at the rank of its centre, as if no two boxes overlapped.
   subroutine start(self, boxes)
      type(sort_and_sweep_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      real(wp), allocatable :: centre(:)
      integer(ip), allocatable :: ranked(:)
      integer(ip) :: k
      integer :: a

      allocate (self%before(4, boxes%n))
      self%before(1:2, :) = huge(1.0_wp)
      self%before(3:4, :) = -huge(1.0_wp)
      allocate (centre(boxes%n), ranked(boxes%n))
      do a = 1, 2
         centre = 0.5_wp*boxes%bounds(a, 1:boxes%n) + 0.5_wp*boxes%bounds(a + 2, 1:boxes%n)
         call sort_reals(centre, ranked)
         allocate (self%ends(a)%value(2_ip*boxes%n), self%ends(a)%code(2_ip*boxes%n))
         do k = 1_ip, boxes%n
            self%ends(a)%code(2_ip*k - 1_ip) = 2_ip*ranked(k)
            self%ends(a)%code(2_ip*k) = 2_ip*ranked(k) + 1_ip
         end do
      end do
   end subroutine start

   !> Bring one list of ends up to date by insertion; every inversion is exchanged exactly once.
   !>
   !> Counts stay in variables of the thread until the end: the other axis is near in memory.
   subroutine sort_axis(a, boxes, n_boxes, now, before, n_ends, value, axis_code, axis)
      !> 1 for x, 2 for y
      integer, intent(in) :: a
      type(boxes_t), intent(in) :: boxes
      integer(ip), intent(in) :: n_boxes
      !> Bounds of this step and of the step before
      real(wp), intent(in) :: now(4, n_boxes), before(4, n_boxes)
      integer(ip), intent(in) :: n_ends
      !> Values and codes of the ends
      real(wp), intent(inout) :: value(n_ends)
      integer(ip), intent(inout) :: axis_code(n_ends)
      !> For changes and counts
      type(axis_t), intent(inout) :: axis
      real(wp) :: new
      integer(ip) :: k, place, code, other
      integer(lp) :: exchanges, events

      exchanges = 0_lp
      events = 0_lp
      do k = 1_ip, n_ends
         code = axis_code(k)
         new = now(a + 2_ip*iand(code, 1_ip), shiftr(code, 1))
         place = k
         do while (place > 1_ip)
            if (value(place - 1_ip) < new) exit
            other = axis_code(place - 1_ip)
            if (.not. (value(place - 1_ip) > new)) then
               if (comes_before(other, code)) exit
            end if
            if (iand(ieor(code, other), 1_ip) == 1_ip) then
               events = events + 1_lp
               call judge(a, code, other, boxes, n_boxes, now, before, axis)
            end if
            value(place) = value(place - 1_ip)
            axis_code(place) = other
            place = place - 1_ip
         end do
         value(place) = new
         axis_code(place) = code
         exchanges = exchanges + int(k - place, lp)
      end do
      axis%exchanges = axis%exchanges + exchanges
      axis%events = axis%events + events
   end subroutine sort_axis

   !> Order of ends of equal value: lower ends first, then by box
   pure logical function comes_before(code, other)
      integer(ip), intent(in) :: code, other

      comes_before = iand(code, 1_ip) < iand(other, 1_ip) .or. &
         (iand(code, 1_ip) == iand(other, 1_ip) .and. code < other)
   end function comes_before

   !> Record the change, if any, that shows as one end going below another of the other sort.
   subroutine judge(a, code, other, boxes, n_boxes, now, before, axis)
      !> 1 for x, 2 for y
      integer, intent(in) :: a
      !> End that goes down, end that it passes
      integer(ip), intent(in) :: code, other
      type(boxes_t), intent(in) :: boxes
      integer(ip), intent(in) :: n_boxes
      real(wp), intent(in) :: now(4, n_boxes), before(4, n_boxes)
      type(axis_t), intent(inout) :: axis
      integer(ip) :: i, j
      logical :: begins, changed

      i = shiftr(code, 1)
      j = shiftr(other, 1)
      begins = iand(code, 1_ip) == 0_ip
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
      if (boxes%body(i) == boxes%body(j) .or. (boxes%fixed(i) .and. boxes%fixed(j))) return
      call axis%changes%record(boxes%body(i), boxes%body(j), merge(1_ip, -1_ip, begins))
      axis%begins = axis%begins + merge(1_lp, 0_lp, begins)
      axis%ends = axis%ends + merge(0_lp, 1_lp, begins)
   end subroutine judge

   !> Whether two boxes overlap on an axis
   pure logical function meet(one, other, a)
      real(wp), intent(in) :: one(4), other(4)
      integer, intent(in) :: a

      meet = one(a) <= other(a + 2) .and. other(a) <= one(a + 2)
   end function meet

   !> Set the counters of the sweep: steps, and per axis exchanges, events, begins and ends.
   subroutine report(self, counters)
      class(sort_and_sweep_t), intent(in) :: self
      type(counters_t), intent(inout) :: counters
      character(len=1), parameter :: name(2) = ['x', 'y']
      integer :: a

      call counters%set('sort_and_sweep_steps', self%steps)
      do a = 1, 2
         call counters%set('sort_and_sweep_'//name(a)//'_exchanges', self%axis(a)%exchanges)
         call counters%set('sort_and_sweep_'//name(a)//'_events', self%axis(a)%events)
         call counters%set('sort_and_sweep_'//name(a)//'_begins', self%axis(a)%begins)
         call counters%set('sort_and_sweep_'//name(a)//'_ends', self%axis(a)%ends)
      end do
   end subroutine report

end module polydem_sort_and_sweep
