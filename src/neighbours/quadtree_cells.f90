!> One node of a quadtree, a square cell with whole-numbered bounds.
!>
!> Lengths count in cells of the finest level. A cell of level L has 2^L of them on a side and begins at a
!> multiple of 2^L, so whether it holds a place is a matter of bits.
module polydem_quadtree_cells
   use polydem_kinds, only: dp, ip
   implicit none
   private
   public :: node_t, count_in, set_reach, cell_bounds, holds, within, quadrant

   !> One cell of the tree
   type :: node_t
      !> Bounds of the cell grown by the greatest reach in it, xmin, ymin, xmax, ymax [finest cells]
      real(dp) :: grown(4)
      !> Children: lower left, lower right, upper left, upper right; 0: none
      integer(ip) :: child(4)
      !> Parent, 0 for the root; next free node for a free one
      integer(ip) :: parent
      !> Level, 0 for the finest: the cell has 2^level finest cells on a side
      integer(ip) :: level
      !> Number of boxes in the cell
      integer(ip) :: count
      !> First box of a leaf, 0 for an internal node
      integer(ip) :: first
      !> Lower left finest cell
      integer(ip) :: low(2)
      !> Greatest reach of the boxes in the cell [finest cells]
      real(dp) :: reach
   end type node_t

contains

   !> Count one more box in.
   pure subroutine count_in(node, reach, ignored)
      !> Node
      type(node_t), intent(inout) :: node
      !> Reach [finest cells]
      real(dp), intent(in) :: reach
      !> As for `cell_bounds`
      integer, intent(in) :: ignored

      node%count = node%count + 1_ip
      if (reach > node%reach) call set_reach(node, reach, ignored)
   end subroutine count_in

   !> Set the greatest reach of a node and its grown bounds.
   pure subroutine set_reach(node, reach, ignored)
      !> Node
      type(node_t), intent(inout) :: node
      !> Reach [finest cells]
      real(dp), intent(in) :: reach
      !> As for `cell_bounds`
      integer, intent(in) :: ignored

      node%reach = reach
      node%grown = cell_bounds(node, ignored) + [-reach, -reach, reach, reach]
   end subroutine set_reach

   !> Bounds of a cell, xmin, ymin, xmax, ymax [finest cells]
   pure function cell_bounds(node, ignored) result(bounds)
      !> Node
      type(node_t), intent(in) :: node
      !> Axis along which cells are endless (the tree is a binary one); 0: none
      integer, intent(in) :: ignored
      real(dp) :: bounds(4)

      bounds(1:2) = real(node%low, dp)
      bounds(3:4) = bounds(1:2) + real(shiftl(1_ip, node%level), dp)
      if (ignored > 0) bounds(ignored:ignored + 2:2) = [-huge(1.0_dp), huge(1.0_dp)]
   end function cell_bounds

   !> Whether a finest cell lies in a cell
   pure logical function holds(node, at)
      !> Node
      type(node_t), intent(in) :: node
      !> Finest cell
      integer(ip), intent(in) :: at(2)

      holds = shiftr(ior(ieor(at(1), node%low(1)), ieor(at(2), node%low(2))), node%level) == 0_ip
   end function holds

   !> Finest cell of a node nearest to a given one: where a box waits that has left but was not yet moved
   pure function within(node, at) result(nearest)
      !> Node
      type(node_t), intent(in) :: node
      !> Finest cell
      integer(ip), intent(in) :: at(2)
      integer(ip) :: nearest(2)

      nearest = max(node%low, min(at, node%low + (shiftl(1_ip, node%level) - 1_ip)))
   end function within

   !> Child of a cell of some level in which a finest cell lies
   pure integer(ip) function quadrant(level, at)
      !> Level of the cell, above 0
      integer(ip), intent(in) :: level
      !> Finest cell
      integer(ip), intent(in) :: at(2)

      quadrant = 1_ip + ibits(at(1), level - 1_ip, 1) + 2_ip*ibits(at(2), level - 1_ip, 1)
   end function quadrant

end module polydem_quadtree_cells
