!> The state of the energy balance in checkpoints and messages between ranks.
module polydem_balance_state
   use polydem_energy_balance, only: allocate_channels, energy_balance_t
   use polydem_kinds, only: ip
   use polydem_serializer, only: serializer_t
   implicit none
   private
   public :: serialize_balance, serialize_contributions

contains

   !> Serialize the values of the whole run.
   subroutine serialize_balance(sums, serializer)
      !> Running sums
      type(energy_balance_t), intent(inout) :: sums
      class(serializer_t), intent(inout) :: serializer

      call serializer%field('/run/energy_balance_start', sums%start, 'J/m, N s/m, N s', &
                        'energy, momentum and angular momentum at the start')
      call serializer%field('/run/energy_balance_steps', sums%steps, '1', 'number of accumulated steps')
      call serializer%field('/run/elastic_start', sums%elastic_start, 'J/m', 'elastic energy at the start')
      call serializer%field('/run/energy_scale', sums%energy_scale, 'J/m', 'largest kinetic energy or work so far')
      call serializer%field('/run/momentum_scale', sums%momentum_scale, 'N s/m, N s', &
                        'largest sums over bodies of absolute momenta and angular momenta so far')
      if (.not. allocated(sums%departed)) return
      call serializer%field('/run/departed_totals', sums%departed, '1', 'totals of the bodies that have left')
      call serializer%field('/run/carried_impulse', sums%carried, 'N s/m', &
                        'impulse of gravity on them, less what bodies that entered have not felt, and its scale')
      call serializer%field('/run/former_gravity', sums%former_gravity, 'm/s2', &
                        'gravity before its last change, and number of accumulated steps then')
      call serializer%field('/run/exchanged_energy', sums%exchanged, 'J/m', &
                        'energy that bodies brought when they entered, and that others took when they left')
   end subroutine serialize_balance

   !> Serialize the channels of the bodies. When reading, the bodies may differ from those before.
   subroutine serialize_contributions(sums, n_bodies, serializer)
      !> Running sums
      type(energy_balance_t), intent(inout) :: sums
      !> Number of bodies
      integer(ip), intent(in) :: n_bodies
      class(serializer_t), intent(inout) :: serializer

      if (serializer%is_reading) sums%is_current = .false.
      if (serializer%is_reading .or. .not. allocated(sums%power_sum)) call allocate_channels(sums, n_bodies)
      call serializer%field('/bodies/power_sum', sums%power_sum, 'W/m', &
                        'sums over steps of the powers of elastic, damping and tangential forces')
      call serializer%field('/bodies/torque_sum', sums%torque, 'N', 'sum over steps of the torque of gravity')
      call serializer%field('/bodies/wall_sum', sums%wall_sum, 'W/m, N/m, N/m, N, N/m, N', &
                        'sums over steps for fixed bodies: power, force, torque, absolute forces and torques')
   end subroutine serialize_contributions

end module polydem_balance_state
