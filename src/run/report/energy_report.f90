!> The energy and momentum balance of a simulation as lines of the log.
module polydem_energy_report
   use polydem_energy_balance, only: balance_t
   use polydem_kinds, only: wp
   use polydem_log, only: log_t
   use polydem_simulation, only: simulation_t, compute_balance
   use polydem_strings, only: to_text
   implicit none
   private
   public :: write_energy_report

   !> Unexplained energy above which there is a warning, as a fraction of the largest kinetic energy or work so far
   real(wp), parameter :: suspicious = 0.01_wp

contains

   !> Write the work of each channel and the residuals of the energy and momentum balance, and a warning if much energy
   !> is unexplained; collective. The guard `energy` warns of a gain while the run goes on; this is its end.
   subroutine write_energy_report(simulation, log)
      type(simulation_t), intent(inout) :: simulation
      type(log_t), intent(inout) :: log
      type(balance_t) :: balance
      character(len=:), allocatable :: angular

      call compute_balance(simulation, balance)
      call log%write_line('')
      call log%write_line('work [J/m]: elastic '//to_text(balance%elastic_work, 4)//', damping '// &
                          to_text(balance%damping_work, 4)//', friction '//to_text(balance%friction_work, 4)// &
                          ', walls '//to_text(balance%wall_work, 4))
      if (balance%has_loads) call log%write_line('            loads '//to_text(balance%load_work, 4)// &
         ', damping of their walls '//to_text(balance%load_damping_work, 4))
      angular = ''
      if (.not. simulation%bodies%cell%is_periodic) &
         angular = ', angular momentum '//to_text(balance%relative_angular_residual, 2)
      call log%write_line('residuals: energy '//to_text(balance%relative_energy_residual, 2)// &
                          ' of the largest kinetic energy or work so far, momentum '// &
                          to_text(balance%relative_momentum_residual, 2)//angular)
      if (balance%relative_energy_residual > suspicious) call log%write_line( &
         'warning: the energy balance leaves '//to_text(balance%energy_residual, 3)//' J/m unexplained, '// &
         to_text(balance%relative_energy_residual, 3)//' of the largest kinetic energy or work so far. Reduce dt '// &
         'until this residual is small')
   end subroutine write_energy_report

end module polydem_energy_report
