!> Base type of a constraint on velocities.
!>
!> A constraint prescribes conditions on velocities, and its forces follow from all contacts at once. It acts after the
!> parts of the force law, when all other forces on the bodies are known, and adds to the forces of contacts. Its
!> contact history is in columns of `contact_history_t`; its work arrays are components of its type.
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

   !> Forces of contacts that follow from conditions on velocities
   type, abstract, extends(law_part_t) :: velocity_constraint_t
   contains
      !> Compute the forces of all contacts
      procedure(apply), deferred :: apply
      !> Set the counters of the solver
      procedure(report), deferred :: report
   end type velocity_constraint_t

   abstract interface
      !> Compute the forces of all contacts.
      subroutine apply(self, dt, incidence, bodies, contacts, history, error)
         import :: bodies_t, contact_history_t, contacts_t, error_t, incidence_t, velocity_constraint_t, wp
         class(velocity_constraint_t), intent(inout) :: self
         !> Time step [s]
         real(wp), intent(in) :: dt
         type(incidence_t), intent(in) :: incidence
         !> Bodies as predicted by velocity Verlet, with the accelerations of the last step (0 before the first step)
         !> and all other forces of this step
         type(bodies_t), intent(in) :: bodies
         !> Contacts of this step; `tangential_force` changes
         type(contacts_t), intent(inout) :: contacts
         type(contact_history_t), intent(inout) :: history
         !> Allocated if the forces are not found
         type(error_t), allocatable, intent(inout) :: error
      end subroutine apply

      !> Set the counters of the solver.
      subroutine report(self, counters)
         import :: counters_t, velocity_constraint_t
         class(velocity_constraint_t), intent(in) :: self
         type(counters_t), intent(inout) :: counters
      end subroutine report
   end interface

end module polydem_velocity_constraint
