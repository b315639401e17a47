!> Candidates under a filter: only those whose state can change are compared (`polydem_inner_list`).
!>
!> Candidates can be added and removed in every step. New ones are compared until the next interval.
module polydem_filtered_candidates
   use polydem_boxes, only: boxes_t
   use polydem_kinds, only: ip, wp
   use polydem_linked_candidates, only: linked_candidates_t
   use polydem_parallel_filter, only: parallel_filter_t
   implicit none
   private
   public :: filtered_candidates_t

   !> Candidates, and the filter of their comparisons
   type, extends(linked_candidates_t) :: filtered_candidates_t
      !> Whether there is a filter
      logical :: filtered = .false.
      !> Lines, intervals and active candidates
      type(parallel_filter_t) :: filter
      !> Bounds that no box leaves, (4, box) [m]
      real(wp), allocatable, private :: everywhere(:, :)
   contains
      procedure :: add
      procedure :: drop
      procedure :: start_filter
      procedure :: is_due
      procedure :: follow_part
      procedure :: gather_left
      procedure :: classify_all
   end type filtered_candidates_t

contains

   !> Make a filter without lines.
   subroutine start_filter(self, n_boxes, side)
      class(filtered_candidates_t), intent(inout) :: self
      !> Number of boxes
      integer(ip), intent(in) :: n_boxes
      !> Typical side of a box [m]
      real(wp), intent(in) :: side

      self%filtered = .true.
      self%filter%isa = self%isa
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

      call self%linked_candidates_t%add(a, b, overlap, k)
      if (self%filtered) call self%filter%active%activate(k, self)
   end subroutine add

   !> Remove a candidate.
   pure subroutine drop(self, k)
      class(filtered_candidates_t), intent(inout) :: self
      !> Number of the candidate
      integer(ip), intent(in) :: k

      if (self%filtered) call self%filter%active%forget(k)
      call self%linked_candidates_t%drop(k)
   end subroutine drop

   !> Whether an interval must begin before the active candidates of this step are compared
   pure logical function is_due(self)
      class(filtered_candidates_t), intent(in) :: self

      is_due = self%filter%is_due(self%n)
   end function is_due

   !> Draw new lines through the boxes of a part that left theirs. After all parts call `gather_left`.
   pure subroutine follow_part(self, w, boxes)
      class(filtered_candidates_t), intent(inout) :: self
      !> Number of the part
      integer, intent(in) :: w
      !> Boxes of this step
      type(boxes_t), intent(in) :: boxes

      call self%filter%follow_part(w, boxes, self%everywhere)
   end subroutine follow_part

   !> Make the candidates of the boxes that left their lines often active, unless an interval is due.
   pure subroutine gather_left(self)
      class(filtered_candidates_t), intent(inout) :: self

      call self%filter%gather_left()
      if (.not. self%is_due()) call activate_strays(self)
   end subroutine gather_left

   !> Draw all lines at the start of an interval, classify all candidates, and compare the active ones.
   subroutine classify_all(self, boxes)
      class(filtered_candidates_t), intent(inout) :: self
      !> Boxes of this step
      type(boxes_t), intent(in) :: boxes

      call self%tidy()
      call self%filter%draw_all_lines(boxes)
      call self%filter%list_strays(self%everywhere)
      call self%filter%classify_all(boxes, self, known=.true.)
      call activate_strays(self)
      call self%filter%compare_active(boxes)
   end subroutine classify_all

   !> Make all candidates of the strays active.
   pure subroutine activate_strays(self)
      type(filtered_candidates_t), intent(inout) :: self
      integer(ip) :: k

      do k = 1_ip, self%filter%strays%n
         call self%filter%activate_candidates_of(self%filter%strays%at(k), self)
      end do
   end subroutine activate_strays

end module polydem_filtered_candidates
