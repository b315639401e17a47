!> The ledger of a simulation as rows for the trajectory and lines for the log.
module polydem_books
   use polydem_kinds, only: ip, lp, wp
   use polydem_ledger, only: balance_t
   use polydem_ledger_row, only: ledger_row_t
   use polydem_log, only: log_t
   use polydem_own_rows, only: owns_pair
   use polydem_simulation, only: simulation_t, take_stock
   use polydem_strings, only: to_text
   implicit none
   private
   public :: fill_row, write_books, count_contacts

contains

   !> Compare bodies and books, and put everything into a row; collective.
   subroutine fill_row(simulation, balance, row)
      !> The simulation
      type(simulation_t), intent(inout) :: simulation
      !> Energy and momentum now
      type(balance_t), intent(out) :: balance
      !> Row of the ledger
      type(ledger_row_t), intent(inout) :: row

      call take_stock(simulation, balance)
      call row%set('kinetic', balance%kinetic, 'J/m', 'kinetic energy of the free bodies')
      call row%set('potential', balance%potential, 'J/m', 'potential of gravity, zero at the origin')
      call row%set('elastic_work', balance%elastic_work, 'J/m', 'work of the elastic normal forces')
      call row%set('damping_work', balance%damping_work, 'J/m', 'work of the normal damping')
      call row%set('friction_work', balance%friction_work, 'J/m', 'work of the tangential forces')
      call row%set('wall_work', balance%wall_work, 'J/m', 'work done by moving walls')
      call row%set('impulse_x', balance%impulse(1), 'N s/m', 'impulse of gravity and fixed bodies along x')
      call row%set('impulse_y', balance%impulse(2), 'N s/m', 'impulse of gravity and fixed bodies along y')
      call row%set('angular_impulse', balance%angular_impulse, 'N s', 'their angular impulse about the origin')
      call row%set('momentum_x', balance%momentum(1), 'N s/m', 'momentum of the free bodies along x')
      call row%set('momentum_y', balance%momentum(2), 'N s/m', 'momentum of the free bodies along y')
      call row%set('angular_momentum', balance%angular_momentum, 'N s', 'their angular momentum about the origin')
      call row%set('energy_residual', balance%energy_residual, 'J/m', 'energy that the books cannot explain')
   end subroutine fill_row

   !> Write where the energy went and how well the books close; collective.
   subroutine write_books(simulation, log)
      !> The simulation
      type(simulation_t), intent(inout) :: simulation
      !> Log
      type(log_t), intent(inout) :: log
      type(balance_t) :: balance

      call take_stock(simulation, balance)
      call log%write_line('')
      call log%write_line('work [J/m]: elastic '//to_text(balance%elastic_work, 4)//', damping '// &
                          to_text(balance%damping_work, 4)//', friction '//to_text(balance%friction_work, 4)// &
                          ', walls '//to_text(balance%wall_work, 4))
      call log%write_line('residuals: energy '//percent(balance%relative_energy_residual)//', momentum '// &
                          to_text(balance%relative_momentum_residual, 2)//', angular momentum '// &
                          to_text(balance%relative_angular_residual, 2))
   end subroutine write_books

   !> Number of contacts of all processes; collective.
   subroutine count_contacts(simulation, n)
      !> The simulation
      type(simulation_t), intent(inout) :: simulation
      !> Their number
      integer(ip), intent(out) :: n
      integer(lp) :: counts(1)
      integer(ip) :: c

      counts = 0_lp
      associate (contacts => simulation%contacts)
         do c = 1_ip, contacts%n
            if (owns_pair(simulation%bodies, contacts%first(c), contacts%second(c))) counts = counts + 1_lp
         end do
      end associate
      call simulation%team%add_up(counts)
      n = int(counts(1), ip)
   end subroutine count_contacts

   !> A share of the energy turned over as text
   function percent(share) result(text)
      real(wp), intent(in) :: share
      character(len=:), allocatable :: text

      text = to_text(share, 2)//' of the energy turned over'
   end function percent

end module polydem_books
