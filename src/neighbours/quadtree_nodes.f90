!> The minimal quadtree: a leaf is the largest cell that holds a single box.
!>
!> Nodes exist only where boxes are: a node is internal if it holds at least two boxes and is above the finest
!> level, otherwise a leaf; leaves on the finest level may hold several boxes. So the tree is a function of
!> where the centres of the boxes are, not of how they came there.
!>
!> Two variants share all of this. The *pruned* tree (Vemuri et al. 1998) has all its leaves on the finest
!> level, however few boxes there are. The *binary* tree (Krengel et al. 2026, section 3.2) looks at one axis
!> only: along the other one cells are endless, and of the four children of a node two are never used.
!>
!> Centres count in whole cells of the finest level, 0 .. 2^30 - 1 in each direction. The origin of the space
!> lies near the cell whose index alternates 0 and 1 bits: its ancestors then extend to the left and to the
!> right in turn, and the root can grow in every direction. Centres further away count as if they lay in
!> the outermost cell. This brings them closer to others, never further, so no neighbour is lost.
module polydem_quadtree_nodes
   use polydem_kinds, only: bp, dp, ip, lp, wp
   use polydem_quadtree_cells, only: cell_bounds, count_in, holds, quadrant, set_reach, within
   use polydem_quadtree_pool, only: node_pool_t
   implicit none
   private
   public :: tree_t

   !> Levels above the finest that the root can reach
   integer(ip), parameter :: top_level = 30_ip
   !> Cell index with alternating bits, 0101...01
   integer(ip), parameter :: middle = 357913941_ip

   !> The tree, where boxes are in it, and which of them changed leaf
   type, extends(node_pool_t) :: tree_t
      !> Root; 0: no box yet
      integer(ip) :: root = 0_ip
      !> Leaf of each box
      integer(ip), allocatable :: leaf(:)
      !> Next box in the same leaf, 0 for the last
      integer(ip), allocatable :: next(:)
      !> Bounds of the leaf of each box, half open, (4, box) [finest cells]
      real(dp), allocatable :: cell(:, :)
      !> Reach of each box with room for rounding [finest cells]
      real(dp), allocatable :: reach(:)
      !> Greatest reach of all
      real(dp) :: greatest_reach = 0.0_dp
      !> Number of boxes whose leaf or reach changed since `settle`
      integer(ip) :: n_changed = 0_ip
      !> These boxes
      integer(ip), allocatable :: changed(:)
      !> 1 if a box is among them, else 0
      integer(bp), allocatable :: is_changed(:)
      !> Finest cells per metre, halved because bounds are summed for the centre [1/m]
      real(dp) :: half_scale = 0.5_dp
      !> Position of the origin [finest cells]
      real(dp) :: shift(2) = 0.0_dp
      !> Room for rounding in a reach [finest cells]
      real(dp) :: slack = 0.0_dp
      !> Whether all leaves are on the finest level (pruned tree)
      logical :: equal_leaves = .false.
   contains
      procedure :: start
      procedure :: insert
      procedure :: move
      procedure :: widen
      procedure :: settle
      procedure :: depth
      procedure :: bytes
   end type tree_t

contains

   !> Make an empty tree.
   subroutine start(self, n, finest, origin)
      class(tree_t), intent(inout) :: self
      !> Number of boxes to come
      integer(ip), intent(in) :: n
      !> Side of a cell of the finest level [m]
      real(dp), intent(in) :: finest
      !> A place amid the boxes [m]
      real(dp), intent(in) :: origin(2)
      real(dp), parameter :: off_border = 0.381966_dp

      call self%reserve(4_ip*n + 64_ip)
      allocate (self%leaf(n), self%next(n), self%cell(4, n), self%reach(n))
      allocate (self%changed(n), self%is_changed(n))
      self%leaf = 0_ip
      self%is_changed = 0_bp
      self%half_scale = 0.5_dp/finest
      self%shift = real(middle, dp) + off_border - origin/finest
      self%slack = 8.0_dp*epsilon(1.0_dp)*(maxval(abs(origin))/finest + 2.0_dp**top_level)
   end subroutine start

   !> Bring a box into the tree for the first time.
   subroutine insert(self, box, reach, bounds)
      class(tree_t), intent(inout) :: self
      !> Box to insert
      integer(ip), intent(in) :: box
      !> Its reach [m]
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

   !> Bring a box that may have left its leaf into the right one.
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

   !> Give a box a greater reach.
   subroutine widen(self, box, reach)
      class(tree_t), intent(inout) :: self
      !> Box that needs it
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
      call mark(self, box)
   end subroutine widen

   !> Forget which boxes changed.
   subroutine settle(self)
      class(tree_t), intent(inout) :: self
      integer(ip) :: k

      do k = 1_ip, self%n_changed
         self%is_changed(self%changed(k)) = 0_bp
      end do
      self%n_changed = 0_ip
   end subroutine settle

   !> Levels from the root to the lowest leaf, both counted
   integer(ip) function depth(self)
      class(tree_t), intent(in) :: self
      integer(ip) :: box

      depth = 0_ip
      if (self%root == 0_ip) return
      do box = 1_ip, size(self%leaf, kind=ip)
         depth = max(depth, self%node(self%root)%level - self%node(self%leaf(box))%level + 1_ip)
      end do
   end function depth

   !> Memory held [B]
   pure integer(lp) function bytes(self)
      class(tree_t), intent(in) :: self

      bytes = 0_lp
      if (.not. allocated(self%leaf)) return
      bytes = self%pool_bytes() + &
         (int(storage_size(self%leaf), lp)*3_lp*size(self%leaf, kind=lp) + &
          int(storage_size(self%is_changed), lp)*size(self%is_changed, kind=lp) + &
          int(storage_size(self%cell), lp)*5_lp*size(self%reach, kind=lp))/8_lp
   end function bytes

   !> Take a box down from a node that counts it already to its leaf, splitting an occupied one.
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
            call settle_in(self, child, resident)
         end if
         call find_child(self, node, at, child)
         call count_in(self%node(child), self%reach(box), self%ignored)
         node = child
      end do
      call settle_in(self, node, box)
   end subroutine descend

   !> Take a box out of its leaf and of all cells below an ancestor; free empty cells, merge cells left with
   !> one box.
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

   !> Make a node with a single box below it a leaf.
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
      call settle_in(self, top, below)
   end subroutine merge_cells

   !> Put a box into a leaf that counts it already, and note that it changed.
   subroutine settle_in(self, leaf, box)
      type(tree_t), intent(inout) :: self
      integer(ip), intent(in) :: leaf, box

      self%next(box) = self%node(leaf)%first
      self%node(leaf)%first = box
      self%leaf(box) = leaf
      self%cell(:, box) = cell_bounds(self%node(leaf), self%ignored)
      call mark(self, box)
   end subroutine settle_in

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

   subroutine mark(self, box)
      type(tree_t), intent(inout) :: self
      integer(ip), intent(in) :: box

      if (self%is_changed(box) /= 0_bp) return
      self%is_changed(box) = 1_bp
      self%n_changed = self%n_changed + 1_ip
      self%changed(self%n_changed) = box
   end subroutine mark

   !> Put a cell of twice the side above the root; a root with one box just becomes larger.
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
         call settle_in(self, old, box)
         return
      end if
      call self%new_node(0_ip, level, low, root)
      self%root = root
      self%node(self%root)%child(quadrant(level, self%node(old)%low)) = old
      self%node(self%root)%count = self%node(old)%count
      call set_reach(self%node(self%root), self%node(old)%reach, self%ignored)
      self%node(old)%parent = self%root
   end subroutine grow_root

   !> Child of a node at a place, made if there is none yet
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

   !> Find the greatest reach of a node again after its box with the greatest one left.
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

   !> Finest cell of the centre of a box; what is not a number lies in cell 0
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

   !> A reach in finest cells, enlarged so that rounding of places cannot hide a neighbour
   pure real(dp) function padded(self, reach)
      type(tree_t), intent(in) :: self
      real(dp), intent(in) :: reach

      padded = 2.0_dp*reach*self%half_scale*(1.0_dp + 1.0e-9_dp) + self%slack
   end function padded

end module polydem_quadtree_nodes
