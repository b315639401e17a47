!> An artificial state of bodies and contacts, complete or distributed over ranks by hand.
!>
!> It is only written to files. Its numbers are arbitrary and use all bits.
module spread_world
   use polydem_bodies, only: bodies_t, measure_sizes, turn_bodies
   use polydem_contacts, only: contacts_t, reserve_contacts
   use polydem_force_sums, only: assemble_forces, force_sums_t
   use polydem_hash, only: mix_word
   use polydem_kinds, only: ip, lp, wp
   implicit none
   private
   public :: world_t, whole_world, part_of_world, some_number

   !> Bodies and their contacts
   type :: world_t
      !> Bodies with the forces of their contacts
      type(bodies_t) :: bodies
      !> Contacts
      type(contacts_t) :: contacts
      !> A number for each contact
      real(wp), allocatable :: pair_value(:)
   end type world_t

   !> Number of bodies, and numbers of the fixed ones
   integer(ip), parameter :: n_bodies = 23_ip, fixed_bodies(4) = [1_ip, 5_ip, 12_ip, 23_ip]
   !> Differences of the global indices of bodies in contact
   integer(ip), parameter :: distances(3) = [1_ip, 4_ip, 7_ip]

contains

   !> The complete state
   subroutine whole_world(step, world)
      !> Number of the step; it changes all numbers
      integer(lp), intent(in) :: step
      !> The world
      type(world_t), intent(out) :: world
      logical :: here(n_bodies)

      here = .true.
      call make_world(step, here, spread(.false., 1, int(n_bodies)), world)
   end subroutine whole_world

   !> The part of the state of one rank. Free bodies are assigned round-robin. With three or more ranks the last rank
   !> has no free bodies.
   subroutine part_of_world(step, rank, n_ranks, world)
      !> Number of the step; it changes all numbers
      integer(lp), intent(in) :: step
      !> The rank, from 0, and the number of ranks
      integer(ip), intent(in) :: rank, n_ranks
      !> Own bodies, fixed bodies, and bodies in contact with own bodies; all contacts of own bodies
      type(world_t), intent(out) :: world
      logical :: own(n_bodies), here(n_bodies)
      integer(ip) :: k, j, i, n_active

      n_active = n_ranks
      if (n_ranks > 2_ip) n_active = n_ranks - 1_ip
      own = [(mod(k, n_active) == rank .and. all(k /= fixed_bodies), k=1_ip, n_bodies)]
      here = own
      here(fixed_bodies) = .true.
      do k = 1_ip, size(distances, kind=ip)
         do i = 1_ip, n_bodies - distances(k)
            j = i + distances(k)
            if (own(i)) here(j) = .true.
            if (own(j)) here(i) = .true.
         end do
      end do
      call make_world(step, here, here .and. .not. own .and. [(all(k /= fixed_bodies), k=1_ip, n_bodies)], world)
   end subroutine part_of_world

   !> A pseudo-random number between -1 and 1 that uses all bits
   elemental real(wp) function some_number(step, row, k)
      !> Any numbers; they determine the result
      integer(lp), intent(in) :: step
      integer(ip), intent(in) :: row, k

      ! A sine is not suitable: compilers may use different implementations for different elements of an array.
      some_number = scale(real(mix_word(mix_word(step, int(row, lp)), int(k, lp)), wp), -63)
   end function some_number

   subroutine make_world(step, here, in_halo, world)
      integer(lp), intent(in) :: step
      !> Whether each body is present on this rank, and whether it is a halo body, (global index)
      logical, intent(in) :: here(:), in_halo(:)
      type(world_t), intent(out) :: world
      type(force_sums_t) :: sums

      call make_bodies(step, here, in_halo, world%bodies)
      call make_contacts(step, world%bodies, world%contacts, world%pair_value)
      call assemble_forces([0.0_wp, -9.81_wp], world%contacts, world%bodies, sums)
   end subroutine make_world

   subroutine make_bodies(step, here, in_halo, bodies)
      integer(lp), intent(in) :: step
      logical, intent(in) :: here(:), in_halo(:)
      type(bodies_t), intent(out) :: bodies
      integer(ip) :: k, s, v

      bodies%n = int(count(here), ip)
      bodies%n_all = n_bodies
      bodies%global_index = pack([(k, k=1_ip, n_bodies)], here)
      bodies%id = 10_ip*bodies%global_index
      bodies%in_halo = pack(in_halo, here)
      bodies%fixed = [(any(bodies%global_index(s) == fixed_bodies), s=1_ip, bodies%n)]
      bodies%free = pack([(s, s=1_ip, bodies%n)], mask=.not. (bodies%fixed .or. bodies%in_halo))
      bodies%mass = merge(0.0_wp, 1.0_wp + real(bodies%global_index, wp)/7.0_wp, bodies%fixed)
      bodies%inertia = bodies%mass/3.0_wp
      bodies%angle = some_number(step, bodies%global_index, 1_ip)
      bodies%angular_velocity = some_number(step, bodies%global_index, 2_ip)
      allocate (bodies%position(2, bodies%n), bodies%velocity(2, bodies%n), bodies%force(2, bodies%n), &
                bodies%torque(bodies%n), bodies%pieces%vertex_start(bodies%n + 1), bodies%radius(bodies%n), &
                bodies%diameter(bodies%n), bodies%thickness(bodies%n))
      bodies%pieces%vertex_start(1) = 1_ip
      do s = 1_ip, bodies%n
         bodies%position(:, s) = some_number(step, bodies%global_index(s), [3_ip, 4_ip])
         bodies%velocity(:, s) = some_number(step, bodies%global_index(s), [5_ip, 6_ip])
         bodies%pieces%vertex_start(s + 1) = bodies%pieces%vertex_start(s) + 3_ip + mod(bodies%global_index(s), 4_ip)
      end do
      v = bodies%pieces%vertex_start(bodies%n + 1) - 1_ip
      allocate (bodies%pieces%vertex(2, v), bodies%pieces%turned(2, v))
      do s = 1_ip, bodies%n
         do v = bodies%pieces%vertex_start(s), bodies%pieces%vertex_start(s + 1) - 1_ip
            bodies%pieces%vertex(:, v) = some_number(0_lp, bodies%global_index(s), &
                                             [7_ip, 8_ip]*(v - bodies%pieces%vertex_start(s) + 1_ip))
         end do
      end do
      call measure_sizes(bodies)
      call turn_bodies(bodies, [(s, s=1_ip, bodies%n)])
   end subroutine make_bodies

   !> Contacts of the bodies that this rank owns, in ascending order
   subroutine make_contacts(step, bodies, contacts, value)
      integer(lp), intent(in) :: step
      type(bodies_t), intent(in) :: bodies
      type(contacts_t), intent(out) :: contacts
      real(wp), allocatable, intent(out) :: value(:)
      logical :: passive(bodies%n)
      integer(ip) :: c, i, j, code

      passive = bodies%fixed .or. bodies%in_halo
      contacts%has_couple = .true.
      call reserve_contacts(contacts, 3_ip*bodies%n)
      do i = 1_ip, bodies%n
         do j = i + 1_ip, bodies%n
            if (all(bodies%global_index(j) - bodies%global_index(i) /= distances)) cycle
            if (passive(i) .and. passive(j)) cycle
            contacts%n = contacts%n + 1_ip
            c = contacts%n
            contacts%row(c)%pair = c
            contacts%row(c)%first = i
            contacts%row(c)%second = j
            code = 100_ip*bodies%global_index(i) + bodies%global_index(j)
            contacts%row(c)%area = some_number(step, code, 1_ip)
            contacts%row(c)%normal = some_number(step, code, [2_ip, 3_ip])
            contacts%row(c)%arm_first = some_number(step, code, [4_ip, 5_ip])
            contacts%row(c)%arm_second = some_number(step, code, [6_ip, 7_ip])
            contacts%row(c)%direction = some_number(step, code, [8_ip, 9_ip])
            contacts%row(c)%lever = some_number(step, code, 10_ip)
            contacts%row(c)%normal_force = some_number(step, code, 11_ip)
            contacts%row(c)%tangential_force = some_number(step, code, 12_ip)
            contacts%row(c)%couple = some_number(step, code, 13_ip)
         end do
      end do
      value = contacts%row(:contacts%n)%tangential_force
   end subroutine make_contacts

end module spread_world
