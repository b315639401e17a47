!> Candidates of padded boxes: a Verlet list in which single boxes can get a new padded box.
!>
!> A *padded box* is a box enlarged by a margin h on every side, and further in the direction in which its sides move.
!> Pairs of boxes whose padded boxes overlap are candidates. `search_all` makes all padded boxes and finds all
!> candidates in cells (`polydem_cell_grids`); they form rows. `search_single` makes a new padded box for one box, finds
!> its new candidates in the cells of the last `search_all`, and appends them behind the rows. Boxes with such a padded
!> box are *moved*; the cells contain their former padded boxes, so they are inserted late into the cells that the new
!> ones cover.
!>
!> The margin is set where two costs are equal: the searches, and the work that is done on candidates that are separate.
!> Both are counted, so runs are reproducible. `must_search` asks for a search of all boxes when single searches have
!> cost as much.
module polydem_outer_list
   use omp_lib, only: omp_get_max_threads
   use polydem_box_lines, only: box_lines_t
   use polydem_boxes, only: boxes_t
   use polydem_candidate_rows, only: candidate_rows_t
   use polydem_candidates, only: overlapping
   use polydem_grid_query, only: grid_query_t
   use polydem_grow, only: grow
   use polydem_index_list, only: index_list_t
   use polydem_kinds, only: bp, dp, ip, lp, wp, min_parallel_size
   use polydem_pair_changes, only: pair_changes_t
   use polydem_size_levels, only: choose_levels, typical_side
   use polydem_thread_changes, only: part
   implicit none
   private
   public :: outer_list_t, free_list

   !> Costs in units of a comparison of two boxes (measured): a search for all boxes, per box and per candidate; a
   !> search for a single box without its comparisons
   real(dp), parameter :: box_cost = 50.0_dp, candidate_cost = 22.0_dp, single_cost = 800.0_dp
   !> Initial value, lower and upper bound of the margin in units of the typical side of a box
   real(wp), parameter :: first_margin = 0.2_wp, least_margin = 2.0_wp**(-10), greatest_margin = 1.0_wp
   !> Largest extension of a padded box in the direction of motion, in units of the margin
   real(wp), parameter :: most_stretch = 4.0_wp

   !> Rows of the last search for all boxes, and behind them the candidates of single searches
   type, extends(candidate_rows_t) :: outer_list_t
      !> Padded boxes, (4, box) [m]
      real(wp), allocatable :: padded(:, :)
      !> Grids of the padded boxes of the last search for all boxes
      type(grid_query_t) :: grids
      !> Typical side of a box [m]
      real(wp) :: side = 0.0_wp
      !> Number of steps since the last search for all boxes, and between the last two
      integer(lp) :: age = 0_lp, life = 0_lp
      !> Work on separate candidates since the last search for all boxes [comparisons]
      real(dp) :: surplus = 0.0_dp
      !> Cost of single searches since then [comparisons]
      real(dp), private :: singles = 0.0_dp
      !> Whether there was a search for all boxes
      logical, private :: searched = .false.
      !> Margin of the padded boxes [m]
      real(wp), private :: margin = 0.0_wp
      !> Number of candidates in the rows
      integer(ip), private :: n_listed = 0_ip
      !> First link of each box to the candidates behind the rows, (box), 0: none. The link 2(k - 1) + s is box s of
      !> candidate k behind the rows
      integer(ip), allocatable, private :: first_link(:)
      !> Next link of the same box, (2, candidate behind the rows), 0: none
      integer(ip), allocatable, private :: next_link(:, :)
      !> Boxes that moved
      type(index_list_t), private :: moved
      !> 1 if a box is in `moved`, else 0, (box)
      integer(bp), allocatable, private :: is_moved(:)
      !> Number of the single search that last met a box, (box)
      integer(ip), allocatable, private :: met_by(:)
      !> Number of single searches
      integer(ip), private :: n_single = 0_ip
      !> Boxes that a single search found, and the candidates that its box had
      type(index_list_t), private :: near, known
   contains
      procedure :: prepare
      procedure :: must_search
      procedure :: should_search
      procedure :: cost_of_singles
      procedure :: search_all
      procedure :: search_single
      procedure :: append_candidates_of
      procedure :: append_candidates_of_all
      procedure :: bytes => bytes_of_all
   end type outer_list_t

contains

   !> Free the memory of a list. gfortran 12 frees a part of it only where a polymorphic object that has the list is
   !> deallocated.
   pure subroutine free_list(list)
      type(outer_list_t), intent(out) :: list

      list%n = 0_ip
   end subroutine free_list

   !> Choose margin and grids, and make an empty list; no box is inside its padded box.
   subroutine prepare(self, boxes)
      class(outer_list_t), intent(inout) :: self
      !> Boxes of the first step
      type(boxes_t), intent(in) :: boxes
      integer(ip), allocatable :: level(:)
      real(dp), allocatable :: largest(:)
      integer :: n_levels

      self%side = typical_side(boxes)
      self%margin = first_margin*self%side
      call choose_levels(boxes, 2.0_wp*self%margin, n_levels, level, largest)
      call self%grids%set_levels(n_levels, level, boxes%fixed(1:boxes%n))
      self%grids%fine = .true.
      call self%start(boxes%n)
      allocate (self%padded(4, boxes%n))
      self%padded = spread([1.0_wp, 1.0_wp, -1.0_wp, -1.0_wp]*huge(1.0_wp), 2, boxes%n)
      allocate (self%first_link(boxes%n), self%met_by(boxes%n), source=0_ip)
      allocate (self%is_moved(boxes%n), source=0_bp)
      allocate (self%next_link(2, 0))
   end subroutine prepare

   !> Whether all boxes must be searched: single searches cost as much, or the margin is much too wide
   pure logical function must_search(self)
      class(outer_list_t), intent(in) :: self

      must_search = .not. self%searched .or. self%singles > cost_of_all(self) .or. &
         (self%surplus > 4.0_dp*cost_of_all(self) .and. self%margin > least_margin*self%side)
   end function must_search

   !> Whether it is best to search all boxes now: single searches in the next interval would cost more per step than all
   !> searches since the last one for all boxes, or more than another one
   pure logical function should_search(self, n_strays, steps)
      class(outer_list_t), intent(in) :: self
      !> Number of boxes that need a single search now
      integer(ip), intent(in) :: n_strays
      !> Length of the interval
      integer(ip), intent(in) :: steps
      real(dp) :: now, so_far

      now = self%cost_of_singles(n_strays)
      so_far = cost_of_all(self) + self%singles
      should_search = self%must_search() .or. self%singles + now > cost_of_all(self) .or. &
         now*real(self%age, dp) > so_far*real(steps, dp)
   end function should_search

   !> Cost of a search for all boxes [comparisons]
   pure real(dp) function cost_of_all(self)
      type(outer_list_t), intent(in) :: self

      cost_of_all = box_cost*real(size(self%is_moved), dp) + candidate_cost*real(self%n, dp)
   end function cost_of_all

   !> Cost of single searches [comparisons]
   pure real(dp) function cost_of_singles(self, n_strays)
      class(outer_list_t), intent(in) :: self
      !> Number of boxes
      integer(ip), intent(in) :: n_strays

      cost_of_singles = real(n_strays, dp)* &
         (single_cost + real(self%grids%late%n_wide(), dp))
   end function cost_of_singles

   !> Set the margin, make all padded boxes, and search for all candidates. Their states are not found. The number of
   !> candidates of the first search shows how much a wider margin costs: little where boxes are far apart.
   subroutine search_all(self, boxes, lines, n_wanted, changes)
      class(outer_list_t), intent(inout) :: self
      !> Boxes of this step
      type(boxes_t), intent(in) :: boxes
      !> Lines of the boxes in this step
      class(box_lines_t), intent(in) :: lines
      !> Number of candidates that overlap or may overlap soon
      integer(ip), intent(in) :: n_wanted
      !> Changes of each thread; appended, (thread)
      type(pair_changes_t), intent(inout) :: changes(:)
      real(dp) :: widen

      call adapt_margin(self, boxes%n, n_wanted)
      call reset(self)
      call self%update_states(boxes, self%padded, changes)
      call find_candidates(self, boxes, lines)
      if (.not. self%searched) then
         widen = sqrt(0.5_dp + box_cost*real(boxes%n, dp)/(candidate_cost*real(max(1_ip, sum(self%grids%found%n)), dp)))
         self%margin = self%margin*real(min(max(widen, 1.0_dp), 2.0_dp), wp)
         if (widen > 1.0_dp) call find_candidates(self, boxes, lines)
      end if
      call self%grids%receive_fixed(self%padded)
      call self%replace(self%grids%found, boxes, changes, with_states=.false.)
      self%n_listed = self%n
      self%searched = .true.
      self%first_link = 0_ip
      call self%list_by_second()
   end subroutine search_all

   !> Make all padded boxes, and find the pairs of those that overlap.
   subroutine find_candidates(self, boxes, lines)
      type(outer_list_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      class(box_lines_t), intent(in) :: lines
      integer(ip) :: low, high
      integer :: w, n_parts

      n_parts = omp_get_max_threads()
      !$omp parallel do if (boxes%n > min_parallel_size) schedule(static, 1) default(none) &
      !$omp    shared(self, boxes, lines, n_parts) private(w, low, high)
      do w = 1, n_parts
         call part(boxes%n, n_parts, w, low, high)
         call fatten(self, low, high, boxes%bounds, lines)
      end do
      !$omp end parallel do
      call self%grids%build(boxes%n, self%padded)
      call self%grids%search(boxes)
   end subroutine find_candidates

   !> Set the margin from the costs of the last list. The first list was made without velocities, so its life says
   !> nothing.
   pure subroutine adapt_margin(self, n_boxes, n_wanted)
      type(outer_list_t), intent(inout) :: self
      integer(ip), intent(in) :: n_boxes, n_wanted
      real(dp) :: searches, factor

      if (self%life == 0_lp) return
      searches = box_cost*real(n_boxes, dp) + candidate_cost*real(n_wanted, dp) + self%singles
      factor = sqrt(searches/max(self%surplus, 1.0_dp))
      self%margin = self%margin*real(min(max(factor, 0.5_dp), 2.0_dp), wp)
      self%margin = min(max(self%margin, least_margin*self%side), greatest_margin*self%side)
   end subroutine adapt_margin

   !> Begin the counts of a new list; no box has moved.
   pure subroutine reset(self)
      type(outer_list_t), intent(inout) :: self
      integer(ip) :: k

      self%life = self%age
      self%age = 0_lp
      self%singles = 0.0_dp
      self%surplus = 0.0_dp
      do k = 1_ip, self%moved%n
         self%is_moved(self%moved%at(k)) = 0_bp
      end do
      self%moved%n = 0_ip
   end subroutine reset

   !> Make the padded boxes low to high.
   pure subroutine fatten(self, low, high, bounds, lines)
      type(outer_list_t), intent(inout) :: self
      integer(ip), intent(in) :: low, high
      real(wp), intent(in), contiguous :: bounds(:, :)
      class(box_lines_t), intent(in) :: lines
      real(wp) :: reach(4), steps, most
      integer(ip) :: i

      steps = real(max(int(lines%length, lp), min(self%life, 1000_lp)), wp)
      most = most_stretch*self%margin
      do i = low, high
         reach = lines%reaches(i, steps)
         self%padded(1:2, i) = bounds(1:2, i) - (self%margin + min(most, max(0.0_wp, max(-reach(1:2), -reach(3:4)))))
         self%padded(3:4, i) = bounds(3:4, i) + (self%margin + min(most, max(0.0_wp, max(reach(1:2), reach(3:4)))))
      end do
   end subroutine fatten

   !> Make room for the links of n candidates behind the rows.
   pure subroutine reserve_links(self, n)
      type(outer_list_t), intent(inout) :: self
      integer(ip), intent(in) :: n
      integer(ip) :: room

      room = size(self%next_link, 2, kind=ip)
      if (room < n) call grow(self%next_link, room, n + n/4_ip + 64_ip)
   end subroutine reserve_links

   !> Give a box a new padded box, and append its new candidates.
   subroutine search_single(self, i, boxes, lines, changes)
      class(outer_list_t), intent(inout) :: self
      !> Box
      integer(ip), intent(in) :: i
      !> Boxes of this step
      type(boxes_t), intent(in) :: boxes
      !> Lines of the boxes in this step
      class(box_lines_t), intent(in) :: lines
      !> New candidates that overlap are appended
      type(pair_changes_t), intent(inout) :: changes
      integer(lp) :: tests
      integer(ip) :: k, j

      call fatten(self, i, i, boxes%bounds, lines)
      tests = self%grids%total%tests
      call meet_candidates(self, i)
      self%near%n = 0_ip
      call self%grids%search_window(self%padded(:, i), self%near)
      do k = 1_ip, self%near%n
         j = self%near%at(k)
         if (self%is_moved(j) == 0_bp) call add_candidate(self, i, j, boxes, changes)
      end do
      self%near%n = 0_ip
      call self%grids%search_late(self%padded(:, i), self%padded, self%near)
      do k = 1_ip, self%near%n
         call add_candidate(self, i, self%near%at(k), boxes, changes)
      end do
      self%singles = self%singles + single_cost + real(self%grids%total%tests - tests, dp)
      call self%grids%add_late(i, self%padded(:, i))
      if (self%is_moved(i) /= 0_bp) return
      self%is_moved(i) = 1_bp
      call self%moved%push(i)
   end subroutine search_single

   !> Mark a box and the boxes of its candidates as met.
   subroutine meet_candidates(self, i)
      type(outer_list_t), intent(inout) :: self
      integer(ip), intent(in) :: i
      integer(ip) :: k

      if (self%n_single == huge(1_ip)) then
         self%met_by = 0_ip
         self%n_single = 0_ip
      end if
      self%n_single = self%n_single + 1_ip
      self%met_by(i) = self%n_single
      self%known%n = 0_ip
      call self%append_candidates_of(i, self%known)
      do k = 1_ip, self%known%n
         self%met_by(self%box(1, self%known%at(k))) = self%n_single
         self%met_by(self%box(2, self%known%at(k))) = self%n_single
      end do
   end subroutine meet_candidates

   !> Append the candidates of a box to a list.
   pure subroutine append_candidates_of(self, i, list)
      class(outer_list_t), intent(in) :: self
      !> Box
      integer(ip), intent(in) :: i
      !> Numbers of candidates
      type(index_list_t), intent(inout) :: list

      call self%candidate_rows_t%append_candidates_of(i, list)
      call append_linked(self, i, list)
   end subroutine append_candidates_of

   !> Append the candidates of several boxes to a list.
   pure subroutine append_candidates_of_all(self, boxes, list)
      class(outer_list_t), intent(in) :: self
      !> The boxes
      type(index_list_t), intent(in) :: boxes
      !> Numbers of candidates
      type(index_list_t), intent(inout) :: list
      integer(ip) :: k

      call self%candidate_rows_t%append_candidates_of_all(boxes, list)
      do k = 1_ip, boxes%n
         call append_linked(self, boxes%at(k), list)
      end do
   end subroutine append_candidates_of_all

   !> Append the candidates of a box behind the rows to a list.
   pure subroutine append_linked(self, i, list)
      type(outer_list_t), intent(in) :: self
      integer(ip), intent(in) :: i
      type(index_list_t), intent(inout) :: list
      integer(ip) :: link, k

      link = self%first_link(i)
      do while (link /= 0_ip)
         k = shiftr(link + 1_ip, 1)
         call list%push(self%n_listed + k)
         link = self%next_link(2_ip - iand(link, 1_ip), k)
      end do
   end subroutine append_linked

   !> Append a candidate, unless it is one already or no pair is possible.
   subroutine add_candidate(self, i, j, boxes, changes)
      type(outer_list_t), intent(inout) :: self
      integer(ip), intent(in) :: i, j
      type(boxes_t), intent(in) :: boxes
      type(pair_changes_t), intent(inout) :: changes
      integer(ip) :: k, s
      logical :: overlap

      if (self%met_by(j) == self%n_single) return
      self%met_by(j) = self%n_single
      if (.not. boxes%may_meet(i, j)) return
      overlap = overlapping(boxes%bounds(:, i), boxes%bounds(:, j))
      if (overlap) call changes%record(boxes%piece(i), boxes%piece(j), 1_ip)
      call self%append(min(i, j), max(i, j), overlap)
      k = self%n - self%n_listed
      call reserve_links(self, k)
      do s = 1_ip, 2_ip
         self%next_link(s, k) = self%first_link(self%box(s, self%n))
         self%first_link(self%box(s, self%n)) = 2_ip*(k - 1_ip) + s
      end do
   end subroutine add_candidate

   !> Allocated memory [B]
   pure integer(lp) function bytes_of_all(self) result(bytes)
      class(outer_list_t), intent(in) :: self

      bytes = 0_lp
      if (.not. allocated(self%padded)) return
      bytes = self%candidate_rows_t%bytes() + self%grids%bytes() + size(self%is_moved, kind=lp) + &
         (int(storage_size(self%padded), lp)*size(self%padded, kind=lp) + int(storage_size(self%first_link), lp)* &
          (2_lp*size(self%first_link, kind=lp) + size(self%next_link, kind=lp)))/8_lp
   end function bytes_of_all

end module polydem_outer_list
