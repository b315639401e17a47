!> Contributions of one free body to the energy and momentum balance.
!>
!> The power of a force between two free bodies, f . (v1 - v2), has two terms: the first body contributes f . v1, the
!> second -f . v2. The contribution of a body therefore depends on no velocity but its own, and the rank that moves the
!> body can compute it. For a contact with a fixed body the free body contributes both terms, and in addition power,
!> force and torque of the fixed body; the velocities of fixed bodies are known on every rank.
module polydem_body_contributions
   use polydem_bodies, only: bodies_t
   use polydem_contact_incidence, only: incidence_t
   use polydem_contacts, only: contacts_t
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: n_channels, n_wall_channels, n_motions, add_rates, elastic_energy_of, motion_of

   !> Number of channels of a body: powers of the elastic normal forces with cohesion, of the other normal forces with
   !> the damping of tilts, and of the tangential forces [W/m]
   integer, parameter :: n_channels = 3
   !> Number of wall channels, the action of fixed bodies on a body: power [W/m]; force along x and y [N/m]; torque
   !> about the origin [N]; sums over contacts of the absolute values of forces [N/m] and torques [N]
   integer, parameter :: n_wall_channels = 6
   !> Number of values of `motion_of`
   integer, parameter :: n_motions = 5

contains

   !> Add the present rates, times a weight, to the channels of a free body.
   pure subroutine add_rates(bodies, incidence, contacts, s, weight, channels, wall_channels)
      !> Bodies
      type(bodies_t), intent(in) :: bodies
      !> Contacts of each body
      type(incidence_t), intent(in) :: incidence
      !> Contacts with their forces
      type(contacts_t), intent(in) :: contacts
      !> Slot of the body
      integer(ip), intent(in) :: s
      !> The weight
      real(wp), intent(in) :: weight
      !> Channels of the body, (n_channels)
      real(wp), intent(inout) :: channels(n_channels)
      !> Wall channels of the body, (n_wall_channels)
      real(wp), intent(inout) :: wall_channels(n_wall_channels)
      real(wp) :: power(n_channels)
      integer(ip) :: c, k

      power = 0.0_wp
      do k = incidence%start_second(s), incidence%start_second(s + 1_ip) - 1_ip
         c = incidence%contact(k)
         call add_power(bodies, contacts, c, s, -1.0_wp, contacts%arm_second(:, c), power)
         if (bodies%fixed(contacts%first(c))) call add_wall(bodies, contacts, c, contacts%first(c), -1.0_wp, weight, &
            contacts%arm_first(:, c), power, wall_channels)
      end do
      do c = incidence%start_first(s), incidence%start_first(s + 1_ip) - 1_ip
         call add_power(bodies, contacts, c, s, 1.0_wp, contacts%arm_first(:, c), power)
         if (bodies%fixed(contacts%second(c))) call add_wall(bodies, contacts, c, contacts%second(c), 1.0_wp, weight, &
            contacts%arm_second(:, c), power, wall_channels)
      end do
      channels = channels + weight*power
   end subroutine add_rates

   !> Part of a free body in the elastic energy of its contacts [J/m]: half of each, or all if the other body is fixed
   pure real(wp) function elastic_energy_of(bodies, incidence, contacts, s) result(energy)
      !> Bodies
      type(bodies_t), intent(in) :: bodies
      !> Contacts of each body
      type(incidence_t), intent(in) :: incidence
      !> Contacts with their forces; the energy of a contact is elastic*area/(2 length)
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

   !> Kinetic energy [J/m], potential energy [J/m], momentum along x and y [N s/m] and angular momentum about the origin
   !> [N s] of a free body
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

   !> Add the powers of the elastic, damping and tangential forces of a contact on one of its bodies.
   pure subroutine add_power(bodies, contacts, c, s, side, arm, power)
      type(bodies_t), intent(in) :: bodies
      type(contacts_t), intent(in) :: contacts
      integer(ip), intent(in) :: c
      !> Slot of the body
      integer(ip), intent(in) :: s
      !> 1 if the body is the first of the contact, -1 if it is the second
      real(wp), intent(in) :: side
      !> Centroid of the overlap relative to the centre of the body [m]
      real(wp), intent(in) :: arm(2)
      real(wp), intent(inout) :: power(n_channels)
      real(wp) :: vx, vy, w, approach

      w = side*bodies%angular_velocity(s)
      vx = side*bodies%velocity(1, s) - w*arm(2)
      vy = side*bodies%velocity(2, s) + w*arm(1)
      approach = contacts%direction(1, c)*vx + contacts%direction(2, c)*vy + contacts%lever(c)*w
      power(1) = power(1) + contacts%elastic(c)*approach
      power(2) = power(2) + (contacts%normal_force(c) - contacts%elastic(c))*approach
      if (contacts%has_cohesion) power(1:2) = power(1:2) + contacts%cohesion(c)*approach*[1.0_wp, -1.0_wp]
      if (contacts%has_twist) power(2) = power(2) + contacts%twist(c)*w
      power(3) = power(3) + contacts%tangential_force(c)*(contacts%direction(1, c)*vy - contacts%direction(2, c)*vx)
   end subroutine add_power

   !> Add the action of a fixed body on a free one: its terms of the powers, and the wall channels.
   pure subroutine add_wall(bodies, contacts, c, wall, side, weight, arm, power, wall_channels)
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
      real(wp), intent(inout) :: power(n_channels), wall_channels(n_wall_channels)
      real(wp) :: fx, fy, twist, torque

      call add_power(bodies, contacts, c, wall, -side, arm, power)
      fx = side*contacts%force(1, c)
      fy = side*contacts%force(2, c)
      twist = side*contacts%lever(c)*contacts%normal_force(c)
      if (contacts%has_twist) twist = twist + side*contacts%twist(c)
      associate (x => bodies%position(:, wall), v => bodies%velocity(:, wall), w => bodies%angular_velocity(wall))
         torque = (x(1) + arm(1))*fy - (x(2) + arm(2))*fx + twist
         wall_channels(1) = wall_channels(1) + weight*(fx*(v(1) - w*arm(2)) + fy*(v(2) + w*arm(1)) + twist*w)
      end associate
      wall_channels(2) = wall_channels(2) + weight*fx
      wall_channels(3) = wall_channels(3) + weight*fy
      wall_channels(4) = wall_channels(4) + weight*torque
      wall_channels(5) = wall_channels(5) + weight*(abs(fx) + abs(fy))
      wall_channels(6) = wall_channels(6) + weight*abs(torque)
   end subroutine add_wall

end module polydem_body_contributions
