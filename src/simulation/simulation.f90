!> The complete state of a simulation.
module polydem_simulation
   use polydem_actions, only: actions_t
   use polydem_bodies, only: bodies_t
   use polydem_body_forces, only: body_forces_t
   use polydem_body_motion, only: body_motion_t
   use polydem_communicator, only: communicator_t
   use polydem_contact_history, only: contact_history_t
   use polydem_contacts, only: contacts_t
   use polydem_domain, only: domain_t
   use polydem_energy_balance, only: balance_t, energy_balance_t, evaluate_balance
   use polydem_errors, only: error_t
   use polydem_force_law, only: force_law_t
   use polydem_kinds, only: ip, lp, wp
   use polydem_neighbour_search, only: neighbour_search_t
   use polydem_packed_history, only: packed_history_t
   use polydem_run_stages, only: run_stages_t
   use polydem_serializer, only: serializer_t
   use polydem_series, only: series_t
   use polydem_settings, only: forces_settings_t, settings_t
   use polydem_start_findings, only: expected_impact_t, relaxation_t, static_pressure_t
   use polydem_strings, only: counted
   use polydem_timers, only: timers_t
   use polydem_sources_and_sinks, only: sources_and_sinks_t
   use polydem_walls, only: walls_t
   use polydem_warning, only: warning_t
   use polydem_loop_results, only: loop_results_t
   implicit none
   private
   public :: simulation_t, participant_t, participant_item_t, guard_t, guard_item_t, report_guard, serialize_guard
   public :: time_of, present_gravity, acts_on_all, compute_balance
   public :: sum_contacts, sum_began, sum_ended, sum_degenerate

   !> Elements of `sums`: contacts, pairs that began, pairs that ended, contacts without direction
   integer, parameter :: sum_contacts = 1, sum_began = 2, sum_ended = 3, sum_degenerate = 4
   !> Number of these elements
   integer, parameter :: n_sums = 4

   !> What takes part in the steps of some runs beside bodies, contacts and integrator, such as loads, sources or a cell
   !> that moves. All procedures do nothing by default, and all but `needs_table` and `check_contacts` are collective.
   type, abstract :: participant_t
      !> Whether it needs all ranks after the forces, so that they agree on errors before
      logical :: needs_all_ranks = .false.
   contains
      procedure :: start => start_nothing
      procedure :: change_bodies => change_nothing
      procedure :: begin_step => begin_nothing
      procedure :: needs_table => needs_no_table
      procedure :: check_contacts => check_nothing
      procedure :: follow_forces => follow_nothing
      procedure :: end_step => end_nothing
      procedure :: serialize => serialize_nothing
      procedure :: add_energies => add_nothing
   end type participant_t

   !> A participant of any kind
   type :: participant_item_t
      !> The participant
      class(participant_t), allocatable :: participant
   end type participant_item_t

   !> A guard: a check during a run that stops it or warns, and what it has found. Each entry of &guards with the words
   !> stop, warn and off has one. A new guard is a file, a line in `guard_list.f90` and an entry.
   type, abstract :: guard_t
      !> Entry of &guards, and its value: stop, warn or off
      character(len=:), allocatable :: name, choice
      !> Whether the value is not off
      logical :: is_on = .true.
      !> What a warning counts, 'step' or 'check', and what was found in it: the end of 'warnings: 3 steps '
      character(len=:), allocatable :: noun, finding
      !> Whether a check looks at the table of all contacts
      logical :: needs_contacts = .false.
      !> Whether all ranks find the same, and thus warn and stop alike
      logical :: is_global = .false.
      !> Whether a rank may stop the run in a step that is no check, without a message to others
      logical :: stops_alone = .false.
      !> Whether the present step is a check: guards that do not look in every step look now
      logical :: is_check = .false.
      !> Whether a guard of a rank asks in this step for a look of all ranks
      logical :: is_asked = .false.
      !> Warnings so far
      type(warning_t) :: warning
   contains
      procedure(configure_guard), deferred :: configure
      procedure :: start => start_no_guard
      procedure :: set_local_limits => set_no_limits
      procedure :: set_global_limits => set_no_limits
      procedure :: respond_to_motion => ignore_motion
      procedure :: asks
      procedure(look_at), deferred :: look
      procedure :: serialize => serialize_guard
      procedure :: report => report_guard
   end type guard_t

   !> A guard of any kind
   type :: guard_item_t
      !> The guard
      class(guard_t), allocatable :: guard
   end type guard_item_t

   !> The complete state of a simulation on one rank
   type :: simulation_t
      !> Settings of the run, which do not change
      type(settings_t) :: settings
      !> Parameters of the forces: those of the settings, with the stiffness that follows from the static pressure, and
      !> gravity and drag of the present stage
      type(forces_settings_t) :: forces
      !> Stages of the run
      type(run_stages_t) :: stages
      !> Communicator of the ranks that share the bodies
      class(communicator_t), allocatable :: comm
      !> Part of space of this rank, and its halo
      type(domain_t) :: domain
      !> Bodies
      type(bodies_t) :: bodies
      !> Walls: what drives them, their names, loads and record
      type(walls_t) :: walls
      !> Rows of the series that no file has yet
      type(series_t) :: series
      !> Sources and sinks; not allocated if there are none
      type(sources_and_sinks_t), allocatable :: sources_and_sinks
      !> Actions of the program that holds the simulation, or of a file; not allocated if there are none
      type(actions_t), allocatable :: actions
      !> Boxes of the bodies, and the pairs of those that overlap
      type(neighbour_search_t) :: search
      !> Table of the contacts of this step; empty if the loop did not keep it
      type(contacts_t) :: contacts
      !> Results of the loop over the contacts of this step
      type(loop_results_t) :: loop
      !> Contact history of the pairs
      type(contact_history_t) :: history
      !> Contact history received by a redistribution, until the pairs are found again; unallocated between steps
      type(packed_history_t), allocatable :: received_history
      !> Force law
      type(force_law_t) :: law
      !> What takes part in the steps beside all this, in the order in which it acts. While a participant acts, the list
      !> is not here, so that it may change the simulation and itself
      type(participant_item_t), allocatable :: participants(:)
      !> Guards in the order of their checks. While one looks, the list is not here
      type(guard_item_t), allocatable :: guards(:)
      !> Forces on bodies that are no contacts
      type(body_forces_t) :: body_forces
      !> What moves the free bodies
      type(body_motion_t) :: motion
      !> Energy and momentum balance
      type(energy_balance_t) :: energy_balance
      !> Timers of the stages
      type(timers_t) :: timers
      !> Number of steps done
      integer(lp) :: step = 0_lp
      !> Number of steps of the whole run
      integer(lp) :: n_steps = 0_lp
      !> Time step [s]
      real(wp) :: dt = 0.0_wp
      !> Stable time step estimated from the shapes [s]
      real(wp) :: expected_stable_step = 0.0_wp
      !> The impact for which it is estimated
      type(expected_impact_t) :: expected
      !> The static pressure of the bodies at the start
      type(static_pressure_t) :: pressure
      !> Number of bodies that were outside the periodic cell at the start
      integer(lp) :: n_outside = 0_lp
      !> Summary of the relaxation before time 0
      type(relaxation_t) :: relaxation
      !> Slots that may move: free bodies, then bodies with prescribed motion, then halo bodies
      integer(ip), allocatable :: moving(:)
      !> Number of those of them that are no halo bodies
      integer(ip) :: n_moving = 0_ip
      !> Sums over all steps, (`sum_contacts` to `sum_degenerate`)
      integer(lp) :: sums(n_sums) = 0_lp
   end type simulation_t

   abstract interface
      !> Set what the guard says of itself: the choice, and what the log counts.
      subroutine configure_guard(self, settings)
         import :: guard_t, settings_t
         class(guard_t), intent(inout) :: self
         type(settings_t), intent(in) :: settings
      end subroutine configure_guard

      !> Look at the simulation after a step, and stop or warn. Collective.
      subroutine look_at(self, simulation, error)
         import :: error_t, guard_t, simulation_t
         class(guard_t), intent(inout) :: self
         !> The simulation at the end of the step
         type(simulation_t), intent(inout) :: simulation
         !> Names body, position and step if the run must stop; on entry an error of another guard of this rank
         type(error_t), allocatable, intent(inout) :: error
      end subroutine look_at
   end interface

contains

   !> Simulated time [s]. It is a product, not a sum, and therefore has no accumulated rounding error.
   pure real(wp) function time_of(self)
      type(simulation_t), intent(in) :: self

      time_of = real(self%step, wp)*self%dt
   end function time_of

   !> Acceleration of gravity in this step, with what changes in time (2) [m/s2]; the forces of the step are known
   pure function present_gravity(self) result(gravity)
      type(simulation_t), intent(in) :: self
      real(wp) :: gravity(2)

      gravity = self%forces%gravity + self%loop%force_sums%acceleration
   end function present_gravity

   !> Whether a step leaves nothing out for bodies that nothing touches: forces act on all bodies, or the border of a
   !> sheared cell, or a stress-controlled cell; or bodies have several pieces, of which pairs are made
   pure logical function acts_on_all(self)
      type(simulation_t), intent(in) :: self

      acts_on_all = self%body_forces%act() .or. self%bodies%cell%is_sheared .or. &
                    allocated(self%bodies%cell%load) .or. self%bodies%pieces%most > 1_ip
   end function acts_on_all

   !> Evaluate the energy and momentum balance; collective.
   subroutine compute_balance(self, balance)
      !> The simulation at the end of a step, with `output.energy_balance` on
      type(simulation_t), intent(inout) :: self
      !> Energy, momentum and their unexplained residuals
      type(balance_t), intent(out) :: balance
      type(participant_item_t), allocatable :: list(:)
      integer :: k

      call evaluate_balance(self%energy_balance, self%comm, self%dt, self%forces%gravity, self%bodies, &
                            self%loop%force_sums, self%loop%walls, balance)
      call move_alloc(self%participants, list)
      do k = 1, size(list)
         call list(k)%participant%add_energies(self, balance)
      end do
      call move_alloc(list, self%participants)
   end subroutine compute_balance

   !> Start with the forces at time 0, or at the time of a restart.
   subroutine start_nothing(self, simulation)
      class(participant_t), intent(inout) :: self
      type(simulation_t), intent(inout) :: simulation

      associate (unused_self => self, unused_simulation => simulation)
      end associate
   end subroutine start_nothing

   !> Let bodies enter, leave or vanish between two steps.
   subroutine change_nothing(self, simulation, error)
      class(participant_t), intent(inout) :: self
      type(simulation_t), intent(inout) :: simulation
      !> Allocated if that fails, on all ranks
      type(error_t), allocatable, intent(inout) :: error

      associate (unused_self => self, unused_simulation => simulation)
      end associate
      if (allocated(error)) return
   end subroutine change_nothing

   !> Begin a step, before bodies move.
   subroutine begin_nothing(self, simulation, error)
      class(participant_t), intent(inout) :: self
      type(simulation_t), intent(inout) :: simulation
      !> Allocated if the step is impossible, on all ranks
      type(error_t), allocatable, intent(inout) :: error

      associate (unused_self => self, unused_simulation => simulation)
      end associate
      if (allocated(error)) return
   end subroutine begin_nothing

   !> Whether this step must keep the table of all contacts
   pure logical function needs_no_table(self, simulation)
      class(participant_t), intent(in) :: self
      type(simulation_t), intent(in) :: simulation

      associate (unused_self => self, unused_simulation => simulation)
      end associate
      needs_no_table = .false.
   end function needs_no_table

   !> Stop the run if the contacts of a step, before they act, are none to go on with. An error of one rank reaches all
   !> ranks if `needs_all_ranks`.
   subroutine check_nothing(self, simulation, error)
      class(participant_t), intent(in) :: self
      type(simulation_t), intent(in) :: simulation
      !> Names the contact
      type(error_t), allocatable, intent(inout) :: error

      associate (unused_self => self, unused_simulation => simulation)
      end associate
      if (allocated(error)) return
   end subroutine check_nothing

   !> Act on the forces of a step, before the bodies get their final velocities.
   subroutine follow_nothing(self, simulation, dt)
      class(participant_t), intent(inout) :: self
      type(simulation_t), intent(inout) :: simulation
      !> Time step; 0 at the start of the run [s]
      real(wp), intent(in) :: dt

      associate (unused_self => self, unused_simulation => simulation, unused_dt => dt)
      end associate
   end subroutine follow_nothing

   !> End a step, when all bodies have their final velocities.
   subroutine end_nothing(self, simulation)
      class(participant_t), intent(inout) :: self
      type(simulation_t), intent(inout) :: simulation

      associate (unused_self => self, unused_simulation => simulation)
      end associate
   end subroutine end_nothing

   !> Write what outlives a step to a checkpoint, or read it.
   subroutine serialize_nothing(self, simulation, serializer)
      class(participant_t), intent(inout) :: self
      type(simulation_t), intent(inout) :: simulation
      class(serializer_t), intent(inout) :: serializer

      associate (unused_self => self, unused_simulation => simulation, unused_serializer => serializer)
      end associate
   end subroutine serialize_nothing

   !> Add work and energy to the balance, whose residual becomes that of all.
   subroutine add_nothing(self, simulation, balance)
      class(participant_t), intent(in) :: self
      !> The simulation; its `energy_balance` may change
      type(simulation_t), intent(inout) :: simulation
      type(balance_t), intent(inout) :: balance

      associate (unused_self => self, unused_simulation => simulation, unused_balance => balance)
      end associate
   end subroutine add_nothing

   !> Record what a guard needs of the simulation at time 0, with the forces of its contacts. Collective.
   subroutine start_no_guard(self, simulation)
      class(guard_t), intent(inout) :: self
      type(simulation_t), intent(inout) :: simulation

      associate (unused_self => self, unused_simulation => simulation)
      end associate
   end subroutine start_no_guard

   !> Set what the step finds for a guard: motion beyond a limit, contacts that are flagged. The local limits depend on
   !> the bodies of this rank, the global ones on those of all ranks (collective).
   subroutine set_no_limits(self, simulation)
      class(guard_t), intent(in) :: self
      type(simulation_t), intent(inout) :: simulation

      associate (unused_self => self, unused_simulation => simulation)
      end associate
   end subroutine set_no_limits

   !> Respond at once to a motion that is not finite or beyond the limit, of any guard.
   subroutine ignore_motion(self, simulation, error)
      class(guard_t), intent(inout) :: self
      type(simulation_t), intent(in) :: simulation
      type(error_t), allocatable, intent(inout) :: error

      associate (unused_self => self, unused_simulation => simulation)
      end associate
      if (allocated(error)) return
   end subroutine ignore_motion

   !> Whether the guard of this rank has found something at which all ranks must look together; by default never.
   logical function asks(self, simulation)
      class(guard_t), intent(in) :: self
      !> The simulation at the end of a step
      type(simulation_t), intent(in) :: simulation

      associate (unused_self => self, unused_simulation => simulation)
      end associate
      asks = .false.
   end function asks

   !> Serialize what the guard has found.
   subroutine serialize_guard(self, serializer)
      class(guard_t), intent(inout) :: self
      class(serializer_t), intent(inout) :: serializer

      call serializer%field('/run/'//self%name//'_warnings', self%warning%count, '1', self%noun//'s '//self%finding)
   end subroutine serialize_guard

   !> Line for the end of the log; empty if there is nothing to report
   function report_guard(self) result(text)
      class(guard_t), intent(in) :: self
      character(len=:), allocatable :: text

      text = ''
      if (self%warning%count > 0_lp) text = 'warnings: '//counted(self%warning%count, self%noun)//' '//self%finding
   end function report_guard

end module polydem_simulation
