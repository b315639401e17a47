!> Relaxation of the initial state: pushes overlapping bodies apart before a run starts.
!>
!> In every sweep each contact displaces its two bodies along its direction by its depth. The displacement is shared
!> between the bodies according to inverse mass and inverse inertia, and divided by the number of contacts of each body.
!> No sweep therefore overshoots (the element bound of `stable_step`). The method is the position projection of
!> M. Mueller et al., J. Vis. Commun. Image Represent. 18 (2007) 109, but with all contacts at once (Jacobi iteration).
!> Forces and velocities are not involved, and fixed bodies do not move. The result is bitwise identical for any number
!> of threads and ranks.
module polydem_relaxation
   use polydem_bodies, only: bodies_t, turn_bodies
   use polydem_box_maker, only: update_boxes
   use polydem_communicator, only: communicator_t
   use polydem_contact_depth, only: deepest_contact, depth_share, depth_text, thinner_pieces
   use polydem_contact_history, only: contact_history_t
   use polydem_contact_incidence, only: incidence_t, index_contacts
   use polydem_contacts, only: contacts_t
   use polydem_errors, only: error_t, input_error, raise
   use polydem_find_contacts, only: find_contacts
   use polydem_global_reductions, only: reduce_to_greatest
   use polydem_halo, only: halo_t
   use polydem_kinds, only: ip, lp, wp, min_parallel_size
   use polydem_local_data, only: rebuild_local_data
   use polydem_neighbours, only: neighbours_t
   use polydem_new_neighbours, only: new_neighbours
   use polydem_source_locations, only: place_of
   use polydem_redistribution, only: have_boxes_left, redistribute
   use polydem_simulation, only: simulation_t
   use polydem_stable_step, only: contact_numbers
   use polydem_start_findings, only: relaxation_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: relax_bodies

   !> Maximum number of sweeps
   integer(ip), parameter :: most_sweeps = 10000_ip
   !> Number of sweeps within which the greatest depth must fall by a share, or the greatest displacement grow by it
   integer(ip), parameter :: most_idle_sweeps = 1000_ip
   real(wp), parameter :: least_progress = 0.05_wp

contains

   !> Push bodies apart until no contact is deeper than `remove_overlap` of &scene: first with depths of the true area,
   !> which push apart however deep an overlap is, at last with those of the law, which may be greater at corners.
   !> Collective; all ranks get the same error.
   subroutine relax_bodies(self, error)
      !> The simulation before time 0; positions and angles of free bodies change, and `relaxation` is set
      type(simulation_t), intent(inout) :: self
      !> Names a contact that is still too deep after `most_sweeps` sweeps, or when there is no progress
      type(error_t), allocatable, intent(inout) :: error
      type(neighbours_t) :: neighbours
      type(contacts_t) :: contacts
      real(wp), allocatable :: thinner(:)
      real(wp) :: greatest(1), least, before(2)
      integer(ip) :: worst
      logical :: is_idle, has_depth_of_law

      least = huge(least)
      has_depth_of_law = .false.
      self%relaxation%from = self%bodies%position
      do
         call find_overlaps(self, neighbours, contacts, error)
         call self%comm%all_reduce_error(error)
         if (allocated(error)) return
         thinner = thinner_pieces(self%bodies, contacts, neighbours%pairs%first, neighbours%pairs%second)
         worst = deepest_contact(contacts, thinner)
         greatest = 0.0_wp
         if (worst > 0_ip) greatest = depth_share(contacts, thinner, worst)
         call reduce_to_greatest(self%comm, greatest)
         associate (relaxation => self%relaxation)
            relaxation%after = greatest(1)
            if (relaxation%sweeps == 0_ip) relaxation%before = relaxation%after
            if (relaxation%after <= self%settings%scene%remove_overlap) then
               if (has_depth_of_law) exit
               has_depth_of_law = .true.
               contacts%measure = self%law%overlap_measure
               cycle
            end if
            least = min(least, relaxation%after)
            call check_progress(relaxation, self%bodies, self%comm, least, before, is_idle)
            if (is_idle .or. relaxation%sweeps == most_sweeps) then
               if (worst > 0_ip) call report_depth(self, contacts, thinner, worst, is_idle, error)
               call self%comm%all_reduce_error(error)
               return
            end if
            call push_apart(contacts, self%domain%halo, self%comm, self%bodies)
            relaxation%sweeps = relaxation%sweeps + 1_ip
         end associate
      end do
      self%relaxation%move = greatest_displacement(self%bodies, self%relaxation%from, self%comm)
      deallocate (self%relaxation%from)
      ! Images of boxes are chosen for the boxes of the last redistribution.
      if (self%bodies%cell%is_periodic) call self%domain%forget_halo()
      call rebuild_local_data(self, error, self%domain%median_diameter)
   end subroutine relax_bodies

   !> Greatest displacement of a body since the start of the relaxation [m]. Collective.
   real(wp) function greatest_displacement(bodies, from, comm)
      type(bodies_t), intent(in) :: bodies
      !> Positions at the start, (2, slot) [m]
      real(wp), intent(in) :: from(:, :)
      class(communicator_t), intent(inout) :: comm
      real(wp) :: greatest(1)

      greatest = 0.0_wp
      if (bodies%n > 0_ip) greatest = sqrt(maxval((bodies%position(1, :) - from(1, :))**2 &
                                                  + (bodies%position(2, :) - from(2, :))**2,.not. bodies%in_halo))
      call reduce_to_greatest(comm, greatest)
      greatest_displacement = greatest(1)
   end function greatest_displacement

   !> Find out every `most_idle_sweeps` sweeps whether they brought no progress. A pile that spreads from its ends moves
   !> on long before its deepest contact does. Collective.
   subroutine check_progress(relaxation, bodies, comm, least, before, is_idle)
      type(relaxation_t), intent(in) :: relaxation
      type(bodies_t), intent(in) :: bodies
      class(communicator_t), intent(inout) :: comm
      !> Least of the greatest depths after each sweep
      real(wp), intent(in) :: least
      !> This depth, and the greatest displacement, at the last check
      real(wp), intent(inout) :: before(2)
      logical, intent(out) :: is_idle
      real(wp) :: move

      is_idle = .false.
      if (modulo(relaxation%sweeps, most_idle_sweeps) /= 0_ip) return
      move = greatest_displacement(bodies, relaxation%from, comm)
      if (relaxation%sweeps > 0_ip) is_idle = least > (1.0_wp - least_progress)*before(1) .and. &
         move < (1.0_wp + least_progress)*before(2)
      before = [least, move]
   end subroutine check_progress

   !> Find the contacts of the bodies at their present positions. Collective.
   subroutine find_overlaps(self, neighbours, contacts, error)
      type(simulation_t), intent(inout) :: self
      !> Pairs, found with a finder of their own; that of the simulation starts at time 0
      type(neighbours_t), intent(inout) :: neighbours
      type(contacts_t), intent(inout) :: contacts
      type(error_t), allocatable, intent(inout) :: error
      type(contact_history_t) :: no_history
      integer(lp) :: redistributions

      call self%domain%halo%follow(self%comm, self%bodies)
      call turn_bodies(self%bodies, self%moving)
      call update_boxes(self%search%maker, self%bodies, self%moving, self%search%boxes)
      redistributions = self%domain%redistributions
      call redistribute(self, have_boxes_left(self), error)
      if (allocated(error)) return
      ! The history of a redistribution is empty here.
      if (allocated(self%received_history)) deallocate (self%received_history)
      ! Other bodies have other boxes.
      associate (settings => self%settings%neighbours)
         if (.not. allocated(neighbours%finder) .or. self%domain%redistributions > redistributions) &
            call new_neighbours(neighbours, settings%finder, self%search%boxes, error, settings%skin, self%bodies%isa)
      end associate
      if (allocated(error)) return
      call neighbours%update(self%search%boxes)
      associate (pairs => neighbours%pairs)
         call find_contacts(self%bodies, pairs%n, pairs%first, pairs%second, no_history, contacts)
      end associate
   end subroutine find_overlaps

   !> Report the deepest contact of all ranks. Two ranks may have it.
   subroutine report_depth(self, contacts, thinner, worst, is_idle, error)
      type(simulation_t), intent(in) :: self
      type(contacts_t), intent(in) :: contacts
      !> Thickness of the thinner piece of each contact [m]
      real(wp), intent(in) :: thinner(:)
      integer(ip), intent(in) :: worst
      !> Whether the last sweeps brought no progress
      logical, intent(in) :: is_idle
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: idle

      if (depth_share(contacts, thinner, worst) < self%relaxation%after) return
      idle = ''
      if (is_idle) idle = ', the last '//to_text(most_idle_sweeps)//' without progress,'
      call raise(error, input_error, place_of(self%settings, 'scene', 'remove_overlap')//': after '// &
                 to_text(self%relaxation%sweeps)//' sweeps'//idle//' '// &
                 depth_text(self%bodies, contacts, thinner, worst)// &
                 '. Provide more space for the bodies, or increase remove_overlap in &scene')
   end subroutine report_depth

   !> One sweep: compute the impulses of all contacts, then move all free bodies. Collective.
   subroutine push_apart(contacts, halo, comm, bodies)
      type(contacts_t), intent(in) :: contacts
      type(halo_t), intent(inout) :: halo
      class(communicator_t), intent(inout) :: comm
      type(bodies_t), intent(inout) :: bodies
      type(incidence_t) :: incidence
      !> Impulse of each contact, with displacements in place of velocities, (contact) [kg]
      real(wp), allocatable :: impulse(:)
      !> Number of contacts of each body, (slot)
      real(wp), allocatable :: numbers(:)

      call index_contacts(bodies%n, contacts, incidence)
      numbers = contact_numbers(bodies%n, incidence)
      call halo%exchange_column(comm, numbers)
      call find_impulses(contacts, numbers, bodies, impulse)
      call move_free(contacts, incidence, impulse, bodies)
   end subroutine push_apart

   !> Compute the impulses of all contacts.
   subroutine find_impulses(contacts, numbers, bodies, impulse)
      type(contacts_t), intent(in) :: contacts
      real(wp), intent(in) :: numbers(:)
      type(bodies_t), intent(in) :: bodies
      real(wp), allocatable, intent(out) :: impulse(:)
      real(wp) :: mobility
      integer(ip) :: c

      allocate (impulse(contacts%n))
      !$omp parallel do if (contacts%n > min_parallel_size) schedule(static) default(none) &
      !$omp    shared(contacts, numbers, bodies, impulse) private(c, mobility)
      do c = 1_ip, contacts%n
         associate (direction => contacts%row(c)%direction)
            mobility = mobility_of(contacts%row(c)%first, contacts%row(c)%arm_first, direction, numbers, bodies) &
               + mobility_of(contacts%row(c)%second, contacts%row(c)%arm_second, direction, numbers, bodies)
         end associate
         impulse(c) = contacts%row(c)%depth/mobility
      end do
      !$omp end parallel do
   end subroutine find_impulses

   !> Displacement of a point of a body along a direction per unit impulse, times the number of contacts of the body
   !> [m/kg]
   pure real(wp) function mobility_of(s, arm, direction, numbers, bodies)
      integer(ip), intent(in) :: s
      real(wp), intent(in) :: arm(2), direction(2)
      !> Number of contacts of each body, (slot)
      real(wp), intent(in) :: numbers(:)
      type(bodies_t), intent(in) :: bodies

      mobility_of = 0.0_wp
      if (bodies%fixed(s)) return
      mobility_of = numbers(s)*(bodies%inverse_mass(s) + lever(arm, direction)**2*bodies%inverse_inertia(s))
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
            shift = shift - impulse(c)*contacts%row(c)%direction
            turn = turn - impulse(c)*lever(contacts%row(c)%arm_second, contacts%row(c)%direction)
         end do
         do c = incidence%start_first(s), incidence%start_first(s + 1_ip) - 1_ip
            shift = shift + impulse(c)*contacts%row(c)%direction
            turn = turn + impulse(c)*lever(contacts%row(c)%arm_first, contacts%row(c)%direction)
         end do
         bodies%position(:, s) = bodies%position(:, s) + shift*bodies%inverse_mass(s)
         bodies%angle(s) = bodies%angle(s) + turn*bodies%inverse_inertia(s)
      end do
      !$omp end parallel do
   end subroutine move_free

end module polydem_relaxation
