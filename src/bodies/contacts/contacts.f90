!> The table of contacts: pairs of bodies whose polygons overlap.
!>
!> Contacts are in ascending order of their pairs: of the first body, then of the second. The first body has the lower
!> identifier. A contact is a row (`contact_t`): its columns are listed there.
module polydem_contacts
   use polydem_bodies, only: bodies_t
   use polydem_contact_block, only: block_size, contact_block_t, contact_t, load_contact
   use polydem_kinds, only: ip, wp
   use polydem_overlap_measure, only: overlap_measure_t
   implicit none
   private
   public :: contacts_t, reserve_contacts, grow_contacts, load_block, contact_force

   !> Contacts 1..n; there may be more rows
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
      !> Whether there is cohesion: `of_area` and `cohesion` are 0 otherwise
      logical :: has_cohesion = .false.
      !> Whether a force part adds to `couple`
      logical :: has_couple = .false.
      !> The contacts
      type(contact_t), allocatable :: row(:)
   end type contacts_t

contains

   !> Make room for at least `capacity` contacts. If there are too few rows, their contents are lost, and all values are
   !> zero.
   pure subroutine reserve_contacts(contacts, capacity)
      type(contacts_t), intent(inout) :: contacts
      !> Number of contacts to make room for
      integer(ip), intent(in) :: capacity

      if (allocated(contacts%row)) then
         if (size(contacts%row) >= capacity) return
         deallocate (contacts%row)
      end if
      allocate (contacts%row(capacity + capacity/4_ip + 16_ip))
   end subroutine reserve_contacts

   !> Make room for at least `capacity` contacts without losing contacts 1..n. Other values are zero.
   pure subroutine grow_contacts(contacts, capacity)
      type(contacts_t), intent(inout) :: contacts
      !> Number of contacts to make room for
      integer(ip), intent(in) :: capacity
      type(contact_t), allocatable :: longer(:)

      if (allocated(contacts%row)) then
         if (size(contacts%row) >= capacity) return
      end if
      allocate (longer(2_ip*capacity + 16_ip))
      if (contacts%n > 0_ip) longer(:contacts%n) = contacts%row(:contacts%n)
      call move_alloc(longer, contacts%row)
   end subroutine grow_contacts

   !> Copy some contacts of a table into a block, without the motion of their bodies.
   pure subroutine load_block(bodies, contacts, high, block)
      !> Bodies with their radii
      type(bodies_t), intent(in) :: bodies
      type(contacts_t), intent(in) :: contacts
      !> First contact to copy; those before it follow in descending order, up to `block_size` contacts
      integer(ip), intent(in) :: high
      type(contact_block_t), intent(inout) :: block
      integer(ip) :: b

      block%n = min(high, block_size)
      block%has_cohesion = contacts%has_cohesion
      do b = 1_ip, block%n
         call load_contact(contacts%row(high - b + 1_ip), bodies, b, block)
      end do
   end subroutine load_block

   !> Force of a contact on its first body; the opposite acts on the second, (2) [N/m]
   pure function contact_force(contacts, c) result(force)
      type(contacts_t), intent(in) :: contacts
      !> Index of the contact
      integer(ip), intent(in) :: c
      real(wp) :: force(2)

      associate (row => contacts%row(c))
         force(1) = row%normal_force*row%direction(1) - row%tangential_force*row%direction(2)
         force(2) = row%normal_force*row%direction(2) + row%tangential_force*row%direction(1)
         if (contacts%has_cohesion) force = force + row%cohesion(:2)
      end associate
   end function contact_force

end module polydem_contacts
