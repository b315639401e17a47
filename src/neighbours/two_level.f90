!> Two-level list: a Verlet list with wide margins, and a filter that compares only pairs whose state can change.
!>
!> `polydem_fat_candidates` holds the candidates, the pairs of boxes whose fat boxes overlap. As long as all boxes lie
!> inside their fat boxes, only candidates can overlap.
!>
!> `polydem_line_filter` predicts straight lines for all sides and divides time into intervals. At the start of an
!> interval it classifies all candidates, and in each step it finds the boxes that are off their lines. Only the active
!> candidates are compared, a tenth of all in a drum. No box on its lines can leave its fat box, because this is tested
!> when the lines are drawn.
!>
!> A box that leaves its fat box, or will if it follows its lines, gets a new one by a search for this box alone. So one
!> fast box costs only the search for its own candidates.
module polydem_two_level
   use omp_lib, only: omp_get_max_threads
   use polydem_active_pairs, only: active_pairs_t
   use polydem_boxes, only: boxes_t
   use polydem_candidates, only: index_list_t
   use polydem_cell_grids, only: part
   use polydem_fat_candidates, only: fat_candidates_t
   use polydem_finder, only: finder_t
   use polydem_finder_statistics, only: count_bytes, count_candidates, count_depth, count_nodes, count_passes, &
      count_rebuilds, count_searches, count_tests, count_visits, phase_filter, phase_search, phase_structure
   use polydem_kinds, only: dp, ip, lp, wp, min_parallel_size
   use polydem_line_filter, only: class_cost, line_filter_t
   use polydem_pair_changes, only: pair_changes_t
   implicit none
   private
   public :: two_level_t

   !> Length of the first interval, which measures velocities, and least upper bound of the length of the others [steps]
   integer(ip), parameter :: first_interval = 2_ip
   integer(lp), parameter :: shortest = 16_lp

   !> Finder with a list of candidates and a filter of the candidates
   type, extends(finder_t) :: two_level_t
      private
      !> Candidates
      type(fat_candidates_t) :: list
      !> Lines, intervals and active candidates
      type(line_filter_t) :: filter
      !> Candidates of a box
      type(index_list_t) :: own
      !> Changes that each thread recorded, (thread)
      type(pair_changes_t), allocatable :: changes(:)
      !> Boxes off their lines, or boxes that can leave their fat boxes, (thread)
      type(index_list_t), allocatable :: found(:)
      !> Active candidates that each thread found, (thread)
      type(active_pairs_t), allocatable :: active(:)
   contains
      procedure :: find
      procedure :: survey
   end type two_level_t

contains

   !> Compare the active candidates; before that, begin an interval or take care of the boxes off their lines.
   subroutine find(self, boxes, changes)
      class(two_level_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      type(pair_changes_t), intent(inout) :: changes
      integer(lp) :: tests
      integer :: w

      call prepare_threads(self)
      tests = self%list%grids%total%tests
      if (allocated(self%list%fat)) then
         self%filter%step = self%filter%step + 1_ip
         self%list%age = self%list%age + 1_lp
         if (.not. must_begin(self)) call follow_lines(self, boxes)
      else
         call self%list%prepare(boxes)
         self%filter%isa = self%isa
         call self%filter%start(boxes%n, self%list%side)
      end if
      if (must_begin(self)) call begin_interval(self, boxes)
      call compare_active(self, boxes)
      call self%work%add(count_tests, self%list%grids%total%tests - tests)
      do w = 1, size(self%changes)
         call changes%append(self%changes(w))
      end do
      call self%work%lap(phase_filter)
   end subroutine find

   !> Make the results of all threads empty.
   subroutine prepare_threads(self)
      type(two_level_t), intent(inout) :: self
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
      end do
   end subroutine prepare_threads

   !> Whether an interval must begin: at the start, when it is due, and when all boxes must be searched
   pure logical function must_begin(self)
      type(two_level_t), intent(in) :: self

      must_begin = self%filter%length == 0_ip .or. self%filter%is_due(self%list%n) .or. self%list%must_search(0_ip)
   end function must_begin

   !> Find the boxes that left their lines and review their candidates. Search for boxes that can leave their fat boxes.
   subroutine follow_lines(self, boxes)
      type(two_level_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      integer(ip) :: low, high, k, i
      integer :: w

      !$omp parallel do if (boxes%n > min_parallel_size) schedule(static, 1) default(none) &
      !$omp    shared(self, boxes) private(w, low, high)
      do w = 1, size(self%changes)
         call part(1_ip, boxes%n, size(self%changes), w, low, high)
         self%found(w)%n = 0_ip
         call self%filter%find_off_lines(low, high, boxes%n, boxes%bounds, self%found(w))
      end do
      !$omp end parallel do
      call self%work%lap(phase_structure)
      do w = 1, size(self%changes)
         do k = 1_ip, self%found(w)%n
            call leave_lines(self, self%found(w)%at(k), boxes)
            if (must_begin(self)) return
         end do
      end do
      do k = 1_ip, self%filter%off%n
         i = self%filter%off%at(k)
         if (lies_inside(boxes%bounds(:, i), self%list%fat(:, i))) cycle
         call search_single(self, i, boxes)
         if (must_begin(self)) return
      end do
      call self%work%lap(phase_search)
   end subroutine follow_lines

   !> Draw new lines through a box that left its lines, and review its candidates.
   subroutine leave_lines(self, i, boxes)
      type(two_level_t), intent(inout) :: self
      integer(ip), intent(in) :: i
      type(boxes_t), intent(in) :: boxes
      logical :: was_off

      was_off = self%filter%is_off(i)
      call self%filter%leave_lines(i, boxes%bounds(:, i))
      if (was_off) return
      if (.not. (self%filter%is_off(i) .or. self%filter%stays_inside(i, self%list%fat(:, i)))) then
         call search_single(self, i, boxes)
         if (.not. self%filter%stays_inside(i, self%list%fat(:, i))) call self%filter%mark_off(i)
      end if
      call self%list%candidates_of(i, self%own)
      call self%filter%review(i, self%own, self%list)
   end subroutine leave_lines

   !> Whether a box lies inside another one
   pure logical function lies_inside(box, other)
      real(wp), intent(in) :: box(4), other(4)

      lies_inside = min(min(box(1) - other(1), box(2) - other(2)), min(other(3) - box(3), other(4) - box(4))) >= 0.0_wp
   end function lies_inside

   !> Search for a box alone, and activate its new candidates.
   subroutine search_single(self, i, boxes)
      type(two_level_t), intent(inout) :: self
      integer(ip), intent(in) :: i
      type(boxes_t), intent(in) :: boxes
      integer(ip) :: n_before, k

      n_before = self%list%n
      call self%list%search_single(i, boxes, self%filter, self%changes(1))
      do k = n_before + 1_ip, self%list%n
         call self%filter%activate(k, self%list)
      end do
   end subroutine search_single

   !> Begin an interval: new lines, new fat boxes where they are needed, and a classification of all candidates.
   subroutine begin_interval(self, boxes)
      type(two_level_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      integer(ip) :: low, high, n_strays, longest, n_wanted
      integer :: w

      longest = first_interval
      if (self%list%age > 0_lp) &
         longest = int(min(max(shortest, self%list%life/3_lp, self%list%age/2_lp), 1024_lp), ip)
      n_wanted = self%filter%active%n_sure + self%filter%active%n
      self%list%surplus = self%list%surplus + self%filter%surplus()
      call self%filter%active%write_back(self%list)
      call self%filter%begin_interval(self%list%n, longest)
      !$omp parallel do if (boxes%n > min_parallel_size) schedule(static, 1) default(none) &
      !$omp    shared(self, boxes) private(w, low, high)
      do w = 1, size(self%changes)
         call part(1_ip, boxes%n, size(self%changes), w, low, high)
         call self%filter%draw_lines(low, high, boxes%n, boxes%bounds)
      end do
      !$omp end parallel do
      n_strays = 0_ip
      call find_strays(self, n_strays)
      call self%work%add(count_passes, 1_lp)
      call self%work%lap(phase_structure)
      if (self%list%is_empty() .or. self%list%must_search(n_strays)) then
         call self%list%search_all(boxes, self%filter, n_wanted, self%changes)
         call self%work%add(count_rebuilds, 1_lp)
         call find_strays(self, n_strays)
      else
         call search_strays(self, boxes)
      end if
      call self%work%lap(phase_search)
      call classify(self, boxes)
      call mark_strays(self)
      call self%work%lap(phase_structure)
   end subroutine begin_interval

   !> List the boxes that can leave their fat boxes in the interval.
   subroutine find_strays(self, n_strays)
      type(two_level_t), intent(inout) :: self
      integer(ip), intent(out) :: n_strays
      integer(ip) :: low, high, n
      integer :: w

      n = size(self%list%fat, 2, kind=ip)
      !$omp parallel do if (n > min_parallel_size) schedule(static, 1) default(none) shared(self, n) &
      !$omp    private(w, low, high)
      do w = 1, size(self%changes)
         call part(1_ip, n, size(self%changes), w, low, high)
         self%found(w)%n = 0_ip
         call self%filter%find_strays(low, high, n, self%list%fat, self%found(w))
      end do
      !$omp end parallel do
      n_strays = 0_ip
      do w = 1, size(self%changes)
         n_strays = n_strays + self%found(w)%n
      end do
   end subroutine find_strays

   !> Search for each box that can leave its fat box.
   subroutine search_strays(self, boxes)
      type(two_level_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      integer(ip) :: k
      integer :: w

      do w = 1, size(self%changes)
         do k = 1_ip, self%found(w)%n
            call self%list%search_single(self%found(w)%at(k), boxes, self%filter, self%changes(1))
         end do
      end do
   end subroutine search_strays

   !> Mark the boxes as off that can leave even their new fat boxes.
   subroutine mark_strays(self)
      type(two_level_t), intent(inout) :: self
      integer(ip) :: k, i
      integer :: w

      do w = 1, size(self%changes)
         do k = 1_ip, self%found(w)%n
            i = self%found(w)%at(k)
            if (self%filter%stays_inside(i, self%list%fat(:, i))) cycle
            call self%filter%mark_off(i)
            call self%list%candidates_of(i, self%own)
            call self%filter%review(i, self%own, self%list)
         end do
      end do
   end subroutine mark_strays

   !> Classify all candidates.
   subroutine classify(self, boxes)
      type(two_level_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      integer(ip) :: low, high
      integer :: w

      !$omp parallel do if (boxes%n > min_parallel_size) schedule(static, 1) default(none) &
      !$omp    shared(self, boxes) private(w, low, high)
      do w = 1, size(self%changes)
         call part(1_ip, self%list%n, size(self%changes), w, low, high)
         call self%filter%classify(low, high, boxes%body, self%list, self%active(w), self%changes(w))
      end do
      !$omp end parallel do
      call self%filter%collect(self%list%n, self%active)
      self%list%surplus = self%list%surplus + class_cost* &
         real(self%list%n - self%filter%active%n - self%filter%active%n_sure, dp)
   end subroutine classify

   !> Compare the boxes of the active candidates.
   subroutine compare_active(self, boxes)
      type(two_level_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      integer(ip) :: low, high, n
      integer :: w

      n = self%filter%active%n
      !$omp parallel do if (n > min_parallel_size) schedule(static, 1) default(none) shared(self, boxes, n) &
      !$omp    private(w, low, high)
      do w = 1, size(self%changes)
         call part(1_ip, n, size(self%changes), w, low, high)
         call self%filter%active%compare(low, high, boxes%bounds, boxes%body, self%changes(w))
      end do
      !$omp end parallel do
      call self%work%add(count_tests, int(n, lp))
      call self%filter%count_step()
   end subroutine compare_active

   !> Set the counters: candidates, cells, grids, and memory [B].
   subroutine survey(self)
      class(two_level_t), intent(inout) :: self

      if (.not. allocated(self%list%fat)) return
      self%work%value(count_searches) = self%list%grids%total%searches
      self%work%value(count_visits) = self%list%grids%total%visits
      self%work%value(count_candidates) = int(self%list%n, lp)
      self%work%value(count_nodes) = int(self%list%grids%n_cells, lp)
      self%work%value(count_depth) = int(self%list%grids%n_levels, lp)
      self%work%value(count_bytes) = self%list%bytes() + self%filter%bytes()
   end subroutine survey

end module polydem_two_level
