!> Incremental search on the minimal quadtree.
!>
!> Every box has a *grown cell*: the cell of its leaf, enlarged by its reach, the greatest half side that it
!> can have at any angle. Boxes whose grown cells overlap are *candidates*. While the centres stay in
!> their leaves the grown cells stay, and boxes that are no candidates cannot overlap, however they turn.
!> A step therefore
!>
!>  1. moves the boxes whose centre left its leaf and repairs the tree (`polydem_quadtree_nodes`),
!>  2. runs once over the candidates, compares their boxes and records where the answer changed,
!>  3. searches the tree again for each box whose leaf changed, or whose leaf was split or merged by a
!>     neighbour, and for no other box. Whether a pair was a candidate before is known from the grown cells
!>     before the step, so only pairs that are candidates anew are added, and those that parted dropped.
!>
!> Krengel et al. (2026) walk across cell edges and corners within a window; here the search climbs to the
!> lowest ancestor around the grown cell and descends from there into every cell close enough, so no box is
!> missed because of its shape or of what lies between.
!>
!> All but the repair runs on threads, each on a contiguous part of a list. The results are joined in the
!> order of the list and so do not depend on the number of threads.
!>
!> The same source makes four finders: on the minimal quadtree compiled with and without inlining, on the pruned
!> quadtree whose leaves are all equal, and on a binary tree along the longer axis for scenes that are
!> nearly one-dimensional. So their differences are those of the trees, or of the compiler, alone.
module polydem_quadtree
   use omp_lib, only: omp_get_max_threads
   use polydem_boxes, only: boxes_t
   use polydem_candidates, only: candidates_t, overlapping, places_t
   use polydem_finder, only: finder_t
   use polydem_kinds, only: dp, ip, lp, wp, worth_threads
   use polydem_pair_changes, only: pair_changes_t
   use polydem_quadtree_nodes, only: tree_t
   use polydem_quadtree_search, only: grown_cells_t, search
   use polydem_work, only: count_bytes, count_candidates, count_depth, count_leaf_changes, count_leavers, &
      count_nodes, count_searches, count_tests, count_visits, phase_filter, phase_search, phase_structure
   implicit none
   private
   public :: quadtree_t

   !> Side of some level's cells in units of the typical reach: the largest that hold one centre each in a
   !> packing. Other values, between powers of two, give up to 1.6 times as many candidates (measured).
   real(dp), parameter :: typical_share = 1.2_dp
   !> Boxes to search from which on threads share the work: a search takes about two microseconds
   integer(ip), parameter :: worth_searching = 16_ip
   !> Most levels below that one
   integer, parameter :: most_levels = 12

   !> What one thread finds in its part of the lists
   type :: worker_t
      !> Boxes whose centre left its leaf or that outgrew their reach
      type(places_t) :: leavers
      !> Boxes of new candidates, two entries each
      type(places_t) :: found
      !> Nodes looked at in searches
      integer(lp) :: visits = 0_lp
      !> Changes
      type(pair_changes_t) :: changes
   end type worker_t

   !> Finder that keeps a tree
   type, extends(finder_t) :: quadtree_t
      !> Whether all leaves are on the finest level (pruned tree, Vemuri et al. 1998); set before the first step
      logical :: equal_leaves = .false.
      !> Whether only the longer axis of the scene is looked at (binary tree); set before the first step
      logical :: one_axis = .false.
      type(tree_t), private :: tree
      type(candidates_t), private :: candidates
      !> Grown cells of the boxes
      type(grown_cells_t), private :: grown
      !> Greatest side that a box may have before its reach must be enlarged [m]
      real(wp), allocatable, private :: greatest_side(:)
      type(worker_t), allocatable, private :: worker(:)
   contains
      procedure :: find
      procedure :: survey
   end type quadtree_t

contains

   !> Repair the tree, compare the candidates, search again where leaves changed.
   subroutine find(self, boxes, changes)
      class(quadtree_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      type(pair_changes_t), intent(inout) :: changes

      call prepare_workers(self)
      if (allocated(self%grown%now)) then
         call update_tree(self, boxes)
      else
         call build_tree(self, boxes)
      end if
      call update_grown_cells(self)
      call self%work%lap(phase_structure)
      call compare_candidates(self, boxes, changes)
      call self%work%lap(phase_filter)
      if (self%tree%n_changed > 0_ip) then
         call search_changed(self, boxes)
         call replace_candidates(self, boxes, changes)
      end if
      call self%work%add(count_leaf_changes, int(self%tree%n_changed, lp))
      call self%tree%settle()
      call self%work%lap(phase_search)
   end subroutine find

   subroutine prepare_workers(self)
      type(quadtree_t), intent(inout) :: self
      integer :: w

      if (allocated(self%worker)) then
         if (size(self%worker) /= omp_get_max_threads()) deallocate (self%worker)
      end if
      if (.not. allocated(self%worker)) allocate (self%worker(omp_get_max_threads()))
      do w = 1, size(self%worker)
         self%worker(w)%leavers%n = 0_ip
         self%worker(w)%found%n = 0_ip
         self%worker(w)%visits = 0_lp
         call self%worker(w)%changes%clear()
      end do
   end subroutine prepare_workers

   !> First and last of the w-th of m equal parts of 1..n
   pure subroutine part(n, m, w, low, high)
      integer(ip), intent(in) :: n
      integer, intent(in) :: m, w
      integer(ip), intent(out) :: low, high

      low = int((int(n, lp)*int(w - 1, lp))/int(m, lp), ip) + 1_ip
      high = int((int(n, lp)*int(w, lp))/int(m, lp), ip)
   end subroutine part

   !> Put all boxes into a new tree.
   subroutine build_tree(self, boxes)
      type(quadtree_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      integer(ip) :: i
      real(dp) :: reach, origin(2)

      call self%candidates%start(boxes%n)
      allocate (self%grown%before(4, boxes%n), self%greatest_side(boxes%n))
      self%grown%before = spread([1.0_dp, 1.0_dp, -1.0_dp, -1.0_dp]*huge(1.0_dp), 2, boxes%n)
      self%grown%now = self%grown%before
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

   !> Side of the finest cells: no larger than the least reach, if that is not absurdly small [m]
   pure real(dp) function finest_cell(boxes)
      type(boxes_t), intent(in) :: boxes
      real(dp) :: logarithms, least, reach
      integer(ip) :: i, n
      integer :: level

      n = 0_ip
      logarithms = 0.0_dp
      least = huge(1.0_dp)
      do i = 1_ip, boxes%n
         reach = real(boxes%reach(i), dp)
         if (.not. (reach > 0.0_dp .and. reach < huge(1.0_dp))) cycle
         n = n + 1_ip
         logarithms = logarithms + log(reach)
         least = min(least, reach)
      end do
      finest_cell = 1.0_dp
      if (n == 0_ip) return
      finest_cell = typical_share*exp(logarithms/real(n, dp))
      do level = 1, most_levels
         if (finest_cell <= least) exit
         finest_cell = 0.5_dp*finest_cell
      end do
   end function finest_cell

   !> The axis along which the boxes extend less far
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

   pure real(wp) function half_side(box)
      real(wp), intent(in) :: box(4)

      half_side = 0.5_wp*max(box(3) - box(1), box(4) - box(2))
   end function half_side

   !> Move the boxes that left their leaves.
   subroutine update_tree(self, boxes)
      type(quadtree_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      integer(ip) :: k, i, low, high
      integer :: w

      !$omp parallel do if (boxes%n > worth_threads) schedule(static, 1) default(none) &
      !$omp    shared(self, boxes) private(w, low, high)
      do w = 1, size(self%worker)
         call part(boxes%n, size(self%worker), w, low, high)
         call find_leavers(self%tree, low, high, boxes%bounds, self%greatest_side, self%worker(w)%leavers)
      end do
      !$omp end parallel do
      do w = 1, size(self%worker)
         do k = 1_ip, self%worker(w)%leavers%n
            i = self%worker(w)%leavers%at(k)
            if (2.0_wp*half_side(boxes%bounds(:, i)) > self%greatest_side(i)) then
               self%greatest_side(i) = 2.0_wp*half_side(boxes%bounds(:, i))
               call self%tree%widen(i, 0.5_dp*real(self%greatest_side(i), dp))
            end if
            call self%tree%move(i, boxes%bounds)
         end do
         call self%work%add(count_leavers, int(self%worker(w)%leavers%n, lp))
      end do
   end subroutine update_tree

   !> List the boxes of a part whose centre is not in its leaf, or that are larger than was promised.
   subroutine find_leavers(tree, low, high, bounds, greatest_side, leavers)
      type(tree_t), intent(in) :: tree
      integer(ip), intent(in) :: low, high
      real(wp), intent(in), contiguous :: bounds(:, :)
      real(wp), intent(in), contiguous :: greatest_side(:)
      type(places_t), intent(inout) :: leavers
      real(dp) :: x, y
      integer(ip) :: i

      do i = low, high
         x = (real(bounds(1, i), dp) + real(bounds(3, i), dp))*tree%half_scale + tree%shift(1)
         y = (real(bounds(2, i), dp) + real(bounds(4, i), dp))*tree%half_scale + tree%shift(2)
         if (x >= tree%cell(1, i) .and. x < tree%cell(3, i) .and. &
             y >= tree%cell(2, i) .and. y < tree%cell(4, i) .and. &
             max(bounds(3, i) - bounds(1, i), bounds(4, i) - bounds(2, i)) <= greatest_side(i)) cycle
         call leavers%push(i)
      end do
   end subroutine find_leavers

   !> Grow the cells of the boxes whose leaf changed, keeping what they were before.
   subroutine update_grown_cells(self)
      type(quadtree_t), intent(inout) :: self
      integer(ip) :: k, i
      real(dp) :: reach

      do k = 1_ip, self%tree%n_changed
         i = self%tree%changed(k)
         reach = self%tree%reach(i)
         self%grown%before(:, i) = self%grown%now(:, i)
         self%grown%now(1:2, i) = self%tree%cell(1:2, i) - reach
         self%grown%now(3:4, i) = self%tree%cell(3:4, i) + reach
      end do
   end subroutine update_grown_cells

   !> Compare the boxes of all candidates.
   subroutine compare_candidates(self, boxes, changes)
      type(quadtree_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      type(pair_changes_t), intent(inout) :: changes
      integer(ip) :: low, high
      integer :: w

      !$omp parallel do if (self%candidates%n > worth_threads) schedule(static, 1) default(none) &
      !$omp    shared(self, boxes) private(w, low, high)
      do w = 1, size(self%worker)
         call part(self%candidates%n, size(self%worker), w, low, high)
         call self%candidates%compare(low, high, boxes%bounds, boxes%body, self%worker(w)%changes)
      end do
      !$omp end parallel do
      do w = 1, size(self%worker)
         call changes%append(self%worker(w)%changes)
      end do
      call self%work%add(count_tests, int(self%candidates%n, lp))
   end subroutine compare_candidates

   !> Find the new candidates of all boxes whose leaf changed.
   subroutine search_changed(self, boxes)
      type(quadtree_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      integer(ip) :: k, low, high
      integer :: w

      !$omp parallel do if (self%tree%n_changed > worth_searching) schedule(static, 1) default(none) &
      !$omp    shared(self, boxes) private(w, k, low, high)
      do w = 1, size(self%worker)
         call part(self%tree%n_changed, size(self%worker), w, low, high)
         do k = low, high
            call search(self%tree, self%grown, boxes, self%tree%changed(k), self%worker(w)%found, &
                        self%worker(w)%visits)
         end do
      end do
      !$omp end parallel do
      do k = 1_ip, self%tree%n_changed
         self%grown%before(:, self%tree%changed(k)) = self%grown%now(:, self%tree%changed(k))
      end do
      call self%work%add(count_searches, int(self%tree%n_changed, lp))
      do w = 1, size(self%worker)
         call self%work%add(count_visits, self%worker(w)%visits)
      end do
   end subroutine search_changed

   !> Drop the candidates that parted and add those that the threads found, in the order of their parts.
   subroutine replace_candidates(self, boxes, changes)
      type(quadtree_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      type(pair_changes_t), intent(inout) :: changes
      integer(ip) :: k, i, j, dropped
      integer :: w
      logical :: overlap

      do k = 1_ip, self%tree%n_changed
         call self%candidates%drop_parted(self%tree%changed(k), self%grown%now, dropped)
      end do
      do w = 1, size(self%worker)
         do k = 1_ip, self%worker(w)%found%n, 2_ip
            i = self%worker(w)%found%at(k)
            j = self%worker(w)%found%at(k + 1_ip)
            overlap = overlapping(boxes%bounds(:, i), boxes%bounds(:, j))
            call self%candidates%add(i, j, overlap)
            if (overlap) call changes%record(boxes%body(i), boxes%body(j), 1_ip)
         end do
      end do
   end subroutine replace_candidates

   !> Candidates, nodes, levels and memory.
   subroutine survey(self)
      class(quadtree_t), intent(inout) :: self

      if (.not. allocated(self%grown%now)) return
      self%work%value(count_candidates) = int(self%candidates%n, lp)
      self%work%value(count_nodes) = int(self%tree%n_nodes, lp)
      self%work%value(count_depth) = int(self%tree%depth(), lp)
      self%work%value(count_bytes) = self%tree%bytes() + self%candidates%bytes() + &
         (int(storage_size(self%grown%now), lp)*2_lp*size(self%grown%now, kind=lp) + &
          int(storage_size(self%greatest_side), lp)*size(self%greatest_side, kind=lp))/8_lp
   end subroutine survey

end module polydem_quadtree
