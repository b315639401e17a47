!> Bodies that are in the way of grains: a list of convex polygons, and a grid of cells to find those near a point.
module polydem_obstacles
   use polydem_kinds, only: ip, wp
   use polydem_outlines, only: distance_to
   use polydem_polygon_list, only: polygon_list_t
   implicit none
   private
   public :: obstacles_t

   !> Greatest number of cells along an axis
   integer(ip), parameter :: most_cells = 2048_ip
   !> Share of the clearance by which a body may be nearer. It is above the rounding errors of coordinates, and below
   !> the play of loose grains
   real(wp), parameter :: rounding = 1.0e-5_wp

   !> Polygons that grains must not touch
   type :: obstacles_t
      !> All of them
      type(polygon_list_t) :: polygons
      !> Bounds xmin, ymin, xmax, ymax, (4, polygon); may be longer than needed [m]
      real(wp), allocatable, private :: bounds(:, :)
      !> Lower left corner of the grid, and side of a cell [m]
      real(wp), private :: low(2) = 0.0_wp, side = 1.0_wp
      !> Number of cells along both axes
      integer(ip), private :: cells(2) = 0_ip
      !> First link of each cell, 0 if it is empty, (cells(1), cells(2))
      integer(ip), allocatable, private :: first(:, :)
      !> Number of links
      integer(ip), private :: n_links = 0_ip
      !> Polygon of each link, and next link of its cell or 0, (2, link); may be longer than needed
      integer(ip), allocatable, private :: link(:, :)
   contains
      procedure :: start
      procedure :: add
      procedure :: leaves
   end type obstacles_t

contains

   !> Make a grid over a rectangle, without polygons.
   pure subroutine start(self, low, high, side)
      class(obstacles_t), intent(inout) :: self
      !> Corners of the rectangle, and side of a cell as far as there are not too many [m]
      real(wp), intent(in) :: low(2), high(2), side

      self%low = low
      self%side = max(side, maxval(high - low)/real(most_cells, wp))
      self%cells = 1_ip + int((high - low)/self%side, ip)
      allocate (self%first(self%cells(1), self%cells(2)), self%link(2, 64), self%bounds(4, 64))
      self%first = 0_ip
   end subroutine start

   !> Add a polygon.
   pure subroutine add(self, corners)
      class(obstacles_t), intent(inout) :: self
      !> Corners, clockwise or anticlockwise, (2, corner) [m]
      real(wp), intent(in) :: corners(:, :)
      real(wp), allocatable :: longer(:, :)

      call self%polygons%append_polygon(corners)
      associate (n => self%polygons%n)
         if (n > size(self%bounds, 2)) then
            allocate (longer(4, 2_ip*n))
            longer(:, :n - 1_ip) = self%bounds(:, :n - 1_ip)
            call move_alloc(longer, self%bounds)
         end if
         self%bounds(:, n) = [minval(corners, 2), maxval(corners, 2)]
         call link_polygon(self, n)
      end associate
   end subroutine add

   !> Add a polygon to the cells that its bounds meet.
   pure subroutine link_polygon(self, k)
      class(obstacles_t), intent(inout) :: self
      integer(ip), intent(in) :: k
      integer(ip), allocatable :: longer(:, :)
      integer(ip) :: from(2), to(2), i, j

      call find_cells(self, self%bounds(1:2, k), self%bounds(3:4, k), from, to)
      do j = from(2), to(2)
         do i = from(1), to(1)
            self%n_links = self%n_links + 1_ip
            if (self%n_links > size(self%link, 2)) then
               allocate (longer(2, 2_ip*self%n_links))
               longer(:, :self%n_links - 1_ip) = self%link(:, :self%n_links - 1_ip)
               call move_alloc(longer, self%link)
            end if
            self%link(:, self%n_links) = [k, self%first(i, j)]
            self%first(i, j) = self%n_links
         end do
      end do
   end subroutine link_polygon

   !> Find the cells that a rectangle meets; from > to if it is beside the grid.
   pure subroutine find_cells(self, low, high, from, to)
      class(obstacles_t), intent(in) :: self
      real(wp), intent(in) :: low(2), high(2)
      integer(ip), intent(out) :: from(2), to(2)

      ! Rectangles that touch the grid from outside belong to its first and last cells.
      from = 1_ip + int(max(0.0_wp, min((low - self%low)/self%side, real(self%cells, wp))), ip)
      to = 1_ip + int(max(-1.0_wp, min((high - self%low)/self%side, real(self%cells - 1_ip, wp))), ip)
      where (high < self%low) to = 0_ip
      where (from > self%cells) from = to + 1_ip
   end subroutine find_cells

   !> Whether all polygons leave room for a circle around a point of the grid
   pure logical function leaves(self, point, radius)
      class(obstacles_t), intent(in) :: self
      !> Centre and radius of the circle [m]
      real(wp), intent(in) :: point(2), radius
      integer(ip) :: from(2), to(2), i, j, l

      leaves = self%polygons%n == 0_ip
      if (leaves) return
      call find_cells(self, point - radius, point + radius, from, to)
      do j = from(2), to(2)
         do i = from(1), to(1)
            l = self%first(i, j)
            do while (l > 0_ip)
               if (is_near(self, self%link(1, l), point, (1.0_wp - rounding)*radius)) return
               l = self%link(2, l)
            end do
         end do
      end do
      leaves = .true.
   end function leaves

   !> Whether a polygon is nearer to a point than a distance
   pure logical function is_near(self, k, point, distance)
      class(obstacles_t), intent(in) :: self
      integer(ip), intent(in) :: k
      real(wp), intent(in) :: point(2), distance

      is_near = .false.
      if (any(point + distance < self%bounds(1:2, k)) .or. any(point - distance > self%bounds(3:4, k))) return
      associate (polygons => self%polygons)
         is_near = distance_to(polygons%vertex(:, polygons%first(k):polygons%first(k + 1_ip) - 1_ip), point) < distance
      end associate
   end function is_near

end module polydem_obstacles
