!> Fills a convex region with convex blocks: the Voronoi cells of random points, each made smaller by half a gap.
!>
!> The cell of a point is what is nearer to it than to any other point. It is cut from the region by the half planes
!> between the point and those around it, ring by ring of a grid, until no farther point can cut it. In a step of Lloyd
!> (IEEE Trans. Inf. Theory 28 (1982) 129) all points move to the centroids of their cells, which become more alike.
module polydem_voronoi
   use polydem_elementary, only: hypotenuse
   use polydem_grain_list, only: grain_t, grains_t
   use polydem_kinds, only: ip, lp, wp
   use polydem_outlines, only: contains_point, inner_circle, inner_circle_t
   use polydem_polygon, only: mass_properties
   use polydem_polygon_list, only: polygon_list_t
   use polydem_random, only: random_t
   use polydem_settings, only: grains_settings_t
   use polydem_strings, only: to_text
   use polydem_wall_outlines, only: problem_t
   implicit none
   private
   public :: cut_blocks

   !> Edges shorter than this, over the square root of the mean area of a cell, are left out
   real(wp), parameter :: shortest_edge = 0.01_wp
   !> Least area of a block over the mean area of a cell
   real(wp), parameter :: least_block = 1.0e-3_wp
   !> Number of halvings in the search of a gap
   integer, parameter :: n_halvings = 40

   !> Points in square cells of a grid
   type :: grid_t
      !> Lower left corner, and side of a cell [m]
      real(wp) :: low(2) = 0.0_wp, side = 0.0_wp
      !> Number of cells along x and y
      integer(ip) :: n(2) = 0_ip
      !> First point of each cell in `point`, and one past the last one
      integer(ip), allocatable :: first(:)
      !> Numbers of the points, cell by cell
      integer(ip), allocatable :: point(:)
   end type grid_t

contains

   !> Cut a region into as many blocks as the group has grains.
   subroutine cut_blocks(region, area, group, random, grains, centres, problem)
      !> Corners of the region, convex, anticlockwise, (2, corner) [m]; its area [m2]
      real(wp), intent(in) :: region(:, :), area
      !> Number of blocks, steps of Lloyd, gap or solid fraction
      type(grains_settings_t), intent(in) :: group
      type(random_t), intent(inout) :: random
      !> The blocks
      type(grains_t), intent(out) :: grains
      !> Their centroids, (2, block) [m]
      real(wp), intent(out) :: centres(:, :)
      !> Its text is allocated if a block would vanish, or the fraction cannot be reached
      type(problem_t), intent(inout) :: problem
      type(polygon_list_t) :: cells, blocks
      real(wp), allocatable :: points(:, :)
      real(wp) :: mean, gap
      integer(ip) :: k
      integer :: step

      mean = area/real(group%number, wp)
      allocate (points(2, group%number))
      call draw_points(region, random, points)
      do step = 0, group%lloyd_steps
         call find_cells(region, mean, points, cells)
         if (step == group%lloyd_steps) exit
         do k = 1_ip, cells%n
            points(:, k) = centroid_of(cells%polygon(k))
         end do
      end do
      call choose_gap(group, area, mean, cells, gap, problem)
      if (allocated(problem%text)) return
      call shrink(cells, mean, gap, blocks)
      call grains%start(blocks%n, maxval(blocks%first(2:blocks%n + 1_ip) - blocks%first(:blocks%n)))
      do k = 1_ip, blocks%n
         call append_block(blocks%polygon(k), grains, centres(:, k))
      end do
   end subroutine cut_blocks

   !> Append a block with its corners relative to its centroid.
   subroutine append_block(corners, grains, centre)
      real(wp), intent(in) :: corners(:, :)
      type(grains_t), intent(inout) :: grains
      !> Its centroid [m]
      real(wp), intent(out) :: centre(2)
      type(grain_t) :: grain
      real(wp) :: moment

      call mass_properties(corners, grain%area, centre, moment)
      grain%corners = corners - spread(centre, 2, size(corners, 2))
      grain%length = 2.0_wp*maxval(hypotenuse(grain%corners(1, :), grain%corners(2, :)))
      call grains%append(grain)
   end subroutine append_block

   !> Draw points that are uniformly distributed over the region.
   subroutine draw_points(region, random, points)
      real(wp), intent(in) :: region(:, :)
      type(random_t), intent(inout) :: random
      real(wp), intent(out) :: points(:, :)
      type(inner_circle_t) :: circle
      real(wp) :: low(2), high(2)
      integer :: k

      circle = inner_circle(region)
      low = minval(region, 2)
      high = maxval(region, 2)
      do k = 1, size(points, 2)
         do
            points(1, k) = random%between(low(1), high(1))
            points(2, k) = random%between(low(2), high(2))
            if (contains_point(region, circle, points(:, k), 0.0_wp)) exit
         end do
      end do
   end subroutine draw_points

   !> Find the gap between the blocks: the given one, or that with which they cover the given fraction of the region.
   subroutine choose_gap(group, area, mean, cells, gap, problem)
      type(grains_settings_t), intent(in) :: group
      real(wp), intent(in) :: area, mean
      type(polygon_list_t), intent(in) :: cells
      real(wp), intent(out) :: gap
      type(problem_t), intent(inout) :: problem
      real(wp) :: narrowest, most, covered

      ! Without a gap neighbours would touch, and overlap by rounding errors.
      narrowest = 1.0e-6_wp*sqrt(mean)
      most = area_of_blocks(cells, mean, narrowest)/area
      gap = group%gap
      if (.not. most > 0.0_wp) then
         problem%key = 'number'
         problem%text = 'makes blocks that are too small to be cut; give lloyd_steps = 2, which makes them more alike'
      else if (group%gap > 0.0_wp) then
         if (area_of_blocks(cells, mean, group%gap) > 0.0_wp) return
         gap = widest_gap(cells, mean, narrowest, 0.0_wp)
         problem%key = 'gap'
         problem%text = 'of '//to_text(group%gap, 3)//' m leaves nothing of the smallest block; lower it to '// &
            to_text(0.9_wp*gap, 2)//', or give more lloyd_steps, which make the blocks more alike'
      else if (group%solid_fraction > most) then
         problem%key = 'solid_fraction'
         problem%text = 'cannot be reached without overlap: the blocks cover at most '//to_text(most, 4)// &
            ' of the region; lower it to '//to_text(0.99_wp*most, 3)
      else
         gap = widest_gap(cells, mean, narrowest, group%solid_fraction*area)
         covered = area_of_blocks(cells, mean, gap)/area
         if (covered < 1.001_wp*group%solid_fraction) return
         problem%key = 'solid_fraction'
         problem%text = 'needs a gap that leaves nothing of the smallest block; increase it to '// &
            to_text(covered + 0.1_wp*(most - covered), 2)//', or give more lloyd_steps, which make the blocks '// &
            'more alike'
      end if
   end subroutine choose_gap

   !> Widest gap with which the blocks have more than an area, and none of them is too small [m]
   real(wp) function widest_gap(cells, mean, narrowest, least) result(gap)
      type(polygon_list_t), intent(in) :: cells
      real(wp), intent(in) :: mean
      !> A gap that is not too wide [m]
      real(wp), intent(in) :: narrowest
      !> The area [m2]
      real(wp), intent(in) :: least
      real(wp) :: high
      integer :: k

      gap = narrowest
      high = sqrt(mean)
      do k = 1, n_halvings
         if (area_of_blocks(cells, mean, 0.5_wp*(gap + high)) > least) then
            gap = 0.5_wp*(gap + high)
         else
            high = 0.5_wp*(gap + high)
         end if
      end do
   end function widest_gap

   !> Total area of the blocks with a gap; 0 if one of them is smaller than the least one [m2]
   real(wp) function area_of_blocks(cells, mean, gap) result(area)
      type(polygon_list_t), intent(in) :: cells
      real(wp), intent(in) :: mean, gap
      type(polygon_list_t) :: blocks
      real(wp) :: one, centroid(2), moment
      integer(ip) :: k

      call shrink(cells, mean, gap, blocks)
      area = 0.0_wp
      if (blocks%n < cells%n) return
      do k = 1_ip, blocks%n
         call mass_properties(blocks%polygon(k), one, centroid, moment)
         area = area + one
      end do
   end function area_of_blocks

   !> Make blocks of cells: all edges move inwards by half a gap. The list ends before a block that is too small.
   subroutine shrink(cells, mean, gap, blocks)
      type(polygon_list_t), intent(in) :: cells
      !> Mean area of a cell [m2]
      real(wp), intent(in) :: mean
      real(wp), intent(in) :: gap
      type(polygon_list_t), intent(out) :: blocks
      real(wp), allocatable :: cell(:, :), block(:, :)
      real(wp) :: edge(2), normal(2), area, centroid(2), moment
      integer(ip) :: j, k

      call blocks%reserve(cells%n, int(cells%first(cells%n + 1_ip), lp))
      do k = 1_ip, cells%n
         cell = cells%polygon(k)
         block = cell
         do j = 1_ip, size(cell, 2, kind=ip)
            edge = cell(:, modulo(j, size(cell, 2, kind=ip)) + 1_ip) - cell(:, j)
            normal = [edge(2), -edge(1)]/hypotenuse(edge(1), edge(2))
            call cut(normal, normal(1)*cell(1, j) + normal(2)*cell(2, j) - 0.5_wp*gap, block)
         end do
         call drop_short_edges(shortest_edge*sqrt(mean), block)
         if (size(block, 2) < 3) return
         call mass_properties(block, area, centroid, moment)
         if (.not. area > least_block*mean) return
         call blocks%append_polygon(block)
      end do
   end subroutine shrink

   !> Find the cells of all points.
   subroutine find_cells(region, mean, points, cells)
      real(wp), intent(in) :: region(:, :)
      !> Mean area of a cell [m2]
      real(wp), intent(in) :: mean
      real(wp), intent(in) :: points(:, :)
      type(polygon_list_t), intent(out) :: cells
      type(grid_t) :: grid
      real(wp), allocatable :: cell(:, :)
      integer(ip) :: k

      call sort_into_grid(minval(region, 2), maxval(region, 2), sqrt(mean), points, grid)
      call cells%reserve(size(points, 2, kind=ip), 8_lp*size(points, 2, kind=lp))
      do k = 1_ip, size(points, 2, kind=ip)
         call cut_cell(region, points, k, grid, cell)
         call drop_short_edges(1.0e-6_wp*sqrt(mean), cell)
         call cells%append_polygon(cell)
      end do
   end subroutine find_cells

   !> Sort points into a grid.
   pure subroutine sort_into_grid(low, high, side, points, grid)
      real(wp), intent(in) :: low(2), high(2), side, points(:, :)
      type(grid_t), intent(out) :: grid
      integer(ip), allocatable :: cell(:)
      integer(ip) :: k, n

      grid%low = low
      grid%side = side
      grid%n = max(1_ip, ceiling((high - low)/side, ip))
      n = product(grid%n)
      allocate (grid%first(n + 1_ip), source=0_ip)
      allocate (grid%point(size(points, 2)), cell(size(points, 2)))
      do k = 1_ip, size(points, 2, kind=ip)
         cell(k) = index_of_cell(grid, place_in_grid(grid, points(:, k)))
         grid%first(cell(k) + 1_ip) = grid%first(cell(k) + 1_ip) + 1_ip
      end do
      grid%first(1) = 1_ip
      do k = 1_ip, n
         grid%first(k + 1_ip) = grid%first(k) + grid%first(k + 1_ip)
      end do
      do k = size(points, 2, kind=ip), 1_ip, -1_ip
         grid%first(cell(k) + 1_ip) = grid%first(cell(k) + 1_ip) - 1_ip
         grid%point(grid%first(cell(k) + 1_ip)) = k
      end do
      grid%first(:n) = grid%first(2:)
      grid%first(n + 1_ip) = size(points, 2, kind=ip) + 1_ip
   end subroutine sort_into_grid

   !> Column and row of the cell of a point
   pure function place_in_grid(grid, point) result(place)
      type(grid_t), intent(in) :: grid
      real(wp), intent(in) :: point(2)
      integer(ip) :: place(2)

      place = max(0_ip, min(grid%n - 1_ip, int((point - grid%low)/grid%side, ip)))
   end function place_in_grid

   !> Index of a cell
   pure integer(ip) function index_of_cell(grid, place)
      type(grid_t), intent(in) :: grid
      integer(ip), intent(in) :: place(2)

      index_of_cell = 1_ip + place(1) + grid%n(1)*place(2)
   end function index_of_cell

   !> Cut the cell of a point from the region.
   pure subroutine cut_cell(region, points, k, grid, cell)
      real(wp), intent(in) :: region(:, :), points(:, :)
      !> Number of the point
      integer(ip), intent(in) :: k
      type(grid_t), intent(in) :: grid
      real(wp), allocatable, intent(out) :: cell(:, :)
      integer(ip) :: place(2), ring, row, column, step

      cell = region
      place = place_in_grid(grid, points(:, k))
      do ring = 0_ip, maxval(grid%n)
         ! The points of this ring are farther than the former ring is wide.
         if (real(ring - 1_ip, wp)*grid%side > 2.0_wp*reach(points(:, k), cell)) exit
         do row = max(0_ip, place(2) - ring), min(grid%n(2) - 1_ip, place(2) + ring)
            step = max(1_ip, 2_ip*ring)
            if (abs(row - place(2)) == ring) step = 1_ip
            do column = place(1) - ring, place(1) + ring, step
               if (column < 0_ip .or. column >= grid%n(1)) cycle
               call cut_by_points(points, k, grid, index_of_cell(grid, [column, row]), cell)
            end do
         end do
      end do
   end subroutine cut_cell

   !> Cut the cell of a point by the half planes of the points in a cell of the grid.
   pure subroutine cut_by_points(points, k, grid, in_cell, cell)
      real(wp), intent(in) :: points(:, :)
      integer(ip), intent(in) :: k
      type(grid_t), intent(in) :: grid
      !> Index of the cell of the grid
      integer(ip), intent(in) :: in_cell
      real(wp), allocatable, intent(inout) :: cell(:, :)
      real(wp) :: to_other(2), middle(2), distance
      integer(ip) :: j

      do j = grid%first(in_cell), grid%first(in_cell + 1_ip) - 1_ip
         if (grid%point(j) == k) cycle
         to_other = points(:, grid%point(j)) - points(:, k)
         distance = hypotenuse(to_other(1), to_other(2))
         if (.not. distance > 0.0_wp) cycle
         middle = 0.5_wp*(points(:, grid%point(j)) + points(:, k))
         call cut(to_other/distance, (to_other(1)*middle(1) + to_other(2)*middle(2))/distance, cell)
      end do
   end subroutine cut_by_points

   !> Greatest distance of a corner of a polygon from a point [m]
   pure real(wp) function reach(point, corners)
      real(wp), intent(in) :: point(2), corners(:, :)
      integer :: k

      reach = 0.0_wp
      do k = 1, size(corners, 2)
         reach = max(reach, hypotenuse(corners(1, k) - point(1), corners(2, k) - point(2)))
      end do
   end function reach

   !> Keep the part of a convex polygon where normal times place does not exceed a value.
   pure subroutine cut(normal, most, corners)
      real(wp), intent(in) :: normal(2), most
      real(wp), allocatable, intent(inout) :: corners(:, :)
      real(wp) :: beyond(size(corners, 2)), kept(2, size(corners, 2) + 2)
      integer :: k, m, n, next

      n = size(corners, 2)
      beyond = normal(1)*corners(1, :) + normal(2)*corners(2, :) - most
      if (.not. any(beyond > 0.0_wp)) return
      m = 0
      do k = 1, n
         next = modulo(k, n) + 1
         if (beyond(k) <= 0.0_wp) then
            m = m + 1
            kept(:, m) = corners(:, k)
         end if
         if (min(beyond(k), beyond(next)) < 0.0_wp .and. max(beyond(k), beyond(next)) > 0.0_wp) then
            m = m + 1
            kept(:, m) = corners(:, k) + (corners(:, next) - corners(:, k))*(beyond(k)/(beyond(k) - beyond(next)))
         end if
      end do
      corners = kept(:, :m)
   end subroutine cut

   !> Leave out the first corner of each short edge. What is left of a convex polygon is inside it.
   pure subroutine drop_short_edges(shortest, corners)
      real(wp), intent(in) :: shortest
      real(wp), allocatable, intent(inout) :: corners(:, :)
      integer :: k, n

      k = 1
      do while (k <= size(corners, 2) .and. size(corners, 2) > 2)
         n = modulo(k, size(corners, 2)) + 1
         if (hypotenuse(corners(1, n) - corners(1, k), corners(2, n) - corners(2, k)) < shortest) then
            corners = reshape([corners(:, :k - 1), corners(:, k + 1:)], [2, size(corners, 2) - 1])
         else
            k = k + 1
         end if
      end do
   end subroutine drop_short_edges

   !> Centroid of a polygon [m]
   pure function centroid_of(corners) result(centroid)
      real(wp), intent(in) :: corners(:, :)
      real(wp) :: centroid(2), area, moment

      call mass_properties(corners, area, centroid, moment)
   end function centroid_of

end module polydem_voronoi
