!> The largest stable time step, from actual contacts or, before there are any, from the shapes of the bodies.
!>
!> Each contact is an element of its own: with the normal stiffness K_n, the tangential stiffness K_t and the
!> mobilities G of its two bodies, each mass shared among the n contacts that it carries, the greatest
!> eigenvalue of K^(1/2) G K^(1/2) is an upper bound of the square of the frequencies of the whole (element
!> bound; in the spirit of C. O'Sullivan & J.D. Bray, Eng. Comput. 21 (2004) 278). The integrator says which
!> product of frequency and step it stands, as a function of the damping ratio.
!>
!> K_n = E L/l, where l is that of the area law or l b/L (see `conservative_law`). The force of the latter steepens as
!> L grows with the depth. The root of the effective area G is a concave function of the displacement of convex bodies:
!> it is the least, over all linear maps of determinant 1, of a multiple of the fourth root of the polar moment of
!> inertia, which is concave (H. Hadwiger, Comment. Math. Helv. 30 (1956) 285). So G'' <= G'^2/(2 G), and the stiffness
!> is at most 3/2 of that value. That law also resists tilts, like a face: K = K_n L^2/12. (No bound for rotations, but
!> of 2600 random contacts of all kinds none had a frequency more than 8 % above.)
module polydem_stable_step
   use polydem_bodies, only: bodies_t
   use polydem_contact_incidence, only: incidence_t
   use polydem_contacts, only: contacts_t
   use polydem_kinds, only: ip, wp
   use polydem_restitution_damping, only: damping_ratio_of
   use polydem_settings, only: forces_settings_t
   use polydem_stability_limit, only: stability_table_t, limit_at
   use polydem_tilt_damping, only: tilt_stiffness
   implicit none
   private
   public :: contact_numbers, stable_step_of_contacts, stable_step_of_shapes

   !> Contacts per pair of bodies assumed before there are any: two equal bodies with four each
   real(wp), parameter :: assumed_contacts = 8.0_wp
   !> Greatest stiffness of a contact of the conservative law over that of a face of the same length
   real(wp), parameter :: steepening = 1.5_wp

contains

   !> Stable step of the contacts as they are [s], huge if there are none, and the contact that sets it.
   subroutine stable_step_of_contacts(settings, table, bodies, numbers, contacts, step, critical)
      !> Group &forces
      type(forces_settings_t), intent(in) :: settings
      !> What the integrator stands
      type(stability_table_t), intent(in) :: table
      !> Bodies
      type(bodies_t), intent(in) :: bodies
      !> Contacts that each body carries, (slot)
      real(wp), intent(in) :: numbers(:)
      !> Contacts with their forces
      type(contacts_t), intent(in) :: contacts
      !> Stable step [s]
      real(wp), intent(out) :: step
      !> The contact that sets it, 0 if there is none
      integer(ip), intent(out) :: critical
      real(wp) :: damping_ratio, this
      integer(ip) :: c

      step = huge(step)
      critical = 0_ip
      damping_ratio = damping_ratio_asked_for(settings)
      do c = 1_ip, contacts%n
         this = step_of_contact(settings, damping_ratio, table, bodies, numbers, contacts, c)
         if (this < step) then
            step = this
            critical = c
         end if
      end do
   end subroutine stable_step_of_contacts

   !> Stable step expected from the shapes of the free bodies [s], and the body that sets it.
   !>
   !> A face contact on the longest edge: l is twice its distance from the centre, or the area over the edge.
   subroutine stable_step_of_shapes(settings, table, bodies, step, critical)
      !> Group &forces
      type(forces_settings_t), intent(in) :: settings
      !> What the integrator stands
      type(stability_table_t), intent(in) :: table
      !> Bodies
      type(bodies_t), intent(in) :: bodies
      !> Stable step [s], huge if there is no free body
      real(wp), intent(out) :: step
      !> Slot of the body that sets it, 0 if there is none
      integer(ip), intent(out) :: critical
      real(wp) :: damping_ratio, ratio, square, g_nn, g_tt, g_rr, k_n, c_n, tilt(2), this
      integer(ip) :: k, s

      step = huge(step)
      critical = 0_ip
      damping_ratio = damping_ratio_asked_for(settings)
      do k = 1_ip, size(bodies%free, kind=ip)
         s = bodies%free(k)
         call shape_of_body(settings%law, bodies, s, ratio, square)
         g_nn = assumed_contacts*bodies%inverse_mass(s)
         g_tt = assumed_contacts*(bodies%inverse_mass(s) + square*bodies%inverse_inertia(s))
         k_n = settings%stiffness*ratio
         c_n = dashpot(settings, damping_ratio, ratio, 0.5_wp*bodies%mass(s))
         ! No edge is longer than two greatest radii; one of the two bodies against which it tilts may be fixed.
         g_rr = assumed_contacts*bodies%inverse_inertia(s)
         tilt = [0.0_wp, settings%tilt_damping*sqrt(k_n*square/3.0_wp*bodies%inertia(s))*g_rr]
         this = step_of_element(settings, table, k_n, c_n, [g_nn, g_tt, 0.0_wp], 1.0_wp/(g_tt/assumed_contacts), tilt)
         if (this < step) then
            step = this
            critical = s
         end if
      end do
   end subroutine stable_step_of_shapes

   real(wp) function step_of_contact(settings, damping_ratio, table, bodies, numbers, contacts, c)
      type(forces_settings_t), intent(in) :: settings
      !> Damping ratio of all contacts, if a restitution is given
      real(wp), intent(in) :: damping_ratio
      type(stability_table_t), intent(in) :: table
      type(bodies_t), intent(in) :: bodies
      real(wp), intent(in) :: numbers(:)
      type(contacts_t), intent(in) :: contacts
      integer(ip), intent(in) :: c
      real(wp) :: g(4), alone(4), mobility, ratio, k_n, c_n, tilt(2)

      g = 0.0_wp
      alone = 0.0_wp
      call add_body(contacts%first(c), contacts%arm_first(:, c))
      call add_body(contacts%second(c), contacts%arm_second(:, c))
      mobility = bodies%inverse_mass(contacts%first(c)) + bodies%inverse_mass(contacts%second(c))
      ratio = contacts%length(c)*contacts%inverse_length(c)
      k_n = settings%stiffness*ratio
      tilt = 0.0_wp
      tilt(2) = settings%tilt_damping*sqrt(tilt_stiffness(settings%stiffness, contacts, c)/alone(4))*g(4)
      if (settings%law == 'conservative') then
         k_n = steepening*k_n
         tilt(1) = steepening*tilt_stiffness(settings%stiffness, contacts, c)*g(4)
      end if
      c_n = dashpot(settings, damping_ratio, ratio, 1.0_wp/mobility)
      if (settings%damping == 'hunt_crossley') then
         ! Both the stiffness and the dashpot follow the force of the moment.
         if (contacts%normal_force(c) > contacts%elastic(c)) k_n = k_n*(contacts%normal_force(c)/contacts%elastic(c))
         c_n = settings%damping_coefficient*sqrt(1.0_wp/(mobility*settings%stiffness))*contacts%elastic(c)*ratio &
            /max(contacts%length(c), sqrt(contacts%area(c)))
      end if
      step_of_contact = step_of_element(settings, table, k_n, c_n, g(1:3), 1.0_wp/alone(2), tilt)

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

   !> Contacts that each body carries, (slot)
   pure function contact_numbers(n_bodies, incidence) result(numbers)
      !> Number of bodies
      integer(ip), intent(in) :: n_bodies
      !> Index of the contacts
      type(incidence_t), intent(in) :: incidence
      real(wp) :: numbers(n_bodies)
      integer(ip) :: s

      do s = 1_ip, n_bodies
         numbers(s) = real(incidence%start_first(s + 1_ip) - incidence%start_first(s) &
                           + incidence%start_second(s + 1_ip) - incidence%start_second(s), wp)
      end do
   end function contact_numbers

   !> Stable step of one element [s].
   pure real(wp) function step_of_element(settings, table, k_n, c_n, g, mass_tangential, tilt)
      type(forces_settings_t), intent(in) :: settings
      type(stability_table_t), intent(in) :: table
      !> Normal stiffness [N/m2] and dashpot [N s/m2]
      real(wp), intent(in) :: k_n, c_n
      !> Mobilities: normal, tangential, mixed [m/kg]
      real(wp), intent(in) :: g(3)
      !> Effective mass of the tangential damping [kg/m]
      real(wp), intent(in) :: mass_tangential
      !> Stiffness [1/s2] and dashpot [1/s] against tilts, times the rotational mobility
      real(wp), intent(in) :: tilt(2)
      real(wp) :: k_t, c_t, a, b, frequency, damping

      k_t = 0.0_wp
      c_t = 0.0_wp
      if (settings%friction == 'cundall_strack') then
         k_t = settings%tangential_stiffness*settings%stiffness
         c_t = settings%tangential_damping*sqrt(mass_tangential*k_t)
      end if
      a = k_n*g(1)
      b = k_t*g(2)
      frequency = sqrt(0.5_wp*(a + b) + sqrt(0.25_wp*(a - b)**2 + k_n*k_t*g(3)**2))
      if (tilt(1) > 0.0_wp) frequency = sqrt(frequency**2 + tilt(1))
      damping = 0.5_wp*max(c_n*g(1), c_t*g(2), tilt(2))/frequency
      step_of_element = limit_at(table, damping)/frequency
   end function step_of_element

   !> Damping ratio of a given restitution, 0 if there is none
   pure real(wp) function damping_ratio_asked_for(settings) result(damping_ratio)
      type(forces_settings_t), intent(in) :: settings

      damping_ratio = 0.0_wp
      if (settings%restitution > 0.0_wp) damping_ratio = damping_ratio_of(settings%restitution)
   end function damping_ratio_asked_for

   !> Normal damping of a contact per unit of velocity [N s/m2], as far as its force does not matter
   pure real(wp) function dashpot(settings, damping_ratio, ratio, mass)
      type(forces_settings_t), intent(in) :: settings
      !> Damping ratio, if a restitution is given
      real(wp), intent(in) :: damping_ratio
      !> L/l of the contact
      real(wp), intent(in) :: ratio
      !> Effective mass [kg/m]
      real(wp), intent(in) :: mass

      if (settings%damping == 'none' .or. settings%damping == 'hunt_crossley') then
         dashpot = 0.0_wp
      else if (settings%restitution > 0.0_wp) then
         dashpot = 2.0_wp*damping_ratio*sqrt(mass*settings%stiffness)*sqrt(ratio)
      else
         dashpot = settings%damping_coefficient*sqrt(mass*settings%stiffness)*ratio
      end if
   end function dashpot

   !> Greatest ratio L/l of an edge to the length of the law, and the square of the greatest radius.
   pure subroutine shape_of_body(law, bodies, s, ratio, square)
      character(len=*), intent(in) :: law
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: s
      real(wp), intent(out) :: ratio, square
      real(wp) :: dx, dy, length, distance, longest, area
      integer(ip) :: first, last, v, w

      first = bodies%vertex_start(s)
      last = bodies%vertex_start(s + 1_ip) - 1_ip
      ratio = 0.0_wp
      square = 0.0_wp
      longest = 0.0_wp
      area = 0.0_wp
      w = last
      do v = first, last
         dx = bodies%shape(1, v) - bodies%shape(1, w)
         dy = bodies%shape(2, v) - bodies%shape(2, w)
         length = sqrt(dx*dx + dy*dy)
         distance = abs(dx*bodies%shape(2, w) - dy*bodies%shape(1, w))/length
         ratio = max(ratio, length/(2.0_wp*distance))
         longest = max(longest, length)
         area = area + 0.5_wp*length*distance
         square = max(square, bodies%shape(1, v)**2 + bodies%shape(2, v)**2)
         w = v
      end do
      if (law == 'conservative') ratio = longest*longest/area
   end subroutine shape_of_body

end module polydem_stable_step
