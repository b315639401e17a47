!> Incremental sort-and-sweep on two axes (Baraff 1992; Krengel et al. 2026).
!>
!> What the order of the ends tells stands in `polydem_sweep_ends`. Krengel et al. drop parted pairs in a
!> second loop over the list of pairs. Here ends of pairs come from exchanges just as beginnings do, so that
!> a step without exchanges does no work on pairs at all, and there is no phase of search: the pairs come
!> with the structure.
!>
!> As there, the first lists are made by sorting the centres of the boxes with a fast sort; both ends of a
!> box start at the rank of its centre, and the first incremental sort then reports the first pairs. Without
!> that, in the order in which the boxes come, the first step can need as many exchanges as there are pairs
!> of ends: this is the finder unsorted_sweep.
!>
!> The axes share nothing that is written and run on two threads; more cannot help.
module polydem_sort_and_sweep
   use polydem_boxes, only: boxes_t
   use polydem_finder, only: finder_t
   use polydem_kinds, only: ip, wp, worth_threads
   use polydem_pair_changes, only: pair_changes_t
   use polydem_sweep_ends, only: bytes_of, ends_t, hand_over, place_ends, refresh_ends, report_t, sort_ends
   use polydem_work, only: count_bytes, phase_filter, phase_structure
   implicit none
   private
   public :: sort_and_sweep_t

   !> Finder that keeps the ends of boxes sorted
   type, extends(finder_t) :: sort_and_sweep_t
      !> Whether the first step begins with the boxes in the order of their centres, or as they come
      logical :: centres_first = .true.
      !> Ends of all boxes in x and in y
      type(ends_t), private :: ends(2)
      !> Reports of x and of y
      type(report_t), private :: report(2)
      !> Bounds of the step before, (4, box) [m]
      real(wp), allocatable, private :: before(:, :)
   contains
      procedure :: find
      procedure :: survey
   end type sort_and_sweep_t

contains

   !> Sort the ends again and record the changes that their exchanges show.
   subroutine find(self, boxes, changes)
      class(sort_and_sweep_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      type(pair_changes_t), intent(inout) :: changes
      integer :: a

      if (.not. allocated(self%before)) call place_ends(boxes, self%centres_first, self%ends, self%before)
      !$omp parallel do if (boxes%n > worth_threads) schedule(static, 1) default(none) shared(self, boxes) private(a)
      do a = 1, 2
         call self%report(a)%clear()
         call refresh_ends(a, 1_ip, 2_ip*boxes%n, boxes, self%ends(a))
         call sort_ends(a, 1_ip, 2_ip, 2_ip*boxes%n, .false., self%work%thorough, boxes, self%before, self%ends(a), &
                        self%report(a))
      end do
      !$omp end parallel do
      self%before(:, 1:boxes%n) = boxes%bounds(:, 1:boxes%n)
      call self%work%lap(phase_structure)
      do a = 1, 2
         call hand_over(self%report(a), changes, self%work)
      end do
      call self%work%lap(phase_filter)
   end subroutine find

   !> Memory held: ends, bounds of the step before, changes.
   subroutine survey(self)
      class(sort_and_sweep_t), intent(inout) :: self

      if (.not. allocated(self%before)) return
      self%work%value(count_bytes) = bytes_of(self%ends, self%before) + &
         self%report(1)%changes%bytes() + self%report(2)%changes%bytes()
   end subroutine survey

end module polydem_sort_and_sweep
