!> Candidates under a filter: only those whose state can change are compared (`polydem_line_filter`).
!>
!> Candidates can be added and removed in every step. New ones are compared until the next interval.
module polydem_filtered_candidates
   use omp_lib, only: omp_get_max_threads
   use polydem_active_pairs, only: active_pairs_t
   use polydem_boxes, only: boxes_t
   use polydem_candidates, only: candidates_t, index_list_t
   use polydem_kinds, only: ip, lp, wp, min_parallel_size
   use polydem_line_filter, only: line_filter_t
   use polydem_pair_changes, only: pair_changes_t
   implicit none
   private
   public :: filtered_candidates_t

   !> Length of the first interval, which measures velocities, and largest length [steps]
   integer(ip), parameter :: first_interval = 2_ip, longest = 1024_ip

   !> Candidates, and the filter of their comparisons
   type, extends(candidates_t) :: filtered_candidates_t
      !> Whether to use the filter; set before the first step
      logical :: filtered = .false.
      !> Lines, intervals and active candidates
      type(line_filter_t) :: filter
      !> Candidates of a box
      type(index_list_t), private :: own
      !> Boxes off their lines, or boxes whose lines may not be used, (thread)
      type(index_list_t), allocatable, private :: found(:)
      !> Active candidates that each thread found, (thread)
      type(active_pairs_t), allocatable, private :: active(:)
      !> Changes that each thread recorded, (thread)
      type(pair_changes_t), allocatable, private :: changes(:)
      !> Bounds that no box leaves, (4, box) [m]
      real(wp), allocatable, private :: everywhere(:, :)
   contains
      procedure :: add
      procedure :: drop
      procedure :: start_filter
      procedure :: compare_active
   end type filtered_candidates_t

contains

   !> Make a filter without lines.
   subroutine start_filter(self, n_boxes, side)
      class(filtered_candidates_t), intent(inout) :: self
      !> Number of boxes
      integer(ip), intent(in) :: n_boxes
      !> Typical side of a box [m]
      real(wp), intent(in) :: side

      call self%filter%start(n_boxes, side)
      allocate (self%everywhere(4, n_boxes))
      self%everywhere(1:2, :) = -0.5_wp*huge(1.0_wp)
      self%everywhere(3:4, :) = 0.5_wp*huge(1.0_wp)
   end subroutine start_filter

   !> Append a candidate; it is active.
   pure subroutine add(self, a, b, overlap)
      class(filtered_candidates_t), intent(inout) :: self
      !> First box
      integer(ip), intent(in) :: a
      !> Second box
      integer(ip), intent(in) :: b
      !> Whether they overlap
      logical, intent(in) :: overlap

      call self%candidates_t%add(a, b, overlap)
      if (self%filtered) call self%filter%activate(self%n, self)
   end subroutine add

   !> Remove one candidate; the last candidate is moved to its place.
   pure subroutine drop(self, k)
      class(filtered_candidates_t), intent(inout) :: self
      !> Number of the candidate
      integer(ip), intent(in) :: k

      if (self%filtered) call self%filter%forget(k, self%n)
      call self%candidates_t%drop(k)
   end subroutine drop

   !> Compare the active candidates of a step; before that, begin an interval or review the boxes off their lines.
   subroutine compare_active(self, boxes, changes, n_compared)
      class(filtered_candidates_t), intent(inout) :: self
      !> Boxes of this step
      type(boxes_t), intent(in) :: boxes
      !> List of changes; the new changes are appended
      type(pair_changes_t), intent(inout) :: changes
      !> Number of comparisons
      integer(ip), intent(out) :: n_compared
      integer(ip) :: low, high, n
      integer :: w

      call prepare_threads(self)
      if (self%filter%length > 0_ip) self%filter%step = self%filter%step + 1_ip
      if (self%filter%length > 0_ip .and. .not. self%filter%is_due(self%n)) call follow_lines(self, boxes)
      if (self%filter%length == 0_ip .or. self%filter%is_due(self%n)) call begin_interval(self, boxes)
      n = self%filter%active%n
      !$omp parallel do if (n > min_parallel_size) schedule(static, 1) default(none) shared(self, boxes, n) &
      !$omp    private(w, low, high)
      do w = 1, size(self%changes)
         call part(n, size(self%changes), w, low, high)
         call self%filter%active%compare(low, high, boxes%bounds, boxes%body, self%changes(w))
      end do
      !$omp end parallel do
      call self%filter%count_step()
      n_compared = n
      do w = 1, size(self%changes)
         call changes%append(self%changes(w))
      end do
   end subroutine compare_active

   !> Make the results of all threads empty.
   subroutine prepare_threads(self)
      type(filtered_candidates_t), intent(inout) :: self
      integer :: w, m

      if (allocated(self%changes)) then
         if (size(self%changes) /= omp_get_max_threads()) deallocate (self%changes, self%found, self%active)
      end if
      if (.not. allocated(self%changes)) then
         m = omp_get_max_threads()
         allocate (self%changes(m), self%found(m), self%active(m))
      end if
      do w = 1, size(self%changes)
         call self%changes(w)%clear()
         self%found(w)%n = 0_ip
      end do
   end subroutine prepare_threads

   !> First and last element of part w, if 1..n is split into m parts of equal size
   pure subroutine part(n, m, w, low, high)
      integer(ip), intent(in) :: n
      integer, intent(in) :: m, w
      integer(ip), intent(out) :: low, high

      low = int((int(n, lp)*int(w - 1, lp))/int(m, lp), ip) + 1_ip
      high = int((int(n, lp)*int(w, lp))/int(m, lp), ip)
   end subroutine part

   !> Draw new lines through the boxes that left theirs, and review their candidates.
   subroutine follow_lines(self, boxes)
      type(filtered_candidates_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      integer(ip) :: low, high, k, i
      integer :: w
      logical :: was_off

      !$omp parallel do if (boxes%n > min_parallel_size) schedule(static, 1) default(none) shared(self, boxes) &
      !$omp    private(w, low, high)
      do w = 1, size(self%changes)
         call part(boxes%n, size(self%changes), w, low, high)
         call self%filter%find_off_lines(low, high, boxes%n, boxes%bounds, self%found(w))
      end do
      !$omp end parallel do
      do w = 1, size(self%changes)
         do k = 1_ip, self%found(w)%n
            i = self%found(w)%at(k)
            was_off = self%filter%is_off(i)
            call self%filter%leave_lines(i, boxes%bounds(:, i))
            if (was_off) cycle
            if (.not. (self%filter%is_off(i) .or. self%filter%stays_inside(i, self%everywhere(:, i)))) &
               call self%filter%mark_off(i)
            call review(self, i)
            if (self%filter%is_due(self%n)) return
         end do
      end do
   end subroutine follow_lines

   !> Review the candidates of a box.
   subroutine review(self, i)
      type(filtered_candidates_t), intent(inout) :: self
      integer(ip), intent(in) :: i

      call self%candidates_of(i, self%own)
      call self%filter%review(i, self%own, self)
   end subroutine review

   !> Begin an interval: new lines, and a classification of all candidates.
   subroutine begin_interval(self, boxes)
      type(filtered_candidates_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      integer(ip) :: low, high, k, n
      integer :: w

      call self%filter%active%write_back(self)
      call self%filter%begin_interval(self%n, merge(longest, first_interval, self%filter%length > 0_ip))
      n = self%n
      !$omp parallel if (boxes%n > min_parallel_size) default(none) shared(self, boxes, n) private(w, low, high)
      !$omp do schedule(static, 1)
      do w = 1, size(self%changes)
         call part(boxes%n, size(self%changes), w, low, high)
         self%found(w)%n = 0_ip
         call self%filter%draw_lines(low, high, boxes%n, boxes%bounds)
         call self%filter%find_strays(low, high, boxes%n, self%everywhere, self%found(w))
      end do
      !$omp end do
      !$omp do schedule(static, 1)
      do w = 1, size(self%changes)
         call part(n, size(self%changes), w, low, high)
         call self%filter%classify(low, high, boxes%body, self, self%active(w), self%changes(w))
      end do
      !$omp end do
      !$omp end parallel
      call self%filter%collect(self%n, self%active)
      do w = 1, size(self%changes)
         do k = 1_ip, self%found(w)%n
            call self%filter%mark_off(self%found(w)%at(k))
            call review(self, self%found(w)%at(k))
         end do
      end do
   end subroutine begin_interval

end module polydem_filtered_candidates
