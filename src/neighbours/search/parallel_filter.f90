!> Filter of candidates (`polydem_inner_list`) by several threads. Each thread works on parts of the boxes, of the
!> candidates or of the active candidates. The results do not depend on the number of threads.
module polydem_parallel_filter
   use polydem_active_pairs, only: active_pairs_t
   use polydem_box_lines, only: median_corner
   use polydem_boxes, only: boxes_t
   use polydem_candidates, only: candidates_t
   use polydem_index_list, only: index_list_t
   use polydem_kinds, only: ip, lp, sp, wp, min_parallel_size
   use polydem_inner_list, only: inner_list_t
   use polydem_thread_changes, only: part, thread_changes_t
   implicit none
   private
   public :: parallel_filter_t

   !> Number of boxes, and of active candidates, above which a step tests them in parallel; one takes about 1 ns
   integer(ip), parameter :: worth_testing = 4096_ip
   !> Number of boxes above which the review of their candidates is parallel; a box takes about 100 ns
   integer(ip), parameter :: worth_reviewing = 128_ip
   !> Inverse share of strays up to which it is cheaper to look at them alone than at all boxes again
   integer(ip), parameter :: few_strays = 16_ip

   !> Results of one part of the work
   type :: worker_t
      !> Boxes that left their lines in this step
      type(index_list_t) :: left
      !> Those of them that left their lines often or leave their bounds, or the boxes that do so in a new interval
      type(index_list_t) :: strays
      !> Candidates of the boxes that left their lines; after the review those that must become active
      type(index_list_t) :: asked
      !> Number of candidates that were classified
      integer(lp) :: n_reviewed = 0_lp
      !> Active candidates at the start of an interval
      type(active_pairs_t) :: active
   end type worker_t

   !> Filter with the results of its threads
   type, extends(inner_list_t) :: parallel_filter_t
      !> Changes that were recorded in each part
      type(thread_changes_t) :: changes
      !> Results of each part, (part)
      type(worker_t), allocatable, private :: worker(:)
      !> Boxes that left their lines often or leave their bounds
      type(index_list_t) :: strays
      !> Number of active candidates that were compared in this step
      integer(ip), private :: n_compared = 0_ip
   contains
      procedure :: begin_step
      procedure :: follow_lines
      procedure, private :: is_parallel
      procedure :: review_left
      procedure :: activate_candidates_of
      procedure :: draw_all_lines
      procedure :: list_strays
      procedure :: shorten_strays
      procedure :: classify_all
      procedure :: find_active_states
      procedure :: append_left
      procedure :: follow_part
      procedure :: gather_left
      procedure :: compare_active
      procedure :: compare_part
   end type parallel_filter_t

contains

   !> Begin a step: the results of all parts are empty.
   subroutine begin_step(self)
      class(parallel_filter_t), intent(inout) :: self

      if (self%length > 0_ip) self%step = self%step + 1_ip
      self%n_compared = 0_ip
      call self%changes%clear()
      if (allocated(self%worker)) then
         if (size(self%worker) /= self%changes%n_threads()) deallocate (self%worker)
      end if
      if (.not. allocated(self%worker)) allocate (self%worker(self%changes%n_threads()))
   end subroutine begin_step

   !> Draw new lines through the boxes that left theirs. Several threads also compare the active candidates, so that
   !> this needs no region of its own. Then handle the `strays`, and call `review_left`.
   subroutine follow_lines(self, boxes, limits)
      class(parallel_filter_t), intent(inout) :: self
      !> Boxes of this step
      type(boxes_t), intent(in) :: boxes
      !> Bounds that each box must not leave while it is on its lines, (4, box) [m]
      real(wp), intent(in), contiguous :: limits(:, :)
      integer :: w

      if (self%is_parallel(boxes%n, worth_testing)) then
         !$omp parallel do schedule(static, 1) default(none) shared(self, boxes, limits) private(w)
         do w = 1, size(self%worker)
            call follow_part(self, w, boxes, limits)
            call compare_part(self, w, boxes)
         end do
         !$omp end parallel do
         self%n_compared = self%active%n
      else
         do w = 1, size(self%worker)
            call follow_part(self, w, boxes, limits)
         end do
      end if
      call self%gather_left()
   end subroutine follow_lines

   !> Count the boxes that left their lines in any part, and join the strays among them.
   pure subroutine gather_left(self)
      class(parallel_filter_t), intent(inout) :: self

      self%n_left = self%n_left + sum(int(self%worker%left%n, lp))
      call gather_strays(self)
   end subroutine gather_left

   !> Append the boxes of a part that left their lines in this step to a list.
   pure subroutine append_left(self, w, list)
      class(parallel_filter_t), intent(in) :: self
      !> Number of the part
      integer, intent(in) :: w
      !> List of boxes
      type(index_list_t), intent(inout) :: list

      call list%append(self%worker(w)%left)
   end subroutine append_left

   !> Whether work is worth a parallel region. Even for one thread a region costs 0.2 us.
   pure logical function is_parallel(self, n, worth)
      class(parallel_filter_t), intent(in) :: self
      !> Amount of work, and the amount above which it is worth a region
      integer(ip), intent(in) :: n, worth

      is_parallel = n > worth .and. size(self%worker) > 1
   end function is_parallel

   !> Find the boxes of a part that left their lines, and draw new ones. After all parts call `gather_left`.
   pure subroutine follow_part(self, w, boxes, limits)
      class(parallel_filter_t), intent(inout) :: self
      !> Number of the part
      integer, intent(in) :: w
      !> Boxes of this step
      type(boxes_t), intent(in) :: boxes
      !> Bounds that each box must not leave while it is on its lines, (4, box) [m]
      real(wp), intent(in), contiguous :: limits(:, :)
      integer(ip) :: low, high

      call part(boxes%n, size(self%worker), w, low, high)
      call self%find_off_lines(low, high, boxes%n, boxes%bounds, self%worker(w)%left)
      call redraw_lines(self, boxes, limits, self%worker(w))
   end subroutine follow_part

   !> Draw new lines through the boxes of a part that left theirs, and list the strays among them. Boxes that were off
   !> before are removed from the list.
   pure subroutine redraw_lines(self, boxes, limits, worker)
      class(parallel_filter_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      real(wp), intent(in), contiguous :: limits(:, :)
      type(worker_t), intent(inout) :: worker
      integer(ip) :: k, i, kept
      logical :: was_off

      kept = 0_ip
      worker%strays%n = 0_ip
      do k = 1_ip, worker%left%n
         i = worker%left%at(k)
         was_off = self%is_off(i)
         call self%leave_lines(i, boxes%bounds(:, i))
         if (was_off) cycle
         kept = kept + 1_ip
         worker%left%at(kept) = i
         if (self%leaves_often(i)) then
            call worker%strays%push(i)
         else if (.not. self%stays_inside(i, limits(:, i))) then
            call worker%strays%push(i)
         end if
      end do
      worker%left%n = kept
   end subroutine redraw_lines

   !> Join the strays of all parts.
   pure subroutine gather_strays(self)
      class(parallel_filter_t), intent(inout) :: self
      integer :: w

      self%strays%n = 0_ip
      do w = 1, size(self%worker)
         call self%strays%append(self%worker(w)%strays)
      end do
   end subroutine gather_strays

   !> Review the candidates of the boxes that left their lines in this step.
   subroutine review_left(self, candidates)
      class(parallel_filter_t), intent(inout) :: self
      !> All candidates
      class(candidates_t), intent(in) :: candidates
      integer :: w

      if (all(self%worker%left%n == 0_ip)) return
      call self%active%reserve_places(candidates%n)
      if (self%is_parallel(sum(self%worker%left%n), worth_reviewing)) then
         !$omp parallel do schedule(static, 1) default(none) shared(self, candidates) private(w)
         do w = 1, size(self%worker)
            call review_part(self, candidates, self%worker(w))
         end do
         !$omp end parallel do
      else
         do w = 1, size(self%worker)
            call review_part(self, candidates, self%worker(w))
         end do
      end if
      do w = 1, size(self%worker)
         call self%active%activate_all(self%worker(w)%asked, candidates)
         self%n_reviewed = self%n_reviewed + self%worker(w)%n_reviewed
      end do
   end subroutine review_left

   !> Review the candidates of the boxes of a part.
   pure subroutine review_part(self, candidates, worker)
      class(parallel_filter_t), intent(in) :: self
      class(candidates_t), intent(in) :: candidates
      type(worker_t), intent(inout) :: worker

      worker%asked%n = 0_ip
      call candidates%append_candidates_of_all(worker%left, worker%asked)
      call self%review(candidates, worker%asked, worker%n_reviewed)
   end subroutine review_part

   !> Mark a box as off and make all its candidates active.
   pure subroutine activate_candidates_of(self, i, candidates)
      class(parallel_filter_t), intent(inout) :: self
      !> Box
      integer(ip), intent(in) :: i
      !> All candidates
      class(candidates_t), intent(in) :: candidates

      call self%mark_off(i)
      self%worker(1)%asked%n = 0_ip
      call candidates%append_candidates_of(i, self%worker(1)%asked)
      call self%active%activate_all(self%worker(1)%asked, candidates)
   end subroutine activate_candidates_of

   !> Draw new lines through all boxes.
   subroutine draw_all_lines(self, boxes)
      class(parallel_filter_t), intent(inout) :: self
      !> Boxes of this step
      type(boxes_t), intent(in) :: boxes
      real(wp) :: origin(2)
      real(sp) :: reach(size(self%worker))
      integer(ip) :: low, high
      integer :: w

      origin = median_corner(boxes%n, boxes%bounds)
      !$omp parallel do if (boxes%n > min_parallel_size) schedule(static, 1) default(none) &
      !$omp    shared(self, boxes, origin, reach) private(w, low, high)
      do w = 1, size(self%worker)
         call part(boxes%n, size(self%worker), w, low, high)
         call self%draw_lines(low, high, boxes%n, boxes%bounds, origin, reach(w))
      end do
      !$omp end parallel do
      call self%set_limit(origin, maxval(reach))
   end subroutine draw_all_lines

   !> List the boxes that do not stay inside given bounds in an interval that begins.
   subroutine list_strays(self, limits)
      class(parallel_filter_t), intent(inout) :: self
      !> Bounds of each box, (4, box) [m]
      real(wp), intent(in), contiguous :: limits(:, :)
      integer(ip) :: low, high, n
      integer :: w

      n = size(limits, 2, ip)
      !$omp parallel do if (n > min_parallel_size) schedule(static, 1) default(none) shared(self, limits, n) &
      !$omp    private(w, low, high)
      do w = 1, size(self%worker)
         call part(n, size(self%worker), w, low, high)
         call self%find_strays(low, high, n, limits, self%worker(w)%strays)
      end do
      !$omp end parallel do
      call gather_strays(self)
   end subroutine list_strays

   !> Remove those boxes from the strays that stay inside given bounds, after the interval became shorter.
   subroutine shorten_strays(self, limits)
      class(parallel_filter_t), intent(inout) :: self
      !> Bounds of each box, (4, box) [m]
      real(wp), intent(in), contiguous :: limits(:, :)
      integer(ip) :: k, n, i

      if (self%strays%n > size(limits, 2, ip)/few_strays) then
         call self%list_strays(limits)
         return
      end if
      n = self%strays%n
      self%strays%n = 0_ip
      do k = 1_ip, n
         i = self%strays%at(k)
         if (.not. self%stays_inside(i, limits(:, i))) call self%strays%push(i)
      end do
   end subroutine shorten_strays

   !> Classify all candidates.
   subroutine classify_all(self, boxes, candidates, known)
      class(parallel_filter_t), intent(inout) :: self
      !> Boxes of this step
      type(boxes_t), intent(in) :: boxes
      !> All candidates
      class(candidates_t), intent(inout) :: candidates
      !> Whether the states of the candidates are known; else those of the active ones must be set afterwards
      logical, intent(in) :: known
      integer(ip) :: low, high
      integer :: w

      !$omp parallel do if (candidates%n > min_parallel_size) schedule(static, 1) default(none) &
      !$omp    shared(self, boxes, candidates, known) private(w, low, high)
      do w = 1, size(self%worker)
         call part(candidates%n, size(self%worker), w, low, high)
         call self%classify(low, high, boxes%piece, known, candidates, self%worker(w)%active, self%changes%of(w))
      end do
      !$omp end parallel do
      call self%collect(candidates%n, self%worker%active)
      self%n_compared = 0_ip
   end subroutine classify_all

   !> Find the states of all active candidates, without changes.
   subroutine find_active_states(self, boxes)
      class(parallel_filter_t), intent(inout) :: self
      !> Boxes of this step
      type(boxes_t), intent(in) :: boxes
      integer(ip) :: low, high
      integer :: w

      !$omp parallel do if (self%active%n > min_parallel_size) schedule(static, 1) default(none) &
      !$omp    shared(self, boxes) private(w, low, high)
      do w = 1, size(self%worker)
         call part(self%active%n, size(self%worker), w, low, high)
         call self%active%find_states_of(high - low + 1_ip, self%active%box(:, low:high), boxes%bounds, &
                                         self%active%overlap(low:high))
      end do
      !$omp end parallel do
   end subroutine find_active_states

   !> Compare the boxes of the active candidates that were not compared in this step.
   subroutine compare_active(self, boxes)
      class(parallel_filter_t), intent(inout) :: self
      !> Boxes of this step
      type(boxes_t), intent(in) :: boxes
      integer :: w

      if (self%is_parallel(self%active%n - self%n_compared, worth_testing)) then
         !$omp parallel do schedule(static, 1) default(none) shared(self, boxes) private(w)
         do w = 1, size(self%worker)
            call compare_part(self, w, boxes)
         end do
         !$omp end parallel do
      else
         do w = 1, size(self%worker)
            call compare_part(self, w, boxes)
         end do
      end if
      call self%count_step()
   end subroutine compare_active

   !> Compare the boxes of a part of these candidates. After all parts call `count_step`.
   subroutine compare_part(self, w, boxes)
      class(parallel_filter_t), intent(inout) :: self
      !> Number of the part
      integer, intent(in) :: w
      !> Boxes of this step
      type(boxes_t), intent(in) :: boxes
      integer(ip) :: low, high

      call part(self%active%n - self%n_compared, size(self%worker), w, low, high)
      call self%active%compare(self%n_compared + low, self%n_compared + high, boxes%bounds, boxes%piece, &
                               self%changes%of(w))
   end subroutine compare_part

end module polydem_parallel_filter
