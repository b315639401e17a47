!> The guards of a simulation within a step: their limits, and their response before other ranks know of it.
module polydem_guard
   use polydem_errors, only: error_t
   use polydem_kinds, only: wp
   use polydem_settings, only: integrate_settings_t
   use polydem_simulation, only: guard_item_t, simulation_t
   implicit none
   private
   public :: set_local_limits, set_global_limits, respond_to_motion, shorter_step

contains

   !> Set what the step finds for the guards, for the bodies that this rank has now.
   subroutine set_local_limits(self)
      type(simulation_t), intent(inout) :: self
      type(guard_item_t), allocatable :: list(:)
      integer :: k

      call move_alloc(self%guards, list)
      do k = 1, size(list)
         call list(k)%guard%set_local_limits(self)
      end do
      call move_alloc(list, self%guards)
   end subroutine set_local_limits

   !> Set limits that depend on the bodies of all ranks. Collective.
   subroutine set_global_limits(self)
      type(simulation_t), intent(inout) :: self
      type(guard_item_t), allocatable :: list(:)
      integer :: k

      self%motion%limit = huge(1.0_wp)
      call move_alloc(self%guards, list)
      do k = 1, size(list)
         call list(k)%guard%set_global_limits(self)
      end do
      call move_alloc(list, self%guards)
   end subroutine set_global_limits

   !> Let the guards respond at once to a motion that is not finite or beyond the limit.
   subroutine respond_to_motion(self, error)
      !> The simulation at the end of a step, or at the start
      type(simulation_t), intent(inout) :: self
      !> Allocated if the run must stop
      type(error_t), allocatable, intent(inout) :: error
      type(guard_item_t), allocatable :: list(:)
      integer :: k

      call move_alloc(self%guards, list)
      do k = 1, size(list)
         call list(k)%guard%respond_to_motion(self, error)
      end do
      call move_alloc(list, self%guards)
   end subroutine respond_to_motion

   !> Clause that says how to shorten the time step: 'reduce dt' if the user chose it
   pure function shorter_step(settings) result(clause)
      type(integrate_settings_t), intent(in) :: settings
      character(len=:), allocatable :: clause

      clause = 'reduce dt'
      if (.not. settings%dt > 0.0_wp) clause = 'reduce safety_factor in &integrate'
   end function shorter_step

end module polydem_guard
