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
!> Rounding. Let u be the unit roundoff, and let |p| + T|v| <= L for all lines of boxes that are not off.
!>
!>  * A predicted position q = fl(p + fl(v s)) differs from p + v s by less than 2.1 u L.
!>  * A side x with fl|x - q| <= d fulfils |x - q| <= d (1 + 2u). So it is less than d (1 + 2u) + 2.1 u L from p + v s,
!>    and a gap of two boxes is less than 2 d (1 + 2u) + 4.2 u L from g(s).
!>  * The gaps between lines at step s are computed as fl(fl(p_a - p_b) + fl(fl(v_a - v_b) s)), with an error of less
!>    than 10.5 u L.
!>
!> All errors together are less than 15 u L + 4 u d. Lines with |p| + T|v| > L = d/(1024 u) are not used: their boxes
!> are off. The errors are then less than d/64, and m = (2 + 1/32) d covers them and the rounding of m itself. For the
!> same reason a box on its lines is closer than (1 + 1/32) d to the straight tubes of `find_room`.
!>
!> The tolerance and the length of the intervals follow from exact counts of comparisons, never from a clock, so runs
!> are reproducible. Both are set where two costs are equal (`adapt`).
module polydem_line_filter
   use polydem_active_pairs, only: active_pairs_t
   use polydem_box_lines, only: box_lines_t, list_differences, trust
   use polydem_candidates, only: candidates_t, index_list_t
   use polydem_kinds, only: bp, dp, ip, lp, sp, wp
   use polydem_line_lanes_base, only: active, overlapping, pair_block
   use polydem_pair_changes, only: pair_changes_t
   implicit none
   private
   public :: line_filter_t, class_cost

   !> Costs in units of a comparison of two boxes (measured): new lines of a box, classification or review of a
   !> candidate, a box that leaves its lines
   real(dp), parameter :: line_cost = 7.0_dp, class_cost = 6.0_dp, leave_cost = 40.0_dp
   !> Initial value, lower and upper bound of the tolerance in units of the typical side of a box
   real(wp), parameter :: first_tolerance = 2.0_wp**(-7), least_tolerance = 2.0_wp**(-20), &
      greatest_tolerance = 2.0_wp**(-3)
   !> Initial value, lower and upper bound of the length of an interval [steps]
   real(dp), parameter :: first_length = 16.0_dp, least_length = 2.0_dp, greatest_length = 1024.0_dp
   !> Number of times that a box may leave its lines in an interval before it is off
   integer(bp), parameter :: often = 4_bp

   !> Lines of all boxes, and active candidates
   type, extends(box_lines_t) :: line_filter_t
      !> Active candidates
      type(active_pairs_t) :: active
      !> Boxes that are off in this interval
      type(index_list_t) :: off
      !> Number of times that each box left its lines in this interval, `often` if it is off, (box)
      integer(bp), allocatable, private :: left(:)
      !> Place of each candidate in `active`, 0 if it is not active, (candidate)
      integer(ip), allocatable, private :: active_at(:)
      !> Length of the intervals before rounding to whole steps
      real(dp), private :: exact_length = first_length
      !> Number of active candidates at the start of the interval
      integer(ip), private :: n_first = 0_ip
      !> Number of comparisons in this interval of candidates that became active in it
      integer(lp), private :: n_extra = 0_lp
      !> Number of times that boxes left their lines in this interval
      integer(lp), private :: n_left = 0_lp
      !> Number of candidates that were reviewed in this interval
      integer(lp), private :: n_reviewed = 0_lp
   contains
      procedure :: start
      procedure :: is_due
      procedure :: begin_interval
      procedure :: classify
      procedure :: collect
      procedure :: leave_lines
      procedure :: mark_off
      procedure :: is_off
      procedure :: review
      procedure :: activate
      procedure :: forget
      procedure :: surplus
      procedure :: count_step
      procedure :: bytes
   end type line_filter_t

contains

   !> Start without candidates; all velocities are zero.
   subroutine start(self, n_boxes, side)
      class(line_filter_t), intent(inout) :: self
      !> Number of boxes
      integer(ip), intent(in) :: n_boxes
      !> Typical side of a box [m]
      real(wp), intent(in) :: side

      allocate (self%place(4, n_boxes), source=0.0_wp)
      allocate (self%speed(4, n_boxes), source=0.0_sp)
      allocate (self%drawn(n_boxes), source=0_ip)
      allocate (self%left(n_boxes), source=0_bp)
      allocate (self%active_at(0))
      self%side = side
      self%tolerance = first_tolerance*side
      call self%active%reserve(64_ip)
   end subroutine start

   !> Whether an interval should begin: the last one is over, or the comparisons that boxes off their lines cost exceed
   !> the cost of a new interval
   pure logical function is_due(self, n_candidates)
      class(line_filter_t), intent(in) :: self
      !> Number of candidates
      integer(ip), intent(in) :: n_candidates

      is_due = self%step > self%length .or. extra_cost(self) > interval_cost(self, n_candidates)
   end function is_due

   !> Cost of the start of an interval [comparisons]
   pure real(dp) function interval_cost(self, n_candidates)
      type(line_filter_t), intent(in) :: self
      integer(ip), intent(in) :: n_candidates

      interval_cost = line_cost*real(size(self%left), dp) + class_cost*real(n_candidates, dp)
   end function interval_cost

   !> Cost of the boxes that left their lines in this interval [comparisons]
   pure real(dp) function extra_cost(self)
      type(line_filter_t), intent(in) :: self

      extra_cost = real(self%n_extra, dp) + leave_cost*real(self%n_left, dp) + class_cost*real(self%n_reviewed, dp)
   end function extra_cost

   !> Set tolerance and length of a new interval. `write_back` must have been called. Then call `draw_lines`, and
   !> `classify` and `collect` when the candidates are complete.
   pure subroutine begin_interval(self, n_candidates, longest)
      class(line_filter_t), intent(inout) :: self
      !> Number of candidates in the last interval
      integer(ip), intent(in) :: n_candidates
      !> Upper bound of the length [steps]
      integer(ip), intent(in) :: longest

      if (self%length > 0_ip .and. self%is_due(n_candidates)) call adapt(self, n_candidates)
      self%length = min(nint(self%exact_length, ip), longest)
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
   !> The new length makes I/T equal to B + X, the new tolerance makes C equal to X; both change slowly.
   pure subroutine adapt(self, n_candidates)
      type(line_filter_t), intent(inout) :: self
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
      factor = sqrt(max(off, 1.0_dp)/max(touching, 1.0_dp))
      self%tolerance = self%tolerance*real(min(max(factor, 0.75_dp), 4.0_dp), wp)
      self%tolerance = min(max(self%tolerance, least_tolerance*self%side), greatest_tolerance*self%side)
   end subroutine adapt

   !> Classify a range of candidates at the start of an interval. The present boxes are those of `draw_lines`.
   pure subroutine classify(self, low, high, body, candidates, found, changes)
      class(line_filter_t), intent(in) :: self
      !> First and last candidate
      integer(ip), intent(in) :: low, high
      !> Body of each box, (box)
      integer(ip), intent(in) :: body(:)
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
         call list_differences(to - from + 1_ip, kind, candidates%overlap(from:to), n, listed)
         do m = 1_ip, n
            k = from + listed(m) - 1_ip
            if (kind(listed(m)) /= active) then
               candidates%overlap(k) = kind(listed(m))
               call changes%record(body(candidates%box(1, k)), body(candidates%box(2, k)), &
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
      class(line_filter_t), intent(inout) :: self
      !> Number of candidates
      integer(ip), intent(in) :: n_candidates
      !> Active candidates of each thread, (thread)
      type(active_pairs_t), intent(in) :: found(:)
      integer(ip) :: k, n
      integer :: w

      if (size(self%active_at) < n_candidates) then
         deallocate (self%active_at)
         allocate (self%active_at(n_candidates + n_candidates/4_ip + 64_ip))
      end if
      self%active_at = 0_ip
      call self%active%reserve(sum(found%n))
      n = 0_ip
      do w = 1, size(found)
         do k = 1_ip, found(w)%n
            n = n + 1_ip
            self%active%box(:, n) = found(w)%box(:, k)
            self%active%overlap(n) = found(w)%overlap(k)
            self%active%owner(n) = found(w)%owner(k)
            self%active_at(found(w)%owner(k)) = n
         end do
      end do
      self%active%n = n
      self%active%n_close = sum(found%n_close)
      self%active%n_sure = sum(found%n_sure)
      self%n_first = n
      if (self%step > 0_ip) self%share = trust
      self%step = 0_ip
   end subroutine collect

   !> Draw new lines through a box that left its lines in this step; it is off if that is often the case.
   pure subroutine leave_lines(self, i, box)
      class(line_filter_t), intent(inout) :: self
      !> Box
      integer(ip), intent(in) :: i
      !> Its bounds [m]
      real(wp), intent(in) :: box(4)

      call self%redraw(i, box)
      self%n_left = self%n_left + 1_lp
      if (self%left(i) < often) self%left(i) = self%left(i) + 1_bp
      if (self%left(i) == often - 1_bp) call self%mark_off(i)
   end subroutine leave_lines

   !> Mark a box as off; all its candidates must be activated.
   pure subroutine mark_off(self, i)
      class(line_filter_t), intent(inout) :: self
      !> Box that is not off
      integer(ip), intent(in) :: i

      self%left(i) = often
      call self%off%push(i)
   end subroutine mark_off

   !> Whether a box is off
   pure logical function is_off(self, i)
      class(line_filter_t), intent(in) :: self
      !> Box
      integer(ip), intent(in) :: i

      is_off = self%left(i) >= often
   end function is_off

   !> Activate those candidates of a box with new lines whose state is not sure from this step to the end of the
   !> interval; all of them if the box is off.
   pure subroutine review(self, i, own, candidates)
      class(line_filter_t), intent(inout) :: self
      !> Box
      integer(ip), intent(in) :: i
      !> Numbers of its candidates
      type(index_list_t), intent(in) :: own
      !> All candidates; the states of those that are not active are valid
      class(candidates_t), intent(in) :: candidates
      integer(ip) :: unsure(pair_block), box(2, pair_block), listed(pair_block + 1_ip), next, n, n_listed, m, k
      integer(bp) :: state(pair_block), kind(pair_block)

      if (own%n > 0_ip) call reserve_places(self, candidates%n)
      next = 1_ip
      do while (next <= own%n)
         n = 0_ip
         do while (next <= own%n .and. n < pair_block)
            k = own%at(next)
            next = next + 1_ip
            if (self%active_at(k) /= 0_ip) cycle
            n = n + 1_ip
            unsure(n) = k
            box(1, n) = candidates%box(1, k)
            box(2, n) = candidates%box(2, k)
            state(n) = candidates%overlap(k)
         end do
         kind = active
         if (.not. self%is_off(i)) then
            self%n_reviewed = self%n_reviewed + int(n, lp)
            call self%classify_pairs(n, box, self%step, kind)
         end if
         call list_differences(n, kind, state, n_listed, listed)
         do m = 1_ip, n_listed
            call self%activate(unsure(listed(m)), candidates)
         end do
      end do
   end subroutine review

   !> Make a candidate active, unless it is.
   pure subroutine activate(self, k, candidates)
      class(line_filter_t), intent(inout) :: self
      !> Number of the candidate
      integer(ip), intent(in) :: k
      !> All candidates
      class(candidates_t), intent(in) :: candidates

      call reserve_places(self, k)
      if (self%active_at(k) /= 0_ip) return
      call self%active%append(k, candidates)
      self%active_at(k) = self%active%n
   end subroutine activate

   !> Take a candidate out of the active ones before it is removed; the last candidate gets its number.
   pure subroutine forget(self, k, last)
      class(line_filter_t), intent(inout) :: self
      !> Number of the candidate, and of the last candidate
      integer(ip), intent(in) :: k, last
      integer(ip) :: p

      call reserve_places(self, last)
      p = self%active_at(k)
      if (p /= 0_ip) then
         call self%active%remove(p)
         self%active_at(self%active%owner(p)) = p
      end if
      self%active_at(k) = self%active_at(last)
      if (k == last) self%active_at(k) = 0_ip
      if (self%active_at(k) /= 0_ip) self%active%owner(self%active_at(k)) = k
      self%active_at(last) = 0_ip
   end subroutine forget

   !> Make room for the places of n candidates; new ones are not active.
   pure subroutine reserve_places(self, n)
      type(line_filter_t), intent(inout) :: self
      integer(ip), intent(in) :: n
      integer(ip), allocatable :: longer(:)

      if (n <= size(self%active_at)) return
      allocate (longer(n + n/4_ip + 64_ip), source=0_ip)
      longer(1:size(self%active_at)) = self%active_at
      call move_alloc(longer, self%active_at)
   end subroutine reserve_places

   !> Work in this interval on candidates that were separate when it began [comparisons]
   pure real(dp) function surplus(self)
      class(line_filter_t), intent(in) :: self

      surplus = real(self%n_extra, dp) + class_cost*real(self%n_reviewed, dp)
   end function surplus

   !> Add the comparisons of this step to the cost of the interval.
   pure subroutine count_step(self)
      class(line_filter_t), intent(inout) :: self

      self%n_extra = self%n_extra + max(0_lp, int(self%active%n - self%n_first, lp))
   end subroutine count_step

   !> Allocated memory [B]
   pure integer(lp) function bytes(self)
      class(line_filter_t), intent(in) :: self

      bytes = 0_lp
      if (.not. allocated(self%place)) return
      bytes = (int(storage_size(self%place) + storage_size(self%speed), lp)*size(self%place, kind=lp) + &
               int(storage_size(self%active_at), lp)*(size(self%active_at, kind=lp) + &
                                                      3_lp*size(self%active%owner, kind=lp)) + &
               int(storage_size(self%left), lp)*(size(self%left, kind=lp) + size(self%active%overlap, kind=lp)))/8_lp
   end function bytes

end module polydem_line_filter
