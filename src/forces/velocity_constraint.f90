!> What every constraint on velocities promises.
!>
!> A constraint knows no force law: it asks for velocities, and the forces follow from all contacts at once. So it acts
!> after the parts of the force law, when all other forces on the bodies are known, and adds to the
!> forces of contacts. What it remembers lies in the columns of `contact_memory_t`; what it needs to work is its own.
module polydem_velocity_constraint
   use polydem_bodies, only: bodies_t
   use polydem_contact_history, only: contact_history_t
   use polydem_contact_incidence, only: incidence_t
   use polydem_contacts, only: contacts_t
   use polydem_counters, only: counters_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: wp
   use polydem_law_part, only: law_part_t
   implicit none
   private
   public :: velocity_constraint_t

   !> Forces of contacts that follow from a demand on velocities
   type, abstract, extends(law_part_t) :: velocity_constraint_t
   contains
      !> Find the forces of all contacts
      procedure(apply), deferred :: apply
      !> Set the counters of the work done so far
      procedure(report), deferred :: report
   end type velocity_constraint_t

   abstract interface
      !> Find the forces of all contacts.
      subroutine apply(self, dt, incidence, bodies, contacts, history, error)
         import :: bodies_t, contact_history_t, contacts_t, error_t, incidence_t, velocity_constraint_t, wp
         class(velocity_constraint_t), intent(inout) :: self
         !> Step [s]
         real(wp), intent(in) :: dt
         !> Index of the contacts
         type(incidence_t), intent(in) :: incidence
         !> Bodies as velocity Verlet predicts them, with the accelerations of the last step (0 before the first) and
         !> all other forces of this one
         type(bodies_t), intent(in) :: bodies
         !> Contacts of this step; `tangential_force` changes
         type(contacts_t), intent(inout) :: contacts
         !> What is remembered of the pairs
         type(contact_history_t), intent(inout) :: history
         !> The forces were not found
         type(error_t), allocatable, intent(inout) :: error
      end subroutine apply

      !> Set the counters of the work done so far.
      subroutine report(self, counters)
         import :: counters_t, velocity_constraint_t
         class(velocity_constraint_t), intent(in) :: self
         !> List to set them in
         type(counters_t), intent(inout) :: counters
      end subroutine report
   end interface

end module polydem_velocity_constraint
