!> Incremental search on the minimal quadtree.
!>
!> Every box has a *padded cell*: the cell of its leaf, enlarged by the reach of the box. The reach is the largest half
!> side that the box can have at any angle. Two boxes are *candidates* if their padded cells overlap. The padded cells
!> do not change while the centres stay in their leaves, and boxes that are not candidates cannot overlap at any angle.
!> A step therefore
!>
!>  1. moves the boxes whose centre left its leaf and repairs the tree (`polydem_quadtree_nodes`),
!>  2. compares the boxes of all candidates once and records the pairs that begin or cease to overlap,
!>  3. searches the tree again for each box whose leaf changed, or whose leaf was split or merged because of a
!>     neighbour, and for no other box. The padded cells before the step show whether a pair was a candidate before.
!>     Only pairs that have become candidates are added, and pairs that have ceased to be candidates are removed.
!>
!> Krengel et al. (2026) walk across cell edges and corners within a window. Here the search climbs to the lowest
!> ancestor that contains the padded cell, and descends into every cell that is near enough. So it finds all boxes.
!>
!> Each thread works on a contiguous part of a list. While the first thread repairs the tree, the others begin to
!> compare candidates. If few boxes moved, the first thread also searches meanwhile, since the nodes that it has changed
!> are in its cache. The results are joined in the order of the list and do not depend on the number of threads.
!>
!> The same source makes the minimal quadtree, the pruned quadtree, whose leaves all have the same size, and a binary
!> tree along the longer axis for nearly one-dimensional scenes.
module polydem_quadtree
   use polydem_boxes, only: boxes_t
   use polydem_candidates, only: overlapping
   use polydem_exponential, only: exponential, logarithm
   use polydem_filtered_candidates, only: filtered_candidates_t
   use polydem_finder, only: finder_t
   use polydem_finder_statistics, only: count_bytes, count_candidates, count_depth, count_leaf_changes, &
      count_left_leaf, count_nodes, count_searches, count_tests, count_visits, phase_filter, phase_search, &
      phase_structure
   use polydem_index_list, only: index_list_t
   use polydem_kinds, only: dp, ip, lp, wp, min_parallel_size
   use polydem_pair_changes, only: pair_changes_t
   use polydem_quadtree_nodes, only: tree_t
   use polydem_quadtree_search, only: padded_cells_t, search
   use polydem_thread_changes, only: part, thread_changes_t
   implicit none
   private
   public :: quadtree_t

   !> Side of the cells of one level in units of the typical (geometric mean) reach. These are the largest cells that
   !> contain one centre each in a packing; others give up to 1.6 times as many candidates (measured)
   real(dp), parameter :: typical_share = 1.2_dp
   !> Time in which one box is moved in the tree, and in which the boxes whose leaf changes with it are searched, in
   !> comparisons of candidates (measured)
   integer(ip), parameter :: move_cost = 500_ip, search_cost = 1600_ip
   !> Largest number of levels below that level
   integer, parameter :: most_levels = 12

   !> Results of one thread for its part of the lists
   type :: worker_t
      !> Boxes whose centre left its leaf or whose half side exceeds their reach
      type(index_list_t) :: outside
      !> Boxes of new candidates, two entries for each candidate
      type(index_list_t) :: found
      !> Candidates to remove
      type(index_list_t) :: separated
      !> Number of visited nodes
      integer(lp) :: visits = 0_lp
   end type worker_t

   !> Finder that stores a tree
   type, extends(finder_t) :: quadtree_t
      !> Whether all leaves are on the finest level (pruned tree, Vemuri et al. 1998); set before the first step
      logical :: equal_leaves = .false.
      !> Whether the tree uses only the longer axis of the scene (binary tree); set before the first step
      logical :: one_axis = .false.
      !> Whether to compare only candidates whose state can change (`polydem_line_filter`); set before the first step
      logical :: filtered = .false.
      !> Tree of the boxes
      type(tree_t), private :: tree
      !> Candidates
      type(filtered_candidates_t), private :: candidates
      !> Padded cells of the boxes
      type(padded_cells_t), private :: padded
      !> Largest side of each box for which its reach is sufficient, (box) [m]
      real(wp), allocatable, private :: greatest_side(:)
      !> Results of the threads, (thread)
      type(worker_t), allocatable, private :: worker(:)
      !> Changes that each thread recorded
      type(thread_changes_t), private :: changes
   contains
      procedure :: find
      procedure :: survey
   end type quadtree_t

contains

   !> Repair the tree, compare the candidates, and search again for boxes whose leaf changed.
   subroutine find(self, boxes, changes)
      class(quadtree_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      type(pair_changes_t), intent(inout) :: changes

      call prepare_workers(self)
      if (.not. allocated(self%padded%now)) call build_tree(self, boxes)
      if (self%filtered) then
         call self%candidates%compare_active(boxes, changes)
         call self%work%add(count_tests, int(self%candidates%filter%active%n, lp))
         call self%work%lap(phase_filter)
      else
         call self%candidates%tidy()
         call self%work%add(count_tests, int(self%candidates%n_pairs(), lp))
      end if
      call work_on_parts(self, boxes)
      call self%changes%join(changes)
      call replace_candidates(self, boxes, changes)
      call self%tree%settle()
      call self%work%lap(phase_search)
   end subroutine find

   !> Make one worker per thread and clear the workers.
   subroutine prepare_workers(self)
      type(quadtree_t), intent(inout) :: self
      integer :: w

      call self%changes%clear()
      if (allocated(self%worker)) then
         if (size(self%worker) /= self%changes%n_threads()) deallocate (self%worker)
      end if
      if (.not. allocated(self%worker)) allocate (self%worker(self%changes%n_threads()))
      do w = 1, size(self%worker)
         self%worker(w)%outside%n = 0_ip
         self%worker(w)%found%n = 0_ip
         self%worker(w)%separated%n = 0_ip
         self%worker(w)%visits = 0_lp
      end do
   end subroutine prepare_workers

   !> Insert all boxes into a new tree.
   subroutine build_tree(self, boxes)
      type(quadtree_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      integer(ip) :: i
      real(dp) :: reach, least, origin(2)

      call self%candidates%start(boxes%n)
      self%candidates%filtered = self%filtered
      self%candidates%isa = self%isa
      self%candidates%filter%isa = self%isa
      call measure_reaches(boxes, reach, least)
      if (self%filtered) call self%candidates%start_filter(boxes%n, 2.0_wp*real(reach, wp))
      allocate (self%padded%before(4, boxes%n), self%greatest_side(boxes%n))
      self%padded%before = spread([1.0_dp, 1.0_dp, -1.0_dp, -1.0_dp]*huge(1.0_dp), 2, boxes%n)
      self%padded%now = self%padded%before
      origin = 0.0_dp
      if (boxes%n > 0_ip) origin = real(boxes%bounds(1:2, 1), dp)
      self%tree%equal_leaves = self%equal_leaves
      if (self%one_axis) self%tree%ignored = shorter_axis(boxes)
      call self%tree%start(boxes%n, finest_cell(boxes), origin)
      do i = 1_ip, boxes%n
         self%greatest_side(i) = 2.0_wp*max(boxes%reach(i), half_side(boxes%bounds(:, i)))
         reach = 0.5_dp*real(self%greatest_side(i), dp)
         call self%tree%insert(i, reach, boxes%bounds)
      end do
   end subroutine build_tree

   !> Side of the finest cells [m]: at most the smallest reach, but not less than a limit set by `most_levels`
   pure real(dp) function finest_cell(boxes)
      type(boxes_t), intent(in) :: boxes
      real(dp) :: typical, least
      integer :: level

      call measure_reaches(boxes, typical, least)
      finest_cell = 1.0_dp
      if (.not. typical > 0.0_dp) return
      finest_cell = typical_share*typical
      do level = 1, most_levels
         if (finest_cell <= least) exit
         finest_cell = 0.5_dp*finest_cell
      end do
   end function finest_cell

   !> Geometric mean and smallest value of the positive reaches [m]; 0 and a large number if there are none
   pure subroutine measure_reaches(boxes, typical, least)
      type(boxes_t), intent(in) :: boxes
      real(dp), intent(out) :: typical, least
      real(dp) :: logarithms, reach
      integer(ip) :: i, n

      n = 0_ip
      logarithms = 0.0_dp
      least = huge(1.0_dp)
      do i = 1_ip, boxes%n
         reach = real(boxes%reach(i), dp)
         if (.not. (reach > 0.0_dp .and. reach < huge(1.0_dp))) cycle
         n = n + 1_ip
         logarithms = logarithms + logarithm(reach)
         least = min(least, reach)
      end do
      typical = 0.0_dp
      if (n > 0_ip) typical = exponential(logarithms/real(n, dp))
   end subroutine measure_reaches

   !> Axis along which the scene is shorter: 1 (x) or 2 (y)
   pure integer function shorter_axis(boxes)
      type(boxes_t), intent(in) :: boxes
      real(wp) :: extent(2)
      integer :: a

      extent = 0.0_wp
      if (boxes%n > 0_ip) then
         do a = 1, 2
            extent(a) = maxval(boxes%bounds(a + 2, 1:boxes%n)) - minval(boxes%bounds(a, 1:boxes%n))
         end do
      end if
      shorter_axis = merge(1, 2, extent(1) < extent(2))
   end function shorter_axis

   !> Half of the longer side of a box [m]
   pure real(wp) function half_side(box)
      real(wp), intent(in) :: box(4)

      half_side = 0.5_wp*max(box(3) - box(1), box(4) - box(2))
   end function half_side

   !> Find the boxes that left their leaf, repair the tree, compare all candidates, and search for new ones.
   subroutine work_on_parts(self, boxes)
      type(quadtree_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      integer(ip) :: low, high, spent
      integer :: w
      logical :: one_searches, is_new

      is_new = self%tree%n_changed > 0_ip
      !$omp parallel if (boxes%n > min_parallel_size) default(none) shared(self, boxes, is_new) &
      !$omp    private(w, low, high, spent, one_searches)
      !$omp do schedule(static, 1)
      do w = 1, size(self%worker)
         call part(boxes%n, size(self%worker), w, low, high)
         call find_outside(self%tree, low, high, boxes%bounds, self%greatest_side, self%worker(w)%outside)
      end do
      !$omp end do
      call plan_first_thread(self, is_new, spent, one_searches)
      !$omp do schedule(static, 1)
      do w = 1, size(self%worker)
         if (w == 1) then
            call move_boxes(self, boxes)
            call update_padded_cells(self)
            call self%work%lap(phase_structure)
            if (one_searches) then
               call search_changed(self, 1_ip, self%tree%n_changed, boxes, self%worker(1))
               call self%work%lap(phase_search)
            end if
         end if
         if (.not. self%filtered) then
            call part(self%candidates%n + spent, size(self%worker), w, low, high)
            low = max(low - spent, 1_ip)
            call self%candidates%compare(low, high - spent, boxes%bounds, boxes%body, self%changes%of(w))
         end if
      end do
      !$omp end do
      !$omp do schedule(static, 1)
      do w = 1, size(self%worker)
         if (w == 1) call self%work%lap(phase_filter)
         if (one_searches) cycle
         call part(self%tree%n_changed, size(self%worker), w, low, high)
         call search_changed(self, low, high, boxes, self%worker(w))
      end do
      !$omp end do
      !$omp end parallel
      do w = 1, size(self%worker)
         call self%work%add(count_left_leaf, int(self%worker(w)%outside%n, lp))
         call self%work%add(count_visits, self%worker(w)%visits)
      end do
      call self%work%add(count_leaf_changes, int(self%tree%n_changed, lp))
      call self%work%add(count_searches, int(self%tree%n_changed, lp))
      call self%work%lap(phase_search)
   end subroutine work_on_parts

   !> Decide what the first thread does while the others compare candidates.
   subroutine plan_first_thread(self, is_new, spent, one_searches)
      type(quadtree_t), intent(in) :: self
      !> Whether the tree was built in this step, so that all boxes are searched
      logical, intent(in) :: is_new
      !> Time that it spends before it compares candidates too, in comparisons of candidates
      integer(ip), intent(out) :: spent
      !> Whether it searches for all boxes whose leaf changed
      logical, intent(out) :: one_searches
      integer(ip) :: n_moved, most

      n_moved = sum(self%worker%outside%n)
      most = self%candidates%n/int(max(size(self%worker) - 1, 1), ip)
      one_searches = .not. (is_new .or. self%filtered) .and. n_moved <= most/(move_cost + search_cost)
      spent = min(n_moved, most/move_cost)*move_cost
      if (one_searches) spent = n_moved*(move_cost + search_cost)
   end subroutine plan_first_thread

   !> Move the boxes that left their leaf, and enlarge reaches that are too small.
   subroutine move_boxes(self, boxes)
      type(quadtree_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      integer(ip) :: k, i
      integer :: w

      do w = 1, size(self%worker)
         do k = 1_ip, self%worker(w)%outside%n
            i = self%worker(w)%outside%at(k)
            if (2.0_wp*half_side(boxes%bounds(:, i)) > self%greatest_side(i)) then
               self%greatest_side(i) = 2.0_wp*half_side(boxes%bounds(:, i))
               call self%tree%increase_reach(i, 0.5_dp*real(self%greatest_side(i), dp))
            end if
            call self%tree%move(i, boxes%bounds)
         end do
      end do
   end subroutine move_boxes

   !> List the boxes low..high whose centre is not in its leaf or whose side exceeds `greatest_side`.
   subroutine find_outside(tree, low, high, bounds, greatest_side, outside)
      type(tree_t), intent(in) :: tree
      integer(ip), intent(in) :: low, high
      real(wp), intent(in), contiguous :: bounds(:, :)
      real(wp), intent(in), contiguous :: greatest_side(:)
      type(index_list_t), intent(inout) :: outside
      real(dp) :: x, y
      integer(ip) :: i

      do i = low, high
         x = (real(bounds(1, i), dp) + real(bounds(3, i), dp))*tree%half_scale + tree%shift(1)
         y = (real(bounds(2, i), dp) + real(bounds(4, i), dp))*tree%half_scale + tree%shift(2)
         if (x >= tree%cell(1, i) .and. x < tree%cell(3, i) .and. &
             y >= tree%cell(2, i) .and. y < tree%cell(4, i) .and. &
             max(bounds(3, i) - bounds(1, i), bounds(4, i) - bounds(2, i)) <= greatest_side(i)) cycle
         call outside%push(i)
      end do
   end subroutine find_outside

   !> Compute the padded cells of the boxes whose leaf changed, and store the previous ones.
   subroutine update_padded_cells(self)
      type(quadtree_t), intent(inout) :: self
      integer(ip) :: k, i
      real(dp) :: reach

      do k = 1_ip, self%tree%n_changed
         i = self%tree%changed(k)
         reach = self%tree%reach(i)
         self%padded%before(:, i) = self%padded%now(:, i)
         self%padded%now(1:2, i) = self%tree%cell(1:2, i) - reach
         self%padded%now(3:4, i) = self%tree%cell(3:4, i) + reach
      end do
   end subroutine update_padded_cells

   !> Find the new candidates of boxes whose leaf changed, and those that are candidates no longer.
   subroutine search_changed(self, low, high, boxes, worker)
      type(quadtree_t), intent(in) :: self
      !> First and last box in the list of those whose leaf changed
      integer(ip), intent(in) :: low, high
      type(boxes_t), intent(in) :: boxes
      type(worker_t), intent(inout) :: worker
      integer(ip) :: k

      do k = low, high
         call search(self%tree, self%padded, boxes, self%tree%changed(k), worker%found, worker%visits)
         call self%candidates%list_separated(self%tree%changed(k), self%padded%now, worker%separated)
      end do
   end subroutine search_changed

   !> Replace the candidates of the boxes whose leaf changed.
   subroutine replace_candidates(self, boxes, changes)
      type(quadtree_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      type(pair_changes_t), intent(inout) :: changes
      integer(ip) :: k, i, j, number
      integer :: w
      logical :: overlap

      do k = 1_ip, self%tree%n_changed
         self%padded%before(:, self%tree%changed(k)) = self%padded%now(:, self%tree%changed(k))
      end do
      do w = 1, size(self%worker)
         do k = 1_ip, self%worker(w)%separated%n
            call self%candidates%drop(self%worker(w)%separated%at(k))
         end do
      end do
      do w = 1, size(self%worker)
         do k = 1_ip, self%worker(w)%found%n, 2_ip
            i = self%worker(w)%found%at(k)
            j = self%worker(w)%found%at(k + 1_ip)
            overlap = overlapping(boxes%bounds(:, i), boxes%bounds(:, j))
            call self%candidates%add(i, j, overlap, number)
            if (overlap) call changes%record(boxes%body(i), boxes%body(j), 1_ip)
         end do
      end do
   end subroutine replace_candidates

   !> Set the counters: candidates, nodes, levels, and memory [B].
   subroutine survey(self)
      class(quadtree_t), intent(inout) :: self

      if (.not. allocated(self%padded%now)) return
      self%work%value(count_candidates) = int(self%candidates%n_pairs(), lp)
      self%work%value(count_nodes) = int(self%tree%n_nodes, lp)
      self%work%value(count_depth) = int(self%tree%depth(), lp)
      self%work%value(count_bytes) = self%tree%bytes() + self%candidates%bytes() + self%candidates%filter%bytes() + &
         (int(storage_size(self%padded%now), lp)*2_lp*size(self%padded%now, kind=lp) + &
          int(storage_size(self%greatest_side), lp)*size(self%greatest_side, kind=lp))/8_lp
   end subroutine survey

end module polydem_quadtree
