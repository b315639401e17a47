!> Start of a simulation: time step, forces and accelerations at time 0. All ranks start alike, one or many.
module polydem_start_simulation
   use polydem_bodies, only: bodies_t
   use polydem_body_passes, only: move_walls
   use polydem_box_maker, only: diameters_of, update_boxes
   use polydem_choose_instruction_set, only: choose_instruction_set
   use polydem_communicator, only: communicator_t
   use polydem_domain, only: new_domain
   use polydem_energy_balance, only: start_energy_balance
   use polydem_errors, only: error_t, input_error, raise
   use polydem_force_law, only: check_law, choose_parts, force_law_t
   use polydem_integrator_factory, only: new_integrator
   use polydem_kinds, only: ip, lp, wp
   use polydem_local_bodies, only: fit_to_bodies
   use polydem_origin, only: place_of
   use polydem_prescribed_motion, only: motion_t
   use polydem_redistribution, only: redistribute
   use polydem_relaxation, only: relax_bodies
   use polydem_settings, only: settings_t
   use polydem_simulation, only: simulation_t
   use polydem_stable_step, only: stable_step_of_shapes
   use polydem_strings, only: to_text
   use polydem_time_step, only: compute_forces
   use polydem_timers, only: timers_t
   use polydem_whole_run, only: find_median, reduce_to_greatest, reduce_to_least
   implicit none
   private
   public :: start_simulation, start_with_bodies

   !> Upper limit of the number of steps
   real(wp), parameter :: most_steps = 1.0e15_wp

contains

   !> Set up a serial simulation with given bodies, and compute the forces at time 0.
   subroutine start_simulation(settings, bodies, motions, self, error)
      !> Checked settings; the group &scene is not used
      type(settings_t), intent(in) :: settings
      !> Bodies at the start
      type(bodies_t), intent(in) :: bodies
      !> Prescribed motions of fixed bodies
      type(motion_t), intent(in) :: motions(:)
      !> The simulation, ready to advance
      type(simulation_t), intent(out) :: self
      !> Allocated if bodies or settings are invalid
      type(error_t), allocatable, intent(inout) :: error

      self%bodies = bodies
      self%motions = motions
      call start_with_bodies(settings, communicator_t(), self, error)
   end subroutine start_simulation

   !> Set up a simulation with the bodies that it has: all fixed bodies, and any share of the free bodies of the run.
   !> Then compute the forces at time 0. Collective; all ranks get the same error.
   subroutine start_with_bodies(settings, comm, self, error)
      !> Checked settings; the group &scene is not used
      type(settings_t), intent(in) :: settings
      class(communicator_t), intent(in) :: comm
      !> On entry with bodies and motions, on return ready to advance
      type(simulation_t), intent(inout) :: self
      !> Allocated if bodies or settings are invalid
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: median_diameter, limit(1)

      call choose_instruction_set(self%isa, error)
      call check_law(settings, 1_ip, error)
      if (allocated(error)) return
      allocate (self%comm, source=comm)
      self%settings = settings
      call new_integrator(settings%integrate, self%integrator)
      call choose_step(self, error)
      if (allocated(error)) return
      call find_median(self%comm, diameters_of(self%bodies), median_diameter)
      call new_domain(self%domain, settings%decomposition, median_diameter, self%comm, error)
      if (.not. allocated(error)) call fit_to_bodies(self, error, median_diameter)
      call self%comm%all_reduce_error(error)
      if (allocated(error)) return
      limit = self%guard%limit
      call reduce_to_least(self%comm, limit)
      self%guard%limit = limit(1)
      call self%integrator%start(self%bodies)
      if (settings%guards%relaxed_depth > 0.0_wp) call relax_bodies(self, error)
      if (allocated(error)) return
      call move_walls(self, 0.0_wp)
      call update_boxes(self%maker, self%bodies, self%moving, self%boxes)
      call redistribute(self, error)
      if (.not. allocated(error)) call compute_forces(self, 0.0_wp, error)
      call self%comm%all_reduce_error(error)
      if (allocated(error)) return
      call start_integration(self)
      if (settings%output%energy_balance) call start_energy_balance( &
         self%energy_balance, self%comm, settings%forces%gravity, self%bodies, self%force_sums, self%walls)
      self%timers = timers_t()
   end subroutine start_with_bodies

   !> Set the accelerations at time 0: from the forces, or from gravity alone, depending on the integration scheme.
   subroutine start_integration(self)
      type(simulation_t), intent(inout) :: self
      integer(ip) :: k
      integer :: c

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
      ! A scheme that ignores the forces at time 0 has no contact history before its first step.
      if (self%integrator%starts_from_forces .or. .not. allocated(self%history%column)) return
      do c = 1, size(self%history%column)
         if (self%history%column(c)%kind%zero_is_new) self%history%column(c)%value = 0.0_wp
      end do
   end subroutine start_integration

   !> Use dt of the settings, or compute it: a fraction of the stable time step, reduced to divide the duration evenly.
   !> Collective; all ranks get the same error.
   subroutine choose_step(self, error)
      type(simulation_t), intent(inout) :: self
      type(error_t), allocatable, intent(inout) :: error
      type(force_law_t) :: law
      integer(ip) :: critical
      real(wp) :: steps, least(1), has_free(1)

      call choose_parts(self%settings%forces, law)
      call stable_step_of_shapes(law, self%integrator%stability(), self%bodies, least(1), critical)
      has_free = merge(1.0_wp, 0.0_wp, critical > 0_ip)
      call reduce_to_least(self%comm, least)
      call reduce_to_greatest(self%comm, has_free)
      self%expected_stable_step = least(1)
      associate (settings => self%settings%integrate)
         self%dt = settings%dt
         if (self%dt <= 0.0_wp .and. (has_free(1) < 1.0_wp .or. .not. self%expected_stable_step > 0.0_wp)) then
            call raise(error, input_error, place_of(self%settings, 'integrate', 'dt')//': cannot choose dt: there '// &
                       'is no free body, or stiffness or mass is extreme. Set dt in &integrate')
            return
         end if
         if (self%dt <= 0.0_wp) then
            steps = settings%duration/(settings%fraction*self%expected_stable_step)
            self%dt = settings%fraction*self%expected_stable_step
            if (steps < most_steps) self%dt = settings%duration/real(max(1_lp, ceiling(steps, lp)), wp)
         end if
         steps = settings%duration/self%dt
         if (.not. (steps >= 0.5_wp .and. steps < most_steps)) then
            call raise(error, input_error, place_of(self%settings, 'integrate', 'duration')//': a duration of '// &
                       to_text(settings%duration)//' s with dt = '//to_text(self%dt)//' s requires '// &
                       to_text(steps)//' steps, but only 1 to '//to_text(most_steps)// &
                       ' are allowed. Change dt or duration in &integrate')
            return
         end if
         self%n_steps = nint(steps, lp)
      end associate
   end subroutine choose_step

end module polydem_start_simulation
