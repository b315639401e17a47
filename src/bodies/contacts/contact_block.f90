!> A contact as a row of the table of contacts, and a block of contacts: what one thread works on between the overlaps
!> of pairs and the forces on bodies.
!>
!> Both have the same columns, and only this module copies them. A block has fixed size and stays in the first-level
!> cache. Each of its columns is an array, so that loops over contacts vectorise. In a block the *first* body of a
!> contact is the one with the smaller radius; of equal radii it is the one with the lower identifier. These roles never
!> change. A row has the body with the lower identifier first. Exchanging the bodies of a contact changes the signs of
!> normal, direction, lever and couple, and of the forces, gradients and moments in `cohesion` and `of_area`, and
!> nothing else.
module polydem_contact_block
   use polydem_bodies, only: bodies_t
   use polydem_kinds, only: ip, wp
   use polydem_overlap_batch, only: lanes, overlap_columns_t
   implicit none
   private
   public :: contact_t, contact_block_t, block_size, load_contact, store_forces, store_contact, copy_motion, &
      is_degenerate, is_exchanged

   !> Largest number of contacts in a block
   integer(ip), parameter :: block_size = lanes

   !> A contact of the table. All vectors are in world coordinates.
   type :: contact_t
      !> Index in the pair list
      integer(ip) :: pair = 0_ip
      !> Slots of the bodies with the lower and with the higher identifier
      integer(ip) :: first = 0_ip, second = 0_ip
      !> Area of the overlap, true or effective (see `polydem_overlap_measure`) [m2]
      real(wp) :: area = 0.0_wp
      !> Rate of change of the area, exact from positions and velocities [m2/s]
      real(wp) :: rate = 0.0_wp
      !> Integral of the outward normal over the outline of the first body inside the second, with the weight of the
      !> measure [m]
      real(wp) :: normal(2) = 0.0_wp
      !> Moment of that integral about the centres of the first and of the second body [m2]
      real(wp) :: moment(2) = 0.0_wp
      !> Centroid of the overlap relative to the centres of the first and of the second body [m]
      real(wp) :: arm_first(2) = 0.0_wp, arm_second(2) = 0.0_wp
      !> Unit vector from the second body to the first: -normal/|normal|
      real(wp) :: direction(2) = 0.0_wp
      !> Length of the contact |normal|, or the square root of the area if degenerate [m]
      real(wp) :: length = 0.0_wp
      !> Square of the length of the overlap; 0 if the measure does not contain it [m2]
      real(wp) :: length_square = 0.0_wp
      !> Depth of the overlap: area over length, of contacts that are joined that of all [m]
      real(wp) :: depth = 0.0_wp
      !> With cohesion: gradient of the true area with respect to the first body (x, y) [m], its moment about the
      !> centroid, and the true area [m2]
      real(wp) :: of_area(4) = 0.0_wp
      !> Reciprocal of the characteristic length of the force model, times the ratio of the stiffness of this pair of
      !> materials to that of the law if materials differ [1/m]
      real(wp) :: inverse_length = 0.0_wp
      !> Torque of the normal force about the centroid of the overlap, on the first body, per unit of force [m]
      real(wp) :: lever = 0.0_wp
      !> Elastic repulsion of the overlap, a part of the normal force: not negative [N/m]
      real(wp) :: elastic = 0.0_wp
      !> Another force with a potential, which may attract: on the first body (x, y) [N/m], its torque about the
      !> centroid of the overlap [N], and its energy [J/m]
      real(wp) :: cohesion(4) = 0.0_wp
      !> Normal force, positive in repulsion: `elastic` and all other normal forces but `cohesion` [N/m]
      real(wp) :: normal_force = 0.0_wp
      !> Tangential force on the first body along (-direction_y, direction_x) [N/m]
      real(wp) :: tangential_force = 0.0_wp
      !> Couple of the contact: a torque on the first body in addition to those of the forces; the opposite acts on the
      !> second [N]
      real(wp) :: couple = 0.0_wp
   end type contact_t

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
      real(wp) :: couple(block_size)
   end type contact_block_t

contains

   !> Whether a contact is degenerate: its `normal` vanishes, and its `length` is the square root of the area.
   pure logical function is_degenerate(row)
      !> Row of the contact
      type(contact_t), intent(in) :: row

      is_degenerate = row%normal(1)**2 + row%normal(2)**2 < 0.25_wp*row%length**2
   end function is_degenerate

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

   !> Copy a row to contact b of a block, without the motion of its bodies.
   pure subroutine load_contact(row, bodies, b, block)
      !> The row
      type(contact_t), intent(in) :: row
      !> Bodies with their radii
      type(bodies_t), intent(in) :: bodies
      !> Index in the block
      integer(ip), intent(in) :: b
      !> The block; `has_cohesion` must be set
      type(contact_block_t), intent(inout) :: block
      real(wp) :: side, sides(4)
      logical :: exchanged

      exchanged = is_exchanged(bodies, row%first, row%second)
      side = merge(-1.0_wp, 1.0_wp, exchanged)
      block%pair(b) = row%pair
      block%first(b) = merge(row%second, row%first, exchanged)
      block%second(b) = merge(row%first, row%second, exchanged)
      block%moment(b, :) = side*merge(row%moment([2, 1]), row%moment, exchanged)
      block%arm_first(b, :) = merge(row%arm_second, row%arm_first, exchanged)
      block%arm_second(b, :) = merge(row%arm_first, row%arm_second, exchanged)
      block%area(b) = row%area
      block%rate(b) = row%rate
      block%normal(b, :) = side*row%normal
      block%direction(b, :) = side*row%direction
      block%length(b) = row%length
      block%length_square(b) = row%length_square
      block%depth(b) = row%depth
      block%degenerate(b) = merge(1.0_wp, 0.0_wp, is_degenerate(row))
      block%inverse_length(b) = row%inverse_length
      block%lever(b) = side*row%lever
      block%elastic(b) = row%elastic
      block%normal_force(b) = row%normal_force
      block%tangential_force(b) = row%tangential_force
      block%couple(b) = side*row%couple
      if (.not. block%has_cohesion) return
      sides = [side, side, side, 1.0_wp]
      block%of_area(b, :) = sides*row%of_area
      block%cohesion(b, :) = sides*row%cohesion
   end subroutine load_contact

   !> Copy contact b of a block to a row, without its forces.
   pure subroutine store_contact(block, b, row)
      type(contact_block_t), intent(in) :: block
      !> Index in the block
      integer(ip), intent(in) :: b
      !> The row
      type(contact_t), intent(inout) :: row
      real(wp) :: side
      logical :: exchanged

      exchanged = block%first(b) > block%second(b)
      side = merge(-1.0_wp, 1.0_wp, exchanged)
      row%pair = block%pair(b)
      row%first = min(block%first(b), block%second(b))
      row%second = max(block%first(b), block%second(b))
      row%moment = side*merge(block%moment(b, [2, 1]), block%moment(b, :), exchanged)
      row%arm_first = merge(block%arm_second(b, :), block%arm_first(b, :), exchanged)
      row%arm_second = merge(block%arm_first(b, :), block%arm_second(b, :), exchanged)
      row%area = block%area(b)
      row%rate = block%rate(b)
      row%normal = side*block%normal(b, :)
      row%direction = side*block%direction(b, :)
      row%length = block%length(b)
      row%length_square = block%length_square(b)
      row%depth = block%depth(b)
      if (block%has_cohesion) row%of_area = [side, side, side, 1.0_wp]*block%of_area(b, :)
   end subroutine store_contact

   !> Copy what the force law has computed for contact b of a block to a row.
   pure subroutine store_forces(block, b, row)
      type(contact_block_t), intent(in) :: block
      !> Index in the block
      integer(ip), intent(in) :: b
      !> The row; `first` must be set
      type(contact_t), intent(inout) :: row
      real(wp) :: side

      side = merge(1.0_wp, -1.0_wp, row%first == block%first(b))
      row%inverse_length = block%inverse_length(b)
      row%lever = side*block%lever(b)
      row%elastic = block%elastic(b)
      row%normal_force = block%normal_force(b)
      row%tangential_force = block%tangential_force(b)
      row%couple = side*block%couple(b)
      if (block%has_cohesion) row%cohesion = [side, side, side, 1.0_wp]*block%cohesion(b, :)
   end subroutine store_forces

end module polydem_contact_block
