!> Carries what never changes about bodies from one process to another: who they are, masses, shapes.
module polydem_freight
   use polydem_bodies, only: bodies_t
   use polydem_kinds, only: ip, lp, wp
   use polydem_sort, only: sort_keys
   use polydem_team, only: team_t
   implicit none
   private
   public :: freight_t, load, trade_freight, join_freights, unload

   !> Bodies one after the other
   type :: freight_t
      !> Place among all bodies of the run, identifier, number of vertices, 1 if fixed, (4, body)
      integer(lp), allocatable :: label(:, :)
      !> Mass, moment of inertia and their inverses, (4, body) [kg/m, kg m, m/kg, 1/(kg m)]
      real(wp), allocatable :: mass(:, :)
      !> Vertices in the body frame, (2, vertex) [m]
      real(wp), allocatable :: shape(:, :)
   end type freight_t

contains

   !> Take bodies from their slots.
   subroutine load(bodies, slots, freight)
      !> Bodies
      type(bodies_t), intent(in) :: bodies
      !> Slots of those to take
      integer(ip), intent(in) :: slots(:)
      !> The same bodies, in the order of the slots
      type(freight_t), intent(out) :: freight
      integer(ip) :: k, s, v, first, n

      associate (start => bodies%vertex_start)
         n = 0_ip
         do k = 1_ip, size(slots, kind=ip)
            n = n + start(slots(k) + 1_ip) - start(slots(k))
         end do
         allocate (freight%label(4, size(slots)), freight%mass(4, size(slots)), freight%shape(2, n))
         v = 0_ip
         do k = 1_ip, size(slots, kind=ip)
            s = slots(k)
            first = start(s)
            n = start(s + 1_ip) - first
            freight%label(:, k) = int([bodies%row(s), bodies%id(s), n, merge(1_ip, 0_ip, bodies%fixed(s))], lp)
            freight%mass(:, k) = [bodies%mass(s), bodies%inertia(s), bodies%inverse_mass(s), bodies%inverse_inertia(s)]
            freight%shape(:, v + 1_ip:v + n) = bodies%shape(:, first:first + n - 1_ip)
            v = v + n
         end do
      end associate
   end subroutine load

   !> Give bodies to other processes, and get theirs; collective.
   subroutine trade_freight(team, counts, freight, counts_received)
      !> Processes
      class(team_t), intent(inout) :: team
      !> Bodies for each process, (0:size - 1)
      integer(ip), intent(in) :: counts(0:)
      !> Bodies in the order of the processes they go to; afterwards of those they came from
      type(freight_t), intent(inout) :: freight
      !> Bodies from each process, (0:size - 1)
      integer(ip), allocatable, intent(out) :: counts_received(:)
      type(freight_t) :: received
      integer(ip), allocatable :: same(:)
      integer(ip) :: vertices(0:size(counts) - 1)
      integer(ip) :: k, r

      k = 0_ip
      do r = 0_ip, team%size - 1_ip
         vertices(r) = int(sum(freight%label(3, k + 1_ip:k + counts(r))), ip)
         k = k + counts(r)
      end do
      call team%trade(freight%label, counts, received%label, counts_received)
      call team%trade(freight%mass, counts, received%mass, same)
      call team%trade(freight%shape, vertices, received%shape, same)
      freight = received
   end subroutine trade_freight

   !> Put one freight behind another.
   subroutine join_freights(freight, other)
      !> First part; afterwards all
      type(freight_t), intent(inout) :: freight
      !> Second part
      type(freight_t), intent(in) :: other

      freight%label = reshape([freight%label, other%label], [4, size(freight%label, 2) + size(other%label, 2)])
      freight%mass = reshape([freight%mass, other%mass], [4, size(freight%mass, 2) + size(other%mass, 2)])
      freight%shape = reshape([freight%shape, other%shape], [2, size(freight%shape, 2) + size(other%shape, 2)])
   end subroutine join_freights

   !> Make bodies, in ascending order. What changes about them is zero, and they are fixed or move with this process.
   subroutine unload(freight, n_all, bodies, slots)
      !> Bodies in any order
      type(freight_t), intent(in) :: freight
      !> Bodies of the run
      integer(ip), intent(in) :: n_all
      !> The same bodies in ascending order
      type(bodies_t), intent(out) :: bodies
      !> Slot that each of the freight got
      integer(ip), allocatable, intent(out) :: slots(:)
      integer(lp), allocatable :: key(:), spare_key(:)
      integer(ip), allocatable :: order(:), spare(:), start(:)
      integer(ip) :: k, n, s

      n = size(freight%label, 2, kind=ip)
      allocate (key(n), spare_key(n), order(n), spare(n), start(n + 1_ip), slots(n))
      start(1) = 1_ip
      do k = 1_ip, n
         key(k) = freight%label(1, k)
         order(k) = k
         start(k + 1_ip) = start(k) + int(freight%label(3, k), ip)
      end do
      call sort_keys(n, key, order, spare_key, spare)
      bodies%n = n
      bodies%n_all = n_all
      call allocate_columns(bodies, n, start(n + 1_ip) - 1_ip)
      do s = 1_ip, n
         k = order(s)
         slots(k) = s
         call place(freight, k, start(k), s, bodies)
      end do
      bodies%free = pack([(s, s=1_ip, n)],.not. bodies%fixed)
   end subroutine unload

   subroutine allocate_columns(bodies, n, n_vertices)
      type(bodies_t), intent(inout) :: bodies
      integer(ip), intent(in) :: n, n_vertices

      allocate (bodies%id(n), bodies%row(n), bodies%vertex_start(n + 1_ip))
      allocate (bodies%fixed(n), bodies%ghost(n), source=.false.)
      allocate (bodies%mass(n), bodies%inertia(n), bodies%inverse_mass(n), bodies%inverse_inertia(n), bodies%angle(n), &
                bodies%angular_velocity(n), bodies%angular_acceleration(n), bodies%torque(n), source=0.0_wp)
      allocate (bodies%position(2, n), bodies%velocity(2, n), bodies%acceleration(2, n), bodies%force(2, n), &
                bodies%direction(2, n), source=0.0_wp)
      allocate (bodies%shape(2, n_vertices), bodies%turned(2, n_vertices), source=0.0_wp)
      bodies%vertex_start(1) = 1_ip
   end subroutine allocate_columns

   !> Put a body of the freight into its slot.
   subroutine place(freight, k, first, s, bodies)
      type(freight_t), intent(in) :: freight
      !> Place in the freight, and first of its vertices there
      integer(ip), intent(in) :: k, first
      !> Slot
      integer(ip), intent(in) :: s
      type(bodies_t), intent(inout) :: bodies
      integer(ip) :: n, v

      n = int(freight%label(3, k), ip)
      v = bodies%vertex_start(s)
      bodies%row(s) = int(freight%label(1, k), ip)
      bodies%id(s) = int(freight%label(2, k), ip)
      bodies%vertex_start(s + 1_ip) = v + n
      bodies%fixed(s) = freight%label(4, k) == 1_lp
      bodies%mass(s) = freight%mass(1, k)
      bodies%inertia(s) = freight%mass(2, k)
      bodies%inverse_mass(s) = freight%mass(3, k)
      bodies%inverse_inertia(s) = freight%mass(4, k)
      bodies%shape(:, v:v + n - 1_ip) = freight%shape(:, first:first + n - 1_ip)
   end subroutine place

end module polydem_freight
