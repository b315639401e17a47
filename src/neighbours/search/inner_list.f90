!> Filter of candidates: pairs whose state cannot change are not compared.
!>
!> At the start of an *interval* of T steps each side of each box gets a line p + v s, the position predicted for step s
!> of the interval, s = 0..T. A step measures the distances of all sides from their lines, in one loop over plain
!> arrays. A box is *on its lines* while no side is farther from its line than the tolerance d. The gaps between the
!> sides of two boxes that are on their lines differ from the gaps g(s) between the lines by 2 d at most. g is linear in
!> s, so it lies between g(0) and g(T). With a margin m slightly above 2 d a candidate is
!>
!>     surely overlapping    if all four gaps are below -m at both ends of the interval
!>     surely separate       if one of the gaps is above m at both ends
!>     active                otherwise
!>
!> Only active candidates are compared. A box that leaves its lines at step s gets new ones, and its candidates are
!> reviewed: those that are not sure between s and T become active. A box that leaves its lines often is *off*: all its
!> candidates are active until the next interval.
!>
!> Rounding. Lines and their gaps are numbers of single precision, with unit roundoff u; places count from an origin o.
!> Let |p| + T|v| <= L for all lines of boxes that are not off, and let L be 100 d or more.
!>
!>  * A side at x is compared with its line after it is moved down by the tolerance, as x - b with b = fl(o + d). Its
!>    distance from b, rounded to single precision, has an error below 2.1 u |x - b|; b has an error below u L, since L
!>    includes |o| times the ratio of the roundoffs of coordinates and lines.
!>  * The line fl(p + fl(v s)) has an error below 1.01 u (2 L).
!>  * A side whose computed distance from it lies between -2 d and 0 is less than d plus these errors from p + v s. With
!>    |x - b| < 1.02 L + d the sum is less than d + 5.4 u L. So a gap of two boxes is less than 2 d + 10.8 u L from
!>    g(s).
!>  * The gaps between lines at step s are computed as fl(fl(p_a - p_b) + fl(fl(v_a - v_b) s)), with an error of less
!>    than 8.3 u L.
!>
!> All errors together are less than 19.1 u L, and m = 2 d + 20 u L covers them and the rounding of m itself. For the
!> same reason a box on its lines is inside the straight tubes of half width d + 20 u L.
!>
!> L follows from the places of the boxes at the start of the interval, but at most 2^19 d of it: the margin then grows
!> by less than d. Lines beyond L are not used: their boxes are off. So are all boxes if the tolerance is so small that
!> products could underflow.
!>
!> The tolerance and the length of the intervals follow from exact counts of comparisons, never from a clock, so runs
!> are reproducible. Both are set where two costs are equal (`adapt`).
module polydem_inner_list
   use polydem_active_pairs, only: active_pairs_t
   use polydem_box_lines, only: box_lines_t, list_differences, trust
   use polydem_candidates, only: candidates_t
   use polydem_index_list, only: index_list_t
   use polydem_kinds, only: bp, dp, ip, lp, sp, wp
   use polydem_line_lanes_base, only: active, overlapping, pair_block
   use polydem_pair_changes, only: pair_changes_t
   implicit none
   private
   public :: inner_list_t, class_cost

   !> Costs in units of a comparison of two boxes (measured): new lines of a box, classification or review of a
   !> candidate, a box that leaves its lines
   real(dp), parameter :: line_cost = 6.0_dp, class_cost = 3.0_dp, leave_cost = 60.0_dp
   !> Initial value, lower and upper bound of the tolerance in units of the typical side of a box
   real(wp), parameter :: first_tolerance = 2.0_wp**(-7), least_tolerance = 2.0_wp**(-20), &
      greatest_tolerance = 2.0_wp**(-3)
   !> Initial value, lower and upper bound of the length of an interval [steps]
   real(dp), parameter :: first_length = 16.0_dp, least_length = 2.0_dp, greatest_length = 1024.0_dp
   !> Length of the first interval, which measures velocities [steps]
   integer(ip), parameter :: first_interval = 2_ip
   !> Number of times that a box may leave its lines in an interval before it is off
   integer(bp), parameter :: often = 6_bp

   !> Lines of all boxes, and active candidates
   type, extends(box_lines_t) :: inner_list_t
      !> Active candidates
      type(active_pairs_t) :: active
      !> Boxes that are off in this interval
      type(index_list_t) :: off
      !> Number of times that each box left its lines in this interval, `often` if it is off, (box)
      integer(bp), allocatable, private :: left(:)
      !> Length of the intervals before rounding to whole steps
      real(dp), private :: exact_length = first_length
      !> Number of active candidates at the start of the interval
      integer(ip), private :: n_first = 0_ip
      !> Number of comparisons in this interval of candidates that became active in it
      integer(lp), private :: n_extra = 0_lp
      !> Number of times that boxes left their lines in this interval
      integer(lp) :: n_left = 0_lp
      !> Number of candidates that were reviewed in this interval
      integer(lp) :: n_reviewed = 0_lp
   contains
      procedure :: start
      procedure :: is_due
      procedure :: begin_interval
      procedure :: classify
      procedure :: collect
      procedure :: leave_lines
      procedure :: leaves_often
      procedure :: mark_off
      procedure :: is_off
      procedure :: review
      procedure :: interval_cost
      procedure :: surplus
      procedure :: count_step
      procedure :: bytes
   end type inner_list_t

contains

   !> Start without candidates; all velocities are zero.
   subroutine start(self, n_boxes, side)
      class(inner_list_t), intent(inout) :: self
      !> Number of boxes
      integer(ip), intent(in) :: n_boxes
      !> Typical side of a box [m]
      real(wp), intent(in) :: side

      allocate (self%place(4, n_boxes), source=0.0_sp)
      allocate (self%speed(4, n_boxes), source=0.0_sp)
      allocate (self%drawn(n_boxes), source=0_ip)
      allocate (self%left(n_boxes), source=0_bp)
      self%side = side
      self%tolerance = real(first_tolerance*side, sp)
      self%active%isa = self%isa
      call self%active%reserve(64_ip)
   end subroutine start

   !> Whether an interval should begin: there was none, the last one is over, or the comparisons that boxes off their
   !> lines cost exceed the cost of a new interval
   pure logical function is_due(self, n_candidates)
      class(inner_list_t), intent(in) :: self
      !> Number of candidates
      integer(ip), intent(in) :: n_candidates

      is_due = self%length == 0_ip .or. self%step > self%length .or. &
         extra_cost(self) > self%interval_cost(n_candidates)
   end function is_due

   !> Cost of the start of an interval [comparisons]
   pure real(dp) function interval_cost(self, n_candidates)
      class(inner_list_t), intent(in) :: self
      !> Number of candidates
      integer(ip), intent(in) :: n_candidates

      interval_cost = line_cost*real(size(self%left), dp) + class_cost*real(n_candidates, dp)
   end function interval_cost

   !> Cost of the boxes that left their lines in this interval [comparisons]
   pure real(dp) function extra_cost(self)
      type(inner_list_t), intent(in) :: self

      extra_cost = real(self%n_extra, dp) + leave_cost*real(self%n_left, dp) + class_cost*real(self%n_reviewed, dp)
   end function extra_cost

   !> Set tolerance and length of a new interval. Then call `draw_lines`, and `classify` and `collect` when the
   !> candidates are complete.
   pure subroutine begin_interval(self, candidates)
      class(inner_list_t), intent(inout) :: self
      !> All candidates; the states of the active ones are written back
      class(candidates_t), intent(inout) :: candidates

      call self%active%write_back(candidates)
      if (self%length > 0_ip) then
         if (self%is_due(candidates%n)) call adapt(self, candidates%n)
         self%length = nint(self%exact_length, ip)
      else
         self%length = first_interval
      end if
      self%left = 0_bp
      self%off%n = 0_ip
      self%n_extra = 0_lp
      self%n_left = 0_lp
      self%n_reviewed = 0_lp
   end subroutine begin_interval

   !> Set tolerance and length. Costs per step are, with I the cost of a new interval,
   !>
   !>     I/T      the new intervals
   !>     B        the candidates that are active because of motion, proportional to T
   !>     C        the candidates that are active because a gap is close to zero, proportional to d
   !>     X        the boxes that leave their lines: decreases with d and increases with T
   !>
   !> The new length makes I/T equal to B + X, the new tolerance makes C equal to X; both change slowly. The first
   !> interval has no velocities, so its X says nothing about the tolerance.
   pure subroutine adapt(self, n_candidates)
      type(inner_list_t), intent(inout) :: self
      integer(ip), intent(in) :: n_candidates
      real(dp) :: steps, intervals, moving, touching, off, factor

      steps = real(max(self%step, 1_ip), dp)
      intervals = interval_cost(self, n_candidates)/steps
      off = extra_cost(self)/steps
      touching = real(self%active%n_close, dp)
      moving = real(self%n_first - self%active%n_close, dp)
      factor = sqrt(intervals/max(moving + off, 1.0_dp))
      self%exact_length = min(self%exact_length, max(2.0_dp*steps, first_length))*min(max(factor, 0.5_dp), 2.0_dp)
      self%exact_length = min(max(self%exact_length, least_length), greatest_length)
      if (self%share < trust) return
      factor = sqrt(max(off, 1.0_dp)/max(touching, 1.0_dp))
      self%tolerance = real(min(max(real(self%tolerance, wp)*real(min(max(factor, 0.5_dp), 2.0_dp), wp), &
                                    least_tolerance*self%side), greatest_tolerance*self%side), sp)
   end subroutine adapt

   !> Classify a range of candidates at the start of an interval. The present boxes are those of `draw_lines`. If the
   !> states of the candidates are not known, those of the active ones remain so.
   pure subroutine classify(self, low, high, piece, known, candidates, found, changes)
      class(inner_list_t), intent(in) :: self
      !> First and last candidate
      integer(ip), intent(in) :: low, high
      !> Body of each box, (box)
      integer(ip), intent(in) :: piece(:)
      !> Whether the states of the candidates are known; else no change is recorded
      logical, intent(in) :: known
      !> Candidates; the states of those that are not active are set
      class(candidates_t), intent(inout) :: candidates
      !> Active candidates of the range
      type(active_pairs_t), intent(inout) :: found
      !> Changes of candidates that are not active; appended
      type(pair_changes_t), intent(inout) :: changes
      integer(ip) :: listed(pair_block + 1_ip), from, to, m, n, k
      integer(bp) :: kind(pair_block)

      found%n = 0_ip
      found%n_close = 0_ip
      found%n_sure = 0_ip
      do from = low, high, pair_block
         to = min(from + pair_block - 1_ip, high)
         call self%classify_pairs(to - from + 1_ip, candidates%box(:, from:to), 0_ip, kind)
         found%n_sure = found%n_sure + count(kind(1:to - from + 1_ip) == overlapping, kind=ip)
         call found%reserve(found%n + pair_block)
         if (.not. known) candidates%overlap(from:to) = iand(kind(1:to - from + 1_ip), overlapping)
         call list_differences(to - from + 1_ip, kind, candidates%overlap(from:to), n, listed)
         do m = 1_ip, n
            k = from + listed(m) - 1_ip
            if (candidates%box(1, k) == candidates%box(2, k)) cycle
            if (kind(listed(m)) /= active) then
               candidates%overlap(k) = kind(listed(m))
               call changes%record(piece(candidates%box(1, k)), piece(candidates%box(2, k)), &
                                   2_ip*int(candidates%overlap(k), ip) - 1_ip)
               cycle
            end if
            found%n = found%n + 1_ip
            found%box(1, found%n) = candidates%box(1, k)
            found%box(2, found%n) = candidates%box(2, k)
            found%overlap(found%n) = candidates%overlap(k)
            found%owner(found%n) = k
            if (self%are_close(candidates%box(1, k), candidates%box(2, k))) found%n_close = found%n_close + 1_ip
         end do
      end do
   end subroutine classify

   !> Make the active candidates of the interval from those that the threads found.
   pure subroutine collect(self, n_candidates, found)
      class(inner_list_t), intent(inout) :: self
      !> Number of candidates
      integer(ip), intent(in) :: n_candidates
      !> Active candidates of each thread, (thread)
      type(active_pairs_t), intent(in) :: found(:)
      integer(ip) :: k, n
      integer :: w

      call self%active%reserve(sum(found%n))
      call self%active%reserve_places(n_candidates)
      self%active%place = 0_ip
      n = 0_ip
      do w = 1, size(found)
         do k = 1_ip, found(w)%n
            n = n + 1_ip
            ! Not box(:, n): for a column the compiler calls memmove.
            self%active%box(1, n) = found(w)%box(1, k)
            self%active%box(2, n) = found(w)%box(2, k)
            self%active%overlap(n) = found(w)%overlap(k)
            self%active%owner(n) = found(w)%owner(k)
            self%active%place(found(w)%owner(k)) = n
         end do
      end do
      self%active%n = n
      self%active%n_close = sum(found%n_close)
      self%active%n_sure = sum(found%n_sure)
      self%n_first = n
      if (self%step > 0_ip) self%share = trust
      self%step = 0_ip
   end subroutine collect

   !> Draw new lines through a box that left its lines in this step, and count this.
   pure subroutine leave_lines(self, i, box)
      class(inner_list_t), intent(inout) :: self
      !> Box
      integer(ip), intent(in) :: i
      !> Its bounds [m]
      real(wp), intent(in) :: box(4)

      call self%redraw(i, box)
      if (self%left(i) < often) self%left(i) = self%left(i) + 1_bp
   end subroutine leave_lines

   !> Whether a box that is not off has left its lines so often that it must be marked as off
   pure logical function leaves_often(self, i)
      class(inner_list_t), intent(in) :: self
      !> Box
      integer(ip), intent(in) :: i

      leaves_often = self%left(i) == often - 1_bp
   end function leaves_often

   !> Mark a box as off; all its candidates must be activated.
   pure subroutine mark_off(self, i)
      class(inner_list_t), intent(inout) :: self
      !> Box that is not off
      integer(ip), intent(in) :: i

      self%left(i) = often
      call self%off%push(i)
   end subroutine mark_off

   !> Whether a box is off
   pure logical function is_off(self, i)
      class(inner_list_t), intent(in) :: self
      !> Box
      integer(ip), intent(in) :: i

      is_off = self%left(i) >= often
   end function is_off

   !> Reduce a list of candidates to those that must become active: candidates that are not active, and whose state is
   !> not sure from this step to the end of the interval or one of whose boxes is off.
   pure subroutine review(self, candidates, list, n_reviewed)
      class(inner_list_t), intent(in) :: self
      !> All candidates; the states of those that are not active are valid
      class(candidates_t), intent(in) :: candidates
      !> Numbers of candidates
      type(index_list_t), intent(inout) :: list
      !> Number of candidates that were classified
      integer(lp), intent(out) :: n_reviewed
      ! The loops have no branches, so that places in memory are read at the same time.
      integer(ip) :: asked(pair_block + 1_ip), box(2, pair_block + 1_ip), listed(pair_block + 1_ip)
      integer(bp) :: state(pair_block + 1_ip), kind(pair_block), off(pair_block + 1_ip)
      integer(ip) :: next, n, n_listed, kept, k, m

      n_reviewed = 0_lp
      kept = 0_ip
      do next = 1_ip, list%n, pair_block
         n = 0_ip
         do m = next, min(next + pair_block - 1_ip, list%n)
            k = list%at(m)
            asked(n + 1_ip) = k
            box(1, n + 1_ip) = candidates%box(1, k)
            box(2, n + 1_ip) = candidates%box(2, k)
            state(n + 1_ip) = candidates%overlap(k)
            off(n + 1_ip) = max(self%left(candidates%box(1, k)), self%left(candidates%box(2, k)))
            n = n + merge(1_ip, 0_ip, self%active%place(k) == 0_ip)
         end do
         call self%classify_pairs(n, box, self%step, kind)
         kind(1:n) = merge(active, kind(1:n), off(1:n) >= often)
         n_reviewed = n_reviewed + count(off(1:n) < often, kind=lp)
         call list_differences(n, kind, state, n_listed, listed)
         do m = 1_ip, n_listed
            kept = kept + 1_ip
            list%at(kept) = asked(listed(m))
         end do
      end do
      list%n = kept
   end subroutine review

   !> Work in this interval on candidates that were separate when it began [comparisons]
   pure real(dp) function surplus(self)
      class(inner_list_t), intent(in) :: self

      surplus = real(self%n_extra, dp) + class_cost*real(self%n_reviewed, dp)
   end function surplus

   !> Add the comparisons of this step to the cost of the interval.
   pure subroutine count_step(self)
      class(inner_list_t), intent(inout) :: self

      self%n_extra = self%n_extra + max(0_lp, int(self%active%n - self%n_first, lp))
   end subroutine count_step

   !> Allocated memory [B]
   pure integer(lp) function bytes(self)
      class(inner_list_t), intent(in) :: self

      bytes = 0_lp
      if (.not. allocated(self%place)) return
      bytes = (int(storage_size(self%place) + storage_size(self%speed), lp)*size(self%place, kind=lp) + &
               int(storage_size(self%drawn), lp)*(size(self%drawn, kind=lp) + size(self%active%place, kind=lp) + &
                                                  3_lp*size(self%active%owner, kind=lp)) + &
               int(storage_size(self%left), lp)*(size(self%left, kind=lp) + size(self%active%overlap, kind=lp)))/8_lp
   end function bytes

end module polydem_inner_list
