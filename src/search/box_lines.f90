!> Lines of boxes: straight predictions of the sides of all boxes, and the distances of the sides from them.
!>
!> In an *interval* of T steps a side has the line p + v s, its predicted position at step s, s = 0..T. A box is *on its
!> lines* while no side is farther from its line than the tolerance. `polydem_line_filter` explains what follows for
!> pairs of boxes, and bounds the rounding errors.
module polydem_box_lines
   use polydem_candidates, only: index_list_t
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: box_lines_t

   !> Share of the deviation at the end of an interval that enters the velocity for the next interval. 1 gives the mean
   !> velocity of the last interval, 3 the best prediction if the acceleration is constant; deviations contain noise
   real(wp), parameter, public :: trust = 1.5_wp
   !> Largest motion of a line in a step in units of the typical side of a box
   real(wp), parameter :: greatest_speed = 4.0_wp
   !> Number of boxes whose sides are compared with their lines, or with their bounds, at once
   integer(ip), parameter :: box_block = 16_ip, block_size = 128_ip

   !> Lines of all boxes in an interval
   type :: box_lines_t
      !> Number of steps since the start of the interval
      integer(ip) :: step = 0_ip
      !> Length of the interval [steps]
      integer(ip) :: length = 0_ip
      !> Largest accepted distance of a side from its line [m]
      real(wp) :: tolerance = 0.0_wp
      !> Typical side of a box [m]
      real(wp) :: side = 0.0_wp
      !> Share of the deviations of the last interval that enters the velocities: `trust`, 1 after the first interval
      real(wp) :: share = 1.0_wp
      !> Lines of each box, (8, box): positions xmin, ymin, xmax, ymax [m] and their velocities [m per step]
      real(wp), allocatable :: line(:, :)
      !> Step of the interval at which the lines of each box were drawn, (box)
      integer(ip), allocatable :: drawn(:)
   contains
      procedure :: gap_margin
      procedure :: draw_lines
      procedure :: redraw
      procedure :: reaches
      procedure :: stays_inside
      procedure :: find_strays
      procedure :: find_off_lines
   end type box_lines_t

contains

   !> Margin of the gaps between two boxes [m]; its excess over two tolerances covers rounding
   pure real(wp) function gap_margin(self)
      class(box_lines_t), intent(in) :: self

      gap_margin = (2.0_wp + 2.0_wp**(-5))*self%tolerance
   end function gap_margin

   !> Draw new lines through the present boxes low to high. The deviations from the old lines correct the velocities.
   pure subroutine draw_lines(self, low, high, n_boxes, bounds)
      class(box_lines_t), intent(inout) :: self
      !> First and last box
      integer(ip), intent(in) :: low, high
      !> Number of boxes
      integer(ip), intent(in) :: n_boxes
      !> Bounds of the boxes, (4, box) [m]
      real(wp), intent(in) :: bounds(4, n_boxes)

      call draw(low, high, self%step, self%share, self%side*greatest_speed, n_boxes, bounds, self%drawn, self%line)
      self%drawn(low:high) = 0_ip
   end subroutine draw_lines

   !> Kernel of `draw_lines`
   pure subroutine draw(low, high, step, share, greatest, n_boxes, bounds, drawn, line)
      integer(ip), intent(in) :: low, high
      !> Number of steps since the start of the last interval
      integer(ip), intent(in) :: step
      !> Share of the deviations that enters the velocities, and largest velocity
      real(wp), intent(in) :: share, greatest
      integer(ip), intent(in) :: n_boxes
      real(wp), intent(in) :: bounds(4, n_boxes)
      integer(ip), intent(in) :: drawn(n_boxes)
      real(wp), intent(inout) :: line(8, n_boxes)
      real(wp) :: rate
      integer(ip) :: i
      integer :: a

      do i = low, high
         rate = 0.0_wp
         if (step > drawn(i)) rate = share/real(step - drawn(i), wp)
         do a = 1, 4
            line(a + 4, i) = line(a + 4, i) + (bounds(a, i) - (line(a, i) + line(a + 4, i)*real(step, wp)))*rate
            line(a + 4, i) = max(-greatest, min(greatest, line(a + 4, i)))
            line(a, i) = bounds(a, i)
         end do
      end do
   end subroutine draw

   !> Draw new lines through a box that left its lines in this step.
   pure subroutine redraw(self, i, box)
      class(box_lines_t), intent(inout) :: self
      !> Box
      integer(ip), intent(in) :: i
      !> Its bounds [m]
      real(wp), intent(in) :: box(4)
      real(wp) :: step, share, greatest
      integer :: a

      step = real(self%step, wp)
      share = trust/max(step - real(self%drawn(i), wp), 1.0_wp)
      greatest = self%side*greatest_speed
      do a = 1, 4
         self%line(a + 4, i) = max(-greatest, min(greatest, self%line(a + 4, i) + &
                                                  (box(a) - (self%line(a, i) + self%line(a + 4, i)*step))*share))
         self%line(a, i) = box(a) - self%line(a + 4, i)*step
      end do
      self%drawn(i) = self%step
   end subroutine redraw

   !> Displacements of the sides of a box in a number of steps, if it stays on its lines [m]
   pure function reaches(self, i, steps)
      class(box_lines_t), intent(in) :: self
      !> Box
      integer(ip), intent(in) :: i
      !> Number of steps
      real(wp), intent(in) :: steps
      real(wp) :: reaches(4)

      reaches = self%line(5:8, i)*steps
   end function reaches

   !> Whether a box stays inside given bounds until the end of the interval while it is on its lines, and whether its
   !> lines may be used at all
   pure logical function stays_inside(self, i, bounds)
      class(box_lines_t), intent(in) :: self
      !> Box
      integer(ip), intent(in) :: i
      !> Bounds xmin, ymin, xmax, ymax [m]
      real(wp), intent(in) :: bounds(4)
      real(wp) :: room(1)

      call find_room(1_ip, real(self%drawn(i), wp), real(self%length, wp), self%tolerance, self%line(:, i), bounds, &
                     room)
      stays_inside = room(1) >= 0.0_wp
   end function stays_inside

   !> List the boxes low to high that do not stay inside given bounds in an interval that begins.
   pure subroutine find_strays(self, low, high, n_boxes, bounds, strays)
      class(box_lines_t), intent(in) :: self
      !> First and last box
      integer(ip), intent(in) :: low, high
      !> Number of boxes
      integer(ip), intent(in) :: n_boxes
      !> Bounds xmin, ymin, xmax, ymax of each box, (4, box) [m]
      real(wp), intent(in) :: bounds(4, n_boxes)
      !> List to which the boxes are appended
      type(index_list_t), intent(inout) :: strays
      real(wp) :: room(block_size)
      integer(ip) :: from, to, i

      do from = low, high, block_size
         to = min(from + block_size - 1_ip, high)
         call find_room(to - from + 1_ip, 0.0_wp, real(self%length, wp), self%tolerance, self%line(:, from:to), &
                        bounds(:, from:to), room)
         do i = from, to
            if (.not. room(i - from + 1_ip) >= 0.0_wp) call strays%push(i)
         end do
      end do
   end subroutine find_strays

   !> Least distances between the tubes around the lines of boxes and given bounds, from one step to another; not above
   !> zero if lines may not be used
   pure subroutine find_room(n, from, to, tolerance, line, bounds, room)
      integer(ip), intent(in) :: n
      real(wp), intent(in) :: from, to, tolerance
      real(wp), intent(in) :: line(8, n), bounds(4, n)
      real(wp), intent(out) :: room(n)
      real(wp) :: width, limit, reach(4), first(4), last(4)
      integer(ip) :: i

      width = (1.0_wp + 2.0_wp**(-5))*tolerance
      ! L as in the head of this module, with 1024 u = 512 epsilon
      limit = tolerance*(2.0_wp**(-9)/epsilon(1.0_wp))
      do i = 1_ip, n
         first = line(1:4, i) + line(5:8, i)*from
         last = line(1:4, i) + line(5:8, i)*to
         reach = limit - (abs(line(1:4, i)) + abs(line(5:8, i)*to))
         first(1:2) = min(first(1:2), last(1:2)) - (bounds(1:2, i) + width)
         first(3:4) = (bounds(3:4, i) - width) - max(first(3:4), last(3:4))
         first = min(first, reach)
         room(i) = min(min(first(1), first(2)), min(first(3), first(4)))
      end do
   end subroutine find_room

   !> List the boxes low to high of which a side is not on its line in this step.
   pure subroutine find_off_lines(self, low, high, n_boxes, bounds, off)
      class(box_lines_t), intent(in) :: self
      !> First and last box
      integer(ip), intent(in) :: low, high
      !> Number of boxes
      integer(ip), intent(in) :: n_boxes
      !> Bounds of the boxes, (4, box) [m]
      real(wp), intent(in) :: bounds(4, n_boxes)
      !> List to which the boxes are appended
      type(index_list_t), intent(inout) :: off

      call compare_with_lines(low, high, real(self%step, wp), self%tolerance, n_boxes, bounds, self%line, off)
   end subroutine find_off_lines

   !> Kernel of `find_off_lines`; the loop over a block has no branches
   pure subroutine compare_with_lines(low, high, step, tolerance, n_boxes, bounds, line, off)
      integer(ip), intent(in) :: low, high, n_boxes
      real(wp), intent(in) :: step, tolerance
      real(wp), intent(in) :: bounds(4, n_boxes), line(8, n_boxes)
      type(index_list_t), intent(inout) :: off
      real(wp) :: most(4)
      integer(ip) :: from, to, i

      do from = low, high, box_block
         to = min(from + box_block - 1_ip, high)
         most = 0.0_wp
         !GCC$ unroll 4
         do i = from, to
            most = max(most, abs(bounds(:, i) - (line(1:4, i) + line(5:8, i)*step)))
         end do
         if (max(max(most(1), most(2)), max(most(3), most(4))) <= tolerance) cycle
         do i = from, to
            if (all(abs(bounds(:, i) - (line(1:4, i) + line(5:8, i)*step)) <= tolerance)) cycle
            call off%push(i)
         end do
      end do
   end subroutine compare_with_lines

end module polydem_box_lines
