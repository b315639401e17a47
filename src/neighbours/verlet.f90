!> Verlet list (Verlet 1967): pairs of boxes that overlap if each is grown by half a skin on every side.
!>
!> A step first asks whether every box still lies inside the grown box of the last rebuild. While all do, boxes that are
!> not in the list cannot overlap, whatever their displacement, rotation or change of shape, and with any rounding; the
!> list is compared in one run over plain arrays, which records where the answer changed. If one box does not, a new
!> list is made by a search in cells (`polydem_cell_grids`, levels as in the hierarchical grid), in ascending
!> order, and what is known of its pairs is carried over from the old one.
!>
!> The skin s. A thick one makes many pairs, a thin one does not last. Let a list of n boxes live for m steps and
!> hold k pairs that do not overlap. To first order k grows as s, and m too, since boxes move at some speed. Tests in
!> vain cost k per step, making lists costs R n/m per step, R tests per box being what a rebuild is worth. Their
!> sum is least where both are equal, at
!>
!>     s' = s sqrt(R n/(k m)).
!>
!> So every rebuild sets the skin, within a factor of two, from exact counts of the life of the list before; no clock is
!> asked, and runs repeat. A list that outlives its worth (k m > 4 R n: at rest, say) is made anew with the half.
module polydem_verlet
   use omp_lib, only: omp_get_max_threads
   use polydem_box_pairs, only: box_pairs_t
   use polydem_boxes, only: boxes_t
   use polydem_candidates, only: candidates_t
   use polydem_cell_grids, only: cell_grids_t, part
   use polydem_finder, only: finder_t
   use polydem_kinds, only: bp, dp, ip, lp, wp, worth_threads
   use polydem_pair_changes, only: pair_changes_t
   use polydem_size_levels, only: choose_levels, typical_side
   use polydem_work, only: count_bytes, count_candidates, count_depth, count_nodes, count_rebuilds, count_searches, &
      count_tests, count_visits, phase_filter, phase_search, phase_structure
   implicit none
   private
   public :: verlet_t

   !> Cost of a rebuild per box in units of the cost of comparing a candidate (R above; measured in drums: 30 with
   !> 2522 boxes, 58 with 12651)
   real(dp), parameter :: rebuild_cost = 30.0_dp
   !> Automatic skin at the start and its bounds in units of the typical side of a box
   real(wp), parameter :: first_skin = 0.125_wp, least_skin = 2.0_wp**(-10), greatest_skin = 4.0_wp
   !> Boxes that are looked at before asking whether one of them left its grown box
   integer(ip), parameter :: block_size = 256_ip

   !> What one thread finds in its part of the lists
   type :: worker_t
      !> Changes
      type(pair_changes_t) :: changes
      !> Whether all boxes lie inside their grown boxes
      logical :: inside = .true.
   end type worker_t

   !> Finder that keeps a list of possible pairs until a box moved too far
   type, extends(finder_t) :: verlet_t
      !> Sum of what two boxes may move towards each other before the list must be made anew [m]; 0: automatic
      real(wp) :: skin = 0.0_wp
      !> Skin in force [m]
      real(wp), private :: thickness = 0.0_wp
      !> Typical side of a box [m]
      real(wp), private :: side = 0.0_wp
      !> Steps that the list served
      integer(lp), private :: age = 0_lp
      !> Candidates that did not overlap when the list was made
      integer(lp), private :: surplus = 0_lp
      !> Grown boxes, (4, box) [m]
      real(wp), allocatable, private :: grown(:, :)
      !> Candidates, the lower box first, ascending
      type(candidates_t), private :: candidates
      !> The same in rows, and the list before; which is which alternates
      type(box_pairs_t), private :: list(2)
      !> Place of the present list in `list`
      integer, private :: now = 1
      !> Whether the candidates of the list before overlapped
      integer(bp), allocatable, private :: overlap_before(:)
      !> For rebuilds
      type(cell_grids_t), private :: grids
      type(worker_t), allocatable, private :: worker(:)
   contains
      procedure :: find
      procedure :: survey
   end type verlet_t

contains

   !> Make a new list if need be, then compare all candidates.
   subroutine find(self, boxes, changes)
      class(verlet_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      type(pair_changes_t), intent(inout) :: changes
      integer :: w
      logical :: keep

      call prepare_workers(self)
      if (allocated(self%grown)) then
         self%age = self%age + 1_lp
         keep = all_inside(self, boxes) .and. .not. outlived(self, boxes%n)
         if (.not. keep .and. .not. self%skin > 0.0_wp) call adapt_skin(self, boxes%n)
      else
         call start(self, boxes)
         keep = .false.
      end if
      call self%work%lap(phase_structure)
      if (.not. keep) call rebuild(self, boxes)
      call compare_candidates(self, boxes)
      if (.not. keep) self%surplus = int(self%candidates%n, lp) - &
         count(self%candidates%overlap(1:self%candidates%n) /= 0_bp, kind=lp)
      do w = 1, size(self%worker)
         call changes%append(self%worker(w)%changes)
      end do
      call self%work%lap(phase_filter)
   end subroutine find

   subroutine prepare_workers(self)
      type(verlet_t), intent(inout) :: self
      integer :: w

      if (allocated(self%worker)) then
         if (size(self%worker) /= omp_get_max_threads()) deallocate (self%worker)
      end if
      if (.not. allocated(self%worker)) allocate (self%worker(omp_get_max_threads()))
      do w = 1, size(self%worker)
         call self%worker(w)%changes%clear()
      end do
   end subroutine prepare_workers

   !> Begin with an empty list.
   subroutine start(self, boxes)
      type(verlet_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      integer(ip), allocatable :: level(:)
      real(dp), allocatable :: largest(:)
      integer :: n_levels

      self%side = typical_side(boxes)
      self%thickness = self%skin
      if (.not. self%skin > 0.0_wp) self%thickness = first_skin*self%side
      call choose_levels(boxes, self%thickness, n_levels, level, largest)
      call self%grids%set_levels(n_levels, level, boxes%fixed(1:boxes%n))
      call self%list(1)%start(boxes%n)
      call self%list(2)%start(boxes%n)
      allocate (self%grown(4, boxes%n), self%candidates%box(2, 0), self%candidates%overlap(0), self%overlap_before(0))
   end subroutine start

   !> Whether every box lies inside its grown box
   logical function all_inside(self, boxes)
      type(verlet_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      integer(ip) :: low, high
      integer :: w

      !$omp parallel do if (boxes%n > worth_threads) schedule(static, 1) default(none) &
      !$omp    shared(self, boxes) private(w, low, high)
      do w = 1, size(self%worker)
         call part(1_ip, boxes%n, size(self%worker), w, low, high)
         self%worker(w)%inside = part_inside(boxes%n, boxes%bounds, self%grown, low, high)
      end do
      !$omp end parallel do
      all_inside = all(self%worker%inside)
   end function all_inside

   !> The same for boxes low..high, block by block without branches
   pure logical function part_inside(n, bounds, grown, low, high) result(inside)
      integer(ip), intent(in) :: n, low, high
      real(wp), intent(in) :: bounds(4, n), grown(4, n)
      real(wp) :: least(4)
      integer(ip) :: from, i

      inside = .true.
      do from = low, high, block_size
         least = 0.0_wp
         do i = from, min(from + block_size - 1_ip, high)
            least(1:2) = min(least(1:2), bounds(1:2, i) - grown(1:2, i))
            least(3:4) = min(least(3:4), grown(3:4, i) - bounds(3:4, i))
         end do
         inside = all(least >= 0.0_wp)
         if (.not. inside) return
      end do
   end function part_inside

   !> Whether an automatic skin has proved much too thick
   pure logical function outlived(self, n)
      type(verlet_t), intent(in) :: self
      integer(ip), intent(in) :: n

      outlived = real(self%surplus, dp)*real(self%age, dp) > 4.0_dp*rebuild_cost*real(n, dp) .and. &
         .not. self%skin > 0.0_wp .and. self%thickness > least_skin*self%side
   end function outlived

   !> Set the skin from the life of the list.
   pure subroutine adapt_skin(self, n)
      type(verlet_t), intent(inout) :: self
      integer(ip), intent(in) :: n
      real(dp) :: factor

      factor = sqrt(rebuild_cost*real(n, dp)/(real(max(self%surplus, 1_lp), dp)*real(self%age, dp)))
      self%thickness = self%thickness*real(min(max(factor, 0.5_dp), 2.0_dp), wp)
      self%thickness = min(max(self%thickness, least_skin*self%side), greatest_skin*self%side)
   end subroutine adapt_skin

   !> Make a new list of candidates.
   subroutine rebuild(self, boxes)
      type(verlet_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      integer(bp), allocatable :: spare(:)
      integer(lp) :: tests
      integer(ip) :: low, high
      integer :: w

      self%age = 0_lp
      self%grown(1:2, :) = boxes%bounds(1:2, 1:boxes%n) - 0.5_wp*self%thickness
      self%grown(3:4, :) = boxes%bounds(3:4, 1:boxes%n) + 0.5_wp*self%thickness
      call self%grids%build(boxes%n, self%grown)
      call self%work%add(count_rebuilds, 1_lp)
      call self%work%lap(phase_structure)
      tests = self%grids%total%tests
      call self%grids%search(boxes)
      call self%work%add(count_tests, self%grids%total%tests - tests)
      self%work%value(count_searches) = self%grids%total%searches
      self%work%value(count_visits) = self%grids%total%visits
      self%now = 3 - self%now
      call self%list(self%now)%gather(self%grids%found)
      call move_alloc(self%overlap_before, spare)
      call move_alloc(self%candidates%overlap, self%overlap_before)
      call move_alloc(spare, self%candidates%overlap)
      self%candidates%n = self%list(self%now)%n()
      call reserve(self%candidates)
      !$omp parallel do if (boxes%n > worth_threads) schedule(static, 1) default(none) &
      !$omp    shared(self, boxes) private(w, low, high)
      do w = 1, size(self%worker)
         call part(1_ip, boxes%n, size(self%worker), w, low, high)
         call self%list(self%now)%sort_rows(low, high)
         call carry_over(self%list(3 - self%now), self%overlap_before, self%list(self%now), low, high, boxes%body, &
                         self%candidates%box, self%candidates%overlap, self%worker(w)%changes)
      end do
      !$omp end parallel do
      call self%work%lap(phase_search)
   end subroutine rebuild

   !> Fill some rows of the candidates with what is known of them: those of the list before overlapped or not, new ones
   !> did not. Those that overlapped and are no candidates any more have ceased to.
   pure subroutine carry_over(before, overlap_before, now, low, high, body, box, overlap, changes)
      !> The list before, and whether its candidates overlapped
      type(box_pairs_t), intent(in) :: before
      integer(bp), intent(in) :: overlap_before(:)
      !> The new list
      type(box_pairs_t), intent(in) :: now
      !> First and last row
      integer(ip), intent(in) :: low, high
      !> Body of each box
      integer(ip), intent(in) :: body(:)
      !> Candidates to fill, (2, candidate), and whether they overlapped
      integer(ip), intent(inout) :: box(:, :)
      integer(bp), intent(inout) :: overlap(:)
      type(pair_changes_t), intent(inout) :: changes
      integer(ip) :: row, old, k

      do row = low, high
         old = before%first(row)
         do k = now%first(row), now%first(row + 1_ip) - 1_ip
            box(1, k) = row
            box(2, k) = now%partner(k)
            overlap(k) = 0_bp
            do while (old < before%first(row + 1_ip))
               if (before%partner(old) >= now%partner(k)) exit
               if (overlap_before(old) /= 0_bp) call changes%record(body(row), body(before%partner(old)), -1_ip)
               old = old + 1_ip
            end do
            if (old == before%first(row + 1_ip)) cycle
            if (before%partner(old) /= now%partner(k)) cycle
            overlap(k) = overlap_before(old)
            old = old + 1_ip
         end do
         do old = old, before%first(row + 1_ip) - 1_ip
            if (overlap_before(old) /= 0_bp) call changes%record(body(row), body(before%partner(old)), -1_ip)
         end do
      end do
   end subroutine carry_over

   !> Compare the boxes of all candidates.
   subroutine compare_candidates(self, boxes)
      type(verlet_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      integer(ip) :: low, high
      integer :: w

      !$omp parallel do if (self%candidates%n > worth_threads) schedule(static, 1) default(none) &
      !$omp    shared(self, boxes) private(w, low, high)
      do w = 1, size(self%worker)
         call part(1_ip, self%candidates%n, size(self%worker), w, low, high)
         call self%candidates%compare(low, high, boxes%bounds, boxes%body, self%worker(w)%changes)
      end do
      !$omp end parallel do
      call self%work%add(count_tests, int(self%candidates%n, lp))
   end subroutine compare_candidates

   !> Make room for the candidates; their old values are not needed.
   pure subroutine reserve(candidates)
      type(candidates_t), intent(inout) :: candidates
      integer(ip) :: n

      n = candidates%n + candidates%n/4_ip + 64_ip
      if (size(candidates%overlap) < candidates%n) then
         deallocate (candidates%overlap)
         allocate (candidates%overlap(n))
      end if
      if (size(candidates%box, 2) >= candidates%n) return
      deallocate (candidates%box)
      allocate (candidates%box(2, n))
   end subroutine reserve

   !> Candidates, cells, grids and memory.
   subroutine survey(self)
      class(verlet_t), intent(inout) :: self

      if (.not. allocated(self%grown)) return
      self%work%value(count_candidates) = int(self%candidates%n, lp)
      self%work%value(count_nodes) = int(self%grids%n_cells, lp)
      self%work%value(count_depth) = int(self%grids%n_levels, lp)
      self%work%value(count_bytes) = self%list(1)%bytes() + self%list(2)%bytes() + self%grids%bytes() + &
         int(storage_size(self%candidates%box)/8, lp)*size(self%candidates%box, kind=lp) + &
         int(storage_size(self%overlap_before)/8, lp)*(size(self%candidates%overlap, kind=lp) + &
         size(self%overlap_before, kind=lp)) + int(storage_size(self%grown)/8, lp)*size(self%grown, kind=lp)
   end subroutine survey

end module polydem_verlet
