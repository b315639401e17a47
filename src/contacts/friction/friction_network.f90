!> All contacts as a linear operator between their tangential forces and their slip velocities.
!>
!> Each contact has one unknown force f along its tangent. It acts on the first body; the second feels the opposite.
!> After a step the velocities of bodies are v = v_free + h M^-1 H f, and the slip velocities of contacts u = H' v. A
!> column of H holds the tangent t and the levers (arm x t) of both bodies. Fixed bodies have the inverse mass 0; their
!> velocity is prescribed. W = H' M^-1 H is never formed. A contact without pressure or without direction has the
!> limit 0.
!>
!> Gauss-Seidel visits the contacts one after the other. One thread visits a small network in the order of the contact
!> table. In a large network each contact has a colour. Contacts of one colour have no free body in common, and threads
!> share them. Colours are assigned in the order of the table, which is that of identifiers: a contact gets the first
!> colour that no other contact of its free bodies has. Contacts for which no colour is left come last. The order does
!> not depend on the number of threads.
module polydem_friction_network
   use polydem_bodies, only: bodies_t
   use polydem_contact_incidence, only: incidence_t
   use polydem_contact_block, only: is_degenerate
   use polydem_contacts, only: contacts_t
   use polydem_kinds, only: ip, lp, wp, min_parallel_size
   implicit none
   private
   public :: friction_network_t, build_network, free_velocities, push_bodies, sweep_contacts, slip_of_contacts
   public :: measure_slip, within, worth_sharing

   !> Number of colours; contacts without a colour follow in one more group
   integer, parameter :: n_colours = 62
   !> Loops over fewer contacts run on one thread, because each contact takes little time
   integer(ip), parameter :: worth_sharing = 1024_ip
   !> Networks with fewer contacts are not coloured: a colour would have too few contacts for several threads
   integer(ip), parameter :: worth_colours = 16384_ip
   !> Relative rounding error of a sum of some forces or velocities
   real(wp), parameter :: rounding = 8.0_wp*epsilon(1.0_wp)

   !> Structure of arrays over contacts 1..n, in the order of the contact table; arrays may be longer
   type :: friction_network_t
      !> Number of contacts
      integer(ip) :: n = 0_ip
      !> Slots of the two bodies, (2, contact)
      integer(ip), allocatable :: body(:, :)
      !> Column of H: tangent, and arm x tangent of the first and the second body, (4, contact) [-, -, m, m]
      real(wp), allocatable :: row(:, :)
      !> Change of the slip velocity by a unit force within a step, h W_cc, (contact) [m/s per N/m]
      real(wp), allocatable :: mobility(:)
      !> Its reciprocal, (contact) [N/m per m/s]
      real(wp), allocatable :: inverse_mobility(:)
      !> Greatest force mu F_n, (contact) [N/m]; 0 if the contact is under tension
      real(wp), allocatable :: limit(:)
      !> Slip velocity due to rounding errors of the forces on the bodies, (contact) [m/s]
      real(wp), allocatable :: noise(:)
      !> Change of velocity and angular velocity of each body by a unit force and torque, h/m and h/I; 0 for a fixed
      !> body, (2, slot)
      real(wp), allocatable :: inverse(:, :)
      !> Contacts in the order of sweeps
      integer(ip), allocatable, private :: order(:)
      !> Indices in `order`: first contact of each colour, and first contact without a colour
      integer(ip), private :: start(n_colours + 1) = 1_ip
      !> Colour of each contact
      integer(ip), allocatable, private :: colour(:)
      !> Colours in use at each body, one bit each
      integer(lp), allocatable, private :: taken(:)
   end type friction_network_t

contains

   !> Build the network of a step.
   subroutine build_network(dt, coefficients, bodies, contacts, network)
      !> Time step [s]
      real(wp), intent(in) :: dt
      !> Friction coefficient mu of each contact
      real(wp), intent(in) :: coefficients(:)
      type(bodies_t), intent(in) :: bodies
      !> Contacts with their normal forces
      type(contacts_t), intent(in) :: contacts
      type(friction_network_t), intent(inout) :: network
      integer(ip) :: c, s

      call reserve(bodies%n, contacts%n, network)
      network%n = contacts%n
      !$omp parallel if (max(bodies%n, contacts%n) > worth_sharing) default(none) &
      !$omp    shared(network, bodies, contacts, coefficients, dt) private(c, s)
      !$omp do schedule(static)
      do s = 1_ip, bodies%n
         network%inverse(:, s) = 0.0_wp
         if (.not. bodies%fixed(s)) network%inverse(:, s) = dt*[bodies%inverse_mass(s), bodies%inverse_inertia(s)]
      end do
      !$omp end do
      !$omp do schedule(static)
      do c = 1_ip, contacts%n
         call fill_contact(coefficients(c), contacts, c, network)
      end do
      !$omp end do
      !$omp end parallel
      call order_contacts(bodies, network)
   end subroutine build_network

   !> Fill the entries of contact c.
   pure subroutine fill_contact(coefficient, contacts, c, network)
      real(wp), intent(in) :: coefficient
      type(contacts_t), intent(in) :: contacts
      integer(ip), intent(in) :: c
      type(friction_network_t), intent(inout) :: network
      real(wp) :: lever(2), pressure

      associate (d => contacts%row(c)%direction, i => contacts%row(c)%first, j => contacts%row(c)%second)
         ! With the tangent (-d_y, d_x), arm x tangent = arm . d.
         lever(1) = contacts%row(c)%arm_first(1)*d(1) + contacts%row(c)%arm_first(2)*d(2)
         lever(2) = contacts%row(c)%arm_second(1)*d(1) + contacts%row(c)%arm_second(2)*d(2)
         network%body(:, c) = [i, j]
         network%row(:, c) = [-d(2), d(1), lever]
         network%mobility(c) = (network%inverse(1, i) + network%inverse(1, j)) &
            + (lever(1)**2*network%inverse(2, i) + lever(2)**2*network%inverse(2, j))
      end associate
      network%inverse_mobility(c) = 1.0_wp/network%mobility(c)
      pressure = contacts%row(c)%normal_force
      network%limit(c) = merge(0.0_wp, coefficient*max(0.0_wp, pressure), is_degenerate(contacts%row(c)))
      network%noise(c) = rounding*network%mobility(c)*abs(pressure)
   end subroutine fill_contact

   !> Choose the order of sweeps.
   subroutine order_contacts(bodies, network)
      type(bodies_t), intent(in) :: bodies
      type(friction_network_t), intent(inout) :: network
      integer(ip) :: c, k, s, counts(n_colours + 1)
      integer(lp) :: taken

      if (network%n < worth_colours) then
         network%start = 1_ip
         do c = 1_ip, network%n
            network%order(c) = c
         end do
         return
      end if
      network%taken(1:bodies%n) = 0_lp
      counts = 0_ip
      do c = 1_ip, network%n
         taken = ior(network%taken(network%body(1, c)), network%taken(network%body(2, c)))
         k = min(int(trailz(not(taken)), ip), int(n_colours, ip)) + 1_ip
         do s = 1_ip, 2_ip
            associate (body => network%body(s, c))
               if (.not. bodies%fixed(body)) network%taken(body) = ibset(network%taken(body), k - 1_ip)
            end associate
         end do
         network%colour(c) = k
         counts(k) = counts(k) + 1_ip
      end do
      network%start(1) = 1_ip
      do k = 1_ip, n_colours
         network%start(k + 1_ip) = network%start(k) + counts(k)
      end do
      counts = network%start
      do c = 1_ip, network%n
         k = network%colour(c)
         network%order(counts(k)) = c
         counts(k) = counts(k) + 1_ip
      end do
   end subroutine order_contacts

   !> Compute the velocities in the middle of the next step without friction.
   !>
   !> Velocity Verlet predicts v_n + dt a_n. The velocity in the middle of the last step is v_n + dt a_n/2.
   subroutine free_velocities(dt, bodies, velocity)
      !> Time step [s]
      real(wp), intent(in) :: dt
      !> Bodies with predicted velocities, the accelerations of the last step and the forces of this step
      type(bodies_t), intent(in) :: bodies
      !> Velocity and angular velocity of each body, (3, slot) [m/s, m/s, rad/s]
      real(wp), intent(inout) :: velocity(:, :)
      real(wp) :: h
      integer(ip) :: s

      h = 0.5_wp*dt
      !$omp parallel do if (bodies%n > min_parallel_size) schedule(static) default(none) &
      !$omp    shared(bodies, velocity, dt, h) private(s)
      do s = 1_ip, bodies%n
         velocity(1, s) = bodies%velocity(1, s)
         velocity(2, s) = bodies%velocity(2, s)
         velocity(3, s) = bodies%angular_velocity(s)
         if (bodies%fixed(s)) cycle
         velocity(1, s) = (velocity(1, s) - h*bodies%acceleration(1, s)) + dt*bodies%inverse_mass(s)*bodies%force(1, s)
         velocity(2, s) = (velocity(2, s) - h*bodies%acceleration(2, s)) + dt*bodies%inverse_mass(s)*bodies%force(2, s)
         velocity(3, s) = (velocity(3, s) - h*bodies%angular_acceleration(s)) &
            + dt*bodies%inverse_inertia(s)*bodies%torque(s)
      end do
      !$omp end parallel do
   end subroutine free_velocities

   !> Compute the velocities due to tangential forces, h M^-1 H f. The threads of a parallel region share the work.
   subroutine push_bodies(network, incidence, force, push)
      type(friction_network_t), intent(in) :: network
      type(incidence_t), intent(in) :: incidence
      !> Tangential force of each contact [N/m]
      real(wp), intent(in), contiguous :: force(:)
      !> Velocity and angular velocity of each body, (3, slot) [m/s, m/s, rad/s]
      real(wp), intent(inout), contiguous :: push(:, :)
      real(wp) :: total(3)
      integer(ip) :: c, k, s

      !$omp do schedule(static)
      do s = 1_ip, size(push, 2, kind=ip)
         total = 0.0_wp
         if (network%inverse(1, s) > 0.0_wp) then
            do k = incidence%start_second(s), incidence%start_second(s + 1_ip) - 1_ip
               c = incidence%contact(k)
               total(1) = total(1) - network%row(1, c)*force(c)
               total(2) = total(2) - network%row(2, c)*force(c)
               total(3) = total(3) - network%row(4, c)*force(c)
            end do
            do c = incidence%start_first(s), incidence%start_first(s + 1_ip) - 1_ip
               total(1) = total(1) + network%row(1, c)*force(c)
               total(2) = total(2) + network%row(2, c)*force(c)
               total(3) = total(3) + network%row(3, c)*force(c)
            end do
         end if
         push(1, s) = network%inverse(1, s)*total(1)
         push(2, s) = network%inverse(1, s)*total(2)
         push(3, s) = network%inverse(2, s)*total(3)
      end do
      !$omp end do
   end subroutine push_bodies

   !> Do one sweep of projected Gauss-Seidel: each contact in turn gets the force that stops its slip, within its limit.
   subroutine sweep_contacts(network, force, velocity)
      type(friction_network_t), intent(in) :: network
      !> Tangential force of each contact [N/m]
      real(wp), intent(inout), contiguous :: force(:)
      !> Velocities under these forces, (3, slot)
      real(wp), intent(inout), contiguous :: velocity(:, :)
      integer(ip) :: colour, k

      if (network%start(2) > 1_ip) then
         !$omp parallel default(none) shared(network, force, velocity) private(colour, k)
         do colour = 1_ip, n_colours
            !$omp do schedule(static)
            do k = network%start(colour), network%start(colour + 1_ip) - 1_ip
               call stop_slip(network, network%order(k), force, velocity)
            end do
            !$omp end do
         end do
         !$omp end parallel
      end if
      do k = network%start(n_colours + 1), network%n
         call stop_slip(network, network%order(k), force, velocity)
      end do
   end subroutine sweep_contacts

   !> Compute the slip velocities of a range of contacts, u = H' v.
   pure subroutine slip_of_contacts(network, velocity, low, high, slip)
      type(friction_network_t), intent(in) :: network
      !> Velocities, (3, slot)
      real(wp), intent(in), contiguous :: velocity(:, :)
      !> First and last contact
      integer(ip), intent(in) :: low, high
      !> Slip velocity of each contact, (contact) [m/s]
      real(wp), intent(inout), contiguous :: slip(:)
      integer(ip) :: c

      do c = low, high
         slip(c) = slip_of(network, c, velocity)
      end do
   end subroutine slip_of_contacts

   !> Find the greatest avoidable slip beyond rounding errors, and the greatest slip velocity that the friction of one
   !> contact removes from its own bodies in a step.
   subroutine measure_slip(network, force, velocity, residual, scale)
      type(friction_network_t), intent(in) :: network
      !> Tangential force of each contact [N/m]
      real(wp), intent(in), contiguous :: force(:)
      !> Velocities under these forces, (3, slot)
      real(wp), intent(in), contiguous :: velocity(:, :)
      !> Greatest avoidable slip [m/s]
      real(wp), intent(out) :: residual
      !> Greatest slip velocity removed by one contact [m/s]
      real(wp), intent(out) :: scale
      integer(ip) :: c

      residual = 0.0_wp
      scale = 0.0_wp
      !$omp parallel do if (network%n > worth_sharing) schedule(static) default(none) &
      !$omp    shared(network, force, velocity) private(c) reduction(max:residual, scale)
      do c = 1_ip, network%n
         residual = max(residual, excess_slip(network, c, force(c), velocity))
         scale = max(scale, network%mobility(c)*abs(force(c)))
      end do
      !$omp end parallel do
   end subroutine measure_slip

   !> Force limited to -limit ... limit [N/m]
   elemental real(wp) function within(limit, force)
      !> Greatest force [N/m]
      real(wp), intent(in) :: limit
      !> Force [N/m]
      real(wp), intent(in) :: force

      within = max(-limit, min(limit, force))
   end function within

   !> Avoidable slip of a contact minus the rounding errors of its forces and velocities [m/s]. Any slip is avoidable if
   !> the force is below its limit, slip along the force if it is at the limit
   pure real(wp) function excess_slip(network, c, force, velocity)
      type(friction_network_t), intent(in) :: network
      integer(ip), intent(in) :: c
      real(wp), intent(in) :: force
      real(wp), intent(in), contiguous :: velocity(:, :)
      real(wp) :: slip

      slip = slip_of(network, c, velocity)
      if (force >= network%limit(c)) slip = max(0.0_wp, slip)
      if (force <= -network%limit(c)) slip = min(0.0_wp, slip)
      associate (i => network%body(1, c), j => network%body(2, c))
         excess_slip = abs(slip) - (rounding*(sum_of(velocity(:, i), network%row(3, c)) &
                                              + sum_of(velocity(:, j), network%row(4, c))) + network%noise(c))
      end associate
   end function excess_slip

   !> Sum of the absolute terms of a body's velocity at a contact [m/s]
   pure real(wp) function sum_of(velocity, lever)
      real(wp), intent(in) :: velocity(3), lever

      sum_of = abs(velocity(1)) + abs(velocity(2)) + abs(lever*velocity(3))
   end function sum_of

   !> Slip velocity of a contact [m/s]
   pure real(wp) function slip_of(network, c, velocity)
      type(friction_network_t), intent(in) :: network
      integer(ip), intent(in) :: c
      real(wp), intent(in), contiguous :: velocity(:, :)

      associate (i => network%body(1, c), j => network%body(2, c))
         slip_of = network%row(1, c)*(velocity(1, i) - velocity(1, j)) &
            + network%row(2, c)*(velocity(2, i) - velocity(2, j)) &
            + (network%row(3, c)*velocity(3, i) - network%row(4, c)*velocity(3, j))
      end associate
   end function slip_of

   !> Give a contact the force that stops its slip, within its limit.
   pure subroutine stop_slip(network, c, force, velocity)
      type(friction_network_t), intent(in) :: network
      integer(ip), intent(in) :: c
      real(wp), intent(inout), contiguous :: force(:), velocity(:, :)
      real(wp) :: before, change, g(2)

      before = force(c)
      force(c) = within(network%limit(c), before - slip_of(network, c, velocity)*network%inverse_mobility(c))
      change = force(c) - before
      if (.not. abs(change) > 0.0_wp) return
      associate (i => network%body(1, c), j => network%body(2, c))
         g = change*network%inverse(:, i)
         ! Threads share fixed bodies, so their velocities must not be written.
         if (network%inverse(1, i) > 0.0_wp) then
            velocity(1, i) = velocity(1, i) + g(1)*network%row(1, c)
            velocity(2, i) = velocity(2, i) + g(1)*network%row(2, c)
            velocity(3, i) = velocity(3, i) + g(2)*network%row(3, c)
         end if
         g = change*network%inverse(:, j)
         if (network%inverse(1, j) > 0.0_wp) then
            velocity(1, j) = velocity(1, j) - g(1)*network%row(1, c)
            velocity(2, j) = velocity(2, j) - g(1)*network%row(2, c)
            velocity(3, j) = velocity(3, j) - g(2)*network%row(4, c)
         end if
      end associate
   end subroutine stop_slip

   !> Allocate the arrays for bodies and contacts.
   subroutine reserve(n_bodies, n_contacts, network)
      integer(ip), intent(in) :: n_bodies, n_contacts
      type(friction_network_t), intent(inout) :: network
      integer(ip) :: m

      if (allocated(network%taken)) then
         if (size(network%taken) >= n_bodies .and. size(network%order) >= n_contacts) return
      end if
      network = friction_network_t()
      m = n_contacts + n_contacts/4_ip + 16_ip
      allocate (network%taken(n_bodies), network%inverse(2, n_bodies), network%body(2, m), network%row(4, m), &
                network%mobility(m), network%inverse_mobility(m), network%limit(m), network%noise(m), &
                network%order(m), network%colour(m))
   end subroutine reserve

end module polydem_friction_network
