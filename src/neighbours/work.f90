!> The work of a neighbour finder: exact counts and seconds per phase.
!>
!> The phases are those into which Krengel et al. (2026) split the neighbourhood computation, after the
!> boxes: the structure (tree, cells or sorted ends) is brought up to date, possible pairs are searched
!> in it, and the pairs of boxes that overlap are filtered out. Then the changes are ordered and merged
!> into the list. `waiting` is the part of all this in which threads waited for one another.
module polydem_work
   use polydem_clock, only: wall_seconds
   use polydem_counters, only: counters_t
   use polydem_kinds, only: dp, lp
   implicit none
   private
   public :: work_t, n_phases, phase_names, n_counts, count_names, n_sums
   public :: phase_structure, phase_search, phase_filter, phase_order, phase_merge, phase_waiting
   public :: count_tests, count_swaps, count_idle_swaps, count_leavers, count_leaf_changes, count_searches
   public :: count_visits, count_rebuilds, count_crossings, count_passes, count_candidates, count_nodes
   public :: count_depth, count_bytes

   integer, parameter :: phase_structure = 1
   integer, parameter :: phase_search = 2
   integer, parameter :: phase_filter = 3
   integer, parameter :: phase_order = 4
   integer, parameter :: phase_merge = 5
   integer, parameter :: phase_waiting = 6
   !> Number of phases
   integer, parameter :: n_phases = 6
   !> Names of the phases, in the order of the constants above
   character(len=*), parameter :: phase_names(n_phases) = &
      [character(len=9) :: 'structure', 'search', 'filter', 'order', 'merge', 'waiting']

   !> Comparisons of two boxes
   integer, parameter :: count_tests = 1
   !> Exchanges of two neighbouring ends of boxes
   integer, parameter :: count_swaps = 2
   !> Those of them between boxes that cannot touch, because they are apart on the other axis before and after the
   !> step (Krengel et al. 2026, Fig. 1); counted only on request
   integer, parameter :: count_idle_swaps = 3
   !> Boxes whose centre left its leaf
   integer, parameter :: count_leavers = 4
   !> Boxes whose leaf is another than before, those split and merged by neighbours included
   integer, parameter :: count_leaf_changes = 5
   !> Boxes whose neighbours were searched
   integer, parameter :: count_searches = 6
   !> Nodes or cells looked at in these searches
   integer, parameter :: count_visits = 7
   !> Structures built from nothing
   integer, parameter :: count_rebuilds = 8
   !> Exchanges of ends across the border of two partitions
   integer, parameter :: count_crossings = 9
   !> Passes over the ends
   integer, parameter :: count_passes = 10
   !> Number of counts that are sums over all steps; those that follow describe the present
   integer, parameter :: n_sums = 10
   !> Possible pairs that are kept from step to step
   integer, parameter :: count_candidates = 11
   !> Nodes or cells in use
   integer, parameter :: count_nodes = 12
   !> Levels of the structure
   integer, parameter :: count_depth = 13
   !> Memory that the finder holds [B]
   integer, parameter :: count_bytes = 14
   !> Number of counts
   integer, parameter :: n_counts = 14
   !> Names of the counts, in the order of the constants above
   character(len=*), parameter :: count_names(n_counts) = &
      [character(len=12) :: 'tests', 'swaps', 'idle_swaps', 'leavers', 'leaf_changes', 'searches', 'visits', &
       'rebuilds', 'crossings', 'passes', 'candidates', 'nodes', 'depth', 'bytes']

   !> Counts and seconds since the finder began
   type :: work_t
      !> Counts, in the order of `count_names`
      integer(lp) :: value(n_counts) = 0_lp
      !> Seconds, in the order of `phase_names`
      real(dp) :: seconds(n_phases) = 0.0_dp
      !> Whether counts are wanted that cost time
      logical :: thorough = .false.
      !> When the running phase began [s]
      real(dp), private :: began = 0.0_dp
   contains
      procedure :: start
      procedure :: lap
      procedure :: add
      procedure :: report
   end type work_t

contains

   !> Begin to time.
   subroutine start(self)
      class(work_t), intent(inout) :: self

      self%began = wall_seconds()
   end subroutine start

   !> Book the time since `start` or the last `lap` under a phase.
   subroutine lap(self, phase)
      class(work_t), intent(inout) :: self
      !> phase_structure, ..., phase_merge
      integer, intent(in) :: phase
      real(dp) :: now

      now = wall_seconds()
      self%seconds(phase) = self%seconds(phase) + (now - self%began)
      self%began = now
   end subroutine lap

   !> Add to a sum.
   pure subroutine add(self, count, n)
      class(work_t), intent(inout) :: self
      !> count_tests, ..., count_passes
      integer, intent(in) :: count
      !> How many
      integer(lp), intent(in) :: n

      self%value(count) = self%value(count) + n
   end subroutine add

   !> Set the counters of the work, under the names of the table; what did not occur is left out.
   subroutine report(self, counters)
      class(work_t), intent(in) :: self
      !> List to set them in
      type(counters_t), intent(inout) :: counters
      integer :: k

      do k = 1, n_counts
         if (self%value(k) /= 0_lp) call counters%set('finder '//trim(count_names(k)), self%value(k))
      end do
   end subroutine report

end module polydem_work
