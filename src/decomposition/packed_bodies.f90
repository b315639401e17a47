!> Packed bodies: transfer of the constant fields of bodies between ranks (identifiers, masses, shapes).
module polydem_packed_bodies
   use polydem_bodies, only: bodies_t, measure_radii
   use polydem_communicator, only: communicator_t
   use polydem_kinds, only: ip, lp, wp
   use polydem_sort, only: sort_keys
   implicit none
   private
   public :: packed_bodies_t, pack_bodies, all_to_all_bodies, join_packed, unpack_bodies

   !> Constant fields of a list of bodies
   type :: packed_bodies_t
      !> Global index, identifier, number of vertices, 1 if fixed, (4, body)
      integer(lp), allocatable :: label(:, :)
      !> Mass, moment of inertia and their inverses, (4, body) [kg/m, kg m, m/kg, 1/(kg m)]
      real(wp), allocatable :: mass(:, :)
      !> Vertices in the body frame, (2, vertex) [m]
      real(wp), allocatable :: shape(:, :)
   end type packed_bodies_t

contains

   !> Pack bodies.
   subroutine pack_bodies(bodies, slots, packed)
      type(bodies_t), intent(in) :: bodies
      !> Slots of the bodies to pack
      integer(ip), intent(in) :: slots(:)
      !> The packed bodies, in the order of the slots
      type(packed_bodies_t), intent(out) :: packed
      integer(ip) :: k, s, v, first, n

      associate (start => bodies%vertex_start)
         n = 0_ip
         do k = 1_ip, size(slots, kind=ip)
            n = n + start(slots(k) + 1_ip) - start(slots(k))
         end do
         allocate (packed%label(4, size(slots)), packed%mass(4, size(slots)), packed%shape(2, n))
         v = 0_ip
         do k = 1_ip, size(slots, kind=ip)
            s = slots(k)
            first = start(s)
            n = start(s + 1_ip) - first
            packed%label(:, k) = int([bodies%global_index(s), bodies%id(s), n, merge(1_ip, 0_ip, bodies%fixed(s))], lp)
            packed%mass(:, k) = [bodies%mass(s), bodies%inertia(s), bodies%inverse_mass(s), bodies%inverse_inertia(s)]
            packed%shape(:, v + 1_ip:v + n) = bodies%shape(:, first:first + n - 1_ip)
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
      type(packed_bodies_t) :: received
      integer(ip), allocatable :: same(:)
      integer(ip) :: vertices(0:size(counts) - 1)
      integer(ip) :: k, r

      k = 0_ip
      do r = 0_ip, comm%size - 1_ip
         vertices(r) = int(sum(packed%label(3, k + 1_ip:k + counts(r))), ip)
         k = k + counts(r)
      end do
      call comm%all_to_all(packed%label, counts, received%label, counts_received)
      call comm%all_to_all(packed%mass, counts, received%mass, same)
      call comm%all_to_all(packed%shape, vertices, received%shape, same)
      packed = received
   end subroutine all_to_all_bodies

   !> Append packed bodies to others.
   subroutine join_packed(packed, other)
      !> First part; afterwards all
      type(packed_bodies_t), intent(inout) :: packed
      !> Second part
      type(packed_bodies_t), intent(in) :: other

      packed%label = reshape([packed%label, other%label], [4, size(packed%label, 2) + size(other%label, 2)])
      packed%mass = reshape([packed%mass, other%mass], [4, size(packed%mass, 2) + size(other%mass, 2)])
      packed%shape = reshape([packed%shape, other%shape], [2, size(packed%shape, 2) + size(other%shape, 2)])
   end subroutine join_packed

   !> Unpack bodies in ascending order of the global index. Their variable fields are zero. Free bodies belong to this
   !> rank; none is in the halo.
   subroutine unpack_bodies(packed, n_all, bodies, slots)
      !> Packed bodies in any order
      type(packed_bodies_t), intent(in) :: packed
      !> Number of all bodies of the run
      integer(ip), intent(in) :: n_all
      !> The same bodies in ascending order of the global index
      type(bodies_t), intent(out) :: bodies
      !> Slot of each packed body
      integer(ip), allocatable, intent(out) :: slots(:)
      integer(lp), allocatable :: key(:), spare_key(:)
      integer(ip), allocatable :: order(:), spare(:), start(:)
      integer(ip) :: k, n, s

      n = size(packed%label, 2, kind=ip)
      allocate (key(n), spare_key(n), order(n), spare(n), start(n + 1_ip), slots(n))
      start(1) = 1_ip
      do k = 1_ip, n
         key(k) = packed%label(1, k)
         order(k) = k
         start(k + 1_ip) = start(k) + int(packed%label(3, k), ip)
      end do
      call sort_keys(n, key, order, spare_key, spare)
      bodies%n = n
      bodies%n_all = n_all
      call allocate_columns(bodies, n, start(n + 1_ip) - 1_ip)
      do s = 1_ip, n
         k = order(s)
         slots(k) = s
         call place(packed, k, start(k), s, bodies)
      end do
      bodies%free = pack([(s, s=1_ip, n)],.not. bodies%fixed)
      call measure_radii(bodies)
   end subroutine unpack_bodies

   !> Allocate all fields of bodies and set them to zero.
   subroutine allocate_columns(bodies, n, n_vertices)
      type(bodies_t), intent(inout) :: bodies
      integer(ip), intent(in) :: n, n_vertices

      allocate (bodies%id(n), bodies%global_index(n), bodies%vertex_start(n + 1_ip))
      allocate (bodies%fixed(n), bodies%in_halo(n), source=.false.)
      allocate (bodies%mass(n), bodies%inertia(n), bodies%inverse_mass(n), bodies%inverse_inertia(n), bodies%angle(n), &
                bodies%angular_velocity(n), bodies%angular_acceleration(n), bodies%torque(n), source=0.0_wp)
      allocate (bodies%position(2, n), bodies%velocity(2, n), bodies%acceleration(2, n), bodies%force(2, n), &
                source=0.0_wp)
      allocate (bodies%shape(2, n_vertices), bodies%turned(2, n_vertices), source=0.0_wp)
      bodies%vertex_start(1) = 1_ip
   end subroutine allocate_columns

   !> Store a packed body in its slot.
   subroutine place(packed, k, first, s, bodies)
      type(packed_bodies_t), intent(in) :: packed
      !> Index of the packed body, and of its first packed vertex
      integer(ip), intent(in) :: k, first
      !> Slot
      integer(ip), intent(in) :: s
      type(bodies_t), intent(inout) :: bodies
      integer(ip) :: n, v

      n = int(packed%label(3, k), ip)
      v = bodies%vertex_start(s)
      bodies%global_index(s) = int(packed%label(1, k), ip)
      bodies%id(s) = int(packed%label(2, k), ip)
      bodies%vertex_start(s + 1_ip) = v + n
      bodies%fixed(s) = packed%label(4, k) == 1_lp
      bodies%mass(s) = packed%mass(1, k)
      bodies%inertia(s) = packed%mass(2, k)
      bodies%inverse_mass(s) = packed%mass(3, k)
      bodies%inverse_inertia(s) = packed%mass(4, k)
      bodies%shape(:, v:v + n - 1_ip) = packed%shape(:, first:first + n - 1_ip)
   end subroutine place

end module polydem_packed_bodies
