!> Two-level list: a Verlet list with wide margins, and a filter that compares only pairs whose state can change.
!>
!> `polydem_outer_list` holds the candidates, the pairs of boxes whose padded boxes overlap. As long as all boxes lie
!> inside their padded boxes, only candidates can overlap.
!>
!> `polydem_inner_list` predicts straight lines for all sides and divides time into intervals. At the start of an
!> interval it classifies all candidates, and in each step it finds the boxes that are off their lines. Only the active
!> candidates are compared, a tenth of all in a drum. No box on its lines can leave its padded box, because this is
!> tested when the lines are drawn.
!>
!> A box that leaves its padded box, or will if it follows its lines, gets a new one by a search for this box alone. So
!> one fast box costs only the search for its own candidates.
module polydem_two_level
   use polydem_boxes, only: boxes_t
   use polydem_candidate_rows, only: lies_inside
   use polydem_outer_list, only: free_list, outer_list_t
   use polydem_finder, only: finder_t
   use polydem_finder_statistics, only: count_bytes, count_candidates, count_depth, count_nodes, count_passes, &
      count_rebuilds, count_searches, count_tests, count_visits, phase_filter, phase_search, phase_structure
   use polydem_index_list, only: index_list_t
   use polydem_kinds, only: dp, ip, lp
   use polydem_inner_list, only: class_cost
   use polydem_pair_changes, only: pair_changes_t
   use polydem_parallel_filter, only: parallel_filter_t
   implicit none
   private
   public :: two_level_t

   !> Length up to which intervals are not shortened to keep boxes inside their padded boxes [steps]
   integer(ip), parameter :: shortest = 16_ip

   !> Finder with a list of candidates and a filter of the candidates
   type, extends(finder_t) :: two_level_t
      private
      !> Candidates
      type(outer_list_t) :: list
      !> Lines, intervals and active candidates
      type(parallel_filter_t) :: filter
   contains
      procedure :: find
      procedure :: survey
      procedure :: release
   end type two_level_t

contains

   !> Free the candidates.
   subroutine release(self)
      class(two_level_t), intent(inout) :: self

      call free_list(self%list)
   end subroutine release

   !> Compare the active candidates; before that, begin an interval or take care of the boxes off their lines.
   subroutine find(self, boxes, changes)
      class(two_level_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      type(pair_changes_t), intent(inout) :: changes
      integer(lp) :: tests

      call self%filter%begin_step()
      tests = self%list%grids%total%tests
      if (allocated(self%list%padded)) then
         self%list%age = self%list%age + 1_lp
         if (.not. must_begin(self)) call follow_lines(self, boxes)
      else
         call self%list%prepare(boxes)
         self%filter%isa = self%isa
         self%list%isa = self%isa
         call self%filter%start(boxes%n, self%list%side)
      end if
      if (must_begin(self)) call begin_interval(self, boxes)
      call self%filter%compare_active(boxes)
      call self%work%add(count_tests, self%list%grids%total%tests - tests + int(self%filter%active%n, lp))
      call self%filter%changes%join(changes)
      call self%work%lap(phase_filter)
   end subroutine find

   !> Whether an interval must begin: when it is due, and when all boxes must be searched
   pure logical function must_begin(self)
      type(two_level_t), intent(in) :: self

      must_begin = self%filter%is_due(self%list%n) .or. self%list%must_search()
   end function must_begin

   !> Find the boxes that left their lines and review their candidates. Search for boxes that can leave their padded
   !> boxes.
   subroutine follow_lines(self, boxes)
      type(two_level_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      integer(ip) :: k, i

      call self%filter%follow_lines(boxes, self%list%padded)
      call self%work%lap(phase_structure)
      do k = 1_ip, self%filter%strays%n
         if (must_begin(self)) return
         i = self%filter%strays%at(k)
         if (.not. self%filter%leaves_often(i)) then
            call search_single(self, i, boxes)
            if (self%filter%stays_inside(i, self%list%padded(:, i))) cycle
         end if
         call self%filter%activate_candidates_of(i, self%list)
      end do
      do k = 1_ip, self%filter%off%n
         if (must_begin(self)) return
         i = self%filter%off%at(k)
         if (.not. lies_inside(boxes%bounds(:, i), self%list%padded(:, i))) call search_single(self, i, boxes)
      end do
      if (.not. must_begin(self)) call self%filter%review_left(self%list)
      call self%work%lap(phase_search)
   end subroutine follow_lines

   !> Search for a box alone, and activate its new candidates.
   subroutine search_single(self, i, boxes)
      type(two_level_t), intent(inout) :: self
      integer(ip), intent(in) :: i
      type(boxes_t), intent(in) :: boxes
      integer(ip) :: n_before, k

      n_before = self%list%n
      call self%list%search_single(i, boxes, self%filter, self%filter%changes%of(1))
      do k = n_before + 1_ip, self%list%n
         call self%filter%active%activate(k, self%list)
      end do
   end subroutine search_single

   !> Begin an interval: new lines, new padded boxes where they are needed, and a classification of all candidates.
   subroutine begin_interval(self, boxes)
      type(two_level_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      integer(ip) :: n_wanted, longest, k, i
      logical :: searched

      n_wanted = self%filter%active%n_sure + self%filter%active%n
      self%list%surplus = self%list%surplus + self%filter%surplus()
      call self%filter%begin_interval(self%list)
      call self%filter%draw_all_lines(boxes)
      longest = self%filter%length
      call choose_length(self)
      call self%work%add(count_passes, 1_lp)
      call self%work%lap(phase_structure)
      searched = self%list%should_search(self%filter%strays%n, self%filter%length)
      if (searched) then
         self%filter%length = longest
         call self%list%search_all(boxes, self%filter, n_wanted, self%filter%changes%of)
         call self%work%add(count_rebuilds, 1_lp)
         call self%filter%list_strays(self%list%padded)
      else
         do k = 1_ip, self%filter%strays%n
            call self%list%search_single(self%filter%strays%at(k), boxes, self%filter, self%filter%changes%of(1))
         end do
      end if
      call self%work%lap(phase_search)
      call self%filter%classify_all(boxes, self%list, known=.not. searched)
      self%list%surplus = self%list%surplus + class_cost* &
         real(self%list%n - self%filter%active%n - self%filter%active%n_sure, dp)
      do k = 1_ip, self%filter%strays%n
         i = self%filter%strays%at(k)
         if (.not. self%filter%stays_inside(i, self%list%padded(:, i))) &
            call self%filter%activate_candidates_of(i, self%list)
      end do
      if (searched) call self%filter%find_active_states(boxes)
      call self%work%lap(phase_structure)
   end subroutine begin_interval

   !> List the boxes that can leave their padded boxes in the interval, and shorten the interval while this makes single
   !> searches and intervals together cheaper per step.
   subroutine choose_length(self)
      type(two_level_t), intent(inout) :: self
      type(index_list_t) :: strays
      real(dp) :: cost

      call self%filter%list_strays(self%list%padded)
      do while (self%filter%length > shortest)
         cost = self%list%cost_of_singles(self%filter%strays%n)
         if (cost <= self%filter%interval_cost(self%list%n)) exit
         strays = self%filter%strays
         self%filter%length = self%filter%length/2_ip
         call self%filter%shorten_strays(self%list%padded)
         if (cost > self%filter%interval_cost(self%list%n) + &
             2.0_dp*self%list%cost_of_singles(self%filter%strays%n)) cycle
         self%filter%length = 2_ip*self%filter%length
         self%filter%strays = strays
         exit
      end do
   end subroutine choose_length

   !> Set the counters: candidates, cells, grids, and memory [B].
   subroutine survey(self)
      class(two_level_t), intent(inout) :: self

      if (.not. allocated(self%list%padded)) return
      self%work%value(count_searches) = self%list%grids%total%searches
      self%work%value(count_visits) = self%list%grids%total%visits
      self%work%value(count_candidates) = int(self%list%n, lp)
      self%work%value(count_nodes) = int(self%list%grids%n_cells, lp)
      self%work%value(count_depth) = int(self%list%grids%n_levels, lp)
      self%work%value(count_bytes) = self%list%bytes() + self%filter%bytes()
   end subroutine survey

end module polydem_two_level
