!> Elastic force from an energy of the overlap: W = E G^2/(2 l b), where G is its effective area (see `effective_area`).
!>
!> With N and M of `effective_area`, dG/dt = N . (v1 - v2) + M1 w1 - M2 w2. So the first body feels the force -w' N and
!> the torque -w' M1, the second w' N and w' M2, w' = E G/(l b): energy returns on every closed path, and momentum and
!> angular momentum balance. (The energy of a contact as a function of its volume: Y. T. Feng, Comput. Methods Appl.
!> Mech. Eng. 373 (2021). A function of the area alone gives nothing against tilts of a face, whose area stays as it is
!> while its corners stay inside; the effective area, which is ours, has the second moments besides.)
!>
!> Seen from the outline, the bodies press on each other with p(x) = w' G/4 (x - c)^T S^-1 (x - c). A face of width w
!> and depth d is a bed of springs: stiffness E w^2/(l b) against approach, w^2/12 of that against tilts as long as
!> these are small against d/w, and less when a corner comes to leave, where the force is still continuous. Corners are
!> softer, F ~ d^3. (p is least in the middle of a face: only its sum and moment are meant, not its distribution.)
!>
!> l and b belong to the pair, not to the contact: with s the side of the square of a body's area, l = 2 s1 s2/(s1 + s2)
!> and b = min(s1, s2). Two equal squares face to face have the stiffness E, a square on a large plate E/2, and two bars
!> of length a and height h E a/h side to side and E h/a end to end, as with the area law.
!>
!> Where one body is inside the other, or bars cross, G is that of the body or of the parallelogram in common: it does
!> not depend on small shifts, and such a contact has no direction and no force of that kind (crossed bars have their
!> torque). The force it gets, along the line of centres, leads out but has no energy; whoever cannot accept that sets
!> degenerate = 'stop' in &overlap.
module polydem_conservative_law
   use polydem_bodies, only: bodies_t
   use polydem_contact_history, only: contact_memory_t
   use polydem_contacts, only: contacts_t
   use polydem_force_part, only: force_part_t
   use polydem_kinds, only: ip, wp, min_parallel_size
   implicit none
   private
   public :: conservative_law_t, new_conservative_law

   !> The conservative law
   type, extends(force_part_t) :: conservative_law_t
      !> Young's modulus in two dimensions E [N/m2]
      real(wp) :: stiffness
      !> Reciprocal side 1/s of the square of each body's area, (bodies) [1/m]
      real(wp), allocatable :: inverse_size(:)
   contains
      procedure :: add
   end type conservative_law_t

contains

   !> Measure the bodies.
   subroutine new_conservative_law(stiffness, bodies, part)
      !> Young's modulus in two dimensions E [N/m2]
      real(wp), intent(in) :: stiffness
      !> Bodies, for their shapes
      type(bodies_t), intent(in) :: bodies
      !> The law
      type(conservative_law_t), intent(out) :: part
      integer(ip) :: s

      part%stiffness = stiffness
      allocate (part%inverse_size(bodies%n))
      do s = 1_ip, bodies%n
         part%inverse_size(s) = 1.0_wp/sqrt(area_of(bodies, s))
      end do
   end subroutine new_conservative_law

   !> Area of a body [m2]
   pure real(wp) function area_of(bodies, s)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: s
      integer(ip) :: v, w

      area_of = 0.0_wp
      w = bodies%vertex_start(s + 1_ip) - 1_ip
      do v = bodies%vertex_start(s), bodies%vertex_start(s + 1_ip) - 1_ip
         area_of = area_of + 0.5_wp*(bodies%shape(1, w)*bodies%shape(2, v) - bodies%shape(2, w)*bodies%shape(1, v))
         w = v
      end do
   end function area_of

   !> Add the elastic force and set its lever and the characteristic length, which is l b/L here.
   subroutine add(self, bodies, dt, contacts, memory)
      class(conservative_law_t), intent(in) :: self
      !> Bodies (not used: all that matters is in the contacts)
      type(bodies_t), intent(in) :: bodies
      !> Time since the last evaluation [s] (not used)
      real(wp), intent(in) :: dt
      !> Contacts with the effective area; `inverse_length`, `lever`, `elastic` and `normal_force` change
      type(contacts_t), intent(inout) :: contacts
      !> Memory of the pairs (not used)
      type(contact_memory_t), intent(inout) :: memory
      real(wp) :: p, q, force
      integer(ip) :: c

      associate (unused_bodies => bodies, unused_dt => dt, unused_memory => memory)
      end associate
      contacts%energy_is_quadratic = .true.
      !$omp parallel do if (contacts%n > min_parallel_size) schedule(static) default(none) &
      !$omp    shared(self, contacts) private(c, p, q, force)
      do c = 1_ip, contacts%n
         p = self%inverse_size(contacts%first(c))
         q = self%inverse_size(contacts%second(c))
         contacts%inverse_length(c) = contacts%length(c)*(0.5_wp*(p + q)*max(p, q))
         contacts%lever(c) = -moment_about_force_point(contacts, c)/contacts%length(c)
         force = self%stiffness*contacts%area(c)*contacts%inverse_length(c)
         contacts%elastic(c) = contacts%elastic(c) + force
         contacts%normal_force(c) = contacts%normal_force(c) + force
      end do
      !$omp end parallel do
   end subroutine add

   !> Moment of N about the force point [m2], from the nearer centre, from which it is rounded least
   pure real(wp) function moment_about_force_point(contacts, c) result(moment)
      type(contacts_t), intent(in) :: contacts
      integer(ip), intent(in) :: c

      associate (r => contacts%arm_first(:, c), s => contacts%arm_second(:, c), n => contacts%normal(:, c))
         if (r(1)*r(1) + r(2)*r(2) <= s(1)*s(1) + s(2)*s(2)) then
            moment = contacts%moment(1, c) - (r(1)*n(2) - r(2)*n(1))
         else
            moment = contacts%moment(2, c) - (s(1)*n(2) - s(2)*n(1))
         end if
      end associate
   end function moment_about_force_point

end module polydem_conservative_law
