!> Terms of the energy and momentum balance as named values, for the trajectory and the log.
module polydem_balance_values
   use polydem_energy_balance, only: balance_t
   use polydem_named_values, only: named_values_t
   implicit none
   private
   public :: name_terms

contains

   !> Set the terms of the balance as named values.
   subroutine name_terms(balance, with_angular, row)
      type(balance_t), intent(in) :: balance
      !> Whether angular momentum is among them: in a periodic cell it is not conserved, since copies of a contact have
      !> other arms
      logical, intent(in) :: with_angular
      !> Row of named values; those of the balance are set
      type(named_values_t), intent(inout) :: row

      call row%set('kinetic', balance%kinetic, 'J/m', 'kinetic energy of the free bodies')
      call row%set('potential', balance%potential, 'J/m', 'potential of gravity, zero at the origin')
      call row%set('elastic_work', balance%elastic_work, 'J/m', 'work of the elastic normal forces')
      call row%set('damping_work', balance%damping_work, 'J/m', 'work of the normal damping')
      call row%set('friction_work', balance%friction_work, 'J/m', 'work of the tangential forces')
      call row%set('wall_work', balance%wall_work, 'J/m', 'work done by moving walls and changing gravity')
      if (balance%has_loads) then
         call row%set('load_work', balance%load_work, 'J/m', 'work of loads on walls')
         call row%set('load_damping_work', balance%load_damping_work, 'J/m', 'work of the damping of these walls')
         call row%set('wall_kinetic', balance%wall_kinetic, 'J/m', 'kinetic energy of these walls')
      end if
      if (balance%bodies_change) then
         call row%set('entered_energy', balance%exchanged(1), 'J/m', 'energy that bodies brought when they entered')
         call row%set('departed_energy', balance%exchanged(2), 'J/m', 'energy that bodies took when they left')
      end if
      call row%set('impulse_x', balance%impulse(1), 'N s/m', 'impulse of gravity and fixed bodies along x')
      call row%set('impulse_y', balance%impulse(2), 'N s/m', 'impulse of gravity and fixed bodies along y')
      if (with_angular) &
         call row%set('angular_impulse', balance%angular_impulse, 'N s', 'their angular impulse about the origin')
      call row%set('momentum_x', balance%momentum(1), 'N s/m', 'momentum of the free bodies along x')
      call row%set('momentum_y', balance%momentum(2), 'N s/m', 'momentum of the free bodies along y')
      if (with_angular) &
         call row%set('angular_momentum', balance%angular_momentum, 'N s', 'their angular momentum about the origin')
      call row%set('energy_residual', balance%energy_residual, 'J/m', 'unexplained energy')
   end subroutine name_terms

end module polydem_balance_values
