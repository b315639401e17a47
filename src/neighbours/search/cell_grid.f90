!> Layout of one grid of cells: region, cell size and number of cells.
!>
!> Boxes are binned by their lower corner. In a coarse grid no box is larger than a cell. The lower corners of two
!> overlapping boxes are then less than a cell apart on both axes, so their cells are the same or neighbours. This also
!> holds with rounding: the cell index is a monotonic function of the position, its error is below 2^-12 cells
!> (`most_columns`), and cells exceed the largest box by more than twice that error (`slack`).
!>
!> In a fine grid cells have the mean size of the boxes. The cells of the lower corners of two overlapping boxes are
!> then at most `reach` columns and rows apart. Fewer boxes are compared, in more ranges.
!>
!> The outermost cells extend to infinity: points outside the grid are moved to its border. The grid may therefore cover
!> only a part of the boxes. This is the case if a few distant boxes would require more than `most_cells` cells per box.
!>
!> Cells are numbered by rows. An empty cell follows each row, and a row of empty cells follows the last row. The search
!> can therefore access the neighbours of any cell without a test whether they exist.
module polydem_cell_grid
   use polydem_kinds, only: dp, ip, wp
   use polydem_sort_reals, only: sort_reals
   implicit none
   private
   public :: cell_grid_t, extent_t, measure, measure_levels, new_grid

   !> Largest number of cells per box
   integer(ip), parameter :: most_cells = 4_ip
   !> A grid leaves out distant boxes if covering them requires more than this multiple of the largest number of cells
   real(dp), parameter :: far_away = 16.0_dp
   !> Number of boxes in the sample from which the region of nearly all boxes is then estimated
   integer(ip), parameter :: sample_size = 512_ip
   !> Largest number of columns or rows; with it, rounding moves no point by 2^-12 cells
   real(wp), parameter :: most_columns = min(2.0_wp**(-13)/epsilon(1.0_wp), 2.0_wp**28)
   !> Relative excess of the cell size over the size of the largest box
   real(wp), parameter :: slack = 2.0_wp**(-10)

   !> Data of a set of boxes that determine the layout of their grid
   type :: extent_t
      !> Number of boxes
      integer(ip) :: n = 0_ip
      !> Smallest and largest coordinates of the lower corners [m]
      real(wp) :: low(2) = huge(1.0_wp), high(2) = -huge(1.0_wp)
      !> Largest and mean width and height of a box [m]
      real(wp) :: side(2) = 0.0_wp, mean(2) = 0.0_wp
   end type extent_t

   !> One grid
   type :: cell_grid_t
      !> Lower left and upper right corner of the region that is divided into cells [m]
      real(wp) :: low(2) = 0.0_wp, high(2) = 0.0_wp
      !> Cells per metre [1/m]
      real(wp) :: scale(2) = 0.0_wp
      !> Number of columns and rows
      integer(ip) :: columns = 1_ip, rows = 1_ip
      !> Number of cells of a row, including the empty cell behind it
      integer(ip) :: stride = 2_ip
      !> Largest distance of the cells of two overlapping boxes, in columns and rows
      integer(ip) :: reach(2) = 1_ip
      !> Number of the first cell minus one
      integer(ip) :: offset = 0_ip
      !> First and last index of the boxes of the grid in the order of cells
      integer(ip) :: first_box = 1_ip, last_box = 0_ip
   contains
      procedure :: n_cells
   end type cell_grid_t

contains

   !> Find the extent of the free boxes if all belong to one level.
   pure subroutine measure(n, bounds, level, extent)
      !> Number of boxes
      integer(ip), intent(in) :: n
      !> Bounds of the boxes, (4, n) [m]
      real(wp), intent(in) :: bounds(4, n)
      !> Level of each box: 1 (free) or 2 (fixed)
      integer(ip), intent(in) :: level(n)
      !> Extent of the free boxes (1); only the number of the fixed boxes (2)
      type(extent_t), intent(out) :: extent(2)
      real(wp) :: xlow, ylow, xhigh, yhigh, width, height, widths, heights
      integer(ip) :: i, n_free

      n_free = 0_ip
      xlow = huge(1.0_wp)
      ylow = huge(1.0_wp)
      xhigh = -huge(1.0_wp)
      yhigh = -huge(1.0_wp)
      width = 0.0_wp
      height = 0.0_wp
      widths = 0.0_wp
      heights = 0.0_wp
      do i = 1_ip, n
         if (level(i) /= 1_ip) cycle
         n_free = n_free + 1_ip
         xlow = min(xlow, bounds(1, i))
         ylow = min(ylow, bounds(2, i))
         xhigh = max(xhigh, bounds(1, i))
         yhigh = max(yhigh, bounds(2, i))
         width = max(width, bounds(3, i) - bounds(1, i))
         height = max(height, bounds(4, i) - bounds(2, i))
         widths = widths + (bounds(3, i) - bounds(1, i))
         heights = heights + (bounds(4, i) - bounds(2, i))
      end do
      extent(1) = extent_t(n_free, [xlow, ylow], [xhigh, yhigh], [width, height], &
                           [widths, heights]/real(max(n_free, 1_ip), wp))
      extent(2)%n = n - n_free
   end subroutine measure

   !> Find the extent of the boxes of each level.
   pure subroutine measure_levels(n, bounds, level, extent)
      !> Number of boxes
      integer(ip), intent(in) :: n
      !> Bounds of the boxes, (4, n) [m]
      real(wp), intent(in) :: bounds(4, n)
      !> Level of each box
      integer(ip), intent(in) :: level(n)
      !> Extent of the boxes of each level, (level)
      type(extent_t), intent(out) :: extent(:)
      integer(ip) :: i, l

      do i = 1_ip, n
         l = level(i)
         extent(l)%n = extent(l)%n + 1_ip
         extent(l)%low = min(extent(l)%low, bounds(1:2, i))
         extent(l)%high = max(extent(l)%high, bounds(1:2, i))
         extent(l)%side = max(extent(l)%side, bounds(3:4, i) - bounds(1:2, i))
         extent(l)%mean = extent(l)%mean + (bounds(3:4, i) - bounds(1:2, i))
      end do
      do l = 1, size(extent, kind=ip)
         extent(l)%mean = extent(l)%mean/real(max(extent(l)%n, 1_ip), wp)
      end do
   end subroutine measure_levels

   !> Lay out a grid.
   pure subroutine new_grid(self, extent, fine, corner, n, offset)
      !> Grid to make
      type(cell_grid_t), intent(out) :: self
      !> Extent of the boxes of the grid
      type(extent_t), intent(in) :: extent
      !> Whether cells have the mean size of the boxes instead of the largest
      logical, intent(in) :: fine
      !> Bounds of all boxes, (4, box) [m]
      real(wp), intent(in), contiguous :: corner(:, :)
      !> Number of all boxes
      integer(ip), intent(in) :: n
      !> Total number of cells of the grids before this one
      integer(ip), intent(in) :: offset
      real(wp) :: side(2), cells(2), span
      real(dp) :: most
      integer :: a

      self%offset = offset
      self%stride = 2_ip
      if (extent%n == 0_ip) return
      self%low = extent%low
      self%high = extent%high
      side = extent%side*(1.0_wp + slack)
      if (fine) side = min(side, max(extent%mean, 0.0_wp)*(1.0_wp + slack))
      most = real(most_cells, dp)*real(extent%n, dp) + 16.0_dp
      cells = cells_that_fit(self, side)
      if (real(cells(1), dp)*real(cells(2), dp) > far_away*most) then
         call leave_out_far_boxes(self, corner(:, 1:n))
         cells = cells_that_fit(self, side)
      end if
      call limit(cells, most)
      do a = 1, 2
         span = self%high(a) - self%low(a)
         if (cells(a) < 2.0_wp) cycle
         self%scale(a) = (cells(a) - 0.5_wp*slack)/span
         if (fine) self%reach(a) = 1_ip + int(min(extent%side(a)*self%scale(a)*(1.0_wp + slack) + slack, cells(a)), ip)
      end do
      self%columns = int(cells(1), ip)
      self%rows = int(cells(2), ip)
      self%stride = self%columns + 1_ip
   end subroutine new_grid

   !> Numbers of columns and rows of cells of a given size in the region of a grid, as whole real numbers
   pure function cells_that_fit(self, side) result(cells)
      type(cell_grid_t), intent(in) :: self
      real(wp), intent(in) :: side(2)
      real(wp) :: cells(2), span
      integer :: a

      do a = 1, 2
         span = self%high(a) - self%low(a)
         cells(a) = 1.0_wp
         ! One cell covers a length whose reciprocal could overflow.
         if (span < 2.0_wp**40*tiny(1.0_wp)) cycle
         if (span > most_columns*side(a)) then
            cells(a) = aint(most_columns)
         else
            cells(a) = max(1.0_wp, aint(span/side(a)))
         end if
      end do
   end function cells_that_fit

   !> Reduce the numbers of columns and rows to at most `most` cells.
   pure subroutine limit(cells, most)
      real(wp), intent(inout) :: cells(2)
      real(dp), intent(in) :: most
      integer :: longer

      if (real(cells(1), dp)*real(cells(2), dp) <= most) return
      longer = 1
      if (cells(2) > cells(1)) longer = 2
      cells(3 - longer) = min(cells(3 - longer), aint(real(sqrt(most), wp)))
      cells(longer) = min(cells(longer), aint(real(most/real(cells(3 - longer), dp), wp)))
   end subroutine limit

   !> Shrink the region of a grid to that of nearly all boxes: from the lowest to the highest 32-quantile of a sample,
   !> with a margin.
   pure subroutine leave_out_far_boxes(self, corner)
      type(cell_grid_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: corner(:, :)
      real(wp), allocatable :: sample(:)
      integer(ip), allocatable :: ranked(:)
      real(wp) :: low, high, margin
      integer(ip) :: n, tail
      integer :: a

      do a = 1, 2
         sample = corner(a, ::max(1, size(corner, 2)/sample_size))
         n = size(sample, kind=ip)
         allocate (ranked(n))
         call sort_reals(sample, ranked)
         tail = n/32_ip
         low = sample(ranked(1_ip + tail))
         high = sample(ranked(n - tail))
         margin = 0.125_wp*(high - low)
         self%low(a) = max(self%low(a), low - margin)
         self%high(a) = max(self%low(a), min(self%high(a), high + margin))
         deallocate (ranked)
      end do
   end subroutine leave_out_far_boxes

   !> Number of cells, including the empty cells behind each row and above the last row
   elemental integer(ip) function n_cells(self)
      class(cell_grid_t), intent(in) :: self

      n_cells = self%stride*(self%rows + 1_ip) + 1_ip
   end function n_cells

end module polydem_cell_grid
