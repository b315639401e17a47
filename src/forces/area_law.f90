!> Elastic normal force of the overlap area: F = E A/l.
!>
!> H.-G. Matuttis & J. Chen, Understanding the Discrete Element Method, Wiley 2014, Eq. 7.6 and 7.7: l is the
!> characteristic length 4 r1 r2/(r1 + r2) of the distances of the force point (the centroid of the overlap) from the
!> centres of mass, so that two equal squares face to face have the stiffness E.
module polydem_area_law
   use polydem_bodies, only: bodies_t
   use polydem_contact_history, only: contact_memory_t
   use polydem_contacts, only: contacts_t, is_degenerate
   use polydem_force_part, only: force_part_t
   use polydem_kinds, only: ip, wp, min_parallel_size
   implicit none
   private
   public :: area_law_t

   !> The area law
   type, extends(force_part_t) :: area_law_t
      !> Young's modulus in two dimensions E [N/m2]
      real(wp) :: stiffness
   contains
      procedure :: add
   end type area_law_t

   !> Least characteristic length as a share of the square root of the area, which only acts where the force point
   !> falls on a centre of mass; in contacts without a direction, where it often does, the whole square root.
   real(wp), parameter :: least_length = 1.0e-3_wp

contains

   !> Set the characteristic length and add the elastic force, which acts at the centroid of the overlap.
   subroutine add(self, bodies, dt, contacts, memory)
      class(area_law_t), intent(in) :: self
      !> Bodies (not used: all that matters is in the contacts)
      type(bodies_t), intent(in) :: bodies
      !> Time since the last evaluation [s] (not used)
      real(wp), intent(in) :: dt
      !> Contacts; `inverse_length`, `lever`, `elastic` and `normal_force` change
      type(contacts_t), intent(inout) :: contacts
      !> Memory of the pairs (not used)
      type(contact_memory_t), intent(inout) :: memory
      real(wp) :: r1, r2, length, force
      integer(ip) :: c

      associate (unused_bodies => bodies, unused_dt => dt, unused_memory => memory)
      end associate
      contacts%energy_is_quadratic = .false.
      !$omp parallel do if (contacts%n > min_parallel_size) schedule(static) default(none) &
      !$omp    shared(self, contacts) private(c, r1, r2, length, force)
      do c = 1_ip, contacts%n
         r1 = sqrt(contacts%arm_first(1, c)**2 + contacts%arm_first(2, c)**2)
         r2 = sqrt(contacts%arm_second(1, c)**2 + contacts%arm_second(2, c)**2)
         length = least_length*sqrt(contacts%area(c))
         if (is_degenerate(contacts, c)) length = contacts%length(c)
         if (r1 + r2 > 0.0_wp) length = max(length, 4.0_wp*r1*r2/(r1 + r2))
         contacts%inverse_length(c) = 1.0_wp/length
         contacts%lever(c) = 0.0_wp
         force = self%stiffness*contacts%area(c)*contacts%inverse_length(c)
         contacts%elastic(c) = contacts%elastic(c) + force
         contacts%normal_force(c) = contacts%normal_force(c) + force
      end do
      !$omp end parallel do
   end subroutine add

end module polydem_area_law
