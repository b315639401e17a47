!> The ledger of a simulation as rows for the trajectory and lines for the log.
module polydem_books
   use polydem_kinds, only: wp
   use polydem_ledger, only: balance_of, balance_t
   use polydem_ledger_row, only: ledger_row_t
   use polydem_log, only: log_t
   use polydem_simulation, only: simulation_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: fill_row, write_books

contains

   !> Compare bodies and books, and put everything into a row.
   subroutine fill_row(simulation, balance, row)
      !> The simulation
      type(simulation_t), intent(inout) :: simulation
      !> Energy and momentum now
      type(balance_t), intent(out) :: balance
      !> Row of the ledger
      type(ledger_row_t), intent(inout) :: row

      call balance_of(simulation%ledger, simulation%settings%forces%gravity, simulation%bodies, balance)
      call row%set('kinetic', balance%kinetic, 'J/m', 'kinetic energy of the free bodies')
      call row%set('potential', balance%potential, 'J/m', 'potential of gravity, zero at the origin')
      associate (ledger => simulation%ledger)
         call row%set('elastic_work', ledger%elastic_work, 'J/m', 'work of the elastic normal forces')
         call row%set('damping_work', ledger%damping_work, 'J/m', 'work of the normal damping')
         call row%set('friction_work', ledger%friction_work, 'J/m', 'work of the tangential forces')
         call row%set('wall_work', ledger%wall_work, 'J/m', 'work done by moving walls')
         call row%set('impulse_x', ledger%impulse(1), 'N s/m', 'impulse of gravity and fixed bodies along x')
         call row%set('impulse_y', ledger%impulse(2), 'N s/m', 'impulse of gravity and fixed bodies along y')
         call row%set('angular_impulse', ledger%angular_impulse, 'N s', 'their angular impulse about the origin')
      end associate
      call row%set('momentum_x', balance%momentum(1), 'N s/m', 'momentum of the free bodies along x')
      call row%set('momentum_y', balance%momentum(2), 'N s/m', 'momentum of the free bodies along y')
      call row%set('angular_momentum', balance%angular_momentum, 'N s', 'their angular momentum about the origin')
      call row%set('energy_residual', balance%energy_residual, 'J/m', 'energy that the books cannot explain')
   end subroutine fill_row

   !> Write where the energy went and how well the books close.
   subroutine write_books(simulation, log)
      !> The simulation
      type(simulation_t), intent(inout) :: simulation
      !> Log
      type(log_t), intent(inout) :: log
      type(balance_t) :: balance

      call balance_of(simulation%ledger, simulation%settings%forces%gravity, simulation%bodies, balance)
      call log%write_line('')
      associate (ledger => simulation%ledger)
         call log%write_line('work [J/m]: elastic '//to_text(ledger%elastic_work, 4)//', damping '// &
                             to_text(ledger%damping_work, 4)//', friction '//to_text(ledger%friction_work, 4)// &
                             ', walls '//to_text(ledger%wall_work, 4))
      end associate
      call log%write_line('residuals: energy '//percent(balance%relative_energy_residual)//', momentum '// &
                          to_text(balance%relative_momentum_residual, 2)//', angular momentum '// &
                          to_text(balance%relative_angular_residual, 2))
   end subroutine write_books

   !> A share of the energy turned over as text
   function percent(share) result(text)
      real(wp), intent(in) :: share
      character(len=:), allocatable :: text

      text = to_text(share, 2)//' of the energy turned over'
   end function percent

end module polydem_books
