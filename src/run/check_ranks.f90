!> Settings that the force law or several ranks do not support.
module polydem_check_ranks
   use polydem_communicator, only: communicator_t
   use polydem_errors, only: error_t, input_error, raise
   use polydem_law_factory, only: check_law
   use polydem_kinds, only: ip
   use polydem_source_locations, only: place_of
   use polydem_settings, only: settings_t
   implicit none
   private
   public :: check_ranks

contains

   !> Refuse settings that the force law does not support, and those that only a serial run supports.
   subroutine check_ranks(settings, comm, error)
      type(settings_t), intent(in) :: settings
      class(communicator_t), intent(in) :: comm
      !> Names the entry; the same on all ranks
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: key

      call check_law(settings, comm%size, error)
      if (comm%size == 1_ip) return
      key = ''
      if (settings%output%step_profile) key = 'step_profile'
      if (settings%output%trace_steps > 0_ip) key = 'trace_steps'
      if (key /= '') call raise(error, input_error, &
         place_of(settings, 'output', key)//': '''//key//''' in &output needs a single rank; run without mpirun')
   end subroutine check_ranks

end module polydem_check_ranks
