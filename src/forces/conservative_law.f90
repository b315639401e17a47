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
   use polydem_contact_element, only: contact_element_t, face_tilt_stiffness
   use polydem_contact_history, only: contact_history_t
   use polydem_contacts, only: contacts_t
   use polydem_force_part, only: acts_elastic, force_part_t
   use polydem_kinds, only: ip, wp, min_parallel_size
   use polydem_settings, only: forces_settings_t
   implicit none
   private
   public :: conservative_law_t

   !> The conservative law
   type, extends(force_part_t) :: conservative_law_t
      !> Young's modulus in two dimensions E [N/m2]
      real(wp) :: stiffness = 0.0_wp
      !> Reciprocal side 1/s of the square of each body's area, (bodies) [1/m]
      real(wp), allocatable :: inverse_size(:)
   contains
      procedure :: choose
      procedure :: measure
      procedure :: add
      procedure :: stiffen
      procedure :: static_depth
   end type conservative_law_t

   !> Greatest stiffness of a contact over that of a face of the same length
   real(wp), parameter :: steepening = 1.5_wp

contains

   !> It is the law 'conservative'.
   subroutine choose(self, settings, chosen)
      class(conservative_law_t), intent(inout) :: self
      !> Group &forces
      type(forces_settings_t), intent(in) :: settings
      !> Whether it belongs to the law
      logical, intent(out) :: chosen

      chosen = settings%law == 'conservative'
      if (.not. chosen) return
      self%name = 'conservative law'
      self%stage = acts_elastic
      self%needs_effective_area = .true.
      self%stiffness = settings%stiffness
   end subroutine choose

   !> Measure the bodies.
   subroutine measure(self, bodies)
      class(conservative_law_t), intent(inout) :: self
      !> Bodies, for their shapes
      type(bodies_t), intent(in) :: bodies
      integer(ip) :: s

      if (allocated(self%inverse_size)) deallocate (self%inverse_size)
      allocate (self%inverse_size(bodies%n))
      do s = 1_ip, bodies%n
         self%inverse_size(s) = 1.0_wp/sqrt(area_of(bodies, s))
      end do
   end subroutine measure

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
   subroutine add(self, bodies, dt, contacts, history)
      class(conservative_law_t), intent(in) :: self
      !> Bodies (not used: all that matters is in the contacts)
      type(bodies_t), intent(in) :: bodies
      !> Time since the last evaluation [s] (not used)
      real(wp), intent(in) :: dt
      !> Contacts with the effective area; `inverse_length`, `lever`, `elastic` and `normal_force` change
      type(contacts_t), intent(inout) :: contacts
      !> Memory of the pairs (not used)
      type(contact_history_t), intent(inout) :: history
      real(wp) :: p, q, force
      integer(ip) :: c

      associate (unused_bodies => bodies, unused_dt => dt, unused_memory => history)
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

   !> Add the stiffness. With K_n = E L/l, where l is l b/L here:
   !>
   !> The force steepens as L grows with the depth. The root of the effective area G is a concave function of the
   !> displacement of convex bodies: it is the least, over all linear maps of determinant 1, of a multiple of the fourth
   !> root of the polar moment of inertia, which is concave (H. Hadwiger, Comment. Math. Helv. 30 (1956) 285). So
   !> G'' <= G'^2/(2 G), and the stiffness is at most 3/2 of K_n. The law also resists tilts, like a face:
   !> K = K_n L^2/12. (No bound for rotations, but of 2600 random contacts of all kinds none had a frequency more
   !> than 8 % above.)
   !>
   !> An expected contact is a face on the longest edge of two equal bodies, where l b is the area.
   subroutine stiffen(self, bodies, contacts, element)
      class(conservative_law_t), intent(in) :: self
      !> Bodies, for the shape of one whose contact is only expected
      type(bodies_t), intent(in) :: bodies
      !> Contacts with their lengths
      type(contacts_t), intent(in) :: contacts
      !> The contact; stiffness against approach and tilts change, and its ratio if it is only expected
      type(contact_element_t), intent(inout) :: element

      if (element%contact == 0_ip) then
         element%ratio = longest_edge_over_area(bodies, element%body)
         element%normal_stiffness = element%normal_stiffness + self%stiffness*element%ratio
      else
         element%normal_stiffness = element%normal_stiffness + steepening*(self%stiffness*element%ratio)
         element%tilt_stiffness = element%tilt_stiffness &
            + steepening*face_tilt_stiffness(self%stiffness, contacts, element%contact)
      end if
   end subroutine stiffen

   !> Square of the longest edge of a body over its area
   pure real(wp) function longest_edge_over_area(bodies, s) result(ratio)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: s
      real(wp) :: dx, dy, length, distance, longest, area
      integer(ip) :: v, w

      longest = 0.0_wp
      area = 0.0_wp
      w = bodies%vertex_start(s + 1_ip) - 1_ip
      do v = bodies%vertex_start(s), bodies%vertex_start(s + 1_ip) - 1_ip
         dx = bodies%shape(1, v) - bodies%shape(1, w)
         dy = bodies%shape(2, v) - bodies%shape(2, w)
         length = sqrt(dx*dx + dy*dy)
         distance = abs(dx*bodies%shape(2, w) - dy*bodies%shape(1, w))/length
         longest = max(longest, length)
         area = area + 0.5_wp*length*distance
         w = v
      end do
      ratio = longest*longest/area
   end function longest_edge_over_area

   !> Depth at which a flat contact of width w carries a load, F l/(E w) [m]: l = 2 s1 s2 min(s1, s2)/((s1 + s2) w),
   !> where s is the side of the square of a body's area.
   real(wp) function static_depth(self, load, block, support, offset) result(depth)
      class(conservative_law_t), intent(in) :: self
      !> Normal load per unit depth of the plane [N/m]
      real(wp), intent(in) :: load
      !> Width and height of the block, (2) [m]
      real(wp), intent(in) :: block(2)
      !> Width and thickness of the support, (2) [m]
      real(wp), intent(in) :: support(2)
      !> Distance of the two centres along the contact [m] (not used)
      real(wp), intent(in) :: offset
      real(wp) :: s1, s2

      associate (unused_offset => offset)
      end associate
      s1 = sqrt(block(1)*block(2))
      s2 = sqrt(support(1)*support(2))
      depth = load/(self%stiffness*block(1))*(2.0_wp*s1*s2*min(s1, s2)/((s1 + s2)*block(1)))
   end function static_depth

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
