!> Bounding boxes of bodies.
!>
!> A body of common size has one box, the bounds of its turned vertices. The box of a much larger body, such as a long
!> wall, would overlap half the scene. A large body is therefore cut into tiles (`polydem_body_tiles`), and each tile
!> has its own box. The body itself remains one polygon. The pieces of a body of several pieces are such tiles, or are
!> cut into tiles like a body. A body of a wall that was removed has no box.
!>
!> If two polygons share a point, their boxes share a point. For whole bodies this follows from the monotonicity of
!> rounding. Boxes of tiles are padded by a few rounding errors of the size of the body: no gap opens between them when
!> the body turns. For interactions with a range, all boxes can be padded by a margin. If the distance of two bodies is
!> less than twice the margin, their boxes overlap.
module polydem_box_maker
   use polydem_bodies, only: block_size, bodies_t, turn_block
   use polydem_body_tiles, only: cut_body, cut_pieces, refuse_tiles
   use polydem_body_sizes, only: median_of_diameters
   use polydem_box_images, only: add_images, box_images_t, place_images, place_near
   use polydem_box_placement, only: extent_of, place_box, place_whole, turn
   use polydem_boxes, only: boxes_t
   use polydem_elementary, only: sine_and_cosine
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, wp, min_parallel_size
   use polydem_polygon, only: diameter
   use polydem_polygon_list, only: polygon_list_t
   implicit none
   private
   public :: box_maker_t, new_box_maker, turn_and_bound, turn_and_bound_block, turn_and_bound_in_cell, place_boxes, &
      place_in_cell, update_boxes

   !> Allowance for rounding, in units of epsilon times the diameter, and greatest number of tiles of all cut bodies
   real(wp), parameter :: roundings = 64.0_wp
   integer(ip), parameter :: most_tiles = 200000_ip

   !> A body that is cut into tiles
   type :: cut_body_t
      !> Its first box and its first tile; the others follow
      integer(ip) :: first_box, first_tile
      !> Number of its tiles
      integer(ip) :: n
      !> Padding of its boxes on each side [m]
      real(wp) :: padding
   end type cut_body_t

   !> Constant data for the boxes of bodies: tiles and paddings
   type :: box_maker_t
      !> Median diameter of the free bodies; huge if there is none [m]
      real(wp) :: median_diameter = huge(1.0_wp)
      !> Padding of the boxes of whole bodies on each side [m]
      real(wp) :: margin = 0.0_wp
      !> Box of each whole body, (body); for a body that is cut, minus its index in `cut`
      integer(ip), allocatable :: box(:)
      !> Bodies that are cut
      type(cut_body_t), allocatable :: cut(:)
      !> Tiles of these bodies in the body frame
      type(polygon_list_t) :: tiles
      !> Piece of each tile; not allocated if every body has one piece
      integer(ip), allocatable :: piece(:)
      !> Images of boxes in a periodic cell
      type(box_images_t) :: images
   end type box_maker_t

contains

   !> Cut large bodies into tiles, and make the boxes of all bodies.
   subroutine new_box_maker(maker, bodies, largest_ratio, margin, boxes, error, median_diameter, room)
      !> Data for `update_boxes`
      type(box_maker_t), intent(out) :: maker
      !> Bodies at their present positions
      type(bodies_t), intent(in) :: bodies
      !> A body longer than this many median diameters of the free bodies is cut
      real(wp), intent(in) :: largest_ratio
      !> Padding of every box on each side, for interactions with a range [m]
      real(wp), intent(in) :: margin
      !> Boxes of all bodies
      type(boxes_t), intent(out) :: boxes
      !> Allocated if a body is so large that it would need too many tiles
      type(error_t), allocatable, intent(inout) :: error
      !> Median diameter of the free bodies of all ranks; by default that of `bodies` [m]
      real(wp), intent(in), optional :: median_diameter
      !> Distance that boxes may move before they are made again; default: they get no images in a periodic cell [m]
      real(wp), intent(in), optional :: room
      integer(ip) :: s

      if (present(median_diameter)) maker%median_diameter = median_diameter
      if (.not. present(median_diameter)) maker%median_diameter = median_of_diameters(bodies)
      maker%margin = margin
      call cut_bodies(maker, bodies, largest_ratio, boxes%n, error)
      if (allocated(error)) return
      boxes%n_pieces = bodies%pieces%n_pieces()
      boxes%one_to_one = boxes%n == boxes%n_pieces .and. bodies%pieces%most == 1_ip &
                         .and. .not. allocated(bodies%removed)
      allocate (boxes%bounds(4, boxes%n), boxes%piece(boxes%n), boxes%body(boxes%n), boxes%fixed(boxes%n), &
                boxes%passive(boxes%n), boxes%reach(boxes%n))
      do s = 1_ip, bodies%n
         call describe_boxes(maker, bodies, s, boxes)
         call update_box(maker, bodies, s, boxes, is_first=.true.)
      end do
      if (present(room) .and. bodies%cell%is_periodic) call add_images(bodies%cell, room, boxes, maker%images)
   end subroutine new_box_maker

   !> Cut the bodies that are too large. Each of the others has one box and no tile.
   subroutine cut_bodies(maker, bodies, largest_ratio, n_boxes, error)
      type(box_maker_t), intent(inout) :: maker
      type(bodies_t), intent(in) :: bodies
      real(wp), intent(in) :: largest_ratio
      !> Number of boxes of all bodies
      integer(ip), intent(out) :: n_boxes
      type(error_t), allocatable, intent(inout) :: error
      type(cut_body_t), allocatable :: longer(:)
      integer(ip) :: s, room, n_cut, n_tiles, known
      logical :: fits, is_removed

      room = most_tiles
      n_boxes = 0_ip
      n_cut = 0_ip
      allocate (maker%box(bodies%n), maker%cut(8))
      do s = 1_ip, bodies%n
         known = maker%tiles%n
         fits = .true.
         is_removed = .false.
         if (allocated(bodies%removed)) is_removed = bodies%removed(s)
         ! A body of small radius is small enough for certain.
         if (.not. is_removed .and. bodies%pieces%most > 1_ip) then
            call cut_pieces(bodies%pieces, s, maker%median_diameter, largest_ratio, roundings, room, maker%tiles, &
                            maker%piece, fits)
         else if (.not. is_removed .and. &
             2.0_wp*bodies%radius(s)*(1.0_wp + roundings*epsilon(1.0_wp))/maker%median_diameter > largest_ratio) then
            call cut_body(bodies%pieces%polygon(s), maker%median_diameter, largest_ratio, room, maker%tiles, fits)
         end if
         n_tiles = maker%tiles%n - known
         if (.not. fits) then
            call refuse_tiles(bodies%id(s), bodies%diameter(s)/maker%median_diameter, most_tiles, error)
            return
         end if
         if (n_tiles == 0_ip .and. .not. is_removed) then
            n_boxes = n_boxes + 1_ip
            maker%box(s) = n_boxes
            cycle
         end if
         room = room - n_tiles
         n_cut = n_cut + 1_ip
         if (n_cut > size(maker%cut)) then
            allocate (longer(2_ip*n_cut))
            longer(:n_cut - 1_ip) = maker%cut
            call move_alloc(longer, maker%cut)
         end if
         maker%cut(n_cut) = cut_body_t(first_box=n_boxes + 1_ip, first_tile=known + 1_ip, n=n_tiles, &
                                       padding=maker%margin + roundings*epsilon(1.0_wp)*bodies%diameter(s))
         maker%box(s) = -n_cut
         n_boxes = n_boxes + n_tiles
      end do
   end subroutine cut_bodies

   !> Set all but the bounds of the boxes of a body.
   pure subroutine describe_boxes(maker, bodies, s, boxes)
      type(box_maker_t), intent(in) :: maker
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: s
      type(boxes_t), intent(inout) :: boxes
      integer(ip) :: b, first, last, p

      b = maker%box(s)
      if (b > 0_ip) then
         call describe_box(bodies, bodies%pieces%first_of(s), s, bodies%diameter(s), maker%margin, b, boxes)
         return
      end if
      associate (cut => maker%cut(-b), tiles => maker%tiles)
         do b = 0_ip, cut%n - 1_ip
            first = tiles%first(cut%first_tile + b)
            last = tiles%first(cut%first_tile + b + 1_ip) - 1_ip
            p = s
            if (allocated(maker%piece)) p = maker%piece(cut%first_tile + b)
            call describe_box(bodies, p, s, diameter(tiles%vertex(:, first:last)), cut%padding, cut%first_box + b, &
                              boxes)
         end do
      end associate
   end subroutine describe_boxes

   !> Set all but the bounds of a box.
   pure subroutine describe_box(bodies, p, s, length, padding, b, boxes)
      type(bodies_t), intent(in) :: bodies
      !> Index of the piece
      integer(ip), intent(in) :: p
      integer(ip), intent(in) :: s
      !> Diameter of the body or tile, and padding of the box [m]
      real(wp), intent(in) :: length, padding
      !> Index of the box
      integer(ip), intent(in) :: b
      type(boxes_t), intent(inout) :: boxes

      boxes%piece(b) = p
      boxes%body(b) = s
      boxes%fixed(b) = bodies%fixed(s)
      boxes%passive(b) = bodies%fixed(s) .or. bodies%in_halo(s)
      boxes%reach(b) = (0.5_wp*length + padding)*(1.0_wp + roundings*epsilon(1.0_wp))
   end subroutine describe_box

   !> Turn bodies to their angles and update their boxes in one pass: the same as `turn_bodies` and then `update_boxes`.
   subroutine turn_and_bound(maker, moving, bodies, boxes)
      !> From `new_box_maker`
      type(box_maker_t), intent(in) :: maker
      !> Slots of the bodies that may have moved since the last call
      integer(ip), intent(in), contiguous :: moving(:)
      !> Bodies; only `turned` changes
      type(bodies_t), intent(inout) :: bodies
      !> Boxes; only `bounds` changes
      type(boxes_t), intent(inout) :: boxes
      integer(ip) :: low

      !$omp parallel do if (size(moving) > min_parallel_size) schedule(static) default(none) &
      !$omp    shared(maker, moving, bodies, boxes) private(low)
      do low = 1_ip, size(moving, kind=ip), block_size
         associate (slots => moving(low:min(low + block_size - 1_ip, size(moving, kind=ip))))
            if (bodies%cell%is_periodic) then
               call turn_and_bound_in_cell(maker, slots, bodies, boxes)
            else
               call turn_and_bound_block(maker, slots, bodies, boxes)
            end if
         end associate
      end do
      !$omp end parallel do
   end subroutine turn_and_bound

   !> Turn up to `block_size` bodies to their angles and update their boxes. Several threads may call it for different
   !> bodies.
   subroutine turn_and_bound_block(maker, slots, bodies, boxes)
      !> From `new_box_maker`
      type(box_maker_t), intent(in) :: maker
      !> Slots of the bodies
      integer(ip), intent(in), contiguous :: slots(:)
      !> Bodies; only `turned` changes
      type(bodies_t), intent(inout) :: bodies
      !> Boxes; only `bounds` changes
      type(boxes_t), intent(inout) :: boxes
      real(wp) :: extent(4, block_size), direction(2, block_size)

      call turn_block(bodies, slots, extent, direction)
      if (bodies%pieces%most > 1_ip) call bodies%pieces%turn_pieces(slots, direction)
      call place_boxes(maker, slots, extent, direction, bodies, boxes)
   end subroutine turn_and_bound_block

   !> The same in a periodic cell. It stands apart, so that the other is small enough to be compiled as a whole.
   subroutine turn_and_bound_in_cell(maker, slots, bodies, boxes)
      !> From `new_box_maker`
      type(box_maker_t), intent(in) :: maker
      !> Slots of the bodies
      integer(ip), intent(in), contiguous :: slots(:)
      !> Bodies; only `turned` changes
      type(bodies_t), intent(inout) :: bodies
      !> Boxes; only `bounds` changes
      type(boxes_t), intent(inout) :: boxes
      real(wp) :: extent(4, block_size), direction(2, block_size)

      call turn_block(bodies, slots, extent, direction)
      if (bodies%pieces%most > 1_ip) call bodies%pieces%turn_pieces(slots, direction)
      call place_in_cell(maker, slots, extent, direction, bodies, boxes)
   end subroutine turn_and_bound_in_cell

   !> Update the boxes of up to `block_size` bodies in the plane from the extents of their turned vertices.
   pure subroutine place_boxes(maker, slots, extent, direction, bodies, boxes)
      !> From `new_box_maker`
      type(box_maker_t), intent(in) :: maker
      !> Slots of the bodies
      integer(ip), intent(in), contiguous :: slots(:)
      !> Least x and y and greatest x and y of the turned vertices of each, (4, body) [m]
      real(wp), intent(in) :: extent(4, block_size)
      !> Cosine and sine of the angle of each, (2, body)
      real(wp), intent(in) :: direction(2, block_size)
      type(bodies_t), intent(in) :: bodies
      !> Boxes; only `bounds` changes
      type(boxes_t), intent(inout) :: boxes
      integer(ip) :: k, n, n_cut

      n = size(slots, kind=ip)
      call place_whole(n, slots, bodies%n, maker%box, maker%margin, extent, bodies%position, boxes%n, boxes%bounds, &
                       n_cut)
      if (n_cut == 0_ip) return
      do k = 1_ip, n
         if (maker%box(slots(k)) > 0_ip) cycle
         call bound_body(maker, bodies%position(:, slots(k)), slots(k), extent(:, k), direction(:, k), boxes)
      end do
   end subroutine place_boxes

   !> Update the boxes of up to `block_size` bodies in a periodic cell from the extents of their turned vertices.
   pure subroutine place_in_cell(maker, slots, extent, direction, bodies, boxes)
      !> From `new_box_maker`
      type(box_maker_t), intent(in) :: maker
      !> Slots of the bodies
      integer(ip), intent(in), contiguous :: slots(:)
      !> Least x and y and greatest x and y of the turned vertices of each, (4, body) [m]
      real(wp), intent(in) :: extent(4, block_size)
      !> Cosine and sine of the angle of each, (2, body)
      real(wp), intent(in) :: direction(2, block_size)
      type(bodies_t), intent(in) :: bodies
      !> Boxes; only `bounds` changes
      type(boxes_t), intent(inout) :: boxes
      integer(ip) :: k

      do k = 1_ip, size(slots, kind=ip)
         call bound_in_cell(maker, bodies, slots(k), extent(:, k), direction(:, k), boxes)
      end do
   end subroutine place_in_cell

   !> Update the boxes of the given bodies to their positions, and all images. The boxes of other bodies do not change.
   subroutine update_boxes(maker, bodies, moving, boxes)
      !> From `new_box_maker`
      type(box_maker_t), intent(in) :: maker
      !> Bodies, turned to their angles
      type(bodies_t), intent(in) :: bodies
      !> Slots of the bodies that may have moved since the last call
      integer(ip), intent(in) :: moving(:)
      !> Boxes; only `bounds` changes
      type(boxes_t), intent(inout) :: boxes
      integer(ip) :: k

      !$omp parallel do if (size(moving) > min_parallel_size) schedule(static) default(none) &
      !$omp    shared(maker, bodies, moving, boxes) private(k)
      do k = 1_ip, size(moving, kind=ip)
         call update_box(maker, bodies, moving(k), boxes, is_first=.false.)
      end do
      !$omp end parallel do
      call place_images(maker%images, bodies%cell, boxes)
   end subroutine update_boxes

   !> Update the boxes of a body that is turned to its angle.
   pure subroutine update_box(maker, bodies, s, boxes, is_first)
      type(box_maker_t), intent(in) :: maker
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: s
      type(boxes_t), intent(inout) :: boxes
      !> Whether its boxes have no bounds so far
      logical, intent(in) :: is_first
      real(wp) :: extent(4), direction(2)

      extent = extent_of(bodies%pieces%turned_polygon(s))
      direction = 0.0_wp
      if (maker%box(s) < 0_ip) call sine_and_cosine(bodies%angle(s), direction(2), direction(1))
      if (bodies%cell%is_periodic .and. .not. is_first) then
         call bound_in_cell(maker, bodies, s, extent, direction, boxes)
      else
         call bound_body(maker, bodies%position(:, s), s, extent, direction, boxes)
      end if
   end subroutine update_box

   !> Update the boxes of a body.
   pure subroutine bound_body(maker, position, s, extent, direction, boxes)
      type(box_maker_t), intent(in) :: maker
      !> Centre of the body [m]
      real(wp), intent(in) :: position(2)
      !> Slot of the body
      integer(ip), intent(in) :: s
      !> Extent of the turned vertices of the whole body [m]
      real(wp), intent(in) :: extent(4)
      !> Cosine and sine of its angle
      real(wp), intent(in) :: direction(2)
      type(boxes_t), intent(inout) :: boxes
      integer(ip) :: b, first, last

      b = maker%box(s)
      if (b > 0_ip) then
         call place_box(extent, maker%margin, position, boxes%bounds(:, b))
         return
      end if
      associate (cut => maker%cut(-b), tiles => maker%tiles)
         do b = 0_ip, cut%n - 1_ip
            first = tiles%first(cut%first_tile + b)
            last = tiles%first(cut%first_tile + b + 1_ip) - 1_ip
            call place_box(extent_of(turn(tiles%vertex(:, first:last), direction)), cut%padding, position, &
                           boxes%bounds(:, cut%first_box + b))
         end do
      end associate
   end subroutine bound_body

   !> Update the boxes of a body in a periodic cell to those of the copy that is nearest to its former boxes. These do
   !> not jump when it returns to the cell.
   pure subroutine bound_in_cell(maker, bodies, s, extent, direction, boxes)
      type(box_maker_t), intent(in) :: maker
      type(bodies_t), intent(in) :: bodies
      !> Slot of the body
      integer(ip), intent(in) :: s
      !> Extent of the turned vertices of the whole body [m]
      real(wp), intent(in) :: extent(4)
      !> Cosine and sine of its angle
      real(wp), intent(in) :: direction(2)
      type(boxes_t), intent(inout) :: boxes
      real(wp) :: former(4)
      integer(ip) :: first, last

      first = maker%box(s)
      last = first
      if (first < 0_ip) then
         last = maker%cut(-first)%first_box + maker%cut(-first)%n - 1_ip
         first = maker%cut(-first)%first_box
      end if
      ! All boxes of a body move together.
      former = boxes%bounds(:, first)
      call bound_body(maker, bodies%position(:, s), s, extent, direction, boxes)
      call place_near(bodies%cell, bodies%inverse_period(:, s), former, boxes%bounds(:, first:last))
   end subroutine bound_in_cell

end module polydem_box_maker
