!> Linked cells: all boxes are binned into a grid at every step. Each box is compared with the boxes of its own cell and
!> of the neighbouring cells (`polydem_cell_grids`).
!>
!> A cell is at least as wide as the widest free box and at least as high as the highest one. This is the weakness of
!> the method: if one free box is as large as the scene, there is a single cell, and all pairs are compared.
!> `hierarchical_grid` avoids this. Between steps the finder stores only the list of pairs. The differences between two
!> lists are the changes.
module polydem_linked_cells
   use polydem_box_pairs, only: box_pairs_t, record_differences
   use polydem_boxes, only: boxes_t
   use polydem_cell_grids, only: cell_grids_t
   use polydem_finder, only: finder_t
   use polydem_finder_statistics, only: count_bytes, count_candidates, count_depth, count_nodes, count_rebuilds, &
      count_searches, count_tests, count_visits, phase_filter, phase_search, phase_structure
   use polydem_kinds, only: ip, lp, min_parallel_size
   use polydem_pair_changes, only: pair_changes_t
   use polydem_thread_changes, only: part, thread_changes_t
   implicit none
   private
   public :: linked_cells_t

   !> Finder that bins all boxes at every step
   type, extends(finder_t) :: linked_cells_t
      !> Grid; extensions use several grids
      type(cell_grids_t) :: grids
      !> Overlapping boxes of this step and of the previous step, in alternating order
      type(box_pairs_t), private :: list(2)
      !> Index of this step in `list`
      integer, private :: now = 1
      !> Changes that each thread recorded
      type(thread_changes_t), private :: part_changes
   contains
      procedure :: find
      procedure :: survey
   end type linked_cells_t

contains

   !> Bin the boxes, search for pairs, sort them and record the differences from the previous step.
   subroutine find(self, boxes, changes)
      class(linked_cells_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      type(pair_changes_t), intent(inout) :: changes

      if (.not. allocated(self%list(1)%first)) then
         call self%list(1)%start(boxes%n)
         call self%list(2)%start(boxes%n)
      end if
      if (self%grids%n_levels == 0) call self%grids%set_levels(1, spread(1_ip, 1, boxes%n), boxes%fixed(1:boxes%n))
      call self%grids%build(boxes%n, boxes%bounds)
      call self%work%add(count_rebuilds, 1_lp)
      call self%work%lap(phase_structure)
      call self%grids%search(boxes)
      self%work%value(count_tests) = self%grids%total%tests
      self%work%value(count_visits) = self%grids%total%visits
      self%work%value(count_searches) = self%grids%total%searches
      call self%work%lap(phase_search)
      self%now = 3 - self%now
      call self%list(self%now)%gather(self%grids%found)
      call record_rows(self, boxes, changes)
      call self%work%lap(phase_filter)
   end subroutine find

   !> Sort the rows of the list and compare them with those of the previous step.
   subroutine record_rows(self, boxes, changes)
      class(linked_cells_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      type(pair_changes_t), intent(inout) :: changes
      integer(ip) :: low, high
      integer :: w

      call self%part_changes%clear()
      !$omp parallel do if (boxes%n > min_parallel_size) schedule(static, 1) default(none) &
      !$omp    shared(self, boxes) private(w, low, high)
      do w = 1, self%part_changes%n_threads()
         call part(boxes%n, self%part_changes%n_threads(), w, low, high)
         call self%list(self%now)%sort_rows(low, high)
         call record_differences(self%list(3 - self%now), self%list(self%now), low, high, boxes%piece, &
                                 self%part_changes%of(w))
      end do
      !$omp end parallel do
      call self%part_changes%join(changes)
   end subroutine record_rows

   !> Set the counters: pairs stored between steps, cells, grids, and memory [B].
   subroutine survey(self)
      class(linked_cells_t), intent(inout) :: self

      self%work%value(count_candidates) = int(self%list(self%now)%n(), lp)
      self%work%value(count_nodes) = int(self%grids%n_cells, lp)
      self%work%value(count_depth) = int(self%grids%n_levels, lp)
      self%work%value(count_bytes) = self%list(1)%bytes() + self%list(2)%bytes() + self%grids%bytes()
   end subroutine survey

end module polydem_linked_cells
