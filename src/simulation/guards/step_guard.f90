!> Guard of time steps above the stable time step of the contacts, or above half of it.
!>
!> A check compares dt with the stable step of all contacts together. Between checks a contact that is too stiff alone
!> is found in the step in which it becomes so.
module polydem_step_guard
   use polydem_errors, only: error_t
   use polydem_guard, only: guard_t, report_guard, serialize_guard
   use polydem_kinds, only: ip, lp, wp
   use polydem_motion_check, only: warn_share
   use polydem_serializer, only: serializer_t
   use polydem_simulation, only: simulation_t
   use polydem_stability_check, only: check_flagged, check_stability, greatest_share
   use polydem_strings, only: to_text
   implicit none
   private
   public :: step_guard_t

   !> Guard of the time step
   type, extends(guard_t) :: step_guard_t
      !> Greatest dt / stable dt so far, and that of a warning so far [1]
      real(wp) :: greatest = 0.0_wp, warned = 0.0_wp
   contains
      procedure :: start
      procedure :: look
      procedure :: asks
      procedure :: serialize
      procedure :: report
   end type step_guard_t

contains

   !> Set what the guard says of itself.
   subroutine start(self, simulation)
      class(step_guard_t), intent(inout) :: self
      type(simulation_t), intent(inout) :: simulation

      self%noun = 'check'
      self%finding = 'with dt above half the stable time step'
      self%choice = simulation%settings%guards%step
      self%needs_contacts = .true.
      self%is_global = .true.
   end subroutine start

   !> Whether this rank has a contact in this step whose dt / stable dt, alone, exceeds all that the log warns of so far
   logical function asks(self, simulation)
      class(step_guard_t), intent(in) :: self
      type(simulation_t), intent(in) :: simulation

      asks = .false.
      if (.not. self%is_on .or. simulation%loop%flagged%n == 0_ip) return
      asks = greatest_share(simulation) > max(warn_share, 1.1_wp*self%warned)
   end function asks

   !> Compare dt with the stable time step. A further warning needs a ratio that is larger by a tenth.
   subroutine look(self, simulation, error)
      class(step_guard_t), intent(inout) :: self
      type(simulation_t), intent(inout) :: simulation
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: warning
      real(wp) :: stable, share

      share = 0.0_wp
      if (self%is_check) then
         call check_stability(simulation, stable, warning, error)
         call simulation%comm%all_reduce_text(warning)
         if (stable < huge(stable)) share = simulation%dt/stable
      else if (self%is_asked) then
         call check_flagged(simulation, share, warning, error)
      end if
      self%greatest = max(self%greatest, share)
      if (.not. allocated(warning)) return
      self%warning%count = self%warning%count + 1_lp
      if (share <= 1.1_wp*self%warned) return
      self%warned = share
      call move_alloc(warning, self%warning%text)
   end subroutine look

   !> Serialize what the guard has found.
   subroutine serialize(self, serializer)
      class(step_guard_t), intent(inout) :: self
      class(serializer_t), intent(inout) :: serializer

      call serialize_guard(self, serializer)
      call serializer%field('/run/warned_share', self%warned, '1', 'greatest dt / stable dt of a warning')
      call serializer%field('/run/greatest_share', self%greatest, '1', 'greatest dt / stable dt')
   end subroutine serialize

   !> Lines for the end of the log
   function report(self) result(text)
      class(step_guard_t), intent(in) :: self
      character(len=:), allocatable :: text
      character(len=:), allocatable :: ratio

      text = report_guard(self)
      if (.not. self%greatest > 0.0_wp) return
      ratio = 'max dt / stable dt of the contacts: '//to_text(self%greatest, 3)
      if (text /= '') ratio = ratio//new_line('a')
      text = ratio//text
   end function report

end module polydem_step_guard
