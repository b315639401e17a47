!> Factory of integration schemes: the only module that uses all of them.
module polydem_integrator_factory
   use polydem_compensated_verlet, only: compensated_verlet_t
   use polydem_gear, only: for_positions, gear_t
   use polydem_integrator, only: integrator_t
   use polydem_settings, only: integrate_settings_t
   use polydem_velocity_verlet, only: velocity_verlet_t
   implicit none
   private
   public :: new_integrator

contains

   !> Make the integration scheme of the settings. Names are valid: the reader of the namelist has checked them.
   subroutine new_integrator(settings, integrator)
      type(integrate_settings_t), intent(in) :: settings
      class(integrator_t), allocatable, intent(out) :: integrator

      select case (settings%scheme)
      case ('gear')
         allocate (gear_t :: integrator)
         integrator%starts_from_forces = .false.
      case ('gear_3_20')
         allocate (integrator, source=gear_t(starts_from_forces=.false., c0=for_positions))
      case default
         if (settings%accumulation == 'compensated') then
            allocate (compensated_verlet_t :: integrator)
         else
            allocate (velocity_verlet_t :: integrator)
            integrator%coasts_exactly = .true.
         end if
      end select
   end subroutine new_integrator

end module polydem_integrator_factory
