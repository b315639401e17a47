!> A periodic cell: the part of the plane that is repeated along one axis or both.
!>
!> Every body has one place in the cell, and every pair of bodies one vector, that to the nearest copy. No contact is
!> missed as long as half the cell is longer than two bodies reach together; then at most one copy of a body can touch.
module polydem_cell
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: cell_t, new_cell, nearest_copy, fold_offsets

   !> Periodic cell
   type :: cell_t
      !> Whether the plane is periodic along any axis
      logical :: is_periodic = .false.
      !> Lower left corner [m]
      real(wp) :: low(2) = 0.0_wp
      !> Width and height; 0 along an axis that is not periodic [m]
      real(wp) :: size(2) = 0.0_wp
      !> 1/size; 0 along an axis that is not periodic [1/m]
      real(wp) :: inverse(2) = 0.0_wp
   end type cell_t

   !> A number of such size that adding it rounds to integers: the bits are the same with every instruction set
   real(wp), parameter :: rounder = 1.5_wp*2.0_wp**(digits(1.0_wp) - 1)

contains

   !> A cell that is periodic along some axes
   pure function new_cell(axes, low, size) result(cell)
      !> 'none', 'x', 'y' or 'xy'
      character(len=*), intent(in) :: axes
      !> Lower left corner, and width and height; only those along periodic axes are used [m]
      real(wp), intent(in) :: low(2), size(2)
      type(cell_t) :: cell
      integer :: axis

      do axis = 1, 2
         if (axes == 'none' .or. scan(axes, 'xy'(axis:axis)) == 0) cycle
         cell%is_periodic = .true.
         cell%low(axis) = low(axis)
         cell%size(axis) = size(axis)
         cell%inverse(axis) = 1.0_wp/size(axis)
      end do
   end function new_cell

   !> A distance along an axis to the nearest copy of where it leads [m]
   elemental real(wp) function nearest_copy(distance, fold, size)
      !> Distance [m]
      real(wp), intent(in) :: distance
      !> 1 over the side of the cell, or 0 if the distance is not folded [1/m]
      real(wp), intent(in) :: fold
      !> Side of the cell [m]
      real(wp), intent(in) :: size

      nearest_copy = distance - ((distance*fold + rounder) - rounder)*size
   end function nearest_copy

   !> Replace the vectors between the bodies of some pairs by those to the nearest copies.
   pure subroutine fold_offsets(cell, n, first, second, folds, offset)
      type(cell_t), intent(in) :: cell
      !> Number of pairs, and slots of their bodies
      integer(ip), intent(in) :: n, first(:), second(:)
      !> 1/size of each body as in `bodies_t`, (2, slot) [1/m]
      real(wp), intent(in), contiguous :: folds(:, :)
      !> Vectors from the first to the second body, (pair, x or y) [m]
      real(wp), intent(inout) :: offset(:, :)
      integer(ip) :: c

      do c = 1_ip, n
         offset(c, :) = nearest_copy(offset(c, :), min(folds(:, first(c)), folds(:, second(c))), cell%size)
      end do
   end subroutine fold_offsets

end module polydem_cell
