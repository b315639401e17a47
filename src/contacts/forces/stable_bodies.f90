!> A stable time step that follows from the sums of springs and dashpots at each body.
!>
!> The energy k (J_1 u_1 - J_2 u_2)^2/2 of a spring between two bodies is at most k (1 + g_2/g_1) (J_1 u_1)^2/2 and the
!> same of the second body, g_1 and g_2 being their mobilities along the spring; likewise the power of a dashpot. An
!> upper bound of the squared frequencies of the whole system is the greatest eigenvalue of M^(-1) K of any body, where
!> K is the sum of k (1 + g_2/g_1) J^T J over its contacts. For one contact it is exact. Six equal contacts around a
!> body, or four, count half: their normals share the directions. The element bound (`polydem_stable_step`) counts each
!> of them in full, but it is the sharper one for a heavy body among light ones. Both hold, and the greater step may be
!> used.
module polydem_stable_bodies
   use polydem_bodies, only: bodies_t
   use polydem_contact_incidence, only: incidence_t
   use polydem_contacts, only: contacts_t
   use polydem_force_law, only: force_law_t
   use polydem_kinds, only: ip, wp, min_parallel_size
   use polydem_linearised_contact, only: linearised_contact_t
   use polydem_present_contact, only: describe_contact
   use polydem_stability_limit, only: stability_table_t, limit_at
   use polydem_stable_step, only: stable_step_alone
   implicit none
   private
   public :: stable_step_of_bodies

   !> Sums over the contacts of a body, divided by its mass and moment of inertia
   type :: body_sums_t
      !> Translations: xx, yy and xy [1/s2, 1/s]
      real(wp) :: moving(3) = 0.0_wp
      !> Translations with the rotation: x and y, and the rotation [1/s2, 1/s]
      real(wp) :: mixed(2) = 0.0_wp, turning = 0.0_wp
   end type body_sums_t

contains

   !> Find the stable step of the free bodies that this rank moves, and a contact of the body that limits it.
   subroutine stable_step_of_bodies(law, table, bodies, contacts, incidence, step, critical, wall_mobility)
      type(force_law_t), intent(in) :: law
      !> Stability limit of the integration scheme
      type(stability_table_t), intent(in) :: table
      type(bodies_t), intent(in) :: bodies
      !> Contacts with their forces
      type(contacts_t), intent(in) :: contacts
      type(incidence_t), intent(in) :: incidence
      !> Stable step [s], huge if there are no contacts
      real(wp), intent(out) :: step
      !> Index of the contact, 0 if there are no contacts
      integer(ip), intent(out) :: critical
      !> Mobility that each contact of a fixed body has because its wall is load-controlled, (slot) [m/kg]; absent: no
      !> wall is
      real(wp), intent(in), optional :: wall_mobility(:)
      real(wp), allocatable :: steps(:), extra(:)
      integer(ip) :: k, n

      n = size(bodies%free, kind=ip)
      allocate (steps(n), extra(contacts%n))
      extra = 0.0_wp
      if (present(wall_mobility)) extra = max(wall_mobility(contacts%row(:contacts%n)%first), &
                                              wall_mobility(contacts%row(:contacts%n)%second))
      !$omp parallel do if (n > min_parallel_size) schedule(static) default(none) &
      !$omp    shared(law, table, bodies, contacts, incidence, extra, steps, n) private(k)
      do k = 1_ip, n
         steps(k) = step_of_body(law, table, bodies, contacts, incidence, extra, bodies%free(k))
      end do
      !$omp end parallel do
      step = huge(step)
      critical = 0_ip
      if (n == 0_ip) return
      k = minloc(steps, 1, kind=ip)
      if (.not. steps(k) < step) return
      step = steps(k)
      critical = stiffest_of(law, table, bodies, contacts, contacts_of(incidence, bodies%free(k)))
   end subroutine stable_step_of_bodies

   !> Contacts of a body
   pure function contacts_of(incidence, s) result(list)
      type(incidence_t), intent(in) :: incidence
      !> Slot of the body
      integer(ip), intent(in) :: s
      integer(ip), allocatable :: list(:)
      integer(ip) :: c

      list = [(c, c=incidence%start_first(s), incidence%start_first(s + 1_ip) - 1_ip), &
              incidence%contact(incidence%start_second(s):incidence%start_second(s + 1_ip) - 1_ip)]
   end function contacts_of

   !> That of some contacts whose stable step is the least if its bodies have no others
   integer(ip) function stiffest_of(law, table, bodies, contacts, list) result(stiffest)
      type(force_law_t), intent(in) :: law
      type(stability_table_t), intent(in) :: table
      type(bodies_t), intent(in) :: bodies
      type(contacts_t), intent(in) :: contacts
      integer(ip), intent(in) :: list(:)
      real(wp) :: steps(size(list))
      integer :: k

      do k = 1, size(list)
         steps(k) = stable_step_alone(law, table, bodies, contacts, list(k))
      end do
      stiffest = list(minloc(steps, 1))
   end function stiffest_of

   !> Stable step of one body [s], huge if it has no contacts
   real(wp) function step_of_body(law, table, bodies, contacts, incidence, extra, s) result(step)
      type(force_law_t), intent(in) :: law
      type(stability_table_t), intent(in) :: table
      type(bodies_t), intent(in) :: bodies
      type(contacts_t), intent(in) :: contacts
      type(incidence_t), intent(in) :: incidence
      !> Mobility of the load-controlled wall of each contact [m/kg]
      real(wp), intent(in) :: extra(:)
      !> Slot of the body
      integer(ip), intent(in) :: s
      type(body_sums_t) :: springs, dashpots
      integer(ip) :: c, k
      real(wp) :: square, frequency

      step = huge(step)
      do c = incidence%start_first(s), incidence%start_first(s + 1_ip) - 1_ip
         call add(c, 1, 2)
      end do
      do k = incidence%start_second(s), incidence%start_second(s + 1_ip) - 1_ip
         call add(incidence%contact(k), 2, 1)
      end do
      square = greatest_eigenvalue(springs)
      if (.not. square > 0.0_wp) return
      frequency = sqrt(square)
      step = limit_at(table, 0.5_wp*greatest_eigenvalue(dashpots)/frequency)/frequency

   contains

      !> Add the springs and dashpots of a contact.
      subroutine add(c, this, other)
         integer(ip), intent(in) :: c
         !> 1 and 2 if the body is the first of the contact, else 2 and 1
         integer, intent(in) :: this, other
         type(linearised_contact_t) :: element
         real(wp) :: mobility(4, 2), lever(2, 2), factor(3)

         call describe_contact(law, bodies, contacts%row(c), element, mobility, lever)
         mobility(:2, other) = mobility(:2, other) + extra(c)
         factor = 1.0_wp
         where (mobility([1, 2, 4], this) > 0.0_wp) &
            factor = 1.0_wp + mobility([1, 2, 4], other)/mobility([1, 2, 4], this)
         associate (n => contacts%row(c)%direction, m => bodies%inverse_mass(s), i => bodies%inverse_inertia(s))
            call add_row(springs, factor(1)*element%normal_stiffness, n, lever(1, this), m, i)
            call add_row(dashpots, factor(1)*element%normal_dashpot, n, lever(1, this), m, i)
            call add_row(springs, factor(2)*element%tangential_stiffness, [-n(2), n(1)], lever(2, this), m, i)
            call add_row(dashpots, factor(2)*element%tangential_dashpot, [-n(2), n(1)], lever(2, this), m, i)
            springs%turning = springs%turning + factor(3)*element%tilt_stiffness*i
            dashpots%turning = dashpots%turning + factor(3)*element%tilt_dashpot*i
         end associate
      end subroutine add

   end function step_of_body

   !> Add one spring or dashpot.
   pure subroutine add_row(sums, value, direction, lever, inverse_mass, inverse_inertia)
      type(body_sums_t), intent(inout) :: sums
      !> Stiffness [N/m2] or dashpot [N s/m2]
      real(wp), intent(in) :: value
      !> Unit vector of its force, and the lever of it about the centre of the body [m]
      real(wp), intent(in) :: direction(2), lever
      !> Of the body [m/kg, 1/(kg m)]
      real(wp), intent(in) :: inverse_mass, inverse_inertia

      sums%moving = sums%moving + value*inverse_mass*[direction(1)**2, direction(2)**2, direction(1)*direction(2)]
      sums%mixed = sums%mixed + value*sqrt(inverse_mass*inverse_inertia)*lever*direction
      sums%turning = sums%turning + value*inverse_inertia*lever**2
   end subroutine add_row

   !> Greatest eigenvalue of the sums of a body; an upper bound if translations in both directions and the rotation are
   !> coupled
   pure real(wp) function greatest_eigenvalue(sums) result(greatest)
      type(body_sums_t), intent(in) :: sums
      real(wp) :: half

      half = 0.5_wp*(sums%moving(1) - sums%moving(2))
      greatest = 0.5_wp*(sums%moving(1) + sums%moving(2)) + sqrt(half**2 + sums%moving(3)**2)
      half = 0.5_wp*(greatest - sums%turning)
      greatest = 0.5_wp*(greatest + sums%turning) + sqrt(half**2 + (sums%mixed(1)**2 + sums%mixed(2)**2))
   end function greatest_eigenvalue

end module polydem_stable_bodies
