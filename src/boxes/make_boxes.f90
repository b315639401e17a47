!> Bounding boxes of bodies.
!>
!> A body of particle size has one box, the bounds of its turned vertices. A larger one, a long wall say,
!> would have a box that overlaps half the scene; it is cut into pieces of about the size of the median
!> grain, each with its own box. Pieces are cut once, in the body frame, by a grid along the longest edge of
!> the body and across; the body itself stays one polygon.
!>
!> Two polygons that share a point always have boxes that share a point. For whole bodies this follows from
!> rounding being monotonic. Boxes of pieces are padded by a few rounding errors of the size of the body, so
!> that no gap opens between them when they are turned.
module polydem_make_boxes
   use polydem_bodies, only: bodies_t
   use polydem_boxes, only: boxes_t
   use polydem_kinds, only: ip, wp
   use polydem_polygon, only: clip_half_plane, diameter
   use polydem_sort_reals, only: sort_reals
   implicit none
   private
   public :: box_maker_t, new_box_maker, update_boxes

   !> Room for rounding in units of epsilon times the diameter of a body
   real(wp), parameter :: roundings = 64.0_wp

   !> What it takes to make boxes
   type :: box_maker_t
      private
      !> First box of each body, (bodies + 1)
      integer(ip), allocatable :: first_box(:)
      !> First vertex of each box's piece, (boxes + 1); the box of a whole body has none
      integer(ip), allocatable :: piece_start(:)
      !> Vertices of the pieces in the frame of their body, (2, vertex) [m]
      real(wp), allocatable :: piece(:, :)
      !> By how much the box of each piece is enlarged [m]
      real(wp), allocatable :: padding(:)
   end type box_maker_t

   !> One piece of a body
   type :: piece_t
      !> Vertices, (2, n) [m]
      real(wp), allocatable :: vertices(:, :)
   end type piece_t

   !> The pieces of a body; none if it stays whole
   type :: cut_t
      !> Pieces
      type(piece_t), allocatable :: pieces(:)
   end type cut_t

contains

   !> Decide which bodies are cut, make room for all boxes and fill them.
   subroutine new_box_maker(maker, bodies, largest_ratio, boxes)
      !> What `update_boxes` will need
      type(box_maker_t), intent(out) :: maker
      !> Bodies at their present place
      type(bodies_t), intent(in) :: bodies
      !> A body longer than this many median diameters of the free bodies is cut
      real(wp), intent(in) :: largest_ratio
      !> Boxes of all bodies
      type(boxes_t), intent(out) :: boxes
      type(cut_t), allocatable :: cuts(:)
      real(wp) :: grain
      integer(ip) :: s, n_vertices, all_slots(bodies%n)

      grain = median_diameter(bodies)
      allocate (cuts(bodies%n), maker%first_box(bodies%n + 1_ip))
      maker%first_box(1) = 1_ip
      n_vertices = 0_ip
      do s = 1_ip, bodies%n
         all_slots(s) = s
         call cut(body_shape(bodies, s), grain, largest_ratio, cuts(s))
         maker%first_box(s + 1_ip) = maker%first_box(s) + max(1_ip, size(cuts(s)%pieces, kind=ip))
         n_vertices = n_vertices + count_vertices(cuts(s))
      end do
      boxes%n = maker%first_box(bodies%n + 1_ip) - 1_ip
      boxes%n_bodies = bodies%n
      boxes%one_to_one = boxes%n == bodies%n
      allocate (boxes%bounds(4, boxes%n), boxes%body(boxes%n), boxes%fixed(boxes%n), boxes%reach(boxes%n))
      allocate (maker%piece_start(boxes%n + 1_ip), maker%piece(2, n_vertices), maker%padding(boxes%n))
      maker%piece_start(1) = 1_ip
      do s = 1_ip, bodies%n
         boxes%body(maker%first_box(s):maker%first_box(s + 1_ip) - 1_ip) = s
         boxes%fixed(maker%first_box(s):maker%first_box(s + 1_ip) - 1_ip) = bodies%fixed(s)
         call store(maker, s, body_shape(bodies, s), cuts(s), boxes%reach)
      end do
      call update_boxes(maker, bodies, all_slots, boxes)
   end subroutine new_box_maker

   !> Store the pieces of a body and the reach of its boxes.
   pure subroutine store(maker, s, vertices, pieces_of, reach)
      type(box_maker_t), intent(inout) :: maker
      integer(ip), intent(in) :: s
      real(wp), intent(in) :: vertices(:, :)
      type(cut_t), intent(in) :: pieces_of
      !> Reach of all boxes [m]
      real(wp), intent(inout) :: reach(:)
      integer(ip) :: b, k, start

      b = maker%first_box(s)
      maker%padding(b) = 0.0_wp
      maker%piece_start(b + 1_ip) = maker%piece_start(b)
      reach(b) = 0.5_wp*diameter(vertices)
      do k = 1_ip, size(pieces_of%pieces, kind=ip)
         b = maker%first_box(s) + k - 1_ip
         start = maker%piece_start(b)
         maker%piece_start(b + 1_ip) = start + size(pieces_of%pieces(k)%vertices, 2, kind=ip)
         maker%piece(:, start:maker%piece_start(b + 1_ip) - 1_ip) = pieces_of%pieces(k)%vertices
         maker%padding(b) = roundings*epsilon(1.0_wp)*diameter(vertices)
         reach(b) = 0.5_wp*diameter(pieces_of%pieces(k)%vertices) + maker%padding(b)
      end do
      reach(maker%first_box(s):b) = reach(maker%first_box(s):b)*(1.0_wp + roundings*epsilon(1.0_wp))
   end subroutine store

   !> Bring the boxes of the given bodies up to date with their place; those of others are left alone.
   subroutine update_boxes(maker, bodies, moving, boxes)
      !> From `new_box_maker`
      type(box_maker_t), intent(in) :: maker
      !> Bodies, turned to their angles
      type(bodies_t), intent(in) :: bodies
      !> Slots of the bodies that may have moved since the last call
      integer(ip), intent(in) :: moving(:)
      !> Boxes; only `bounds` changes
      type(boxes_t), intent(inout) :: boxes
      integer(ip) :: k, s, b

      !$omp parallel do schedule(static) default(none) shared(maker, bodies, moving, boxes) private(k, s, b)
      do k = 1_ip, size(moving, kind=ip)
         s = moving(k)
         b = maker%first_box(s)
         if (maker%piece_start(b + 1_ip) == maker%piece_start(b)) then
            call bound(bodies%turned(:, bodies%vertex_start(s):bodies%vertex_start(s + 1_ip) - 1_ip), &
                       0.0_wp, bodies%position(:, s), boxes%bounds(:, b))
            cycle
         end if
         do b = maker%first_box(s), maker%first_box(s + 1_ip) - 1_ip
            call bound(turn(maker%piece(:, maker%piece_start(b):maker%piece_start(b + 1_ip) - 1_ip), &
                            bodies%direction(:, s)), &
                       maker%padding(b), bodies%position(:, s), boxes%bounds(:, b))
         end do
      end do
      !$omp end parallel do
   end subroutine update_boxes

   !> Box of turned vertices, padded before the position is added, so that rounding stays monotonic.
   pure subroutine bound(turned, padding, position, box)
      real(wp), intent(in) :: turned(:, :)
      real(wp), intent(in) :: padding, position(2)
      real(wp), intent(out) :: box(4)
      real(wp) :: low(2), high(2)
      integer(ip) :: v

      low = turned(:, 1)
      high = low
      do v = 2_ip, size(turned, 2, kind=ip)
         low = min(low, turned(:, v))
         high = max(high, turned(:, v))
      end do
      box(1:2) = position + (low - padding)
      box(3:4) = position + (high + padding)
   end subroutine bound

   !> Vertices turned by an angle
   pure function turn(vertices, direction) result(turned)
      real(wp), intent(in) :: vertices(:, :)
      !> Cosine and sine of the angle
      real(wp), intent(in) :: direction(2)
      real(wp) :: turned(2, size(vertices, 2))
      integer(ip) :: v

      do v = 1_ip, size(vertices, 2, kind=ip)
         turned(1, v) = direction(1)*vertices(1, v) - direction(2)*vertices(2, v)
         turned(2, v) = direction(2)*vertices(1, v) + direction(1)*vertices(2, v)
      end do
   end function turn

   !> Vertices of a body in its frame
   pure function body_shape(bodies, s) result(vertices)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: s
      real(wp) :: vertices(2, bodies%vertex_start(s + 1_ip) - bodies%vertex_start(s))

      vertices = bodies%shape(:, bodies%vertex_start(s):bodies%vertex_start(s + 1_ip) - 1_ip)
   end function body_shape

   !> Median diameter of the free bodies; huge if there is none, so that nothing is cut [m]
   pure real(wp) function median_diameter(bodies)
      type(bodies_t), intent(in) :: bodies
      real(wp), allocatable :: length(:)
      integer(ip), allocatable :: ranked(:)
      integer(ip) :: k, n

      n = size(bodies%free, kind=ip)
      median_diameter = huge(1.0_wp)
      if (n == 0_ip) return
      allocate (length(n), ranked(n))
      do k = 1_ip, n
         length(k) = diameter(body_shape(bodies, bodies%free(k)))
      end do
      call sort_reals(length, ranked)
      median_diameter = length(ranked((n + 1_ip)/2_ip))
   end function median_diameter

   !> Cut a body by a grid along its longest edge and across; a small one is left whole.
   pure subroutine cut(vertices, grain, largest_ratio, pieces_of)
      real(wp), intent(in) :: vertices(:, :)
      real(wp), intent(in) :: grain, largest_ratio
      type(cut_t), intent(out) :: pieces_of
      real(wp) :: along(2), across(2), from_along, from_across, length, width
      real(wp), allocatable :: strip(:, :), cell(:, :)
      type(piece_t), allocatable :: pieces(:)
      integer(ip) :: i, j, n, n_along, n_across

      allocate (pieces_of%pieces(0))
      if (diameter(vertices)/grain <= largest_ratio) return
      along = longest_edge(vertices)
      across = [-along(2), along(1)]
      call extent(vertices, along, from_along, length)
      call extent(vertices, across, from_across, width)
      n_along = parts(length, grain, largest_ratio)
      n_across = parts(width, grain, largest_ratio)
      if (n_along*n_across == 1_ip) return
      allocate (pieces(n_along*n_across))
      n = 0_ip
      do i = 1_ip, n_along
         call slice(vertices, along, from_along, length, i, n_along, strip)
         do j = 1_ip, n_across
            call slice(strip, across, from_across, width, j, n_across, cell)
            if (size(cell, 2) == 0) cycle
            n = n + 1_ip
            call move_alloc(cell, pieces(n)%vertices)
         end do
      end do
      pieces_of%pieces = pieces(1:n)
   end subroutine cut

   pure integer(ip) function count_vertices(pieces_of)
      type(cut_t), intent(in) :: pieces_of
      integer(ip) :: k

      count_vertices = 0_ip
      do k = 1_ip, size(pieces_of%pieces, kind=ip)
         count_vertices = count_vertices + size(pieces_of%pieces(k)%vertices, 2, kind=ip)
      end do
   end function count_vertices

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

   !> Number of parts into which a length is cut
   pure integer(ip) function parts(length, grain, largest_ratio)
      real(wp), intent(in) :: length, grain, largest_ratio

      parts = 1_ip
      if (length/grain > largest_ratio) parts = max(1_ip, ceiling(length/grain, ip))
   end function parts

   !> The k-th of n slices of a polygon in some direction
   pure subroutine slice(vertices, direction, from, length, k, n, part)
      real(wp), intent(in) :: vertices(:, :)
      real(wp), intent(in) :: direction(2), from, length
      integer(ip), intent(in) :: k, n
      real(wp), allocatable, intent(out) :: part(:, :)
      real(wp), allocatable :: lower(:, :)
      real(wp) :: low, high

      low = from + length*real(k - 1_ip, wp)/real(n, wp)
      high = from + length*real(k, wp)/real(n, wp)
      lower = vertices
      if (k > 1_ip) call clip_half_plane(vertices, low*direction, -direction, lower)
      part = lower
      if (k < n) call clip_half_plane(lower, high*direction, direction, part)
   end subroutine slice

end module polydem_make_boxes
