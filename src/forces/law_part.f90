!> What every member of a force law knows about itself: parts of the contact force, and a constraint on velocities.
!>
!> A member takes what it needs from the settings, says whether the scene asks for it, what it stores of each pair,
!> how stiff it makes a contact, and what it does not go with. So no other file has to know its name: the factory
!> (`force_law`) offers the settings to each member in turn. A member writes only what differs from the defaults below.
module polydem_law_part
   use polydem_bodies, only: bodies_t
   use polydem_contact_element, only: contact_element_t
   use polydem_contact_history, only: history_kind_t
   use polydem_contacts, only: contacts_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip
   use polydem_settings, only: forces_settings_t, settings_t
   implicit none
   private
   public :: law_part_t

   !> A member of a force law
   type, abstract :: law_part_t
      !> Name for `check` and the log; `choose` sets it
      character(len=40) :: name = ''
      !> Place of the first of its columns among those of `contact_memory_t`; the law sets it
      integer :: first_column = 1
   contains
      !> Take what it needs from the settings
      procedure(choose), deferred :: choose
      !> Refuse what it does not go with
      procedure :: check
      !> Measure the bodies
      procedure :: measure
      !> What it stores of each pair
      procedure :: stored
      !> Add its springs and dashpots to those of a contact
      procedure :: stiffen
   end type law_part_t

   abstract interface
      !> Take what it needs from the settings, and say whether the scene asks for it.
      subroutine choose(self, settings, chosen)
         import :: forces_settings_t, law_part_t
         class(law_part_t), intent(inout) :: self
         !> Group &forces
         type(forces_settings_t), intent(in) :: settings
         !> Whether this member belongs to the law
         logical, intent(out) :: chosen
      end subroutine choose
   end interface

contains

   !> Refuse settings that it does not go with; as it is here, it goes with all.
   subroutine check(self, settings, n_processes, error)
      class(law_part_t), intent(in) :: self
      !> All settings of the run
      type(settings_t), intent(in) :: settings
      !> Number of processes that share the bodies
      integer(ip), intent(in) :: n_processes
      !> Names the entry and says what to do
      type(error_t), allocatable, intent(inout) :: error

      associate (unused_self => self, unused_settings => settings, unused_n => n_processes, unused_error => error)
      end associate
   end subroutine check

   !> Measure the bodies, whenever they are other bodies than before; as it is here, nothing about them matters.
   subroutine measure(self, bodies)
      class(law_part_t), intent(inout) :: self
      !> Bodies, for their shapes
      type(bodies_t), intent(in) :: bodies

      associate (unused_self => self, unused_bodies => bodies)
      end associate
   end subroutine measure

   !> What it stores of each pair, in the order of its columns: column(first_column), column(first_column + 1) ... of
   !> `contact_memory_t`; as it is here, nothing. Names must differ from those of other members of the same law.
   function stored(self) result(kinds)
      class(law_part_t), intent(in) :: self
      type(history_kind_t), allocatable :: kinds(:)

      associate (unused_self => self)
      end associate
      allocate (kinds(0))
   end function stored

   !> Add its springs and dashpots to those of a contact, for the stable step; as it is here, it has none. A part that
   !> acts later finds those of the parts that act before it.
   subroutine stiffen(self, bodies, contacts, element)
      class(law_part_t), intent(in) :: self
      !> Bodies
      type(bodies_t), intent(in) :: bodies
      !> Contacts with their forces; only those of `element%contact` may be looked at
      type(contacts_t), intent(in) :: contacts
      !> The contact: masses and geometry are set
      type(contact_element_t), intent(inout) :: element

      associate (unused_self => self, unused_bodies => bodies, unused_contacts => contacts, unused => element)
      end associate
   end subroutine stiffen

end module polydem_law_part
