!> Packed bodies: transfer of the constant fields and the shapes of bodies between ranks.
module polydem_packed_bodies
   use polydem_bodies, only: allocate_with_corners, bodies_t
   use polydem_body_fields, only: serialize_constants, serialize_corners, serialize_sizes, serialize_vertices
   use polydem_bodies_in_cell, only: set_cell
   use polydem_cell, only: cell_t
   use polydem_communicator, only: communicator_t
   use polydem_instruction_set, only: isa_base
   use polydem_kinds, only: ip, lp
   use polydem_migration_buffer, only: migration_buffer_t
   use polydem_serializer, only: serializer_t
   use polydem_sort, only: ascending_order
   implicit none
   private
   public :: packed_bodies_t, pack_bodies, all_to_all_bodies, copy_packed, join_packed, unpack_bodies

   !> Constant fields and shapes of a list of bodies
   type :: packed_bodies_t
      private
      !> Global index and number of vertices of each body
      type(migration_buffer_t) :: list
      !> Other constant fields
      type(migration_buffer_t) :: constants
      !> Vertices in the body frame, those of each body in order
      type(migration_buffer_t) :: vertices
      !> Number of all bodies of the run, and greatest identifier that it has used
      integer(ip) :: n_all = 0_ip, last_id = 0_ip
      !> Instruction set of the kernels that compute with the bodies
      integer :: isa = isa_base
      !> Whether the bodies have materials
      logical :: has_materials = .false.
      !> Greatest number of pieces of a body of the run
      integer(ip) :: most_pieces = 1_ip
      !> Periodic cell in which the bodies are
      type(cell_t) :: cell
   end type packed_bodies_t

contains

   !> Pack bodies.
   subroutine pack_bodies(bodies, slots, packed, room)
      !> Bodies; unchanged on return
      type(bodies_t), intent(inout) :: bodies
      !> Slots of the bodies to pack
      integer(ip), intent(in) :: slots(:)
      !> The packed bodies, in the order of the slots
      type(packed_bodies_t), intent(out) :: packed
      !> Number of bodies to join later, for which memory is reserved
      integer(ip), intent(in), optional :: room
      integer(ip), allocatable :: corners(:)

      if (present(room)) then
         packed%list%room = room
         packed%constants%room = room
         ! As many vertices as other bodies have, and at most as many as there are. More can be joined.
         packed%vertices%room = int(min(int(room, lp)*int(size(bodies%pieces%vertex, 2)/max(1_ip, bodies%n) + 1, lp), &
                                        size(bodies%pieces%vertex, 2, kind=lp)), ip)
      end if
      packed%n_all = bodies%n_all
      packed%last_id = bodies%last_id
      packed%isa = bodies%isa
      packed%has_materials = allocated(bodies%material)
      packed%most_pieces = bodies%pieces%most
      packed%cell = bodies%cell
      corners = bodies%pieces%vertex_start(2:) - bodies%pieces%vertex_start(:bodies%n)
      packed%list%slots = slots
      call serialize_list(packed%list, bodies%global_index, corners)
      packed%constants%slots = slots
      call serialize_constants(packed%constants, bodies)
      call serialize_sizes(packed%constants, bodies)
      packed%vertices%slots = vertices_of(bodies%pieces%vertex_start(slots), corners(slots))
      call serialize_vertices(packed%vertices, bodies)
   end subroutine pack_bodies

   !> Serialize the list of packed bodies.
   subroutine serialize_list(serializer, global_index, corners)
      class(serializer_t), intent(inout) :: serializer
      !> Global index and number of vertices of each body
      integer(ip), intent(inout), contiguous :: global_index(:), corners(:)

      call serializer%field('/bodies/global_index', global_index, '1', 'indices among all bodies of the run')
      call serialize_corners(serializer, corners)
   end subroutine serialize_list

   !> Indices of the vertices of some bodies
   pure function vertices_of(first, corners) result(vertices)
      !> First vertex and number of vertices of each body
      integer(ip), intent(in) :: first(:), corners(:)
      integer(ip), allocatable :: vertices(:)
      integer(ip) :: k, v, n

      allocate (vertices(sum(corners)))
      n = 0_ip
      do k = 1_ip, size(corners, kind=ip)
         do v = 0_ip, corners(k) - 1_ip
            n = n + 1_ip
            vertices(n) = first(k) + v
         end do
      end do
   end function vertices_of

   !> Read the list of packed bodies.
   subroutine read_list(packed, global_index, corners)
      type(packed_bodies_t), intent(inout) :: packed
      !> Global index and number of vertices of each packed body
      integer(ip), allocatable, intent(out) :: global_index(:), corners(:)
      integer(ip) :: k, n

      n = packed%list%n_rows
      allocate (global_index(n), corners(n))
      call packed%list%restore_to([(k, k=1_ip, n)])
      call serialize_list(packed%list, global_index, corners)
   end subroutine read_list

   !> Exchange packed bodies between ranks, all-to-all. Collective.
   subroutine all_to_all_bodies(comm, counts, packed, counts_received)
      class(communicator_t), intent(inout) :: comm
      !> Number of bodies for each rank, (0:size - 1)
      integer(ip), intent(in) :: counts(0:)
      !> Bodies in the order of their destination ranks; afterwards received bodies in the order of their source ranks
      type(packed_bodies_t), intent(inout) :: packed
      !> Number of bodies from each rank, (0:size - 1)
      integer(ip), allocatable, intent(out) :: counts_received(:)
      integer(ip), allocatable :: global_index(:), corners(:), same(:)
      integer(ip) :: vertices(0:size(counts) - 1)
      integer(ip) :: k, r

      call read_list(packed, global_index, corners)
      k = 0_ip
      do r = 0_ip, comm%size - 1_ip
         vertices(r) = sum(corners(k + 1_ip:k + counts(r)))
         k = k + counts(r)
      end do
      call packed%list%move(comm, counts, counts_received)
      call packed%constants%move(comm, counts, same)
      call packed%vertices%move(comm, vertices, same)
   end subroutine all_to_all_bodies

   !> Copy some of the packed bodies.
   subroutine copy_packed(packed, rows, copied)
      !> Packed bodies; the order is kept
      type(packed_bodies_t), intent(inout) :: packed
      !> Indices of the bodies to copy
      integer(ip), intent(in) :: rows(:)
      !> These bodies, in this order
      type(packed_bodies_t), intent(out) :: copied
      integer(ip), allocatable :: global_index(:), corners(:), first(:)
      integer(ip) :: k

      call read_list(packed, global_index, corners)
      allocate (first(size(corners)))
      if (size(first) > 0) first(1) = 1_ip
      do k = 2_ip, size(first, kind=ip)
         first(k) = first(k - 1_ip) + corners(k - 1_ip)
      end do
      call packed%list%copy_rows(rows, copied%list)
      call packed%constants%copy_rows(rows, copied%constants)
      call packed%vertices%copy_rows(vertices_of(first(rows), corners(rows)), copied%vertices)
   end subroutine copy_packed

   !> Append packed bodies to others.
   subroutine join_packed(packed, other)
      !> First part; afterwards all
      type(packed_bodies_t), intent(inout) :: packed
      !> Second part
      type(packed_bodies_t), intent(in) :: other

      call packed%list%append(other%list)
      call packed%constants%append(other%constants)
      call packed%vertices%append(other%vertices)
   end subroutine join_packed

   !> Unpack bodies in ascending order of the global index. Their variable fields are zero. Free bodies belong to this
   !> rank; none is in the halo.
   subroutine unpack_bodies(packed, bodies, slots)
      !> Packed bodies in any order; the order is kept
      type(packed_bodies_t), intent(inout) :: packed
      !> The same bodies in ascending order of the global index
      type(bodies_t), intent(out) :: bodies
      !> Slot of each packed body
      integer(ip), allocatable, intent(out) :: slots(:)
      integer(ip), allocatable :: global_index(:), corners(:), order(:)
      integer(ip) :: n, s

      call read_list(packed, global_index, corners)
      n = size(corners, kind=ip)
      order = ascending_order(int(global_index, lp))
      call allocate_with_corners(bodies, corners(order), packed%most_pieces)
      bodies%n_all = packed%n_all
      bodies%last_id = packed%last_id
      bodies%isa = packed%isa
      if (packed%has_materials) allocate (bodies%material(n))
      call set_cell(bodies, packed%cell)
      allocate (slots(n))
      slots(order) = [(s, s=1_ip, n)]
      call packed%constants%restore_to(slots)
      call serialize_constants(packed%constants, bodies)
      call serialize_sizes(packed%constants, bodies)
      bodies%global_index = global_index(order)
      call packed%vertices%restore_to(vertices_of(bodies%pieces%vertex_start(slots), corners))
      call serialize_vertices(packed%vertices, bodies)
      call bodies%pieces%find_pieces()
      bodies%free = pack([(s, s=1_ip, n)],.not. bodies%fixed)
   end subroutine unpack_bodies

end module polydem_packed_bodies
