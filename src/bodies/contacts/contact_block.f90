!> A block of contacts: what one thread works on between the overlaps of pairs and the forces on bodies.
!>
!> A block has fixed size and stays in the first-level cache. Its columns are like those of the table of contacts
!> (`contacts_t`), but with the contact as first index, so that loops over contacts vectorise. In a block the *first*
!> body of a contact is the one with the smaller radius; of equal radii it is the one with the lower identifier. These
!> roles never change. A table has the body with the lower identifier first. Exchanging the bodies of a contact changes
!> the signs of normal, direction, lever and twist, and of the forces, gradients and moments in `cohesion` and
!> `of_area`, and nothing else.
module polydem_contact_block
   use polydem_bodies, only: bodies_t
   use polydem_contacts, only: contacts_t, is_degenerate
   use polydem_kinds, only: ip, wp
   use polydem_overlap_batch, only: lanes, overlap_columns_t
   implicit none
   private
   public :: contact_block_t, block_size, load_block, store_forces, store_contact, copy_motion, &
      is_exchanged

   !> Largest number of contacts in a block
   integer(ip), parameter :: block_size = lanes

   !> Structure of arrays over contacts 1..n. Those that it extends are written by the evaluation of a batch of pairs;
   !> in a degenerate contact, `length` is the square root of the area.
   type, extends(overlap_columns_t) :: contact_block_t
      !> Number of contacts
      integer(ip) :: n = 0_ip
      !> Whether there is cohesion; otherwise `of_area` and `cohesion` are not set
      logical :: has_cohesion = .false.
      !> Index in the pair list
      integer(ip) :: pair(block_size) = 0_ip
      !> Slots of the first and of the second body
      integer(ip) :: first(block_size) = 0_ip, second(block_size) = 0_ip
      !> First and second piece; set only if bodies have several pieces, (contact, body)
      integer(ip) :: piece(block_size, 2)
      !> Numbers of the materials of both bodies; set only if bodies have materials, (contact, body)
      integer(ip) :: material(block_size, 2)
      !> Rate of change of the area [m2/s]
      real(wp) :: rate(block_size)
      !> Unit vector from the second body to the first, (contact, x or y)
      real(wp) :: direction(block_size, 2)
      !> 1 for a degenerate contact, else 0
      real(wp) :: degenerate(block_size)
      !> Depth of the overlap [m]
      real(wp) :: depth(block_size)
      !> Velocities of the centres of both bodies, (contact, x or y) [m/s]
      real(wp) :: velocity_first(block_size, 2), velocity_second(block_size, 2)
      !> Angular velocities of the first and of the second body, (contact, body) [rad/s]
      real(wp) :: angular_velocity(block_size, 2)
      !> Sum of the reciprocal masses [m/kg]
      real(wp) :: mobility(block_size)
      !> Reciprocal moments of inertia, (contact, body) [1/(kg m)]
      real(wp) :: inverse_inertia(block_size, 2)
      !> Reciprocal of the characteristic length of the force model, times the ratio of the stiffness of this pair of
      !> materials to that of the law if materials differ [1/m]
      real(wp) :: inverse_length(block_size)
      !> Torque of the normal force about the centroid of the overlap, on the first body, per unit of force [m]
      real(wp) :: lever(block_size)
      !> Elastic repulsion of the overlap, a part of the normal force: not negative [N/m]
      real(wp) :: elastic(block_size)
      !> Another force with a potential, which may attract: on the first body (x, y) [N/m], its torque about the
      !> centroid of the overlap [N], and its energy [J/m]
      real(wp) :: cohesion(block_size, 4)
      !> Normal force, positive in repulsion: `elastic` and all other normal forces but `cohesion` [N/m]
      real(wp) :: normal_force(block_size)
      !> Of one of several contacts between the same two bodies, where fixed bodies count as one: its normal damping
      !> force [N/m] and its dashpot [N s/m2], both over 2 zeta; 0 for a contact alone. Set only if the force law needs
      !> shares
      real(wp) :: shared_force(block_size), shared_dashpot(block_size)
      !> Normal damping force per normal velocity, before its limit; set only if tilts are damped [N s/m2]
      real(wp) :: dashpot(block_size)
      !> Tangential force on the first body along (-direction_y, direction_x) [N/m]
      real(wp) :: tangential_force(block_size)
      !> Torque on the first body in addition to those of the forces; the opposite acts on the second [N]
      real(wp) :: twist(block_size)
   end type contact_block_t

contains

   !> Whether the first body of a contact is the one with the higher slot, the second of the table
   pure logical function is_exchanged(bodies, low, high)
      !> Bodies with their radii
      type(bodies_t), intent(in) :: bodies
      !> Slots of the two bodies, low < high
      integer(ip), intent(in) :: low, high

      is_exchanged = bodies%radius(high) < bodies%radius(low)
   end function is_exchanged

   !> Copy velocities, masses and materials of the bodies to the contacts of a block.
   pure subroutine copy_motion(bodies, block)
      type(bodies_t), intent(in) :: bodies
      !> Contacts; `velocity_first` to `inverse_inertia`, and `material`, are set
      type(contact_block_t), intent(inout) :: block
      integer(ip) :: c, i, j

      do c = 1_ip, block%n
         i = block%first(c)
         j = block%second(c)
         block%velocity_first(c, 1) = bodies%velocity(1, i)
         block%velocity_first(c, 2) = bodies%velocity(2, i)
         block%velocity_second(c, 1) = bodies%velocity(1, j)
         block%velocity_second(c, 2) = bodies%velocity(2, j)
         block%angular_velocity(c, 1) = bodies%angular_velocity(i)
         block%angular_velocity(c, 2) = bodies%angular_velocity(j)
         block%mobility(c) = bodies%inverse_mass(i) + bodies%inverse_mass(j)
         block%inverse_inertia(c, 1) = bodies%inverse_inertia(i)
         block%inverse_inertia(c, 2) = bodies%inverse_inertia(j)
      end do
      if (.not. allocated(bodies%material)) return
      do c = 1_ip, block%n
         block%material(c, 1) = bodies%material(block%first(c))
         block%material(c, 2) = bodies%material(block%second(c))
      end do
   end subroutine copy_motion

   !> Copy some contacts of a table into a block, without the motion of their bodies.
   pure subroutine load_block(bodies, contacts, high, block)
      !> Bodies with their radii
      type(bodies_t), intent(in) :: bodies
      type(contacts_t), intent(in) :: contacts
      !> First contact to copy; those before it follow in descending order, up to `block_size` contacts
      integer(ip), intent(in) :: high
      type(contact_block_t), intent(inout) :: block
      real(wp) :: side, sides(4)
      integer(ip) :: b, c
      logical :: exchanged

      block%n = min(high, block_size)
      block%has_cohesion = contacts%has_cohesion
      do b = 1_ip, block%n
         c = high - b + 1_ip
         block%pair(b) = contacts%pair(c)
         exchanged = is_exchanged(bodies, contacts%first(c), contacts%second(c))
         side = merge(-1.0_wp, 1.0_wp, exchanged)
         block%first(b) = merge(contacts%second(c), contacts%first(c), exchanged)
         block%second(b) = merge(contacts%first(c), contacts%second(c), exchanged)
         block%moment(b, :) = side*merge(contacts%moment([2, 1], c), contacts%moment(:, c), exchanged)
         block%arm_first(b, :) = merge(contacts%arm_second(:, c), contacts%arm_first(:, c), exchanged)
         block%arm_second(b, :) = merge(contacts%arm_first(:, c), contacts%arm_second(:, c), exchanged)
         block%area(b) = contacts%area(c)
         block%rate(b) = contacts%rate(c)
         block%normal(b, :) = side*contacts%normal(:, c)
         block%direction(b, :) = side*contacts%direction(:, c)
         block%length(b) = contacts%length(c)
         block%length_square(b) = contacts%length_square(c)
         block%depth(b) = contacts%depth(c)
         block%degenerate(b) = merge(1.0_wp, 0.0_wp, is_degenerate(contacts, c))
         block%inverse_length(b) = contacts%inverse_length(c)
         block%lever(b) = side*contacts%lever(c)
         block%elastic(b) = contacts%elastic(c)
         block%normal_force(b) = contacts%normal_force(c)
         block%tangential_force(b) = contacts%tangential_force(c)
         if (contacts%has_cohesion) then
            sides = [side, side, side, 1.0_wp]
            block%of_area(b, :) = sides*contacts%of_area(:, c)
            block%cohesion(b, :) = sides*contacts%cohesion(:, c)
         end if
         block%twist(b) = 0.0_wp
         if (contacts%has_twist) block%twist(b) = side*contacts%twist(c)
      end do
   end subroutine load_block

   !> Copy what the force law has computed for contact b of a block to contact c of a table.
   pure subroutine store_forces(block, b, contacts, c)
      type(contact_block_t), intent(in) :: block
      !> Index in the block
      integer(ip), intent(in) :: b
      !> Table of contacts; `first` of contact c must be set
      type(contacts_t), intent(inout) :: contacts
      !> Index in the table
      integer(ip), intent(in) :: c
      real(wp) :: side

      side = merge(1.0_wp, -1.0_wp, contacts%first(c) == block%first(b))
      contacts%inverse_length(c) = block%inverse_length(b)
      contacts%lever(c) = side*block%lever(b)
      contacts%elastic(c) = block%elastic(b)
      contacts%normal_force(c) = block%normal_force(b)
      contacts%tangential_force(c) = block%tangential_force(b)
      if (contacts%has_cohesion) contacts%cohesion(:, c) = [side, side, side, 1.0_wp]*block%cohesion(b, :)
      if (contacts%has_twist) contacts%twist(c) = side*block%twist(b)
   end subroutine store_forces

   !> Copy contact b of a block to contact c of a table.
   pure subroutine store_contact(block, b, contacts, c)
      type(contact_block_t), intent(in) :: block
      !> Index in the block
      integer(ip), intent(in) :: b
      type(contacts_t), intent(inout) :: contacts
      !> Index in the table
      integer(ip), intent(in) :: c
      real(wp) :: side
      logical :: exchanged

      exchanged = block%first(b) > block%second(b)
      side = merge(-1.0_wp, 1.0_wp, exchanged)
      contacts%pair(c) = block%pair(b)
      contacts%first(c) = min(block%first(b), block%second(b))
      contacts%second(c) = max(block%first(b), block%second(b))
      contacts%moment(:, c) = side*merge(block%moment(b, [2, 1]), block%moment(b, :), exchanged)
      contacts%arm_first(:, c) = merge(block%arm_second(b, :), block%arm_first(b, :), exchanged)
      contacts%arm_second(:, c) = merge(block%arm_first(b, :), block%arm_second(b, :), exchanged)
      contacts%area(c) = block%area(b)
      contacts%rate(c) = block%rate(b)
      contacts%normal(:, c) = side*block%normal(b, :)
      contacts%direction(:, c) = side*block%direction(b, :)
      contacts%length(c) = block%length(b)
      contacts%length_square(c) = block%length_square(b)
      contacts%depth(c) = block%depth(b)
      if (contacts%has_cohesion) contacts%of_area(:, c) = [side, side, side, 1.0_wp]*block%of_area(b, :)
   end subroutine store_contact

end module polydem_contact_block
