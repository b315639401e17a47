!> Normal damping by the exact rate of the overlap area: F = gamma sqrt(m_eff E) (dA/dt)/l.
!>
!> Matuttis & Chen 2014, Eq. 7.13, with dA/dt from positions and velocities instead of a backward difference. There is
!> no contact history, no lag of half a step and no jump in the first step of a contact.
module polydem_rate_damping
   use polydem_bodies, only: bodies_t
   use polydem_contact_history, only: contact_history_t
   use polydem_contacts, only: contacts_t
   use polydem_kinds, only: ip, wp
   use polydem_normal_damping, only: block_size, normal_damping_t
   implicit none
   private
   public :: rate_damping_t

   !> Damping by the rate of the area
   type, extends(normal_damping_t) :: rate_damping_t
   contains
      procedure :: find_forces
   end type rate_damping_t

contains

   !> Compute the damping forces of one block of contacts.
   subroutine find_forces(self, bodies, dt, contacts, history, low, high, force)
      class(rate_damping_t), intent(in) :: self
      !> Bodies, for their masses
      type(bodies_t), intent(in) :: bodies
      !> Time since the last evaluation [s] (not used)
      real(wp), intent(in) :: dt
      !> Contacts
      type(contacts_t), intent(in) :: contacts
      !> Contact history (not used)
      type(contact_history_t), intent(inout) :: history
      !> First and last contact of the block
      integer(ip), intent(in) :: low, high
      !> Damping force of contact c at index c - low + 1 [N/m]
      real(wp), intent(inout) :: force(block_size)
      real(wp) :: mobility
      integer(ip) :: c

      associate (unused_dt => dt, unused_history => history)
      end associate
      do c = low, high
         mobility = bodies%inverse_mass(contacts%first(c)) + bodies%inverse_mass(contacts%second(c))
         force(c - low + 1_ip) = self%coefficient*sqrt(self%stiffness/mobility)*contacts%rate(c) &
            *contacts%inverse_length(c)
      end do
   end subroutine find_forces

end module polydem_rate_damping
