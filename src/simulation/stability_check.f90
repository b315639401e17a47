!> Comparison of the time step with the stable time step of the present contacts.
module polydem_stability_check
   use polydem_errors, only: error_t
   use polydem_guards, only: check_step
   use polydem_kinds, only: ip, wp
   use polydem_simulation, only: simulation_t
   use polydem_stable_step, only: contact_numbers, stable_step_of_contacts
   use polydem_whole_run, only: reduce_to_least
   implicit none
   private
   public :: check_stability, find_stable_step

contains

   !> Compare the time step with the stable time step of the present contacts. The rank that has the critical contact
   !> warns or fails. Collective.
   subroutine check_stability(self, stable, warning, error)
      type(simulation_t), intent(inout) :: self
      !> Stable time step of the present contacts [s], huge if there are none
      real(wp), intent(out) :: stable
      !> Allocated if dt is large, or if it is unstable and `step` of &guards is not 'stop'
      character(len=:), allocatable, intent(out) :: warning
      !> Allocated if dt is unstable and `step` of &guards is 'stop'
      type(error_t), allocatable, intent(inout) :: error
      type(error_t), allocatable :: failure
      integer(ip) :: critical

      call find_stable_step(self, stable, critical)
      call check_step(self%bodies, self%contacts, self%step, self%dt, stable, critical, warning, failure)
      if (.not. allocated(failure)) return
      if (self%settings%guards%step /= 'stop') then
         warning = failure%message
      else if (.not. allocated(error)) then
         call move_alloc(failure, error)
      end if
   end subroutine check_stability

   !> Find the stable time step of the present contacts. Collective.
   subroutine find_stable_step(self, stable, critical)
      type(simulation_t), intent(inout) :: self
      !> Stable time step of the contacts of all ranks [s], huge if there are none
      real(wp), intent(out) :: stable
      !> Index of the contact that limits it; 0 if this rank does not have it
      integer(ip), intent(out) :: critical
      real(wp), allocatable :: numbers(:)
      real(wp) :: least(1)

      numbers = contact_numbers(self%bodies%n, self%walk%incidence)
      call self%domain%halo%exchange_column(self%comm, numbers)
      call stable_step_of_contacts(self%law, self%integrator%stability(), self%bodies, numbers, self%contacts, &
                                   stable, critical)
      least = stable
      call reduce_to_least(self%comm, least)
      if (stable > least(1)) critical = 0_ip
      stable = least(1)
   end subroutine find_stable_step

end module polydem_stability_check
