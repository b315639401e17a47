!> Contacts (pairs of bodies whose polygons overlap), and what is remembered about pairs between steps.
!>
!> Contacts stand in ascending order of their pairs: of the first body, then of the second. The first body
!> has the lower identifier. All vectors point in world directions.
!>
!> Memory rides on the pair list: entry `p` belongs to pair `p`, follows it when the list changes, and is
!> cleared when the polygons part. A column of memory, or `twist`, that no model of the scene needs is never allocated.
module polydem_contacts
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: contacts_t, contact_memory_t, memory_kinds, at_tangential, at_area, at_direction, &
      reserve_contacts, is_degenerate

   !> Structure of arrays over contacts 1..n; the arrays may be longer
   type :: contacts_t
      !> Number of contacts
      integer(ip) :: n = 0_ip
      !> Number of contacts without a direction (one body inside the other, or crossing bars)
      integer(ip) :: n_degenerate = 0_ip
      !> Whether the elastic force has an energy, quadratic in `area`: half of elastic area/length
      logical :: energy_is_quadratic = .false.
      !> Whether `area` and what follows from it (`rate`, `normal`, `moment`, `direction`, `length`) are to be those of
      !> the effective area, which differs from the area by the shape of the overlap
      logical :: area_is_effective = .false.
      !> Whether the law needs the column `twist`
      logical :: has_twist = .false.
      !> Place in the pair list
      integer(ip), allocatable :: pair(:)
      !> Slot of the body with the lower identifier
      integer(ip), allocatable :: first(:)
      !> Slot of the body with the higher identifier
      integer(ip), allocatable :: second(:)
      !> Area of the overlap, true or effective [m2]
      real(wp), allocatable :: area(:)
      !> Rate of change of the area, exact from positions and velocities [m2/s]
      real(wp), allocatable :: rate(:)
      !> Integral of the outward normal over the outline of the first body inside the second, weighted if the area is
      !> effective, (2, contact) [m]
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
      !> Reciprocal of the characteristic length of the force law [1/m]
      real(wp), allocatable :: inverse_length(:)
      !> Torque of the normal force about the centroid of the overlap, on the first body, per unit of force [m]
      real(wp), allocatable :: lever(:)
      !> Elastic part of the normal force, positive in repulsion [N/m]
      real(wp), allocatable :: elastic(:)
      !> Normal force, positive in repulsion [N/m]
      real(wp), allocatable :: normal_force(:)
      !> Tangential force on the first body along (-direction_y, direction_x) [N/m]
      real(wp), allocatable :: tangential_force(:)
      !> Torque on the first body besides those of the forces, the opposite on the second, where a model needs it [N]
      real(wp), allocatable :: twist(:)
      !> Force on the first body; the second feels the opposite, (2, contact) [N/m]
      real(wp), allocatable :: force(:, :)
   end type contacts_t

   !> Something that force parts remember of pairs from step to step
   type :: memory_kind_t
      !> Name in checkpoints, and unit
      character(len=16) :: name, unit
      !> What it is
      character(len=48) :: meaning
   end type memory_kind_t

   !> Rows of the table of what is remembered
   integer, parameter :: at_tangential = 1, at_area = 2, at_direction = 3
   !> All that can be remembered. The tangential force is that of the spring or of exact friction; the area serves
   !> the book's backward difference, and to know new contacts; the direction, packed in one number, serves a guard
   type(memory_kind_t), parameter :: memory_kinds(*) = [ &
      memory_kind_t('tangential', 'N/m', 'tangential force remembered'), &
      memory_kind_t('area', 'm2', 'area of the overlap at the last step'), &
      memory_kind_t('direction', '1', 'direction at the last step, packed')]

   !> A column of memory
   type :: memory_column_t
      !> Value of each pair, zero when its bodies do not overlap; not allocated where no model asks for it, (pair)
      real(wp), allocatable :: value(:)
   end type memory_column_t

   !> What is remembered of pairs: columns that ride on the pair list
   type :: contact_memory_t
      !> Edge that separated the pair last: +k of the first body, -k of the second, 0 unknown
      integer(ip), allocatable :: separating_edge(:)
      !> Columns in the order of the table
      type(memory_column_t) :: column(size(memory_kinds))
   end type contact_memory_t

contains

   !> Whether a contact has no direction of its own: its `normal` vanishes, and its `length` is made up.
   pure logical function is_degenerate(contacts, c)
      !> Table of contacts
      type(contacts_t), intent(in) :: contacts
      !> Place in the table
      integer(ip), intent(in) :: c

      is_degenerate = contacts%normal(1, c)**2 + contacts%normal(2, c)**2 < 0.25_wp*contacts%length(c)**2
   end function is_degenerate

   !> Make room for at least `capacity` contacts; contents are lost when the arrays grow.
   subroutine reserve_contacts(contacts, capacity)
      !> Table of contacts
      type(contacts_t), intent(inout) :: contacts
      !> Number of contacts to make room for
      integer(ip), intent(in) :: capacity
      integer(ip) :: m

      if (allocated(contacts%pair)) then
         if (size(contacts%pair) >= capacity) return
         deallocate (contacts%pair, contacts%first, contacts%second, contacts%area, contacts%rate, &
                     contacts%normal, contacts%moment, contacts%arm_first, contacts%arm_second, &
                     contacts%direction, contacts%length, contacts%inverse_length, contacts%lever, &
                     contacts%elastic, contacts%normal_force, contacts%tangential_force, contacts%force)
         if (allocated(contacts%twist)) deallocate (contacts%twist)
      end if
      m = capacity + capacity/4_ip + 16_ip
      allocate (contacts%pair(m), contacts%first(m), contacts%second(m), contacts%area(m), &
                contacts%rate(m), contacts%normal(2, m), contacts%moment(2, m), &
                contacts%arm_first(2, m), contacts%arm_second(2, m), contacts%direction(2, m), &
                contacts%length(m), contacts%inverse_length(m), contacts%lever(m), &
                contacts%elastic(m), contacts%normal_force(m), contacts%tangential_force(m), contacts%force(2, m))
      if (contacts%has_twist) allocate (contacts%twist(m))
   end subroutine reserve_contacts

end module polydem_contacts
