!> A list to which generators and readers append bodies one by one, and its conversion to the arrays of `bodies_t`.
module polydem_body_list
   use polydem_bodies, only: allocate_bodies, bodies_t, greatest_identifier, measure_bodies, turn_bodies
   use polydem_errors, only: error_t, input_error, raise
   use polydem_kinds, only: ip, lp, wp
   use polydem_piece_properties, only: join_pieces
   use polydem_polygon, only: clean_polygon, mass_properties
   use polydem_polygon_list, only: polygon_list_t
   use polydem_sort, only: ascending_order
   use polydem_strings, only: to_text
   implicit none
   private
   public :: body_list_t, new_bodies, check_mass

   !> Least mass [kg/m] and moment of inertia [kg m]; the greatest is the inverse of this. In double precision products
   !> of two such values are normal numbers; in single precision only the values themselves are.
   real(wp), parameter :: least_mass = 10.0_wp**(-min(100, range(1.0_wp)))

   !> What is given of a body
   type :: given_body_t
      !> Number in the list
      integer(ip) :: entry = 0_ip
      !> Whether it is fixed
      logical :: fixed = .false.
      !> Density [kg/m3]
      real(wp) :: density = 2500.0_wp
      !> Velocity of the centre of mass [m/s], and angular velocity [rad/s]
      real(wp) :: velocity(2) = 0.0_wp, angular_velocity = 0.0_wp
      !> Mass [kg/m] and moment of inertia [kg m], 0 if not given
      real(wp) :: mass = 0.0_wp, inertia = 0.0_wp
      !> Number of the material
      integer(ip) :: material = 0_ip
      !> First vertex of each of its pieces and the number of vertices; not allocated for one piece
      integer(ip), allocatable :: first(:)
   end type given_body_t

   !> A growing list of bodies before their mass properties are computed. One of several ranks keeps all fixed bodies
   !> and its share of the free ones; the shares of the ranks are `share` consecutive bodies in turn.
   type :: body_list_t
      !> Number of bodies in the list, including those that the rank leaves to others
      integer(ip) :: n = 0_ip
      !> Number of this rank, from 0, and number of ranks that share the free bodies
      integer(ip) :: rank = 0_ip, n_ranks = 1_ip
      !> What an identifier that is not given exceeds the position in the list by
      integer(ip) :: id_offset = 0_ip
      !> Whether the run has materials
      logical :: has_materials = .false.
      !> Greatest number of pieces of a body, including those that the rank leaves to others
      integer(ip) :: most_pieces = 1_ip
      !> Identifiers of all bodies, (n)
      integer(ip), allocatable, private :: id(:)
      !> Kept bodies, (polygons%n) or longer
      type(given_body_t), allocatable, private :: body(:)
      !> Their vertices in world coordinates
      type(polygon_list_t), private :: polygons
   contains
      procedure :: append
      procedure :: leaves_next
      procedure :: skip
      procedure :: last_id
      procedure :: greatest_id
      procedure :: kept_polygons
   end type body_list_t

   !> Number of consecutive bodies of a share
   integer(ip), parameter :: share = 256_ip

contains

   !> Append a body. The default mass of a free body is density times area. Its default moment of inertia is that of
   !> its mass spread evenly over the polygon. The default mass and moment of inertia of a fixed body are infinite.
   subroutine append(self, vertices, fixed, density, velocity, angular_velocity, id, masses, material, piece)
      class(body_list_t), intent(inout) :: self
      !> Vertices in world coordinates, clockwise or anticlockwise, those of each piece in turn, (2, vertex) [m]
      real(wp), intent(in) :: vertices(:, :)
      !> Whether the body is fixed, .false. if absent
      logical, intent(in), optional :: fixed
      !> Density, 2500 if absent [kg/m3]
      real(wp), intent(in), optional :: density
      !> Velocity of the centre of mass [m/s]
      real(wp), intent(in), optional :: velocity(2)
      !> Angular velocity [rad/s]
      real(wp), intent(in), optional :: angular_velocity
      !> Identifier; the position in the list plus `id_offset` if absent
      integer(ip), intent(in), optional :: id
      !> Mass [kg/m] and moment of inertia [kg m] instead of those of the polygon; 0: not given
      real(wp), intent(in), optional :: masses(2)
      !> Number of its material, 0 if absent
      integer(ip), intent(in), optional :: material
      !> Number of the piece of each vertex, from 0 and ascending by steps of 1; absent: one piece
      integer(ip), intent(in), optional :: piece(:)
      type(given_body_t) :: body
      type(given_body_t), allocatable :: longer(:)
      logical :: is_left

      if (present(fixed)) body%fixed = fixed
      if (present(piece)) then
         self%most_pieces = max(self%most_pieces, maxval(piece) + 1_ip)
         if (maxval(piece) > 0_ip) body%first = starts_of(piece)
      end if
      is_left = self%leaves_next() .and. .not. body%fixed
      call self%skip(id)
      if (is_left) return
      body%entry = self%n
      if (present(density)) body%density = density
      if (present(velocity)) body%velocity = velocity
      if (present(angular_velocity)) body%angular_velocity = angular_velocity
      if (present(masses)) then
         body%mass = masses(1)
         body%inertia = masses(2)
      end if
      if (present(material)) body%material = material
      associate (n => self%polygons%n)
         if (.not. allocated(self%body)) allocate (self%body(64))
         if (n == size(self%body)) then
            allocate (longer(2_ip*n))
            longer(:n) = self%body
            call move_alloc(longer, self%body)
         end if
         call self%polygons%append_polygon(vertices)
         self%body(n) = body
      end associate
   end subroutine append

   !> First vertex of each piece, and the number of vertices
   pure function starts_of(piece) result(first)
      integer(ip), intent(in) :: piece(:)
      integer(ip), allocatable :: first(:)
      integer(ip) :: v

      first = [0_ip, pack([(v, v=1_ip, size(piece, kind=ip) - 1_ip)], piece(2:) > piece(:size(piece) - 1)), &
               size(piece, kind=ip)]
   end function starts_of

   !> Whether the rank leaves the next body to another rank if it is free
   pure logical function leaves_next(self)
      class(body_list_t), intent(in) :: self

      leaves_next = modulo(self%n/share, self%n_ranks) /= self%rank
   end function leaves_next

   !> Count a body that the rank does not keep.
   subroutine skip(self, id)
      class(body_list_t), intent(inout) :: self
      !> Identifier; the position in the list plus `id_offset` if absent
      integer(ip), intent(in), optional :: id
      integer(ip), allocatable :: longer(:)

      if (.not. allocated(self%id)) allocate (self%id(64))
      if (self%n == size(self%id)) then
         allocate (longer(2*size(self%id)))
         longer(:self%n) = self%id
         call move_alloc(longer, self%id)
      end if
      self%n = self%n + 1_ip
      self%id(self%n) = self%n + self%id_offset
      if (present(id)) self%id(self%n) = id
   end subroutine skip

   !> Identifier of the last body
   pure integer(ip) function last_id(self)
      class(body_list_t), intent(in) :: self

      last_id = self%id(self%n)
   end function last_id

   !> Greatest identifier; 0 of an empty list
   pure integer(ip) function greatest_id(self)
      class(body_list_t), intent(in) :: self

      greatest_id = 0_ip
      if (self%n > 0_ip) greatest_id = maxval(self%id(:self%n))
   end function greatest_id

   !> Polygons of the pieces of the bodies that the rank keeps, as they were given
   function kept_polygons(self) result(polygons)
      class(body_list_t), intent(in) :: self
      type(polygon_list_t) :: polygons
      real(wp), allocatable :: whole(:, :)
      integer(ip) :: k, p

      polygons = self%polygons
      if (self%most_pieces == 1_ip) return
      polygons%n = 0_ip
      do k = 1_ip, self%polygons%n
         whole = self%polygons%polygon(k)
         if (.not. allocated(self%body(k)%first)) then
            call polygons%append_polygon(whole)
            cycle
         end if
         do p = 1_ip, size(self%body(k)%first, kind=ip) - 1_ip
            call polygons%append_polygon(whole(:, self%body(k)%first(p) + 1_ip:self%body(k)%first(p + 1_ip)))
         end do
      end do
   end function kept_polygons

   !> Check the polygons of the kept bodies and build the arrays, in ascending order of the identifiers, at angle 0.
   subroutine new_bodies(list, bodies, error)
      type(body_list_t), intent(in) :: list
      !> The kept bodies as a structure of arrays
      type(bodies_t), intent(out) :: bodies
      !> Allocated if a body is invalid; the message names it
      type(error_t), allocatable, intent(inout) :: error
      integer(ip), allocatable :: order(:), kept(:)
      integer(ip) :: k, s

      call rank_identifiers(list, order, error)
      if (allocated(error)) return
      allocate (kept(list%n))
      kept = 0_ip
      do k = 1_ip, list%polygons%n
         kept(list%body(k)%entry) = k
      end do
      call allocate_bodies(bodies, list%polygons%n, 16_ip*list%polygons%n)
      bodies%n_all = list%n
      if (list%n > 0_ip) bodies%last_id = list%id(order(list%n))
      if (list%has_materials) allocate (bodies%material(bodies%n))
      call check_identifiers(list, bodies, error)
      if (allocated(error)) return
      s = 0_ip
      do k = 1_ip, list%n
         if (kept(order(k)) == 0_ip) cycle
         s = s + 1_ip
         bodies%global_index(s) = k
         call place(list, kept(order(k)), s, bodies, error)
         if (.not. allocated(error)) cycle
         error%place = int(k, lp)
         return
      end do
      call finish(bodies)
   end subroutine new_bodies

   !> Find the ascending order of the identifiers of all bodies, and check that no two are equal.
   subroutine rank_identifiers(list, order, error)
      type(body_list_t), intent(in) :: list
      !> Number in the list of the body with the k-th identifier, (n)
      integer(ip), allocatable, intent(out) :: order(:)
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: k

      order = [(k, k=1_ip, list%n)]
      ! An empty list has no arrays.
      if (list%n < 2_ip) return
      if (all(list%id(2:list%n) > list%id(:list%n - 1_ip))) return
      order = ascending_order(int(list%id(:list%n), lp))
      do k = 2_ip, list%n
         if (list%id(order(k)) > list%id(order(k - 1_ip))) cycle
         call raise(error, input_error, 'body '//to_text(list%id(order(k)))// &
                    ': the identifier is used twice; each body needs its own')
         return
      end do
   end subroutine rank_identifiers

   !> Prepare for bodies of several pieces. The identifier of a piece is that of its body times the greatest number of
   !> pieces of a body, plus its number in the body.
   subroutine check_identifiers(list, bodies, error)
      type(body_list_t), intent(in) :: list
      type(bodies_t), intent(inout) :: bodies
      type(error_t), allocatable, intent(inout) :: error

      bodies%pieces%most = list%most_pieces
      if (list%most_pieces == 1_ip) return
      allocate (bodies%pieces%number(size(bodies%pieces%vertex, 2)), source=0_ip)
      if (bodies%last_id <= greatest_identifier(list%most_pieces)) return
      call raise(error, input_error, 'body '//to_text(bodies%last_id)//': with up to '//to_text(list%most_pieces)// &
                 ' pieces of a body, identifiers must be at most '//to_text(greatest_identifier(list%most_pieces))// &
                 '; number the bodies anew')
   end subroutine check_identifiers

   !> Check one body and store it in its slot.
   subroutine place(list, k, s, bodies, error)
      type(body_list_t), intent(in) :: list
      !> Number of the body among the kept bodies
      integer(ip), intent(in) :: k
      integer(ip), intent(in) :: s
      type(bodies_t), intent(inout) :: bodies
      type(error_t), allocatable, intent(inout) :: error
      real(wp), allocatable :: cleaned(:, :)
      character(len=:), allocatable :: problem
      real(wp) :: area, centroid(2), second_moment
      integer(ip), allocatable :: number(:)
      integer(ip) :: v

      bodies%id(s) = list%id(list%body(k)%entry)
      bodies%fixed(s) = list%body(k)%fixed
      if (allocated(list%body(k)%first)) then
         call join_pieces(list%polygons%polygon(k), list%body(k)%first, cleaned, number, area, centroid, &
                          second_moment, problem)
      else
         call clean_polygon(list%polygons%polygon(k), cleaned, problem)
         if (allocated(problem)) problem = 'the polygon '//problem
      end if
      if (allocated(problem)) then
         call raise(error, input_error, 'body '//to_text(bodies%id(s))//': '//problem)
         return
      end if
      associate (given => list%body(k))
         if (.not. given%density > 0.0_wp) then
            call raise(error, input_error, 'body '//to_text(bodies%id(s))//': the density must be positive')
            return
         end if
         if (bodies%fixed(s) .and. any(abs([given%velocity, given%angular_velocity]) > 0.0_wp)) then
            call raise(error, input_error, 'body '//to_text(bodies%id(s))//': it is fixed and cannot have a '// &
                       'velocity or an angular velocity; give a group &motion in the namelist to move it')
            return
         end if
         if (.not. allocated(given%first)) call mass_properties(cleaned, area, centroid, second_moment)
         bodies%position(:, s) = centroid
         bodies%velocity(:, s) = given%velocity
         bodies%angular_velocity(s) = given%angular_velocity
         if (list%has_materials) bodies%material(s) = given%material
         bodies%mass(s) = given%mass
         bodies%inertia(s) = given%inertia
         if (.not. bodies%fixed(s) .and. bodies%mass(s) <= 0.0_wp) bodies%mass(s) = given%density*area
      end associate
      call check_mass('mass', bodies%mass(s), bodies%id(s), bodies%fixed(s), error)
      if (allocated(error)) return
      if (.not. bodies%fixed(s) .and. bodies%inertia(s) <= 0.0_wp) &
         bodies%inertia(s) = bodies%mass(s)*(second_moment/area)
      call check_mass('moment of inertia', bodies%inertia(s), bodies%id(s), bodies%fixed(s), error)
      call reserve_vertices(bodies, bodies%pieces%vertex_start(s), size(cleaned, 2, kind=ip))
      do v = 1_ip, size(cleaned, 2, kind=ip)
         bodies%pieces%vertex(:, bodies%pieces%vertex_start(s) + v - 1_ip) = cleaned(:, v) - centroid
         if (allocated(number)) bodies%pieces%number(bodies%pieces%vertex_start(s) + v - 1_ip) = number(v)
      end do
      bodies%pieces%vertex_start(s + 1_ip) = bodies%pieces%vertex_start(s) + size(cleaned, 2, kind=ip)
   end subroutine place

   !> Reject a mass so small or large that its inverse or products leave the range of normal numbers. 0 is infinite and
   !> valid for fixed bodies.
   subroutine check_mass(name, mass, id, is_fixed, error)
      !> What it is, for the message
      character(len=*), intent(in) :: name
      !> The mass [kg/m], or a moment of inertia [kg m]
      real(wp), intent(in) :: mass
      !> Identifier of the body
      integer(ip), intent(in) :: id
      !> Whether it is fixed
      logical, intent(in) :: is_fixed
      !> Names the body
      type(error_t), allocatable, intent(inout) :: error

      if (mass >= least_mass .and. mass <= 1.0_wp/least_mass) return
      if (is_fixed .and. abs(mass) <= 0.0_wp) return
      call raise(error, input_error, 'body '//to_text(id)//': the '//name//' is '//to_text(mass)// &
                 ', but must be between '//to_text(least_mass)//' and '//to_text(1.0_wp/least_mass)// &
                 '; choose units that bring it into this range')
   end subroutine check_mass

   subroutine reserve_vertices(bodies, first, more)
      type(bodies_t), intent(inout) :: bodies
      integer(ip), intent(in) :: first, more
      real(wp), allocatable :: longer(:, :)
      integer(ip), allocatable :: longer_number(:)

      if (first + more - 1_ip <= size(bodies%pieces%vertex, 2)) return
      allocate (longer(2, 2_ip*(first + more)))
      longer(:, 1:first - 1_ip) = bodies%pieces%vertex(:, 1:first - 1_ip)
      call move_alloc(longer, bodies%pieces%vertex)
      if (.not. allocated(bodies%pieces%number)) return
      allocate (longer_number(2_ip*(first + more)), source=0_ip)
      longer_number(1:first - 1_ip) = bodies%pieces%number(1:first - 1_ip)
      call move_alloc(longer_number, bodies%pieces%number)
   end subroutine reserve_vertices

   subroutine finish(bodies)
      type(bodies_t), intent(inout) :: bodies
      real(wp), allocatable :: shape(:, :)
      integer(ip) :: s, n_vertices

      n_vertices = bodies%pieces%vertex_start(bodies%n + 1_ip) - 1_ip
      allocate (shape(2, n_vertices), bodies%pieces%turned(2, n_vertices))
      shape(:, :) = bodies%pieces%vertex(:, :n_vertices)
      call move_alloc(shape, bodies%pieces%vertex)
      if (bodies%pieces%most > 1_ip) bodies%pieces%number = bodies%pieces%number(:n_vertices)
      call bodies%pieces%find_pieces()
      call measure_bodies(bodies)
      bodies%free = pack([(s, s=1_ip, bodies%n)],.not. bodies%fixed)
      call turn_bodies(bodies, [(s, s=1_ip, bodies%n)])
   end subroutine finish

end module polydem_body_list
