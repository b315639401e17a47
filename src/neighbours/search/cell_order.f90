!> Boxes in the order of cells: copies of their bounds, one array for each bound. Boxes of neighbouring cells of a row
!> are adjacent in memory. The comparison writes each pair and increases the count only if the pair overlaps; this needs
!> no branch.
module polydem_cell_order
   use polydem_kinds, only: ip, lp, wp
   implicit none
   private
   public :: cell_order_t

   !> Boxes in the order of cells
   type :: cell_order_t
      !> Box numbers in the order of cells
      integer(ip), allocatable :: box(:)
      !> Cell of each box, in the order of cells
      integer(ip), allocatable :: cell(:)
      !> Bounds of the boxes in the order of cells [m]
      real(wp), allocatable :: xmin(:), ymin(:), xmax(:), ymax(:)
   contains
      procedure :: reserve
      procedure :: sort
      procedure :: compare
      procedure :: bytes
   end type cell_order_t

contains

   !> Allocate the arrays.
   subroutine reserve(self, n)
      class(cell_order_t), intent(inout) :: self
      !> Number of boxes
      integer(ip), intent(in) :: n

      if (allocated(self%box)) then
         if (size(self%box) == n) return
         deallocate (self%box, self%cell, self%xmin, self%ymin, self%xmax, self%ymax)
      end if
      allocate (self%box(n), self%cell(n), self%xmin(n), self%ymin(n), self%xmax(n), self%ymax(n))
   end subroutine reserve

   !> Sort the boxes by cell; boxes of the same cell are in the order of their numbers.
   pure subroutine sort(self, n, n_cells, bounds, cell_of, first)
      class(cell_order_t), intent(inout) :: self
      !> Number of boxes and of cells
      integer(ip), intent(in) :: n, n_cells
      !> Bounds of the boxes, (4, box) [m]
      real(wp), intent(in) :: bounds(4, n)
      !> Cell of each box, (box)
      integer(ip), intent(in) :: cell_of(n)
      !> Index of the first box of each cell, and behind the last cell
      integer(ip), intent(out) :: first(n_cells + 2)
      integer(ip) :: i, k, c

      first = 0_ip
      do i = 1_ip, n
         first(cell_of(i) + 2_ip) = first(cell_of(i) + 2_ip) + 1_ip
      end do
      first(1:2) = 1_ip
      do c = 1_ip, n_cells
         first(c + 2_ip) = first(c + 1_ip) + first(c + 2_ip)
      end do
      ! first(c + 1) is the next free index of cell c, and at the end the first index of the next cell.
      do i = 1_ip, n
         c = cell_of(i)
         k = first(c + 1_ip)
         first(c + 1_ip) = k + 1_ip
         self%box(k) = i
         self%cell(k) = c
         self%xmin(k) = bounds(1, i)
         self%ymin(k) = bounds(2, i)
         self%xmax(k) = bounds(3, i)
         self%ymax(k) = bounds(4, i)
      end do
   end subroutine sort

   !> Compare one box with a range of boxes. `found` must have room for one pair more than the number of comparisons.
   pure subroutine compare(self, k, from, to, n_found, found)
      class(cell_order_t), intent(in) :: self
      !> Index of the box, first and last index of the range
      integer(ip), intent(in) :: k, from, to
      !> Number of pairs found so far
      integer(ip), intent(inout) :: n_found
      !> Pairs, (2, pair)
      integer(ip), intent(inout) :: found(2, *)
      integer(ip) :: j, n, own
      real(wp) :: xmin, ymin, xmax, ymax

      own = self%box(k)
      xmin = self%xmin(k)
      ymin = self%ymin(k)
      xmax = self%xmax(k)
      ymax = self%ymax(k)
      n = n_found
      do j = from, to
         found(1, n + 1_ip) = own
         found(2, n + 1_ip) = self%box(j)
         n = n + merge(1_ip, 0_ip, min(min(self%xmax(j) - xmin, xmax - self%xmin(j)), &
                                       min(self%ymax(j) - ymin, ymax - self%ymin(j))) >= 0.0_wp)
      end do
      n_found = n
   end subroutine compare

   !> Allocated memory [B]
   pure integer(lp) function bytes(self)
      class(cell_order_t), intent(in) :: self

      bytes = 0_lp
      if (.not. allocated(self%box)) return
      bytes = (int(storage_size(self%box), lp)*2_lp*size(self%box, kind=lp) + &
               int(storage_size(self%xmin), lp)*4_lp*size(self%xmin, kind=lp))/8_lp
   end function bytes

end module polydem_cell_order
