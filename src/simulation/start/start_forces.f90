!> Forces and accelerations at time 0.
module polydem_start_forces
   use polydem_bodies, only: bodies_t
   use polydem_contact_history, only: contact_history_t
   use polydem_energy_balance, only: start_energy_balance
   use polydem_errors, only: error_t
   use polydem_field_sums, only: accelerate_by_fields
   use polydem_force_sums, only: force_sums_t
   use polydem_integrator, only: integrator_t
   use polydem_kinds, only: wp
   use polydem_participants, only: follow_forces, start_participants
   use polydem_simulation, only: simulation_t
   use polydem_time_step, only: compute_forces
   use polydem_timers, only: timers_t
   implicit none
   private
   public :: start_forces

contains

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
      call start_integration(self%forces%gravity, self%loop%force_sums, self%bodies, self%motion%integrator, &
                             self%history)
      call follow_forces(self, 0.0_wp)
      if (self%settings%output%energy_balance) call start_energy_balance( &
         self%energy_balance, self%comm, self%forces%gravity, self%bodies, self%loop%force_sums, &
         self%loop%walls)
      call start_participants(self)
      self%timers = timers_t()
   end subroutine start_forces

   !> Set the accelerations at time 0: from all forces, or from all but those of contacts, depending on the scheme.
   subroutine start_integration(gravity, sums, bodies, integrator, history)
      !> Acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      type(force_sums_t), intent(in) :: sums
      type(bodies_t), intent(inout) :: bodies
      class(integrator_t), intent(inout) :: integrator
      type(contact_history_t), intent(inout) :: history
      integer :: c

      call integrator%start_accelerations(gravity, bodies)
      if (.not. integrator%starts_from_forces) call accelerate_by_fields(sums, bodies)
      call integrator%start(bodies)
      ! A scheme that ignores the forces at time 0 has no contact history before its first step.
      if (integrator%starts_from_forces .or. .not. allocated(history%column)) return
      do c = 1, size(history%column)
         if (history%column(c)%kind%zero_is_new) history%column(c)%value = 0.0_wp
      end do
   end subroutine start_integration

end module polydem_start_forces
