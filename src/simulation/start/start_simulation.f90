!> Start of a simulation: time step, forces and accelerations at time 0. All ranks start alike, one or many.
module polydem_start_simulation
   use polydem_begin_stage, only: continue_stages, prepare_stages
   use polydem_bodies, only: bodies_t
   use polydem_body_forces, only: choose_body_forces
   use polydem_box_maker, only: update_boxes
   use polydem_changed_bodies, only: expect_changes
   use polydem_check_traffic, only: check_traffic, draw_sample
   use polydem_choose_instruction_set, only: choose_instruction_set
   use polydem_choose_step, only: choose_step
   use polydem_communicator, only: communicator_t
   use polydem_domain, only: new_domain
   use polydem_enter_cell, only: check_constraint, enter_cell
   use polydem_energy_balance, only: start_energy_balance
   use polydem_errors, only: error_t
   use polydem_field_sums, only: accelerate_by_fields
   use polydem_global_reductions, only: find_median, sum_exactly
   use polydem_integrator_factory, only: new_integrator
   use polydem_kinds, only: ip, wp
   use polydem_law_factory, only: choose_parts
   use polydem_local_data, only: limit_displacement, rebuild_local_data
   use polydem_new_neighbours, only: choose_finder
   use polydem_pair_parameters, only: pair_parameters
   use polydem_predict, only: move_walls, yield_walls
   use polydem_redistribution, only: redistribute
   use polydem_relaxation, only: relax_bodies
   use polydem_settings, only: forces_settings_t, settings_t
   use polydem_simulation, only: simulation_t
   use polydem_time_step, only: compute_forces
   use polydem_timers, only: timers_t
   use polydem_traffic, only: new_traffic
   use polydem_wall_load, only: set_masses
   implicit none
   private
   public :: start_with_bodies, place_bodies, start_forces

contains

   !> Set up a simulation with the bodies that it has: all fixed bodies, and any share of the free bodies of the run.
   !> Then compute the forces at time 0. Collective; all ranks get the same error.
   subroutine start_with_bodies(settings, comm, self, error)
      !> Checked settings; the group &scene is not used
      type(settings_t), intent(in) :: settings
      class(communicator_t), intent(in) :: comm
      !> On entry with bodies and walls, and with a time step if it is not to be chosen; on return ready to advance
      type(simulation_t), intent(inout) :: self
      !> Allocated if bodies or settings are invalid
      type(error_t), allocatable, intent(inout) :: error

      call place_bodies(settings, comm, self, error)
      if (.not. allocated(error)) call start_forces(self, error)
   end subroutine start_with_bodies

   !> The first part of `start_with_bodies`: all but the forces. Collective; all ranks get the same error.
   subroutine place_bodies(settings, comm, self, error)
      !> Checked settings
      type(settings_t), intent(in) :: settings
      class(communicator_t), intent(in) :: comm
      !> On entry with bodies and walls
      type(simulation_t), intent(inout) :: self
      !> Allocated if bodies or settings are invalid
      type(error_t), allocatable, intent(inout) :: error
      type(bodies_t) :: sample
      real(wp) :: median_diameter

      call choose_instruction_set(self%bodies%isa, error)
      call choose_parts(settings%forces, self%law, pair_parameters(settings))
      call self%law%check(settings, 1_ip, error)
      if (allocated(error)) return
      allocate (self%comm, source=comm)
      self%settings = settings
      call enter_cell(self, error)
      if (allocated(error)) return
      call prepare_stages(self)
      call new_traffic(self%settings, self%traffic)
      call new_integrator(settings%integrate, self%integrator)
      call choose_finder(self%neighbours, settings%neighbours%finder, error, settings%neighbours%skin, self%bodies%isa)
      call choose_all_fields(self)
      if (allocated(self%loads)) call prepare_loads(self)
      call draw_sample(self, sample, error)
      if (allocated(error)) return
      call choose_step(self, sample, error)
      if (allocated(error)) return
      call self%body_forces%configure(self%settings%forces)
      call find_median(self%comm, self%bodies%diameter(self%bodies%free), median_diameter)
      if (median_diameter >= huge(1.0_wp)) call find_median(self%comm, sample%diameter, median_diameter)
      call new_domain(self%domain, settings%decomposition, median_diameter, self%comm, self%bodies%cell)
      if (.not. allocated(error)) call rebuild_local_data(self, error, median_diameter)
      if (.not. allocated(error)) call check_constraint(self, error)
      call self%comm%all_reduce_error(error)
      if (allocated(error)) return
      call limit_displacement(self%settings%guards, self%bodies, self%comm, self%motion_check)
      call self%integrator%start(self%bodies)
      if (settings%scene%remove_overlap > 0.0_wp) call relax_bodies(self, error)
      if (allocated(error)) return
      call continue_stages(self, error)
      call move_walls(self, 0.0_wp)
      call update_boxes(self%maker, self%bodies, self%moving, self%boxes)
      if (.not. allocated(error)) call check_traffic(self, error)
      call redistribute(self, .false., error)
      call self%comm%all_reduce_error(error)
   end subroutine place_bodies

   !> The second part of `start_with_bodies`. If contact history was received, the forces follow from it. Collective;
   !> all ranks get the same error.
   subroutine start_forces(self, error)
      !> The simulation after `place_bodies`
      type(simulation_t), intent(inout) :: self
      !> Allocated if a contact stops the run
      type(error_t), allocatable, intent(inout) :: error

      call compute_forces(self, error)
      call self%comm%all_reduce_error(error)
      if (allocated(error)) return
      call start_integration(self)
      if (allocated(self%loads)) call yield_walls(self, 0.0_wp)
      if (self%settings%output%series_interval > 0.0_wp) &
         call self%record%start(self%named, self%bodies, self%loop%walls)
      if (self%settings%output%energy_balance) call start_energy_balance( &
         self%energy_balance, self%comm, self%settings%forces%gravity, self%bodies, self%force_sums, self%loop%walls)
      if (allocated(self%traffic)) call expect_changes(self%energy_balance)
      self%timers = timers_t()
   end subroutine start_forces

   !> Choose the forces that are no contacts: those of any stage, with the parameters of the strongest.
   subroutine choose_all_fields(self)
      type(simulation_t), intent(inout) :: self
      type(forces_settings_t) :: forces
      integer :: k

      forces = self%settings%forces
      do k = 1, size(self%settings%stage)
         forces%drag = max(forces%drag, self%stages%drag + self%settings%stage(k)%drag)
      end do
      call choose_body_forces(forces, self%body_forces)
   end subroutine choose_all_fields

   !> Set the masses of walls that yield. Collective.
   subroutine prepare_loads(self)
      type(simulation_t), intent(inout) :: self
      real(wp) :: total

      call self%named%find_slots(self%bodies)
      call sum_exactly(self%comm, self%bodies%mass(self%bodies%free), total)
      call set_masses(self%loads, self%named, self%bodies, total, self%settings%forces%stiffness)
   end subroutine prepare_loads

   !> Set the accelerations at time 0: from all forces, or from all but those of contacts, depending on the scheme.
   subroutine start_integration(self)
      type(simulation_t), intent(inout) :: self
      integer :: c

      call self%integrator%start_accelerations(self%settings%forces%gravity, self%bodies)
      if (.not. self%integrator%starts_from_forces) call accelerate_by_fields(self%force_sums, self%bodies)
      call self%integrator%start(self%bodies)
      ! A scheme that ignores the forces at time 0 has no contact history before its first step.
      if (self%integrator%starts_from_forces .or. .not. allocated(self%history%column)) return
      do c = 1, size(self%history%column)
         if (self%history%column(c)%kind%zero_is_new) self%history%column(c)%value = 0.0_wp
      end do
   end subroutine start_integration

end module polydem_start_simulation
