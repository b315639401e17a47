!> Normal damping by the exact rate of the overlap area: F = gamma sqrt(m_eff E) (dA/dt)/l.
!>
!> Matuttis & Chen 2014, Eq. 7.13, with dA/dt from positions and velocities instead of a backward difference. There is
!> no contact history, no lag of half a step and no jump in the first step of a contact.
module polydem_rate_damping
   use polydem_contact_block, only: block_size, contact_block_t
   use polydem_kinds, only: ip, wp
   use polydem_normal_damping, only: normal_damping_t
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
   subroutine find_forces(self, block, force)
      class(rate_damping_t), intent(in) :: self
      type(contact_block_t), intent(in) :: block
      real(wp), intent(inout) :: force(block_size)
      integer(ip) :: c

      do c = 1_ip, block%n
         force(c) = self%coefficient%one*sqrt(self%stiffness/block%mobility(c))*block%rate(c) &
            *block%inverse_length(c)
      end do
   end subroutine find_forces

end module polydem_rate_damping
