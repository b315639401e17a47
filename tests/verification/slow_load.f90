!> Gravity that is raised slowly, so that a scene passes through its equilibria.
module slow_load
   use outlines, only: pi
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, wp
   use polydem_simulation, only: simulation_t
   use polydem_time_step, only: advance
   implicit none
   private
   public :: load_slowly, slow_integration

   !> Group &integrate for a slow load: the automatic step for bodies that meet at 1 cm/s; the energy balance is off
   character(len=*), parameter :: slow_integration = &
      ' &integrate duration = 1000 speed = 0.01 / &output energy_balance = .false. /'

contains

   !> Raise gravity from nothing to its value, hold it, and find how far a body has moved.
   subroutine load_slowly(simulation, gravity, rise, hold, body, limit, moved, error)
      !> Bodies that touch without depth
      type(simulation_t), intent(inout) :: simulation
      !> Acceleration of gravity at the end (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      !> Times for which gravity rises, and then stays [s]
      real(wp), intent(in) :: rise, hold
      !> Slot of the body
      integer(ip), intent(in) :: body
      !> Distance that ends the run [m]
      real(wp), intent(in) :: limit
      !> Distance that the body has moved [m]; huge after an error
      real(wp), intent(out) :: moved
      !> What went wrong
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: start(2)
      integer :: k, n

      moved = huge(moved)
      if (allocated(error)) return
      start = simulation%bodies%position(:, body)
      ! The first half step would give bodies the speed that the whole of gravity causes in it.
      simulation%bodies%acceleration = 0.0_wp
      n = max(1, nint(rise/simulation%dt))
      do k = 1, n + nint(hold/simulation%dt)
         simulation%forces%gravity = gravity*sin(0.5_wp*pi*real(min(k, n), wp)/real(n, wp))**2
         call advance(simulation, error)
         if (allocated(error)) return
         moved = norm2(simulation%bodies%position(:, body) - start)
         if (moved > limit) return
      end do
   end subroutine load_slowly

end module slow_load
