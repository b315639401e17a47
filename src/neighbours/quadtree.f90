!> Incremental search on the minimal quadtree.
!>
!> Every box has a *padded cell*: the cell of its leaf, enlarged by the reach of the box. The reach is the largest half
!> side that the box can have at any angle. Two boxes are *candidates* if their padded cells overlap. The padded cells
!> do not change while the centres stay in their leaves, and boxes that are not candidates cannot overlap at any angle.
!> A step therefore
!>
!>  1. moves the boxes whose centre left its leaf and repairs the tree (`polydem_quadtree_nodes`),
!>  2. compares the boxes of all candidates once and records the pairs that begin or cease to overlap,
!>  3. searches the tree again for each box whose leaf changed, or whose leaf was merged because of a neighbour, so that
!>     its padded cell has grown, and for no other box. The padded cells before the step show whether a pair was a
!>     candidate before. Only pairs that have become candidates are added, and pairs that have ceased to be candidates
!>     are removed.
!>
!> Krengel et al. (2026) walk across cell edges and corners within a window. Here the search climbs to the lowest
!> ancestor that contains the padded cell, and descends into every cell that is near enough. So it finds all boxes.
!>
!> Each thread works on a contiguous part of a list. While the first thread repairs the tree, the others begin to
!> compare candidates. If few boxes moved, the first thread also searches meanwhile, since the nodes that it has changed
!> are in its cache. The results are joined in the order of the list and do not depend on the number of threads.
!>
!> With a filter (`polydem_line_filter`) only candidates whose state can change are compared, and only boxes that can
!> leave their leaf are tested (`polydem_leaf_watch`).
!>
!> The same source makes the minimal quadtree, the pruned quadtree, whose leaves all have the same size, and a binary
!> tree along the longer axis for nearly one-dimensional scenes.
module polydem_quadtree
   use polydem_boxes, only: boxes_t
   use polydem_filtered_candidates, only: filtered_candidates_t
   use polydem_finder, only: finder_t
   use polydem_finder_statistics, only: count_bytes, count_candidates, count_depth, count_leaf_changes, &
      count_left_leaf, count_nodes, count_passes, count_searches, count_tests, count_visits, phase_filter, &
      phase_search, phase_structure
   use polydem_kinds, only: dp, ip, lp, wp, min_parallel_size
   use polydem_leaf_watch, only: leaf_watch_t
   use polydem_pair_changes, only: pair_changes_t
   use polydem_quadtree_measures, only: finest_cell, half_side, measure_reaches, shorter_axis
   use polydem_quadtree_nodes, only: tree_t
   use polydem_quadtree_search, only: find_outside, padded_cells_t, replace_candidates, &
      search_changed, worker_t
   use polydem_thread_changes, only: part, thread_changes_t
   implicit none
   private
   public :: quadtree_t

   !> Time in which one box is moved in the tree, and in which the boxes whose leaf changes with it are searched, in
   !> comparisons of candidates (measured)
   integer(ip), parameter :: move_cost = 500_ip, search_cost = 1600_ip

   !> Logarithm to base 2 of the number of candidates per box whose leaf changed, with a filter, below which all threads
   !> search: the search would take more time than review and comparisons
   integer, parameter :: few_changes = 11
   !> Enlargement of the largest sides of boxes under a filter, in units of the typical side: boxes on their lines then
   !> surely do not exceed them
   real(wp), parameter :: side_allowance = 2.0_wp**(-5)

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
      !> Boxes that can leave their leaf, with a filter
      type(leaf_watch_t), private :: watch
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
         call filter_and_search(self, boxes)
         call self%work%add(count_tests, int(self%candidates%filter%active%n, lp))
         call self%candidates%filter%changes%join(changes)
      else
         call self%candidates%tidy()
         call self%work%add(count_tests, int(self%candidates%n_pairs(), lp))
         call work_on_parts(self, boxes)
         call self%changes%join(changes)
      end if
      call count_work(self)
      call replace_candidates(self%worker, boxes, self%candidates, changes)
      call self%padded%settle(self%tree)
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
         call self%worker(w)%clear()
      end do
   end subroutine prepare_workers

   !> Insert all boxes into a new tree.
   subroutine build_tree(self, boxes)
      type(quadtree_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      integer(ip) :: i
      real(dp) :: reach, least, origin(2)
      real(wp) :: allowance

      call self%candidates%start(boxes%n)
      self%candidates%filtered = self%filtered
      self%candidates%isa = self%isa
      self%candidates%filter%isa = self%isa
      call measure_reaches(boxes, reach, least)
      allowance = 0.0_wp
      if (self%filtered) then
         call self%candidates%start_filter(boxes%n, 2.0_wp*real(reach, wp))
         allowance = side_allowance*2.0_wp*real(reach, wp)
      end if
      allocate (self%greatest_side(boxes%n))
      call self%padded%start(boxes%n)
      origin = 0.0_dp
      if (boxes%n > 0_ip) origin = real(boxes%bounds(1:2, 1), dp)
      self%tree%equal_leaves = self%equal_leaves
      if (self%one_axis) self%tree%ignored = shorter_axis(boxes)
      call self%tree%start(boxes%n, finest_cell(boxes), origin)
      do i = 1_ip, boxes%n
         self%greatest_side(i) = 2.0_wp*max(boxes%reach(i), half_side(boxes%bounds(:, i))) + allowance
         reach = 0.5_dp*real(self%greatest_side(i), dp)
         call self%tree%insert(i, reach, boxes%bounds)
      end do
   end subroutine build_tree

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
            call self%padded%update(self%tree)
            call self%work%lap(phase_structure)
            if (one_searches) then
               call search_changed(self%tree, self%padded, self%candidates, 1_ip, self%tree%n_changed, boxes, &
                                   self%worker(1))
               call self%work%lap(phase_search)
            end if
         end if
         call part(self%candidates%n + spent, size(self%worker), w, low, high)
         low = max(low - spent, 1_ip)
         call self%candidates%compare(low, high - spent, boxes%bounds, boxes%body, self%changes%of(w))
      end do
      !$omp end do
      !$omp do schedule(static, 1)
      do w = 1, size(self%worker)
         if (w == 1) call self%work%lap(phase_filter)
         if (one_searches) cycle
         call part(self%tree%n_changed, size(self%worker), w, low, high)
         call search_changed(self%tree, self%padded, self%candidates, low, high, boxes, self%worker(w))
      end do
      !$omp end do
      !$omp end parallel
      call self%work%lap(phase_search)
   end subroutine work_on_parts

   !> Count the work of all workers in this step.
   subroutine count_work(self)
      type(quadtree_t), intent(inout) :: self
      integer :: w

      do w = 1, size(self%worker)
         call self%work%add(count_left_leaf, int(self%worker(w)%outside%n, lp))
         call self%work%add(count_searches, self%worker(w)%searches)
         call self%work%add(count_visits, self%worker(w)%visits)
      end do
      call self%work%add(count_leaf_changes, int(self%tree%n_changed, lp))
   end subroutine count_work

   !> The work of `work_on_parts` with a filter. Of two threads, the first one repairs the tree and searches, while the
   !> other one reviews the candidates of the boxes that left their lines and compares the active ones. So each finds
   !> most of what it reads in its own cache. More threads compare together before the first one repairs the tree. If
   !> many leaves changed, or there are more than two threads, all search afterwards.
   subroutine filter_and_search(self, boxes)
      type(quadtree_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      integer(ip) :: low, high
      integer :: n_threads, w
      logical :: compares, one_searches

      call follow_boxes(self, boxes, compares)
      if (.not. compares) call self%work%add(count_passes, 1_lp)
      n_threads = size(self%worker)
      if (compares .and. n_threads /= 2) then
         call self%candidates%review_and_compare(boxes, alone=.false.)
         compares = .false.
      end if
      call self%work%lap(phase_filter)
      one_searches = .false.
      !$omp parallel if (boxes%n > min_parallel_size) default(none) private(w, low, high) &
      !$omp    shared(self, boxes, compares, n_threads, one_searches)
      !$omp do schedule(static, 1)
      do w = 1, n_threads
         if (w == 1) call repair_and_search(self, boxes, one_searches)
         if (w == n_threads .and. compares) call self%candidates%review_and_compare(boxes, alone=.true.)
      end do
      !$omp end do
      !$omp do schedule(static, 1)
      do w = 1, n_threads
         if (one_searches) cycle
         call part(self%tree%n_changed, n_threads, w, low, high)
         call search_changed(self%tree, self%padded, self%candidates, low, high, boxes, self%worker(w))
      end do
      !$omp end do
      !$omp end parallel
      call self%work%lap(phase_search)
   end subroutine filter_and_search

   !> Find the boxes that left their lines, or begin an interval, and find the boxes that left their leaf.
   subroutine follow_boxes(self, boxes, compares)
      type(quadtree_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      !> Whether the active candidates are still to be compared: no interval began
      logical, intent(out) :: compares
      logical :: all_judged
      integer(ip) :: k

      call self%candidates%filter%begin_step()
      call self%watch%set_parts(size(self%worker), boxes%n, all_judged)
      compares = .not. self%candidates%is_due()
      if (.not. compares) call self%candidates%begin_interval(boxes)
      call test_boxes(self, boxes, follows=compares, judges=all_judged .or. .not. compares)
      if (.not. compares) return
      call self%candidates%gather_left()
      compares = .not. self%candidates%is_due()
      if (.not. compares) then
         call self%candidates%begin_interval(boxes)
         call test_boxes(self, boxes, follows=.false., judges=.true.)
         return
      end if
      ! These were on their lines when they were judged, and are off now.
      associate (strays => self%candidates%filter%strays)
         do k = 1_ip, strays%n
            call self%watch%judge(strays%at(k), self%candidates%filter, self%tree, self%greatest_side)
         end do
      end associate
   end subroutine follow_boxes

   !> Find the boxes that left their leaf. Each thread works on the boxes of which it has just tested the lines.
   subroutine test_boxes(self, boxes, follows, judges)
      type(quadtree_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      !> Whether to find the boxes that left their lines before, and whether to judge all boxes, not only these
      logical, intent(in) :: follows, judges
      integer(ip) :: k
      integer :: w

      !$omp parallel do if (boxes%n > min_parallel_size) schedule(static) default(none) &
      !$omp    shared(self, boxes, follows, judges) private(w, k)
      do w = 1, size(self%worker)
         associate (filter => self%candidates%filter, outside => self%worker(w)%outside)
            if (follows) call self%candidates%follow_part(w, boxes)
            if (judges) then
               call self%watch%judge_part(w, filter, self%tree, self%greatest_side)
            else
               outside%n = 0_ip
               call filter%append_left(w, outside)
               do k = 1_ip, outside%n
                  call self%watch%judge(outside%at(k), filter, self%tree, self%greatest_side)
               end do
            end if
            call self%watch%find_outside(w, self%tree, boxes%bounds, outside)
         end associate
      end do
      !$omp end parallel do
   end subroutine test_boxes

   !> Move the boxes that left their leaf, judge those with a new leaf, and search for them if they are few.
   subroutine repair_and_search(self, boxes, one_searches)
      type(quadtree_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      !> Whether this thread searches
      logical, intent(out) :: one_searches
      integer(ip) :: k
      integer :: w

      do w = 1, size(self%worker)
         call self%worker(w)%outside%sort()
      end do
      call move_boxes(self, boxes)
      call self%padded%update(self%tree)
      do k = 1_ip, self%tree%n_changed
         call self%watch%judge(self%tree%changed(k), self%candidates%filter, self%tree, self%greatest_side)
      end do
      call self%work%lap(phase_structure)
      one_searches = size(self%worker) <= 2 .and. self%tree%n_changed <= shiftr(self%candidates%n, few_changes)
      if (one_searches) call search_changed(self%tree, self%padded, self%candidates, 1_ip, self%tree%n_changed, &
                                            boxes, self%worker(1))
   end subroutine repair_and_search

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
      one_searches = .not. is_new .and. n_moved <= most/(move_cost + search_cost)
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

   !> Set the counters: candidates, nodes, levels, and memory [B].
   subroutine survey(self)
      class(quadtree_t), intent(inout) :: self

      if (.not. allocated(self%padded%now)) return
      self%work%value(count_candidates) = int(self%candidates%n_pairs(), lp)
      self%work%value(count_nodes) = int(self%tree%n_nodes, lp)
      self%work%value(count_depth) = int(self%tree%depth(), lp)
      self%work%value(count_bytes) = self%tree%bytes() + self%candidates%bytes() + self%candidates%filter%bytes() + &
         self%watch%bytes() + (int(storage_size(self%padded%now), lp)*2_lp*size(self%padded%now, kind=lp) + &
          int(storage_size(self%greatest_side), lp)*size(self%greatest_side, kind=lp))/8_lp
   end subroutine survey

end module polydem_quadtree
