!> Memory pool of the nodes of a tree: one array with the nodes in use and a list of free nodes for reuse.
module polydem_quadtree_pool
   use polydem_kinds, only: dp, ip, lp
   use polydem_quadtree_cells, only: node_t, set_reach
   implicit none
   private
   public :: node_pool_t

   !> Used and free nodes
   type :: node_pool_t
      !> All nodes, (node); the tree refers to a node by its index
      type(node_t), allocatable :: node(:)
      !> Number of nodes in use
      integer(ip) :: n_nodes = 0_ip
      !> Axis along which all cells are unbounded (binary tree); 0: none
      integer :: ignored = 0
      !> First free node, 0: none
      integer(ip), private :: free = 0_ip
      !> Number of nodes that have ever been in use
      integer(ip), private :: n_touched = 0_ip
   contains
      procedure :: reserve
      procedure :: new_node
      procedure :: free_node
      procedure :: pool_bytes
   end type node_pool_t

contains

   !> Allocate memory for nodes; none is in use.
   subroutine reserve(self, n)
      class(node_pool_t), intent(inout) :: self
      !> Number of nodes, at least 1; the pool grows if it needs more
      integer(ip), intent(in) :: n

      allocate (self%node(n))
   end subroutine reserve

   !> Take a node without boxes from the pool.
   subroutine new_node(self, parent, level, low, node)
      class(node_pool_t), intent(inout) :: self
      !> Parent of the node, 0 for a root
      integer(ip), intent(in) :: parent
      !> Level of the node
      integer(ip), intent(in) :: level
      !> Finest cell at the lower left corner of the node
      integer(ip), intent(in) :: low(2)
      !> Index of the node
      integer(ip), intent(out) :: node
      type(node_t), allocatable :: longer(:)

      if (self%free /= 0_ip) then
         node = self%free
         self%free = self%node(node)%parent
      else
         if (self%n_touched == size(self%node)) then
            allocate (longer(size(self%node) + size(self%node)/2))
            longer(1:self%n_touched) = self%node
            call move_alloc(longer, self%node)
         end if
         self%n_touched = self%n_touched + 1_ip
         node = self%n_touched
      end if
      self%n_nodes = self%n_nodes + 1_ip
      self%node(node)%child = 0_ip
      self%node(node)%parent = parent
      self%node(node)%level = level
      self%node(node)%count = 0_ip
      self%node(node)%first = 0_ip
      self%node(node)%low = low
      call set_reach(self%node(node), 0.0_dp, self%ignored)
   end subroutine new_node

   !> Return a node to the pool.
   subroutine free_node(self, node)
      class(node_pool_t), intent(inout) :: self
      !> Index of the node
      integer(ip), intent(in) :: node

      self%node(node)%parent = self%free
      self%free = node
      self%n_nodes = self%n_nodes - 1_ip
   end subroutine free_node

   !> Allocated memory [B]
   pure integer(lp) function pool_bytes(self)
      class(node_pool_t), intent(in) :: self

      pool_bytes = 0_lp
      if (allocated(self%node)) pool_bytes = int(storage_size(self%node), lp)*size(self%node, kind=lp)/8_lp
   end function pool_bytes

end module polydem_quadtree_pool
