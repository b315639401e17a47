!> Response of a guard of the run: it stops the run, or it warns once and then only counts.
module polydem_warning
   use polydem_errors, only: error_t, raise, run_error
   use polydem_kinds, only: dp, lp
   implicit none
   private
   public :: warning_t

   !> The warnings of one guard
   type :: warning_t
      !> Number of warnings, reported or not
      integer(lp) :: count = 0_lp
      !> The first warning; unallocated once it is reported
      character(len=:), allocatable :: text
      !> Weight of the first warning: of several ranks, the one with the largest weight is reported
      real(dp) :: weight = 0.0_dp
   contains
      procedure :: respond
      procedure :: take
   end type warning_t

contains

   !> Stop the run or warn, as the settings choose. The first warning is stored, and all are counted.
   subroutine respond(self, choice, message, error, weight)
      class(warning_t), intent(inout) :: self
      !> Entry of &guards: 'stop' or 'warn'
      character(len=*), intent(in) :: choice
      !> Message: body, position and step, and what to do
      character(len=*), intent(in) :: message
      !> Allocated if the run must stop
      type(error_t), allocatable, intent(inout) :: error
      !> Weight of the message among those of other ranks in the same step; 0 if absent
      real(dp), intent(in), optional :: weight

      if (choice == 'stop') then
         call raise(error, run_error, message)
         return
      end if
      self%count = self%count + 1_lp
      if (self%count > 1_lp) return
      self%text = message
      self%weight = 0.0_dp
      if (present(weight)) self%weight = weight
   end subroutine respond

   !> Return the pending warning and clear it. It is thus reported once.
   subroutine take(self, text)
      class(warning_t), intent(inout) :: self
      !> The warning; unallocated if none is pending
      character(len=:), allocatable, intent(out) :: text

      if (allocated(self%text)) call move_alloc(self%text, text)
   end subroutine take

end module polydem_warning
