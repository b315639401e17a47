!> Comparison of the time step with the stable time step of the present contacts.
module polydem_stability_check
   use polydem_errors, only: error_t
   use polydem_guards, only: check_step
   use polydem_kinds, only: dp, ip, wp
   use polydem_simulation, only: simulation_t
   use polydem_stable_step, only: contact_numbers, stable_step_of_contacts
   implicit none
   private
   public :: check_stability

contains

   !> Compare the time step with the stable time step of the present contacts. The rank that has the critical contact
   !> warns or fails. Collective.
   subroutine check_stability(self, stable, warning, error)
      !> The simulation
      type(simulation_t), intent(inout) :: self
      !> Stable time step of the present contacts [s], huge if there are none
      real(wp), intent(out) :: stable
      !> Allocated if dt is large, or if it is unstable and `step` of &guards is not 'stop'
      character(len=:), allocatable, intent(out) :: warning
      !> Allocated if dt is unstable and `step` of &guards is 'stop'
      type(error_t), allocatable, intent(inout) :: error
      type(error_t), allocatable :: failure
      real(wp), allocatable :: numbers(:)
      real(dp) :: least(1)
      integer(ip) :: critical

      numbers = contact_numbers(self%bodies%n, self%incidence)
      call self%domain%halo%exchange_column(self%comm, numbers)
      call stable_step_of_contacts(self%law, self%integrator%stability(), self%bodies, numbers, self%contacts, &
                                   stable, critical)
      least(1) = -real(stable, dp)
      call self%comm%all_reduce_max(least)
      if (stable > real(-least(1), wp)) critical = 0_ip
      if (self%comm%size > 1_ip) stable = real(-least(1), wp)
      call check_step(self%bodies, self%contacts, self%step, self%dt, stable, critical, warning, failure)
      if (.not. allocated(failure)) return
      if (self%settings%guards%step /= 'stop') then
         warning = failure%message
      else if (.not. allocated(error)) then
         call move_alloc(failure, error)
      end if
   end subroutine check_stability

end module polydem_stability_check
