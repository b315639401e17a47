!> Minimal quadtree: a leaf is the largest cell that contains a single box.
!>
!> Nodes exist only where boxes are. A node is internal if it contains at least two boxes and is above the finest level;
!> otherwise it is a leaf. Leaves on the finest level may contain several boxes. The tree is a function of the current
!> centres of the boxes and does not depend on their paths.
!>
!> The module has two variants. The *pruned* tree (Vemuri et al. 1998) has all leaves on the finest level. The *binary*
!> tree (Krengel et al. 2026, section 3.2) uses only one axis: its cells are unbounded along the other axis, and two of
!> the four children of a node are never used.
!>
!> Positions of centres are integers from 0 to 2^30 - 1 in each direction, in cells of the finest level. The origin of
!> space lies near the cell whose index has alternating bits 0 and 1. The ancestors of this cell extend to the left and
!> to the right in turn, so the root can grow in every direction. Centres outside this range are moved to the outermost
!> cell. This never increases the distance between two centres, so no neighbour is lost.
module polydem_quadtree_nodes
   use polydem_kinds, only: bp, dp, ip, lp, wp
   use polydem_quadtree_cells, only: cell_bounds, count_in, holds, quadrant, set_reach, within
   use polydem_quadtree_pool, only: node_pool_t
   implicit none
   private
   public :: tree_t

   !> Highest level of the root; 0 is the finest level
   integer(ip), parameter :: top_level = 30_ip
   !> Cell index with alternating bits, 0101...01
   integer(ip), parameter :: middle = 357913941_ip

   !> Tree, leaf of each box, and list of the boxes whose leaf changed
   type, extends(node_pool_t) :: tree_t
      !> Root; 0: the tree has no box
      integer(ip) :: root = 0_ip
      !> Leaf of each box, (box)
      integer(ip), allocatable :: leaf(:)
      !> Next box in the same leaf, (box); 0 for the last box
      integer(ip), allocatable :: next(:)
      !> Bounds of the leaf of each box, half open, (4, box) [finest cells]
      real(dp), allocatable :: cell(:, :)
      !> Reach of each box with an allowance for rounding, (box) [finest cells]
      real(dp), allocatable :: reach(:)
      !> Largest reach of all boxes [finest cells]
      real(dp) :: greatest_reach = 0.0_dp
      !> Number of boxes whose leaf or reach changed since the last call of `settle`
      integer(ip) :: n_changed = 0_ip
      !> Boxes whose leaf or reach changed; the first `n_changed` entries are valid
      integer(ip), allocatable :: changed(:)
      !> 1 if a box is in `changed`, else 0, (box)
      integer(bp), allocatable :: is_changed(:)
      !> Finest cells per metre, halved because the sum of two bounds is twice the centre [1/m]
      real(dp) :: half_scale = 0.5_dp
      !> Position of the origin of space [finest cells]
      real(dp) :: shift(2) = 0.0_dp
      !> Allowance for rounding in a reach [finest cells]
      real(dp) :: slack = 0.0_dp
      !> Whether all leaves are on the finest level (pruned tree)
      logical :: equal_leaves = .false.
   contains
      procedure :: start
      procedure :: insert
      procedure :: move
      procedure :: increase_reach
      procedure :: settle
      procedure :: depth
      procedure :: bytes
   end type tree_t

contains

   !> Make an empty tree.
   subroutine start(self, n, finest, origin)
      class(tree_t), intent(inout) :: self
      !> Number of boxes that will be inserted
      integer(ip), intent(in) :: n
      !> Side of a cell of the finest level [m]
      real(dp), intent(in) :: finest
      !> Position among the boxes [m]
      real(dp), intent(in) :: origin(2)
      real(dp), parameter :: off_border = 0.381966_dp

      ! A packing has 1.6 nodes per box; the pool grows by a half if it needs more.
      call self%reserve(n + n/4_ip + 64_ip)
      allocate (self%leaf(n), self%next(n), self%cell(4, n), self%reach(n))
      allocate (self%changed(n), self%is_changed(n))
      self%leaf = 0_ip
      self%is_changed = 0_bp
      self%half_scale = 0.5_dp/finest
      self%shift = real(middle, dp) + off_border - origin/finest
      self%slack = 8.0_dp*epsilon(1.0_dp)*(maxval(abs(origin))/finest + 2.0_dp**top_level)
   end subroutine start

   !> Insert a box into the tree for the first time.
   subroutine insert(self, box, reach, bounds)
      class(tree_t), intent(inout) :: self
      !> Box to insert
      integer(ip), intent(in) :: box
      !> Reach of the box [m]
      real(dp), intent(in) :: reach
      !> Bounds of all boxes, (4, box) [m]
      real(wp), intent(in), contiguous :: bounds(:, :)
      integer(ip) :: at(2), root

      at = cell_of(self, bounds(:, box))
      self%reach(box) = padded(self, reach)
      self%greatest_reach = max(self%greatest_reach, self%reach(box))
      if (self%root == 0_ip) then
         call self%new_node(0_ip, 0_ip, at, root)
         self%root = root
      else
         do while (.not. holds(self%node(self%root), at))
            call grow_root(self)
         end do
      end if
      call count_in(self%node(self%root), self%reach(box), self%ignored)
      call descend(self, self%root, box, at, bounds)
   end subroutine insert

   !> Move a box that may have left its leaf to the leaf of its present position.
   subroutine move(self, box, bounds)
      class(tree_t), intent(inout) :: self
      !> Box that moved
      integer(ip), intent(in) :: box
      !> Bounds of all boxes, (4, box) [m]
      real(wp), intent(in), contiguous :: bounds(:, :)
      integer(ip) :: at(2), node

      at = cell_of(self, bounds(:, box))
      node = self%leaf(box)
      do while (.not. holds(self%node(node), at))
         if (node == self%root) call grow_root(self)
         if (node /= self%root) node = self%node(node)%parent
      end do
      if (node == self%leaf(box)) return
      call remove_below(self, node, box)
      call descend(self, node, box, at, bounds)
   end subroutine move

   !> Increase the reach of a box.
   subroutine increase_reach(self, box, reach)
      class(tree_t), intent(inout) :: self
      !> Box
      integer(ip), intent(in) :: box
      !> New reach [m]
      real(dp), intent(in) :: reach
      integer(ip) :: node

      self%reach(box) = max(self%reach(box), padded(self, reach))
      self%greatest_reach = max(self%greatest_reach, self%reach(box))
      node = self%leaf(box)
      do while (node /= 0_ip)
         call set_reach(self%node(node), max(self%node(node)%reach, self%reach(box)), self%ignored)
         node = self%node(node)%parent
      end do
      call mark_changed(self, box)
   end subroutine increase_reach

   !> Clear the list of changed boxes.
   subroutine settle(self)
      class(tree_t), intent(inout) :: self
      integer(ip) :: k

      do k = 1_ip, self%n_changed
         self%is_changed(self%changed(k)) = 0_bp
      end do
      self%n_changed = 0_ip
   end subroutine settle

   !> Number of levels from the root to the lowest leaf, both included
   integer(ip) function depth(self)
      class(tree_t), intent(in) :: self
      integer(ip) :: box

      depth = 0_ip
      if (self%root == 0_ip) return
      do box = 1_ip, size(self%leaf, kind=ip)
         depth = max(depth, self%node(self%root)%level - self%node(self%leaf(box))%level + 1_ip)
      end do
   end function depth

   !> Allocated memory [B]
   pure integer(lp) function bytes(self)
      class(tree_t), intent(in) :: self

      bytes = 0_lp
      if (.not. allocated(self%leaf)) return
      bytes = self%pool_bytes() + &
         (int(storage_size(self%leaf), lp)*3_lp*size(self%leaf, kind=lp) + &
          int(storage_size(self%is_changed), lp)*size(self%is_changed, kind=lp) + &
          int(storage_size(self%cell), lp)*5_lp*size(self%reach, kind=lp))/8_lp
   end function bytes

   !> Move a box down to its leaf from a node whose count already includes the box. A leaf that contains another box is
   !> split.
   subroutine descend(self, top, box, at, bounds)
      type(tree_t), intent(inout) :: self
      integer(ip), intent(in) :: top, box, at(2)
      real(wp), intent(in), contiguous :: bounds(:, :)
      integer(ip) :: node, child, resident

      node = top
      do while (self%node(node)%level > 0_ip .and. (self%node(node)%count > 1_ip .or. self%equal_leaves))
         resident = self%node(node)%first
         if (resident /= 0_ip) then
            self%node(node)%first = 0_ip
            call find_child(self, node, within(self%node(node), cell_of(self, bounds(:, resident))), child)
            call count_in(self%node(child), self%reach(resident), self%ignored)
            call add_to_leaf(self, child, resident)
         end if
         call find_child(self, node, at, child)
         call count_in(self%node(child), self%reach(box), self%ignored)
         node = child
      end do
      call add_to_leaf(self, node, box)
   end subroutine descend

   !> Remove a box from its leaf and from all cells below an ancestor. Empty cells are freed, and cells that contain a
   !> single box are merged.
   subroutine remove_below(self, ancestor, box)
      type(tree_t), intent(inout) :: self
      integer(ip), intent(in) :: ancestor, box
      integer(ip) :: node, parent, single

      node = self%leaf(box)
      call unlink(self, node, box)
      single = 0_ip
      do while (node /= ancestor)
         parent = self%node(node)%parent
         self%node(node)%count = self%node(node)%count - 1_ip
         if (self%node(node)%count == 0_ip) then
            where (self%node(parent)%child == node) self%node(parent)%child = 0_ip
            call self%free_node(node)
         else
            if (self%node(node)%count == 1_ip) single = node
            if (self%node(node)%reach <= self%reach(box)) call shrink_reach(self, node)
         end if
         node = parent
      end do
      if (single /= 0_ip .and. .not. self%equal_leaves) call merge_cells(self, single)
   end subroutine remove_below

   !> Turn a node that contains a single box into a leaf.
   subroutine merge_cells(self, top)
      type(tree_t), intent(inout) :: self
      integer(ip), intent(in) :: top
      integer(ip) :: node, below

      if (self%node(top)%first /= 0_ip) return
      node = maxval(self%node(top)%child)
      self%node(top)%child = 0_ip
      do while (self%node(node)%first == 0_ip)
         below = maxval(self%node(node)%child)
         call self%free_node(node)
         node = below
      end do
      below = self%node(node)%first
      call self%free_node(node)
      call add_to_leaf(self, top, below)
   end subroutine merge_cells

   !> Add a box to a leaf whose count already includes it, and add the box to the list of changed boxes.
   subroutine add_to_leaf(self, leaf, box)
      type(tree_t), intent(inout) :: self
      integer(ip), intent(in) :: leaf, box

      self%next(box) = self%node(leaf)%first
      self%node(leaf)%first = box
      self%leaf(box) = leaf
      self%cell(:, box) = cell_bounds(self%node(leaf), self%ignored)
      call mark_changed(self, box)
   end subroutine add_to_leaf

   !> Remove a box from the linked list of its leaf.
   subroutine unlink(self, leaf, box)
      type(tree_t), intent(inout) :: self
      integer(ip), intent(in) :: leaf, box
      integer(ip) :: other

      other = self%node(leaf)%first
      if (other == box) then
         self%node(leaf)%first = self%next(box)
         return
      end if
      do while (self%next(other) /= box)
         other = self%next(other)
      end do
      self%next(other) = self%next(box)
   end subroutine unlink

   !> Add a box to the list of changed boxes.
   subroutine mark_changed(self, box)
      type(tree_t), intent(inout) :: self
      integer(ip), intent(in) :: box

      if (self%is_changed(box) /= 0_bp) return
      self%is_changed(box) = 1_bp
      self%n_changed = self%n_changed + 1_ip
      self%changed(self%n_changed) = box
   end subroutine mark_changed

   !> Make a new root with twice the side above the root. A root that contains one box is enlarged instead.
   subroutine grow_root(self)
      type(tree_t), intent(inout) :: self
      integer(ip) :: old, root, level, low(2), box

      old = self%root
      level = self%node(old)%level + 1_ip
      low = shiftl(shiftr(self%node(old)%low, level), level)
      if (self%node(old)%count == 1_ip .and. .not. self%equal_leaves) then
         self%node(old)%level = level
         self%node(old)%low = low
         call set_reach(self%node(old), self%node(old)%reach, self%ignored)
         box = self%node(old)%first
         self%node(old)%first = 0_ip
         call add_to_leaf(self, old, box)
         return
      end if
      call self%new_node(0_ip, level, low, root)
      self%root = root
      self%node(self%root)%child(quadrant(level, self%node(old)%low)) = old
      self%node(self%root)%count = self%node(old)%count
      call set_reach(self%node(self%root), self%node(old)%reach, self%ignored)
      self%node(old)%parent = self%root
   end subroutine grow_root

   !> Find the child of a node that contains a finest cell; it is made if it does not exist.
   subroutine find_child(self, node, at, child)
      type(tree_t), intent(inout) :: self
      integer(ip), intent(in) :: node, at(2)
      integer(ip), intent(out) :: child
      integer(ip) :: q, level

      level = self%node(node)%level
      q = quadrant(level, at)
      child = self%node(node)%child(q)
      if (child /= 0_ip) return
      call self%new_node(node, level - 1_ip, shiftl(shiftr(at, level - 1_ip), level - 1_ip), child)
      self%node(node)%child(q) = child
   end subroutine find_child

   !> Compute the largest reach of a node again after a box has left it.
   subroutine shrink_reach(self, node)
      type(tree_t), intent(inout) :: self
      integer(ip), intent(in) :: node
      real(dp) :: reach
      integer(ip) :: box
      integer :: q

      reach = 0.0_dp
      box = self%node(node)%first
      do while (box /= 0_ip)
         reach = max(reach, self%reach(box))
         box = self%next(box)
      end do
      do q = 1, 4
         if (self%node(node)%child(q) /= 0_ip) reach = max(reach, self%node(self%node(node)%child(q))%reach)
      end do
      if (reach < self%node(node)%reach) call set_reach(self%node(node), reach, self%ignored)
   end subroutine shrink_reach

   !> Finest cell that contains the centre of a box; NaN lies in cell 0
   pure function cell_of(self, box) result(at)
      type(tree_t), intent(in) :: self
      real(wp), intent(in) :: box(4)
      integer(ip) :: at(2)
      real(dp) :: place
      integer :: a

      do a = 1, 2
         place = (real(box(a), dp) + real(box(a + 2), dp))*self%half_scale + self%shift(a)
         at(a) = 0_ip
         if (a == self%ignored) place = real(middle, dp)
         if (place > 0.0_dp) at(a) = int(min(place, 2.0_dp**top_level - 1.0_dp), ip)
      end do
   end function cell_of

   !> Reach in finest cells, enlarged to allow for rounding of positions
   pure real(dp) function padded(self, reach)
      type(tree_t), intent(in) :: self
      real(dp), intent(in) :: reach

      padded = 2.0_dp*reach*self%half_scale*(1.0_dp + 1.0e-9_dp) + self%slack
   end function padded

end module polydem_quadtree_nodes
