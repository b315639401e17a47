!> Bounding boxes of bodies.
!>
!> A body of common size has one box, the bounds of its turned vertices. The box of a much larger body, such as a long
!> wall, would overlap half the scene. A large body is therefore cut into tiles (`polydem_body_tiles`), and each tile
!> has its own box. The body itself remains one polygon. A body of a wall that has vanished has no box.
!>
!> If two polygons share a point, their boxes share a point. For whole bodies this follows from the monotonicity of
!> rounding. Boxes of tiles are padded by a few rounding errors of the size of the body: no gap opens between them when
!> the body turns.
!>
!> For interactions with a range, all boxes can be padded by a margin. If the distance of two bodies is less than twice
!> the margin, their boxes overlap.
module polydem_box_maker
   use polydem_bodies, only: block_size, bodies_t, turn_block
   use polydem_body_tiles, only: cut_body
   use polydem_body_sizes, only: median_of_diameters
   use polydem_box_placement, only: extent_of, place_box, place_whole, turn
   use polydem_boxes, only: boxes_t
   use polydem_elementary, only: sine_and_cosine
   use polydem_errors, only: error_t, input_error, raise
   use polydem_kinds, only: ip, wp, min_parallel_size
   use polydem_polygon, only: diameter
   use polydem_polygon_list, only: polygon_list_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: box_maker_t, new_box_maker, turn_and_bound, turn_and_bound_block, place_boxes, update_boxes, &
      have_boxes_within

   !> Allowance for rounding, in units of epsilon times the diameter of a body
   real(wp), parameter :: roundings = 64.0_wp
   !> Greatest number of tiles of all cut bodies together
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
      private
      !> Median diameter of the free bodies; huge if there is none [m]
      real(wp), public :: median_diameter = huge(1.0_wp)
      !> Padding of the boxes of whole bodies on each side [m]
      real(wp) :: margin = 0.0_wp
      !> Box of each whole body, (body); for a body that is cut, minus its index in `cut`
      integer(ip), allocatable :: box(:)
      !> Bodies that are cut
      type(cut_body_t), allocatable :: cut(:)
      !> Tiles of these bodies in the body frame
      type(polygon_list_t) :: tiles
   end type box_maker_t

contains

   !> Cut large bodies into tiles, and make the boxes of all bodies.
   subroutine new_box_maker(maker, bodies, largest_ratio, margin, boxes, error, median_diameter)
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
      !> Median diameter of the free bodies of the run, for ranks with a part of the bodies; by default that of `bodies`
      !> [m]
      real(wp), intent(in), optional :: median_diameter
      integer(ip) :: s

      if (present(median_diameter)) maker%median_diameter = median_diameter
      if (.not. present(median_diameter)) maker%median_diameter = median_of_diameters(bodies)
      maker%margin = margin
      call cut_bodies(maker, bodies, largest_ratio, boxes%n, error)
      if (allocated(error)) return
      boxes%n_pieces = bodies%n
      boxes%one_to_one = boxes%n == boxes%n_pieces .and. .not. allocated(bodies%gone)
      allocate (boxes%bounds(4, boxes%n), boxes%piece(boxes%n), boxes%body(boxes%n), boxes%fixed(boxes%n), &
                boxes%passive(boxes%n), boxes%reach(boxes%n))
      do s = 1_ip, bodies%n
         call describe_boxes(maker, bodies, s, boxes)
         call update_box(maker, bodies, s, boxes)
      end do
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
      logical :: fits, is_gone

      room = most_tiles
      n_boxes = 0_ip
      n_cut = 0_ip
      allocate (maker%box(bodies%n), maker%cut(8))
      do s = 1_ip, bodies%n
         known = maker%tiles%n
         fits = .true.
         is_gone = .false.
         if (allocated(bodies%gone)) is_gone = bodies%gone(s)
         ! A body of small radius is small enough for certain.
         if (.not. is_gone .and. &
             2.0_wp*bodies%radius(s)*(1.0_wp + roundings*epsilon(1.0_wp))/maker%median_diameter > largest_ratio) &
            call cut_body(bodies%pieces%polygon(s), &
                          maker%median_diameter, largest_ratio, room, maker%tiles, fits)
         n_tiles = maker%tiles%n - known
         if (.not. fits) then
            call refuse(bodies%id(s), bodies%diameter(s)/maker%median_diameter, error)
            return
         end if
         if (n_tiles == 0_ip .and. .not. is_gone) then
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

   !> Report a body that would need too many boxes.
   pure subroutine refuse(id, ratio, error)
      integer(ip), intent(in) :: id
      !> Diameter of the body in median diameters
      real(wp), intent(in) :: ratio
      type(error_t), allocatable, intent(inout) :: error

      call raise(error, input_error, 'body '//to_text(id)//' is '//to_text(ratio)//' times as long as the '// &
                 'median diameter of the free bodies; cut into tiles of that size, it and the bodies before it '// &
                 'need more than '//to_text(most_tiles)//' boxes; set largest_ratio in &boxes above this ratio '// &
                 'to keep it whole')
   end subroutine refuse

   !> Set all but the bounds of the boxes of a body.
   pure subroutine describe_boxes(maker, bodies, s, boxes)
      type(box_maker_t), intent(in) :: maker
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: s
      type(boxes_t), intent(inout) :: boxes
      integer(ip) :: b, first, last

      b = maker%box(s)
      if (b > 0_ip) then
         call describe_box(bodies, s, bodies%diameter(s), maker%margin, b, boxes)
         return
      end if
      associate (cut => maker%cut(-b), tiles => maker%tiles)
         do b = 0_ip, cut%n - 1_ip
            first = tiles%first(cut%first_tile + b)
            last = tiles%first(cut%first_tile + b + 1_ip) - 1_ip
            call describe_box(bodies, s, diameter(tiles%vertex(:, first:last)), cut%padding, cut%first_box + b, boxes)
         end do
      end associate
   end subroutine describe_boxes

   !> Set all but the bounds of a box.
   pure subroutine describe_box(bodies, s, length, padding, b, boxes)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: s
      !> Diameter of the body or tile, and padding of the box [m]
      real(wp), intent(in) :: length, padding
      !> Index of the box
      integer(ip), intent(in) :: b
      type(boxes_t), intent(inout) :: boxes

      boxes%piece(b) = s
      boxes%body(b) = s
      boxes%fixed(b) = bodies%fixed(s)
      boxes%passive(b) = bodies%fixed(s) .or. bodies%in_halo(s)
      boxes%reach(b) = (0.5_wp*length + padding)*(1.0_wp + roundings*epsilon(1.0_wp))
   end subroutine describe_box

   !> Whether every box of some bodies lies within a zone, or within a limit of its own. Touching counts as within.
   pure logical function have_boxes_within(maker, slots, boxes, zone, limit)
      type(box_maker_t), intent(in) :: maker
      !> Slots of the bodies
      integer(ip), intent(in), contiguous :: slots(:)
      type(boxes_t), intent(in) :: boxes
      !> xmin, ymin, xmax, ymax of the zone [m]
      real(wp), intent(in) :: zone(4)
      !> xmin, ymin, xmax, ymax of the limit of each box, (4, box) [m]
      real(wp), intent(in) :: limit(:, :)
      integer(ip) :: others(block_size + 1_ip), low, high, b, k, n, first, last

      have_boxes_within = .true.
      do low = 1_ip, size(slots, kind=ip), block_size
         high = min(low + block_size - 1_ip, size(slots, kind=ip))
         call list_outside(slots(low:high), maker%box, boxes%bounds, zone, n, others)
         do k = 1_ip, n
            first = maker%box(others(k))
            last = first
            if (first < 0_ip) then
               last = maker%cut(-first)%first_box + maker%cut(-first)%n - 1_ip
               first = maker%cut(-first)%first_box
            end if
            do b = first, last
               have_boxes_within = have_boxes_within .and. &
                  (is_within(boxes%bounds(:, b), zone) .or. is_within(boxes%bounds(:, b), limit(:, b)))
            end do
         end do
      end do
   end function have_boxes_within

   !> List the bodies that are cut, and those whose box is not within a zone. There is no branch, since a processor
   !> cannot predict which bodies these are.
   pure subroutine list_outside(slots, box, bounds, zone, n, outside)
      !> Slots of the bodies, at most `block_size`
      integer(ip), intent(in), contiguous :: slots(:)
      !> Box of each body, (slot); negative if it is cut
      integer(ip), intent(in), contiguous :: box(:)
      !> Bounds of all boxes, and xmin, ymin, xmax, ymax of the zone [m]
      real(wp), intent(in), contiguous :: bounds(:, :)
      real(wp), intent(in) :: zone(4)
      !> Number and slots of the listed bodies. A slot is written before it is known to count, so there is a spare one
      integer(ip), intent(out) :: n
      integer(ip), intent(inout) :: outside(block_size + 1_ip)
      real(wp) :: room
      integer(ip) :: b, k

      n = 0_ip
      do k = 1_ip, size(slots, kind=ip)
         outside(n + 1_ip) = slots(k)
         b = max(box(slots(k)), 1_ip)
         room = min(min(bounds(1, b) - zone(1), bounds(2, b) - zone(2)), &
                    min(zone(3) - bounds(3, b), zone(4) - bounds(4, b)))
         n = n + ior(merge(0_ip, 1_ip, room >= 0.0_wp), shiftr(box(slots(k)), bit_size(n) - 1))
      end do
   end subroutine list_outside

   !> Whether a box lies within a rectangle
   pure logical function is_within(box, rectangle)
      !> xmin, ymin, xmax, ymax [m]
      real(wp), intent(in) :: box(4), rectangle(4)

      is_within = box(1) >= rectangle(1) .and. box(2) >= rectangle(2) .and. box(3) <= rectangle(3) &
                  .and. box(4) <= rectangle(4)
   end function is_within

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
         call turn_and_bound_block(maker, moving(low:min(low + block_size - 1_ip, size(moving, kind=ip))), bodies, &
                                   boxes)
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
      call place_boxes(maker, slots, extent, direction, bodies, boxes)
   end subroutine turn_and_bound_block

   !> Update the boxes of up to `block_size` bodies from the extents of their turned vertices.
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

   !> Update the boxes of the given bodies to their positions. The boxes of other bodies do not change.
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
         call update_box(maker, bodies, moving(k), boxes)
      end do
      !$omp end parallel do
   end subroutine update_boxes

   !> Update the boxes of a body that is turned to its angle.
   pure subroutine update_box(maker, bodies, s, boxes)
      type(box_maker_t), intent(in) :: maker
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: s
      type(boxes_t), intent(inout) :: boxes
      real(wp) :: extent(4), direction(2)

      extent = extent_of(bodies%pieces%turned_polygon(s))
      direction = 0.0_wp
      if (maker%box(s) < 0_ip) call sine_and_cosine(bodies%angle(s), direction(2), direction(1))
      call bound_body(maker, bodies%position(:, s), s, extent, direction, boxes)
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

end module polydem_box_maker
