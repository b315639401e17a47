!> Watches for energy that nobody gave: the sign of a step that is too large, or of deep overlaps set free.
!>
!> Kinetic energy, potential of gravity and the work done against damping and friction together may grow by the work of
!> the walls and by what contacts held when the books were opened, taken as half of force times depth. What they
!> grow beyond is measured against the energy turned over. A force law that is not conservative, as the area law,
!> adds to it, some per cent of the work of a contact in either direction.
module polydem_energy_guard
   use polydem_bodies, only: bodies_t
   use polydem_contacts, only: contacts_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_ledger, only: balance_t
   use polydem_simulation, only: simulation_t, take_stock
   use polydem_strings, only: to_text
   use polydem_team, only: team_t
   use polydem_warnings, only: warning_t
   implicit none
   private
   public :: energy_guard_t, open_energy_guard, check_energy, stored_energy

   !> What must be known to tell given from ungiven energy
   type :: energy_guard_t
      !> Elastic energy of the contacts at the start [J/m]
      real(wp) :: stored = 0.0_wp
      !> Warnings so far
      type(warning_t) :: warning
   end type energy_guard_t

contains

   !> Take down what the contacts hold; to be called when the ledger has been opened, where all bodies are.
   subroutine open_energy_guard(guard, contacts)
      !> The guard
      type(energy_guard_t), intent(out) :: guard
      !> Contacts at the start with their forces
      type(contacts_t), intent(in) :: contacts

      guard%stored = stored_energy(contacts)
   end subroutine open_energy_guard

   !> Elastic energy of contacts, taken as half of force times depth [J/m]
   pure real(wp) function stored_energy(contacts)
      !> Contacts with their forces
      type(contacts_t), intent(in) :: contacts
      integer(ip) :: c

      stored_energy = 0.0_wp
      do c = 1_ip, contacts%n
         stored_energy = stored_energy + 0.5_wp*contacts%elastic(c)*contacts%area(c)/contacts%length(c)
      end do
   end function stored_energy

   !> Compare the energy with what was given; collective, and all processes come to the same result.
   subroutine check_energy(guard, simulation, error)
      !> The guard
      type(energy_guard_t), intent(inout) :: guard
      !> Simulation at the end of a step; entries `energy` and `energy_limit` of &guards tell what to do and when
      type(simulation_t), intent(inout) :: simulation
      !> Names the fastest body if the run must stop
      type(error_t), allocatable, intent(inout) :: error
      type(balance_t) :: balance
      real(wp) :: growth, scale
      real(dp) :: position(2)
      integer(lp) :: id

      call take_stock(simulation, balance)
      growth = balance%energy_residual + balance%elastic_work - guard%stored &
         + max(0.0_wp, balance%damping_work) + max(0.0_wp, balance%friction_work)
      scale = max(simulation%ledger%energy_scale, guard%stored)
      associate (settings => simulation%settings%guards)
         if (growth <= settings%energy_limit*scale) return
         call find_fastest(simulation%team, simulation%bodies, id, position)
         call guard%warning%respond(settings%energy, 'step '//to_text(simulation%step)//': the energy is by '// &
                                    to_text(growth, 3)//' J/m, '//to_text(growth/scale, 3)//' of what was turned '// &
                                    'over, above what gravity and walls gave; the fastest body '//to_text(id)// &
                                    ' at ('//to_text(real(position(1), wp))//', '//to_text(real(position(2), wp))// &
                                    ') m. Take a smaller dt, or look for deep overlaps', error)
      end associate
   end subroutine check_energy

   !> Find the free body with the greatest kinetic energy; of several, that with the lowest identifier. Collective.
   subroutine find_fastest(team, bodies, id, position)
      class(team_t), intent(inout) :: team
      type(bodies_t), intent(in) :: bodies
      !> Identifier of the body
      integer(lp), intent(out) :: id
      !> Its position [m]
      real(dp), intent(out) :: position(2)
      real(dp) :: energy, own, greatest(1)
      integer(lp) :: lowest(1)
      integer(ip) :: fastest, k, s

      ! If all energies are not-a-numbers, it is the first body; a process without bodies never has it.
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
      call team%maximise(greatest)
      lowest = -huge(0_lp)
      if (fastest > 0_ip .and. own >= greatest(1)) lowest = -int(bodies%id(fastest), lp)
      call team%maximise(lowest)
      id = -lowest(1)
      position = -huge(1.0_dp)
      if (fastest > 0_ip) then
         if (int(bodies%id(fastest), lp) == id) position = real(bodies%position(:, fastest), dp)
      end if
      call team%maximise(position)
   end subroutine find_fastest

end module polydem_energy_guard
