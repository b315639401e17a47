!> Guard against unexplained energy gain, the sign of too large a time step or of deep overlaps that are released.
!>
!> The sum of kinetic energy, gravitational potential energy and energy dissipated by damping and friction may increase
!> only by the work of the walls and by the elastic energy that the contacts stored at the start of the energy balance,
!> as `energy_of_contact` has it, with that of cohesion. Any further increase is unexplained. It is compared with the
!> energy turned over. A non-conservative force law, such as the area law, contributes a few per cent of the work of a
!> contact, with either sign.
module polydem_energy_guard
   use polydem_bodies, only: bodies_t
   use polydem_communicator, only: communicator_t
   use polydem_contacts, only: contacts_t
   use polydem_energy_balance, only: balance_t
   use polydem_errors, only: error_t
   use polydem_force_sums, only: energy_of_contact
   use polydem_global_reductions, only: sum_exactly
   use polydem_guard, only: shorter_step
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_ownership, only: owns_pair
   use polydem_settings, only: settings_t
   use polydem_simulation, only: guard_t, simulation_t, compute_balance
   use polydem_strings, only: to_text
   implicit none
   private
   public :: energy_guard_t, find_stored_energy

   !> Guard of the energy
   type, extends(guard_t) :: energy_guard_t
      !> Elastic energy of the contacts at the start [J/m]
      real(wp) :: stored = 0.0_wp
   contains
      procedure :: configure
      procedure :: start
      procedure :: look
   end type energy_guard_t

contains

   !> Set what the guard says of itself.
   subroutine configure(self, settings)
      class(energy_guard_t), intent(inout) :: self
      type(settings_t), intent(in) :: settings

      self%noun = 'check'
      self%finding = 'that found an unexplained energy gain'
      self%choice = settings%guards%energy
      self%is_global = .true.
   end subroutine configure

   !> Record the elastic energy of the contacts.
   subroutine start(self, simulation)
      class(energy_guard_t), intent(inout) :: self
      type(simulation_t), intent(inout) :: simulation

      if (self%is_on) call find_stored_energy(simulation%comm, simulation%bodies, simulation%contacts, self%stored)
   end subroutine start

   !> Find the elastic energy of the contacts of all ranks, with that of cohesion. Collective.
   subroutine find_stored_energy(comm, bodies, contacts, stored)
      class(communicator_t), intent(inout) :: comm
      type(bodies_t), intent(in) :: bodies
      !> Contacts with their forces
      type(contacts_t), intent(in) :: contacts
      !> Elastic energy [J/m]
      real(wp), intent(out) :: stored
      real(wp), allocatable :: terms(:)
      integer(ip) :: c

      allocate (terms(contacts%n), source=0.0_wp)
      do c = 1_ip, contacts%n
         if (owns_pair(bodies, contacts%row(c)%first, contacts%row(c)%second)) &
            terms(c) = energy_of_contact(contacts, c)
      end do
      call sum_exactly(comm, terms, stored)
   end subroutine find_stored_energy

   !> Warn or stop if the unexplained energy gain exceeds its limit. Collective; the result is the same on all ranks.
   subroutine look(self, simulation, error)
      class(energy_guard_t), intent(inout) :: self
      type(simulation_t), intent(inout) :: simulation
      type(error_t), allocatable, intent(inout) :: error
      type(balance_t) :: balance
      real(wp) :: growth, scale
      real(dp) :: position(2)
      integer(lp) :: id

      if (.not. self%is_check) return
      call compute_balance(simulation, balance)
      growth = balance%energy_residual + balance%elastic_work - self%stored &
         + max(0.0_wp, balance%damping_work) + max(0.0_wp, balance%friction_work)
      scale = max(simulation%energy_balance%energy_scale, self%stored)
      associate (settings => simulation%settings%guards)
         if (growth <= settings%energy_limit*scale) return
         call find_fastest(simulation%comm, simulation%bodies, id, position)
         call self%warning%respond(self%choice, 'step '//to_text(simulation%step)//': unexplained energy '// &
                                    'gain of '//to_text(growth, 3)//' J/m, '//to_text(growth/scale, 3)// &
                                    ' of the largest kinetic energy or work so far; fastest body '//to_text(id)// &
                                    ' at ('//to_text(real(position(1), wp))//', '//to_text(real(position(2), wp))// &
                                    ') m. Check for deep overlaps, or '// &
                                    shorter_step(simulation%settings%integrate), error)
      end associate
   end subroutine look

   !> Find the free body with the greatest kinetic energy. A tie goes to the lowest identifier. Collective.
   subroutine find_fastest(comm, bodies, id, position)
      class(communicator_t), intent(inout) :: comm
      type(bodies_t), intent(in) :: bodies
      !> Identifier of the body
      integer(lp), intent(out) :: id
      !> Position of the body [m]
      real(dp), intent(out) :: position(2)
      real(dp) :: energy, own, greatest(1)
      integer(lp) :: lowest(1)
      integer(ip) :: fastest, k, s

      ! If all energies are NaN, the first body is the result. A rank without bodies never supplies it.
      fastest = 0_ip
      own = -2.0_dp
      if (size(bodies%free) > 0) then
         fastest = bodies%free(1)
         own = -1.0_dp
      end if
      do k = 1_ip, size(bodies%free, kind=ip)
         s = bodies%free(k)
         energy = real(bodies%mass(s)*(bodies%velocity(1, s)**2 + bodies%velocity(2, s)**2) &
                       + bodies%inertia(s)*bodies%angular_velocity(s)**2, dp)
         if (.not. energy > own) cycle
         own = energy
         fastest = s
      end do
      greatest = own
      call comm%all_reduce_max(greatest)
      lowest = -huge(0_lp)
      if (fastest > 0_ip .and. own >= greatest(1)) lowest = -int(bodies%id(fastest), lp)
      call comm%all_reduce_max(lowest)
      id = -lowest(1)
      position = -huge(1.0_dp)
      if (fastest > 0_ip) then
         if (int(bodies%id(fastest), lp) == id) position = real(bodies%position(:, fastest), dp)
      end if
      call comm%all_reduce_max(position)
   end subroutine find_fastest

end module polydem_energy_guard
