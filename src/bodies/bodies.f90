!> The bodies of a simulation as a structure of arrays.
!>
!> A body moves, freely or as prescribed. It is one convex polygon or several, its pieces (`polydem_pieces`). Its *slot*
!> is its index in the arrays, which may change. Its *identifier* never changes. Slots are in ascending order of
!> identifiers.
!> Fixed bodies are on every rank; a free body is on the rank that moves it and, as a halo body, on ranks nearby.
!>
!> World coordinates of a vertex are `position + turned`. They are not stored. Vectors between two near bodies start
!> from the difference of their positions, which is exact; the precision is then independent of the distance from the
!> origin.
module polydem_bodies
   use polydem_cell, only: cell_t
   use polydem_elementary, only: sines_and_cosines
   use polydem_hash, only: mix_word
   use polydem_instruction_set, only: isa_base
   use polydem_kinds, only: ip, lp, wp, dp, min_parallel_size
   use polydem_pieces, only: pieces_t
   use polydem_polygon, only: diameter, greatest_radius, thickness
   implicit none
   private
   public :: bodies_t, piece_identifiers, greatest_identifier, allocate_bodies, allocate_with_corners, &
      measure_bodies, turn_bodies, turn_block, find_directions, block_size, measure_sizes, state_hash, &
      state_words, image_word

   !> Greatest number of bodies of a block for `turn_block`
   integer(ip), parameter :: block_size = 64_ip

   !> Structure of arrays over slots 1..n
   type :: bodies_t
      !> Number of bodies
      integer(ip) :: n = 0_ip
      !> Identifier of each slot, ascending
      integer(ip), allocatable :: id(:)
      !> Whether the body is fixed: it rests or follows a prescribed motion
      logical, allocatable :: fixed(:)
      !> Slots of the free bodies that this rank moves, ascending
      integer(ip), allocatable :: free(:)
      !> Whether the body is in the halo: a copy of a body near one of `free` that another rank moves
      logical, allocatable :: in_halo(:)
      !> Global index of each body: its position in the ascending order of all bodies of the run, from 1
      integer(ip), allocatable :: global_index(:)
      !> Number of all bodies of the run
      integer(ip) :: n_all = 0_ip
      !> Greatest identifier that a body of the run has or had
      integer(ip) :: last_id = 0_ip
      !> Instruction set of the kernels that compute with these bodies
      integer :: isa = isa_base
      !> Mass [kg/m]; an infinite mass is stored as 0
      real(wp), allocatable :: mass(:)
      !> Moment of inertia about the centre of mass [kg m]; an infinite one is stored as 0
      real(wp), allocatable :: inertia(:)
      !> Number of the material: position among the groups &material, 0 for none; not allocated if there are none
      integer(ip), allocatable :: material(:)
      !> 1/mass, 0 for infinite mass [m/kg]
      real(wp), allocatable :: inverse_mass(:)
      !> 1/inertia, 0 for infinite inertia [1/(kg m)]
      real(wp), allocatable :: inverse_inertia(:)
      !> Centre of mass, (2, slot) [m]
      real(wp), allocatable :: position(:, :)
      !> Angle since the start [rad]
      real(wp), allocatable :: angle(:)
      !> Velocity of the centre of mass, (2, slot) [m/s]
      real(wp), allocatable :: velocity(:, :)
      !> Angular velocity [rad/s]
      real(wp), allocatable :: angular_velocity(:)
      !> Acceleration of the centre of mass, (2, slot) [m/s2]
      real(wp), allocatable :: acceleration(:, :)
      !> Angular acceleration [rad/s2]
      real(wp), allocatable :: angular_acceleration(:)
      !> Periodic cell in which the bodies are
      type(cell_t) :: cell
      !> In a periodic cell the number of cells that each body has crossed along each axis: without the cell its centre
      !> would be at `position + image*cell%size`, (slot, x or y)
      integer(ip), allocatable :: image(:, :)
      !> In a sheared cell what `image` lacks: sum of the shifts of the borders that each body has crossed, (slot) [m]
      real(wp), allocatable :: shear_offset(:)
      !> In a periodic cell 1/size for each body and axis, 0 along axes along which it does not repeat, (2, slot) [1/m]
      real(wp), allocatable :: inverse_period(:, :)
      !> Works of damping and of friction on each body so far, (2, slot) [J/m]; set for a frame that has them
      real(wp), allocatable :: work(:, :)
      !> Sum of the forces, (2, slot) [N/m]. A step keeps the sums of fixed bodies only, see `total_forces`
      real(wp), allocatable :: force(:, :)
      !> Sum of the torques about the centre of mass, likewise [N]
      real(wp), allocatable :: torque(:)
      !> Polygons of the bodies
      type(pieces_t) :: pieces
      !> Greatest distance of a vertex from the centre of mass [m]
      real(wp), allocatable :: radius(:)
      !> Greatest distance between two vertices [m]
      real(wp), allocatable :: diameter(:)
      !> Twice the least distance of an edge from the centre of mass; of several pieces the least, each about its own
      !> centroid [m]
      real(wp), allocatable :: thickness(:)
      !> Whether the body is one of a wall that was removed: it has no box and meets nothing, (slot); not allocated if
      !> no wall is removed
      logical, allocatable :: removed(:)
   end type bodies_t

contains

   !> Allocate the columns of bodies and set them to zero, and reserve memory for vertices.
   subroutine allocate_bodies(bodies, n, n_vertices)
      type(bodies_t), intent(out) :: bodies
      !> Number of bodies
      integer(ip), intent(in) :: n
      !> Number of vertices for which `pieces%vertex` has memory; `pieces%turned` is not allocated
      integer(ip), intent(in) :: n_vertices

      bodies%n = n
      allocate (bodies%id(n), bodies%global_index(n), source=0_ip)
      allocate (bodies%pieces%vertex_start(n + 1_ip), source=1_ip)
      allocate (bodies%fixed(n), bodies%in_halo(n), source=.false.)
      allocate (bodies%mass(n), bodies%inertia(n), bodies%inverse_mass(n), bodies%inverse_inertia(n), &
                bodies%radius(n), bodies%diameter(n), bodies%thickness(n), bodies%angle(n), &
                bodies%angular_velocity(n), bodies%angular_acceleration(n), bodies%torque(n), source=0.0_wp)
      allocate (bodies%position(2, n), bodies%velocity(2, n), bodies%acceleration(2, n), bodies%force(2, n), &
                source=0.0_wp)
      allocate (bodies%pieces%vertex(2, n_vertices))
   end subroutine allocate_bodies

   !> Allocate the columns of bodies whose numbers of vertices are known, and set them to zero.
   subroutine allocate_with_corners(bodies, corners, most)
      type(bodies_t), intent(out) :: bodies
      !> Number of vertices of each body
      integer(ip), intent(in) :: corners(:)
      !> Greatest number of pieces of a body of the run
      integer(ip), intent(in) :: most
      integer(ip) :: s

      call allocate_bodies(bodies, size(corners, kind=ip), sum(corners))
      allocate (bodies%pieces%turned(2, sum(corners)), source=0.0_wp)
      bodies%pieces%most = most
      if (most > 1_ip) allocate (bodies%pieces%number(sum(corners)), source=0_ip)
      do s = 1_ip, bodies%n
         bodies%pieces%vertex_start(s + 1_ip) = bodies%pieces%vertex_start(s) + corners(s)
      end do
   end subroutine allocate_with_corners

   !> Greatest identifier that a body may have, so that its pieces have identifiers, too
   pure integer(ip) function greatest_identifier(most)
      !> Greatest number of pieces of a body of the run
      integer(ip), intent(in) :: most

      greatest_identifier = huge(1_ip)/most - 1_ip
   end function greatest_identifier

   !> Identifiers of all pieces: that of the body times the greatest number of pieces, plus the number in the body. They
   !> ascend; if every body has one piece, they are those of the bodies.
   pure function piece_identifiers(bodies) result(id)
      type(bodies_t), intent(in) :: bodies
      integer(ip), allocatable :: id(:)
      integer(ip) :: p

      if (bodies%pieces%most == 1_ip) then
         id = bodies%id
         return
      end if
      associate (pieces => bodies%pieces)
         allocate (id(size(pieces%body)))
         do p = 1_ip, size(id, kind=ip)
            id(p) = bodies%id(pieces%body(p))*pieces%most + (p - pieces%first(pieces%body(p)))
         end do
      end associate
   end function piece_identifiers

   !> Update `turned` of the given bodies to their angles.
   subroutine turn_bodies(bodies, slots)
      !> Bodies; only `turned` changes
      type(bodies_t), intent(inout) :: bodies
      !> Slots of the bodies that may have turned
      integer(ip), intent(in) :: slots(:)
      real(wp) :: extent(4, block_size), direction(2, block_size)
      integer(ip) :: low

      !$omp parallel do if (size(slots) > min_parallel_size) schedule(static) default(none) &
      !$omp    shared(bodies, slots) private(low, extent, direction)
      do low = 1_ip, size(slots, kind=ip), block_size
         associate (some => slots(low:min(low + block_size - 1_ip, size(slots, kind=ip))))
            call turn_block(bodies, some, extent, direction)
            if (bodies%pieces%most > 1_ip) call bodies%pieces%turn_pieces(some, direction)
         end associate
      end do
      !$omp end parallel do
   end subroutine turn_bodies

   !> Compute what follows from the masses and shapes of all bodies: sizes and inverse masses.
   subroutine measure_bodies(bodies)
      !> Bodies; only `radius`, `diameter`, `thickness`, `inverse_mass` and `inverse_inertia` change
      type(bodies_t), intent(inout) :: bodies

      call measure_sizes(bodies)
      bodies%inverse_mass = 0.0_wp
      bodies%inverse_inertia = 0.0_wp
      where (bodies%mass > 0.0_wp) bodies%inverse_mass = 1.0_wp/bodies%mass
      where (bodies%inertia > 0.0_wp) bodies%inverse_inertia = 1.0_wp/bodies%inertia
   end subroutine measure_bodies

   !> Compute the sizes of all bodies from their shapes.
   subroutine measure_sizes(bodies)
      !> Bodies; only `radius`, `diameter` and `thickness` change
      type(bodies_t), intent(inout) :: bodies
      integer(ip) :: s

      !$omp parallel do if (bodies%n > min_parallel_size) schedule(static) default(none) shared(bodies) private(s)
      do s = 1_ip, bodies%n
         associate (shape => bodies%pieces%polygon(s))
            bodies%radius(s) = greatest_radius(shape)
            bodies%diameter(s) = diameter(shape)
            if (bodies%pieces%most == 1_ip) bodies%thickness(s) = thickness(shape)
         end associate
         if (bodies%pieces%most > 1_ip) then
            associate (pieces => bodies%pieces)
               bodies%thickness(s) = minval(pieces%thickness(pieces%first(s):pieces%first(s + 1_ip) - 1_ip))
            end associate
         end if
      end do
      !$omp end parallel do
   end subroutine measure_sizes

   !> Update `turned` of up to `block_size` bodies to their angles; the caller turns their pieces, if they have several.
   !> A call for these in here costs a step 2 % of its instructions.
   subroutine turn_block(bodies, slots, extent, direction)
      !> Bodies; only `turned` of these bodies changes
      type(bodies_t), intent(inout) :: bodies
      !> Slots of the bodies
      integer(ip), intent(in) :: slots(:)
      !> Least x and y and greatest x and y of the turned vertices of each body, (4, body) [m]
      real(wp), intent(out) :: extent(4, block_size)
      !> Cosine and sine of the angle of each body, (2, body)
      real(wp), intent(out) :: direction(2, block_size)
      integer(ip) :: k

      call find_directions(bodies, slots, direction)
      do k = 1_ip, size(slots, kind=ip)
         associate (pieces => bodies%pieces, first => bodies%pieces%vertex_start(slots(k)), &
                    last => bodies%pieces%vertex_start(slots(k) + 1_ip) - 1_ip)
            call turn_vertices(last - first + 1_ip, pieces%vertex(:, first:last), direction(1, k), direction(2, k), &
                               pieces%turned(:, first:last), extent(:, k))
         end associate
      end do
   end subroutine turn_block

   !> Find cosine and sine of the angles of up to `block_size` bodies.
   subroutine find_directions(bodies, slots, direction)
      type(bodies_t), intent(in) :: bodies
      !> Slots of the bodies
      integer(ip), intent(in) :: slots(:)
      !> Cosine and sine of the angle of each body, (2, body)
      real(wp), intent(out) :: direction(2, block_size)
      real(wp) :: angle(block_size), cosine(block_size), sine(block_size)
      integer(ip) :: k, n

      n = size(slots, kind=ip)
      do k = 1_ip, n
         angle(k) = bodies%angle(slots(k))
      end do
      call sines_and_cosines(bodies%isa, angle(1:n), sine(1:n), cosine(1:n))
      do k = 1_ip, n
         direction(:, k) = [cosine(k), sine(k)]
      end do
   end subroutine find_directions

   !> Turn vertices, and find their extent.
   pure subroutine turn_vertices(n, vertex, cosine, sine, turned, extent)
      !> Number of vertices
      integer(ip), intent(in) :: n
      !> Vertices, (2, n) [m]
      real(wp), intent(in) :: vertex(2, n)
      !> Cosine and sine of the angle
      real(wp), intent(in) :: cosine, sine
      !> The turned vertices, (2, n) [m]
      real(wp), intent(out) :: turned(2, n)
      !> Their least x and y and greatest x and y [m]
      real(wp), intent(out) :: extent(4)
      real(wp) :: x, y, low(2), high(2)
      integer(ip) :: v

      low = huge(1.0_wp)
      high = -huge(1.0_wp)
      do v = 1_ip, n
         x = cosine*vertex(1, v) - sine*vertex(2, v)
         y = cosine*vertex(2, v) + sine*vertex(1, v)
         turned(1, v) = x
         turned(2, v) = y
         low(1) = min(low(1), x)
         low(2) = min(low(2), y)
         high(1) = max(high(1), x)
         high(2) = max(high(2), y)
      end do
      extent(1:2) = low
      extent(3:4) = high
   end subroutine turn_vertices

   !> Hash of the bits of every body's identifier, position, angle and velocities in identifier order.
   !>
   !> Real numbers enter in double precision. Two states with the same hash agree in every bit (up to collisions).
   pure integer(lp) function state_hash(bodies)
      !> Bodies to hash
      type(bodies_t), intent(in) :: bodies
      integer(lp) :: words(7)
      integer(ip) :: s
      integer :: k

      state_hash = int(bodies%n, lp)
      do s = 1_ip, bodies%n
         words = state_words(bodies, s)
         do k = 1, size(words)
            state_hash = mix_word(state_hash, words(k))
         end do
      end do
      if (.not. allocated(bodies%image)) return
      do s = 1_ip, bodies%n
         state_hash = mix_word(state_hash, image_word(bodies, s))
      end do
   end function state_hash

   !> Contribution of a body to the hash of the state
   pure function state_words(bodies, s) result(words)
      type(bodies_t), intent(in) :: bodies
      !> Slot of the body
      integer(ip), intent(in) :: s
      !> Bits of its identifier, position, angle and velocities
      integer(lp) :: words(7)

      words = [int(bodies%id(s), lp), bits(bodies%position(1, s)), bits(bodies%position(2, s)), bits(bodies%angle(s)), &
               bits(bodies%velocity(1, s)), bits(bodies%velocity(2, s)), bits(bodies%angular_velocity(s))]
   end function state_words

   !> Contribution of the cells that a body has crossed to the hash of the state in a periodic cell
   pure integer(lp) function image_word(bodies, s)
      type(bodies_t), intent(in) :: bodies
      !> Slot of the body
      integer(ip), intent(in) :: s

      image_word = ior(shiftl(int(bodies%image(s, 1), lp), 32), iand(int(bodies%image(s, 2), lp), 2_lp**32 - 1_lp))
   end function image_word

   !> Bits of a real number in double precision
   pure integer(lp) function bits(number)
      real(wp), intent(in) :: number

      bits = transfer(real(number, dp), 0_lp)
   end function bits

end module polydem_bodies
