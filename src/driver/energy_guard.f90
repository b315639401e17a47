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
   use polydem_kinds, only: ip, lp, wp
   use polydem_ledger, only: balance_of, balance_t, ledger_t
   use polydem_strings, only: to_text
   use polydem_warnings, only: warning_t
   implicit none
   private
   public :: energy_guard_t, open_energy_guard, check_energy

   !> What must be known to tell given from ungiven energy
   type :: energy_guard_t
      !> Elastic energy of the contacts at the start [J/m]
      real(wp) :: stored = 0.0_wp
      !> Warnings so far
      type(warning_t) :: warning
   end type energy_guard_t

contains

   !> Take down what the contacts hold; to be called when the ledger has been opened.
   subroutine open_energy_guard(guard, contacts)
      !> The guard
      type(energy_guard_t), intent(out) :: guard
      !> Contacts at the start with their forces
      type(contacts_t), intent(in) :: contacts
      integer(ip) :: c

      do c = 1_ip, contacts%n
         guard%stored = guard%stored + 0.5_wp*contacts%elastic(c)*contacts%area(c)/contacts%length(c)
      end do
   end subroutine open_energy_guard

   !> Compare the energy with what was given.
   subroutine check_energy(guard, choice, limit, ledger, gravity, bodies, step, error)
      !> The guard
      type(energy_guard_t), intent(inout) :: guard
      !> Entry `energy` of &guards: 'stop' or 'warn'
      character(len=*), intent(in) :: choice
      !> Greatest growth as a share of the energy turned over
      real(wp), intent(in) :: limit
      !> Books
      type(ledger_t), intent(inout) :: ledger
      !> Acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      !> Bodies at the end of a step
      type(bodies_t), intent(in) :: bodies
      !> Number of the step
      integer(lp), intent(in) :: step
      !> Names the fastest body if the run must stop
      type(error_t), allocatable, intent(inout) :: error
      type(balance_t) :: balance
      real(wp) :: growth, scale
      integer(ip) :: s

      call balance_of(ledger, gravity, bodies, balance)
      growth = balance%energy_residual + ledger%elastic_work - guard%stored &
         + max(0.0_wp, ledger%damping_work) + max(0.0_wp, ledger%friction_work)
      scale = max(ledger%energy_scale, guard%stored)
      if (growth <= limit*scale) return
      s = fastest(bodies)
      call guard%warning%respond(choice, 'step '//to_text(step)//': the energy is by '//to_text(growth, 3)//' J/m, '// &
                                 to_text(growth/scale, 3)//' of what was turned over, above what gravity and walls '// &
                                 'gave; the fastest body '//to_text(bodies%id(s))//' at ('// &
                                 to_text(bodies%position(1, s))//', '//to_text(bodies%position(2, s))// &
                                 ') m. Take a smaller dt, or look for deep overlaps', error)
   end subroutine check_energy

   !> The free body with the greatest kinetic energy
   pure integer(ip) function fastest(bodies)
      type(bodies_t), intent(in) :: bodies
      real(wp) :: energy, greatest
      integer(ip) :: k, s

      fastest = 1_ip
      greatest = -1.0_wp
      do k = 1_ip, size(bodies%free, kind=ip)
         s = bodies%free(k)
         energy = bodies%mass(s)*(bodies%velocity(1, s)**2 + bodies%velocity(2, s)**2) &
            + bodies%inertia(s)*bodies%angular_velocity(s)**2
         if (energy > greatest) then
            greatest = energy
            fastest = s
         end if
      end do
   end function fastest

end module polydem_energy_guard
