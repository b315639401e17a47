!> The nodes of a tree in one array: those in use, and a list of free ones that are used again.
module polydem_quadtree_pool
   use polydem_kinds, only: dp, ip, lp
   use polydem_quadtree_cells, only: node_t, set_reach
   implicit none
   private
   public :: node_pool_t

   !> Nodes, used and free
   type :: node_pool_t
      !> All nodes; a tree names them by their place
      type(node_t), allocatable :: node(:)
      !> Nodes in use
      integer(ip) :: n_nodes = 0_ip
      !> Axis along which all cells are endless (binary tree); 0: none
      integer :: ignored = 0
      !> First free node, 0: none
      integer(ip), private :: free = 0_ip
      !> Nodes that were ever in use
      integer(ip), private :: n_touched = 0_ip
   contains
      procedure :: reserve
      procedure :: new_node
      procedure :: free_node
      procedure :: pool_bytes
   end type node_pool_t

contains

   !> Make room for some nodes; none is in use.
   subroutine reserve(self, n)
      class(node_pool_t), intent(inout) :: self
      !> Number of nodes, at least 1; more get room when they come
      integer(ip), intent(in) :: n

      allocate (self%node(n))
   end subroutine reserve

   !> Take a node that holds no box yet.
   subroutine new_node(self, parent, level, low, node)
      class(node_pool_t), intent(inout) :: self
      !> Its parent, 0 for a root
      integer(ip), intent(in) :: parent
      !> Its level
      integer(ip), intent(in) :: level
      !> Its lower left finest cell
      integer(ip), intent(in) :: low(2)
      !> Its place
      integer(ip), intent(out) :: node
      type(node_t), allocatable :: longer(:)

      if (self%free /= 0_ip) then
         node = self%free
         self%free = self%node(node)%parent
      else
         if (self%n_touched == size(self%node)) then
            allocate (longer(2*size(self%node)))
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

   !> Give a node back.
   subroutine free_node(self, node)
      class(node_pool_t), intent(inout) :: self
      !> Its place
      integer(ip), intent(in) :: node

      self%node(node)%parent = self%free
      self%free = node
      self%n_nodes = self%n_nodes - 1_ip
   end subroutine free_node

   !> Memory held [B]
   pure integer(lp) function pool_bytes(self)
      class(node_pool_t), intent(in) :: self

      pool_bytes = 0_lp
      if (allocated(self%node)) pool_bytes = int(storage_size(self%node), lp)*size(self%node, kind=lp)/8_lp
   end function pool_bytes

end module polydem_quadtree_pool
