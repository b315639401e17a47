!> Participant that slows all free bodies down at the end of each step: their velocities fall like exp(-t/T), T = 1 s.
module polydem_brake
   use polydem_energy_balance, only: balance_t
   use polydem_exact_all_reduce, only: all_reduce_exact_sums
   use polydem_exact_sum, only: exact_sum_t
   use polydem_kinds, only: ip, wp
   use polydem_serializer, only: serializer_t
   use polydem_simulation, only: participant_t, simulation_t
   implicit none
   private
   public :: brake_t

   !> A brake
   type, extends(participant_t) :: brake_t
      !> Kinetic energy that it has taken [J/m]
      real(wp) :: taken = 0.0_wp
   contains
      procedure :: end_step
      procedure :: serialize
      procedure :: add_energies
   end type brake_t

contains

   !> Slow the bodies down, and sum what they lose over all ranks.
   subroutine end_step(self, simulation)
      class(brake_t), intent(inout) :: self
      type(simulation_t), intent(inout) :: simulation
      type(exact_sum_t) :: sums(1)
      real(wp) :: factor, energy
      integer(ip) :: k

      factor = 1.0_wp - simulation%dt
      associate (bodies => simulation%bodies)
         do k = 1_ip, size(bodies%free, kind=ip)
            associate (s => bodies%free(k))
               energy = 0.5_wp*bodies%mass(s)*sum(bodies%velocity(:, s)**2) &
                        + 0.5_wp*bodies%inertia(s)*bodies%angular_velocity(s)**2
               call sums(1)%add((1.0_wp - factor**2)*energy)
               bodies%velocity(:, s) = factor*bodies%velocity(:, s)
               bodies%angular_velocity(s) = factor*bodies%angular_velocity(s)
            end associate
         end do
      end associate
      call all_reduce_exact_sums(simulation%comm, sums)
      self%taken = self%taken + sums(1)%value()
   end subroutine end_step

   !> Serialize the energy.
   subroutine serialize(self, simulation, serializer)
      class(brake_t), intent(inout) :: self
      type(simulation_t), intent(inout) :: simulation
      class(serializer_t), intent(inout) :: serializer

      associate (unused => simulation)
      end associate
      call serializer%field('/run/brake', self%taken, 'J/m', 'energy that the brake has taken')
   end subroutine serialize

   !> Add the energy to the work of damping.
   subroutine add_energies(self, simulation, balance)
      class(brake_t), intent(in) :: self
      type(simulation_t), intent(inout) :: simulation
      type(balance_t), intent(inout) :: balance

      associate (unused => simulation)
      end associate
      balance%damping_work = balance%damping_work - self%taken
      balance%energy_residual = balance%energy_residual + self%taken
   end subroutine add_energies

end module polydem_brake
