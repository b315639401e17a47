!> Candidates under a filter: only those whose state can change are compared (`polydem_line_filter`).
!>
!> Candidates can be added and removed in every step. New ones are compared until the next interval.
module polydem_filtered_candidates
   use polydem_boxes, only: boxes_t
   use polydem_candidates, only: candidates_t
   use polydem_kinds, only: ip, wp
   use polydem_pair_changes, only: pair_changes_t
   use polydem_parallel_filter, only: parallel_filter_t
   implicit none
   private
   public :: filtered_candidates_t

   !> Candidates, and the filter of their comparisons
   type, extends(candidates_t) :: filtered_candidates_t
      !> Whether to use the filter; set before the first step
      logical :: filtered = .false.
      !> Lines, intervals and active candidates
      type(parallel_filter_t) :: filter
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

   !> Add a candidate; it is active.
   pure subroutine add(self, a, b, overlap, k)
      class(filtered_candidates_t), intent(inout) :: self
      !> First box
      integer(ip), intent(in) :: a
      !> Second box
      integer(ip), intent(in) :: b
      !> Whether they overlap
      logical, intent(in) :: overlap
      !> Its number
      integer(ip), intent(out) :: k

      call self%candidates_t%add(a, b, overlap, k)
      if (self%filtered) call self%filter%active%activate(k, self)
   end subroutine add

   !> Remove a candidate.
   pure subroutine drop(self, k)
      class(filtered_candidates_t), intent(inout) :: self
      !> Number of the candidate
      integer(ip), intent(in) :: k

      if (self%filtered) call self%filter%active%forget(k)
      call self%candidates_t%drop(k)
   end subroutine drop

   !> Compare the active candidates of a step; before that, begin an interval or review the boxes off their lines.
   subroutine compare_active(self, boxes, changes)
      class(filtered_candidates_t), intent(inout) :: self
      !> Boxes of this step
      type(boxes_t), intent(in) :: boxes
      !> List of changes; the new changes are appended
      type(pair_changes_t), intent(inout) :: changes
      integer(ip) :: k

      call self%filter%begin_step()
      if (.not. self%filter%is_due(self%n)) then
         call self%filter%follow_lines(boxes, self%everywhere)
         if (.not. self%filter%is_due(self%n)) then
            do k = 1_ip, self%filter%strays%n
               call self%filter%activate_candidates_of(self%filter%strays%at(k), self)
            end do
            call self%filter%review_left(self)
         end if
      end if
      if (self%filter%is_due(self%n)) then
         call self%filter%begin_interval(self)
         call self%tidy()
         call self%filter%draw_all_lines(boxes)
         call self%filter%list_strays(self%everywhere)
         call self%filter%classify_all(boxes, self, known=.true.)
         do k = 1_ip, self%filter%strays%n
            call self%filter%activate_candidates_of(self%filter%strays%at(k), self)
         end do
      end if
      call self%filter%compare_active(boxes)
      call self%filter%changes%join(changes)
   end subroutine compare_active

end module polydem_filtered_candidates
