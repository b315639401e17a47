!> A guard: a check during a run that stops it or warns.
!>
!> Each entry of &guards with the words stop, warn and off has a guard. It says in `start` how the log counts its
!> findings and what it needs, and looks at the simulation after each step. A new guard is a file, a line in
!> `guard_list.f90` and an entry.
module polydem_guard
   use polydem_errors, only: error_t
   use polydem_kinds, only: lp
   use polydem_serializer, only: serializer_t
   use polydem_simulation, only: simulation_t
   use polydem_strings, only: counted
   use polydem_warning, only: warning_t
   implicit none
   private
   public :: guard_t, report_guard, serialize_guard

   !> A guard and what it has found
   type, abstract :: guard_t
      !> Entry of &guards, and its value: stop, warn or off
      character(len=:), allocatable :: name, choice
      !> Whether the value is not off
      logical :: is_on = .true.
      !> What a warning counts, 'step' or 'check', and what was found in it: the end of 'warnings: 3 steps '
      character(len=:), allocatable :: noun, finding
      !> Whether a check looks at the table of all contacts
      logical :: needs_contacts = .false.
      !> Whether all ranks find the same, and thus warn and stop alike
      logical :: is_global = .false.
      !> Whether a rank may stop the run in a step that is no check, without a message to others
      logical :: stops_alone = .false.
      !> Whether the present step is a check: guards that do not look in every step look now
      logical :: is_check = .false.
      !> Whether a guard of a rank asks in this step for a look of all ranks
      logical :: is_asked = .false.
      !> Warnings so far
      type(warning_t) :: warning
   contains
      procedure(start_guard), deferred :: start
      procedure(look_at), deferred :: look
      procedure :: asks
      procedure :: serialize => serialize_guard
      procedure :: report => report_guard
   end type guard_t

   abstract interface
      !> Set what the guard says of itself, and record what it needs of the start. Collective.
      subroutine start_guard(self, simulation)
         import :: guard_t, simulation_t
         class(guard_t), intent(inout) :: self
         !> The simulation at time 0, with the forces of its contacts
         type(simulation_t), intent(inout) :: simulation
      end subroutine start_guard

      !> Look at the simulation after a step, and stop or warn. Collective.
      subroutine look_at(self, simulation, error)
         import :: error_t, guard_t, simulation_t
         class(guard_t), intent(inout) :: self
         !> The simulation at the end of the step
         type(simulation_t), intent(inout) :: simulation
         !> Names body, position and step if the run must stop; on entry an error of another guard of this rank
         type(error_t), allocatable, intent(inout) :: error
      end subroutine look_at
   end interface

contains

   !> Whether the guard of this rank has found something at which all ranks must look together; by default never.
   logical function asks(self, simulation)
      class(guard_t), intent(in) :: self
      !> The simulation at the end of a step
      type(simulation_t), intent(in) :: simulation

      associate (unused_self => self, unused_simulation => simulation)
      end associate
      asks = .false.
   end function asks

   !> Serialize what the guard has found.
   subroutine serialize_guard(self, serializer)
      class(guard_t), intent(inout) :: self
      class(serializer_t), intent(inout) :: serializer

      call serializer%field('/run/'//self%name//'_warnings', self%warning%count, '1', self%noun//'s '//self%finding)
   end subroutine serialize_guard

   !> Line for the end of the log; empty if there is nothing to report
   function report_guard(self) result(text)
      class(guard_t), intent(in) :: self
      character(len=:), allocatable :: text

      text = ''
      if (self%warning%count > 0_lp) text = 'warnings: '//counted(self%warning%count, self%noun)//' '//self%finding
   end function report_guard

end module polydem_guard
