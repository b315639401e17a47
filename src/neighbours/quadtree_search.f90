!> The search of the tree: which boxes are candidates of a given one that were none before.
module polydem_quadtree_search
   use polydem_boxes, only: boxes_t
   use polydem_candidates, only: meet, places_t
   use polydem_kinds, only: bp, dp, ip, lp
   use polydem_quadtree_nodes, only: tree_t
   implicit none
   private
   public :: grown_cells_t, search

   !> Cells that can wait to be searched: three per level and one
   integer, parameter :: stack_size = 96

   !> Cells of the leaves of all boxes, enlarged by the reach of each box
   type :: grown_cells_t
      !> Now, (4, box) [finest cells]
      real(dp), allocatable :: now(:, :)
      !> Before the step
      real(dp), allocatable :: before(:, :)
   end type grown_cells_t

contains

   !> Find the new candidates of one box.
   subroutine search(tree, grown, boxes, i, found, visits)
      !> Tree
      type(tree_t), intent(in) :: tree
      !> Grown cells now and before
      type(grown_cells_t), intent(in) :: grown
      !> Boxes; only bodies, and which are passive, matter
      type(boxes_t), intent(in) :: boxes
      !> Box whose grown cell is new
      integer(ip), intent(in) :: i
      !> Boxes of new candidates, two entries each, appended to what is there
      type(places_t), intent(inout) :: found
      !> Nodes looked at, on the way up and down, added to what is there
      integer(lp), intent(inout) :: visits
      integer(ip) :: stack(stack_size), node, child, j
      integer :: waiting, q
      real(dp) :: window(4)

      window = grown%now(:, i)
      waiting = 1
      stack(1) = ancestor_around(tree, i, window)
      visits = visits + int(tree%node(stack(1))%level - tree%node(tree%leaf(i))%level, lp)
      do while (waiting > 0)
         node = stack(waiting)
         waiting = waiting - 1
         visits = visits + 1_lp
         j = tree%node(node)%first
         do while (j /= 0_ip)
            if (is_new(tree, grown, boxes, i, j)) then
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

   !> Lowest cell around the leaf of a box that holds the centre of every possible candidate
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
            ! Formed as the grown cells are, and strict, because grown cells that touch make candidates.
            inside = inside .and. low + tree%greatest_reach < window(a) .and. window(a + 2) < high - tree%greatest_reach
         end do
         if (inside) exit
         node = tree%node(node)%parent
      end do
   end function ancestor_around

   !> Whether two boxes are candidates now and were none before, and this search has to say so
   pure logical function is_new(tree, grown, boxes, i, j)
      type(tree_t), intent(in) :: tree
      type(grown_cells_t), intent(in) :: grown
      type(boxes_t), intent(in) :: boxes
      integer(ip), intent(in) :: i, j

      is_new = .false.
      if (j <= i) then
         if (j == i .or. tree%is_changed(j) /= 0_bp) return
      end if
      if (.not. meet(grown%now(:, i), grown%now(:, j))) return
      if (meet(grown%before(:, i), grown%before(:, j))) return
      is_new = boxes%body(i) /= boxes%body(j) .and. .not. (boxes%passive(i) .and. boxes%passive(j))
   end function is_new

end module polydem_quadtree_search
