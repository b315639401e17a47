!> Verlet list (Verlet 1967): pairs of boxes whose padded boxes overlap. The padding on every side is half the skin.
!>
!> Each step first tests whether every box lies inside its padded box of the last rebuild. As long as all boxes do,
!> boxes that are not in the list cannot overlap, for any displacement, rotation, change of shape and rounding. The step
!> then compares the pairs of the list in one loop over plain arrays and records the changes. If a box does not lie
!> inside its padded box, a search in cells makes a new list in ascending order (`polydem_cell_grids`, levels as in the
!> hierarchical grid), and the states of its pairs are copied from the old list.
!>
!> The skin s has an optimum: a thick skin gives many pairs, a thin skin frequent rebuilds. Let a list of n boxes last
!> for m steps and contain k pairs that do not overlap. To first order k and m are proportional to s, because boxes move
!> with a given speed. Unnecessary tests cost k per step. Rebuilds cost R n/m per step, if a rebuild costs as much as R
!> tests per box. The sum is least if both costs are equal, at
!>
!>     s' = s sqrt(R n/(k m)).
!>
!> Every rebuild changes the skin to this value, but at most by a factor of two. It uses exact counts of the life of the
!> last list and no clock, so runs are reproducible. A list that lasts too long (k m > 4 R n, for example at rest) is
!> rebuilt with half the skin.
module polydem_verlet
   use polydem_boxes, only: boxes_t
   use polydem_candidate_rows, only: candidate_rows_t
   use polydem_cell_grids, only: cell_grids_t
   use polydem_finder, only: finder_t
   use polydem_finder_statistics, only: count_bytes, count_candidates, count_depth, count_nodes, count_rebuilds, &
      count_searches, count_tests, count_visits, phase_filter, phase_search, phase_structure
   use polydem_kinds, only: bp, dp, ip, lp, wp, min_parallel_size
   use polydem_pair_changes, only: pair_changes_t
   use polydem_size_levels, only: choose_levels, typical_side
   use polydem_thread_changes, only: part, thread_changes_t
   implicit none
   private
   public :: verlet_t

   !> Cost of a rebuild per box in units of the cost of comparing a candidate (R above; measured in drums: 30 with
   !> 2522 boxes, 58 with 12651)
   real(dp), parameter :: rebuild_cost = 30.0_dp
   !> Initial value, lower and upper bound of the automatic skin in units of the typical side of a box
   real(wp), parameter :: first_skin = 0.125_wp, least_skin = 2.0_wp**(-10), greatest_skin = 4.0_wp
   !> Number of boxes in a block; after each block there is a test whether a box has left its padded box
   integer(ip), parameter :: block_size = 256_ip

   !> Finder that stores a list of possible pairs until a box has moved too far
   type, extends(finder_t) :: verlet_t
      !> Approach of two boxes after which the list must be rebuilt [m]; 0: automatic
      real(wp) :: skin = 0.0_wp
      !> Present skin [m]
      real(wp), private :: thickness = 0.0_wp
      !> Typical side of a box [m]
      real(wp), private :: side = 0.0_wp
      !> Number of steps since the last rebuild
      integer(lp), private :: age = 0_lp
      !> Number of candidates that did not overlap at the last rebuild
      integer(lp), private :: surplus = 0_lp
      !> Padded boxes of the last rebuild, (4, box) [m]
      real(wp), allocatable, private :: padded(:, :)
      !> Candidates in ascending order, lower box first
      type(candidate_rows_t), private :: candidates
      !> Grids for the search of a rebuild
      type(cell_grids_t), private :: grids
      !> Changes that each thread recorded
      type(thread_changes_t), private :: changes
   contains
      procedure :: find
      procedure :: survey
   end type verlet_t

contains

   !> Rebuild the list if necessary, then compare all candidates.
   subroutine find(self, boxes, changes)
      class(verlet_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      type(pair_changes_t), intent(inout) :: changes
      logical :: keep

      call self%changes%clear()
      if (allocated(self%padded)) then
         self%age = self%age + 1_lp
         keep = all_inside(self, boxes) .and. .not. is_too_thick(self, boxes%n)
         if (.not. keep .and. .not. self%skin > 0.0_wp) call adapt_skin(self, boxes%n)
      else
         call start(self, boxes)
         keep = .false.
      end if
      call self%work%lap(phase_structure)
      if (.not. keep) call rebuild(self, boxes)
      call compare_candidates(self, boxes)
      if (.not. keep) self%surplus = int(self%candidates%n, lp) - &
         count(self%candidates%overlap(1:self%candidates%n) /= 0_bp, kind=lp)
      call self%changes%join(changes)
      call self%work%lap(phase_filter)
   end subroutine find

   !> Choose skin and grids, and make an empty list; no box is inside its padded box.
   subroutine start(self, boxes)
      type(verlet_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      integer(ip), allocatable :: level(:)
      real(dp), allocatable :: largest(:)
      integer :: n_levels

      self%side = typical_side(boxes)
      self%thickness = self%skin
      if (.not. self%skin > 0.0_wp) self%thickness = first_skin*self%side
      call choose_levels(boxes, self%thickness, n_levels, level, largest)
      call self%grids%set_levels(n_levels, level, boxes%fixed(1:boxes%n))
      self%candidates%isa = self%isa
      call self%candidates%start(boxes%n)
      allocate (self%padded(4, boxes%n))
      self%padded = spread([1.0_wp, 1.0_wp, -1.0_wp, -1.0_wp]*huge(1.0_wp), 2, boxes%n)
   end subroutine start

   !> Whether every box lies inside its padded box
   logical function all_inside(self, boxes)
      type(verlet_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      integer(ip) :: low, high
      integer :: w
      logical :: inside(self%changes%n_threads())

      !$omp parallel do if (boxes%n > min_parallel_size) schedule(static, 1) default(none) &
      !$omp    shared(self, boxes, inside) private(w, low, high)
      do w = 1, size(inside)
         call part(boxes%n, size(inside), w, low, high)
         inside(w) = part_inside(boxes%n, boxes%bounds, self%padded, low, high)
      end do
      !$omp end parallel do
      all_inside = all(inside)
   end function all_inside

   !> Whether the boxes low..high lie inside their padded boxes; the loop over a block has no branches
   pure logical function part_inside(n, bounds, padded, low, high) result(inside)
      integer(ip), intent(in) :: n, low, high
      real(wp), intent(in) :: bounds(4, n), padded(4, n)
      real(wp) :: least(4)
      integer(ip) :: from, i

      inside = .true.
      do from = low, high, block_size
         least = 0.0_wp
         do i = from, min(from + block_size - 1_ip, high)
            least(1:2) = min(least(1:2), bounds(1:2, i) - padded(1:2, i))
            least(3:4) = min(least(3:4), padded(3:4, i) - bounds(3:4, i))
         end do
         inside = all(least >= 0.0_wp)
         if (.not. inside) return
      end do
   end function part_inside

   !> Whether an automatic skin is much too thick
   pure logical function is_too_thick(self, n)
      type(verlet_t), intent(in) :: self
      integer(ip), intent(in) :: n

      is_too_thick = real(self%surplus, dp)*real(self%age, dp) > 4.0_dp*rebuild_cost*real(n, dp) .and. &
         .not. self%skin > 0.0_wp .and. self%thickness > least_skin*self%side
   end function is_too_thick

   !> Set the skin from the counts of the last list.
   pure subroutine adapt_skin(self, n)
      type(verlet_t), intent(inout) :: self
      integer(ip), intent(in) :: n
      real(dp) :: factor

      factor = sqrt(rebuild_cost*real(n, dp)/(real(max(self%surplus, 1_lp), dp)*real(self%age, dp)))
      self%thickness = self%thickness*real(min(max(factor, 0.5_dp), 2.0_dp), wp)
      self%thickness = min(max(self%thickness, least_skin*self%side), greatest_skin*self%side)
   end subroutine adapt_skin

   !> Rebuild the list of candidates.
   subroutine rebuild(self, boxes)
      type(verlet_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      integer(lp) :: tests

      self%age = 0_lp
      call self%candidates%update_states(boxes, self%padded, self%changes%of)
      self%padded(1:2, :) = boxes%bounds(1:2, 1:boxes%n) - 0.5_wp*self%thickness
      self%padded(3:4, :) = boxes%bounds(3:4, 1:boxes%n) + 0.5_wp*self%thickness
      call self%grids%build(boxes%n, self%padded)
      call self%work%add(count_rebuilds, 1_lp)
      call self%work%lap(phase_structure)
      tests = self%grids%total%tests
      call self%grids%search(boxes)
      call self%work%add(count_tests, self%grids%total%tests - tests)
      self%work%value(count_searches) = self%grids%total%searches
      self%work%value(count_visits) = self%grids%total%visits
      call self%candidates%replace(self%grids%found, boxes, self%changes%of, with_states=.true.)
      call self%work%lap(phase_search)
   end subroutine rebuild

   !> Compare the boxes of all candidates.
   subroutine compare_candidates(self, boxes)
      type(verlet_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      integer(ip) :: low, high
      integer :: w

      !$omp parallel do if (self%candidates%n > min_parallel_size) schedule(static, 1) default(none) &
      !$omp    shared(self, boxes) private(w, low, high)
      do w = 1, self%changes%n_threads()
         call part(self%candidates%n, self%changes%n_threads(), w, low, high)
         call self%candidates%compare(low, high, boxes%bounds, boxes%piece, self%changes%of(w))
      end do
      !$omp end parallel do
      call self%work%add(count_tests, int(self%candidates%n, lp))
   end subroutine compare_candidates

   !> Set the counters: candidates, cells, grids, and memory [B].
   subroutine survey(self)
      class(verlet_t), intent(inout) :: self

      if (.not. allocated(self%padded)) return
      self%work%value(count_candidates) = int(self%candidates%n, lp)
      self%work%value(count_nodes) = int(self%grids%n_cells, lp)
      self%work%value(count_depth) = int(self%grids%n_levels, lp)
      self%work%value(count_bytes) = self%candidates%bytes() + self%grids%bytes() + &
         int(storage_size(self%padded)/8, lp)*size(self%padded, kind=lp)
   end subroutine survey

end module polydem_verlet
