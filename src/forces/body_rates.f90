!> What a free body has to book in a step: powers of the forces of its contacts, and what it gets from outside; and
!> what it has.
!>
!> The power of a force between two free bodies, f . (v1 - v2), is booked in two shares: f . v1 by the first and
!> -f . v2 by the second. So a body needs no velocity but its own, and whoever moves it can book it; the shares add up
!> to the power. A contact with a fixed body, whose velocity everybody knows, is booked wholly by the free one, with
!> the power, force and torque of the fixed body, which are zero elsewhere.
module polydem_body_rates
   use polydem_assemble, only: incidence_t
   use polydem_bodies, only: bodies_t
   use polydem_contacts, only: contacts_t
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: n_books, n_wall_books, n_motions, add_rates, elastic_energy_of, motion_of

   !> Books of a body: powers of the elastic normal forces, of damping with that of tilts, and of the tangential forces
   !> [W/m]
   integer, parameter :: n_books = 3
   !> Books of what fixed bodies do to a body: power [W/m]; force along x and y [N/m]; torque about the origin [N]; sums
   !> over contacts of the absolute values of forces [N/m] and torques [N]
   integer, parameter :: n_wall_books = 6
   !> Numbers of `motion_of`
   integer, parameter :: n_motions = 5

contains

   !> Add a multiple of the rates of this moment to the books of a free body.
   pure subroutine add_rates(bodies, incidence, contacts, s, weight, book, wall_book)
      !> Bodies
      type(bodies_t), intent(in) :: bodies
      !> Index of the contacts
      type(incidence_t), intent(in) :: incidence
      !> Contacts with their forces
      type(contacts_t), intent(in) :: contacts
      !> Slot of the body
      integer(ip), intent(in) :: s
      !> The multiple
      real(wp), intent(in) :: weight
      !> Its books, (n_books)
      real(wp), intent(inout) :: book(n_books)
      !> Its books of fixed bodies, (n_wall_books)
      real(wp), intent(inout) :: wall_book(n_wall_books)
      real(wp) :: power(n_books)
      integer(ip) :: c, k

      power = 0.0_wp
      do k = incidence%start_second(s), incidence%start_second(s + 1_ip) - 1_ip
         c = incidence%contact(k)
         call add_power(bodies, contacts, c, s, -1.0_wp, contacts%arm_second(:, c), power)
         if (bodies%fixed(contacts%first(c))) call add_wall(bodies, contacts, c, contacts%first(c), -1.0_wp, weight, &
            contacts%arm_first(:, c), power, wall_book)
      end do
      do c = incidence%start_first(s), incidence%start_first(s + 1_ip) - 1_ip
         call add_power(bodies, contacts, c, s, 1.0_wp, contacts%arm_first(:, c), power)
         if (bodies%fixed(contacts%second(c))) call add_wall(bodies, contacts, c, contacts%second(c), 1.0_wp, weight, &
            contacts%arm_second(:, c), power, wall_book)
      end do
      book = book + weight*power
   end subroutine add_rates

   !> What of the elastic energy of its contacts belongs to a free body [J/m]: half, or all if the other one is fixed
   pure real(wp) function elastic_energy_of(bodies, incidence, contacts, s) result(energy)
      !> Bodies
      type(bodies_t), intent(in) :: bodies
      !> Index of the contacts
      type(incidence_t), intent(in) :: incidence
      !> Contacts with their forces, whose energy is half of elastic force times area/length
      type(contacts_t), intent(in) :: contacts
      !> Slot of the body
      integer(ip), intent(in) :: s
      integer(ip) :: c, k

      energy = 0.0_wp
      do k = incidence%start_second(s), incidence%start_second(s + 1_ip) - 1_ip
         c = incidence%contact(k)
         energy = energy + merge(0.5_wp, 0.25_wp, bodies%fixed(contacts%first(c))) &
            *contacts%elastic(c)*contacts%area(c)/contacts%length(c)
      end do
      do c = incidence%start_first(s), incidence%start_first(s + 1_ip) - 1_ip
         energy = energy + merge(0.5_wp, 0.25_wp, bodies%fixed(contacts%second(c))) &
            *contacts%elastic(c)*contacts%area(c)/contacts%length(c)
      end do
   end function elastic_energy_of

   !> Kinetic energy [J/m], potential [J/m], momentum along x and y [N s/m] and angular momentum about the origin [N s]
   !> of a free body
   pure function motion_of(gravity, bodies, s) result(values)
      !> Acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      !> Bodies
      type(bodies_t), intent(in) :: bodies
      !> Slot of the body
      integer(ip), intent(in) :: s
      real(wp) :: values(n_motions)

      associate (m => bodies%mass(s), v => bodies%velocity(:, s), x => bodies%position(:, s), &
                 spin => bodies%inertia(s)*bodies%angular_velocity(s))
         values(1) = 0.5_wp*(m*(v(1)*v(1) + v(2)*v(2)) + spin*bodies%angular_velocity(s))
         values(2) = -m*(gravity(1)*x(1) + gravity(2)*x(2))
         values(3:4) = m*v
         values(5) = m*(x(1)*v(2) - x(2)*v(1)) + spin
      end associate
   end function motion_of

   !> Powers of the elastic, damping and tangential forces of a contact on one of its bodies.
   pure subroutine add_power(bodies, contacts, c, mover, side, arm, power)
      type(bodies_t), intent(in) :: bodies
      type(contacts_t), intent(in) :: contacts
      integer(ip), intent(in) :: c
      !> Slot of the body whose velocity counts
      integer(ip), intent(in) :: mover
      !> 1 for the forces as the first body feels them, -1 as the second does
      real(wp), intent(in) :: side
      !> Centroid of the overlap relative to the centre of the mover [m]
      real(wp), intent(in) :: arm(2)
      real(wp), intent(inout) :: power(n_books)
      real(wp) :: vx, vy, w, approach

      w = side*bodies%angular_velocity(mover)
      vx = side*bodies%velocity(1, mover) - w*arm(2)
      vy = side*bodies%velocity(2, mover) + w*arm(1)
      approach = contacts%direction(1, c)*vx + contacts%direction(2, c)*vy + contacts%lever(c)*w
      power(1) = power(1) + contacts%elastic(c)*approach
      power(2) = power(2) + (contacts%normal_force(c) - contacts%elastic(c))*approach
      if (contacts%has_twist) power(2) = power(2) + contacts%twist(c)*w
      power(3) = power(3) + contacts%tangential_force(c)*(contacts%direction(1, c)*vy - contacts%direction(2, c)*vx)
   end subroutine add_power

   !> What a fixed body does to a free one: its share of the powers, and its own books.
   pure subroutine add_wall(bodies, contacts, c, wall, side, weight, arm, power, book)
      type(bodies_t), intent(in) :: bodies
      type(contacts_t), intent(in) :: contacts
      integer(ip), intent(in) :: c
      !> Slot of the fixed body
      integer(ip), intent(in) :: wall
      !> 1 if the free body is the first, else -1
      real(wp), intent(in) :: side
      real(wp), intent(in) :: weight
      !> Centroid of the overlap relative to the centre of the fixed body [m]
      real(wp), intent(in) :: arm(2)
      real(wp), intent(inout) :: power(n_books), book(n_wall_books)
      real(wp) :: fx, fy, twist, torque

      call add_power(bodies, contacts, c, wall, -side, arm, power)
      fx = side*contacts%force(1, c)
      fy = side*contacts%force(2, c)
      twist = side*contacts%lever(c)*contacts%normal_force(c)
      if (contacts%has_twist) twist = twist + side*contacts%twist(c)
      associate (x => bodies%position(:, wall), v => bodies%velocity(:, wall), w => bodies%angular_velocity(wall))
         torque = (x(1) + arm(1))*fy - (x(2) + arm(2))*fx + twist
         book(1) = book(1) + weight*(fx*(v(1) - w*arm(2)) + fy*(v(2) + w*arm(1)) + twist*w)
      end associate
      book(2) = book(2) + weight*fx
      book(3) = book(3) + weight*fy
      book(4) = book(4) + weight*torque
      book(5) = book(5) + weight*(abs(fx) + abs(fy))
      book(6) = book(6) + weight*abs(torque)
   end subroutine add_wall

end module polydem_body_rates
