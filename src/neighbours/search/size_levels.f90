!> Levels of a hierarchical grid: their number, and the boxes of each level.
!>
!> Krijgsman, Ogarko & Luding (2014) choose the cell sizes that minimise the expected work. The search for a box of side
!> s in a grid of cells of side h visits (s/h + 2)^2 cells and tests all boxes in them; in its own grid the work is half
!> of that. A level contains all boxes with sides up to h that are too large for the level below. Smaller boxes are
!> searched in the grids of larger boxes. In that paper the cell sizes are continuous, and a descent method finds the
!> minimum for each number of levels. Here sizes are divided into classes. The work is then a sum over levels, and each
!> term depends only on the first and last class of its level. The best levels and their number are therefore the exact
!> solution of a shortest-path problem.
!>
!> If all boxes have nearly the same size, the solution is one level, as with linked cells.
module polydem_size_levels
   use polydem_boxes, only: boxes_t
   use polydem_exponential, only: exponential, logarithm
   use polydem_kinds, only: dp, ip, wp
   implicit none
   private
   public :: choose_levels, typical_side

   !> Number of size classes per octave, and number of octaves below the largest box; smaller boxes are in the lowest
   !> class
   integer, parameter :: classes_per_octave = 4, octaves = 24
   !> Largest number of classes
   integer, parameter :: most_classes = classes_per_octave*octaves + 1
   !> Work of a visit of a cell in units of the work of a test. MercuryDPM, which implements the method of the paper,
   !> uses 0.2 for particles in linked lists. Here a test is only a few comparisons, and the number of boxes in a cell
   !> is hard to predict (measured: 6)
   real(dp), parameter :: visit_work = 6.0_dp
   !> Smallest assumed fraction of the area that squares with the sides of the boxes cover
   real(dp), parameter :: least_cover = 0.25_dp

   !> Size distribution of the boxes
   type :: spectrum_t
      !> Number of classes
      integer :: n = 0
      !> Number of boxes of each class, (class)
      real(dp) :: boxes(most_classes) = 0.0_dp
      !> Largest side of each class, (class) [m]
      real(dp) :: side(most_classes) = 0.0_dp
      !> Area in which the boxes lie [m2]
      real(dp) :: area = 0.0_dp
   end type spectrum_t

contains

   !> Choose the levels of the free boxes.
   pure subroutine choose_levels(boxes, margin, n_levels, level, largest)
      !> Boxes of this step
      type(boxes_t), intent(in) :: boxes
      !> Excess of the sides of the padded boxes over those of the boxes [m]
      real(wp), intent(in) :: margin
      !> Number of levels
      integer, intent(out) :: n_levels
      !> Level of each box, (box); 1 is the level of the smallest boxes
      integer(ip), allocatable, intent(out) :: level(:)
      !> Largest side assumed for a box of each level, margin included, (level) [m]
      real(dp), allocatable, intent(out) :: largest(:)
      type(spectrum_t) :: spectrum
      integer :: class(boxes%n), level_of_class(most_classes)
      integer(ip) :: i

      call sort_by_size(boxes, margin, spectrum, class)
      call shortest_path(spectrum, n_levels, level_of_class)
      allocate (level(boxes%n), largest(n_levels))
      largest = 0.0_dp
      do i = 1_ip, boxes%n
         level(i) = int(level_of_class(class(i)), ip)
      end do
      do i = 1_ip, int(spectrum%n, ip)
         largest(level_of_class(i)) = max(largest(level_of_class(i)), spectrum%side(i))
      end do
   end subroutine choose_levels

   !> Largest side of a box, at present or at any angle [m]
   pure real(dp) function side_of(boxes, i)
      type(boxes_t), intent(in) :: boxes
      integer(ip), intent(in) :: i

      side_of = real(max(2.0_wp*boxes%reach(i), boxes%bounds(3, i) - boxes%bounds(1, i), &
                         boxes%bounds(4, i) - boxes%bounds(2, i)), dp)
   end function side_of

   !> Geometric mean of the sides of the free boxes with positive sides [m]
   pure real(wp) function typical_side(boxes)
      !> Boxes of this step
      type(boxes_t), intent(in) :: boxes
      real(dp) :: logarithms
      integer(ip) :: i, n

      logarithms = 0.0_dp
      n = 0_ip
      do i = 1_ip, boxes%n
         if (boxes%fixed(i) .or. .not. side_of(boxes, i) > 0.0_dp) cycle
         n = n + 1_ip
         logarithms = logarithms + logarithm(side_of(boxes, i))
      end do
      typical_side = 0.0_wp
      if (n > 0_ip) typical_side = real(exponential(logarithms/real(n, dp)), wp)
   end function typical_side

   !> Count the free boxes of each size class. Fixed boxes get class 1 but are not counted.
   pure subroutine sort_by_size(boxes, margin, spectrum, class)
      type(boxes_t), intent(in) :: boxes
      real(wp), intent(in) :: margin
      type(spectrum_t), intent(out) :: spectrum
      integer, intent(out) :: class(:)
      real(dp) :: largest, least, side, low(2), high(2), squares, octave
      integer(ip) :: i

      largest = 0.0_dp
      least = huge(1.0_dp)
      squares = 0.0_dp
      low = huge(1.0_dp)
      high = -huge(1.0_dp)
      do i = 1_ip, boxes%n
         if (boxes%fixed(i)) cycle
         side = side_of(boxes, i) + real(margin, dp)
         largest = max(largest, side)
         least = min(least, side)
         squares = squares + side**2
         low = min(low, real(boxes%bounds(1:2, i), dp))
         high = max(high, real(boxes%bounds(3:4, i), dp))
      end do
      class = 1
      spectrum%n = 1
      if (.not. squares > 0.0_dp) return
      spectrum%area = min((high(1) - low(1))*(high(2) - low(2)), squares/least_cover)
      least = max(least, largest*2.0_dp**(-octaves))
      octave = logarithm(2.0_dp)
      do i = 1_ip, boxes%n
         if (boxes%fixed(i)) cycle
         side = max(side_of(boxes, i) + real(margin, dp), least)
         class(i) = 1 + int(real(classes_per_octave, dp)*logarithm(side/least)/octave)
         class(i) = min(class(i), most_classes)
         spectrum%n = max(spectrum%n, class(i))
         spectrum%boxes(class(i)) = spectrum%boxes(class(i)) + 1.0_dp
         spectrum%side(class(i)) = max(spectrum%side(class(i)), side)
      end do
   end subroutine sort_by_size

   !> Combine classes into levels with the least expected work.
   pure subroutine shortest_path(spectrum, n_levels, level_of_class)
      type(spectrum_t), intent(in) :: spectrum
      integer, intent(out) :: n_levels
      integer, intent(out) :: level_of_class(:)
      ! Least work of the classes 1 to b, and the first class of the last of their levels
      real(dp) :: work(0:most_classes), this
      integer :: first(most_classes), a, b

      work(0) = 0.0_dp
      do b = 1, spectrum%n
         work(b) = huge(1.0_dp)
         do a = b, 1, -1
            this = work(a - 1) + work_of_level(spectrum, a, b)
            if (this > work(b)) cycle
            work(b) = this
            first(b) = a
         end do
      end do
      n_levels = 0
      b = spectrum%n
      do while (b > 0)
         n_levels = n_levels + 1
         b = first(b) - 1
      end do
      level_of_class = 1
      a = n_levels
      b = spectrum%n
      do while (b > 0)
         level_of_class(first(b):b) = a
         a = a - 1
         b = first(b) - 1
      end do
   end subroutine shortest_path

   !> Expected work of all searches in the grid of a level
   pure real(dp) function work_of_level(spectrum, a, b) result(work)
      type(spectrum_t), intent(in) :: spectrum
      !> First and last class of the level
      integer, intent(in) :: a, b
      real(dp) :: h, in_cell
      integer :: k

      work = 0.0_dp
      h = maxval(spectrum%side(a:b))
      if (.not. (h > 0.0_dp .and. spectrum%area > 0.0_dp)) return
      in_cell = sum(spectrum%boxes(a:b))*min(h*h/spectrum%area, 1.0_dp)
      work = sum(spectrum%boxes(a:b))*4.5_dp*(in_cell + visit_work)
      do k = 1, a - 1
         work = work + spectrum%boxes(k)*(spectrum%side(k)/h + 2.0_dp)**2*(in_cell + visit_work)
      end do
   end function work_of_level

end module polydem_size_levels
