!> Boxes in cells (`polydem_cell_grids`), and the search for the boxes in a window. It finds late insertions
!> (`polydem_late_insertions`) in addition: fixed boxes, and boxes that changed after they were binned.
module polydem_grid_query
   use polydem_cell_grid, only: cell_grid_t
   use polydem_cell_grids, only: cell_grids_t, column, row
   use polydem_late_insertions, only: cell_block_t, late_insertions_t
   use polydem_index_list, only: index_list_t
   use polydem_kinds, only: ip, lp, wp
   implicit none
   private
   public :: grid_query_t

   !> Grids with late insertions
   type, extends(cell_grids_t) :: grid_query_t
      !> Boxes registered in cells after the sort
      type(late_insertions_t) :: late
   contains
      procedure :: receive_fixed
      procedure :: add_late
      procedure :: search_window
      procedure :: search_late
      procedure :: bytes
   end type grid_query_t

contains

   !> Remove all late insertions, and insert all fixed boxes, after `build`.
   pure subroutine receive_fixed(self, bounds)
      class(grid_query_t), intent(inout) :: self
      !> Bounds of the boxes, (4, box) [m]
      real(wp), intent(in), contiguous :: bounds(:, :)
      integer(ip) :: k

      call self%late%clear(self%n_cells)
      do k = self%grid(self%n_levels + 1)%first_box, self%grid(self%n_levels + 1)%last_box
         call self%add_late(self%order%box(k), bounds(:, self%order%box(k)))
      end do
   end subroutine receive_fixed

   !> Register a box in the cells of its grid that it covers, a fixed box in the coarsest grid.
   pure subroutine add_late(self, i, bounds)
      class(grid_query_t), intent(inout) :: self
      !> Box
      integer(ip), intent(in) :: i
      !> Its bounds xmin, ymin, xmax, ymax [m]
      real(wp), intent(in) :: bounds(4)

      call self%late%add(i, cells_of(self%grid(min(self%level(i), int(self%n_levels, ip))), bounds))
   end subroutine add_late

   !> Cells that a window covers; none if its bounds are not numbers
   pure type(cell_block_t) function cells_of(grid, window)
      type(cell_grid_t), intent(in) :: grid
      real(wp), intent(in) :: window(4)
      integer(ip) :: left, low

      left = max(column(grid, window(1)), 0_ip)
      low = max(row(grid, window(2)), 0_ip)
      cells_of = cell_block_t(grid%offset + low*grid%stride + left + 1_ip, column(grid, window(3)) - left + 1_ip, &
                              row(grid, window(4)) - low + 1_ip, grid%stride)
   end function cells_of

   !> List the late insertions that overlap a window.
   pure subroutine search_late(self, window, bounds, near)
      class(grid_query_t), intent(inout) :: self
      !> Bounds xmin, ymin, xmax, ymax of the window [m]
      real(wp), intent(in) :: window(4)
      !> Present bounds of the boxes, (4, box) [m]
      real(wp), intent(in), contiguous :: bounds(:, :)
      !> List to which the boxes are appended; a box can be appended several times
      type(index_list_t), intent(inout) :: near
      integer :: l

      do l = 1, self%n_levels
         call self%late%append_near(cells_of(self%grid(l), window), window, bounds, near, self%total%tests)
      end do
      call self%late%append_wide(window, bounds, near, self%total%tests)
   end subroutine search_late

   !> List the boxes that were not fixed and overlapped a window when they were binned.
   subroutine search_window(self, window, near)
      class(grid_query_t), intent(inout) :: self
      !> Bounds xmin, ymin, xmax, ymax of the window [m]
      real(wp), intent(in) :: window(4)
      !> List to which the boxes are appended
      type(index_list_t), intent(inout) :: near
      integer(ip) :: j, r, left, right, from, to
      integer :: l

      do l = 1, self%n_levels
         associate (grid => self%grid(l))
            if (grid%last_box < grid%first_box) cycle
            left = max(column(grid, window(1)) - grid%reach(1), 0_ip)
            right = column(grid, window(3))
            do r = max(row(grid, window(2)) - grid%reach(2), 0_ip), row(grid, window(4))
               from = self%first(grid%offset + r*grid%stride + left + 1_ip)
               to = self%first(grid%offset + r*grid%stride + right + 2_ip) - 1_ip
               self%total%visits = self%total%visits + int(right - left + 1_ip, lp)
               self%total%tests = self%total%tests + int(to - from + 1_ip, lp)
               do j = from, to
                  if (min(min(self%order%xmax(j) - window(1), window(3) - self%order%xmin(j)), &
                          min(self%order%ymax(j) - window(2), window(4) - self%order%ymin(j))) >= 0.0_wp) &
                     call near%push(self%order%box(j))
               end do
            end do
         end associate
      end do
      self%total%searches = self%total%searches + 1_lp
   end subroutine search_window

   !> Allocated memory [B]
   pure integer(lp) function bytes(self)
      class(grid_query_t), intent(in) :: self

      bytes = self%cell_grids_t%bytes() + self%late%bytes()
   end function bytes

end module polydem_grid_query
