!> What a guard does when it finds something: it stops the run, or warns once and counts from then on.
module polydem_warnings
   use polydem_errors, only: error_t, raise, run_error
   use polydem_kinds, only: dp, lp
   use polydem_log, only: log_t
   implicit none
   private
   public :: warning_t

   !> The warnings of one guard
   type :: warning_t
      !> How often there was reason to warn
      integer(lp) :: count = 0_lp
      !> The first warning, until it is told
      character(len=:), allocatable :: text
      !> Of the first warnings of several processes, that of the greatest weight is told
      real(dp) :: weight = 0.0_dp
   contains
      procedure :: respond
      procedure :: tell
   end type warning_t

contains

   !> Stop the run if that is the choice; else keep the first message, and count.
   subroutine respond(self, choice, message, error, weight)
      class(warning_t), intent(inout) :: self
      !> Entry of &guards: 'stop' or 'warn'
      character(len=*), intent(in) :: choice
      !> Names body, position and step, and says what to do
      character(len=*), intent(in) :: message
      !> Allocated if the run must stop
      type(error_t), allocatable, intent(inout) :: error
      !> Weight of the message among those of other processes at the same step; 0 if absent
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

   !> Write a warning that nobody has been told of.
   subroutine tell(self, log)
      class(warning_t), intent(inout) :: self
      !> Log
      type(log_t), intent(inout) :: log

      if (.not. allocated(self%text)) return
      call log%write_line('warning: '//self%text)
      deallocate (self%text)
   end subroutine tell

end module polydem_warnings
