!> The largest stable time step, from the contacts or, if there are none yet, from the shapes of the bodies.
!>
!> Each contact is an element with the normal stiffness K_n, the tangential stiffness K_t and the mobilities G of its
!> two bodies. The mass of a body is divided among its n contacts. The greatest eigenvalue of K^(1/2) G K^(1/2) over all
!> elements is an upper bound of the squared frequencies of the whole system (element bound; similar to C. O'Sullivan &
!> J.D. Bray, Eng. Comput. 21 (2004) 278; another one is `polydem_stable_bodies`). The integration scheme has a largest
!> stable product of frequency and step, given as a function of the damping ratio.
!>
!> The parts of the force law add the stiffnesses and dashpots (`stiffen`). The stiffness against tilts is added to the
!> squared frequency of the other two.
!>
!> Before bodies touch, the contacts of a body are expected ones (`expected_contact`).
module polydem_stable_step
   use polydem_bodies, only: bodies_t
   use polydem_linearised_contact, only: linearised_contact_t
   use polydem_contact_incidence, only: incidence_t
   use polydem_contacts, only: contacts_t
   use polydem_expected_contact, only: expect_contact
   use polydem_force_law, only: force_law_t
   use polydem_kinds, only: ip, wp, min_parallel_size
   use polydem_present_contact, only: describe_contact
   use polydem_stability_limit, only: stability_table_t, limit_at
   implicit none
   private
   public :: contact_numbers, stable_step_of_contacts, stable_step_of_shapes, &
      stable_step_alone, stiffest_product

   !> Assumed number of contacts of the two equal bodies of an expected contact: four of each body
   real(wp), parameter :: assumed_contacts = 8.0_wp
   !> Damping ratio of an expected contact up to which damping is moderate
   real(wp), parameter :: moderate = 0.75_wp

contains

   !> Find the stable step of the present contacts, and the contact that limits it.
   subroutine stable_step_of_contacts(law, table, bodies, numbers, contacts, step, critical, wall_mobility)
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
      !> Mobility that each contact of a fixed body has because its wall is load-controlled, (slot) [m/kg]; absent: no
      !> wall is
      real(wp), intent(in), optional :: wall_mobility(:)
      real(wp), allocatable :: steps(:), extra(:)
      integer(ip) :: c

      allocate (steps(contacts%n), extra(contacts%n))
      extra = 0.0_wp
      if (present(wall_mobility)) extra = max(wall_mobility(contacts%row(:contacts%n)%first), &
                                              wall_mobility(contacts%row(:contacts%n)%second))
      !$omp parallel do if (contacts%n > min_parallel_size) schedule(static) default(none) &
      !$omp    shared(law, table, bodies, numbers, contacts, steps, extra) private(c)
      do c = 1_ip, contacts%n
         steps(c) = step_of_contact(law, table, bodies, &
                                    numbers([contacts%row(c)%first, contacts%row(c)%second]), contacts, c, extra(c))
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
   !> assumed to have contacts with equal bodies that it hits at a given speed, with the greatest stiffness that its
   !> outline allows.
   subroutine stable_step_of_shapes(law, table, bodies, speed, step, critical, depth, length, damped, wall_mobility)
      !> Force law; `measure` is not required
      type(force_law_t), intent(in) :: law
      !> Stability limit of the integration scheme
      type(stability_table_t), intent(in) :: table
      type(bodies_t), intent(in) :: bodies
      !> Speed of approach of the bodies [m/s]; 0: contacts without depth
      real(wp), intent(in) :: speed
      !> Stable step [s], huge if there is no free body
      real(wp), intent(out) :: step
      !> Slot of the body that limits the step, 0 if there is no free body
      integer(ip), intent(out) :: critical
      !> Depth of its expected contact, area over length [m]; 0 if there is no free body
      real(wp), intent(out) :: depth
      !> Length of that contact [m], and its stable step over that without dashpots
      real(wp), intent(out), optional :: length, damped
      !> Greatest mobility of a load-controlled wall [m/kg], and greatest product of mobility and length [m2/kg];
      !> absent: no wall is
      real(wp), intent(in), optional :: wall_mobility(2)
      real(wp), allocatable :: steps(:)
      real(wp) :: unused(3), found(3), extra(2)
      integer(ip) :: k, n

      n = size(bodies%free, kind=ip)
      step = huge(step)
      critical = 0_ip
      depth = 0.0_wp
      if (present(length)) length = 0.0_wp
      if (present(damped)) damped = 1.0_wp
      extra = 0.0_wp
      if (present(wall_mobility)) extra = wall_mobility
      if (n == 0_ip) return
      allocate (steps(n))
      !$omp parallel do if (n > min_parallel_size) schedule(static) default(none) &
      !$omp    shared(law, table, bodies, speed, steps, n, extra) private(k, unused)
      do k = 1_ip, n
         call find_expected_step(law, table, bodies, bodies%free(k), speed, extra, steps(k), unused)
      end do
      !$omp end parallel do
      k = minloc(steps, 1, kind=ip)
      critical = bodies%free(k)
      call find_expected_step(law, table, bodies, critical, speed, extra, step, found)
      depth = found(1)
      if (present(length)) length = found(2)
      if (present(damped)) damped = found(3)
   end subroutine stable_step_of_shapes

   !> Find the stable step of the expected contacts of a body.
   subroutine find_expected_step(law, table, bodies, s, speed, wall_mobility, step, found)
      type(force_law_t), intent(in) :: law
      type(stability_table_t), intent(in) :: table
      type(bodies_t), intent(in) :: bodies
      !> Slot of the body
      integer(ip), intent(in) :: s
      !> Speed of approach [m/s]
      real(wp), intent(in) :: speed
      !> As in `stable_step_of_shapes`; bodies of this size cover the wall
      real(wp), intent(in) :: wall_mobility(2)
      !> Stable step [s]
      real(wp), intent(out) :: step
      !> Depth and length of the contact [m], and its stable step over that without dashpots
      real(wp), intent(out) :: found(3)
      real(wp) :: step_with, found_with(3)
      integer(ip) :: materials(2), partner

      materials = 0_ip
      if (allocated(bodies%material)) materials = bodies%material(s)
      call find_step_of_pair(law, table, bodies, s, materials, speed, wall_mobility, step, found)
      if (.not. allocated(law%pairs%stiffness%factor)) return
      do partner = 0_ip, law%pairs%n_materials
         if (partner == materials(1)) cycle
         call find_step_of_pair(law, table, bodies, s, [materials(1), partner], speed, wall_mobility, step_with, &
                                 found_with)
         if (.not. step_with < step) cycle
         step = step_with
         found = found_with
      end do
   end subroutine find_expected_step

   !> Find the stable step of the expected contacts of a body with equal bodies or, if their material differs, with
   !> heavy ones. (The step of two light bodies of different materials is that of the lighter one on a heavy body.)
   subroutine find_step_of_pair(law, table, bodies, s, materials, speed, wall_mobility, step, found)
      type(force_law_t), intent(in) :: law
      type(stability_table_t), intent(in) :: table
      type(bodies_t), intent(in) :: bodies
      !> Slot of the body
      integer(ip), intent(in) :: s
      !> Its material, and that of the others
      integer(ip), intent(in) :: materials(2)
      !> Speed of approach [m/s]
      real(wp), intent(in) :: speed
      !> As in `stable_step_of_shapes`; bodies of this size cover the wall
      real(wp), intent(in) :: wall_mobility(2)
      !> Stable step [s]
      real(wp), intent(out) :: step
      !> Depth and length of the contact [m], and its stable step over that without dashpots
      real(wp), intent(out) :: found(3)
      type(linearised_contact_t) :: element
      real(wp) :: g(4), outline, across, turning, number, share, full, shared, undamped

      number = assumed_contacts
      if (materials(1) /= materials(2)) number = 0.5_wp*assumed_contacts
      call expect_contact(law, bodies, s, materials, speed, element, outline, across, turning)
      g(1) = number*bodies%inverse_mass(s) + (wall_mobility(1) + wall_mobility(2)/bodies%diameter(s))
      g(2) = number*(bodies%inverse_mass(s) + element%radius_square*bodies%inverse_inertia(s)) &
             + (wall_mobility(1) + wall_mobility(2)/bodies%diameter(s))
      g(3) = 0.0_wp
      g(4) = number*bodies%inverse_inertia(s)
      element%tangential_mass = 1.0_wp/(bodies%inverse_mass(s) + element%radius_square*bodies%inverse_inertia(s))
      call law%stiffen(element)
      ! Springs count in full, for accuracy: then an impact of two bodies takes at least ten steps. So do moderate
      ! dashpots, as many as fit on the outline. Of strong ones those count that act along one direction, and the sum
      ! of those that act against rotation: an impact leaves little of which the error might matter.
      share = min(1.0_wp, outline/(0.5_wp*assumed_contacts*element%length))
      full = with_dashpots(share, share)
      shared = with_dashpots(share*(across/outline), &
                             min(1.0_wp, turning/(0.5_wp*assumed_contacts*element%length**3)))
      element%tangential_dashpot = 0.0_wp
      undamped = with_dashpots(0.0_wp, 0.0_wp)
      step = max(full, min(shared, undamped*(limit_at(table, moderate)/limit_at(table, 0.0_wp))))
      found = [element%depth, element%length, step/undamped]

   contains

      !> Stable step with shares of the dashpots against approach and against tilts [s]
      pure real(wp) function with_dashpots(approach, tilt)
         real(wp), intent(in) :: approach, tilt
         type(linearised_contact_t) :: other

         other = element
         other%normal_dashpot = element%normal_dashpot*approach
         other%tilt_dashpot = element%tilt_dashpot*tilt
         with_dashpots = step_of_element(table, other, g)
      end function with_dashpots

   end subroutine find_step_of_pair

   !> Stable step of a contact whose bodies have no other contacts [s]
   real(wp) function stable_step_alone(law, table, bodies, contacts, c)
      type(force_law_t), intent(in) :: law
      !> Stability limit of the integration scheme
      type(stability_table_t), intent(in) :: table
      type(bodies_t), intent(in) :: bodies
      !> Contacts with their forces
      type(contacts_t), intent(in) :: contacts
      !> Index of the contact
      integer(ip), intent(in) :: c

      stable_step_alone = step_of_contact(law, table, bodies, [1.0_wp, 1.0_wp], contacts, c, 0.0_wp)
   end function stable_step_alone

   !> Stable step of contact c [s]
   real(wp) function step_of_contact(law, table, bodies, numbers, contacts, c, extra)
      type(force_law_t), intent(in) :: law
      type(stability_table_t), intent(in) :: table
      type(bodies_t), intent(in) :: bodies
      !> Numbers of contacts of its first and of its second body
      real(wp), intent(in) :: numbers(2)
      type(contacts_t), intent(in) :: contacts
      integer(ip), intent(in) :: c
      !> Mobility of a load-controlled wall [m/kg]
      real(wp), intent(in) :: extra
      type(linearised_contact_t) :: element
      real(wp) :: mobility(4, 2), lever(2, 2)

      call describe_contact(law, bodies, contacts%row(c), element, mobility, lever)
      step_of_contact = step_of_element(table, element, ([extra, extra, 0.0_wp, 0.0_wp] &
                                                         + mobility(:, 1)*numbers(1)) + mobility(:, 2)*numbers(2))
   end function step_of_contact

   !> Product of ratio L/l and mobility below which no contact, alone, has a stable step below a given one [m/kg].
   !>
   !> Frequencies follow this product, and dashpots at most the product with the root of the greatest mass. So the
   !> lightest pair and the heaviest body at a wall bound all others. Arms are at most the greatest radius R: they
   !> increase the mobility by a share of m R^2/I.
   real(wp) function stiffest_product(law, table, bodies, step) result(product)
      type(force_law_t), intent(in) :: law
      !> Stability limit of the integration scheme
      type(stability_table_t), intent(in) :: table
      type(bodies_t), intent(in) :: bodies
      !> Time step [s]
      real(wp), intent(in) :: step
      real(wp) :: mobilities(2), turning
      integer(ip) :: s

      product = huge(product)
      mobilities = [0.0_wp, huge(1.0_wp)]
      turning = 0.0_wp
      do s = 1_ip, bodies%n
         if (.not. bodies%inverse_mass(s) > 0.0_wp .or. bodies%fixed(s)) cycle
         mobilities(1) = max(mobilities(1), 2.0_wp*bodies%inverse_mass(s))
         mobilities(2) = min(mobilities(2), bodies%inverse_mass(s))
         turning = max(turning, bodies%radius(s)**2*bodies%inverse_inertia(s)*bodies%mass(s))
      end do
      if (mobilities(1) > 0.0_wp) product = min(product_at(mobilities(1)), product_at(mobilities(2)))

   contains

      !> The product at a mobility, on the safe side by 1 %
      real(wp) function product_at(mobility)
         real(wp), intent(in) :: mobility
         real(wp) :: factor
         integer :: k

         product_at = sqrt(sqrt(tiny(mobility)))*mobility
         factor = 16.0_wp
         do k = 1, 2000
            if (factor < 1.01_wp) exit
            if (is_stable(law, table, step, turning, mobility, factor*product_at/mobility)) then
               product_at = factor*product_at
            else
               factor = sqrt(factor)
            end if
         end do
      end function product_at

   end function stiffest_product

   !> Whether a step is stable for a contact of unit arms and of twice their length, of any pair of materials
   logical function is_stable(law, table, step, turning, mobility, ratio)
      type(force_law_t), intent(in) :: law
      type(stability_table_t), intent(in) :: table
      !> Time step [s]
      real(wp), intent(in) :: step
      !> Share of the rotation in the mobility, mobility [m/kg], and ratio L/l
      real(wp), intent(in) :: turning, mobility, ratio
      type(linearised_contact_t) :: element
      real(wp) :: g(4)
      integer(ip) :: i, j

      g = [mobility*(1.0_wp + turning), mobility*(1.0_wp + turning), mobility*turning, mobility*turning]
      is_stable = .true.
      do j = 0_ip, law%pairs%n_materials
         do i = 0_ip, j
            element = linearised_contact_t(materials=[i, j], ratio=ratio, length=2.0_wp, &
                                           inverse_length=0.5_wp*ratio, normal_mobility=mobility, &
                                           normal_mass=1.0_wp/mobility, rotational_mobility=turning*mobility, &
                                           tangential_mass=1.0_wp/mobility, rolling_radius=1.0_wp, &
                                           rolling_inertia=(1.0_wp + 1.0_wp/turning)/mobility)
            call law%stiffen(element)
            is_stable = is_stable .and. step_of_element(table, element, g) >= step
         end do
      end do
   end function is_stable

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
      type(linearised_contact_t), intent(in) :: element
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

end module polydem_stable_step
