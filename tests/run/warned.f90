!> What a run says at its start, for the tests of warnings.
module warned
   use polydem_errors, only: error_t
   use polydem_file_system, only: make_folder
   use polydem_initial_warnings, only: warn_of_risks
   use polydem_kinds, only: lp
   use polydem_log, only: log_t
   use polydem_scene_measures, only: measure_scene, scene_measures_t
   use polydem_simulation, only: simulation_t
   implicit none
   private
   public :: warnings_about

contains

   !> All warnings of a simulation at time 0, one per line; behind them a note if their number is wrong
   function warnings_about(simulation) result(warnings)
      !> The simulation
      type(simulation_t), intent(inout) :: simulation
      character(len=:), allocatable :: warnings
      type(scene_measures_t) :: measures
      type(log_t) :: log
      type(error_t), allocatable :: error
      integer(lp) :: n, n_lines
      character(len=1000) :: line
      integer :: unit, status

      call make_folder('initial_warnings', error)
      call log%open('initial_warnings', error, quiet=.true.)
      call measure_scene(simulation, measures)
      call warn_of_risks(simulation, measures, log, n)
      call log%close(error)
      warnings = ''
      n_lines = 0_lp
      open (newunit=unit, file='initial_warnings/log.txt', action='read', status='old')
      do
         read (unit, '(a)', iostat=status) line
         if (status /= 0) exit
         n_lines = n_lines + 1_lp
         warnings = warnings//trim(line)//new_line('a')
      end do
      close (unit)
      if (n /= n_lines) warnings = warnings//'the number of warnings is wrong'
   end function warnings_about

end module warned
