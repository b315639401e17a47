!> What every part of a contact force promises.
!>
!> A force law is a list of parts. Each part looks at all contacts in one loop and adds to the columns
!> `elastic`, `normal_force` and `tangential_force` of the contact table; it never overwrites what other
!> parts left there, unless it limits their sum, which it says. Parts are immutable; what they
!> remember lies in the columns of `contact_memory_t` that ride on the pair list.
module polydem_force_part
   use polydem_bodies, only: bodies_t
   use polydem_contact_history, only: contact_memory_t
   use polydem_contacts, only: contacts_t
   use polydem_kinds, only: wp
   implicit none
   private
   public :: force_part_t

   !> One part of the force between two bodies in contact
   type, abstract :: force_part_t
   contains
      !> Add this part to the forces of all contacts
      procedure(add), deferred :: add
   end type force_part_t

   abstract interface
      !> Add this part to the forces of all contacts.
      subroutine add(self, bodies, dt, contacts, memory)
         import :: bodies_t, contact_memory_t, contacts_t, force_part_t, wp
         class(force_part_t), intent(in) :: self
         !> Bodies with the positions and velocities of this step
         type(bodies_t), intent(in) :: bodies
         !> Time since the last evaluation [s]; 0 at the start of a run
         real(wp), intent(in) :: dt
         !> Contacts of this step
         type(contacts_t), intent(inout) :: contacts
         !> What is remembered of the pairs
         type(contact_memory_t), intent(inout) :: memory
      end subroutine add
   end interface

end module polydem_force_part
