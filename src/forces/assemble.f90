!> From forces of contacts to forces and torques of bodies.
!>
!> The force of a contact acts at the centroid of the overlap, with a torque where the line of action of the normal
!> force does not run through it (`lever`), and with a torque of its own if there is one (`twist`); the second body
!> feels the opposite of all.
!>
!> Every body sums over its contacts in ascending order of the partner's identifier, whatever the number of
!> threads, so that results have the same bits. A contact table is ascending in the first body already;
!> for the second body an index is made by counting.
module polydem_assemble
   use polydem_bodies, only: bodies_t
   use polydem_contacts, only: contacts_t
   use polydem_kinds, only: ip, wp, worth_threads
   implicit none
   private
   public :: incidence_t, index_contacts, assemble_forces

   !> Which contacts a body takes part in
   type :: incidence_t
      !> Contacts start_first(s) .. start_first(s + 1) - 1 have body s as their first, (n + 1)
      integer(ip), allocatable :: start_first(:)
      !> Entries start_second(s) .. start_second(s + 1) - 1 of `contact` have body s as their second, (n + 1)
      integer(ip), allocatable :: start_second(:)
      !> Contacts ordered by their second body, then by their first
      integer(ip), allocatable :: contact(:)
   end type incidence_t

contains

   !> Find the contacts of each body.
   subroutine index_contacts(n_bodies, contacts, incidence)
      !> Number of bodies
      integer(ip), intent(in) :: n_bodies
      !> Contacts in ascending order
      type(contacts_t), intent(in) :: contacts
      !> Index; grows when it must
      type(incidence_t), intent(inout) :: incidence
      integer(ip) :: c, s

      call reserve(n_bodies, contacts%n, incidence)
      associate (start_1 => incidence%start_first, start_2 => incidence%start_second)
         start_1 = 0_ip
         start_2 = 0_ip
         do c = 1_ip, contacts%n
            start_1(contacts%first(c)) = start_1(contacts%first(c)) + 1_ip
            start_2(contacts%second(c)) = start_2(contacts%second(c)) + 1_ip
         end do
         call counts_to_ends(n_bodies, start_1)
         call counts_to_ends(n_bodies, start_2)
         do c = contacts%n, 1_ip, -1_ip
            s = contacts%second(c)
            start_1(contacts%first(c)) = start_1(contacts%first(c)) - 1_ip
            start_2(s) = start_2(s) - 1_ip
            incidence%contact(start_2(s)) = c
         end do
      end associate
   end subroutine index_contacts

   !> Turn the forces of contacts into sums over bodies, and add gravity to the free ones.
   subroutine assemble_forces(gravity, incidence, contacts, bodies)
      !> Acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      !> Index of these contacts
      type(incidence_t), intent(in) :: incidence
      !> Contacts; `force` is set
      type(contacts_t), intent(inout) :: contacts
      !> Bodies; `force` and `torque` are set
      type(bodies_t), intent(inout) :: bodies
      integer(ip) :: c, k, s
      real(wp) :: fx, fy, torque

      !$omp parallel if (bodies%n > worth_threads) default(none) shared(gravity, incidence, contacts, bodies) &
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

   subroutine reserve(n_bodies, n_contacts, incidence)
      integer(ip), intent(in) :: n_bodies, n_contacts
      type(incidence_t), intent(inout) :: incidence

      if (.not. allocated(incidence%start_first)) then
         allocate (incidence%start_first(n_bodies + 1_ip), incidence%start_second(n_bodies + 1_ip))
         allocate (incidence%contact(0))
      end if
      if (size(incidence%contact) < n_contacts) then
         deallocate (incidence%contact)
         allocate (incidence%contact(n_contacts + n_contacts/4_ip))
      end if
   end subroutine reserve

   !> Turn counts per body into one past the last place of each body.
   pure subroutine counts_to_ends(n, start)
      integer(ip), intent(in) :: n
      integer(ip), intent(inout) :: start(:)
      integer(ip) :: s, total

      total = 1_ip
      do s = 1_ip, n
         total = total + start(s)
         start(s) = total
      end do
      start(n + 1_ip) = total
   end subroutine counts_to_ends

end module polydem_assemble
