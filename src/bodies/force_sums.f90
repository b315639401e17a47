!> Sums of the contact forces on each body, separately for elastic, normal and tangential forces.
!>
!> The force of a contact acts at the centroid of the overlap. Torques are added: `lever` times the normal force,
!> because its line of action may miss the centroid, that of cohesion for the same reason, and `couple`, the contact's
!> own torque. The second body feels the opposite force and torques.
!>
!> Each body sums over its contacts in descending order of the partner's identifier. A loop over all contacts in
!> descending order adds them in this order. So does every thread that runs over a range of contacts and keeps the
!> terms of bodies beyond its range: they follow those of the range itself, in descending order of the ranges. The sums
!> therefore have the same bits for any number of threads and ranks, and need no index from bodies to contacts.
module polydem_force_sums
   use polydem_bodies, only: bodies_t
   use polydem_contact_block, only: block_size, contact_block_t
   use polydem_contacts, only: contacts_t, load_block
   use polydem_kinds, only: ip, wp
   use polydem_term_list, only: append_term, n_terms, reserve_terms, term_list_t
   implicit none
   private
   public :: force_sums_t, contact_terms_t, n_terms, of_elastic, of_normal, of_tangential, sum_x, sum_y
   public :: sum_torque, sum_energy, begin_sums, start_sums, clear_sums, terms_of_block, term_of
   public :: add_terms, add_deferred_terms, assemble_forces, total_forces, find_forces, set_force
   public :: energy_of_contact

   !> Kinds of forces: elastic forces with cohesion; all normal forces, with the couple; tangential forces
   integer, parameter :: of_elastic = 1, of_normal = 2, of_tangential = 3
   !> Rows of a term: force along x and along y of each kind [N/m], torque of each kind [N], elastic energy [J/m]
   integer, parameter :: sum_x(3) = [1, 3, 5], sum_y(3) = [2, 4, 6], sum_torque(3) = [7, 8, 9], sum_energy = 10
   !> Number of bodies in a group for deferred terms
   integer(ip), parameter :: group = 16_ip

   !> Sums of all bodies
   type :: force_sums_t
      !> Sums over the contacts of each body, (n_terms, slot)
      real(wp), allocatable :: value(:, :)
      !> Whether a term was added to the sums of a body, (slot); the others are zero
      logical, allocatable :: has_terms(:)
      !> Those of them that are no contacts, along x and y [N/m], and torques [N], (3, slot); allocated if there are any
      real(wp), allocatable :: field(:, :)
      !> The part of these that is the same acceleration of all bodies, (2) [m/s2]
      real(wp) :: acceleration(2) = 0.0_wp
      !> The part of these that actions give to bodies, (3, slot); allocated if they give any
      real(wp), allocatable :: given(:, :)
      !> Whether `bodies` has the total forces of these sums on all bodies, not only on fixed ones
      logical :: are_in_bodies = .true.
   end type force_sums_t

   !> Terms of the contacts of a block
   type :: contact_terms_t
      !> Terms of the first body of each contact, (row, contact)
      real(wp) :: first(n_terms, block_size)
      !> Rows of the second body from its torques on; its forces are opposite, (row, contact)
      real(wp) :: second(sum_torque(1):n_terms, block_size)
   end type contact_terms_t

contains

   !> Begin to sum the forces on n bodies.
   subroutine begin_sums(n, sums)
      !> Number of bodies
      integer(ip), intent(in) :: n
      type(force_sums_t), intent(inout) :: sums

      call reserve_sums(n, sums)
      sums%are_in_bodies = .false.
   end subroutine begin_sums

   !> Make room for the sums of n bodies. New sums are zero.
   subroutine reserve_sums(n, sums)
      integer(ip), intent(in) :: n
      type(force_sums_t), intent(inout) :: sums

      if (allocated(sums%value)) then
         if (size(sums%value, 2) == n) return
         deallocate (sums%value, sums%has_terms)
      end if
      allocate (sums%value(n_terms, n), source=0.0_wp)
      allocate (sums%has_terms(n), source=.false.)
   end subroutine reserve_sums

   !> Set the sums of all n bodies to zero.
   subroutine start_sums(n, sums)
      !> Number of bodies
      integer(ip), intent(in) :: n
      type(force_sums_t), intent(inout) :: sums
      call reserve_sums(n, sums)
      call clear_sums(1_ip, n, sums)
   end subroutine start_sums

   !> Set the sums of some bodies to zero. In a dilute scene most of them are.
   pure subroutine clear_sums(first, last, sums)
      !> First and last slot
      integer(ip), intent(in) :: first, last
      type(force_sums_t), intent(inout) :: sums
      integer(ip) :: s

      do s = first, last
         if (.not. sums%has_terms(s)) cycle
         call clear(sums%value(:, s))
         sums%has_terms(s) = .false.
      end do
   end subroutine clear_sums

   !> Set the sums of a body to zero. Numbers that are named one by one cost no call of the C library.
   pure subroutine clear(value)
      real(wp), intent(out) :: value(n_terms)

      value(1) = 0.0_wp
      value(2) = 0.0_wp
      value(3) = 0.0_wp
      value(4) = 0.0_wp
      value(5) = 0.0_wp
      value(6) = 0.0_wp
      value(7) = 0.0_wp
      value(8) = 0.0_wp
      value(9) = 0.0_wp
      value(10) = 0.0_wp
   end subroutine clear

   !> Compute the terms of all contacts of a block.
   pure subroutine terms_of_block(block, terms)
      !> Contacts with their forces
      type(contact_block_t), intent(in) :: block
      type(contact_terms_t), intent(inout) :: terms
      real(wp) :: elastic, normal, tangential, x, y, lever_first, lever_second, torque
      integer(ip) :: c

      associate (first => terms%first, second => terms%second)
         do c = 1_ip, block%n
            x = block%direction(c, 1)
            y = block%direction(c, 2)
            elastic = block%elastic(c)
            normal = block%normal_force(c)
            tangential = block%tangential_force(c)
            lever_first = (block%arm_first(c, 1)*y - block%arm_first(c, 2)*x) + block%lever(c)
            lever_second = (block%arm_second(c, 1)*y - block%arm_second(c, 2)*x) + block%lever(c)
            first(1, c) = elastic*x
            first(2, c) = elastic*y
            first(3, c) = normal*x
            first(4, c) = normal*y
            first(5, c) = -tangential*y
            first(6, c) = tangential*x
            first(7, c) = elastic*lever_first
            first(8, c) = normal*lever_first + block%couple(c)
            first(9, c) = tangential*(block%arm_first(c, 1)*x + block%arm_first(c, 2)*y)
            first(10, c) = 0.5_wp*contact_energy(block%elastic(c), block%area(c), block%length(c))
            second(7, c) = -elastic*lever_second
            second(8, c) = -(normal*lever_second + block%couple(c))
            second(9, c) = -tangential*(block%arm_second(c, 1)*x + block%arm_second(c, 2)*y)
            second(10, c) = first(10, c)
         end do
      end associate
      if (.not. block%has_cohesion) return
      associate (first => terms%first, second => terms%second)
         do c = 1_ip, block%n
            x = block%cohesion(c, 1)
            y = block%cohesion(c, 2)
            first(1, c) = first(1, c) + x
            first(2, c) = first(2, c) + y
            first(3, c) = first(3, c) + x
            first(4, c) = first(4, c) + y
            torque = (block%arm_first(c, 1)*y - block%arm_first(c, 2)*x) + block%cohesion(c, 3)
            first(7, c) = first(7, c) + torque
            first(8, c) = first(8, c) + torque
            torque = (block%arm_second(c, 1)*y - block%arm_second(c, 2)*x) + block%cohesion(c, 3)
            second(7, c) = second(7, c) - torque
            second(8, c) = second(8, c) - torque
            first(10, c) = first(10, c) + 0.5_wp*block%cohesion(c, 4)
            second(10, c) = first(10, c)
         end do
      end associate
   end subroutine terms_of_block

   !> Energy of a contact of a table [J/m]
   pure real(wp) function energy_of_contact(contacts, c) result(energy)
      type(contacts_t), intent(in) :: contacts
      !> Index of the contact
      integer(ip), intent(in) :: c

      energy = contact_energy(contacts%row(c)%elastic, contacts%row(c)%area, contacts%row(c)%length)
      if (contacts%has_cohesion) energy = energy + contacts%row(c)%cohesion(4)
   end function energy_of_contact

   !> Elastic energy of a contact [J/m]: exact for laws whose contacts have one, else an estimate
   elemental real(wp) function contact_energy(elastic, area, length) result(energy)
      !> Elastic repulsion [N/m], area [m2] and length [m] of the contact
      real(wp), intent(in) :: elastic, area, length

      energy = 0.5_wp*elastic*area/length
   end function contact_energy

   !> Term of one body of a contact. The energy of a contact is divided between its two bodies.
   pure function term_of(terms, c, is_first) result(term)
      !> Terms of a block
      type(contact_terms_t), intent(in) :: terms
      !> Index in the block
      integer(ip), intent(in) :: c
      !> Whether the body is the first of the contact
      logical, intent(in) :: is_first
      real(wp) :: term(n_terms)

      term = terms%first(:, c)
      if (is_first) return
      term(:6) = -term(:6)
      term(7:) = terms%second(:, c)
   end function term_of

   !> Add the terms of a block to the sums of its bodies, in the order of the block. Terms of bodies after the last slot
   !> of this thread are appended to the deferred terms.
   pure subroutine add_terms(block, terms, last, sums, deferred)
      !> Contacts in descending order
      type(contact_block_t), intent(in) :: block
      !> Their terms
      type(contact_terms_t), intent(in) :: terms
      !> Last slot whose sums this thread may change
      integer(ip), intent(in) :: last
      type(force_sums_t), intent(inout) :: sums
      !> Terms of the bodies after `last`
      type(term_list_t), intent(inout) :: deferred
      integer(ip) :: c, low

      low = 1_ip
      if (max(maxval(block%first(:block%n)), maxval(block%second(:block%n))) > last) then
         call reserve_terms(deferred%n + block%n, deferred)
         do c = 1_ip, block%n
            if (max(block%first(c), block%second(c)) <= last) cycle
            call add_pairs(low, c - 1_ip, block%first, block%second, terms, last, sums%value, sums%has_terms)
            associate (i => block%first(c), j => block%second(c))
               call add_or_keep([i, j], term_of(terms, c, .true.), last, sums, deferred)
               call add_or_keep([j, i], term_of(terms, c, .false.), last, sums, deferred)
            end associate
            low = c + 1_ip
         end do
      end if
      call add_pairs(low, block%n, block%first, block%second, terms, last, sums%value, sums%has_terms)
   end subroutine add_terms

   !> Add the terms of contacts to the sums of their bodies, in the order of the contacts.
   pure subroutine add_pairs(low, high, i, j, terms, last, value, has_terms)
      !> First and last of the contacts
      integer(ip), intent(in) :: low, high
      !> Slots of the first and of the second body of each contact
      integer(ip), intent(in) :: i(high), j(high)
      integer(ip), intent(in) :: last
      type(contact_terms_t), intent(in) :: terms
      real(wp), intent(inout) :: value(n_terms, last)
      logical, intent(inout) :: has_terms(last)
      integer(ip) :: c

      do c = low, high
         call add(terms%first(:, c), value(:, i(c)))
         call subtract(terms%first(:, c), terms%second(:, c), value(:, j(c)))
         has_terms(i(c)) = .true.
         has_terms(j(c)) = .true.
      end do
   end subroutine add_pairs

   !> Add a term to the sums of a body. Arrays of their own let the compiler add two numbers at a time.
   pure subroutine add(term, value)
      real(wp), intent(in) :: term(n_terms)
      real(wp), intent(inout) :: value(n_terms)

      value = value + term
   end subroutine add

   !> Add the term of the second body to its sums.
   pure subroutine subtract(first, second, value)
      !> Term of the first body, and rows of the second
      real(wp), intent(in) :: first(n_terms), second(sum_torque(1):n_terms)
      real(wp), intent(inout) :: value(n_terms)

      value(:6) = value(:6) - first(:6)
      value(7:) = value(7:) + second
   end subroutine subtract

   !> Add a term to the sums of a body, or append it to the deferred terms.
   pure subroutine add_or_keep(slots, term, last, sums, deferred)
      !> Slots of the body and of its partner
      integer(ip), intent(in) :: slots(2)
      real(wp), intent(in) :: term(n_terms)
      integer(ip), intent(in) :: last
      type(force_sums_t), intent(inout) :: sums
      type(term_list_t), intent(inout) :: deferred

      if (slots(1) > last) then
         call append_term(slots, term, deferred)
      else
         sums%value(:, slots(1)) = sums%value(:, slots(1)) + term
         sums%has_terms(slots(1)) = .true.
      end if
   end subroutine add_or_keep

   !> Add deferred terms to the sums of a share of the bodies, in the order of the terms. Bodies with deferred terms lie
   !> close together. Threads therefore take turns in groups of bodies, whose sums fill whole cache lines.
   pure subroutine add_deferred_terms(deferred, k, n, sums)
      !> Deferred terms of one thread
      type(term_list_t), intent(in) :: deferred
      !> The share, from 1, and the number of shares
      integer(ip), intent(in) :: k, n
      type(force_sums_t), intent(inout) :: sums
      integer(ip) :: t

      do t = 1_ip, deferred%n
         associate (s => deferred%slots(1, t))
            if (mod(s/group, n) /= k - 1_ip) cycle
            sums%value(:, s) = sums%value(:, s) + deferred%term(:, t)
            sums%has_terms(s) = .true.
         end associate
      end do
   end subroutine add_deferred_terms

   !> Sum the forces of a whole table of contacts, and set the forces and torques on all bodies.
   subroutine assemble_forces(gravity, contacts, bodies, sums)
      !> Acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      !> Contacts with normal and tangential forces, in ascending order
      type(contacts_t), intent(in) :: contacts
      !> Bodies; `force` and `torque` are set
      type(bodies_t), intent(inout) :: bodies
      type(force_sums_t), intent(inout) :: sums
      type(contact_block_t) :: block
      type(contact_terms_t) :: terms
      type(term_list_t) :: none
      integer(ip) :: high

      call begin_sums(bodies%n, sums)
      call clear_sums(1_ip, bodies%n, sums)
      do high = contacts%n, 1_ip, -block_size
         call load_block(bodies, contacts, high, block)
         call terms_of_block(block, terms)
         call add_terms(block, terms, bodies%n, sums, none)
      end do
      call total_forces(gravity, sums, bodies)
   end subroutine assemble_forces

   !> Set the forces and torques on all bodies from the sums, and add gravity to free bodies, unless they are set.
   pure subroutine total_forces(gravity, sums, bodies)
      !> Acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      type(force_sums_t), intent(inout) :: sums
      !> Bodies; `force` and `torque` are set
      type(bodies_t), intent(inout) :: bodies
      integer(ip) :: s

      if (sums%are_in_bodies) return
      sums%are_in_bodies = .true.
      do s = 1_ip, bodies%n
         call set_force(sums%value(:, s), s, bodies)
         if (bodies%fixed(s)) cycle
         bodies%force(1, s) = bodies%force(1, s) + bodies%mass(s)*gravity(1)
         bodies%force(2, s) = bodies%force(2, s) + bodies%mass(s)*gravity(2)
      end do
   end subroutine total_forces

   !> Set the force and torque on one body from the sum of its terms.
   pure subroutine set_force(total, s, bodies)
      !> Sum of the terms
      real(wp), intent(in) :: total(n_terms)
      !> Slot of the body
      integer(ip), intent(in) :: s
      !> Bodies; `force` and `torque` of body s are set
      type(bodies_t), intent(inout) :: bodies

      bodies%force(1, s) = total(sum_x(of_normal)) + total(sum_x(of_tangential))
      bodies%force(2, s) = total(sum_y(of_normal)) + total(sum_y(of_tangential))
      bodies%torque(s) = total(sum_torque(of_normal)) + total(sum_torque(of_tangential))
   end subroutine set_force

   !> Find the forces of contacts and gravity on a run of free bodies, as `total_forces` does, without storing them.
   !> Several threads may call it for different bodies.
   pure subroutine find_forces(gravity, first, last, mass, value, has_terms, force)
      !> Acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      !> First and last slot
      integer(ip), intent(in) :: first, last
      !> Masses [kg/m]
      real(wp), intent(in) :: mass(last)
      !> Sums of the bodies
      real(wp), intent(in) :: value(n_terms, last)
      !> Whether they have terms
      logical, intent(in) :: has_terms(last)
      !> Forces along x and y [N/m] and torques [N], (3, slot)
      real(wp), intent(inout) :: force(3, first:last)
      integer(ip) :: s

      do s = first, last
         force(:, s) = 0.0_wp
         if (has_terms(s)) then
            force(1, s) = value(sum_x(of_normal), s) + value(sum_x(of_tangential), s)
            force(2, s) = value(sum_y(of_normal), s) + value(sum_y(of_tangential), s)
            force(3, s) = value(sum_torque(of_normal), s) + value(sum_torque(of_tangential), s)
         end if
         force(1, s) = force(1, s) + mass(s)*gravity(1)
         force(2, s) = force(2, s) + mass(s)*gravity(2)
      end do
   end subroutine find_forces

end module polydem_force_sums
