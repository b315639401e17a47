!> Contacts: pairs of bodies whose polygons overlap.
!>
!> Contacts are in ascending order of their pairs: of the first body, then of the second. The first body has the lower
!> identifier. All vectors are in world coordinates. `of_area`, `cohesion` and `twist` are allocated only if a
!> force part of the run needs them.
module polydem_contacts
   use polydem_grow, only: grow
   use polydem_kinds, only: ip, wp
   use polydem_overlap_measure, only: overlap_measure_t
   implicit none
   private
   public :: contacts_t, reserve_contacts, grow_contacts, copy_contact, contact_force, is_degenerate

   !> Structure of arrays over contacts 1..n; the arrays may be longer
   type :: contacts_t
      !> Number of contacts
      integer(ip) :: n = 0_ip
      !> Number of degenerate contacts, which have no direction (one body inside the other, or crossing bars)
      integer(ip) :: n_degenerate = 0_ip
      !> Whether the elastic force has an energy, elastic*area/(2 length), and cohesion states its own
      logical :: energy_is_known = .false.
      !> How overlaps are measured: `area` and the columns derived from it (`rate`, `normal`, `moment`, `direction`,
      !> `length`) are those of this measure
      type(overlap_measure_t) :: measure
      !> Whether a force part needs the columns `of_area` and `cohesion`
      logical :: has_cohesion = .false.
      !> Whether a force part needs the column `twist`
      logical :: has_twist = .false.
      !> Index in the pair list
      integer(ip), allocatable :: pair(:)
      !> Slot of the body with the lower identifier
      integer(ip), allocatable :: first(:)
      !> Slot of the body with the higher identifier
      integer(ip), allocatable :: second(:)
      !> Area of the overlap, true or effective (see `polydem_overlap_measure`) [m2]
      real(wp), allocatable :: area(:)
      !> Rate of change of the area, exact from positions and velocities [m2/s]
      real(wp), allocatable :: rate(:)
      !> Integral of the outward normal over the outline of the first body inside the second, with the weight of the
      !> measure, (2, contact) [m]
      real(wp), allocatable :: normal(:, :)
      !> Moment of that integral about the centres of the first and of the second body, (2, contact) [m2]
      real(wp), allocatable :: moment(:, :)
      !> Centroid of the overlap relative to the centre of the first body, (2, contact) [m]
      real(wp), allocatable :: arm_first(:, :)
      !> Centroid of the overlap relative to the centre of the second body, (2, contact) [m]
      real(wp), allocatable :: arm_second(:, :)
      !> Unit vector from the second body to the first, (2, contact): -normal/|normal|
      real(wp), allocatable :: direction(:, :)
      !> Length of the contact |normal|, or the square root of the area if degenerate [m]
      real(wp), allocatable :: length(:)
      !> Square of the length of the overlap; 0 if the measure does not contain it [m2]
      real(wp), allocatable :: length_square(:)
      !> Depth of the overlap: area over length, of contacts that are joined that of all [m]
      real(wp), allocatable :: depth(:)
      !> Gradient of the true area with respect to the first body (x, y) [m], its moment about the centroid, and the
      !> true area [m2], (4, contact)
      real(wp), allocatable :: of_area(:, :)
      !> Reciprocal of the characteristic length of the force model, times the ratio of the stiffness of this pair of
      !> materials to that of the law if materials differ [1/m]
      real(wp), allocatable :: inverse_length(:)
      !> Torque of the normal force about the centroid of the overlap, on the first body, per unit of force [m]
      real(wp), allocatable :: lever(:)
      !> Elastic repulsion of the overlap, a part of the normal force: not negative [N/m]
      real(wp), allocatable :: elastic(:)
      !> Another force with a potential, which may attract: on the first body (x, y) [N/m], its torque about the
      !> centroid of the overlap [N], and its energy [J/m], (4, contact)
      real(wp), allocatable :: cohesion(:, :)
      !> Normal force, positive in repulsion: `elastic` and all other normal forces but `cohesion` [N/m]
      real(wp), allocatable :: normal_force(:)
      !> Tangential force on the first body along (-direction_y, direction_x) [N/m]
      real(wp), allocatable :: tangential_force(:)
      !> Torque on the first body in addition to those of the forces; the opposite acts on the second [N]
      real(wp), allocatable :: twist(:)
   end type contacts_t

contains

   !> Whether a contact is degenerate: its `normal` vanishes, and its `length` is the square root of the area.
   pure logical function is_degenerate(contacts, c)
      type(contacts_t), intent(in) :: contacts
      !> Index of the contact
      integer(ip), intent(in) :: c

      is_degenerate = contacts%normal(1, c)**2 + contacts%normal(2, c)**2 < 0.25_wp*contacts%length(c)**2
   end function is_degenerate

   !> Make room for at least `capacity` contacts. If the arrays grow, their contents are lost, and all values are zero.
   pure subroutine reserve_contacts(contacts, capacity)
      type(contacts_t), intent(inout) :: contacts
      !> Number of contacts to make room for
      integer(ip), intent(in) :: capacity

      if (allocated(contacts%pair)) then
         if (size(contacts%pair) >= capacity) return
      end if
      call lengthen_columns(contacts, 0_ip, capacity + capacity/4_ip + 16_ip)
   end subroutine reserve_contacts

   !> Make room for at least `capacity` contacts without losing contacts 1..n.
   pure subroutine grow_contacts(contacts, capacity)
      type(contacts_t), intent(inout) :: contacts
      !> Number of contacts to make room for
      integer(ip), intent(in) :: capacity

      if (allocated(contacts%pair)) then
         if (size(contacts%pair) >= capacity) return
      end if
      call lengthen_columns(contacts, contacts%n, 2_ip*capacity + 16_ip)
   end subroutine grow_contacts

   !> Lengthen all columns, one after the other, and keep their first values. The others become zero.
   pure subroutine lengthen_columns(contacts, kept, m)
      type(contacts_t), intent(inout) :: contacts
      !> Number of contacts to keep, and new length
      integer(ip), intent(in) :: kept, m

      call grow(contacts%pair, kept, m, 0_ip)
      call grow(contacts%first, kept, m, 0_ip)
      call grow(contacts%second, kept, m, 0_ip)
      call grow(contacts%area, kept, m, 0.0_wp)
      call grow(contacts%rate, kept, m, 0.0_wp)
      call grow(contacts%normal, kept, m, 0.0_wp)
      call grow(contacts%moment, kept, m, 0.0_wp)
      call grow(contacts%arm_first, kept, m, 0.0_wp)
      call grow(contacts%arm_second, kept, m, 0.0_wp)
      call grow(contacts%direction, kept, m, 0.0_wp)
      call grow(contacts%length, kept, m, 0.0_wp)
      call grow(contacts%length_square, kept, m, 0.0_wp)
      call grow(contacts%depth, kept, m, 0.0_wp)
      call grow(contacts%inverse_length, kept, m, 0.0_wp)
      call grow(contacts%lever, kept, m, 0.0_wp)
      call grow(contacts%elastic, kept, m, 0.0_wp)
      if (contacts%has_cohesion) then
         if (.not. allocated(contacts%cohesion)) allocate (contacts%of_area(4, 0), contacts%cohesion(4, 0))
         call grow(contacts%of_area, kept, m, 0.0_wp)
         call grow(contacts%cohesion, kept, m, 0.0_wp)
      end if
      call grow(contacts%normal_force, kept, m, 0.0_wp)
      call grow(contacts%tangential_force, kept, m, 0.0_wp)
      if (contacts%has_twist) call grow(contacts%twist, kept, m, 0.0_wp)
   end subroutine lengthen_columns

   !> Copy a contact from one table to another.
   pure subroutine copy_contact(from, c, to, d)
      !> The one table
      type(contacts_t), intent(in) :: from
      !> Index of the contact in it
      integer(ip), intent(in) :: c
      !> The other table, with room for the contact
      type(contacts_t), intent(inout) :: to
      !> Index of the copy
      integer(ip), intent(in) :: d

      to%pair(d) = from%pair(c)
      to%first(d) = from%first(c)
      to%second(d) = from%second(c)
      to%area(d) = from%area(c)
      to%rate(d) = from%rate(c)
      to%normal(:, d) = from%normal(:, c)
      to%moment(:, d) = from%moment(:, c)
      to%arm_first(:, d) = from%arm_first(:, c)
      to%arm_second(:, d) = from%arm_second(:, c)
      to%direction(:, d) = from%direction(:, c)
      to%length(d) = from%length(c)
      to%length_square(d) = from%length_square(c)
      to%depth(d) = from%depth(c)
      to%inverse_length(d) = from%inverse_length(c)
      to%lever(d) = from%lever(c)
      to%elastic(d) = from%elastic(c)
      if (to%has_cohesion) to%of_area(:, d) = from%of_area(:, c)
      if (to%has_cohesion) to%cohesion(:, d) = from%cohesion(:, c)
      to%normal_force(d) = from%normal_force(c)
      to%tangential_force(d) = from%tangential_force(c)
      if (to%has_twist) to%twist(d) = from%twist(c)
   end subroutine copy_contact

   !> Force of a contact on its first body; the opposite acts on the second, (2) [N/m]
   pure function contact_force(contacts, c) result(force)
      type(contacts_t), intent(in) :: contacts
      !> Index of the contact
      integer(ip), intent(in) :: c
      real(wp) :: force(2)

      force(1) = contacts%normal_force(c)*contacts%direction(1, c) &
         - contacts%tangential_force(c)*contacts%direction(2, c)
      force(2) = contacts%normal_force(c)*contacts%direction(2, c) &
         + contacts%tangential_force(c)*contacts%direction(1, c)
      if (contacts%has_cohesion) force = force + contacts%cohesion(:2, c)
   end function contact_force

end module polydem_contacts
