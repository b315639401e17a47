!> Parts of a simulation that depend on the bodies of a rank: measures of the force law, boxes, pair list with contact
!> history, limits of the guards.
module polydem_local_data
   use polydem_bodies, only: bodies_t
   use polydem_bodies_in_cell, only: find_periods
   use polydem_box_maker, only: new_box_maker
   use polydem_contact_flags, only: flag_limits_t
   use polydem_contact_history, only: add_column, contact_history_t
   use polydem_contact_incidence, only: incidence_t
   use polydem_contacts, only: contacts_t, reserve_contacts
   use polydem_errors, only: error_t
   use polydem_force_law, only: force_law_t
   use polydem_force_sums, only: start_sums
   use polydem_guard, only: set_local_limits
   use polydem_kinds, only: ip, wp
   use polydem_neighbours, only: restart_neighbours
   use polydem_simulation, only: acts_on_all, simulation_t
   use polydem_wall, only: wall_t
   implicit none
   private
   public :: rebuild_local_data, list_moving

contains

   !> Rebuild what depends on the bodies: measures of the force law, boxes, an empty pair list with contact history,
   !> limits of the guards.
   subroutine rebuild_local_data(self, error, median_diameter)
      !> The simulation, with its bodies, walls, force law and finder
      type(simulation_t), intent(inout) :: self
      !> Allocated if the bodies or the settings are invalid
      type(error_t), allocatable, intent(inout) :: error
      !> Median diameter of all free bodies of the run [m]; default: median of the free bodies of this rank
      real(wp), intent(in), optional :: median_diameter

      call self%walls%find_slots(self%bodies)
      call self%walls%mark_removed(self%bodies)
      call find_periods(self%bodies)
      call self%law%measure(self%bodies)
      if (self%stages%number > 0_ip .or. allocated(self%actions)) &
         call self%law%scale_friction(self%stages%friction_scale)
      call fit_table(self%law, self%contacts)
      self%loop%walls%n = 0_ip
      self%loop%walls%border%n = 0_ip
      self%loop%walls%energy_is_known = self%law%energy_is_known
      call fit_table(self%law, self%loop%flagged)
      self%loop%n_contacts = 0_ip
      self%loop%passing_pair = 0_ip
      call start_sums(self%bodies%n, self%loop%force_sums)
      call self%motion%flight%start(self%forces%gravity, acts_on_all(self), self%motion%integrator, &
                                    self%bodies%n)
      self%loop%incidence = incidence_t()
      call list_moving(self%bodies, self%walls%wall, self%moving, self%n_moving)
      associate (choice => self%settings%boxes)
         call new_box_maker(self%search%maker, self%bodies, choice%largest_ratio, choice%margin, self%search%boxes, &
                            error, median_diameter, self%domain%margin)
      end associate
      if (allocated(error)) return
      call restart_neighbours(self%search%neighbours, self%search%boxes)
      call allocate_history(self%law, self%history)
      self%loop%flag_limits = flag_limits_t()
      call set_local_limits(self)
   end subroutine rebuild_local_data

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

   !> Allocate the columns of the contact history of the force law, at the places known to its parts.
   subroutine allocate_history(law, history)
      type(force_law_t), intent(in) :: law
      type(contact_history_t), intent(out) :: history
      integer :: k

      allocate (history%features(0))
      do k = 1, size(law%history_kinds)
         call add_column(history, law%history_kinds(k), 0_ip)
      end do
   end subroutine allocate_history

   !> List the slots that may move: free bodies, bodies with prescribed motion, halo bodies.
   subroutine list_moving(bodies, walls, moving, n_moving)
      type(bodies_t), intent(in) :: bodies
      !> All walls, of which motions or loads drive some
      type(wall_t), intent(in) :: walls(:)
      !> The slots, in this order
      integer(ip), allocatable, intent(out) :: moving(:)
      !> Number of slots before the halo bodies
      integer(ip), intent(out) :: n_moving
      integer :: k
      integer(ip) :: s

      moving = bodies%free
      do k = 1, size(walls)
         if (walls(k)%is_driven()) moving = [moving, walls(k)%slots]
      end do
      n_moving = size(moving, kind=ip)
      moving = [moving, pack([(s, s=1_ip, bodies%n)], bodies%in_halo)]
   end subroutine list_moving

end module polydem_local_data
