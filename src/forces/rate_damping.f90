!> Normal damping by the exact rate of the overlap area: F = gamma sqrt(m_eff E) (dA/dt)/l.
!>
!> Matuttis & Chen 2014, Eq. 7.13, with dA/dt taken from positions and velocities instead of a backward
!> difference: no memory, no lag of half a step, no jump at the first step of a contact. The sum of the
!> normal forces is not allowed to become attractive.
module polydem_rate_damping
   use polydem_bodies, only: bodies_t
   use polydem_contact_history, only: contact_memory_t
   use polydem_contacts, only: contacts_t
   use polydem_force_part, only: force_part_t
   use polydem_kinds, only: ip, wp, min_parallel_size
   implicit none
   private
   public :: rate_damping_t

   !> Damping by the rate of the area
   type, extends(force_part_t) :: rate_damping_t
      !> Young's modulus in two dimensions E [N/m2]
      real(wp) :: stiffness
      !> Dimensionless damping coefficient gamma
      real(wp) :: coefficient
   contains
      procedure :: add
   end type rate_damping_t

contains

   !> Add the damping and limit the sum to repulsion.
   subroutine add(self, bodies, dt, contacts, memory)
      class(rate_damping_t), intent(in) :: self
      !> Bodies, for their masses
      type(bodies_t), intent(in) :: bodies
      !> Time since the last evaluation [s] (not used)
      real(wp), intent(in) :: dt
      !> Contacts; `normal_force` changes
      type(contacts_t), intent(inout) :: contacts
      !> Memory of the pairs (not used)
      type(contact_memory_t), intent(inout) :: memory
      real(wp) :: mobility, force
      integer(ip) :: c

      associate (unused_dt => dt, unused_memory => memory)
      end associate
      !$omp parallel do if (contacts%n > min_parallel_size) schedule(static) default(none) &
      !$omp    shared(self, bodies, contacts) private(c, mobility, force)
      do c = 1_ip, contacts%n
         mobility = bodies%inverse_mass(contacts%first(c)) + bodies%inverse_mass(contacts%second(c))
         force = self%coefficient*sqrt(self%stiffness/mobility)*contacts%rate(c)*contacts%inverse_length(c)
         contacts%normal_force(c) = max(0.0_wp, contacts%normal_force(c) + force)
      end do
      !$omp end parallel do
   end subroutine add

end module polydem_rate_damping
