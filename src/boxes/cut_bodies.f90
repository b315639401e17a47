!> Cutting of large bodies into pieces, once and in the frame of the body.
!>
!> A grid of cells about as large as a grain is laid along the longest edge of the body and across. A block
!> of cells is halved until it is one cell, or lies so deep in the body that its box sticks out at no
!> angle. So cells of the size of a grain follow the outline, pieces grow with the depth, and together they
!> fill the body: their number goes with its circumference, not its area, and a small body inside a large one
!> still meets a piece of it.
module polydem_cut_bodies
   use polydem_kinds, only: ip, wp
   use polydem_polygon, only: clip_half_plane, diameter
   implicit none
   private
   public :: pieces_t, cut_body

   !> A growing list of pieces
   type :: pieces_t
      !> Number of pieces
      integer(ip) :: n = 0_ip
      !> First vertex of each piece, and behind the last piece the next one; may be longer than n + 1
      integer(ip), allocatable :: start(:)
      !> Vertices in the frame of the body, (2, vertex) [m]; may be longer than needed
      real(wp), allocatable :: vertices(:, :)
   contains
      procedure :: append
   end type pieces_t

   !> The grid by which a body is cut; index 1 is along its longest edge, 2 across
   type :: grid_t
      !> Unit vectors, (2, axis)
      real(wp) :: direction(2, 2)
      !> Where the body begins [m]
      real(wp) :: from(2)
      !> How long the body is [m]
      real(wp) :: length(2)
      !> Number of cells
      integer(ip) :: cells(2)
   end type grid_t

contains

   !> Append the pieces of a body, none if it is small enough to stay whole.
   pure subroutine cut_body(vertices, grain, largest_ratio, room, pieces, fits)
      !> Vertices of the body in its frame, anticlockwise, (2, n) [m]
      real(wp), intent(in) :: vertices(:, :)
      !> Length of a grain [m]
      real(wp), intent(in) :: grain
      !> What is longer than this many grains is cut
      real(wp), intent(in) :: largest_ratio
      !> Number of pieces that may be appended
      integer(ip), intent(in) :: room
      !> Pieces
      type(pieces_t), intent(inout) :: pieces
      !> Whether there was room; if not, the pieces are not complete
      logical, intent(out) :: fits
      type(grid_t) :: grid
      integer(ip) :: most
      integer :: a

      fits = .true.
      if (diameter(vertices)/grain <= largest_ratio) return
      grid%direction(:, 1) = longest_edge(vertices)
      grid%direction(:, 2) = [-grid%direction(2, 1), grid%direction(1, 1)]
      do a = 1, 2
         call extent(vertices, grid%direction(:, a), grid%from(a), grid%length(a))
         grid%cells(a) = number_of_cells(grid%length(a)/grain, largest_ratio, room)
      end do
      ! The outline alone has more pieces than the grid has cells on a side.
      fits = all(grid%cells == 1_ip .or. grid%cells <= room)
      if (all(grid%cells == 1_ip) .or. .not. fits) return
      most = pieces%n + room
      call cut_block(grid, vertices, [0_ip, 0_ip], grid%cells, vertices, most, pieces)
      fits = pieces%n <= most
   end subroutine cut_body

   !> Number of cells into which a length in grains is cut; more than there is room for if it is too many
   pure integer(ip) function number_of_cells(grains, largest_ratio, room)
      real(wp), intent(in) :: grains, largest_ratio
      integer(ip), intent(in) :: room

      number_of_cells = 1_ip
      if (grains <= largest_ratio) return
      number_of_cells = room + 1_ip
      if (grains <= real(room, wp)) number_of_cells = max(1_ip, ceiling(grains, ip))
   end function number_of_cells

   !> Append what of a body lies in a block of cells, halving the block as long as need be.
   pure recursive subroutine cut_block(grid, outline, low, high, part, most, pieces)
      type(grid_t), intent(in) :: grid
      !> The whole body [m]
      real(wp), intent(in) :: outline(:, :)
      !> The block has the cells low + 1 to high
      integer(ip), intent(in) :: low(2), high(2)
      !> The body in this block [m]
      real(wp), intent(in) :: part(:, :)
      !> Number of pieces at which to give up
      integer(ip), intent(in) :: most
      type(pieces_t), intent(inout) :: pieces
      real(wp) :: point(2), direction(2)
      real(wp), allocatable :: half(:, :)
      integer(ip) :: middle(2)
      integer :: a

      if (size(part, 2) == 0 .or. pieces%n > most) return
      if (all(high - low == 1_ip) .or. lies_deep(grid, outline, low, high)) then
         call pieces%append(part)
         return
      end if
      a = merge(2, 1, high(2) - low(2) >= high(1) - low(1))
      middle = (low + high)/2_ip
      direction = grid%direction(:, a)
      point = line(grid, a, middle(a))*direction
      call clip_half_plane(part, point, direction, half)
      call cut_block(grid, outline, low, merge(middle, high, [1, 2] == a), half, most, pieces)
      call clip_half_plane(part, point, -direction, half)
      call cut_block(grid, outline, merge(middle, low, [1, 2] == a), high, half, most, pieces)
   end subroutine cut_block

   !> Whether a block lies at least half its longer side within the outline: so far its box can stick out of
   !> the block at some angle.
   pure logical function lies_deep(grid, outline, low, high)
      type(grid_t), intent(in) :: grid
      real(wp), intent(in) :: outline(:, :)
      integer(ip), intent(in) :: low(2), high(2)
      real(wp) :: centre(2), half(2), edge(2), depth
      integer(ip) :: v, n
      integer :: a
      ! Blocks of cells of equal sides may just touch the limit.
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
         if (depth < nearly*maxval(half)*hypot(edge(1), edge(2))) return
      end do
      lies_deep = .true.
   end function lies_deep

   !> Where the k-th line of the grid lies, counted from 0 [m]
   pure real(wp) function line(grid, a, k)
      type(grid_t), intent(in) :: grid
      !> 1: lines across the longest edge, 2: along it
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
         if (hypot(edge(1), edge(2)) <= longest) cycle
         longest = hypot(edge(1), edge(2))
         direction = edge/longest
      end do
   end function longest_edge

   !> Where a polygon begins in some direction, and its length there
   pure subroutine extent(vertices, direction, from, length)
      real(wp), intent(in) :: vertices(:, :)
      real(wp), intent(in) :: direction(2)
      real(wp), intent(out) :: from, length
      real(wp) :: along(size(vertices, 2))

      along = vertices(1, :)*direction(1) + vertices(2, :)*direction(2)
      from = minval(along)
      length = maxval(along) - from
   end subroutine extent

   pure real(wp) function cross(p, q)
      real(wp), intent(in) :: p(2), q(2)

      cross = p(1)*q(2) - p(2)*q(1)
   end function cross

   !> Append a piece; one without vertices stands for a body that stays whole.
   pure subroutine append(self, vertices)
      class(pieces_t), intent(inout) :: self
      !> Vertices in the frame of the body, (2, n) [m]
      real(wp), intent(in) :: vertices(:, :)
      integer(ip), allocatable :: longer(:)
      real(wp), allocatable :: more(:, :)
      integer(ip) :: first, last

      if (.not. allocated(self%start)) then
         allocate (self%start(64), self%vertices(2, 256))
         self%start(1) = 1_ip
      end if
      first = self%start(self%n + 1_ip)
      last = first + size(vertices, 2, kind=ip) - 1_ip
      if (self%n + 2_ip > size(self%start)) then
         allocate (longer(2_ip*self%n + 2_ip))
         longer(1:self%n + 1_ip) = self%start(1:self%n + 1_ip)
         call move_alloc(longer, self%start)
      end if
      if (last > size(self%vertices, 2)) then
         allocate (more(2, 2_ip*last))
         more(:, 1:first - 1_ip) = self%vertices(:, 1:first - 1_ip)
         call move_alloc(more, self%vertices)
      end if
      self%vertices(:, first:last) = vertices
      self%n = self%n + 1_ip
      self%start(self%n + 1_ip) = last + 1_ip
   end subroutine append

end module polydem_cut_bodies
