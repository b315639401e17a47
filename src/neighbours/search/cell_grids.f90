!> Boxes binned into the cells of one or several grids, and the search for overlapping pairs in these cells.
!>
!> Each free box belongs to one grid, its level; finer grids come first. With one grid this is the method of linked
!> cells (Quentrec & Brot 1973; Hockney & Eastwood 1981), with several grids the hierarchical grid (Krijgsman, Ogarko &
!> Luding 2014). Instead of linked lists, a counting sort orders the boxes by cell, grid after grid. Copies of their
!> bounds are stored in that order, one array for each bound. Boxes of neighbouring cells of a row are then adjacent in
!> memory, and the search for the partners of a box runs over plain ranges:
!>
!>     in its own grid        the boxes behind it in its cell, the boxes of the next cell of the row, and those of three
!>                            cells of the row above. Every pair of cells is visited from one side only. In a fine grid:
!>                            the boxes behind it in the cells of its row that it covers, and the cells that it covers
!>                            in the rows above, with `reach` more cells to the left.
!>     in each coarser grid   the cells that the box covers, and `reach` more cells to the left and below, because boxes
!>                            are binned by their lower corner
!>
!> Fixed boxes are few and often large (walls). They belong to no cell, so they do not enlarge the cells, and are stored
!> behind all grids. The search for the partners of a fixed box covers all grids; other boxes do not search for fixed
!> boxes.
module polydem_cell_grids
   use omp_lib, only: omp_get_max_threads
   use polydem_box_pairs, only: found_pairs_t
   use polydem_boxes, only: boxes_t
   use polydem_cell_grid, only: cell_grid_t, extent_t, measure, measure_levels, new_grid
   use polydem_cell_order, only: cell_order_t
   use polydem_kinds, only: ip, lp, wp, min_parallel_size
   use polydem_thread_changes, only: part
   implicit none
   private
   public :: cell_grids_t, column, row

   !> Counts of one thread
   type :: tally_t
      !> Number of comparisons of two boxes
      integer(lp) :: tests = 0_lp
      !> Number of visited cells
      integer(lp) :: visits = 0_lp
      !> Number of searches of a box in a grid
      integer(lp) :: searches = 0_lp
   end type tally_t

   !> Grids with their boxes in the order of cells
   type :: cell_grids_t
      !> Whether cells have the mean size of the boxes of their grid instead of the largest; set before `build`
      logical :: fine = .false.
      !> Number of grids
      integer :: n_levels = 0
      !> Grid of each box, (box); n_levels + 1 if the box is fixed
      integer(ip), allocatable :: level(:)
      !> Grids, (level), the finest first; the last grid has one cell, for the fixed boxes
      type(cell_grid_t), allocatable :: grid(:)
      !> Extents of the boxes from which the grids are laid out, (level)
      type(extent_t), allocatable :: extent(:)
      !> Index of the first box of each cell, (cell), for all grids one after the other
      integer(ip), allocatable :: first(:)
      !> Number of cells, including empty cells at borders
      integer(ip) :: n_cells = 0_ip
      !> Boxes in the order of cells
      type(cell_order_t) :: order
      !> Cell of each box, (box)
      integer(ip), allocatable, private :: cell_of(:)
      !> Pairs of each thread in the last search, (thread); those of a search for one box are adjacent, this box first
      type(found_pairs_t), allocatable :: found(:)
      !> Counts summed over all searches
      type(tally_t) :: total
   contains
      procedure :: set_levels
      procedure :: build
      procedure :: search
      procedure :: bytes
   end type cell_grids_t

contains

   !> Assign each box to a grid.
   subroutine set_levels(self, n_levels, level, fixed)
      class(cell_grids_t), intent(inout) :: self
      !> Number of grids
      integer, intent(in) :: n_levels
      !> Grid of each box, (box); 1 is the finest
      integer(ip), intent(in) :: level(:)
      !> Whether each box is fixed, (box); a fixed box is in no grid
      logical, intent(in) :: fixed(:)

      self%n_levels = n_levels
      self%level = merge(int(n_levels, ip) + 1_ip, level, fixed)
      if (allocated(self%grid)) deallocate (self%grid, self%extent)
      allocate (self%grid(n_levels + 1), self%extent(n_levels + 1))
   end subroutine set_levels

   !> Lay out the grids and bin the boxes.
   subroutine build(self, n, bounds)
      class(cell_grids_t), intent(inout) :: self
      !> Number of boxes
      integer(ip), intent(in) :: n
      !> Bounds of the boxes, (4, box) [m]
      real(wp), intent(in), contiguous :: bounds(:, :)
      integer(ip) :: place
      integer :: l

      call reserve_boxes(self, n)
      if (self%n_levels == 1) then
         call measure(n, bounds, self%level, self%extent)
      else
         call measure_levels(n, bounds, self%level, self%extent)
      end if
      self%n_cells = 0_ip
      place = 1_ip
      do l = 1, self%n_levels + 1
         if (l <= self%n_levels) then
            call new_grid(self%grid(l), self%extent(l), self%fine, bounds, n, self%n_cells)
         else
            self%grid(l) = cell_grid_t(offset=self%n_cells)
         end if
         self%grid(l)%first_box = place
         self%grid(l)%last_box = place + self%extent(l)%n - 1_ip
         place = self%grid(l)%last_box + 1_ip
         self%n_cells = self%n_cells + self%grid(l)%n_cells()
      end do
      call reserve_cells(self, self%n_cells + 2_ip)
      call find_cells(n, bounds, self%grid, self%level, self%cell_of)
      call self%order%sort(n, self%n_cells, bounds, self%cell_of, self%first)
   end subroutine build

   !> Column of a point, from 0
   elemental integer(ip) function column(grid, x)
      type(cell_grid_t), intent(in) :: grid
      !> Coordinate of the point [m]
      real(wp), intent(in) :: x

      column = int((min(max(x, grid%low(1)), grid%high(1)) - grid%low(1))*grid%scale(1), ip)
   end function column

   !> Row of a point, from 0
   elemental integer(ip) function row(grid, y)
      type(cell_grid_t), intent(in) :: grid
      !> Coordinate of the point [m]
      real(wp), intent(in) :: y

      row = int((min(max(y, grid%low(2)), grid%high(2)) - grid%low(2))*grid%scale(2), ip)
   end function row

   !> Find the cell of each box.
   pure subroutine find_cells(n, bounds, grid, level, cell_of)
      integer(ip), intent(in) :: n
      real(wp), intent(in) :: bounds(4, n)
      type(cell_grid_t), intent(in) :: grid(:)
      integer(ip), intent(in) :: level(n)
      integer(ip), intent(out) :: cell_of(n)
      integer(ip) :: i

      do i = 1_ip, n
         associate (g => grid(level(i)))
            cell_of(i) = g%offset + row(g, bounds(2, i))*g%stride + column(g, bounds(1, i)) + 1_ip
         end associate
      end do
   end subroutine find_cells

   !> Find all overlapping pairs of boxes of different bodies that are not both passive.
   subroutine search(self, boxes)
      class(cell_grids_t), intent(inout) :: self
      !> Boxes; only their bodies, and whether the bodies are passive, are used
      type(boxes_t), intent(in) :: boxes
      type(tally_t), allocatable :: tally(:)
      logical :: all_valid
      integer :: w

      ! Fixed boxes do not find each other.
      all_valid = boxes%one_to_one .and. all(boxes%passive(1:boxes%n) .eqv. boxes%fixed(1:boxes%n))
      if (allocated(self%found)) then
         if (size(self%found) /= omp_get_max_threads()) deallocate (self%found)
      end if
      if (.not. allocated(self%found)) allocate (self%found(omp_get_max_threads()))
      allocate (tally(size(self%found)))
      !$omp parallel do if (boxes%n > min_parallel_size) schedule(static, 1) default(none) &
      !$omp    shared(self, boxes, tally, all_valid) private(w)
      do w = 1, size(self%found)
         call search_part(self, w, size(self%found), self%found(w), tally(w))
         if (.not. all_valid) call self%found(w)%remove_invalid_pairs(boxes)
      end do
      !$omp end parallel do
      self%total%tests = self%total%tests + sum(tally%tests)
      self%total%visits = self%total%visits + sum(tally%visits)
      self%total%searches = self%total%searches + sum(tally%searches)
   end subroutine search

   !> Search for the partners of the boxes in part w of each level.
   subroutine search_part(self, w, m, found, tally)
      class(cell_grids_t), intent(in) :: self
      integer, intent(in) :: w, m
      type(found_pairs_t), intent(inout) :: found
      type(tally_t), intent(inout) :: tally
      type(found_pairs_t) :: mine
      type(tally_t) :: my_tally
      integer(ip) :: low, high, k
      integer :: l, other

      ! The local variables are on the stack of the thread. Those of other threads would be on the same cache lines.
      call move_alloc(found%box, mine%box)
      call mine%reserve(64_ip)
      do l = 1, self%n_levels + 1
         call part_of_level(self%grid(l), m, w, low, high)
         do k = low, high
            if (l <= self%n_levels .and. self%fine) then
               call search_fine_grid(self, self%grid(l), k, mine, my_tally)
            else if (l <= self%n_levels) then
               call search_own_grid(self, self%grid(l), k, mine, my_tally)
            end if
            do other = merge(1, l + 1, l > self%n_levels), self%n_levels
               call search_other_grid(self, self%grid(other), k, mine, my_tally)
            end do
         end do
      end do
      call move_alloc(mine%box, found%box)
      found%n = mine%n
      tally = my_tally
   end subroutine search_part

   !> Part w of m of the boxes of a level
   pure subroutine part_of_level(grid, m, w, low, high)
      type(cell_grid_t), intent(in) :: grid
      integer, intent(in) :: m, w
      integer(ip), intent(out) :: low, high

      call part(grid%last_box - grid%first_box + 1_ip, m, w, low, high)
      low = grid%first_box + low - 1_ip
      high = grid%first_box + high - 1_ip
   end subroutine part_of_level

   !> Compare a box with later boxes of its own grid.
   subroutine search_own_grid(self, grid, k, found, tally)
      type(cell_grids_t), intent(in) :: self
      type(cell_grid_t), intent(in) :: grid
      !> Index of the box in the order of cells
      integer(ip), intent(in) :: k
      type(found_pairs_t), intent(inout) :: found
      type(tally_t), intent(inout) :: tally
      integer(ip) :: cell, beside, from, to, more

      cell = self%order%cell(k)
      beside = self%first(cell + 2_ip) - 1_ip
      from = self%first(cell + grid%stride - 1_ip)
      to = self%first(cell + grid%stride + 2_ip) - 1_ip
      more = (beside - k) + (to - from + 1_ip)
      if (size(found%box, 2) < found%n + more + 1_ip) call found%reserve(more + 1_ip)
      call self%order%compare(k, k + 1_ip, beside, found%n, found%box)
      call self%order%compare(k, from, to, found%n, found%box)
      tally%tests = tally%tests + int(more, lp)
      tally%visits = tally%visits + 5_lp
      tally%searches = tally%searches + 1_lp
   end subroutine search_own_grid

   !> Compare a box with later boxes of its own fine grid.
   subroutine search_fine_grid(self, grid, k, found, tally)
      type(cell_grids_t), intent(in) :: self
      type(cell_grid_t), intent(in) :: grid
      !> Index of the box in the order of cells
      integer(ip), intent(in) :: k
      type(found_pairs_t), intent(inout) :: found
      type(tally_t), intent(inout) :: tally
      integer(ip) :: before, left, right, low, r, from, to

      low = row(grid, self%order%ymin(k))
      before = grid%offset + low*grid%stride
      left = max(self%order%cell(k) - before - grid%reach(1), 1_ip)
      right = max(column(grid, self%order%xmax(k)) + 1_ip, self%order%cell(k) - before)
      from = k + 1_ip
      do r = low, row(grid, self%order%ymax(k))
         to = self%first(before + right + 1_ip) - 1_ip
         if (size(found%box, 2) < found%n + to - from + 2_ip) call found%reserve(to - from + 2_ip)
         call self%order%compare(k, from, to, found%n, found%box)
         tally%tests = tally%tests + int(max(to - from + 1_ip, 0_ip), lp)
         tally%visits = tally%visits + int(right - left + 1_ip, lp)
         before = before + grid%stride
         from = self%first(before + left)
      end do
      tally%searches = tally%searches + 1_lp
   end subroutine search_fine_grid

   !> Compare a box with the boxes of another grid.
   subroutine search_other_grid(self, grid, k, found, tally)
      type(cell_grids_t), intent(in) :: self
      type(cell_grid_t), intent(in) :: grid
      !> Index of the box in the order of cells
      integer(ip), intent(in) :: k
      type(found_pairs_t), intent(inout) :: found
      type(tally_t), intent(inout) :: tally
      integer(ip) :: r, left, right, from, to

      if (grid%last_box < grid%first_box) return
      left = max(column(grid, self%order%xmin(k)) - grid%reach(1), 0_ip)
      right = column(grid, self%order%xmax(k))
      do r = max(row(grid, self%order%ymin(k)) - grid%reach(2), 0_ip), row(grid, self%order%ymax(k))
         from = self%first(grid%offset + r*grid%stride + left + 1_ip)
         to = self%first(grid%offset + r*grid%stride + right + 2_ip) - 1_ip
         tally%visits = tally%visits + int(right - left + 1_ip, lp)
         if (to < from) cycle
         tally%tests = tally%tests + int(to - from + 1_ip, lp)
         if (size(found%box, 2) < found%n + to - from + 2_ip) call found%reserve(to - from + 2_ip)
         call self%order%compare(k, from, to, found%n, found%box)
      end do
      tally%searches = tally%searches + 1_lp
   end subroutine search_other_grid

   !> Allocate the arrays over boxes.
   subroutine reserve_boxes(self, n)
      type(cell_grids_t), intent(inout) :: self
      integer(ip), intent(in) :: n

      call self%order%reserve(n)
      if (allocated(self%cell_of)) then
         if (size(self%cell_of) == n) return
         deallocate (self%cell_of)
      end if
      allocate (self%cell_of(n))
   end subroutine reserve_boxes

   !> Allocate the array over cells.
   subroutine reserve_cells(self, n)
      type(cell_grids_t), intent(inout) :: self
      integer(ip), intent(in) :: n

      if (allocated(self%first)) then
         if (size(self%first) >= n) return
         deallocate (self%first)
      end if
      allocate (self%first(n + n/8_ip))
   end subroutine reserve_cells

   !> Allocated memory [B]
   pure integer(lp) function bytes(self)
      class(cell_grids_t), intent(in) :: self
      integer :: w

      bytes = 0_lp
      if (.not. allocated(self%cell_of)) return
      bytes = self%order%bytes() + &
         int(storage_size(self%first)/8, lp)*(2_lp*size(self%cell_of, kind=lp) + size(self%first, kind=lp))
      do w = 1, size(self%found)
         if (allocated(self%found(w)%box)) bytes = bytes + int(storage_size(self%found(w)%box)/8, lp)* &
            size(self%found(w)%box, kind=lp)
      end do
   end function bytes

end module polydem_cell_grids
