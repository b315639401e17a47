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
module polydem_quadtree
   use omp_lib, only: omp_get_max_threads
   use polydem_boxes, only: boxes_t
   use polydem_candidates, only: candidates_t, meet, overlapping, places_t
   use polydem_counters, only: counters_t
   use polydem_finder, only: finder_t
   use polydem_kinds, only: bp, dp, ip, lp, wp, worth_threads
   use polydem_pair_changes, only: pair_changes_t
   use polydem_quadtree_nodes, only: tree_t
   implicit none
   private
   public :: quadtree_t

   !> Side of some level's cells in units of the typical reach: the largest that hold one centre each in a
   !> packing. Other values, between powers of two, give up to 1.6 times as many candidates (measured).
   real(dp), parameter :: typical_share = 1.2_dp
   !> Most levels below that one
   integer, parameter :: most_levels = 12
   !> Cells that can wait to be searched: three per level and one
   integer, parameter :: stack_size = 96

   !> What one thread finds in its part of the lists
   type :: worker_t
      !> Boxes whose centre left its leaf or that outgrew their reach
      type(places_t) :: leavers
      !> Boxes of new candidates, two entries each
      type(places_t) :: found
      !> Changes
      type(pair_changes_t) :: changes
   end type worker_t

   !> Finder that keeps a minimal quadtree
   type, extends(finder_t) :: quadtree_t
      private
      type(tree_t) :: tree
      type(candidates_t) :: candidates
      !> Grown cell of each box, (4, box) [finest cells]
      real(dp), allocatable :: grown(:, :)
      !> The same before the step
      real(dp), allocatable :: grown_before(:, :)
      !> Greatest side that a box may have before its reach must be enlarged [m]
      real(wp), allocatable :: greatest_side(:)
      type(worker_t), allocatable :: worker(:)
      integer(lp) :: steps = 0_lp, leavers = 0_lp, changed = 0_lp, searched = 0_lp
      integer(lp) :: dropped = 0_lp, found = 0_lp
   contains
      procedure :: find
      procedure :: report
   end type quadtree_t

contains

   !> Repair the tree, compare the candidates, search again where leaves changed.
   subroutine find(self, boxes, changes)
      class(quadtree_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      type(pair_changes_t), intent(inout) :: changes

      call prepare_workers(self)
      if (allocated(self%grown)) then
         call update_tree(self, boxes)
      else
         call build_tree(self, boxes)
      end if
      call update_grown_cells(self)
      call compare_candidates(self, boxes, changes)
      if (self%tree%n_changed > 0_ip) then
         call search_changed(self, boxes)
         call replace_candidates(self, boxes, changes)
      end if
      self%steps = self%steps + 1_lp
      self%changed = self%changed + int(self%tree%n_changed, lp)
      call self%tree%settle()
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
      allocate (self%grown(4, boxes%n), self%grown_before(4, boxes%n), self%greatest_side(boxes%n))
      self%grown = spread([1.0_dp, 1.0_dp, -1.0_dp, -1.0_dp]*huge(1.0_dp), 2, boxes%n)
      self%grown_before = self%grown
      origin = 0.0_dp
      if (boxes%n > 0_ip) origin = real(boxes%bounds(1:2, 1), dp)
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
         self%leavers = self%leavers + int(self%worker(w)%leavers%n, lp)
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
         self%grown_before(:, i) = self%grown(:, i)
         self%grown(1:2, i) = self%tree%cell(1:2, i) - reach
         self%grown(3:4, i) = self%tree%cell(3:4, i) + reach
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
   end subroutine compare_candidates

   !> Find the new candidates of all boxes whose leaf changed.
   subroutine search_changed(self, boxes)
      type(quadtree_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      integer(ip) :: k, low, high
      integer :: w

      !$omp parallel do if (self%tree%n_changed > worth_threads) schedule(static, 1) default(none) &
      !$omp    shared(self, boxes) private(w, k, low, high)
      do w = 1, size(self%worker)
         call part(self%tree%n_changed, size(self%worker), w, low, high)
         do k = low, high
            call search(self, boxes, self%tree%changed(k), self%worker(w)%found)
         end do
      end do
      !$omp end parallel do
      do k = 1_ip, self%tree%n_changed
         self%grown_before(:, self%tree%changed(k)) = self%grown(:, self%tree%changed(k))
      end do
      self%searched = self%searched + int(self%tree%n_changed, lp)
   end subroutine search_changed

   !> Find the new candidates of one box.
   subroutine search(self, boxes, i, found)
      type(quadtree_t), intent(in) :: self
      type(boxes_t), intent(in) :: boxes
      integer(ip), intent(in) :: i
      type(places_t), intent(inout) :: found
      integer(ip) :: stack(stack_size), node, child, j
      integer :: waiting, q
      real(dp) :: window(4)

      window = self%grown(:, i)
      waiting = 1
      stack(1) = ancestor_around(self%tree, i, window)
      do while (waiting > 0)
         node = stack(waiting)
         waiting = waiting - 1
         j = self%tree%node(node)%first
         do while (j /= 0_ip)
            if (is_new(self, boxes, i, j)) then
               call found%push(i)
               call found%push(j)
            end if
            j = self%tree%next(j)
         end do
         do q = 1, 4
            child = self%tree%node(node)%child(q)
            if (child == 0_ip) cycle
            if (.not. meet(self%tree%node(child)%grown, window)) cycle
            waiting = waiting + 1
            stack(waiting) = child
         end do
      end do
   end subroutine search

   !> Lowest cell around the leaf of a box that holds the centre of every possible candidate
   pure integer(ip) function ancestor_around(tree, i, window) result(node)
      type(tree_t), intent(in) :: tree
      integer(ip), intent(in) :: i
      real(dp), intent(in) :: window(4)
      real(dp) :: low(2), high(2)

      node = tree%leaf(i)
      do while (node /= tree%root)
         low = real(tree%node(node)%low, dp)
         high = low + real(shiftl(1_ip, tree%node(node)%level), dp)
         ! Formed as the grown cells are, and strict, because grown cells that touch make candidates.
         if (all(low + tree%greatest_reach < window(1:2) .and. window(3:4) < high - tree%greatest_reach)) exit
         node = tree%node(node)%parent
      end do
   end function ancestor_around

   !> Whether two boxes are candidates now and were none before, and this search has to say so
   pure logical function is_new(self, boxes, i, j)
      type(quadtree_t), intent(in) :: self
      type(boxes_t), intent(in) :: boxes
      integer(ip), intent(in) :: i, j

      is_new = .false.
      if (j <= i) then
         if (j == i .or. self%tree%is_changed(j) /= 0_bp) return
      end if
      if (.not. meet(self%grown(:, i), self%grown(:, j))) return
      if (meet(self%grown_before(:, i), self%grown_before(:, j))) return
      is_new = boxes%body(i) /= boxes%body(j) .and. .not. (boxes%fixed(i) .and. boxes%fixed(j))
   end function is_new

   !> Drop the candidates that parted and add those that the threads found, in the order of their parts.
   subroutine replace_candidates(self, boxes, changes)
      type(quadtree_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      type(pair_changes_t), intent(inout) :: changes
      integer(ip) :: k, i, j, dropped
      integer :: w
      logical :: overlap

      do k = 1_ip, self%tree%n_changed
         call self%candidates%drop_parted(self%tree%changed(k), self%grown, dropped)
         self%dropped = self%dropped + int(dropped, lp)
      end do
      do w = 1, size(self%worker)
         do k = 1_ip, self%worker(w)%found%n, 2_ip
            i = self%worker(w)%found%at(k)
            j = self%worker(w)%found%at(k + 1_ip)
            overlap = overlapping(boxes%bounds(:, i), boxes%bounds(:, j))
            call self%candidates%add(i, j, overlap)
            if (overlap) call changes%record(boxes%body(i), boxes%body(j), 1_ip)
         end do
         self%found = self%found + int(self%worker(w)%found%n/2_ip, lp)
      end do
   end subroutine replace_candidates

   !> Set the counters of the quadtree.
   !>
   !> Sums over all steps: leavers (boxes whose centre left its leaf), leaf_changes (boxes whose leaf is
   !> another, those split and merged by neighbours included), searches, dropped and found candidates. As
   !> they are now: candidates, nodes, depth.
   subroutine report(self, counters)
      class(quadtree_t), intent(in) :: self
      type(counters_t), intent(inout) :: counters

      call counters%set('quadtree_steps', self%steps)
      call counters%set('quadtree_leavers', self%leavers)
      call counters%set('quadtree_leaf_changes', self%changed)
      call counters%set('quadtree_searches', self%searched)
      call counters%set('quadtree_dropped', self%dropped)
      call counters%set('quadtree_found', self%found)
      call counters%set('quadtree_candidates', int(self%candidates%n, lp))
      call counters%set('quadtree_nodes', int(self%tree%n_nodes, lp))
      if (allocated(self%tree%leaf)) call counters%set('quadtree_depth', int(self%tree%depth(), lp))
   end subroutine report

end module polydem_quadtree
