!> Search for the changes of candidates after the tree has changed.
!>
!> A pair becomes a candidate only if the padded cell of one of its boxes has grown somewhere, and ceases to be one only
!> if one has shrunk somewhere. So the tree is searched for boxes whose padded cell has grown, and the candidates of the
!> others are only compared. The candidates can be replaced later, before the next comparison.
module polydem_quadtree_search
   use polydem_boxes, only: boxes_t
   use polydem_candidates, only: overlapping
   use polydem_index_list, only: index_list_t
   use polydem_kinds, only: bp, dp, ip, lp, wp
   use polydem_linked_candidates, only: linked_candidates_t, meet
   use polydem_pair_changes, only: pair_changes_t
   use polydem_quadtree_nodes, only: tree_t
   implicit none
   private
   public :: padded_cells_t, replacement_t, worker_t, find_outside, search_changed

   !> Size of the stack of cells to be searched: at most three cells per level and one more are on the stack
   integer, parameter :: stack_size = 96

   !> Padded cells: the cells of the leaves of all boxes, each enlarged by the reach of its box
   type :: padded_cells_t
      !> Bounds of the padded cells in this step, (4, box) [finest cells]
      real(dp), allocatable :: now(:, :)
      !> Bounds of the padded cells before this step, (4, box) [finest cells]
      real(dp), allocatable :: before(:, :)
      !> 1 if the padded cell of a box has grown in this step, else 0, (box)
      integer(bp), allocatable :: has_grown(:)
   contains
      procedure :: start
      procedure :: update
      procedure :: settle
   end type padded_cells_t

   !> Results of one thread, or of one part of the work
   type :: worker_t
      !> Boxes whose centre left its leaf or whose half side exceeds their reach
      type(index_list_t) :: outside
      !> Both boxes of each new candidate, and 1 if they overlap, else 0
      type(index_list_t) :: found
      !> Boxes whose padded cell has shrunk somewhere
      type(index_list_t) :: shrunk
      !> Number of searches, and of nodes visited in them
      integer(lp) :: searches = 0_lp, visits = 0_lp
   contains
      procedure :: clear
   end type worker_t

   !> Candidates to add and to remove after a search; it can wait until the next step compares them
   type :: replacement_t
      private
      !> Both boxes of each new candidate, and 1 if they overlap, else 0
      type(index_list_t) :: found
      !> Boxes whose padded cell has shrunk somewhere
      type(index_list_t) :: shrunk
      !> Candidates to remove
      type(index_list_t) :: separated
   contains
      procedure :: collect
      procedure :: apply
   end type replacement_t

contains

   !> Start with empty cells.
   pure subroutine start(self, n_boxes)
      class(padded_cells_t), intent(inout) :: self
      !> Number of boxes
      integer(ip), intent(in) :: n_boxes

      allocate (self%before(4, n_boxes))
      allocate (self%has_grown(n_boxes), source=0_bp)
      self%before = spread([1.0_dp, 1.0_dp, -1.0_dp, -1.0_dp]*huge(1.0_dp), 2, n_boxes)
      self%now = self%before
   end subroutine start

   !> Compute the padded cells of the boxes whose leaf changed. The previous ones are those of `before`.
   pure subroutine update(self, tree)
      class(padded_cells_t), intent(inout) :: self
      !> Tree of the boxes
      type(tree_t), intent(in) :: tree
      integer(ip) :: k, i
      real(dp) :: reach

      do k = 1_ip, tree%n_changed
         i = tree%changed(k)
         reach = tree%reach(i)
         self%now(1:2, i) = tree%cell(1:2, i) - reach
         self%now(3:4, i) = tree%cell(3:4, i) + reach
         self%has_grown(i) = merge(0_bp, 1_bp, lies_in(self%now(:, i), self%before(:, i)))
      end do
   end subroutine update

   !> Whether a cell lies in another one
   pure logical function lies_in(cell, other)
      real(dp), intent(in) :: cell(4), other(4)

      lies_in = all(cell(1:2) >= other(1:2)) .and. all(cell(3:4) <= other(3:4))
   end function lies_in

   !> End a step: the padded cells before the next step are those of now.
   pure subroutine settle(self, tree)
      class(padded_cells_t), intent(inout) :: self
      !> Tree of the boxes
      type(tree_t), intent(in) :: tree
      integer(ip) :: k, i

      do k = 1_ip, tree%n_changed
         i = tree%changed(k)
         self%before(:, i) = self%now(:, i)
         self%has_grown(i) = 0_bp
      end do
   end subroutine settle

   !> Delete all results.
   pure subroutine clear(self)
      class(worker_t), intent(inout) :: self

      self%outside%n = 0_ip
      self%found%n = 0_ip
      self%shrunk%n = 0_ip
      self%searches = 0_lp
      self%visits = 0_lp
   end subroutine clear

   !> List the boxes low..high whose centre is not in its leaf or whose side exceeds `greatest_side`.
   subroutine find_outside(tree, low, high, bounds, greatest_side, outside)
      !> Tree of the boxes
      type(tree_t), intent(in) :: tree
      !> First and last box
      integer(ip), intent(in) :: low, high
      !> Bounds of the boxes, (4, box) [m]
      real(wp), intent(in), contiguous :: bounds(:, :)
      !> Largest side of each box for which its reach is sufficient, (box) [m]
      real(wp), intent(in), contiguous :: greatest_side(:)
      !> List of the boxes; appended
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

   !> Find the new candidates of boxes whose leaf changed, and the boxes that may have lost some.
   subroutine search_changed(tree, padded, low, high, boxes, worker, changes)
      !> Tree of the boxes
      type(tree_t), intent(in) :: tree
      !> Padded cells in this step and before
      type(padded_cells_t), intent(in) :: padded
      !> First and last box in the list of those whose leaf changed
      integer(ip), intent(in) :: low, high
      type(boxes_t), intent(in) :: boxes
      !> Results; increased
      type(worker_t), intent(inout) :: worker
      !> List of changes; new overlapping pairs are appended
      type(pair_changes_t), intent(inout) :: changes
      integer(ip) :: k, i

      do k = low, high
         i = tree%changed(k)
         if (padded%has_grown(i) /= 0_bp) then
            worker%searches = worker%searches + 1_lp
            call search(tree, padded, boxes, i, worker%found, worker%visits, changes)
         end if
         if (.not. lies_in(padded%before(:, i), padded%now(:, i))) call worker%shrunk%push(i)
      end do
   end subroutine search_changed

   !> Collect the results of a search.
   pure subroutine collect(self, worker)
      class(replacement_t), intent(inout) :: self
      !> Results of all workers, (worker)
      type(worker_t), intent(in) :: worker(:)
      integer :: w

      do w = 1, size(worker)
         call self%found%append(worker(w)%found)
         call self%shrunk%append(worker(w)%shrunk)
      end do
   end subroutine collect

   !> Remove and add candidates after `settle`, when `before` has the padded cells of the search. Forget its results.
   pure subroutine apply(self, padded, candidates)
      class(replacement_t), intent(inout) :: self
      !> Padded cells. Those of `now` are not used, and may change meanwhile
      type(padded_cells_t), intent(in) :: padded
      class(linked_candidates_t), intent(inout) :: candidates
      integer(ip) :: k, number

      self%separated%n = 0_ip
      do k = 1_ip, self%shrunk%n
         call candidates%list_separated(self%shrunk%at(k), padded%before, self%separated)
      end do
      do k = 1_ip, self%separated%n
         call candidates%drop(self%separated%at(k))
      end do
      do k = 1_ip, self%found%n, 3_ip
         call candidates%add(self%found%at(k), self%found%at(k + 1_ip), self%found%at(k + 2_ip) /= 0_ip, number)
      end do
      self%found%n = 0_ip
      self%shrunk%n = 0_ip
   end subroutine apply

   !> Find the new candidates of one box.
   subroutine search(tree, padded, boxes, i, found, visits, changes)
      type(tree_t), intent(in) :: tree
      type(padded_cells_t), intent(in) :: padded
      type(boxes_t), intent(in) :: boxes
      !> Box whose padded cell has grown
      integer(ip), intent(in) :: i
      !> Both boxes of each new candidate, and 1 if they overlap, else 0; appended
      type(index_list_t), intent(inout) :: found
      !> Number of visited nodes, upwards and downwards; increased by this search
      integer(lp), intent(inout) :: visits
      !> List of changes; new overlapping pairs are appended
      type(pair_changes_t), intent(inout) :: changes
      integer(ip) :: stack(stack_size), node, child, j
      integer :: waiting, q
      real(dp) :: window(4)

      window = padded%now(:, i)
      waiting = 1
      stack(1) = ancestor_around(tree, i, window)
      visits = visits + int(tree%node(stack(1))%level - tree%node(tree%leaf(i))%level, lp)
      do while (waiting > 0)
         node = stack(waiting)
         waiting = waiting - 1
         visits = visits + 1_lp
         j = tree%node(node)%first
         do while (j /= 0_ip)
            if (is_new(padded, boxes, i, j)) then
               call found%push(i)
               call found%push(j)
               if (overlapping(boxes%bounds(:, i), boxes%bounds(:, j))) then
                  call found%push(1_ip)
                  call changes%record(boxes%piece(i), boxes%piece(j), 1_ip)
               else
                  call found%push(0_ip)
               end if
            end if
            j = tree%next(j)
         end do
         do q = 1, 4
            child = tree%node(node)%child(q)
            if (child == 0_ip) cycle
            if (.not. meet(tree%node(child)%grown, window)) cycle
            waiting = waiting + 1
            stack(waiting) = child
         end do
      end do
   end subroutine search

   !> Lowest ancestor of the leaf of a box that contains the centres of all possible candidates
   pure integer(ip) function ancestor_around(tree, i, window) result(node)
      type(tree_t), intent(in) :: tree
      integer(ip), intent(in) :: i
      real(dp), intent(in) :: window(4)
      real(dp) :: low, high
      integer :: a
      logical :: inside

      node = tree%leaf(i)
      do while (node /= tree%root)
         inside = .true.
         do a = 1, 2
            if (a == tree%ignored) cycle
            low = real(tree%node(node)%low(a), dp)
            high = low + real(shiftl(1_ip, tree%node(node)%level), dp)
            ! These expressions round like those of the padded cells. The inequalities are strict because padded cells
            ! that touch are candidates.
            inside = inside .and. low + tree%greatest_reach < window(a) .and. window(a + 2) < high - tree%greatest_reach
         end do
         if (inside) exit
         node = tree%node(node)%parent
      end do
   end function ancestor_around

   !> Whether two boxes have become candidates and this search reports the pair. If the padded cells of both have grown,
   !> only the search for the box with the lower number reports it.
   pure logical function is_new(padded, boxes, i, j)
      type(padded_cells_t), intent(in) :: padded
      type(boxes_t), intent(in) :: boxes
      integer(ip), intent(in) :: i, j

      is_new = .false.
      if (j <= i) then
         if (j == i .or. padded%has_grown(j) /= 0_bp) return
      end if
      if (.not. meet(padded%now(:, i), padded%now(:, j))) return
      if (meet(padded%before(:, i), padded%before(:, j))) return
      is_new = boxes%may_meet(i, j)
   end function is_new

end module polydem_quadtree_search
