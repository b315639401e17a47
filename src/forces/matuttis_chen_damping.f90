!> Normal damping as in the programs that accompany the book: backward difference of the area, with cut-offs.
!>
!> Matuttis & Chen 2014, Eq. 7.13: F = gamma sqrt(m_eff E) (A - A_old)/(l dt), where A_old is 0 in the first step of
!> a contact; on approach at most four times the elastic force (p. 227), never attractive in sum (p. 277).
!> Meant for comparison; `rate_damping` is the same law without the artefacts of the difference.
module polydem_matuttis_chen_damping
   use polydem_bodies, only: bodies_t
   use polydem_contact_history, only: at_area, contact_memory_t
   use polydem_contacts, only: contacts_t
   use polydem_force_part, only: force_part_t
   use polydem_kinds, only: ip, wp, min_parallel_size
   implicit none
   private
   public :: book_damping_t

   !> Damping by the backward difference of the area
   type, extends(force_part_t) :: book_damping_t
      !> Young's modulus in two dimensions E [N/m2]
      real(wp) :: stiffness
      !> Dimensionless damping coefficient gamma
      real(wp) :: coefficient
   contains
      procedure :: add
   end type book_damping_t

   !> Greatest damping on approach, as a multiple of the elastic force
   real(wp), parameter :: approach_limit = 4.0_wp

contains

   !> Add the damping, limit the sum to repulsion and remember the area.
   subroutine add(self, bodies, dt, contacts, memory)
      class(book_damping_t), intent(in) :: self
      !> Bodies, for their masses
      type(bodies_t), intent(in) :: bodies
      !> Time since the last evaluation [s]; 0: no rate is known, no damping
      real(wp), intent(in) :: dt
      !> Contacts; `normal_force` changes
      type(contacts_t), intent(inout) :: contacts
      !> Memory of the pairs; `area` is read and set
      type(contact_memory_t), intent(inout) :: memory
      real(wp) :: mobility, force
      integer(ip) :: c

      !$omp parallel do if (contacts%n > min_parallel_size) schedule(static) default(none) &
      !$omp    shared(self, bodies, dt, contacts, memory) &
      !$omp    private(c, mobility, force)
      do c = 1_ip, contacts%n
         force = 0.0_wp
         if (dt > 0.0_wp) then
            mobility = bodies%inverse_mass(contacts%first(c)) + bodies%inverse_mass(contacts%second(c))
            force = self%coefficient*sqrt(self%stiffness/mobility)*contacts%inverse_length(c) &
               *((contacts%area(c) - memory%column(at_area)%value(contacts%pair(c)))/dt)
            force = min(force, approach_limit*contacts%elastic(c))
         end if
         contacts%normal_force(c) = max(0.0_wp, contacts%normal_force(c) + force)
         memory%column(at_area)%value(contacts%pair(c)) = contacts%area(c)
      end do
      !$omp end parallel do
   end subroutine add

end module polydem_matuttis_chen_damping
