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
!> The same source makes the minimal quadtree, the pruned quadtree, whose leaves all have the same size, and a binary
!> tree along the longer axis for nearly one-dimensional scenes. `polydem_filtered_quadtree` extends it.
module polydem_quadtree
   use polydem_boxes, only: boxes_t
   use polydem_filtered_candidates, only: filtered_candidates_t
   use polydem_finder, only: finder_t
   use polydem_finder_statistics, only: count_bytes, count_candidates, count_depth, count_leaf_changes, &
      count_left_leaf, count_nodes, count_searches, count_tests, count_visits, phase_filter, phase_search, &
      phase_structure
   use polydem_kinds, only: dp, ip, lp, wp, min_parallel_size
   use polydem_pair_changes, only: pair_changes_t
   use polydem_quadtree_measures, only: finest_cell, half_side, measure_reaches, shorter_axis
   use polydem_quadtree_nodes, only: tree_t
   use polydem_quadtree_search, only: find_outside, padded_cells_t, replacement_t, search_changed, worker_t
   use polydem_thread_changes, only: part, thread_changes_t
   implicit none
   private
   public :: quadtree_t

   !> Time in which one box is moved in the tree, and in which the boxes whose leaf changes with it are searched, in
   !> comparisons of candidates (measured)
   integer(ip), parameter :: move_cost = 500_ip, search_cost = 1600_ip

   !> Finder that stores a tree
   type, extends(finder_t) :: quadtree_t
      !> Whether all leaves are on the finest level (pruned tree, Vemuri et al. 1998); set before the first step
      logical :: equal_leaves = .false.
      !> Whether the tree uses only the longer axis of the scene (binary tree); set before the first step
      logical :: one_axis = .false.
      ! The following are not private because `polydem_filtered_quadtree` needs them.
      !> Tree of the boxes
      type(tree_t) :: tree
      !> Candidates, with a filter in an extension of this type
      type(filtered_candidates_t) :: candidates
      !> Padded cells of the boxes
      type(padded_cells_t) :: padded
      !> Largest side of each box for which its reach is sufficient, (box) [m]
      real(wp), allocatable :: greatest_side(:)
      !> Candidates to add and to remove according to the last search
      type(replacement_t) :: replacement
      !> Results of the threads, (thread)
      type(worker_t), allocatable :: worker(:)
      !> Changes that each thread recorded
      type(thread_changes_t) :: changes
   contains
      procedure :: find
      procedure :: survey
      procedure :: prepare
      procedure :: move_boxes
      procedure :: settle
   end type quadtree_t

contains

   !> Repair the tree, compare the candidates, and search again for boxes whose leaf changed.
   subroutine find(self, boxes, changes)
      class(quadtree_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      type(pair_changes_t), intent(inout) :: changes

      call self%prepare(boxes, 0.0_wp)
      call self%candidates%tidy()
      call self%work%add(count_tests, int(self%candidates%n_pairs(), lp))
      call work_on_parts(self, boxes)
      call self%changes%join(changes)
      call self%settle()
      call self%replacement%apply(self%padded, self%candidates)
      call self%work%lap(phase_search)
   end subroutine find

   !> Begin a step: one worker without results per thread. In the first step make the tree.
   subroutine prepare(self, boxes, allowance)
      class(quadtree_t), intent(inout) :: self
      !> Boxes of this step
      type(boxes_t), intent(in) :: boxes
      !> Enlargement of the largest sides for which reaches are sufficient, in units of the typical side
      real(wp), intent(in) :: allowance
      integer :: w

      call self%changes%clear()
      if (allocated(self%worker)) then
         if (size(self%worker) /= self%changes%n_threads()) deallocate (self%worker)
      end if
      if (.not. allocated(self%worker)) allocate (self%worker(self%changes%n_threads()))
      do w = 1, size(self%worker)
         call self%worker(w)%clear()
      end do
      if (.not. allocated(self%padded%now)) call build_tree(self, boxes, allowance)
   end subroutine prepare

   !> Insert all boxes into a new tree.
   subroutine build_tree(self, boxes, allowance)
      class(quadtree_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      real(wp), intent(in) :: allowance
      integer(ip) :: i
      real(dp) :: reach, typical, least, origin(2)

      call self%candidates%start(boxes%n)
      self%candidates%isa = self%isa
      call measure_reaches(boxes, typical, least)
      allocate (self%greatest_side(boxes%n))
      call self%padded%start(boxes%n)
      origin = 0.0_dp
      if (boxes%n > 0_ip) origin = real(boxes%bounds(1:2, 1), dp)
      self%tree%equal_leaves = self%equal_leaves
      if (self%one_axis) self%tree%ignored = shorter_axis(boxes)
      call self%tree%start(boxes%n, finest_cell(boxes), origin)
      do i = 1_ip, boxes%n
         self%greatest_side(i) = 2.0_wp*(max(boxes%reach(i), half_side(boxes%bounds(:, i))) + &
                                         allowance*real(typical, wp))
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
            call self%move_boxes(boxes)
            call self%padded%update(self%tree)
            call self%work%lap(phase_structure)
            if (one_searches) then
               call search_changed(self%tree, self%padded, 1_ip, self%tree%n_changed, boxes, self%worker(1), &
                                   self%changes%of(1))
               call self%work%lap(phase_search)
            end if
         end if
         call part(self%candidates%n + spent, size(self%worker), w, low, high)
         low = max(low - spent, 1_ip)
         call self%candidates%compare(low, high - spent, boxes%bounds, boxes%piece, self%changes%of(w))
      end do
      !$omp end do
      !$omp do schedule(static, 1)
      do w = 1, size(self%worker)
         if (w == 1) call self%work%lap(phase_filter)
         if (one_searches) cycle
         call part(self%tree%n_changed, size(self%worker), w, low, high)
         call search_changed(self%tree, self%padded, low, high, boxes, self%worker(w), self%changes%of(w))
      end do
      !$omp end do
      !$omp end parallel
      call self%work%lap(phase_search)
   end subroutine work_on_parts

   !> End a step after the search: count the work of all workers, and collect their results.
   subroutine settle(self)
      class(quadtree_t), intent(inout) :: self
      integer :: w

      do w = 1, size(self%worker)
         call self%work%add(count_left_leaf, int(self%worker(w)%outside%n, lp))
         call self%work%add(count_searches, self%worker(w)%searches)
         call self%work%add(count_visits, self%worker(w)%visits)
      end do
      call self%work%add(count_leaf_changes, int(self%tree%n_changed, lp))
      call self%replacement%collect(self%worker)
      call self%padded%settle(self%tree)
      call self%tree%settle()
   end subroutine settle

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
      class(quadtree_t), intent(inout) :: self
      !> Boxes of this step
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
      self%work%value(count_bytes) = self%tree%bytes() + self%candidates%bytes() + &
         (int(storage_size(self%padded%now), lp)*2_lp*size(self%padded%now, kind=lp) + &
          int(storage_size(self%greatest_side), lp)*size(self%greatest_side, kind=lp))/8_lp
   end subroutine survey

end module polydem_quadtree
