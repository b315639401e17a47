!> A simulation: all that a run consists of, and what must be made anew when the bodies of a process become others.
module polydem_simulation_parts
   use polydem_assemble, only: incidence_t
   use polydem_bodies, only: bodies_t
   use polydem_boxes, only: boxes_t
   use polydem_contacts, only: at_direction, contact_memory_t, contacts_t
   use polydem_domain, only: domain_t
   use polydem_errors, only: error_t
   use polydem_force_law, only: force_law_t, new_force_law
   use polydem_guards, only: motion_guard_t, new_motion_guard
   use polydem_integrator, only: integrator_t
   use polydem_kinds, only: ip, lp, wp
   use polydem_ledger, only: ledger_t
   use polydem_make_boxes, only: box_maker_t, new_box_maker
   use polydem_motion, only: motion_t
   use polydem_neighbours, only: neighbours_t, new_neighbours
   use polydem_pair_freight, only: pair_freight_t
   use polydem_relax, only: relaxation_t
   use polydem_settings, only: settings_t
   use polydem_team, only: team_t
   use polydem_timers, only: timers_t
   use polydem_work, only: work_t
   implicit none
   private
   public :: simulation_t, fit_to_bodies

   !> Everything that a run consists of
   type :: simulation_t
      !> Settings of the run
      type(settings_t) :: settings
      !> Processes that share the bodies
      class(team_t), allocatable :: team
      !> The part of space that this process looks after
      type(domain_t) :: domain
      !> How often the bodies that are here became others
      integer(ip) :: generation = 0_ip
      !> Bodies
      type(bodies_t) :: bodies
      !> Prescribed motions of fixed bodies
      type(motion_t), allocatable :: motions(:)
      !> How the boxes are made
      type(box_maker_t) :: maker
      !> Bounding boxes
      type(boxes_t) :: boxes
      !> Pairs of bodies whose boxes overlap
      type(neighbours_t) :: neighbours
      !> Contacts of the last step
      type(contacts_t) :: contacts
      !> What is remembered of the pairs
      type(contact_memory_t) :: memory
      !> What is remembered of pairs that are to be found anew; unallocated between steps
      type(pair_freight_t), allocatable :: arrived
      !> Contacts of each body
      type(incidence_t) :: incidence
      !> Force law
      type(force_law_t) :: law
      !> Integrator
      class(integrator_t), allocatable :: integrator
      !> Books of energy and momentum
      type(ledger_t) :: ledger
      !> Seconds per stage
      type(timers_t) :: timers
      !> Steps done
      integer(lp) :: step = 0_lp
      !> Steps to do
      integer(lp) :: n_steps = 0_lp
      !> Time step [s]
      real(wp) :: dt = 0.0_wp
      !> Stable step expected from the shapes [s]
      real(wp) :: expected_stable_step = 0.0_wp
      !> Watches how far bodies move
      type(motion_guard_t) :: guard
      !> How bodies were pushed apart before time 0
      type(relaxation_t) :: relaxation
      !> Slots that may move: free bodies, then those of motions, then ghosts
      integer(ip), allocatable :: moving(:)
      !> Sums over all steps: pairs, contacts, pairs that began, pairs that ended, degenerate contacts
      integer(lp) :: sums(5) = 0_lp
   end type simulation_t

contains

   !> Make what depends on which bodies there are: law, boxes, an empty list of pairs with its memory, guards.
   subroutine fit_to_bodies(self, error, grain)
      !> The simulation with new bodies and motions
      type(simulation_t), intent(inout) :: self
      !> Bad input
      type(error_t), allocatable, intent(inout) :: error
      !> Median diameter of the free bodies of the run; taken from those here if absent [m]
      real(wp), intent(in), optional :: grain

      call new_force_law(self%settings%forces, self%bodies, self%law)
      self%contacts%area_is_effective = self%law%needs_effective_area
      self%contacts%has_twist = self%law%needs_twist
      self%contacts%n = 0_ip
      self%incidence = incidence_t()
      call list_moving(self)
      call renew_guard(self)
      associate (choice => self%settings%boxes)
         call new_box_maker(self%maker, self%bodies, choice%largest_ratio, choice%margin, self%boxes, error, grain)
      end associate
      if (allocated(error)) return
      call renew_neighbours(self, error)
      call allocate_memory(self)
      self%generation = self%generation + 1_ip
   end subroutine fit_to_bodies

   !> Guard the bodies that are here now, with the limit and the warnings of the whole run.
   subroutine renew_guard(self)
      type(simulation_t), intent(inout) :: self
      type(motion_guard_t) :: former
      integer :: n

      former = self%guard
      n = size(self%moving) - count(self%bodies%ghost)
      call new_motion_guard(self%guard, self%settings%guards, self%bodies, self%moving(:n))
      if (self%generation == 0_ip) return
      self%guard%limit = former%limit
      self%guard%warning = former%warning
   end subroutine renew_guard

   !> Begin with an empty list of pairs, but go on counting the work.
   subroutine renew_neighbours(self, error)
      type(simulation_t), intent(inout) :: self
      type(error_t), allocatable, intent(inout) :: error
      type(work_t) :: work

      if (allocated(self%neighbours%finder)) work = self%neighbours%finder%work
      associate (choice => self%settings%neighbours)
         call new_neighbours(self%neighbours, choice%finder, self%boxes, error, choice%skin)
      end associate
      if (allocated(error)) return
      self%neighbours%finder%work%value = work%value
      self%neighbours%finder%work%seconds = work%seconds
   end subroutine renew_neighbours

   subroutine allocate_memory(self)
      type(simulation_t), intent(inout) :: self
      integer :: k

      self%memory = contact_memory_t()
      allocate (self%memory%separating_edge(0))
      do k = 1, size(self%memory%column)
         if (self%law%needs(k)) allocate (self%memory%column(k)%value(0))
      end do
      if (self%settings%guards%passing /= 'off') allocate (self%memory%column(at_direction)%value(0))
   end subroutine allocate_memory

   subroutine list_moving(self)
      type(simulation_t), intent(inout) :: self
      integer :: k
      integer(ip) :: s

      self%moving = self%bodies%free
      do k = 1, size(self%motions)
         self%moving = [self%moving, self%motions(k)%slots]
      end do
      self%moving = [self%moving, pack([(s, s=1_ip, self%bodies%n)], self%bodies%ghost)]
   end subroutine list_moving

end module polydem_simulation_parts
