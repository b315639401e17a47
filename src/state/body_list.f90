!> A list to which generators and readers append bodies one by one, and its conversion to the arrays of `bodies_t`.
module polydem_body_list
   use polydem_bodies, only: bodies_t, measure_radii, turn_bodies
   use polydem_errors, only: error_t, input_error, raise
   use polydem_instruction_set, only: isa_base
   use polydem_kinds, only: ip, lp, wp
   use polydem_polygon, only: clean_polygon, mass_properties
   use polydem_sort, only: sort_keys
   use polydem_strings, only: to_text
   implicit none
   private
   public :: body_list_t, new_bodies

   !> Default density [kg/m3]
   real(wp), parameter :: default_density = 2500.0_wp

   !> Least mass [kg/m] and moment of inertia [kg m]; the greatest is the inverse of this. In double precision products
   !> of two such values are normal numbers; in single precision only the values themselves are.
   real(wp), parameter :: least_mass = 10.0_wp**(-min(100, range(1.0_wp)))

   !> One body before its mass properties are computed
   type :: entry_t
      !> Identifier
      integer(ip) :: id = 0_ip
      !> Whether it is fixed
      logical :: fixed = .false.
      !> Vertices in world coordinates, (2, vertex) [m]
      real(wp), allocatable :: vertices(:, :)
      !> Density [kg/m3]
      real(wp) :: density = default_density
      !> Velocity of the centre of mass [m/s]
      real(wp) :: velocity(2) = 0.0_wp
      !> Angular velocity [rad/s]
      real(wp) :: angular_velocity = 0.0_wp
      !> Mass, 0 if not given [kg/m]
      real(wp) :: mass = 0.0_wp
      !> Moment of inertia, 0 if not given [kg m]
      real(wp) :: inertia = 0.0_wp
   end type entry_t

   !> A growing list of bodies
   type :: body_list_t
      !> Number of bodies in the list
      integer(ip) :: n = 0_ip
      type(entry_t), allocatable, private :: entries(:)
   contains
      procedure :: append
   end type body_list_t

contains

   !> Append a body. The default `mass` of a free body is density times area. Its default `inertia` is that of its mass
   !> spread evenly over the polygon. The default mass and moment of inertia of a fixed body are infinite.
   subroutine append(self, vertices, fixed, density, velocity, angular_velocity, id, mass, inertia)
      class(body_list_t), intent(inout) :: self
      !> Vertices in world coordinates, clockwise or anticlockwise, (2, vertex) [m]
      real(wp), intent(in) :: vertices(:, :)
      !> Whether the body is fixed, .false. if absent
      logical, intent(in), optional :: fixed
      !> Density, 2500 if absent [kg/m3]
      real(wp), intent(in), optional :: density
      !> Velocity of the centre of mass [m/s]
      real(wp), intent(in), optional :: velocity(2)
      !> Angular velocity [rad/s]
      real(wp), intent(in), optional :: angular_velocity
      !> Identifier; the position in the list if absent
      integer(ip), intent(in), optional :: id
      !> Mass instead of that of the polygon [kg/m]
      real(wp), intent(in), optional :: mass
      !> Moment of inertia instead of that of the polygon [kg m]
      real(wp), intent(in), optional :: inertia

      call make_room(self)
      self%n = self%n + 1_ip
      associate (entry => self%entries(self%n))
         entry%vertices = vertices
         entry%id = self%n
         if (present(fixed)) entry%fixed = fixed
         if (present(density)) entry%density = density
         if (present(velocity)) entry%velocity = velocity
         if (present(angular_velocity)) entry%angular_velocity = angular_velocity
         if (present(id)) entry%id = id
         if (present(mass)) entry%mass = mass
         if (present(inertia)) entry%inertia = inertia
      end associate
   end subroutine append

   !> Check every polygon and build the arrays, in ascending order of the identifiers, at angle 0.
   subroutine new_bodies(list, bodies, error)
      !> List of bodies
      type(body_list_t), intent(in) :: list
      !> The same bodies as a structure of arrays
      type(bodies_t), intent(out) :: bodies
      !> Allocated if a body is invalid; the message names it
      type(error_t), allocatable, intent(inout) :: error
      integer(lp), allocatable :: key(:), spare_key(:)
      integer(ip), allocatable :: order(:), spare(:)
      integer(ip) :: k, s

      allocate (key(list%n), spare_key(list%n), order(list%n), spare(list%n))
      do k = 1_ip, list%n
         key(k) = int(list%entries(k)%id, lp)
         order(k) = k
      end do
      call sort_keys(list%n, key, order, spare_key, spare)
      do k = 2_ip, list%n
         if (key(k) == key(k - 1_ip)) then
            call raise(error, input_error, 'body '//to_text(key(k))// &
                       ': the identifier is used twice; each body needs its own')
            return
         end if
      end do
      call allocate_bodies(bodies, list%n)
      do s = 1_ip, list%n
         call place(list%entries(order(s)), s, bodies, error)
         if (allocated(error)) return
      end do
      call finish(bodies)
   end subroutine new_bodies

   subroutine make_room(self)
      type(body_list_t), intent(inout) :: self
      type(entry_t), allocatable :: longer(:)

      if (.not. allocated(self%entries)) allocate (self%entries(64))
      if (self%n < size(self%entries)) return
      allocate (longer(2*size(self%entries)))
      longer(1:self%n) = self%entries
      call move_alloc(longer, self%entries)
   end subroutine make_room

   subroutine allocate_bodies(bodies, n)
      type(bodies_t), intent(inout) :: bodies
      integer(ip), intent(in) :: n

      bodies%n = n
      allocate (bodies%id(n), bodies%fixed(n), bodies%mass(n), bodies%inertia(n), &
                bodies%inverse_mass(n), bodies%inverse_inertia(n), bodies%position(2, n), &
                bodies%angle(n), bodies%velocity(2, n), bodies%angular_velocity(n), &
                bodies%acceleration(2, n), bodies%angular_acceleration(n), bodies%force(2, n), &
                bodies%torque(n), bodies%direction(2, n), bodies%vertex_start(n + 1_ip))
      bodies%angle = 0.0_wp
      bodies%acceleration = 0.0_wp
      bodies%angular_acceleration = 0.0_wp
      bodies%force = 0.0_wp
      bodies%torque = 0.0_wp
      bodies%vertex_start(1) = 1_ip
      allocate (bodies%shape(2, 16*n))
   end subroutine allocate_bodies

   !> Check one body and store it in its slot.
   subroutine place(entry, s, bodies, error)
      type(entry_t), intent(in) :: entry
      integer(ip), intent(in) :: s
      type(bodies_t), intent(inout) :: bodies
      type(error_t), allocatable, intent(inout) :: error
      real(wp), allocatable :: cleaned(:, :)
      character(len=:), allocatable :: problem
      real(wp) :: area, centroid(2), second_moment
      integer(ip) :: k

      call clean_polygon(entry%vertices, cleaned, problem)
      if (allocated(problem)) then
         call raise(error, input_error, 'body '//to_text(entry%id)//': the polygon '//problem)
         return
      end if
      if (.not. entry%density > 0.0_wp) then
         call raise(error, input_error, 'body '//to_text(entry%id)//': the density must be positive')
         return
      end if
      if (entry%fixed .and. any(abs([entry%velocity, entry%angular_velocity]) > 0.0_wp)) then
         call raise(error, input_error, 'body '//to_text(entry%id)//': it is fixed and cannot have a velocity '// &
                    'or an angular velocity; set motion in &scene of the namelist to move it')
         return
      end if
      call mass_properties(cleaned, area, centroid, second_moment)
      bodies%id(s) = entry%id
      bodies%fixed(s) = entry%fixed
      bodies%position(:, s) = centroid
      bodies%velocity(:, s) = entry%velocity
      bodies%angular_velocity(s) = entry%angular_velocity
      bodies%mass(s) = entry%mass
      bodies%inertia(s) = entry%inertia
      if (.not. entry%fixed .and. bodies%mass(s) <= 0.0_wp) bodies%mass(s) = entry%density*area
      call check_mass('mass', bodies%mass(s), entry, error)
      if (allocated(error)) return
      if (.not. entry%fixed .and. bodies%inertia(s) <= 0.0_wp) bodies%inertia(s) = bodies%mass(s)*(second_moment/area)
      call check_mass('moment of inertia', bodies%inertia(s), entry, error)
      call reserve_vertices(bodies, bodies%vertex_start(s), size(cleaned, 2, kind=ip))
      do k = 1_ip, size(cleaned, 2, kind=ip)
         bodies%shape(:, bodies%vertex_start(s) + k - 1_ip) = cleaned(:, k) - centroid
      end do
      bodies%vertex_start(s + 1_ip) = bodies%vertex_start(s) + size(cleaned, 2, kind=ip)
   end subroutine place

   !> Reject a mass so small or large that its inverse or products leave the range of normal numbers. 0 is infinite and
   !> valid for fixed bodies.
   subroutine check_mass(name, mass, entry, error)
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: mass
      type(entry_t), intent(in) :: entry
      type(error_t), allocatable, intent(inout) :: error

      if (mass >= least_mass .and. mass <= 1.0_wp/least_mass) return
      if (entry%fixed .and. abs(mass) <= 0.0_wp) return
      call raise(error, input_error, 'body '//to_text(entry%id)//': the '//name//' is '//to_text(mass)// &
                 ', but must be between '//to_text(least_mass)//' and '//to_text(1.0_wp/least_mass)// &
                 '; choose units that bring it into this range')
   end subroutine check_mass

   subroutine reserve_vertices(bodies, first, more)
      type(bodies_t), intent(inout) :: bodies
      integer(ip), intent(in) :: first, more
      real(wp), allocatable :: longer(:, :)

      if (first + more - 1_ip <= size(bodies%shape, 2)) return
      allocate (longer(2, 2_ip*(first + more)))
      longer(:, 1:first - 1_ip) = bodies%shape(:, 1:first - 1_ip)
      call move_alloc(longer, bodies%shape)
   end subroutine reserve_vertices

   subroutine finish(bodies)
      type(bodies_t), intent(inout) :: bodies
      integer(ip) :: s, n_vertices

      n_vertices = bodies%vertex_start(bodies%n + 1_ip) - 1_ip
      bodies%shape = bodies%shape(:, 1:n_vertices)
      allocate (bodies%turned(2, n_vertices))
      call measure_radii(bodies)
      bodies%inverse_mass = 0.0_wp
      bodies%inverse_inertia = 0.0_wp
      where (bodies%mass > 0.0_wp) bodies%inverse_mass = 1.0_wp/bodies%mass
      where (bodies%inertia > 0.0_wp) bodies%inverse_inertia = 1.0_wp/bodies%inertia
      bodies%n_all = bodies%n
      bodies%global_index = [(s, s=1_ip, bodies%n)]
      bodies%in_halo = spread(.false., 1, bodies%n)
      bodies%free = pack([(s, s=1_ip, bodies%n)],.not. bodies%fixed)
      call turn_bodies(bodies, [(s, s=1_ip, bodies%n)], isa_base)
   end subroutine finish

end module polydem_body_list
