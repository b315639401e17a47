!> Hierarchical grid (Krijgsman, Ogarko & Luding 2014): one grid per size of boxes.
!>
!> A box belongs to the finest grid whose cells hold it. It is compared with boxes of its own grid as in linked cells,
!> and with those in the cells of every coarser grid that it reaches; larger boxes do not look for smaller ones
!> ("bottom-up" in their words). Number and cell sizes of the grids come from the distribution of sizes by their
!> estimate of the work (`polydem_size_levels`).
!>
!> They keep cells in a hash table and move only the particles that changed their cell. Here all boxes are sorted
!> anew at every step, which costs a few nanoseconds per box, and cells follow the largest box of their
!> level, so that a search does not depend on what was promised of the sizes. The levels are chosen at the start,
!> from the sides that boxes can have at any angle, and again if a box outgrows its level by `tolerance`.
!> Boxes that are nearly alike make one level; then this is `linked_cells`, and costs the same.
module polydem_hierarchical_grid
   use polydem_boxes, only: boxes_t
   use polydem_kinds, only: dp, ip, wp
   use polydem_linked_cells, only: linked_cells_t
   use polydem_pair_changes, only: pair_changes_t
   use polydem_size_levels, only: choose_levels
   implicit none
   private
   public :: hierarchical_grid_t

   !> Share by which boxes may exceed the size of their level before levels are chosen again
   real(dp), parameter :: tolerance = 0.25_dp

   !> Finder that bins all boxes anew at every step, into grids by their size
   type, extends(linked_cells_t) :: hierarchical_grid_t
      private
      !> Greatest side reckoned with in each level [m]
      real(dp), allocatable :: largest(:)
   contains
      procedure :: find
   end type hierarchical_grid_t

contains

   !> Choose levels if need be, then find as with one grid.
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

   !> Whether levels have been chosen and the boxes of the last step were not much larger than reckoned with
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
