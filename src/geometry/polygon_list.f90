!> A list of polygons, whose vertices lie one after the other in one array.
module polydem_polygon_list
   use polydem_grow, only: grow
   use polydem_kinds, only: ip, lp, wp
   implicit none
   private
   public :: polygon_list_t

   !> A growing list of polygons
   type :: polygon_list_t
      !> Number of polygons
      integer(ip) :: n = 0_ip
      !> First vertex of each polygon, and one past the last vertex of the last one; may be longer than n + 1
      integer(ip), allocatable :: first(:)
      !> Vertices of all polygons, (2, vertex) [m]; may be longer than needed
      real(wp), allocatable :: vertex(:, :)
   contains
      procedure :: reserve
      procedure :: append_polygon
      procedure :: polygon
   end type polygon_list_t

contains

   !> Make room for polygons. Pages of memory beyond their last vertex remain unused.
   pure subroutine reserve(self, n, n_vertices)
      class(polygon_list_t), intent(inout) :: self
      !> Number of polygons in all
      integer(ip), intent(in) :: n
      !> Number of their vertices
      integer(lp), intent(in) :: n_vertices

      if (.not. allocated(self%first)) then
         allocate (self%first(n + 1_ip), self%vertex(2, n_vertices))
         self%first(1) = 1_ip
      end if
      if (n >= size(self%first)) call grow(self%first, self%n + 1_ip, n + 1_ip)
      if (n_vertices > size(self%vertex, 2, kind=lp)) &
         call grow(self%vertex, self%first(self%n + 1_ip) - 1_ip, int(n_vertices, ip))
   end subroutine reserve

   !> Append a polygon.
   pure subroutine append_polygon(self, vertices)
      class(polygon_list_t), intent(inout) :: self
      !> Its vertices, (2, n) [m]
      real(wp), intent(in) :: vertices(:, :)
      integer(ip) :: behind, first

      if (.not. allocated(self%first)) call self%reserve(64_ip, 512_lp)
      first = self%first(self%n + 1_ip)
      behind = first + size(vertices, 2, kind=ip)
      if (self%n + 1_ip == size(self%first)) call self%reserve(2_ip*self%n, 0_lp)
      if (behind - 1_ip > size(self%vertex, 2)) call self%reserve(0_ip, 2_lp*int(behind, lp))
      self%vertex(:, first:behind - 1_ip) = vertices
      self%n = self%n + 1_ip
      self%first(self%n + 1_ip) = behind
   end subroutine append_polygon

   !> Vertices of a polygon, (2, vertex) [m]
   pure function polygon(self, k) result(vertices)
      class(polygon_list_t), intent(in) :: self
      !> Its number in the list
      integer(ip), intent(in) :: k
      real(wp), allocatable :: vertices(:, :)

      vertices = self%vertex(:, self%first(k):self%first(k + 1_ip) - 1_ip)
   end function polygon

end module polydem_polygon_list
