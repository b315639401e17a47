!> Division of large bodies into tiles, once and in the body frame.
!>
!> A grid is aligned with the longest edge of the body. Its cells are about one median diameter wide. A block of cells
!> is halved until it is one cell, or lies deep enough in the body that its bounding box stays inside the body at any
!> angle. Tiles are therefore one cell large along the outline, and larger with increasing depth. Together they fill
!> the body: a small body inside a large one always meets a tile. The number of tiles is proportional to the
!> circumference of the body, not to its area.
module polydem_body_tiles
   use polydem_elementary, only: hypotenuse
   use polydem_errors, only: error_t, input_error, raise
   use polydem_grow, only: grow
   use polydem_kinds, only: ip, wp
   use polydem_pieces, only: pieces_t
   use polydem_polygon, only: clip_half_plane, cross, diameter
   use polydem_polygon_list, only: polygon_list_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: cut_body, cut_pieces, refuse_tiles

   !> Grid for the division of a body; axis 1 is along its longest edge, axis 2 across
   type :: grid_t
      !> Unit vectors, (2, axis)
      real(wp) :: direction(2, 2)
      !> Least coordinate of the body along each axis [m]
      real(wp) :: from(2)
      !> Extent of the body along each axis [m]
      real(wp) :: length(2)
      !> Number of cells along each axis
      integer(ip) :: cells(2)
   end type grid_t

contains

   !> Report a body that would need too many boxes.
   pure subroutine refuse_tiles(id, ratio, most_tiles, error)
      !> Identifier of the body
      integer(ip), intent(in) :: id
      !> Diameter of the body in median diameters
      real(wp), intent(in) :: ratio
      !> Greatest number of tiles of all bodies
      integer(ip), intent(in) :: most_tiles
      !> Names the body
      type(error_t), allocatable, intent(inout) :: error

      call raise(error, input_error, 'body '//to_text(id)//' is '//to_text(ratio)//' times as long as the '// &
                 'median diameter of the free bodies; cut into tiles of that size, it and the bodies before it '// &
                 'need more than '//to_text(most_tiles)//' boxes; set largest_ratio in &boxes above this ratio '// &
                 'to keep it whole')
   end subroutine refuse_tiles

   !> Make tiles of the pieces of a body: a piece is one tile or is cut into several. A body of one piece that is not
   !> cut gets no tile.
   subroutine cut_pieces(pieces, s, median_diameter, largest_ratio, roundings, room, tiles, piece, fits)
      type(pieces_t), intent(in) :: pieces
      !> Slot of the body
      integer(ip), intent(in) :: s
      !> A piece that is longer than `largest_ratio` median diameters is cut [m, 1]
      real(wp), intent(in) :: median_diameter, largest_ratio
      !> Allowance for rounding, in units of epsilon
      real(wp), intent(in) :: roundings
      !> Number of tiles that may be added
      integer(ip), intent(in) :: room
      !> Tiles, to which those of the body are added
      type(polygon_list_t), intent(inout) :: tiles
      !> Piece of each tile, (tiles%n) or longer
      integer(ip), allocatable, intent(inout) :: piece(:)
      !> Whether the tiles are not too many
      logical, intent(out) :: fits
      integer(ip) :: before, known, p, range(2)

      if (.not. allocated(piece)) allocate (piece(pieces%n_pieces()))
      range = pieces%pieces_of(s)
      fits = .true.
      before = tiles%n
      do p = range(1), range(2)
         known = tiles%n
         if (2.0_wp*pieces%radius(p)*(1.0_wp + roundings*epsilon(1.0_wp))/median_diameter > largest_ratio) then
            call cut_body(pieces%piece_polygon(p), median_diameter, largest_ratio, room - (known - before), tiles, fits)
            if (.not. fits) return
         end if
         if (tiles%n == known .and. range(2) > range(1)) call tiles%append_polygon(pieces%piece_polygon(p))
         if (tiles%n > size(piece)) call grow(piece, known, 2_ip*tiles%n, 0_ip)
         piece(known + 1_ip:tiles%n) = p
      end do
   end subroutine cut_pieces

   !> Append the tiles of a body. A body that is small enough has no tiles.
   pure subroutine cut_body(vertices, median_diameter, largest_ratio, room, tiles, fits)
      !> Vertices of the body in the body frame, anticlockwise, (2, n) [m]
      real(wp), intent(in) :: vertices(:, :)
      !> Median diameter of the free bodies [m]
      real(wp), intent(in) :: median_diameter
      !> A body longer than this many median diameters is cut
      real(wp), intent(in) :: largest_ratio
      !> Greatest number of tiles to append
      integer(ip), intent(in) :: room
      !> Tiles of all bodies, in the body frame
      type(polygon_list_t), intent(inout) :: tiles
      !> Whether there was room; if not, the tiles are incomplete
      logical, intent(out) :: fits
      type(grid_t) :: grid
      integer(ip) :: most
      integer :: a

      fits = .true.
      if (diameter(vertices)/median_diameter <= largest_ratio) return
      grid%direction(:, 1) = longest_edge(vertices)
      grid%direction(:, 2) = [-grid%direction(2, 1), grid%direction(1, 1)]
      do a = 1, 2
         call extent(vertices, grid%direction(:, a), grid%from(a), grid%length(a))
         grid%cells(a) = number_of_cells(grid%length(a)/median_diameter, largest_ratio, room)
      end do
      ! The outline alone has more tiles than the grid has cells along an axis.
      fits = all(grid%cells == 1_ip .or. grid%cells <= room)
      if (all(grid%cells == 1_ip) .or. .not. fits) return
      most = tiles%n + room
      call cut_block(grid, vertices, [0_ip, 0_ip], grid%cells, vertices, most, tiles)
      fits = tiles%n <= most
   end subroutine cut_body

   !> Number of cells along a length in median diameters; `room` + 1 if they are too many
   pure integer(ip) function number_of_cells(diameters, largest_ratio, room)
      real(wp), intent(in) :: diameters, largest_ratio
      integer(ip), intent(in) :: room

      number_of_cells = 1_ip
      if (diameters <= largest_ratio) return
      number_of_cells = room + 1_ip
      if (diameters <= real(room, wp)) number_of_cells = max(1_ip, ceiling(diameters, ip))
   end function number_of_cells

   !> Append the tiles of a body in a block of cells. Halve the block as often as necessary.
   pure recursive subroutine cut_block(grid, outline, low, high, part, most, tiles)
      type(grid_t), intent(in) :: grid
      !> The whole body [m]
      real(wp), intent(in) :: outline(:, :)
      !> The block has the cells low + 1 to high
      integer(ip), intent(in) :: low(2), high(2)
      !> The body in this block [m]
      real(wp), intent(in) :: part(:, :)
      !> Greatest number of tiles; beyond it the procedure returns
      integer(ip), intent(in) :: most
      type(polygon_list_t), intent(inout) :: tiles
      real(wp) :: point(2), direction(2)
      real(wp), allocatable :: half(:, :)
      integer(ip) :: middle(2)
      integer :: a

      if (size(part, 2) == 0 .or. tiles%n > most) return
      if (all(high - low == 1_ip) .or. lies_deep(grid, outline, low, high)) then
         call tiles%append_polygon(part)
         return
      end if
      a = merge(2, 1, high(2) - low(2) >= high(1) - low(1))
      middle = (low + high)/2_ip
      direction = grid%direction(:, a)
      point = line(grid, a, middle(a))*direction
      call clip_half_plane(part, point, direction, half)
      call cut_block(grid, outline, low, merge(middle, high, [1, 2] == a), half, most, tiles)
      call clip_half_plane(part, point, -direction, half)
      call cut_block(grid, outline, merge(middle, low, [1, 2] == a), high, half, most, tiles)
   end subroutine cut_block

   !> Whether the distance of a block from the outline is at least half its longer side. The bounding box of a turned
   !> block extends at most this far beyond the block.
   pure logical function lies_deep(grid, outline, low, high)
      type(grid_t), intent(in) :: grid
      real(wp), intent(in) :: outline(:, :)
      integer(ip), intent(in) :: low(2), high(2)
      real(wp) :: centre(2), half(2), edge(2), depth
      integer(ip) :: v, n
      integer :: a
      ! Tolerance for square blocks, which can be exactly at the limit
      real(wp), parameter :: nearly = 0.999_wp

      centre = 0.0_wp
      do a = 1, 2
         half(a) = 0.5_wp*(line(grid, a, high(a)) - line(grid, a, low(a)))
         centre = centre + 0.5_wp*(line(grid, a, high(a)) + line(grid, a, low(a)))*grid%direction(:, a)
      end do
      n = size(outline, 2, kind=ip)
      lies_deep = .false.
      do v = 1_ip, n
         edge = outline(:, 1_ip + modulo(v, n)) - outline(:, v)
         depth = cross(edge, centre - outline(:, v)) - half(1)*abs(cross(edge, grid%direction(:, 1))) &
                 - half(2)*abs(cross(edge, grid%direction(:, 2)))
         if (depth < nearly*maxval(half)*hypotenuse(edge(1), edge(2))) return
      end do
      lies_deep = .true.
   end function lies_deep

   !> Coordinate of line k of the grid, counted from 0 [m]
   pure real(wp) function line(grid, a, k)
      type(grid_t), intent(in) :: grid
      !> Axis: 1 for lines perpendicular to the longest edge, 2 for lines along it
      integer, intent(in) :: a
      integer(ip), intent(in) :: k

      line = grid%from(a) + grid%length(a)*real(k, wp)/real(grid%cells(a), wp)
   end function line

   !> Unit vector along the longest edge
   pure function longest_edge(vertices) result(direction)
      real(wp), intent(in) :: vertices(:, :)
      real(wp) :: direction(2), edge(2), longest
      integer(ip) :: v, n

      n = size(vertices, 2, kind=ip)
      longest = -1.0_wp
      direction = [1.0_wp, 0.0_wp]
      do v = 1_ip, n
         edge = vertices(:, 1_ip + modulo(v, n)) - vertices(:, v)
         if (hypotenuse(edge(1), edge(2)) <= longest) cycle
         longest = hypotenuse(edge(1), edge(2))
         direction = edge/longest
      end do
   end function longest_edge

   !> Least coordinate and extent of a polygon in a direction
   pure subroutine extent(vertices, direction, from, length)
      real(wp), intent(in) :: vertices(:, :)
      real(wp), intent(in) :: direction(2)
      real(wp), intent(out) :: from, length
      real(wp) :: along(size(vertices, 2))

      along = vertices(1, :)*direction(1) + vertices(2, :)*direction(2)
      from = minval(along)
      length = maxval(along) - from
   end subroutine extent

end module polydem_body_tiles
