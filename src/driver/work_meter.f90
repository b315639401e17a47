!> The work of a finder between two looks at it.
module polydem_work_meter
   use polydem_finder, only: finder_t
   use polydem_kinds, only: dp, lp
   use polydem_work, only: n_counts, n_phases, n_sums
   implicit none
   private
   public :: work_meter_t

   !> What the finder had done at the last look
   type :: work_meter_t
      private
      !> Sums of counts
      integer(lp) :: value(n_counts) = 0_lp
      !> Seconds of phases
      real(dp) :: seconds(n_phases) = 0.0_dp
   contains
      procedure :: look
      procedure :: look_at_seconds
   end type work_meter_t

contains

   !> Read the seconds since the last look, and no counts.
   pure subroutine look_at_seconds(self, finder, phase)
      class(work_meter_t), intent(inout) :: self
      !> Finder
      class(finder_t), intent(in) :: finder
      !> Seconds of each phase, (phases)
      real(dp), intent(out) :: phase(:)

      phase = finder%work%seconds - self%seconds
      self%seconds = finder%work%seconds
   end subroutine look_at_seconds

   !> Read seconds and counts since the last look, and the present state.
   subroutine look(self, finder, phase, count)
      class(work_meter_t), intent(inout) :: self
      !> Finder, which surveys its state
      class(finder_t), intent(inout) :: finder
      !> Seconds of each phase, (phases)
      real(dp), intent(out) :: phase(:)
      !> Increments of sums, and values of what describes the present, (counts)
      integer(lp), intent(out) :: count(:)

      call self%look_at_seconds(finder, phase)
      call finder%survey()
      count = finder%work%value
      count(:n_sums) = count(:n_sums) - self%value(:n_sums)
      self%value = finder%work%value
   end subroutine look

end module polydem_work_meter
