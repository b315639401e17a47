!> Guard of bodies that spin fast.
module polydem_spin_guard
   use polydem_errors, only: error_t
   use polydem_kinds, only: dp, ip, wp
   use polydem_settings, only: settings_t
   use polydem_simulation, only: guard_t, simulation_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: spin_guard_t

   !> Guard of the angular velocity
   type, extends(guard_t) :: spin_guard_t
      !> Greatest angular velocity without a warning [1/s]
      real(wp) :: limit = 1.0e4_wp
   contains
      procedure :: configure
      procedure :: look
   end type spin_guard_t

contains

   !> Set what the guard says of itself.
   subroutine configure(self, settings)
      class(spin_guard_t), intent(inout) :: self
      type(settings_t), intent(in) :: settings

      ! As for deep contacts, as long as &guards has no entry of its own.
      self%choice = settings%guards%overlap
      self%noun = 'check'
      self%finding = 'with a body that spins fast'
   end subroutine configure

   !> Respond to the fastest of the bodies that this rank moves. Of several ranks, the one with the fastest reports it.
   subroutine look(self, simulation, error)
      class(spin_guard_t), intent(inout) :: self
      type(simulation_t), intent(inout) :: simulation
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: s

      if (.not. self%is_check .or. size(simulation%bodies%free) == 0) return
      associate (bodies => simulation%bodies)
         s = bodies%free(maxloc(abs(bodies%angular_velocity(bodies%free)), dim=1))
         if (abs(bodies%angular_velocity(s)) <= self%limit) return
         call self%warning%respond(self%choice, 'step '//to_text(simulation%step)//': body '// &
                                   to_text(bodies%id(s))//' spins with '//to_text(bodies%angular_velocity(s), 3)// &
                                   ' 1/s', error, real(abs(bodies%angular_velocity(s)), dp))
      end associate
   end subroutine look

end module polydem_spin_guard
