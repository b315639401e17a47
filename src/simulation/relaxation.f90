!> Relaxation of the initial state: pushes overlapping bodies apart before a run starts.
!>
!> In every sweep each contact displaces its two bodies along its direction by its depth. The displacement is shared
!> between the bodies according to inverse mass and inverse inertia, and divided by the number of contacts of each body.
!> No sweep therefore overshoots (the element bound of `stable_step`). The method is the position projection of
!> M. Mueller et al., J. Vis. Commun. Image Represent. 18 (2007) 109, but with all contacts at once (Jacobi iteration).
!> Forces and velocities are not involved, and fixed bodies do not move. The result is bitwise identical for any number
!> of threads.
module polydem_relaxation
   use polydem_bodies, only: bodies_t, turn_bodies
   use polydem_body_sizes, only: thickness_of_bodies
   use polydem_box_maker, only: box_maker_t, new_box_maker, update_boxes
   use polydem_boxes, only: boxes_t
   use polydem_contact_depth, only: deepest_contact, depth_share, depth_text
   use polydem_contact_history, only: contact_history_t
   use polydem_contact_incidence, only: incidence_t, index_contacts
   use polydem_contacts, only: contacts_t
   use polydem_errors, only: error_t, input_error, raise
   use polydem_find_contacts, only: find_contacts
   use polydem_instruction_set, only: isa_base
   use polydem_kinds, only: ip, wp, min_parallel_size
   use polydem_neighbours, only: neighbours_t, new_neighbours
   use polydem_settings, only: settings_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: relaxation_t, relax_bodies

   !> Summary of a relaxation
   type :: relaxation_t
      !> Number of sweeps, 0 if no relaxation was necessary
      integer(ip) :: sweeps = 0_ip
      !> Depth of the deepest contact before and after, as a fraction of the thickness of the thinner body
      real(wp) :: before = 0.0_wp, after = 0.0_wp
      !> Greatest displacement of the centre of a body [m]
      real(wp) :: move = 0.0_wp
   end type relaxation_t

   !> Maximum number of sweeps
   integer(ip), parameter :: most_sweeps = 10000_ip

contains

   !> Push bodies apart until no contact is deeper than `relaxed_depth` of &guards.
   subroutine relax_bodies(settings, bodies, relaxation, error)
      !> Settings; the groups &boxes, &neighbours and &guards are used
      type(settings_t), intent(in) :: settings
      !> Bodies; position and angle of the free ones change
      type(bodies_t), intent(inout) :: bodies
      !> Summary of the relaxation
      type(relaxation_t), intent(out) :: relaxation
      !> Names a contact that is still too deep after `most_sweeps` sweeps
      type(error_t), allocatable, intent(inout) :: error
      type(box_maker_t) :: maker
      type(boxes_t) :: boxes
      type(neighbours_t) :: neighbours
      type(contacts_t) :: contacts
      type(contact_history_t) :: no_memory
      type(incidence_t) :: incidence
      real(wp), allocatable :: thickness(:), start(:, :)
      integer(ip) :: worst

      call new_box_maker(maker, bodies, settings%boxes%largest_ratio, settings%boxes%margin, boxes, error)
      if (allocated(error)) return
      call new_neighbours(neighbours, settings%neighbours%finder, boxes, error, settings%neighbours%skin)
      if (allocated(error)) return
      thickness = thickness_of_bodies(bodies)
      start = bodies%position
      do
         call update_boxes(maker, bodies, bodies%free, boxes)
         call neighbours%update(boxes)
         call find_contacts(bodies, neighbours%pairs%n, neighbours%pairs%first, neighbours%pairs%second, no_memory, &
                            contacts)
         worst = deepest_contact(contacts, thickness)
         relaxation%after = 0.0_wp
         if (worst > 0_ip) relaxation%after = depth_share(contacts, thickness, worst)
         if (relaxation%sweeps == 0_ip) relaxation%before = relaxation%after
         if (relaxation%after <= settings%guards%relaxed_depth) exit
         if (relaxation%sweeps == most_sweeps) then
            call raise(error, input_error, settings%file//': after '//to_text(most_sweeps)//' sweeps '// &
                       depth_text(bodies, contacts, thickness, worst)//'. Provide more space for the bodies, or '// &
                       'increase relaxed_depth in &guards')
            return
         end if
         call index_contacts(bodies%n, contacts, incidence)
         call push_apart(contacts, incidence, bodies)
         relaxation%sweeps = relaxation%sweeps + 1_ip
      end do
      relaxation%move = sqrt(maxval((bodies%position(1, :) - start(1, :))**2 &
                                    + (bodies%position(2, :) - start(2, :))**2))
   end subroutine relax_bodies

   !> One sweep: compute the impulses of all contacts, then move all free bodies.
   subroutine push_apart(contacts, incidence, bodies)
      type(contacts_t), intent(in) :: contacts
      type(incidence_t), intent(in) :: incidence
      type(bodies_t), intent(inout) :: bodies
      !> Impulse of each contact, with displacements in place of velocities, (contact) [kg]
      real(wp), allocatable :: impulse(:)
      real(wp) :: mobility
      integer(ip) :: c

      allocate (impulse(contacts%n))
      !$omp parallel do if (contacts%n > min_parallel_size) schedule(static) default(none) &
      !$omp    shared(contacts, incidence, bodies, impulse) private(c, mobility)
      do c = 1_ip, contacts%n
         associate (direction => contacts%direction(:, c))
            mobility = mobility_of(contacts%first(c), contacts%arm_first(:, c), direction, incidence, bodies) &
               + mobility_of(contacts%second(c), contacts%arm_second(:, c), direction, incidence, bodies)
         end associate
         impulse(c) = contacts%area(c)/(contacts%length(c)*mobility)
      end do
      !$omp end parallel do
      call move_free(contacts, incidence, impulse, bodies)
      call turn_bodies(bodies, bodies%free, isa_base)
   end subroutine push_apart

   !> Displacement of a point of a body along a direction per unit impulse, times the number of contacts of the body
   !> [m/kg]
   pure real(wp) function mobility_of(s, arm, direction, incidence, bodies)
      integer(ip), intent(in) :: s
      real(wp), intent(in) :: arm(2), direction(2)
      type(incidence_t), intent(in) :: incidence
      type(bodies_t), intent(in) :: bodies
      integer(ip) :: n

      mobility_of = 0.0_wp
      if (bodies%fixed(s)) return
      n = incidence%start_first(s + 1_ip) - incidence%start_first(s) &
         + incidence%start_second(s + 1_ip) - incidence%start_second(s)
      mobility_of = real(n, wp)*(bodies%inverse_mass(s) + lever(arm, direction)**2*bodies%inverse_inertia(s))
   end function mobility_of

   !> Lever arm of a unit vector at a point, the cross product of both [m]
   pure real(wp) function lever(arm, direction)
      real(wp), intent(in) :: arm(2), direction(2)

      lever = arm(1)*direction(2) - arm(2)*direction(1)
   end function lever

   !> Translate and rotate every free body by the sum of the impulses of its contacts, in the order of the partners.
   subroutine move_free(contacts, incidence, impulse, bodies)
      type(contacts_t), intent(in) :: contacts
      type(incidence_t), intent(in) :: incidence
      real(wp), intent(in) :: impulse(:)
      type(bodies_t), intent(inout) :: bodies
      real(wp) :: shift(2), turn
      integer(ip) :: c, k, m, s

      !$omp parallel do if (bodies%n > min_parallel_size) schedule(static) default(none) &
      !$omp    shared(contacts, incidence, impulse, bodies) private(c, k, m, s, shift, turn)
      do k = 1_ip, size(bodies%free, kind=ip)
         s = bodies%free(k)
         shift = 0.0_wp
         turn = 0.0_wp
         do m = incidence%start_second(s), incidence%start_second(s + 1_ip) - 1_ip
            c = incidence%contact(m)
            shift = shift - impulse(c)*contacts%direction(:, c)
            turn = turn - impulse(c)*lever(contacts%arm_second(:, c), contacts%direction(:, c))
         end do
         do c = incidence%start_first(s), incidence%start_first(s + 1_ip) - 1_ip
            shift = shift + impulse(c)*contacts%direction(:, c)
            turn = turn + impulse(c)*lever(contacts%arm_first(:, c), contacts%direction(:, c))
         end do
         bodies%position(:, s) = bodies%position(:, s) + shift*bodies%inverse_mass(s)
         bodies%angle(s) = bodies%angle(s) + turn*bodies%inverse_inertia(s)
      end do
      !$omp end parallel do
   end subroutine move_free

end module polydem_relaxation
