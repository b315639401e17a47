!> Energy of walls in the balance: of those that are load-controlled, and of those that are removed; and work of a
!> stress-controlled cell.
module polydem_wall_energy
   use polydem_energy_balance, only: balance_t, energy_balance_t
   use polydem_kinds, only: wp
   implicit none
   private
   public :: add_cell, add_loads, release_energy

contains

   !> Add the work of a stress-controlled cell to the balance. The channels of the bodies have the powers of their own
   !> velocities; here is what the motion of the cell adds. The cell does the opposite work, as walls do.
   pure subroutine add_cell(sums, works, energy_is_known, balance)
      !> Running sums; the energy scale may grow
      type(energy_balance_t), intent(inout) :: sums
      !> Work of the elastic, the other normal and the tangential forces on the motion of the cell, (3) [J/m]
      real(wp), intent(in) :: works(3)
      !> Whether the elastic work of the balance is the difference of an energy, which has it already
      logical, intent(in) :: energy_is_known
      !> Terms and residuals of the bodies
      type(balance_t), intent(inout) :: balance

      if (.not. energy_is_known) balance%elastic_work = balance%elastic_work + works(1)
      balance%damping_work = balance%damping_work + works(2)
      balance%friction_work = balance%friction_work + works(3)
      balance%wall_work = balance%wall_work - sum(works)
      if (energy_is_known) balance%energy_residual = balance%energy_residual + works(1)
      sums%energy_scale = max(sums%energy_scale, abs(balance%wall_work), maxval(abs(works)))
      call set_relative(sums, balance)
   end subroutine add_cell

   !> Set the residual of energy relative to the scale.
   pure subroutine set_relative(sums, balance)
      type(energy_balance_t), intent(in) :: sums
      type(balance_t), intent(inout) :: balance

      balance%relative_energy_residual = 0.0_wp
      if (sums%energy_scale > 0.0_wp) balance%relative_energy_residual = abs(balance%energy_residual)/sums%energy_scale
   end subroutine set_relative

   !> Add the loads on walls to the balance. The work of a load-controlled wall is that of its load and its damping,
   !> less its kinetic energy; the residual gets what is missing.
   pure subroutine add_loads(sums, energies, balance)
      !> Running sums; the energy scale may grow
      type(energy_balance_t), intent(inout) :: sums
      !> Work of the loads, of the damping and of the contacts on the walls, and kinetic energy of the walls, (4) [J/m]
      real(wp), intent(in) :: energies(4)
      !> Terms and residuals of the bodies
      type(balance_t), intent(inout) :: balance

      balance%has_loads = .true.
      balance%load_work = energies(1)
      balance%load_damping_work = energies(2)
      balance%wall_kinetic = energies(4)
      sums%energy_scale = max(sums%energy_scale, maxval(abs(energies)))
      balance%energy_residual = balance%energy_residual + (energies(4) - (energies(1) + energies(2) + energies(3)))
      call set_relative(sums, balance)
   end subroutine add_loads

   !> Take elastic energy that leaves together with a wall from the energy at the start.
   pure subroutine release_energy(sums, energy)
      !> Running sums
      type(energy_balance_t), intent(inout) :: sums
      !> The energy [J/m]
      real(wp), intent(in) :: energy

      sums%elastic_start = sums%elastic_start - energy
   end subroutine release_energy

end module polydem_wall_energy
