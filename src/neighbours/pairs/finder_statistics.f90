!> Finder statistics: exact counts of operations, and seconds per phase.
!>
!> The first phases are those of the neighbourhood computation of Krengel et al. (2026), after the boxes: the structure
!> (tree, cells or sorted ends) is updated, it is searched for possible pairs, and the pairs of boxes that overlap are
!> selected. Then the changes are ordered and merged into the list. `waiting` is the part of all these phases in which
!> threads wait for one another.
module polydem_finder_statistics
   use polydem_clock, only: wall_seconds
   use polydem_counters, only: at_end, counters_t, over_steps
   use polydem_kinds, only: dp, lp
   implicit none
   private
   public :: finder_statistics_t, n_phases, phase_names, n_counts, count_names, n_sums
   public :: phase_structure, phase_search, phase_filter, phase_order, phase_merge, phase_waiting
   public :: count_tests, count_swaps, count_idle_swaps, count_left_leaf, count_leaf_changes, count_searches
   public :: count_visits, count_rebuilds, count_crossings, count_passes, count_locks, count_lock_waits
   public :: count_candidates, count_nodes, count_depth, count_bytes

   !> Update of the structure
   integer, parameter :: phase_structure = 1
   !> Search for possible pairs
   integer, parameter :: phase_search = 2
   !> Selection of the pairs of boxes that overlap
   integer, parameter :: phase_filter = 3
   !> Ordering of the changes
   integer, parameter :: phase_order = 4
   !> Merging of the changes into the list
   integer, parameter :: phase_merge = 5
   !> Waiting of threads, a part of the other phases
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
   !> Idle exchanges: between boxes that cannot touch, because they are apart on the other axis before and after the
   !> step (Krengel et al. 2026, Fig. 1); counted only on request
   integer, parameter :: count_idle_swaps = 3
   !> Boxes whose centre left its leaf
   integer, parameter :: count_left_leaf = 4
   !> Boxes whose leaf changed, including boxes of leaves that neighbours split or merged
   integer, parameter :: count_leaf_changes = 5
   !> Boxes whose neighbours were searched
   integer, parameter :: count_searches = 6
   !> Nodes or cells visited in these searches
   integer, parameter :: count_visits = 7
   !> Structures built from scratch
   integer, parameter :: count_rebuilds = 8
   !> Exchanges of ends across the border of two partitions
   integer, parameter :: count_crossings = 9
   !> Passes over the ends
   integer, parameter :: count_passes = 10
   !> How often threads took the lock of a list that they share
   integer, parameter :: count_locks = 11
   !> How often a thread had to wait for this lock
   integer, parameter :: count_lock_waits = 12
   !> Number of counts that are sums over all steps; the counts below describe the present state
   integer, parameter :: n_sums = 12
   !> Possible pairs that persist from step to step
   integer, parameter :: count_candidates = 13
   !> Nodes or cells in use
   integer, parameter :: count_nodes = 14
   !> Levels of the structure
   integer, parameter :: count_depth = 15
   !> Memory that the finder holds [B]
   integer, parameter :: count_bytes = 16
   !> Number of counts
   integer, parameter :: n_counts = 16
   !> Names of the counts, in the order of the constants above
   character(len=*), parameter :: count_names(n_counts) = &
      [character(len=12) :: 'tests', 'swaps', 'idle_swaps', 'left_leaf', 'leaf_changes', 'searches', 'visits', &
       'rebuilds', 'crossings', 'passes', 'locks', 'lock_waits', 'candidates', 'nodes', 'depth', 'bytes']

   !> Counts and seconds since the finder began
   type :: finder_statistics_t
      !> Counts, in the order of `count_names`
      integer(lp) :: value(n_counts) = 0_lp
      !> Seconds, in the order of `phase_names`
      real(dp) :: seconds(n_phases) = 0.0_dp
      !> Whether to count quantities that cost time
      logical :: thorough = .false.
      !> Start of the current phase [s]
      real(dp), private :: began = 0.0_dp
   contains
      procedure :: start
      procedure :: lap
      procedure :: add
      procedure :: report
   end type finder_statistics_t

contains

   !> Start the clock.
   subroutine start(self)
      class(finder_statistics_t), intent(inout) :: self

      self%began = wall_seconds()
   end subroutine start

   !> Add the time since `start` or the last `lap` to a phase.
   subroutine lap(self, phase)
      class(finder_statistics_t), intent(inout) :: self
      !> phase_structure, ..., phase_merge
      integer, intent(in) :: phase
      real(dp) :: now

      now = wall_seconds()
      self%seconds(phase) = self%seconds(phase) + (now - self%began)
      self%began = now
   end subroutine lap

   !> Add to a count.
   pure subroutine add(self, count, n)
      class(finder_statistics_t), intent(inout) :: self
      !> count_tests, ..., count_lock_waits
      integer, intent(in) :: count
      !> The increment
      integer(lp), intent(in) :: n

      self%value(count) = self%value(count) + n
   end subroutine add

   !> Set the counters of a run to the counts, under their names in `count_names`. Zero counts are omitted.
   subroutine report(self, counters)
      class(finder_statistics_t), intent(in) :: self
      !> List to set them in
      type(counters_t), intent(inout) :: counters
      character(len=len(over_steps)) :: scope
      integer :: k

      do k = 1, n_counts
         if (self%value(k) == 0_lp) cycle
         scope = at_end
         if (k <= n_sums) scope = over_steps
         call counters%set('finder '//trim(count_names(k)), self%value(k), trim(scope))
      end do
   end subroutine report

end module polydem_finder_statistics
