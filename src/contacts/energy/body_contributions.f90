!> Contributions of one free body to the energy and momentum balance.
!>
!> The power of a force between two free bodies, f . (v1 - v2), has two terms: the first body contributes f . v1, the
!> second -f . v2. The contribution of a body therefore depends on no velocity but its own, and the rank that moves the
!> body can compute it. For a contact with a fixed body the free body contributes both terms, and in addition power,
!> force and torque of the fixed body; the velocities of fixed bodies are known on every rank.
module polydem_body_contributions
   use polydem_bodies, only: bodies_t
   use polydem_cell, only: shear_flow
   use polydem_force_sums, only: force_sums_t, n_terms, of_elastic, of_normal, of_tangential, sum_energy, sum_torque, &
      sum_x, sum_y
   use polydem_kinds, only: ip, wp
   use polydem_term_list, only: term_list_t
   use polydem_wall_terms, only: wall_terms_t
   implicit none
   private
   public :: n_channels, n_wall_channels, n_motions, add_powers, add_fields, add_given, add_torques, add_walls
   public :: motion_of

   !> Number of channels of a body: powers of the elastic normal forces with cohesion, of the other normal forces with
   !> the damping of tilts, and of the tangential forces [W/m]
   integer, parameter :: n_channels = 3
   !> Number of wall channels, the action of fixed bodies on a body: power [W/m]; force along x and y [N/m]; torque
   !> about the origin [N]; sums over contacts of the absolute values of forces [N/m] and torques [N]
   integer, parameter :: n_wall_channels = 6
   !> Number of values of `motion_of`
   integer, parameter :: n_motions = 7

contains

   !> Add the powers of the elastic, damping and tangential forces on some bodies, times a weight, to their channels.
   pure subroutine add_powers(bodies, forces, weight, first, last, channels)
      type(bodies_t), intent(in) :: bodies
      !> Sums of the forces on each body
      type(force_sums_t), intent(in) :: forces
      !> Factor of what is added
      real(wp), intent(in) :: weight
      !> First and last slot, of free bodies of this rank
      integer(ip), intent(in) :: first, last
      !> Channels of all bodies, (n_channels, slot) [W/m]
      real(wp), intent(inout), contiguous :: channels(:, :)

      if (last < first) return
      call add_powers_of(last - first + 1_ip, forces%has_terms(first), bodies%velocity(1, first), &
                         bodies%angular_velocity(first), forces%value(1, first), weight, channels(:, first:last))
   end subroutine add_powers

   !> Add the powers of the sums of some bodies to their channels.
   pure subroutine add_powers_of(n, has_terms, velocity, spin, value, weight, channels)
      !> Number of bodies
      integer(ip), intent(in) :: n
      !> Whether they have terms
      logical, intent(in) :: has_terms(n)
      !> Their velocities [m/s] and angular velocities [rad/s]
      real(wp), intent(in) :: velocity(2, n), spin(n)
      !> Sums of their terms
      real(wp), intent(in) :: value(n_terms, n)
      !> Factor of what is added
      real(wp), intent(in) :: weight
      !> Their channels [W/m]
      real(wp), intent(inout) :: channels(n_channels, n)
      integer(ip) :: s

      do s = 1_ip, n
         if (.not. has_terms(s)) cycle
         call add_term(velocity(:, s), spin(s), value(:, s), weight, channels(:, s))
      end do
   end subroutine add_powers_of

   !> Add the powers of the elastic, damping and tangential rows of a term on a body, times a weight.
   pure subroutine add_term(velocity, spin, term, weight, channels)
      !> Velocity [m/s] and angular velocity [rad/s] of the body
      real(wp), intent(in) :: velocity(2), spin
      real(wp), intent(in) :: term(n_terms)
      !> Factor of what is added
      real(wp), intent(in) :: weight
      !> Channels [W/m]
      real(wp), intent(inout) :: channels(n_channels)
      integer, parameter :: e = of_elastic, n = of_normal, f = of_tangential
      integer, parameter :: ex = sum_x(e), ey = sum_y(e), et = sum_torque(e), nx = sum_x(n), ny = sum_y(n), &
         nt = sum_torque(n), fx = sum_x(f), fy = sum_y(f), ft = sum_torque(f)

      associate (x => velocity(1), y => velocity(2), w => spin)
         channels(1) = channels(1) + weight*((term(ex)*x + term(ey)*y) + term(et)*w)
         channels(2) = channels(2) + weight*(((term(nx) - term(ex))*x + (term(ny) - term(ey))*y) &
                                             + (term(nt) - term(et))*w)
         channels(3) = channels(3) + weight*((term(fx)*x + term(fy)*y) + term(ft)*w)
      end associate
   end subroutine add_term

   !> Add the impulses of forces on some bodies that are no contacts to their wall channels, times a weight, as of a
   !> fixed body at rest. Their powers are among those of damping. That of an acceleration from outside moves from there
   !> to the power of fixed bodies, and so does that of the rest at the velocity of the shear of the cell, so that all
   !> copies of a body have the same power of damping.
   pure subroutine add_fields(bodies, field, acceleration, weight, first, last, channels, wall_channels)
      type(bodies_t), intent(in) :: bodies
      !> Forces along x and y [N/m] and torques [N], (3, slot)
      real(wp), intent(in) :: field(:, :)
      !> The acceleration of all bodies that they contain, (2) [m/s2]
      real(wp), intent(in) :: acceleration(2)
      !> Factor of what is added
      real(wp), intent(in) :: weight
      !> First and last slot
      integer(ip), intent(in) :: first, last
      !> Channels of all bodies, (n_channels, slot) [W/m]
      real(wp), intent(inout) :: channels(:, :)
      !> Wall channels of all bodies, (n_wall_channels, slot)
      real(wp), intent(inout) :: wall_channels(:, :)
      real(wp) :: power, torque, flow(3)
      integer(ip) :: s

      do s = first, last
         associate (x => bodies%position(:, s), f => field(:, s), on_walls => wall_channels(:, s))
            torque = (x(1)*f(2) - x(2)*f(1)) + f(3)
            on_walls(2) = on_walls(2) + weight*f(1)
            on_walls(3) = on_walls(3) + weight*f(2)
            on_walls(4) = on_walls(4) + weight*torque
            on_walls(5) = on_walls(5) + weight*(abs(f(1)) + abs(f(2)))
            on_walls(6) = on_walls(6) + weight*abs(torque)
         end associate
      end do
      if (bodies%cell%is_sheared) then
         do s = first, last
            flow = shear_flow(bodies%cell, bodies%position(2, s))
            power = weight*((field(1, s) - bodies%mass(s)*acceleration(1))*flow(1) + field(3, s)*flow(3))
            channels(2, s) = channels(2, s) - power
            wall_channels(1, s) = wall_channels(1, s) + power
         end do
      end if
      if (.not. any(abs(acceleration) > 0.0_wp)) return
      do s = first, last
         power = weight*bodies%mass(s)*(acceleration(1)*bodies%velocity(1, s) + acceleration(2)*bodies%velocity(2, s))
         channels(2, s) = channels(2, s) - power
         wall_channels(1, s) = wall_channels(1, s) + power
      end do
   end subroutine add_fields

   !> Move the powers of forces that actions give to some bodies from those of damping to those of fixed bodies.
   pure subroutine add_given(bodies, given, weight, first, last, channels, wall_channels)
      type(bodies_t), intent(in) :: bodies
      !> Forces along x and y [N/m] and torques [N], (3, slot), which are among the fields
      real(wp), intent(in) :: given(:, :)
      !> Factor of what is added
      real(wp), intent(in) :: weight
      !> First and last slot
      integer(ip), intent(in) :: first, last
      !> Channels of all bodies, (n_channels, slot) [W/m]
      real(wp), intent(inout) :: channels(:, :)
      !> Wall channels of all bodies, (n_wall_channels, slot)
      real(wp), intent(inout) :: wall_channels(:, :)
      real(wp) :: power, flow(3)
      integer(ip) :: s

      do s = first, last
         ! The power at the velocity of the shear is there already.
         flow = shear_flow(bodies%cell, bodies%position(2, s))
         power = weight*((given(1, s)*(bodies%velocity(1, s) - flow(1)) + given(2, s)*bodies%velocity(2, s)) &
                         + given(3, s)*(bodies%angular_velocity(s) - flow(3)))
         channels(2, s) = channels(2, s) - power
         wall_channels(1, s) = wall_channels(1, s) + power
      end do
   end subroutine add_given

   !> Add the torques of gravity on some bodies about the origin, times a weight.
   pure subroutine add_torques(n, weight, gravity, mass, position, torque)
      !> Number of bodies
      integer(ip), intent(in) :: n
      !> Factor of what is added
      real(wp), intent(in) :: weight
      !> Acceleration of gravity [m/s2]
      real(wp), intent(in) :: gravity(2)
      !> Masses [kg/m] and positions [m]
      real(wp), intent(in) :: mass(n), position(2, n)
      !> Sums of the torques about the origin [N]
      real(wp), intent(inout) :: torque(n)
      integer(ip) :: s

      do s = 1_ip, n
         torque(s) = torque(s) + weight*(mass(s)*(position(1, s)*gravity(2) - position(2, s)*gravity(1)))
      end do
   end subroutine add_torques

   !> Add the action of a fixed body on a free one: its terms of the powers, and the wall channels.
   pure subroutine add_wall(bodies, wall, term, weight, channels, wall_channels)
      type(bodies_t), intent(in) :: bodies
      !> Slot of the fixed body
      integer(ip), intent(in) :: wall
      !> Term of the fixed body in their contact
      real(wp), intent(in) :: term(n_terms)
      !> Factor of all that is added
      real(wp), intent(in) :: weight
      !> Channels of the free body
      real(wp), intent(inout) :: channels(n_channels)
      !> Wall channels of the free body
      real(wp), intent(inout) :: wall_channels(n_wall_channels)
      real(wp) :: fx, fy, couple, torque

      call add_term(bodies%velocity(:, wall), bodies%angular_velocity(wall), term, weight, channels)
      fx = term(sum_x(of_normal)) + term(sum_x(of_tangential))
      fy = term(sum_y(of_normal)) + term(sum_y(of_tangential))
      couple = term(sum_torque(of_normal)) + term(sum_torque(of_tangential))
      associate (x => bodies%position(:, wall), v => bodies%velocity(:, wall), w => bodies%angular_velocity(wall))
         torque = (x(1)*fy - x(2)*fx) + couple
         wall_channels(1) = wall_channels(1) - weight*((fx*v(1) + fy*v(2)) + couple*w)
      end associate
      wall_channels(2) = wall_channels(2) - weight*fx
      wall_channels(3) = wall_channels(3) - weight*fy
      wall_channels(4) = wall_channels(4) - weight*torque
      wall_channels(5) = wall_channels(5) + weight*(abs(fx) + abs(fy))
      wall_channels(6) = wall_channels(6) + weight*abs(torque)
   end subroutine add_wall

   !> Add the action of fixed bodies on some free ones to the channels, and their share of the elastic energy.
   pure subroutine add_walls(bodies, walls, weight, first, last, channels, wall_channels, energy)
      type(bodies_t), intent(in) :: bodies
      !> Contacts with fixed bodies
      type(wall_terms_t), intent(in) :: walls
      !> Factor of all that is added to the channels
      real(wp), intent(in) :: weight
      !> First and last slot of the free bodies
      integer(ip), intent(in) :: first, last
      !> Channels of all bodies, (n_channels, slot)
      real(wp), intent(inout) :: channels(:, :)
      !> Wall channels of all bodies, (n_wall_channels, slot)
      real(wp), intent(inout) :: wall_channels(:, :)
      !> Elastic energy of each body [J/m]
      real(wp), intent(inout), optional :: energy(:)
      integer(ip) :: c

      do c = 1_ip, walls%n
         associate (wall => walls%slots(1, c), body => walls%slots(2, c))
            if (body < first .or. body > last) cycle
            call add_wall(bodies, wall, walls%term(:, c), weight, channels(:, body), wall_channels(:, body))
            if (present(energy)) energy(body) = energy(body) + walls%term(sum_energy, c)
         end associate
      end do
      if (walls%border%n > 0_ip) call add_border(bodies%cell%jump, walls%border, weight, first, last, channels, &
                                                 wall_channels)
   end subroutine add_walls

   !> Add the work of the border of a sheared cell on some bodies to the channels. The upper body of a contact meets a
   !> copy that moves with the jump of the border relative to its partner. Half of the power of this velocity belongs to
   !> each body of the contact, so that either of two ranks adds its own half.
   pure subroutine add_border(jump, border, weight, first, last, channels, wall_channels)
      !> Velocity of the border [m/s]
      real(wp), intent(in) :: jump
      !> Terms of the upper bodies
      type(term_list_t), intent(in) :: border
      !> Factor of all that is added
      real(wp), intent(in) :: weight
      !> First and last slot
      integer(ip), intent(in) :: first, last
      !> Channels of all bodies, (n_channels, slot) [W/m]
      real(wp), intent(inout) :: channels(:, :)
      !> Wall channels of all bodies, (n_wall_channels, slot)
      real(wp), intent(inout) :: wall_channels(:, :)
      real(wp) :: half, power(n_channels)
      integer(ip) :: c, s
      integer :: k

      half = 0.5_wp*weight*jump
      do c = 1_ip, border%n
         associate (term => border%term(:, c))
            power(1) = half*term(sum_x(of_elastic))
            power(2) = half*(term(sum_x(of_normal)) - term(sum_x(of_elastic)))
            power(3) = half*term(sum_x(of_tangential))
         end associate
         do k = 1, 2
            s = border%slots(k, c)
            if (s < first .or. s > last) cycle
            channels(:, s) = channels(:, s) + power
            wall_channels(1, s) = wall_channels(1, s) - ((power(1) + power(2)) + power(3))
         end do
      end do
   end subroutine add_border

   !> Kinetic energy [J/m], potential energy [J/m], momentum along x and y [N s/m] and angular momentum about the origin
   !> [N s] of a free body; then the sums of the absolute values of its momenta along x and y [N s/m], and of its
   !> orbital angular momentum and its spin [N s]
   pure function motion_of(gravity, bodies, s) result(values)
      !> Acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      type(bodies_t), intent(in) :: bodies
      !> Slot of the body
      integer(ip), intent(in) :: s
      real(wp) :: values(n_motions)

      associate (m => bodies%mass(s), v => bodies%velocity(:, s), x => bodies%position(:, s), &
                 spin => bodies%inertia(s)*bodies%angular_velocity(s))
         values(1) = 0.5_wp*(m*(v(1)*v(1) + v(2)*v(2)) + spin*bodies%angular_velocity(s))
         values(2) = -m*(gravity(1)*x(1) + gravity(2)*x(2))
         if (allocated(bodies%image)) values(2) = values(2) &
            - m*(gravity(1)*(real(bodies%image(s, 1), wp)*bodies%cell%size(1)) &
                 + gravity(2)*(real(bodies%image(s, 2), wp)*bodies%cell%size(2)))
         if (allocated(bodies%shear_offset)) values(2) = values(2) - m*(gravity(1)*bodies%shear_offset(s))
         values(3:4) = m*v
         values(5) = m*(x(1)*v(2) - x(2)*v(1)) + spin
         values(6) = m*(abs(v(1)) + abs(v(2)))
         values(7) = abs(m*(x(1)*v(2) - x(2)*v(1))) + abs(spin)
      end associate
   end function motion_of

end module polydem_body_contributions
