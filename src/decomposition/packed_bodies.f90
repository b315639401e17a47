!> Packed bodies: transfer of the constant fields and the shapes of bodies between ranks.
module polydem_packed_bodies
   use polydem_bodies, only: allocate_bodies, bodies_t, measure_radii
   use polydem_body_fields, only: serialize_constants
   use polydem_communicator, only: communicator_t
   use polydem_kinds, only: ip, lp, wp
   use polydem_migration_buffer, only: migration_buffer_t
   use polydem_sort, only: ascending_order
   implicit none
   private
   public :: packed_bodies_t, pack_bodies, all_to_all_bodies, join_packed, unpack_bodies

   !> Constant fields and shapes of a list of bodies
   type :: packed_bodies_t
      private
      !> Constant fields of `serialize_constants`
      type(migration_buffer_t) :: constants
      !> Number of vertices, (1, body)
      integer(lp), allocatable :: corners(:, :)
      !> Vertices in the body frame, (2, vertex) [m]
      real(wp), allocatable :: shape(:, :)
   end type packed_bodies_t

contains

   !> Pack bodies.
   subroutine pack_bodies(bodies, slots, packed)
      !> Bodies; unchanged on return
      type(bodies_t), intent(inout) :: bodies
      !> Slots of the bodies to pack
      integer(ip), intent(in) :: slots(:)
      !> The packed bodies, in the order of the slots
      type(packed_bodies_t), intent(out) :: packed
      integer(ip) :: k, n, v

      packed%constants%slots = slots
      call serialize_constants(packed%constants, bodies)
      associate (start => bodies%vertex_start)
         packed%corners = reshape(int(start(slots + 1_ip) - start(slots), lp), [1, size(slots)])
         allocate (packed%shape(2, sum(packed%corners)))
         v = 0_ip
         do k = 1_ip, size(slots, kind=ip)
            n = int(packed%corners(1, k), ip)
            packed%shape(:, v + 1_ip:v + n) = bodies%shape(:, start(slots(k)):start(slots(k)) + n - 1_ip)
            v = v + n
         end do
      end associate
   end subroutine pack_bodies

   !> Exchange packed bodies between ranks, all-to-all. Collective.
   subroutine all_to_all_bodies(comm, counts, packed, counts_received)
      class(communicator_t), intent(inout) :: comm
      !> Number of bodies for each rank, (0:size - 1)
      integer(ip), intent(in) :: counts(0:)
      !> Bodies in the order of their destination ranks; afterwards received bodies in the order of their source ranks
      type(packed_bodies_t), intent(inout) :: packed
      !> Number of bodies from each rank, (0:size - 1)
      integer(ip), allocatable, intent(out) :: counts_received(:)
      integer(lp), allocatable :: corners(:, :)
      real(wp), allocatable :: shape(:, :)
      integer(ip), allocatable :: same(:)
      integer(ip) :: vertices(0:size(counts) - 1)
      integer(ip) :: k, r

      k = 0_ip
      do r = 0_ip, comm%size - 1_ip
         vertices(r) = int(sum(packed%corners(1, k + 1_ip:k + counts(r))), ip)
         k = k + counts(r)
      end do
      call packed%constants%move(comm, counts, counts_received)
      call comm%all_to_all(packed%corners, counts, corners, same)
      call comm%all_to_all(packed%shape, vertices, shape, same)
      call move_alloc(corners, packed%corners)
      call move_alloc(shape, packed%shape)
   end subroutine all_to_all_bodies

   !> Append packed bodies to others.
   subroutine join_packed(packed, other)
      !> First part; afterwards all
      type(packed_bodies_t), intent(inout) :: packed
      !> Second part
      type(packed_bodies_t), intent(in) :: other

      call packed%constants%append(other%constants)
      packed%corners = reshape([packed%corners, other%corners], [1, size(packed%corners) + size(other%corners)])
      packed%shape = reshape([packed%shape, other%shape], [2, size(packed%shape, 2) + size(other%shape, 2)])
   end subroutine join_packed

   !> Unpack bodies in ascending order of the global index. Their variable fields are zero. Free bodies belong to this
   !> rank; none is in the halo.
   subroutine unpack_bodies(packed, n_all, bodies, slots)
      !> Packed bodies in any order; the order is kept
      type(packed_bodies_t), intent(inout) :: packed
      !> Number of all bodies of the run
      integer(ip), intent(in) :: n_all
      !> The same bodies in ascending order of the global index
      type(bodies_t), intent(out) :: bodies
      !> Slot of each packed body
      integer(ip), allocatable, intent(out) :: slots(:)
      integer(ip), allocatable :: order(:), start(:)
      integer(ip) :: k, n, s

      n = size(packed%corners, kind=ip)
      call allocate_bodies(bodies, n, size(packed%shape, 2, kind=ip))
      bodies%n_all = n_all
      allocate (bodies%turned(2, size(packed%shape, 2)), source=0.0_wp)
      ! In the order of the list first: the global indices then give the slots.
      call packed%constants%restore_to([(k, k=1_ip, n)])
      call serialize_constants(packed%constants, bodies)
      order = ascending_order(int(bodies%global_index, lp))
      allocate (slots(n), start(n + 1_ip))
      slots(order) = [(s, s=1_ip, n)]
      call packed%constants%restore_to(slots)
      call serialize_constants(packed%constants, bodies)
      start(1) = 1_ip
      do k = 1_ip, n
         start(k + 1_ip) = start(k) + int(packed%corners(1, k), ip)
      end do
      do s = 1_ip, n
         associate (first => start(order(s)), last => start(order(s) + 1_ip) - 1_ip, v => bodies%vertex_start)
            v(s + 1_ip) = v(s) + last - first + 1_ip
            bodies%shape(:, v(s):v(s + 1_ip) - 1_ip) = packed%shape(:, first:last)
         end associate
      end do
      bodies%free = pack([(s, s=1_ip, n)],.not. bodies%fixed)
      call measure_radii(bodies)
   end subroutine unpack_bodies

end module polydem_packed_bodies
