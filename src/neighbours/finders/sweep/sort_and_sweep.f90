!> Incremental sort-and-sweep on two axes (Baraff 1992; Krengel et al. 2026).
!>
!> `polydem_sweep_ends` explains the relation between the order of ends and the pairs. Krengel et al. remove separated
!> pairs in a second loop over the list of pairs. Here exchanges of ends show both the start and the end of an overlap.
!> A step without exchanges does no work on pairs, and there is no search phase.
!>
!> As in that paper, the initial lists come from a fast sort of the centres of the boxes. Both ends of a box start at
!> the rank of its centre, and the first incremental sort reports the first pairs. The finder unsorted_sweep omits this
!> sort and starts with the given order of the boxes. Its first step can need as many exchanges as there are pairs of
!> ends.
!>
!> The two axes share no written data. Each axis uses one thread, so more than two threads give no speed-up.
module polydem_sort_and_sweep
   use polydem_boxes, only: boxes_t
   use polydem_finder, only: finder_t
   use polydem_finder_statistics, only: count_bytes, phase_filter, phase_structure
   use polydem_kinds, only: ip, wp, min_parallel_size
   use polydem_pair_changes, only: pair_changes_t
   use polydem_sweep_ends, only: bytes_of, ends_t, add_report, place_ends, range_t, refresh_ends, report_t, &
      sort_ends
   implicit none
   private
   public :: sort_and_sweep_t

   !> Finder that stores the sorted ends of boxes
   type, extends(finder_t) :: sort_and_sweep_t
      !> Whether the first step starts with the boxes in the order of their centres, not in the given order
      logical :: centres_first = .true.
      !> Ends of all boxes in x and in y
      type(ends_t), private :: ends(2)
      !> Changes and counts of x and of y
      type(report_t), private :: report(2)
      !> Bounds of the previous step, (4, box) [m]
      real(wp), allocatable, private :: before(:, :)
   contains
      procedure :: find
      procedure :: survey
   end type sort_and_sweep_t

contains

   !> Sort the ends and record the changes that follow from exchanges of ends.
   subroutine find(self, boxes, changes)
      class(sort_and_sweep_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      type(pair_changes_t), intent(inout) :: changes
      integer :: a

      if (.not. allocated(self%before)) call place_ends(boxes, self%centres_first, self%ends, self%before)
      !$omp parallel do if (boxes%n > min_parallel_size) schedule(static, 1) default(none) shared(self, boxes) &
      !$omp    private(a)
      do a = 1, 2
         call self%report(a)%clear()
         call refresh_ends(a, 1_ip, 2_ip*boxes%n, boxes, self%ends(a))
         call sort_ends(range_t(axis=a, high=2_ip*boxes%n), self%work%thorough, boxes, self%before, self%ends(a), &
                        self%report(a))
      end do
      !$omp end parallel do
      self%before(:, 1:boxes%n) = boxes%bounds(:, 1:boxes%n)
      call self%work%lap(phase_structure)
      do a = 1, 2
         call add_report(self%report(a), changes, self%work)
      end do
      call self%work%lap(phase_filter)
   end subroutine find

   !> Set the counter of memory [B]: ends, bounds of the previous step, changes.
   subroutine survey(self)
      class(sort_and_sweep_t), intent(inout) :: self

      if (.not. allocated(self%before)) return
      self%work%value(count_bytes) = bytes_of(self%ends, self%before) + &
         self%report(1)%changes%bytes() + self%report(2)%changes%bytes()
   end subroutine survey

end module polydem_sort_and_sweep
