!> The largest stable time step, from the contacts or, if there are none yet, from the shapes of the bodies.
!>
!> Each contact is an element with the normal stiffness K_n, the tangential stiffness K_t and the mobilities G of its
!> two bodies. The mass of a body is divided among its n contacts. The greatest eigenvalue of K^(1/2) G K^(1/2) over all
!> elements is an upper bound of the squared frequencies of the whole system (element bound; similar to C. O'Sullivan &
!> J.D. Bray, Eng. Comput. 21 (2004) 278). The integration scheme has a largest stable product of frequency and step,
!> given as a function of the damping ratio.
!>
!> The parts of the force law add the stiffnesses and dashpots (`stiffen`). The stiffness against tilts is added to the
!> squared frequency of the other two.
module polydem_stable_step
   use polydem_bodies, only: bodies_t
   use polydem_contact_element, only: contact_element_t
   use polydem_contact_incidence, only: incidence_t
   use polydem_contacts, only: contacts_t
   use polydem_force_law, only: force_law_t
   use polydem_kinds, only: ip, wp, min_parallel_size
   use polydem_stability_limit, only: stability_table_t, limit_at
   implicit none
   private
   public :: contact_numbers, stable_step_of_contacts, stable_step_of_shapes

   !> Assumed number of contacts of the two equal bodies of an expected contact: four of each body
   real(wp), parameter :: assumed_contacts = 8.0_wp

contains

   !> Find the stable step of the present contacts, and the contact that limits it.
   subroutine stable_step_of_contacts(law, table, bodies, numbers, contacts, step, critical)
      type(force_law_t), intent(in) :: law
      !> Stability limit of the integration scheme
      type(stability_table_t), intent(in) :: table
      type(bodies_t), intent(in) :: bodies
      !> Number of contacts of each body, (slot)
      real(wp), intent(in) :: numbers(:)
      !> Contacts with their forces
      type(contacts_t), intent(in) :: contacts
      !> Stable step [s], huge if there are no contacts
      real(wp), intent(out) :: step
      !> Index of the contact that limits the step, 0 if there are no contacts
      integer(ip), intent(out) :: critical
      real(wp), allocatable :: steps(:)
      integer(ip) :: c

      allocate (steps(contacts%n))
      !$omp parallel do if (contacts%n > min_parallel_size) schedule(static) default(none) &
      !$omp    shared(law, table, bodies, numbers, contacts, steps) private(c)
      do c = 1_ip, contacts%n
         steps(c) = step_of_contact(law, table, bodies, numbers, contacts, c)
      end do
      !$omp end parallel do
      step = huge(step)
      critical = minloc(steps, 1, kind=ip)
      if (critical == 0_ip) return
      if (steps(critical) < step) then
         step = steps(critical)
      else
         critical = 0_ip
      end if
   end subroutine stable_step_of_contacts

   !> Find the stable step expected from the shapes of the free bodies, and the body that limits it. Each body is
   !> assumed to have contacts with equal bodies, with the greatest stiffness that its edges allow.
   subroutine stable_step_of_shapes(law, table, bodies, step, critical)
      !> Force law; `measure` is not required
      type(force_law_t), intent(in) :: law
      !> Stability limit of the integration scheme
      type(stability_table_t), intent(in) :: table
      type(bodies_t), intent(in) :: bodies
      !> Stable step [s], huge if there is no free body
      real(wp), intent(out) :: step
      !> Slot of the body that limits the step, 0 if there is no free body
      integer(ip), intent(out) :: critical
      type(contact_element_t) :: element
      real(wp) :: g(4), this
      integer(ip) :: k, s

      step = huge(step)
      critical = 0_ip
      do k = 1_ip, size(bodies%free, kind=ip)
         s = bodies%free(k)
         call describe_shape(bodies, s, element)
         g(1) = assumed_contacts*bodies%inverse_mass(s)
         g(2) = assumed_contacts*(bodies%inverse_mass(s) + element%radius_square*bodies%inverse_inertia(s))
         g(3) = 0.0_wp
         g(4) = assumed_contacts*bodies%inverse_inertia(s)
         element%normal_mass = 0.5_wp*bodies%mass(s)
         element%normal_mobility = 2.0_wp*bodies%inverse_mass(s)
         element%tangential_mass = 1.0_wp/(g(2)/assumed_contacts)
         call law%stiffen(element)
         this = step_of_element(table, element, g)
         if (this < step) then
            step = this
            critical = s
         end if
      end do
   end subroutine stable_step_of_shapes

   !> Stable step of contact c [s]
   real(wp) function step_of_contact(law, table, bodies, numbers, contacts, c)
      type(force_law_t), intent(in) :: law
      type(stability_table_t), intent(in) :: table
      type(bodies_t), intent(in) :: bodies
      real(wp), intent(in) :: numbers(:)
      type(contacts_t), intent(in) :: contacts
      integer(ip), intent(in) :: c
      type(contact_element_t) :: element
      real(wp) :: g(4), alone(4)

      g = 0.0_wp
      alone = 0.0_wp
      call add_body(contacts%first(c), contacts%arm_first(:, c))
      call add_body(contacts%second(c), contacts%arm_second(:, c))
      element%area = contacts%area(c)
      element%length = contacts%length(c)
      element%inverse_length = contacts%inverse_length(c)
      element%ratio = element%length*element%inverse_length
      element%elastic = contacts%elastic(c)
      element%repulsion = contacts%normal_force(c)
      if (contacts%has_cohesion) element%repulsion = element%repulsion - contacts%cohesion(c)
      element%normal_mobility = bodies%inverse_mass(contacts%first(c)) + bodies%inverse_mass(contacts%second(c))
      element%normal_mass = 1.0_wp/element%normal_mobility
      element%tangential_mass = 1.0_wp/alone(2)
      element%rotational_mobility = alone(4)
      call law%stiffen(element)
      step_of_contact = step_of_element(table, element, g)

   contains

      !> Add the normal, tangential, mixed and rotational mobility of one body.
      subroutine add_body(s, arm)
         integer(ip), intent(in) :: s
         real(wp), intent(in) :: arm(2)
         real(wp) :: along, across, mine(4)

         if (bodies%fixed(s)) return
         across = arm(1)*contacts%direction(2, c) - arm(2)*contacts%direction(1, c) + contacts%lever(c)
         along = arm(1)*contacts%direction(1, c) + arm(2)*contacts%direction(2, c)
         mine(1) = bodies%inverse_mass(s) + across*across*bodies%inverse_inertia(s)
         mine(2) = bodies%inverse_mass(s) + along*along*bodies%inverse_inertia(s)
         mine(3) = along*across*bodies%inverse_inertia(s)
         mine(4) = bodies%inverse_inertia(s)
         alone = alone + mine
         g = g + mine*numbers(s)
      end subroutine add_body

   end function step_of_contact

   !> Number of contacts of each body, (slot)
   pure function contact_numbers(n_bodies, incidence) result(numbers)
      !> Number of bodies
      integer(ip), intent(in) :: n_bodies
      type(incidence_t), intent(in) :: incidence
      real(wp) :: numbers(n_bodies)
      integer(ip) :: s

      do s = 1_ip, n_bodies
         numbers(s) = real(incidence%start_first(s + 1_ip) - incidence%start_first(s) &
                           + incidence%start_second(s + 1_ip) - incidence%start_second(s), wp)
      end do
   end function contact_numbers

   !> Stable step of one element [s]
   pure real(wp) function step_of_element(table, element, g)
      type(stability_table_t), intent(in) :: table
      !> Springs and dashpots
      type(contact_element_t), intent(in) :: element
      !> Mobilities: normal, tangential, mixed [m/kg], rotational [1/(kg m)]
      real(wp), intent(in) :: g(4)
      real(wp) :: a, b, tilt(2), frequency, damping

      associate (k_n => element%normal_stiffness, k_t => element%tangential_stiffness, &
                 c_n => element%normal_dashpot, c_t => element%tangential_dashpot)
         tilt = [element%tilt_stiffness, element%tilt_dashpot]*g(4)
         a = k_n*g(1)
         b = k_t*g(2)
         frequency = sqrt(0.5_wp*(a + b) + sqrt(0.25_wp*(a - b)**2 + k_n*k_t*g(3)**2))
         if (tilt(1) > 0.0_wp) frequency = sqrt(frequency**2 + tilt(1))
         damping = 0.5_wp*max(c_n*g(1), c_t*g(2), tilt(2))/frequency
         step_of_element = limit_at(table, damping)/frequency
      end associate
   end function step_of_element

   !> Start an expected contact from the shape of its body.
   pure subroutine describe_shape(bodies, s, element)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: s
      type(contact_element_t), intent(out) :: element
      real(wp) :: dx, dy, length, distance, longest, area
      integer(ip) :: v, w

      element%is_expected = .true.
      element%inertia = bodies%inertia(s)
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
         element%edge_ratio = max(element%edge_ratio, length/(2.0_wp*distance))
         element%radius_square = max(element%radius_square, bodies%shape(1, v)**2 + bodies%shape(2, v)**2)
         w = v
      end do
      element%square_ratio = longest*longest/area
      element%longest = longest
   end subroutine describe_shape

end module polydem_stable_step
