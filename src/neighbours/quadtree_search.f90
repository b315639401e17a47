!> Search of the tree for the new candidates of a box.
module polydem_quadtree_search
   use polydem_boxes, only: boxes_t
   use polydem_candidates, only: meet
   use polydem_index_list, only: index_list_t
   use polydem_kinds, only: bp, dp, ip, lp
   use polydem_quadtree_nodes, only: tree_t
   implicit none
   private
   public :: padded_cells_t, search

   !> Size of the stack of cells to be searched: at most three cells per level and one more are on the stack
   integer, parameter :: stack_size = 96

   !> Padded cells: the cells of the leaves of all boxes, each enlarged by the reach of its box
   type :: padded_cells_t
      !> Bounds of the padded cells in this step, (4, box) [finest cells]
      real(dp), allocatable :: now(:, :)
      !> Bounds of the padded cells before this step, (4, box) [finest cells]
      real(dp), allocatable :: before(:, :)
   end type padded_cells_t

contains

   !> Find the new candidates of one box.
   subroutine search(tree, padded, boxes, i, found, visits)
      !> Tree of the boxes
      type(tree_t), intent(in) :: tree
      !> Padded cells in this step and before
      type(padded_cells_t), intent(in) :: padded
      !> Boxes; only their bodies, and whether the bodies are passive, are used
      type(boxes_t), intent(in) :: boxes
      !> Box whose padded cell changed
      integer(ip), intent(in) :: i
      !> List of the boxes of new candidates; two entries are appended for each candidate
      type(index_list_t), intent(inout) :: found
      !> Number of visited nodes, upwards and downwards; increased by this search
      integer(lp), intent(inout) :: visits
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
            if (is_new(tree, padded, boxes, i, j)) then
               call found%push(i)
               call found%push(j)
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

   !> Whether two boxes have become candidates and this search reports the pair. If the leaves of both boxes changed,
   !> only the search for the box with the lower number reports it.
   pure logical function is_new(tree, padded, boxes, i, j)
      type(tree_t), intent(in) :: tree
      type(padded_cells_t), intent(in) :: padded
      type(boxes_t), intent(in) :: boxes
      integer(ip), intent(in) :: i, j

      is_new = .false.
      if (j <= i) then
         if (j == i .or. tree%is_changed(j) /= 0_bp) return
      end if
      if (.not. meet(padded%now(:, i), padded%now(:, j))) return
      if (meet(padded%before(:, i), padded%before(:, j))) return
      is_new = boxes%body(i) /= boxes%body(j) .and. .not. (boxes%passive(i) .and. boxes%passive(j))
   end function is_new

end module polydem_quadtree_search
