!> Constructed and random networks of contacts, and their dense matrices, for tests of exact friction.
module networks
   use polydem_bodies, only: bodies_t
   use polydem_body_list, only: body_list_t, new_bodies
   use polydem_contact_history, only: contact_history_t, history_kind_t, add_column
   use polydem_contact_incidence, only: incidence_t, index_contacts
   use polydem_contacts, only: contacts_t, reserve_contacts
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, wp
   use polydem_random, only: random_t
   implicit none
   private
   public :: scene_t, column_of, random_scene, lattice_of, dense_of, kkt_error

   !> Bodies with forces and velocities, and their contacts
   type :: scene_t
      !> Bodies
      type(bodies_t) :: bodies
      !> Contacts
      type(contacts_t) :: contacts
      !> Contacts of each body
      type(incidence_t) :: incidence
      !> Contact history, one pair per contact
      type(contact_history_t) :: history
   end type scene_t

contains

   !> Random squares, the first n_fixed of them fixed, with random forces, velocities and contacts.
   subroutine random_scene(n_bodies, n_fixed, n_contacts, random, scene)
      !> Number of bodies
      integer(ip), intent(in) :: n_bodies
      !> Number of fixed bodies
      integer(ip), intent(in) :: n_fixed
      !> Number of contacts, of different pairs; pairs of two fixed bodies have no contact
      integer(ip), intent(in) :: n_contacts
      !> Random numbers
      type(random_t), intent(inout) :: random
      !> The scene
      type(scene_t), intent(out) :: scene
      integer(ip) :: c, i, j
      real(wp) :: angle, missing

      call place_squares(n_bodies, n_fixed, n_bodies*(n_bodies - 1_ip)/2_ip, scene)
      call push_at_random(random, scene)
      missing = real(n_contacts, wp)
      c = 0_ip
      do i = 1_ip, n_bodies
         do j = max(i, n_fixed) + 1_ip, n_bodies
            if (c == n_contacts) exit
            if (random%uniform()*real(pairs_left(i, j), wp) > missing) cycle
            missing = missing - 1.0_wp
            c = c + 1_ip
            angle = 6.28_wp*random%uniform()
            call set_contact(scene, c, i, j, [cos(angle), sin(angle)], abs(random%normal()), &
                             1.0e-2_wp*[random%normal(), random%normal()], 1.0e-2_wp*[random%normal(), random%normal()])
         end do
      end do
      call finish(scene, c)

   contains

      !> Number of remaining pairs, including this pair
      pure integer(ip) function pairs_left(i, j)
         integer(ip), intent(in) :: i, j
         integer(ip) :: k

         pairs_left = n_bodies - j + 1_ip
         do k = i + 1_ip, n_bodies
            pairs_left = pairs_left + n_bodies - max(k, n_fixed)
         end do
      end function pairs_left

   end subroutine random_scene

   !> A column of thin plates on a fixed plate, each with a sideways force and a torque.
   subroutine column_of(n_blocks, scene)
      !> Number of free plates
      integer(ip), intent(in) :: n_blocks
      !> The scene
      type(scene_t), intent(out) :: scene
      integer(ip) :: c

      call place_squares(n_blocks + 1_ip, 1_ip, n_blocks, scene)
      do c = 1_ip, n_blocks
         scene%bodies%force(1, c + 1_ip) = 0.01_wp
         scene%bodies%torque(c + 1_ip) = 1.0e-4_wp*cos(real(c, wp))
         call set_contact(scene, c, c, c + 1_ip, [0.0_wp, -1.0_wp], 10.0_wp*real(n_blocks - c + 1_ip, wp), &
                          [0.0_wp, 1.0e-4_wp], [0.0_wp, -1.0e-4_wp])
      end do
      call finish(scene, n_blocks)
   end subroutine column_of

   !> A square lattice of squares with random forces and velocities. Each touches the next ones to the right, above and
   !> above on the right; the first row is fixed.
   subroutine lattice_of(n_columns, n_rows, random, scene)
      !> Numbers of columns and rows
      integer(ip), intent(in) :: n_columns, n_rows
      !> Random numbers
      type(random_t), intent(inout) :: random
      !> The scene
      type(scene_t), intent(out) :: scene
      integer(ip) :: c, k, s, column, row, steps(2, 3)
      real(wp) :: angle

      call place_squares(n_columns*n_rows, n_columns, 3_ip*n_columns*n_rows, scene)
      call push_at_random(random, scene)
      steps = reshape([1_ip, 0_ip, 0_ip, 1_ip, 1_ip, 1_ip], [2, 3])
      c = 0_ip
      do s = 1_ip, n_columns*n_rows
         column = mod(s - 1_ip, n_columns) + 1_ip
         row = (s - 1_ip)/n_columns + 1_ip
         do k = merge(2_ip, 1_ip, row == 1_ip), 3_ip
            if (column + steps(1, k) > n_columns .or. row + steps(2, k) > n_rows) cycle
            c = c + 1_ip
            angle = 6.28_wp*random%uniform()
            call set_contact(scene, c, s, s + steps(1, k) + n_columns*steps(2, k), [cos(angle), sin(angle)], &
                             abs(random%normal()), 1.0e-2_wp*[random%normal(), random%normal()], &
                             1.0e-2_wp*[random%normal(), random%normal()])
         end do
      end do
      call finish(scene, c)
   end subroutine lattice_of

   !> Matrix h W and slip velocities without friction, from their definition, the motion of contact points.
   subroutine dense_of(scene, dt, matrix, free_slip)
      !> Scene
      type(scene_t), intent(in) :: scene
      !> Time step [s]
      real(wp), intent(in) :: dt
      !> Matrix, (contact, contact) [m/s per N/m]
      real(wp), allocatable, intent(out) :: matrix(:, :)
      !> Slip velocities [m/s]
      real(wp), allocatable, intent(out) :: free_slip(:)
      real(wp), allocatable :: velocity(:, :)
      integer(ip) :: c, k, s

      associate (bodies => scene%bodies, contacts => scene%contacts)
         allocate (matrix(contacts%n, contacts%n), free_slip(contacts%n), velocity(3, bodies%n))
         do k = 0_ip, contacts%n
            velocity = 0.0_wp
            if (k == 0_ip) then
               do s = 1_ip, bodies%n
                  velocity(:, s) = [bodies%velocity(:, s), bodies%angular_velocity(s)]
                  if (.not. bodies%fixed(s)) velocity(:, s) = velocity(:, s) &
                     + dt*[bodies%force(:, s)*bodies%inverse_mass(s), bodies%torque(s)*bodies%inverse_inertia(s)]
               end do
            else
               call add_force(contacts%row(k)%first, 1.0_wp, contacts%row(k)%arm_first)
               call add_force(contacts%row(k)%second, -1.0_wp, contacts%row(k)%arm_second)
            end if
            do c = 1_ip, contacts%n
               if (k == 0_ip) free_slip(c) = slip(c)
               if (k > 0_ip) matrix(c, k) = slip(c)
            end do
         end do
      end associate

   contains

      !> Velocity of a free body due to a unit tangential force of contact k
      subroutine add_force(body, sign_of_force, arm)
         integer(ip), intent(in) :: body
         real(wp), intent(in) :: sign_of_force, arm(2)
         real(wp) :: force(2)

         if (scene%bodies%fixed(body)) return
         force = sign_of_force*[-scene%contacts%row(k)%direction(2), scene%contacts%row(k)%direction(1)]
         velocity(1:2, body) = dt*scene%bodies%inverse_mass(body)*force
         velocity(3, body) = dt*scene%bodies%inverse_inertia(body)*(arm(1)*force(2) - arm(2)*force(1))
      end subroutine add_force

      real(wp) function slip(c)
         integer(ip), intent(in) :: c
         real(wp) :: difference(2)

         difference = at(scene%contacts%row(c)%first, scene%contacts%row(c)%arm_first) &
            - at(scene%contacts%row(c)%second, scene%contacts%row(c)%arm_second)
         slip = scene%contacts%row(c)%direction(1)*difference(2) - scene%contacts%row(c)%direction(2)*difference(1)
      end function slip

      !> Velocity of a point of a body
      function at(body, arm) result(v)
         integer(ip), intent(in) :: body
         real(wp), intent(in) :: arm(2)
         real(wp) :: v(2)

         v = velocity(1:2, body) + velocity(3, body)*[-arm(2), arm(1)]
      end function at

   end subroutine dense_of

   !> Greatest violation of the conditions of a solution (Karush-Kuhn-Tucker): forces within their bounds, no slip below
   !> the bounds, and slip against the force at the bounds. Forces are shares of their limits; slip is a share of the
   !> greatest change of a slip velocity.
   real(wp) function kkt_error(scene, dt, friction)
      !> Scene with its friction
      type(scene_t), intent(in) :: scene
      !> Time step [s]
      real(wp), intent(in) :: dt
      !> Friction coefficient
      real(wp), intent(in) :: friction
      real(wp), allocatable :: matrix(:, :), slip(:), f(:)
      real(wp) :: scale
      integer(ip) :: c

      call dense_of(scene, dt, matrix, slip)
      f = scene%contacts%row%tangential_force
      associate (n => scene%contacts%n)
         scale = 0.0_wp
         do c = 1_ip, n
            scale = max(scale, matrix(c, c)*abs(f(c)))
            slip = slip + matrix(:, c)*f(c)
         end do
         kkt_error = 0.0_wp
         do c = 1_ip, n
            associate (limit => friction*scene%contacts%row(c)%normal_force)
               kkt_error = max(kkt_error, (abs(f(c)) - limit)/(limit + tiny(limit)))
               if (abs(f(c)) < limit) then
                  kkt_error = max(kkt_error, abs(slip(c))/scale)
               else if (limit > 0.0_wp) then
                  kkt_error = max(kkt_error, sign(slip(c), f(c)*slip(c))/scale)
               end if
            end associate
         end do
      end associate
   end function kkt_error

   !> Give all bodies random forces and velocities.
   subroutine push_at_random(random, scene)
      type(random_t), intent(inout) :: random
      type(scene_t), intent(inout) :: scene
      integer(ip) :: s

      do s = 1_ip, scene%bodies%n
         scene%bodies%velocity(:, s) = 1.0e-2_wp*[random%normal(), random%normal()]
         scene%bodies%angular_velocity(s) = random%normal()
         scene%bodies%force(:, s) = [random%normal(), random%normal()]
         scene%bodies%torque(s) = 1.0e-2_wp*random%normal()
      end do
   end subroutine push_at_random

   subroutine place_squares(n_bodies, n_fixed, n_contacts, scene)
      integer(ip), intent(in) :: n_bodies, n_fixed, n_contacts
      type(scene_t), intent(inout) :: scene
      real(wp), parameter :: square(2, 4) = 0.005_wp*reshape( &
         [-1.0_wp, -1.0_wp, 1.0_wp, -1.0_wp, 1.0_wp, 1.0_wp, -1.0_wp, 1.0_wp], [2, 4])
      type(body_list_t) :: list
      type(error_t), allocatable :: error
      integer(ip) :: s

      do s = 1_ip, n_bodies
         call list%append(square, density=1000.0_wp*real(1_ip + mod(s, 7_ip), wp), fixed=s <= n_fixed)
      end do
      call new_bodies(list, scene%bodies, error)
      call reserve_contacts(scene%contacts, n_contacts)
   end subroutine place_squares

   subroutine set_contact(scene, c, i, j, direction, normal_force, arm_first, arm_second)
      type(scene_t), intent(inout) :: scene
      integer(ip), intent(in) :: c, i, j
      real(wp), intent(in) :: direction(2), normal_force, arm_first(2), arm_second(2)

      associate (contacts => scene%contacts)
         contacts%row(c)%pair = c
         contacts%row(c)%first = i
         contacts%row(c)%second = j
         contacts%row(c)%direction = direction
         contacts%row(c)%length = 0.01_wp
         contacts%row(c)%normal = -0.01_wp*direction
         contacts%row(c)%normal_force = normal_force
         contacts%row(c)%arm_first = arm_first
         contacts%row(c)%arm_second = arm_second
      end associate
   end subroutine set_contact

   subroutine finish(scene, n_contacts)
      type(scene_t), intent(inout) :: scene
      integer(ip), intent(in) :: n_contacts

      scene%contacts%n = n_contacts
      scene%contacts%row(1:n_contacts)%tangential_force = 0.0_wp
      call add_column(scene%history, history_kind_t('tangential', 'N/m', ''), n_contacts)
      call index_contacts(scene%bodies%n, scene%contacts, scene%incidence)
   end subroutine finish

end module networks
