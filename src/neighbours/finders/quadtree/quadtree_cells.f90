!> Node of a quadtree: a square cell with integer bounds.
!>
!> The unit of length is the side of a cell of the finest level. A cell of level L has 2^L finest cells on a side, and
!> its lower bounds are multiples of 2^L. Bit operations show whether it contains a finest cell.
module polydem_quadtree_cells
   use polydem_kinds, only: dp, ip
   implicit none
   private
   public :: node_t, count_in, set_reach, cell_bounds, holds, within, quadrant

   !> One cell of the tree
   type :: node_t
      !> Bounds xmin, ymin, xmax, ymax of the cell, padded by the largest reach of its boxes [finest cells]
      real(dp) :: grown(4)
      !> Children: lower left, lower right, upper left, upper right; 0: none
      integer(ip) :: child(4)
      !> Parent, 0 for the root; for a free node the next free node
      integer(ip) :: parent
      !> Level, 0 for the finest: the cell has 2^level finest cells on a side
      integer(ip) :: level
      !> Number of boxes in the cell
      integer(ip) :: count
      !> First box of a leaf, 0 for an internal node
      integer(ip) :: first
      !> Finest cell at the lower left corner
      integer(ip) :: low(2)
      !> Largest reach of the boxes in the cell [finest cells]
      real(dp) :: reach
   end type node_t

contains

   !> Add one box to the count and to the largest reach of a node.
   pure subroutine count_in(node, reach, ignored)
      !> Node
      type(node_t), intent(inout) :: node
      !> Reach of the box [finest cells]
      real(dp), intent(in) :: reach
      !> Ignored axis as in `cell_bounds`
      integer, intent(in) :: ignored

      node%count = node%count + 1_ip
      if (reach > node%reach) call set_reach(node, reach, ignored)
   end subroutine count_in

   !> Set the largest reach of a node and its padded bounds.
   pure subroutine set_reach(node, reach, ignored)
      !> Node
      type(node_t), intent(inout) :: node
      !> Reach [finest cells]
      real(dp), intent(in) :: reach
      !> Ignored axis as in `cell_bounds`
      integer, intent(in) :: ignored

      node%reach = reach
      node%grown = cell_bounds(node, ignored) + [-reach, -reach, reach, reach]
   end subroutine set_reach

   !> Bounds xmin, ymin, xmax, ymax of a cell [finest cells]
   pure function cell_bounds(node, ignored) result(bounds)
      !> Node
      type(node_t), intent(in) :: node
      !> Axis along which cells are unbounded (binary tree); 0: none
      integer, intent(in) :: ignored
      real(dp) :: bounds(4)

      bounds(1:2) = real(node%low, dp)
      bounds(3:4) = bounds(1:2) + real(shiftl(1_ip, node%level), dp)
      if (ignored > 0) bounds(ignored:ignored + 2:2) = [-huge(1.0_dp), huge(1.0_dp)]
   end function cell_bounds

   !> Whether a cell contains a finest cell
   pure logical function holds(node, at)
      !> Node
      type(node_t), intent(in) :: node
      !> Finest cell
      integer(ip), intent(in) :: at(2)

      holds = shiftr(ior(ieor(at(1), node%low(1)), ieor(at(2), node%low(2))), node%level) == 0_ip
   end function holds

   !> Finest cell of a node nearest to a given finest cell. A box that has left its leaf but is not yet moved counts as
   !> lying there
   pure function within(node, at) result(nearest)
      !> Node
      type(node_t), intent(in) :: node
      !> Finest cell
      integer(ip), intent(in) :: at(2)
      integer(ip) :: nearest(2)

      nearest = max(node%low, min(at, node%low + (shiftl(1_ip, node%level) - 1_ip)))
   end function within

   !> Number (1 to 4) of the child of a cell that contains a finest cell
   pure integer(ip) function quadrant(level, at)
      !> Level of the cell, above 0
      integer(ip), intent(in) :: level
      !> Finest cell
      integer(ip), intent(in) :: at(2)

      quadrant = 1_ip + ibits(at(1), level - 1_ip, 1) + 2_ip*ibits(at(2), level - 1_ip, 1)
   end function quadrant

end module polydem_quadtree_cells
