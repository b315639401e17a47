!> Increments of finder statistics between two readings.
module polydem_finder_meter
   use polydem_finder, only: finder_t
   use polydem_finder_statistics, only: n_counts, n_phases, n_sums
   use polydem_kinds, only: dp, lp
   implicit none
   private
   public :: finder_meter_t

   !> Statistics of a finder at the last reading
   type :: finder_meter_t
      private
      !> Counts, in the order of `count_names`
      integer(lp) :: value(n_counts) = 0_lp
      !> Seconds, in the order of `phase_names`
      real(dp) :: seconds(n_phases) = 0.0_dp
   contains
      procedure :: read_all
      procedure :: read_seconds
   end type finder_meter_t

contains

   !> Read the seconds since the last reading, but no counts.
   pure subroutine read_seconds(self, finder, phase)
      class(finder_meter_t), intent(inout) :: self
      class(finder_t), intent(in) :: finder
      !> Seconds of each phase since the last reading, (phases)
      real(dp), intent(out) :: phase(:)

      phase = finder%work%seconds - self%seconds
      self%seconds = finder%work%seconds
   end subroutine read_seconds

   !> Read seconds and counts since the last reading, and the counts of the present state.
   subroutine read_all(self, finder, phase, count)
      class(finder_meter_t), intent(inout) :: self
      !> Finder; its `survey` is called
      class(finder_t), intent(inout) :: finder
      !> Seconds of each phase since the last reading, (phases)
      real(dp), intent(out) :: phase(:)
      !> Increments of the counts that are sums, and values of those that describe the present state, (counts)
      integer(lp), intent(out) :: count(:)

      call self%read_seconds(finder, phase)
      call finder%survey()
      count = finder%work%value
      count(:n_sums) = count(:n_sums) - self%value(:n_sums)
      self%value = finder%work%value
   end subroutine read_all

end module polydem_finder_meter
