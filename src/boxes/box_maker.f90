!> Bounding boxes of bodies.
!>
!> A body of common size has one box, the bounds of its turned vertices. The box of a much larger body, such as a long
!> wall, would overlap half the scene. A large body is therefore cut into pieces (`polydem_body_pieces`), and each piece
!> has its own box. The body itself remains one polygon.
!>
!> If two polygons share a point, their boxes share a point. For whole bodies this follows from the monotonicity of
!> rounding. Boxes of pieces are padded by a few rounding errors of the size of the body: no gap opens between them when
!> the body turns.
!>
!> For interactions with a range, all boxes can be padded by a margin. If the distance of two bodies is less than twice
!> the margin, their boxes overlap.
module polydem_box_maker
   use polydem_bodies, only: block_size, bodies_t, turn_block
   use polydem_body_pieces, only: cut_body, pieces_t
   use polydem_boxes, only: boxes_t
   use polydem_errors, only: error_t, input_error, raise
   use polydem_kinds, only: ip, wp, min_parallel_size
   use polydem_polygon, only: diameter
   use polydem_sort_reals, only: sort_reals
   use polydem_strings, only: to_text
   implicit none
   private
   public :: box_maker_t, new_box_maker, turn_and_bound, update_boxes, diameters_of

   !> Allowance for rounding, in units of epsilon times the diameter of a body
   real(wp), parameter :: roundings = 64.0_wp
   !> Greatest number of pieces of all cut bodies together
   integer(ip), parameter :: most_pieces = 200000_ip

   !> Constant data for the boxes of bodies: pieces and paddings
   type :: box_maker_t
      private
      !> Median diameter of the free bodies; huge if there is none [m]
      real(wp), public :: median_diameter = huge(1.0_wp)
      !> First box of each body, (bodies + 1)
      integer(ip), allocatable :: first_box(:)
      !> First vertex of the piece of each box, (boxes + 1); the box of a whole body has no vertices here
      integer(ip), allocatable :: piece_start(:)
      !> Vertices of the pieces in the body frame, (2, vertex) [m]
      real(wp), allocatable :: piece(:, :)
      !> Padding of each box on each side [m]
      real(wp), allocatable :: padding(:)
   end type box_maker_t

contains

   !> Cut large bodies into pieces, and make the boxes of all bodies.
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
      !> Allocated if a body is so large that it would need too many pieces
      type(error_t), allocatable, intent(inout) :: error
      !> Median diameter of the free bodies of the run, for ranks with a part of the bodies; by default that of `bodies`
      !> [m]
      real(wp), intent(in), optional :: median_diameter
      integer(ip) :: s, all_slots(bodies%n)

      if (present(median_diameter)) maker%median_diameter = median_diameter
      if (.not. present(median_diameter)) maker%median_diameter = median_of_diameters(bodies)
      call cut_bodies(maker, bodies, largest_ratio, error)
      if (allocated(error)) return
      boxes%n = maker%first_box(bodies%n + 1_ip) - 1_ip
      boxes%n_bodies = bodies%n
      boxes%one_to_one = boxes%n == bodies%n
      allocate (boxes%bounds(4, boxes%n), boxes%body(boxes%n), boxes%fixed(boxes%n), boxes%passive(boxes%n), &
                boxes%reach(boxes%n))
      allocate (maker%padding(boxes%n))
      do s = 1_ip, bodies%n
         all_slots(s) = s
         boxes%body(maker%first_box(s):maker%first_box(s + 1_ip) - 1_ip) = s
         boxes%fixed(maker%first_box(s):maker%first_box(s + 1_ip) - 1_ip) = bodies%fixed(s)
         boxes%passive(maker%first_box(s):maker%first_box(s + 1_ip) - 1_ip) = bodies%fixed(s) .or. bodies%in_halo(s)
         call set_reach(maker, s, body_shape(bodies, s), margin, boxes%reach)
      end do
      call update_boxes(maker, bodies, all_slots, boxes)
   end subroutine new_box_maker

   !> Cut the bodies that are too large. Each of the others has one piece without vertices.
   subroutine cut_bodies(maker, bodies, largest_ratio, error)
      type(box_maker_t), intent(inout) :: maker
      type(bodies_t), intent(in) :: bodies
      real(wp), intent(in) :: largest_ratio
      type(error_t), allocatable, intent(inout) :: error
      type(pieces_t) :: pieces
      real(wp) :: none(2, 0)
      integer(ip) :: s, room
      logical :: fits

      room = most_pieces
      allocate (maker%first_box(bodies%n + 1_ip))
      maker%first_box(1) = 1_ip
      do s = 1_ip, bodies%n
         call cut_body(body_shape(bodies, s), maker%median_diameter, largest_ratio, room, pieces, fits)
         if (.not. fits) then
            call refuse(bodies%id(s), diameter(body_shape(bodies, s))/maker%median_diameter, error)
            return
         end if
         room = room - (pieces%n + 1_ip - maker%first_box(s))
         if (pieces%n < maker%first_box(s)) call pieces%append(none)
         maker%first_box(s + 1_ip) = pieces%n + 1_ip
      end do
      if (bodies%n == 0_ip) then
         maker%piece_start = [1_ip]
         maker%piece = none
         return
      end if
      maker%piece_start = pieces%start(1:pieces%n + 1_ip)
      maker%piece = pieces%vertices(:, 1:pieces%start(pieces%n + 1_ip) - 1_ip)
   end subroutine cut_bodies

   !> Report a body that would need too many boxes.
   pure subroutine refuse(id, ratio, error)
      integer(ip), intent(in) :: id
      !> Diameter of the body in median diameters
      real(wp), intent(in) :: ratio
      type(error_t), allocatable, intent(inout) :: error

      call raise(error, input_error, 'body '//to_text(id)//' is '//to_text(ratio)//' times as long as the '// &
                 'median diameter of the free bodies; cut into pieces of that size, it and the bodies before it '// &
                 'need more than '//to_text(most_pieces)//' boxes; set largest_ratio in &boxes above this ratio '// &
                 'to keep it whole')
   end subroutine refuse

   !> Set the padding and the reach of the boxes of a body.
   pure subroutine set_reach(maker, s, vertices, margin, reach)
      type(box_maker_t), intent(inout) :: maker
      integer(ip), intent(in) :: s
      real(wp), intent(in) :: vertices(:, :), margin
      !> Reach of all boxes [m]
      real(wp), intent(inout) :: reach(:)
      real(wp) :: length, part
      integer(ip) :: b, first, last

      length = diameter(vertices)
      do b = maker%first_box(s), maker%first_box(s + 1_ip) - 1_ip
         first = maker%piece_start(b)
         last = maker%piece_start(b + 1_ip) - 1_ip
         maker%padding(b) = margin + merge(roundings*epsilon(1.0_wp)*length, 0.0_wp, last >= first)
         part = length
         if (last >= first) part = diameter(maker%piece(:, first:last))
         reach(b) = (0.5_wp*part + maker%padding(b))*(1.0_wp + roundings*epsilon(1.0_wp))
      end do
   end subroutine set_reach

   !> Turn bodies to their angles and update their boxes in one pass: the same as `turn_bodies` and then `update_boxes`.
   subroutine turn_and_bound(maker, moving, isa, bodies, boxes)
      !> From `new_box_maker`
      type(box_maker_t), intent(in) :: maker
      !> Slots of the bodies that may have moved since the last call
      integer(ip), intent(in) :: moving(:)
      !> Instruction set of the kernels
      integer, intent(in) :: isa
      !> Bodies; only `direction` and `turned` change
      type(bodies_t), intent(inout) :: bodies
      !> Boxes; only `bounds` changes
      type(boxes_t), intent(inout) :: boxes
      real(wp) :: extent(4, block_size)
      integer(ip) :: low, high, k

      !$omp parallel do if (size(moving) > min_parallel_size) schedule(static) default(none) &
      !$omp    shared(maker, moving, isa, bodies, boxes) private(low, high, k, extent)
      do low = 1_ip, size(moving, kind=ip), block_size
         high = min(low + block_size - 1_ip, size(moving, kind=ip))
         call turn_block(bodies, moving(low:high), isa, extent)
         do k = low, high
            call bound_body(maker, bodies, moving(k), extent(:, k - low + 1_ip), boxes)
         end do
      end do
      !$omp end parallel do
   end subroutine turn_and_bound

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
         associate (s => moving(k))
            call bound_body(maker, bodies, s, &
                            extent_of(bodies%turned(:, bodies%vertex_start(s):bodies%vertex_start(s + 1_ip) - 1_ip)), &
                            boxes)
         end associate
      end do
      !$omp end parallel do
   end subroutine update_boxes

   !> Update the boxes of a body.
   pure subroutine bound_body(maker, bodies, s, extent, boxes)
      type(box_maker_t), intent(in) :: maker
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: s
      !> Extent of the turned vertices of the whole body [m]
      real(wp), intent(in) :: extent(4)
      type(boxes_t), intent(inout) :: boxes
      integer(ip) :: b

      b = maker%first_box(s)
      if (maker%piece_start(b + 1_ip) == maker%piece_start(b)) then
         call place_box(extent, maker%padding(b), bodies%position(:, s), boxes%bounds(:, b))
         return
      end if
      do b = maker%first_box(s), maker%first_box(s + 1_ip) - 1_ip
         call place_box(extent_of(turn(maker%piece(:, maker%piece_start(b):maker%piece_start(b + 1_ip) - 1_ip), &
                                       bodies%direction(:, s))), &
                        maker%padding(b), bodies%position(:, s), boxes%bounds(:, b))
      end do
   end subroutine bound_body

   !> Box of vertices with an extent. The padding is applied before the position is added: rounding then remains
   !> monotonic.
   pure subroutine place_box(extent, padding, position, box)
      real(wp), intent(in) :: extent(4), padding, position(2)
      real(wp), intent(out) :: box(4)

      box(1:2) = position + (extent(1:2) - padding)
      box(3:4) = position + (extent(3:4) + padding)
   end subroutine place_box

   !> Least x and y and greatest x and y of vertices [m]
   pure function extent_of(vertices) result(extent)
      real(wp), intent(in) :: vertices(:, :)
      real(wp) :: extent(4)
      integer(ip) :: v

      extent(1:2) = vertices(:, 1)
      extent(3:4) = vertices(:, 1)
      do v = 2_ip, size(vertices, 2, kind=ip)
         extent(1:2) = min(extent(1:2), vertices(:, v))
         extent(3:4) = max(extent(3:4), vertices(:, v))
      end do
   end function extent_of

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

   !> Vertices of a body in the body frame
   pure function body_shape(bodies, s) result(vertices)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: s
      real(wp) :: vertices(2, bodies%vertex_start(s + 1_ip) - bodies%vertex_start(s))

      vertices = bodies%shape(:, bodies%vertex_start(s):bodies%vertex_start(s + 1_ip) - 1_ip)
   end function body_shape

   !> Median diameter of the free bodies; huge if there are none, and no body is cut [m]
   pure real(wp) function median_of_diameters(bodies)
      type(bodies_t), intent(in) :: bodies
      real(wp), allocatable :: length(:)
      integer(ip), allocatable :: ranked(:)
      integer(ip) :: n

      n = size(bodies%free, kind=ip)
      median_of_diameters = huge(1.0_wp)
      if (n == 0_ip) return
      allocate (ranked(n))
      length = diameters_of(bodies)
      call sort_reals(length, ranked)
      median_of_diameters = length(ranked((n + 1_ip)/2_ip))
   end function median_of_diameters

   !> Diameters of the free bodies, (body) [m]
   pure function diameters_of(bodies) result(length)
      !> Bodies
      type(bodies_t), intent(in) :: bodies
      real(wp), allocatable :: length(:)
      integer(ip) :: k

      allocate (length(size(bodies%free)))
      do k = 1_ip, size(bodies%free, kind=ip)
         length(k) = diameter(body_shape(bodies, bodies%free(k)))
      end do
   end function diameters_of

end module polydem_box_maker
