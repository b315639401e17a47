!> Late insertions into cells: boxes that are registered in every cell that they cover, wherever they were binned.
!>
!> A counting sort bins all boxes at once. Boxes that are fixed, or that changed after the sort, are inserted late.
!> A search meets a late insertion once in each of its cells. A box that covers very many cells, or none because it is
!> nowhere, is registered in no cell, and every search meets it.
module polydem_late_insertions
   use polydem_index_list, only: index_list_t
   use polydem_kinds, only: ip, lp, wp
   implicit none
   private
   public :: late_insertions_t, cell_block_t

   !> Largest number of cells in which a late insertion is registered
   integer(ip), parameter :: most_cells = 16_ip

   !> Cells that a window covers in a grid
   type :: cell_block_t
      !> Lower left cell
      integer(ip) :: first = 1_ip
      !> Number of columns and rows
      integer(ip) :: columns = 0_ip, rows = 0_ip
      !> Distance of the numbers of a cell and of the cell above it
      integer(ip) :: stride = 1_ip
   end type cell_block_t

   !> Late insertions into all cells
   type :: late_insertions_t
      private
      !> First entry of each cell, (cell); 0: none
      integer(ip), allocatable :: first(:)
      !> Box of each entry, and next entry of the same cell, (entry); 0: none
      type(index_list_t) :: box, next
      !> Late insertions that cover very many cells or none
      type(index_list_t) :: wide
   contains
      procedure :: clear
      procedure :: add
      procedure :: append_near
      procedure :: append_wide
      procedure :: n_wide
      procedure :: bytes
   end type late_insertions_t

contains

   !> Remove all late insertions.
   pure subroutine clear(self, n_cells)
      class(late_insertions_t), intent(inout) :: self
      !> Number of cells
      integer(ip), intent(in) :: n_cells

      if (allocated(self%first)) then
         if (size(self%first) < n_cells) deallocate (self%first)
      end if
      if (.not. allocated(self%first)) allocate (self%first(n_cells + n_cells/8_ip))
      self%first(1:n_cells) = 0_ip
      self%box%n = 0_ip
      self%next%n = 0_ip
      self%wide%n = 0_ip
   end subroutine clear

   !> Register a box in the cells that it covers.
   pure subroutine add(self, i, cells)
      class(late_insertions_t), intent(inout) :: self
      !> Box
      integer(ip), intent(in) :: i
      !> Cells that it covers
      type(cell_block_t), intent(in) :: cells
      integer(ip) :: r, c

      if (min(cells%columns, cells%rows) < 1_ip .or. &
          int(cells%columns, lp)*int(cells%rows, lp) > int(most_cells, lp)) then
         call self%wide%push(i)
         return
      end if
      do r = 0_ip, cells%rows - 1_ip
         do c = cells%first + r*cells%stride, cells%first + r*cells%stride + cells%columns - 1_ip
            call self%box%push(i)
            call self%next%push(self%first(c))
            self%first(c) = self%box%n
         end do
      end do
   end subroutine add

   !> Append the late insertions of some cells that overlap a window to a list, some of them several times.
   pure subroutine append_near(self, cells, window, bounds, near, n_tests)
      class(late_insertions_t), intent(in) :: self
      !> Cells that the window covers
      type(cell_block_t), intent(in) :: cells
      !> Bounds xmin, ymin, xmax, ymax of the window [m]
      real(wp), intent(in) :: window(4)
      !> Present bounds of all boxes, (4, box) [m]
      real(wp), intent(in), contiguous :: bounds(:, :)
      !> List of boxes
      type(index_list_t), intent(inout) :: near
      !> Number of comparisons; increased
      integer(lp), intent(inout) :: n_tests
      integer(ip) :: r, c, entry

      do r = 0_ip, cells%rows - 1_ip
         do c = cells%first + r*cells%stride, cells%first + r*cells%stride + cells%columns - 1_ip
            entry = self%first(c)
            do while (entry /= 0_ip)
               n_tests = n_tests + 1_lp
               if (meet(window, bounds(:, self%box%at(entry)))) call near%push(self%box%at(entry))
               entry = self%next%at(entry)
            end do
         end do
      end do
   end subroutine append_near

   !> Append the late insertions that cover very many cells or none, and overlap a window, to a list.
   pure subroutine append_wide(self, window, bounds, near, n_tests)
      class(late_insertions_t), intent(in) :: self
      !> Bounds xmin, ymin, xmax, ymax of the window [m]
      real(wp), intent(in) :: window(4)
      !> Present bounds of all boxes, (4, box) [m]
      real(wp), intent(in), contiguous :: bounds(:, :)
      !> List of boxes
      type(index_list_t), intent(inout) :: near
      !> Number of comparisons; increased
      integer(lp), intent(inout) :: n_tests
      integer(ip) :: k

      n_tests = n_tests + int(self%wide%n, lp)
      do k = 1_ip, self%wide%n
         if (meet(window, bounds(:, self%wide%at(k)))) call near%push(self%wide%at(k))
      end do
   end subroutine append_wide

   !> Whether two boxes share a point; written here so that it is expanded in the loops
   pure logical function meet(a, b)
      !> Bounds xmin, ymin, xmax, ymax of the boxes [m]
      real(wp), intent(in) :: a(4), b(4)

      meet = min(min(b(3) - a(1), a(3) - b(1)), min(b(4) - a(2), a(4) - b(2))) >= 0.0_wp
   end function meet

   !> Number of late insertions that every search meets
   pure integer(ip) function n_wide(self)
      class(late_insertions_t), intent(in) :: self

      n_wide = self%wide%n
   end function n_wide

   !> Allocated memory [B]
   pure integer(lp) function bytes(self)
      class(late_insertions_t), intent(in) :: self

      bytes = 0_lp
      if (.not. allocated(self%first)) return
      bytes = size(self%first, kind=lp)
      if (allocated(self%box%at)) bytes = bytes + size(self%box%at, kind=lp) + size(self%next%at, kind=lp)
      if (allocated(self%wide%at)) bytes = bytes + size(self%wide%at, kind=lp)
      bytes = bytes*int(storage_size(self%first)/8, lp)
   end function bytes

end module polydem_late_insertions
