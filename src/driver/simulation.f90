!> A simulation and its time step.
module polydem_simulation
   use polydem_assemble, only: assemble_forces, index_contacts
   use polydem_bodies, only: bodies_t, turn_bodies
   use polydem_contacts, only: at_area, is_degenerate
   use polydem_counters, only: counters_t
   use polydem_errors, only: error_t, input_error, raise, run_error
   use polydem_exchange_counts, only: report_exchange
   use polydem_find_contacts, only: find_contacts
   use polydem_force_law, only: evaluate_law
   use polydem_guards, only: check_contacts, check_motion, check_places, check_step
   use polydem_integrator_factory, only: new_integrator
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_ledger, only: balance_of, balance_t, book_step, open_ledger
   use polydem_lone_team, only: lone_team_t
   use polydem_make_boxes, only: update_boxes
   use polydem_motion, only: motion_t, move_bodies
   use polydem_own_rows, only: owns_pair
   use polydem_relax, only: relax_bodies, relaxation_t
   use polydem_scene, only: build_scene
   use polydem_settings, only: settings_t
   use polydem_settle, only: recall_pairs, settle
   use polydem_simulation_parts, only: fit_to_bodies, simulation_t
   use polydem_stable_step, only: contact_numbers, stable_step_of_contacts, stable_step_of_shapes
   use polydem_strings, only: to_text
   use polydem_timers, only: stage_boxes, stage_exchange, stage_forces, stage_integrate, stage_neighbours, &
      stage_overlap, timers_t
   implicit none
   private
   public :: simulation_t, new_simulation, start_simulation, advance, time_of, take_stock, collect_counts, &
      report_counters, check_stability

   !> More steps than any run can do
   real(wp), parameter :: most_steps = 1.0e15_wp

contains

   !> Build the scene that the settings ask for and everything else.
   subroutine new_simulation(settings, self, error)
      !> Checked settings
      type(settings_t), intent(in) :: settings
      !> The simulation, ready to advance
      type(simulation_t), intent(out) :: self
      !> Bad input
      type(error_t), allocatable, intent(inout) :: error
      type(bodies_t) :: bodies
      type(motion_t), allocatable :: motions(:)
      type(relaxation_t) :: relaxation

      call build_scene(settings, bodies, motions, error)
      if (allocated(error)) return
      if (settings%guards%relaxed_depth > 0.0_wp) call relax_bodies(settings, bodies, relaxation, error)
      if (allocated(error)) return
      call start_simulation(settings, bodies, motions, self, error)
      self%relaxation = relaxation
   end subroutine new_simulation

   !> Start from given bodies, and compute the forces at time 0.
   subroutine start_simulation(settings, bodies, motions, self, error)
      !> Checked settings; the group &scene is not used
      type(settings_t), intent(in) :: settings
      !> Bodies at the start
      type(bodies_t), intent(in) :: bodies
      !> Prescribed motions of fixed bodies
      type(motion_t), intent(in) :: motions(:)
      !> The simulation, ready to advance
      type(simulation_t), intent(out) :: self
      !> Bad input
      type(error_t), allocatable, intent(inout) :: error

      allocate (lone_team_t :: self%team)
      self%settings = settings
      self%bodies = bodies
      self%motions = motions
      call new_integrator(settings%integrate, self%integrator)
      call choose_step(self, error)
      if (.not. allocated(error)) call fit_to_bodies(self, error)
      if (allocated(error)) return
      call move_walls(self, 0.0_wp)
      call update_boxes(self%maker, self%bodies, self%moving, self%boxes)
      call find_and_push(self, 0.0_wp, error)
      if (allocated(error)) return
      call start_integration(self)
      if (settings%output%ledger) call open_ledger(self%ledger, self%team, settings%forces%gravity, self%bodies, &
                                                   self%incidence, self%contacts)
      self%timers = timers_t()
   end subroutine start_simulation

   !> One time step. Of several processes all call this; a failure of one is known to all, at the latest when they agree
   !> after the step.
   subroutine advance(self, error)
      !> The simulation
      type(simulation_t), intent(inout) :: self
      !> The run cannot go on; names body, position and step
      type(error_t), allocatable, intent(inout) :: error

      self%step = self%step + 1_lp
      self%ledger%is_current = .false.
      call self%timers%start()
      call self%integrator%predict(self%dt, self%bodies)
      call move_walls(self, time_of(self))
      call check_places(self%guard, self%bodies, self%step, error)
      call self%timers%lap(stage_integrate)
      call place_boxes(self, error)
      if (allocated(error)) return
      call find_and_push(self, self%dt, error)
      ! Contacts may stop the run here; then nobody ends the step.
      if (self%settings%overlap%degenerate == 'stop') call self%team%agree(error)
      if (allocated(error)) return
      call self%integrator%correct(self%dt, self%bodies)
      call self%timers%lap(stage_integrate)
      if (self%settings%output%ledger) then
         call book_step(self%ledger, self%settings%forces%gravity, self%bodies, self%incidence, self%contacts)
         call self%timers%lap(stage_forces)
      end if
      call check_motion(self%guard, self%bodies, self%step, self%dt, error)
      call self%timers%lap(stage_integrate)
   end subroutine advance

   !> From predicted positions to boxes, with all bodies where they belong.
   subroutine place_boxes(self, error)
      type(simulation_t), intent(inout) :: self
      type(error_t), allocatable, intent(inout) :: error
      logical :: shared

      shared = self%team%size > 1_ip
      if (shared) then
         associate (domain => self%domain, team => self%team)
            domain%step_messages = domain%step_messages - team%messages
            domain%step_bytes = domain%step_bytes - team%bytes
            call domain%ghosts%follow(team, self%bodies)
            domain%step_messages = domain%step_messages + team%messages
            domain%step_bytes = domain%step_bytes + team%bytes
         end associate
         call self%timers%lap(stage_exchange)
      end if
      if (.not. allocated(error)) then
         call turn_bodies(self%bodies, self%moving)
         call self%timers%lap(stage_integrate)
         call update_boxes(self%maker, self%bodies, self%moving, self%boxes)
         call self%timers%lap(stage_boxes)
      end if
      call settle(self, error)
      if (.not. shared) return
      self%domain%ghost_steps = self%domain%ghost_steps + int(size(self%domain%ghosts%slots), lp)
      call self%timers%lap(stage_exchange)
   end subroutine place_boxes

   !> Simulated time [s]: a product, so that it does not drift.
   pure real(wp) function time_of(self)
      !> The simulation
      type(simulation_t), intent(in) :: self

      time_of = real(self%step, wp)*self%dt
   end function time_of

   !> Compare the bodies with the books; collective.
   subroutine take_stock(self, balance)
      !> The simulation, which has a ledger, at the end of a step
      type(simulation_t), intent(inout) :: self
      !> Energy, momentum, and what is unexplained
      type(balance_t), intent(out) :: balance

      call balance_of(self%ledger, self%team, self%dt, self%settings%forces%gravity, self%bodies, self%incidence, &
                      self%contacts, balance)
   end subroutine take_stock

   !> Compare the step with the stable step of the present contacts. Of several processes, that which has the critical
   !> contact warns or fails.
   subroutine check_stability(self, stable, warning, error)
      !> The simulation
      type(simulation_t), intent(inout) :: self
      !> Stable step of the present contacts [s], huge if there are none
      real(wp), intent(out) :: stable
      !> Set if the step is large, or unstable and that does not stop the run
      character(len=:), allocatable, intent(out) :: warning
      !> Set if the step is unstable and that stops the run
      type(error_t), allocatable, intent(inout) :: error
      type(error_t), allocatable :: failure
      real(wp), allocatable :: numbers(:)
      real(dp) :: least(1)
      integer(ip) :: critical

      numbers = contact_numbers(self%bodies%n, self%incidence)
      call self%domain%ghosts%follow_column(self%team, numbers)
      call stable_step_of_contacts(self%settings%forces, self%integrator%stability(), self%bodies, numbers, &
                                   self%contacts, stable, critical)
      least(1) = -real(stable, dp)
      call self%team%maximise(least)
      if (stable > real(-least(1), wp)) critical = 0_ip
      if (self%team%size > 1_ip) stable = real(-least(1), wp)
      call check_step(self%bodies, self%contacts, self%step, self%dt, stable, critical, warning, failure)
      if (.not. allocated(failure)) return
      if (self%settings%guards%step /= 'stop') then
         warning = failure%message
      else if (.not. allocated(error)) then
         call move_alloc(failure, error)
      end if
   end subroutine check_stability

   !> Bring the counts of all processes to the leader, where they go on; collective.
   subroutine collect_counts(self)
      !> The simulation
      type(simulation_t), intent(inout) :: self
      integer(lp), allocatable :: counts(:)

      if (self%team%size == 1_ip) return
      associate (value => self%neighbours%finder%work%value, n => size(self%sums))
         counts = [self%sums, value]
         call self%team%add_up(counts)
         if (.not. self%team%leads()) counts = 0_lp
         self%sums = counts(:n)
         value = counts(n + 1:)
      end associate
   end subroutine collect_counts

   !> Exact counts of the work done so far on all processes: pairs that began and ended and the work of finders count
   !> for each process that has them, everything else once. Collective.
   subroutine report_counters(self, counters)
      !> The simulation
      type(simulation_t), intent(inout) :: self
      !> List to set them in
      type(counters_t), intent(inout) :: counters
      integer(lp) :: counts(2)

      counts = [int(self%boxes%n, lp), int(self%neighbours%pairs%n, lp)]
      call self%team%add_up(counts)
      call collect_counts(self)
      call counters%set('steps', self%step)
      call counters%set('bodies', int(self%bodies%n_all, lp))
      call counters%set('boxes', counts(1))
      call counters%set('pairs', self%sums(1))
      call counters%set('pairs began', self%sums(3))
      call counters%set('pairs ended', self%sums(4))
      call counters%set('contacts', self%sums(2))
      call counters%set('contacts without direction', self%sums(5))
      call self%neighbours%report(counters)
      call counters%set('pairs', counts(2))
      if (allocated(self%law%constraint)) call self%law%constraint%report(counters)
      call report_exchange(self, counters)
   end subroutine report_counters

   !> From the boxes of the bodies to the forces on them: the middle of the step.
   subroutine find_and_push(self, dt, error)
      type(simulation_t), intent(inout) :: self
      real(wp), intent(in) :: dt
      type(error_t), allocatable, intent(inout) :: error

      call self%neighbours%update(self%boxes)
      if (self%neighbours%pairs%contradictions > 0_lp) then
         call raise(error, run_error, 'step '//to_text(self%step)//': the finder '// &
                    self%settings%neighbours%finder//' reported changes that contradict its list. This is a '// &
                    'mistake in the program; all_pairs can take its place')
         return
      end if
      call carry_memory(self)
      call recall_pairs(self)
      call self%timers%lap(stage_neighbours)
      associate (pairs => self%neighbours%pairs)
         call find_contacts(self%bodies, pairs%n, pairs%first, pairs%second, self%memory, self%contacts)
         self%sums(3:4) = self%sums(3:4) + int([pairs%n_began, pairs%n_ended], lp)
      end associate
      call count_own(self)
      call check_contacts(self%settings%overlap%degenerate, self%bodies, self%contacts, self%step, error)
      call self%timers%lap(stage_overlap)
      call evaluate_law(self%law, self%bodies, dt, self%contacts, self%memory)
      call index_contacts(self%bodies%n, self%contacts, self%incidence)
      call assemble_forces(self%settings%forces%gravity, self%incidence, self%contacts, self%bodies)
      if (allocated(self%law%constraint)) call constrain(self, error)
      call self%timers%lap(stage_forces)
   end subroutine find_and_push

   !> Count the pairs, the contacts and those of them without direction whose lead body this process moves.
   subroutine count_own(self)
      type(simulation_t), intent(inout) :: self
      integer(lp) :: n(3)
      integer(ip) :: c, p

      associate (pairs => self%neighbours%pairs, contacts => self%contacts, bodies => self%bodies)
         n = int([pairs%n, contacts%n, contacts%n_degenerate], lp)
         if (self%team%size > 1_ip) then
            do p = 1_ip, pairs%n
               if (.not. owns_pair(bodies, pairs%first(p), pairs%second(p))) n(1) = n(1) - 1_lp
            end do
            do c = 1_ip, contacts%n
               if (owns_pair(bodies, contacts%first(c), contacts%second(c))) cycle
               n(2) = n(2) - 1_lp
               if (contacts%n_degenerate > 0_ip) n(3) = n(3) - merge(1_lp, 0_lp, is_degenerate(contacts, c))
            end do
         end if
      end associate
      self%sums([1, 2, 5]) = self%sums([1, 2, 5]) + n
   end subroutine count_own

   !> Add the forces that keep velocities to a constraint.
   subroutine constrain(self, error)
      type(simulation_t), intent(inout) :: self
      type(error_t), allocatable, intent(inout) :: error

      if (allocated(error)) return
      call self%law%constraint%apply(self%dt, self%incidence, self%bodies, self%contacts, self%memory, error)
      if (allocated(error)) error%message = 'step '//to_text(self%step)//': '//error%message
      call assemble_forces(self%settings%forces%gravity, self%incidence, self%contacts, self%bodies)
   end subroutine constrain

   !> Move the columns of memory along with the pair list.
   subroutine carry_memory(self)
      type(simulation_t), intent(inout) :: self
      integer :: k

      associate (pairs => self%neighbours%pairs, memory => self%memory)
         call pairs%carry(memory%separating_edge, 0_ip)
         do k = 1, size(memory%column)
            if (allocated(memory%column(k)%value)) call pairs%carry(memory%column(k)%value, 0.0_wp)
         end do
      end associate
   end subroutine carry_memory

   subroutine move_walls(self, time)
      type(simulation_t), intent(inout) :: self
      real(wp), intent(in) :: time
      integer :: k

      do k = 1, size(self%motions)
         if (time >= self%motions(k)%start) call move_bodies(self%motions(k), time, self%bodies)
      end do
   end subroutine move_walls

   !> Accelerations at time 0: from the forces, or from gravity alone if the scheme wants it so.
   subroutine start_integration(self)
      type(simulation_t), intent(inout) :: self
      integer(ip) :: k

      associate (bodies => self%bodies)
         do k = 1_ip, size(bodies%free, kind=ip)
            associate (s => bodies%free(k))
               if (self%integrator%starts_from_forces) then
                  bodies%acceleration(:, s) = bodies%force(:, s)*bodies%inverse_mass(s)
                  bodies%angular_acceleration(s) = bodies%torque(s)*bodies%inverse_inertia(s)
               else
                  bodies%acceleration(:, s) = self%settings%forces%gravity
                  bodies%angular_acceleration(s) = 0.0_wp
               end if
            end associate
         end do
         call self%integrator%start(bodies)
      end associate
      ! A scheme that does not look at the forces at time 0 knows no contacts from before its first step.
      associate (area => self%memory%column(at_area))
         if (.not. self%integrator%starts_from_forces .and. allocated(area%value)) area%value = 0.0_wp
      end associate
   end subroutine start_integration

   !> Take the step of the settings, or a fraction of the stable step that divides the duration.
   subroutine choose_step(self, error)
      type(simulation_t), intent(inout) :: self
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: critical
      real(wp) :: steps

      call stable_step_of_shapes(self%settings%forces, self%integrator%stability(), self%bodies, &
                                 self%expected_stable_step, critical)
      associate (settings => self%settings%integrate)
         self%dt = settings%dt
         if (self%dt <= 0.0_wp .and. (critical == 0_ip .or. .not. self%expected_stable_step > 0.0_wp)) then
            call raise(error, input_error, self%settings%file//': no step can be chosen, since there is no free '// &
                       'body, or stiffness and masses are beyond all measure; give dt in &integrate')
            return
         end if
         if (self%dt <= 0.0_wp) then
            steps = settings%duration/(settings%fraction*self%expected_stable_step)
            self%dt = settings%fraction*self%expected_stable_step
            if (steps < most_steps) self%dt = settings%duration/real(max(1_lp, ceiling(steps, lp)), wp)
         end if
         steps = settings%duration/self%dt
         if (.not. (steps >= 0.5_wp .and. steps < most_steps)) then
            call raise(error, input_error, self%settings%file//': a duration of '//to_text(settings%duration)// &
                       ' s in steps of '//to_text(self%dt)//' s makes '//to_text(steps)//' steps; 1 to '// &
                       to_text(most_steps)//' are possible. Give another dt or duration in &integrate')
            return
         end if
         self%n_steps = nint(steps, lp)
      end associate
   end subroutine choose_step

end module polydem_simulation
