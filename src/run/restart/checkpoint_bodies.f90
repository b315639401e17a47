!> The bodies in a checkpoint: constant fields, vertices and variable fields. A restart takes them from there, not from
!> the scene.
module polydem_checkpoint_bodies
   use polydem_bodies, only: allocate_with_corners, bodies_t, measure_bodies
   use polydem_bodies_in_cell, only: set_cell
   use polydem_body_fields, only: serialize_bodies, serialize_constants, serialize_corners, serialize_vertices
   use polydem_body_list, only: check_mass
   use polydem_cell, only: cell_t
   use polydem_communicator, only: communicator_t
   use polydem_errors, only: error_t, input_error, raise
   use polydem_kinds, only: far, ip, lp, wp
   use polydem_serializer, only: serializer_t
   use polydem_sort, only: place_in
   use polydem_strings, only: to_text
   implicit none
   private
   public :: save_bodies, read_bodies

   !> Number of bodies that are looked through at a time
   integer(lp), parameter :: most_rows = 65536_lp

   !> Bodies that a rank takes from a checkpoint
   type :: taken_t
      !> Number of all bodies, and greatest identifier
      integer(ip) :: n_all = 0_ip, last_id = 0_ip
      !> Rows of the bodies, and of their vertices, ascending
      integer(lp), allocatable :: row(:), vertex(:)
      !> Indices of the bodies among all
      integer(ip), allocatable :: index(:)
      !> Number of vertices of each body
      integer(ip), allocatable :: corners(:)
   end type taken_t

contains

   !> Save bodies.
   subroutine save_bodies(serializer, bodies)
      !> Serializer; its `error` holds a failure
      class(serializer_t), intent(inout) :: serializer
      type(bodies_t), intent(inout) :: bodies
      integer(ip), allocatable :: corners(:)
      integer(ip) :: last_id(1), most(1)

      last_id = bodies%last_id
      call serialize_last(serializer, last_id)
      most = bodies%pieces%most
      if (most(1) > 1_ip) call serializer%field('/run/most_pieces', most, '1', &
         'greatest number of pieces of a body of the run; pairs name a piece by the identifier of its body times '// &
         'this number, plus the number of the piece')
      corners = bodies%pieces%vertex_start(2:) - bodies%pieces%vertex_start(:bodies%n)
      call serialize_constants(serializer, bodies)
      call serialize_corners(serializer, corners)
      call serialize_vertices(serializer, bodies)
      call serialize_bodies(serializer, bodies)
   end subroutine save_bodies

   !> Serialize the greatest identifier, so that none is used twice.
   subroutine serialize_last(serializer, last_id)
      class(serializer_t), intent(inout) :: serializer
      !> The identifier
      integer(ip), intent(inout) :: last_id(1)

      call serializer%field('/run/last_identifier', last_id, '1', 'greatest identifier that a body has or had')
   end subroutine serialize_last

   !> Read the bodies of a rank: all fixed bodies, and a share of the free ones. The rows of /bodies stay chosen, so
   !> that columns of other objects over these bodies can follow.
   subroutine read_bodies(serializer, comm, bodies, removed)
      !> Serializer; its `error` holds a failure, also if the bodies are invalid
      class(serializer_t), intent(inout) :: serializer
      class(communicator_t), intent(in) :: comm
      !> On entry the bodies of the scene, or at least their greatest number of pieces; on return those of the
      !> checkpoint
      type(bodies_t), intent(inout) :: bodies
      !> Rows of bodies that are left out, ascending; default: none
      integer(ip), intent(in), optional :: removed(:)
      type(taken_t) :: taken
      integer(ip) :: k, last_id(1), most_pieces
      integer :: isa
      logical :: has_materials
      type(cell_t) :: cell

      call choose_bodies(serializer, comm, taken, removed)
      if (allocated(serializer%error)) return
      last_id = 0_ip
      call serialize_last(serializer, last_id)
      isa = bodies%isa
      has_materials = allocated(bodies%material)
      cell = bodies%cell
      most_pieces = bodies%pieces%most
      call allocate_with_corners(bodies, taken%corners, most_pieces)
      if (has_materials) allocate (bodies%material(bodies%n))
      bodies%n_all = taken%n_all
      bodies%last_id = max(last_id(1), taken%last_id)
      bodies%isa = isa
      call set_cell(bodies, cell)
      bodies%global_index = taken%index
      call serializer%choose_rows('/bodies/', taken%row)
      call serializer%choose_rows('/vertices/', taken%vertex)
      call serialize_constants(serializer, bodies)
      call serialize_vertices(serializer, bodies)
      call serialize_bodies(serializer, bodies)
      bodies%free = pack([(k, k=1_ip, bodies%n)],.not. bodies%fixed)
      if (.not. allocated(serializer%error)) call check_numbers(bodies, serializer%error)
      if (.not. allocated(serializer%error)) call bodies%pieces%find_pieces()
      call check_bodies(bodies, serializer%error)
      if (.not. allocated(serializer%error)) call measure_bodies(bodies)
   end subroutine read_bodies

   !> Choose the bodies that a rank takes: all fixed ones, and the free ones of one block of rows. For this it looks
   !> through all rows of a few columns, some at a time.
   subroutine choose_bodies(serializer, comm, taken, removed)
      class(serializer_t), intent(inout) :: serializer
      class(communicator_t), intent(in) :: comm
      !> The bodies
      type(taken_t), intent(out) :: taken
      !> Rows of bodies that no rank takes, ascending
      integer(ip), intent(in), optional :: removed(:)
      integer(ip), allocatable :: id(:), fixed(:), corners(:)
      logical, allocatable :: is_taken(:)
      integer(lp), allocatable :: row(:)
      integer(lp) :: n, n_vertices, vertex, first, k

      call serializer%count_rows('/bodies/id', n)
      call serializer%count_rows('/vertices/position', n_vertices)
      if (max(n, n_vertices) > int(huge(1_ip) - 1_ip, lp)) call raise(serializer%error, input_error, &
         '/bodies/id or /vertices/position has more rows than 32 bits can count')
      if (allocated(serializer%error)) return
      taken%n_all = int(n, ip)
      taken%last_id = -huge(1_ip)
      allocate (taken%row(0), taken%index(0), taken%vertex(0), taken%corners(0))
      vertex = 0_lp
      do first = 0_lp, max(0_lp, n - 1_lp), most_rows
         row = [(k, k=first + 1_lp, min(n, first + most_rows))]
         id = spread(0_ip, 1, size(row))
         fixed = id
         corners = id
         call serializer%choose_rows('/bodies/', row)
         call serializer%choose_rows('/pieces/', row)
         call serializer%field('/bodies/id', id, '1', 'identifiers')
         call serializer%field('/bodies/fixed', fixed, '1', '1: fixed')
         call serialize_corners(serializer, corners)
         if (allocated(serializer%error)) return
         if (any(corners < 3_ip) .or. vertex + sum(int(corners, lp)) > n_vertices) call raise(serializer%error, &
            input_error, '/pieces/corners has numbers that cannot be numbers of vertices')
         if (any([taken%last_id, id(:size(id) - 1)] >= id)) call raise(serializer%error, input_error, &
            '/bodies/id does not ascend')
         if (allocated(serializer%error)) return
         is_taken = fixed == 1_ip .or. ((row - 1_lp)*int(comm%size, lp))/n == int(comm%rank, lp)
         if (present(removed)) &
            is_taken(pack(removed - first, removed > first .and. removed <= first + size(row))) = .false.
         taken%row = [taken%row, pack(row, is_taken)]
         taken%corners = [taken%corners, pack(corners, is_taken)]
         call append_vertices(is_taken, corners, vertex, taken%vertex)
         if (size(id) > 0) taken%last_id = id(size(id))
      end do
      if (vertex < n_vertices) call raise(serializer%error, input_error, &
         '/pieces/corners does not add up to the rows of /vertices/position')
      taken%index = int(taken%row, ip)
      if (.not. present(removed)) return
      taken%n_all = int(n, ip) - size(removed, kind=ip)
      taken%index = [(taken%index(k) - place_in(removed, taken%index(k)) + 1_ip, k=1_lp, size(taken%index, kind=lp))]
   end subroutine choose_bodies

   !> Append the rows of the vertices of those bodies that are taken.
   subroutine append_vertices(is_taken, corners, vertex, rows)
      !> Whether each of some successive bodies is taken
      logical, intent(in) :: is_taken(:)
      !> Their numbers of vertices
      integer(ip), intent(in) :: corners(:)
      !> Number of vertices of all bodies before them; on return also of these
      integer(lp), intent(inout) :: vertex
      !> The rows so far; on return with those of these bodies
      integer(lp), allocatable, intent(inout) :: rows(:)
      integer(lp) :: more(sum(int(corners, lp), is_taken)), k
      integer :: j, n

      n = 0
      do j = 1, size(corners)
         if (is_taken(j)) then
            more(n + 1:n + corners(j)) = [(vertex + k, k=1_lp, int(corners(j), lp))]
            n = n + corners(j)
         end if
         vertex = vertex + int(corners(j), lp)
      end do
      rows = [rows, more]
   end subroutine append_vertices

   !> Check the numbers of pieces, which other programs may have changed.
   subroutine check_numbers(bodies, error)
      type(bodies_t), intent(in) :: bodies
      !> Names the body
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: s

      if (bodies%pieces%most == 1_ip) return
      do s = 1_ip, bodies%n
         associate (number => bodies%pieces%number(bodies%pieces%vertex_start(s):bodies%pieces%vertex_start(s + 1_ip) &
                                                                                 - 1_ip))
            associate (n => size(number))
               if (number(1) == 0_ip .and. number(n) < bodies%pieces%most &
                   .and. all(number(2:) == number(:n - 1) .or. number(2:) == number(:n - 1) + 1_ip)) cycle
            end associate
         end associate
         call raise(error, input_error, 'body '//to_text(bodies%id(s))//': /vertices/piece does not count its pieces')
         return
      end do
   end subroutine check_numbers

   !> Check masses and vertices, which other programs may have changed.
   subroutine check_bodies(bodies, error)
      type(bodies_t), intent(in) :: bodies
      !> Names the body
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: s

      do s = 1_ip, bodies%n
         if (allocated(error)) return
         call check_mass('mass', bodies%mass(s), bodies%id(s), bodies%fixed(s), error)
         call check_mass('moment of inertia', bodies%inertia(s), bodies%id(s), bodies%fixed(s), error)
         associate (polygon => bodies%pieces%polygon(s))
            if (.not. all(abs(polygon) <= far)) then
               call raise(error, input_error, 'body '//to_text(bodies%id(s))//': a vertex is too far away')
            else if (.not. bodies%pieces%area_of(s) > 0.0_wp) then
               call raise(error, input_error, 'body '//to_text(bodies%id(s))//': the polygon has no area')
            end if
         end associate
      end do
   end subroutine check_bodies

end module polydem_checkpoint_bodies
