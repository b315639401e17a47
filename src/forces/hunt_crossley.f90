!> Normal damping in proportion to the elastic force: F = F_el (1 + a v_n), a = gamma sqrt(m_eff/E)/l.
!>
!> K.H. Hunt & F.R.E. Crossley, J. Appl. Mech. 42 (1975) 440, with v_n = (dA/dt)/L, so that the loss is never negative.
!> It vanishes with the overlap: nothing jumps when bodies touch, and restitution converges with the second order of
!> the step. Slow impacts lose less: with u = a v before and e the restitution, u - ln(1 + u) = -e u - ln(1 - e u),
!> e = 1 - 2u/3 + ... The sum of the normal forces is not allowed to become attractive.
module polydem_hunt_crossley
   use polydem_bodies, only: bodies_t
   use polydem_contact_history, only: contact_memory_t
   use polydem_contacts, only: contacts_t
   use polydem_force_part, only: force_part_t
   use polydem_kinds, only: ip, wp, min_parallel_size
   implicit none
   private
   public :: hunt_crossley_t

   !> Damping in proportion to the elastic force
   type, extends(force_part_t) :: hunt_crossley_t
      !> Young's modulus in two dimensions E [N/m2]
      real(wp) :: stiffness
      !> Dimensionless damping coefficient gamma
      real(wp) :: coefficient
   contains
      procedure :: add
   end type hunt_crossley_t

contains

   !> Add the damping and limit the sum to repulsion.
   subroutine add(self, bodies, dt, contacts, memory)
      class(hunt_crossley_t), intent(in) :: self
      !> Bodies, for their masses
      type(bodies_t), intent(in) :: bodies
      !> Time since the last evaluation [s] (not used)
      real(wp), intent(in) :: dt
      !> Contacts; `normal_force` changes
      type(contacts_t), intent(inout) :: contacts
      !> Memory of the pairs (not used)
      type(contact_memory_t), intent(inout) :: memory
      real(wp) :: mobility, share
      integer(ip) :: c

      associate (unused_dt => dt, unused_memory => memory)
      end associate
      !$omp parallel do if (contacts%n > min_parallel_size) schedule(static) default(none) &
      !$omp    shared(self, bodies, contacts) private(c, mobility, share)
      do c = 1_ip, contacts%n
         mobility = bodies%inverse_mass(contacts%first(c)) + bodies%inverse_mass(contacts%second(c))
         ! Bars that nearly cross turn without approach: L is not taken shorter than the side of a square of the area.
         share = self%coefficient*sqrt(1.0_wp/(mobility*self%stiffness))*contacts%inverse_length(c) &
            *(contacts%rate(c)/max(contacts%length(c), sqrt(contacts%area(c))))
         contacts%normal_force(c) = max(0.0_wp, contacts%normal_force(c) + contacts%elastic(c)*share)
      end do
      !$omp end parallel do
   end subroutine add

end module polydem_hunt_crossley
