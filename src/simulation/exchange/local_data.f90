!> Parts of a simulation that depend on the bodies of a rank: measures of the force law, boxes, pair list with contact
!> history, guards.
module polydem_local_data
   use polydem_bodies, only: bodies_t
   use polydem_bodies_in_cell, only: find_folds
   use polydem_box_maker, only: new_box_maker
   use polydem_communicator, only: communicator_t
   use polydem_contact_history, only: add_column, column_of, contact_history_t
   use polydem_contact_incidence, only: incidence_t
   use polydem_contacts, only: contacts_t, reserve_contacts
   use polydem_errors, only: error_t
   use polydem_force_law, only: force_law_t
   use polydem_force_sums, only: start_sums
   use polydem_motion_check, only: displacement_limit, motion_check_t, new_motion_check, shorter_step, &
      warn_share
   use polydem_global_reductions, only: reduce_to_least
   use polydem_kinds, only: ip, wp
   use polydem_neighbours, only: restart_neighbours
   use polydem_contact_flags, only: new_flag_limits
   use polydem_settings, only: guards_settings_t
   use polydem_simulation, only: acts_on_all, former_direction, simulation_t
   use polydem_stable_step, only: stiffest_product
   use polydem_wall, only: wall_t
   implicit none
   private
   public :: rebuild_local_data, limit_displacement

contains

   !> Rebuild what depends on the bodies: measures of the force law, boxes, an empty pair list with contact history,
   !> guards.
   subroutine rebuild_local_data(self, error, median_diameter)
      !> The simulation, with its bodies, walls, force law and finder
      type(simulation_t), intent(inout) :: self
      !> Allocated if the bodies or the settings are invalid
      type(error_t), allocatable, intent(inout) :: error
      !> Median diameter of all free bodies of the run [m]; default: median of the free bodies of this rank
      real(wp), intent(in), optional :: median_diameter

      call self%walls%named%find_slots(self%bodies)
      call self%walls%named%mark_gone(self%bodies)
      call find_folds(self%bodies)
      call self%law%measure(self%bodies)
      if (self%stages%number > 0_ip) call self%law%scale_friction(self%stages%friction_scale)
      call fit_table(self%law, self%contacts)
      self%loop%walls%n = 0_ip
      self%loop%walls%border%n = 0_ip
      self%loop%walls%energy_is_known = self%law%energy_is_known
      call fit_table(self%law, self%loop%flagged)
      self%loop%n_contacts = 0_ip
      self%loop%passing_pair = 0_ip
      call start_sums(self%bodies%n, self%loop%force_sums)
      call self%motion%flight%start(self%settings%forces%gravity, acts_on_all(self), self%motion%integrator, &
                                    self%bodies%n)
      self%loop%incidence = incidence_t()
      call list_moving(self%bodies, self%walls%driven, self%moving, self%n_moving)
      if (.not. allocated(self%motion%check%choice)) call new_motion_check( &
         self%motion%check, self%settings%guards, self%bodies, shorter_step(self%settings%integrate))
      associate (choice => self%settings%boxes)
         call new_box_maker(self%search%maker, self%bodies, choice%largest_ratio, choice%margin, self%search%boxes, &
                            error, median_diameter, self%domain%margin)
      end associate
      if (allocated(error)) return
      call restart_neighbours(self%search%neighbours, self%search%boxes)
      call allocate_history(self%law, self%settings%guards, self%history)
      call new_flag_limits(self%loop%flag_limits, self%settings%guards, self%bodies, &
                             column_of(self%history, 'direction'))
      if (self%settings%guards%step /= 'off') self%loop%flag_limits%soft = &
         stiffest_product(self%law, self%motion%integrator%stability(), self%bodies, self%dt/warn_share)
   end subroutine rebuild_local_data

   !> Limit the displacement of a step to that of the thinnest body of all ranks. Collective.
   subroutine limit_displacement(settings, bodies, comm, check)
      type(guards_settings_t), intent(in) :: settings
      type(bodies_t), intent(in) :: bodies
      class(communicator_t), intent(inout) :: comm
      !> The check; its limit is set
      type(motion_check_t), intent(inout) :: check
      real(wp) :: limit(1)

      limit = displacement_limit(settings, bodies)
      call reduce_to_least(comm, limit)
      check%limit = limit(1)
   end subroutine limit_displacement

   !> Empty a table of contacts, and let it measure overlaps as the law needs it.
   subroutine fit_table(law, contacts)
      type(force_law_t), intent(in) :: law
      type(contacts_t), intent(out) :: contacts

      contacts%measure = law%overlap_measure
      contacts%energy_is_known = law%energy_is_known
      contacts%has_cohesion = law%needs_cohesion
      contacts%has_couple = law%needs_couple
      call reserve_contacts(contacts, 0_ip)
   end subroutine fit_table

   !> Allocate the columns of the contact history: those of the force law, at the places known to its parts, then those
   !> of the guards.
   subroutine allocate_history(law, settings, history)
      type(force_law_t), intent(in) :: law
      type(guards_settings_t), intent(in) :: settings
      type(contact_history_t), intent(out) :: history
      integer :: k

      allocate (history%features(0))
      do k = 1, size(law%history_kinds)
         call add_column(history, law%history_kinds(k), 0_ip)
      end do
      if (settings%tunnelling /= 'off') call add_column(history, former_direction, 0_ip)
   end subroutine allocate_history

   !> List the slots that may move: free bodies, bodies with prescribed motion, halo bodies.
   subroutine list_moving(bodies, walls, moving, n_moving)
      type(bodies_t), intent(in) :: bodies
      !> Fixed bodies with prescribed motions or loads
      type(wall_t), intent(in) :: walls(:)
      integer(ip), allocatable, intent(out) :: moving(:)
      !> Number of slots before the halo bodies
      integer(ip), intent(out) :: n_moving
      integer :: k
      integer(ip) :: s

      moving = bodies%free
      do k = 1, size(walls)
         moving = [moving, walls(k)%slots]
      end do
      n_moving = size(moving, kind=ip)
      moving = [moving, pack([(s, s=1_ip, bodies%n)], bodies%in_halo)]
   end subroutine list_moving

end module polydem_local_data
