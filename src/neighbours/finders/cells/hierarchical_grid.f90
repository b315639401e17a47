!> Hierarchical grid (Krijgsman, Ogarko & Luding 2014): one grid per size class of boxes.
!>
!> A box belongs to the finest grid whose cells are at least as large as the box. It is compared with boxes of its own
!> grid as in linked cells, and with the boxes in those cells of every coarser grid that it reaches. Larger boxes do not
!> search for smaller ones ("bottom-up" in that paper). The number of grids and their cell sizes follow from the size
!> distribution and the work estimate of that paper (`polydem_size_levels`).
!>
!> Krijgsman et al. store cells in a hash table and move only particles whose cell changed. Here all boxes are sorted
!> again at every step, which costs a few nanoseconds per box. The cell size follows the largest box of the level, so
!> the search does not depend on assumptions about sizes. The levels are chosen at the start, from the sides that boxes
!> can have at any angle, and again if a box exceeds the size of its level by `tolerance`. Boxes of nearly equal size
!> form one level; the finder then works and costs the same as `linked_cells`.
module polydem_hierarchical_grid
   use polydem_boxes, only: boxes_t
   use polydem_kinds, only: dp, ip, wp
   use polydem_linked_cells, only: linked_cells_t
   use polydem_pair_changes, only: pair_changes_t
   use polydem_size_levels, only: choose_levels
   implicit none
   private
   public :: hierarchical_grid_t

   !> Relative excess over the size of its level at which a box triggers a new choice of levels
   real(dp), parameter :: tolerance = 0.25_dp

   !> Finder that bins all boxes at every step, into grids by size
   type, extends(linked_cells_t) :: hierarchical_grid_t
      private
      !> Largest side of a box assumed in the choice of the levels, (level) [m]
      real(dp), allocatable :: largest(:)
   contains
      procedure :: find
   end type hierarchical_grid_t

contains

   !> Choose levels if necessary, then search as with one grid.
   subroutine find(self, boxes, changes)
      class(hierarchical_grid_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      type(pair_changes_t), intent(inout) :: changes
      integer(ip), allocatable :: level(:)
      integer :: n_levels

      if (.not. fits(self)) then
         call choose_levels(boxes, 0.0_wp, n_levels, level, self%largest)
         call self%grids%set_levels(n_levels, level, boxes%fixed(1:boxes%n))
      end if
      call self%linked_cells_t%find(boxes, changes)
   end subroutine find

   !> Whether levels have been chosen and the boxes of the last step were not much larger than assumed in that choice
   pure logical function fits(self)
      type(hierarchical_grid_t), intent(in) :: self
      integer :: l

      fits = allocated(self%largest)
      if (.not. fits) return
      do l = 1, self%grids%n_levels
         fits = fits .and. real(maxval(self%grids%extent(l)%side), dp) <= (1.0_dp + tolerance)*self%largest(l)
      end do
   end function fits

end module polydem_hierarchical_grid
