!> The complete state of a simulation.
module polydem_simulation
   use polydem_bodies, only: bodies_t
   use polydem_body_forces, only: body_forces_t
   use polydem_body_motion, only: body_motion_t
   use polydem_communicator, only: communicator_t
   use polydem_contact_history, only: contact_history_t, history_kind_t
   use polydem_contacts, only: contacts_t
   use polydem_domain, only: domain_t
   use polydem_energy_balance, only: balance_t, energy_balance_t, evaluate_balance
   use polydem_force_law, only: force_law_t
   use polydem_kinds, only: ip, lp, wp
   use polydem_neighbour_search, only: neighbour_search_t
   use polydem_packed_history, only: packed_history_t
   use polydem_run_stages, only: run_stages_t
   use polydem_series, only: series_t
   use polydem_settings, only: settings_t
   use polydem_timers, only: timers_t
   use polydem_traffic, only: traffic_t
   use polydem_wall_energy, only: add_cell, add_loads
   use polydem_walls, only: walls_t
   use polydem_loop_results, only: loop_results_t
   implicit none
   private
   public :: simulation_t, relaxation_t, former_direction, time_of, present_gravity, acts_on_all, compute_balance
   public :: sum_contacts, sum_began, sum_ended, sum_degenerate

   !> Elements of `sums`: contacts, pairs that began, pairs that ended, contacts without direction
   integer, parameter :: sum_contacts = 1, sum_began = 2, sum_ended = 3, sum_degenerate = 4
   !> Number of these elements
   integer, parameter :: n_sums = 4

   !> Summary of the relaxation before time 0
   type :: relaxation_t
      !> Number of sweeps, 0 if no relaxation was necessary
      integer(ip) :: sweeps = 0_ip
      !> Depth of the deepest contact before and after, as a fraction of the thickness of the thinner body
      real(wp) :: before = 0.0_wp, after = 0.0_wp
      !> Greatest displacement of the centre of a body [m]
      real(wp) :: move = 0.0_wp
      !> Positions before the relaxation, allocated while it lasts, (2, slot) [m]
      real(wp), allocatable :: from(:, :)
   end type relaxation_t

   !> The impact for which the time step is chosen
   type :: expected_impact_t
      !> Speed of approach [m/s]
      real(wp) :: speed = 0.0_wp
      !> Where the speed comes from
      character(len=:), allocatable :: origin
      !> Depth of the contact of two equal bodies, area over length [m]
      real(wp) :: depth = 0.0_wp
      !> Length of this contact [m], and its stable step over that without dashpots
      real(wp) :: length = 0.0_wp, damped = 1.0_wp
      !> Identifier of the body whose contacts limit the step; 0 if there is no free body
      integer(lp) :: body = 0_lp
   end type expected_impact_t

   !> The greatest static pressure of the scene
   type :: static_pressure_t
      !> Pressure; 0: there is none [N/m2]
      real(wp) :: greatest = 0.0_wp
      !> Where it comes from
      character(len=:), allocatable :: origin
      !> Whether it is the weight of the free bodies
      logical :: is_of_bodies = .false.
   end type static_pressure_t

   !> The complete state of a simulation on one rank
   type :: simulation_t
      !> Settings of the run; gravity and drag of the group &forces are those of the present stage
      type(settings_t) :: settings
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
      type(traffic_t), allocatable :: traffic
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

   !> What the guard against passing bodies remembers
   type(history_kind_t), parameter :: former_direction = &
      history_kind_t('direction', '1', 'direction at the last step, packed')

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

      gravity = self%settings%forces%gravity + self%loop%force_sums%acceleration
   end function present_gravity

   !> Whether a step leaves nothing out for bodies that nothing touches: forces act on all bodies, or the border of a
   !> sheared cell, or a cell that yields; or bodies have several pieces, of which pairs are made
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

      call evaluate_balance(self%energy_balance, self%comm, self%dt, self%settings%forces%gravity, self%bodies, &
                            self%loop%force_sums, self%loop%walls, balance)
      if (allocated(self%bodies%cell%load)) call add_cell( &
         self%energy_balance, self%dt*(self%bodies%cell%load%power_sum - 0.5_wp*self%bodies%cell%load%power), &
         self%loop%walls%energy_is_known, balance)
      if (allocated(self%walls%loads)) call add_loads(self%energy_balance, self%walls%energies(self%dt), balance)
   end subroutine compute_balance

end module polydem_simulation
