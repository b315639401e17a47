!> Minimal quadtree under a filter.
!>
!> Only candidates whose state can change are compared (`polydem_inner_list`), and only boxes that can leave their leaf
!> are tested (`polydem_leaf_exits`). The rest of a step forms two chains. One repairs the tree and searches
!> (`polydem_quadtree`). The other one replaces candidates according to the search of the last step, reviews the
!> candidates of the boxes that left their lines, and compares the active ones.
!>
!> Two threads do one chain each, so that each finds most of what it reads in its own cache, and then share the
!> comparisons. With one thread, and with three or more, all threads compare before the first one repairs the tree. If
!> many leaves changed, or there are more than two threads, all search. If many leaves changed, as in the first step,
!> candidates are replaced at once. They are also replaced when an interval begins, because it classifies them all.
module polydem_filtered_quadtree
   use polydem_boxes, only: boxes_t
   use polydem_finder_statistics, only: count_bytes, count_passes, count_tests, phase_filter, phase_search, &
      phase_structure
   use polydem_kinds, only: dp, ip, lp, wp, min_parallel_size
   use polydem_leaf_exits, only: leaf_exits_t
   use polydem_pair_changes, only: pair_changes_t
   use polydem_quadtree, only: quadtree_t
   use polydem_quadtree_measures, only: measure_reaches
   use polydem_quadtree_search, only: search_changed
   use polydem_thread_changes, only: part
   implicit none
   private
   public :: filtered_quadtree_t

   !> If more than one box per 2^few_changes candidates changed its leaf, the search would take more time than the other
   !> chain: all threads search, and candidates are replaced at once
   integer, parameter :: few_changes = 11
   !> Enlargement of the largest sides of boxes in units of the typical side: boxes on their lines then surely do not
   !> exceed them
   real(wp), parameter :: side_allowance = 2.0_wp**(-5)

   !> Finder that stores a tree and lines
   type, extends(quadtree_t) :: filtered_quadtree_t
      !> Boxes that can leave their leaf
      type(leaf_exits_t), private :: watch
   contains
      procedure :: find
      procedure :: survey
   end type filtered_quadtree_t

contains

   !> Follow the lines, repair the tree, compare the active candidates, and search again for boxes whose leaf changed.
   subroutine find(self, boxes, changes)
      class(filtered_quadtree_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      type(pair_changes_t), intent(inout) :: changes
      integer(ip) :: most
      logical :: waits

      call self%prepare(boxes, side_allowance)
      if (.not. self%candidates%filtered) call start_filter(self, boxes)
      call work_in_chains(self, boxes, most)
      call self%work%add(count_tests, int(self%candidates%filter%active%n, lp))
      call self%candidates%filter%changes%join(changes)
      waits = self%tree%n_changed <= most
      call self%settle()
      if (.not. waits) call self%replacement%apply(self%padded, self%candidates)
      call self%work%lap(phase_search)
   end subroutine find

   !> Make a filter without lines.
   subroutine start_filter(self, boxes)
      type(filtered_quadtree_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      real(dp) :: typical, least

      call measure_reaches(boxes, typical, least)
      call self%candidates%start_filter(boxes%n, 2.0_wp*real(typical, wp))
   end subroutine start_filter

   !> Work on both chains.
   subroutine work_in_chains(self, boxes, most)
      type(filtered_quadtree_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      !> Number of boxes whose leaf changed up to which one of two threads searches for all, and replacement waits
      integer(ip), intent(out) :: most
      integer(ip) :: low, high
      integer :: n_threads, w
      logical :: compares, one_searches

      call follow_boxes(self, boxes, compares)
      if (.not. compares) call self%work%add(count_passes, 1_lp)
      n_threads = size(self%worker)
      ! The chains do not read the number of candidates, which one of them changes.
      most = shiftr(self%candidates%n, few_changes)
      if (compares .and. n_threads /= 2) then
         call self%replacement%apply(self%padded, self%candidates)
         call self%candidates%filter%review_left(self%candidates)
         call self%candidates%filter%compare_active(boxes)
         compares = .false.
      end if
      call self%work%lap(phase_filter)
      one_searches = .false.
      !$omp parallel if (boxes%n > min_parallel_size) default(none) private(w, low, high) &
      !$omp    shared(self, boxes, compares, n_threads, most, one_searches)
      !$omp do schedule(static, 1)
      do w = 1, n_threads
         if (w == 1) call repair_and_search(self, boxes, most, one_searches)
         if (w < n_threads .or. .not. compares) cycle
         call self%replacement%apply(self%padded, self%candidates)
         call self%candidates%filter%review_left(self%candidates)
      end do
      !$omp end do
      !$omp do schedule(static, 1)
      do w = 1, n_threads
         if (compares) call self%candidates%filter%compare_part(w, boxes)
         if (one_searches) cycle
         call part(self%tree%n_changed, n_threads, w, low, high)
         call search_changed(self%tree, self%padded, low, high, boxes, self%worker(w), &
                             self%candidates%filter%changes%of(w))
      end do
      !$omp end do nowait
      !$omp end parallel
      if (compares) call self%candidates%filter%count_step()
      call self%work%lap(phase_search)
   end subroutine work_in_chains

   !> Find the boxes that left their lines, or begin an interval, and find the boxes that left their leaf.
   subroutine follow_boxes(self, boxes, compares)
      type(filtered_quadtree_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      !> Whether the active candidates are still to be compared: no interval began
      logical, intent(out) :: compares
      logical :: all_judged
      integer(ip) :: k

      call self%candidates%filter%begin_step()
      call self%watch%set_parts(size(self%worker), boxes%n, all_judged)
      compares = .not. self%candidates%is_due()
      if (.not. compares) call begin_interval(self, boxes)
      call test_boxes(self, boxes, follows=compares, judges=all_judged .or. .not. compares)
      if (.not. compares) return
      call self%candidates%gather_left()
      compares = .not. self%candidates%is_due()
      if (.not. compares) then
         call begin_interval(self, boxes)
         call test_boxes(self, boxes, follows=.false., judges=.true.)
         return
      end if
      ! These were on their lines when they were judged, and are off now.
      associate (strays => self%candidates%filter%strays)
         do k = 1_ip, strays%n
            call self%watch%judge(strays%at(k), self%candidates%filter, self%tree, self%greatest_side)
         end do
      end associate
   end subroutine follow_boxes

   !> Begin an interval of the filter. Its tolerance and length follow from the candidates of the last one.
   subroutine begin_interval(self, boxes)
      type(filtered_quadtree_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes

      call self%candidates%filter%begin_interval(self%candidates)
      call self%replacement%apply(self%padded, self%candidates)
      call self%candidates%classify_all(boxes)
   end subroutine begin_interval

   !> Find the boxes that left their leaf. Each thread works on the boxes of which it has just tested the lines.
   subroutine test_boxes(self, boxes, follows, judges)
      type(filtered_quadtree_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      !> Whether to find the boxes that left their lines before, and whether to judge all boxes, not only these
      logical, intent(in) :: follows, judges
      integer(ip) :: k
      integer :: w

      !$omp parallel do if (boxes%n > min_parallel_size) schedule(static) default(none) &
      !$omp    shared(self, boxes, follows, judges) private(w, k)
      do w = 1, size(self%worker)
         associate (filter => self%candidates%filter, outside => self%worker(w)%outside)
            if (follows) call self%candidates%follow_part(w, boxes)
            if (judges) then
               call self%watch%judge_part(w, filter, self%tree, self%greatest_side)
            else
               outside%n = 0_ip
               call filter%append_left(w, outside)
               do k = 1_ip, outside%n
                  call self%watch%judge(outside%at(k), filter, self%tree, self%greatest_side)
               end do
            end if
            call self%watch%find_outside(w, self%tree, boxes%bounds, outside)
         end associate
      end do
      !$omp end parallel do
   end subroutine test_boxes

   !> Move the boxes that left their leaf, judge those with a new leaf, and search for them if they are few.
   subroutine repair_and_search(self, boxes, most, one_searches)
      type(filtered_quadtree_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      !> Number of boxes whose leaf changed up to which this thread searches
      integer(ip), intent(in) :: most
      !> Whether this thread searches
      logical, intent(out) :: one_searches
      integer(ip) :: k
      integer :: w

      do w = 1, size(self%worker)
         call self%worker(w)%outside%sort()
      end do
      call self%move_boxes(boxes)
      call self%padded%update(self%tree)
      do k = 1_ip, self%tree%n_changed
         call self%watch%judge(self%tree%changed(k), self%candidates%filter, self%tree, self%greatest_side)
      end do
      call self%work%lap(phase_structure)
      one_searches = size(self%worker) <= 2 .and. self%tree%n_changed <= most
      if (one_searches) call search_changed(self%tree, self%padded, 1_ip, self%tree%n_changed, boxes, self%worker(1), &
                                            self%candidates%filter%changes%of(1))
   end subroutine repair_and_search

   !> Set the counters: candidates of the last comparison, nodes, levels, and memory [B].
   subroutine survey(self)
      class(filtered_quadtree_t), intent(inout) :: self

      if (.not. allocated(self%padded%now)) return
      call self%quadtree_t%survey()
      call self%work%add(count_bytes, self%candidates%filter%bytes() + self%watch%bytes())
   end subroutine survey

end module polydem_filtered_quadtree
