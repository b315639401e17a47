!> A made-up world of bodies and contacts, whole and spread over processes by hand.
!>
!> Nothing in it moves: it is there to be written. Numbers are arbitrary, with digits in every bit.
module spread_world
   use polydem_assemble, only: assemble_forces, incidence_t, index_contacts
   use polydem_bodies, only: bodies_t, turn_bodies
   use polydem_contacts, only: contacts_t, reserve_contacts
   use polydem_hash, only: mix_word
   use polydem_kinds, only: ip, lp, wp
   implicit none
   private
   public :: world_t, whole_world, part_of_world, some_number

   !> Bodies, their contacts, and boxes
   type :: world_t
      !> Bodies with the forces of their contacts
      type(bodies_t) :: bodies
      !> Contacts
      type(contacts_t) :: contacts
      !> Slot of the body of each box
      integer(ip), allocatable :: box_body(:)
      !> A number for each box, (1, box), and for each contact
      real(wp), allocatable :: box_value(:, :), pair_value(:)
   end type world_t

   !> Number of bodies, and which of them are fixed
   integer(ip), parameter :: n_bodies = 23_ip, fixed_bodies(4) = [1_ip, 5_ip, 12_ip, 23_ip]
   !> Distances of the rows of bodies in contact
   integer(ip), parameter :: distances(3) = [1_ip, 4_ip, 7_ip]

contains

   !> The world as a process on its own has it
   subroutine whole_world(step, world)
      !> Changes all numbers
      integer(lp), intent(in) :: step
      !> The world
      type(world_t), intent(out) :: world
      logical :: here(n_bodies)

      here = .true.
      call make_world(step, here, spread(.false., 1, int(n_bodies)), world)
   end subroutine whole_world

   !> The world as a process has it: free bodies are dealt out in turns. With three processes and more the last one gets
   !> none.
   subroutine part_of_world(step, rank, n_ranks, world)
      !> Changes all numbers
      integer(lp), intent(in) :: step
      !> The process, from 0, and how many there are
      integer(ip), intent(in) :: rank, n_ranks
      !> Its own bodies, fixed ones, and those that touch its own; all contacts of its own bodies
      type(world_t), intent(out) :: world
      logical :: own(n_bodies), here(n_bodies)
      integer(ip) :: k, j, i, players

      players = n_ranks
      if (n_ranks > 2_ip) players = n_ranks - 1_ip
      own = [(mod(k, players) == rank .and. all(k /= fixed_bodies), k=1_ip, n_bodies)]
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

   !> A number between -1 and 1 with digits in every bit
   elemental real(wp) function some_number(step, row, k)
      !> Any numbers; the same ones give the same number
      integer(lp), intent(in) :: step
      integer(ip), intent(in) :: row, k

      ! No sine: compilers may take another one for some elements of an array than for others.
      some_number = scale(real(mix_word(mix_word(step, int(row, lp)), int(k, lp)), wp), -63)
   end function some_number

   subroutine make_world(step, here, ghost, world)
      integer(lp), intent(in) :: step
      !> Which of all bodies are in it, and which of all are ghosts
      logical, intent(in) :: here(:), ghost(:)
      type(world_t), intent(out) :: world
      type(incidence_t) :: incidence
      integer(ip) :: b, s

      call make_bodies(step, here, ghost, world%bodies)
      call make_contacts(step, world%bodies, world%contacts, world%pair_value)
      call index_contacts(world%bodies%n, world%contacts, incidence)
      call assemble_forces([0.0_wp, -9.81_wp], incidence, world%contacts, world%bodies)
      associate (bodies => world%bodies)
         world%box_body = [((s, b=1_ip, 1_ip + mod(bodies%row(s), 3_ip)), s=1_ip, bodies%n)]
         world%box_value = reshape([((some_number(step, bodies%row(s), b), b=1_ip, 1_ip + mod(bodies%row(s), 3_ip)), &
                                     s=1_ip, bodies%n)], [1, size(world%box_body)])
      end associate
   end subroutine make_world

   subroutine make_bodies(step, here, ghost, bodies)
      integer(lp), intent(in) :: step
      logical, intent(in) :: here(:), ghost(:)
      type(bodies_t), intent(out) :: bodies
      integer(ip) :: k, s, v

      bodies%n = int(count(here), ip)
      bodies%n_all = n_bodies
      bodies%row = pack([(k, k=1_ip, n_bodies)], here)
      bodies%id = 10_ip*bodies%row
      bodies%ghost = pack(ghost, here)
      bodies%fixed = [(any(bodies%row(s) == fixed_bodies), s=1_ip, bodies%n)]
      bodies%free = pack([(s, s=1_ip, bodies%n)], .not. bodies%fixed .and. .not. bodies%ghost)
      bodies%mass = merge(0.0_wp, 1.0_wp + real(bodies%row, wp)/7.0_wp, bodies%fixed)
      bodies%inertia = bodies%mass/3.0_wp
      bodies%angle = some_number(step, bodies%row, 1_ip)
      bodies%angular_velocity = some_number(step, bodies%row, 2_ip)
      allocate (bodies%position(2, bodies%n), bodies%velocity(2, bodies%n), bodies%force(2, bodies%n), &
                bodies%torque(bodies%n), bodies%vertex_start(bodies%n + 1), bodies%direction(2, bodies%n))
      bodies%vertex_start(1) = 1_ip
      do s = 1_ip, bodies%n
         bodies%position(:, s) = some_number(step, bodies%row(s), [3_ip, 4_ip])
         bodies%velocity(:, s) = some_number(step, bodies%row(s), [5_ip, 6_ip])
         bodies%vertex_start(s + 1) = bodies%vertex_start(s) + 3_ip + mod(bodies%row(s), 4_ip)
      end do
      v = bodies%vertex_start(bodies%n + 1) - 1_ip
      allocate (bodies%shape(2, v), bodies%turned(2, v))
      do s = 1_ip, bodies%n
         do v = bodies%vertex_start(s), bodies%vertex_start(s + 1) - 1_ip
            bodies%shape(:, v) = some_number(0_lp, bodies%row(s), [7_ip, 8_ip]*(v - bodies%vertex_start(s) + 1_ip))
         end do
      end do
      call turn_bodies(bodies, [(s, s=1_ip, bodies%n)])
   end subroutine make_bodies

   !> Contacts of this process' own bodies, in ascending order
   subroutine make_contacts(step, bodies, contacts, value)
      integer(lp), intent(in) :: step
      type(bodies_t), intent(in) :: bodies
      type(contacts_t), intent(out) :: contacts
      real(wp), allocatable, intent(out) :: value(:)
      logical :: passive(bodies%n)
      integer(ip) :: c, i, j, code

      passive = bodies%fixed .or. bodies%ghost
      contacts%has_twist = .true.
      call reserve_contacts(contacts, 3_ip*bodies%n)
      do i = 1_ip, bodies%n
         do j = i + 1_ip, bodies%n
            if (all(bodies%row(j) - bodies%row(i) /= distances)) cycle
            if (passive(i) .and. passive(j)) cycle
            contacts%n = contacts%n + 1_ip
            c = contacts%n
            contacts%first(c) = i
            contacts%second(c) = j
            code = 100_ip*bodies%row(i) + bodies%row(j)
            contacts%area(c) = some_number(step, code, 1_ip)
            contacts%normal(:, c) = some_number(step, code, [2_ip, 3_ip])
            contacts%arm_first(:, c) = some_number(step, code, [4_ip, 5_ip])
            contacts%arm_second(:, c) = some_number(step, code, [6_ip, 7_ip])
            contacts%direction(:, c) = some_number(step, code, [8_ip, 9_ip])
            contacts%lever(c) = some_number(step, code, 10_ip)
            contacts%normal_force(c) = some_number(step, code, 11_ip)
            contacts%tangential_force(c) = some_number(step, code, 12_ip)
            contacts%twist(c) = some_number(step, code, 13_ip)
         end do
      end do
      value = contacts%tangential_force(:contacts%n)
   end subroutine make_contacts

end module spread_world
