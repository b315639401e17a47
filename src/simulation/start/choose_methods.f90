!> Makes what the settings name: the only module of this layer that uses the factories.
module polydem_choose_methods
   use polydem_body_forces, only: body_forces_t, choose_body_forces
   use polydem_changed_bodies, only: expect_changes
   use polydem_errors, only: error_t
   use polydem_guard_list, only: choose_guards
   use polydem_integrator_factory, only: new_integrator
   use polydem_kinds, only: ip
   use polydem_law_factory, only: choose_parts
   use polydem_new_neighbours, only: choose_finder
   use polydem_pair_parameters, only: pair_parameters
   use polydem_participants, only: choose_participants
   use polydem_settings, only: forces_settings_t, settings_t
   use polydem_simulation, only: simulation_t
   use polydem_new_sources_and_sinks, only: new_sources_and_sinks, start_sources_and_sinks
   implicit none
   private
   public :: choose_methods, allow_exchange

contains

   !> Choose what the settings name: force law, integrator, finder, forces on bodies, sources and sinks, participants,
   !> guards.
   subroutine choose_methods(self, error)
      !> The simulation with its settings, and with the parameters of its first stage
      type(simulation_t), intent(inout) :: self
      !> Allocated if there is no such finder, if a setting excludes a part of the law, or if outlines cannot be read
      type(error_t), allocatable, intent(inout) :: error

      associate (settings => self%settings)
         call choose_parts(self%forces, self%law, pair_parameters(settings, self%forces))
         call self%law%check(settings, 1_ip, error)
         if (allocated(error)) return
         call new_sources_and_sinks(settings, self%sources_and_sinks, error)
         if (allocated(error)) return
         call new_integrator(settings%integrate, self%motion%integrator)
         call choose_finder(self%search%neighbours, settings%neighbours%finder, error, settings%neighbours%skin, &
                            self%bodies%isa)
         call choose_all_fields(settings, self%forces, self%body_forces)
      end associate
      call choose_participants(self)
      call choose_guards(self%settings, self%guards)
   end subroutine choose_methods

   !> Choose the forces that are no contacts: those of any stage, with the parameters of the strongest.
   subroutine choose_all_fields(settings, forces, body_forces)
      type(settings_t), intent(in) :: settings
      !> Parameters of the forces in the first stage
      type(forces_settings_t), intent(in) :: forces
      type(body_forces_t), intent(out) :: body_forces
      type(forces_settings_t) :: strongest
      integer :: k

      strongest = forces
      do k = 1, size(settings%stage)
         strongest%drag = max(strongest%drag, settings%forces%drag + settings%stage(k)%drag)
      end do
      call choose_body_forces(strongest, body_forces)
   end subroutine choose_all_fields

   !> Let bodies enter and leave by actions, in a run without sources and sinks.
   subroutine allow_exchange(self)
      !> The simulation at time 0
      type(simulation_t), intent(inout) :: self

      if (allocated(self%sources_and_sinks)) return
      call start_sources_and_sinks(0, 0, self%sources_and_sinks)
      call expect_changes(self%energy_balance)
      call choose_participants(self)
   end subroutine allow_exchange

end module polydem_choose_methods
