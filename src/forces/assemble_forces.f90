!> Sums the forces of contacts into forces and torques of bodies.
!>
!> The force of a contact acts at the centroid of the overlap. Two torques are added: `lever` times the normal force,
!> because its line of action may miss the centroid, and `twist`, the contact's own torque. The second body feels the
!> opposite force and torques.
!>
!> Each body sums over its contacts in ascending order of the partner's identifier, so the result has the same bits for
!> any number of threads. The table of contacts is in ascending order of the first body. For the second body, the
!> contact index (`incidence_t`) gives the order.
module polydem_assemble_forces
   use polydem_bodies, only: bodies_t
   use polydem_contact_incidence, only: incidence_t
   use polydem_contacts, only: contacts_t
   use polydem_kinds, only: ip, wp, min_parallel_size
   implicit none
   private
   public :: assemble_forces

contains

   !> Sum the forces and torques of contacts over bodies, and add gravity to free bodies.
   subroutine assemble_forces(gravity, incidence, contacts, bodies)
      !> Acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      !> Contacts of each body
      type(incidence_t), intent(in) :: incidence
      !> Contacts; `force` is set
      type(contacts_t), intent(inout) :: contacts
      !> Bodies; `force` and `torque` are set
      type(bodies_t), intent(inout) :: bodies
      integer(ip) :: c, k, s
      real(wp) :: fx, fy, torque

      !$omp parallel if (bodies%n > min_parallel_size) default(none) shared(gravity, incidence, contacts, bodies) &
      !$omp    private(c, k, s, fx, fy, torque)
      !$omp do schedule(static)
      do c = 1_ip, contacts%n
         contacts%force(1, c) = contacts%normal_force(c)*contacts%direction(1, c) &
            - contacts%tangential_force(c)*contacts%direction(2, c)
         contacts%force(2, c) = contacts%normal_force(c)*contacts%direction(2, c) &
            + contacts%tangential_force(c)*contacts%direction(1, c)
      end do
      !$omp end do
      !$omp do schedule(static)
      do s = 1_ip, bodies%n
         fx = 0.0_wp
         fy = 0.0_wp
         torque = 0.0_wp
         do k = incidence%start_second(s), incidence%start_second(s + 1_ip) - 1_ip
            c = incidence%contact(k)
            fx = fx - contacts%force(1, c)
            fy = fy - contacts%force(2, c)
            torque = torque - (contacts%arm_second(1, c)*contacts%force(2, c) &
                               - contacts%arm_second(2, c)*contacts%force(1, c) &
                               + contacts%lever(c)*contacts%normal_force(c))
            if (contacts%has_twist) torque = torque - contacts%twist(c)
         end do
         do c = incidence%start_first(s), incidence%start_first(s + 1_ip) - 1_ip
            fx = fx + contacts%force(1, c)
            fy = fy + contacts%force(2, c)
            torque = torque + (contacts%arm_first(1, c)*contacts%force(2, c) &
                               - contacts%arm_first(2, c)*contacts%force(1, c) &
                               + contacts%lever(c)*contacts%normal_force(c))
            if (contacts%has_twist) torque = torque + contacts%twist(c)
         end do
         if (.not. bodies%fixed(s)) then
            fx = fx + bodies%mass(s)*gravity(1)
            fy = fy + bodies%mass(s)*gravity(2)
         end if
         bodies%force(1, s) = fx
         bodies%force(2, s) = fy
         bodies%torque(s) = torque
      end do
      !$omp end do
      !$omp end parallel
   end subroutine assemble_forces

end module polydem_assemble_forces
