!> Positions for grains of many sizes: square cells with given sides, cut from a rectangle.
!>
!> The largest square is cut from a random corner of the rectangle. The rest of the rectangle is cut into two
!> rectangles, along the line that makes one of them as large as possible. The next square is cut from the rectangle
!> with the longest short side, and so on. Small squares fill the gaps between large squares, and all sizes mix.
!> (J. Jylanki, A thousand ways to pack the bin, 2010, discusses guillotine cuts and the choice of the next rectangle.)
module polydem_cut_cells
   use polydem_kinds, only: ip, wp
   use polydem_random, only: random_t
   use polydem_sort_reals, only: sort_reals
   implicit none
   private
   public :: cut_cells, fit_cells

   !> Fraction of the rectangle that the cells cover in the first attempt of `fit_cells`. Squares of different sizes
   !> never reach this fraction
   real(wp), parameter :: greatest_share = 0.98_wp
   !> Factor of the sides from one attempt of `fit_cells` to the next
   real(wp), parameter :: shrinkage = 0.99_wp

   !> Binary heap of upright rectangles. The short side of rectangle k is not longer than that of its parent k/2
   type :: heap_t
      !> Number of rectangles
      integer(ip) :: n = 0_ip
      !> Bounds xmin, ymin, xmax, ymax of each rectangle, (4, rectangle) [m]
      real(wp), allocatable :: bounds(:, :)
   end type heap_t

contains

   !> Find the largest cells with the given ratios of sides that fit into a rectangle.
   subroutine fit_cells(inside, least, random, centres, spread)
      !> Corners of the rectangle, anticlockwise from the lower left, (2, 4) [m]
      real(wp), intent(in) :: inside(2, 4)
      !> Smallest allowed sides of the cells, (cell) [m]
      real(wp), intent(in) :: least(:)
      type(random_t), intent(inout) :: random
      !> Centres of the cells, (2, cell) [m]
      real(wp), intent(out) :: centres(:, :)
      !> Ratio of the sides to the smallest allowed sides; 0 if the cells do not fit
      real(wp), intent(out) :: spread
      logical :: fits
      type(random_t) :: initial
      integer(ip) :: descending(size(least))
      real(wp) :: found(2, size(least))

      call sort_reals(-least, descending)
      initial = random
      spread = sqrt(greatest_share*(inside(1, 3) - inside(1, 1))*(inside(2, 3) - inside(2, 1))/sum(least**2))
      do while (spread >= 1.0_wp)
         random = initial
         call cut_cells(inside, spread*least(descending), random, found, fits)
         if (fits) then
            centres(:, descending) = found
            return
         end if
         spread = shrinkage*spread
      end do
      spread = 0.0_wp
   end subroutine fit_cells

   !> Cut square cells from a rectangle.
   subroutine cut_cells(inside, sides, random, centres, fits)
      !> Corners of the rectangle, anticlockwise from the lower left, (2, 4) [m]
      real(wp), intent(in) :: inside(2, 4)
      !> Sides of the cells in descending order, (cell) [m]
      real(wp), intent(in) :: sides(:)
      type(random_t), intent(inout) :: random
      !> Centres of the cells, (2, cell) [m]
      real(wp), intent(out) :: centres(:, :)
      !> Whether all cells fit
      logical, intent(out) :: fits
      type(heap_t) :: heap
      real(wp) :: whole(4), rest(4), cell(4), room(2)
      integer :: k, a, along

      allocate (heap%bounds(4, size(sides) + 1))
      call push(heap, [inside(:, 1), inside(:, 3)])
      do k = 1, size(sides)
         whole = heap%bounds(:, 1)
         room = whole(3:4) - whole(1:2) - sides(k)
         fits = all(room >= 0.0_wp)
         if (.not. fits) return
         call pop(heap)
         ! The strip beside the cell has the full height if the room beside the cell is larger than that above it.
         along = merge(1, 2, room(1) > room(2))
         cell = whole
         do a = along, 3 - along, 3 - 2*along
            rest = cell
            if (random%uniform() < 0.5_wp) then
               cell(a + 2) = cell(a) + sides(k)
               rest(a) = cell(a + 2)
            else
               cell(a) = cell(a + 2) - sides(k)
               rest(a + 2) = cell(a)
            end if
            if (k < size(sides)) call push(heap, rest)
         end do
         centres(:, k) = 0.5_wp*(cell(1:2) + cell(3:4))
      end do
      fits = .true.
   end subroutine cut_cells

   !> Add a rectangle to the heap.
   pure subroutine push(heap, rectangle)
      type(heap_t), intent(inout) :: heap
      real(wp), intent(in) :: rectangle(4)
      integer(ip) :: k

      heap%n = heap%n + 1_ip
      k = heap%n
      do while (k > 1_ip)
         if (short_side(heap%bounds(:, k/2_ip)) >= short_side(rectangle)) exit
         heap%bounds(:, k) = heap%bounds(:, k/2_ip)
         k = k/2_ip
      end do
      heap%bounds(:, k) = rectangle
   end subroutine push

   !> Remove the first rectangle of the heap, which has the longest short side.
   pure subroutine pop(heap)
      type(heap_t), intent(inout) :: heap
      real(wp) :: last(4)
      integer(ip) :: k, child

      last = heap%bounds(:, heap%n)
      heap%n = heap%n - 1_ip
      k = 1_ip
      do while (2_ip*k <= heap%n)
         child = 2_ip*k
         if (child < heap%n) then
            if (short_side(heap%bounds(:, child + 1_ip)) > short_side(heap%bounds(:, child))) child = child + 1_ip
         end if
         if (short_side(last) >= short_side(heap%bounds(:, child))) exit
         heap%bounds(:, k) = heap%bounds(:, child)
         k = child
      end do
      if (heap%n > 0_ip) heap%bounds(:, k) = last
   end subroutine pop

   !> Length of the shorter side of a rectangle [m]
   pure real(wp) function short_side(rectangle)
      real(wp), intent(in) :: rectangle(4)

      short_side = min(rectangle(3) - rectangle(1), rectangle(4) - rectangle(2))
   end function short_side

end module polydem_cut_cells
