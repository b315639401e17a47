!> Lines of boxes: straight predictions of the sides of all boxes, and the distances of the sides from them.
!>
!> In an *interval* of T steps a side has the line p + v s, its predicted position at step s, s = 0..T. A box is *on its
!> lines* while no side is farther from its line than the tolerance. Lines are numbers of single precision, and places
!> count from an origin. `polydem_inner_list` explains what follows for pairs of boxes, and bounds the rounding errors.
module polydem_box_lines
   use polydem_index_list, only: index_list_t
   use polydem_instruction_set, only: isa_avx2, isa_base
   use polydem_kinds, only: bp, far, ip, sp, wp
   use polydem_line_lanes_avx2, only: classify_avx2 => classify, draw_avx2 => draw, find_off_avx2 => find_off, &
      list_strays_avx2 => list_strays
   use polydem_line_lanes_base, only: classify, draw, find_off, list_strays, most_place
   implicit none
   private
   public :: box_lines_t, list_differences, median_corner

   !> Share of the deviation at the end of an interval that enters the velocity for the next interval. 1 gives the mean
   !> velocity of the last interval, 3 the best prediction if the acceleration is constant; deviations contain noise
   real(wp), parameter, public :: trust = 1.5_wp
   !> Largest motion of a line in a step in units of the typical side of a box
   real(wp), parameter :: greatest_speed = 4.0_wp
   !> Largest velocity of any line [m per step], in the range of single precision
   real(wp), parameter :: most_speed = 1.0e30_wp
   !> All velocities are reduced by this multiple of the tolerance. So those of boxes at rest become zero, and not
   !> numbers so small that arithmetic with them is slow
   real(wp), parameter :: least_speed = 2.0_wp**(-40)
   !> 20 u as in the head of `polydem_inner_list`
   real(sp), parameter :: rounding = 10.0_sp*epsilon(1.0_sp)
   !> Least tolerance for which lines are used [m]; below it, products could underflow
   real(sp), parameter :: least_tolerance = 2.0_sp**(-60)
   !> Largest places in use in units of the tolerance, and room for motion beyond them in units of the typical side
   real(sp), parameter :: most_tolerances = 2.0_sp**19, motion = 16.0_sp
   !> Number of boxes in the sample that sets the origin
   integer(ip), parameter :: sample_size = 31_ip

   !> Lines of all boxes in an interval
   type :: box_lines_t
      !> Number of steps since the start of the interval
      integer(ip) :: step = 0_ip
      !> Length of the interval [steps]
      integer(ip) :: length = 0_ip
      !> Largest accepted distance of a side from its line [m]
      real(sp) :: tolerance = 0.0_sp
      !> Origin of the places: a median of lower corners [m]
      real(wp) :: origin(2) = 0.0_wp
      !> L as in the head of `polydem_inner_list`; negative if no lines are used [m]
      real(sp) :: limit = -1.0_sp
      !> Typical side of a box [m]
      real(wp) :: side = 0.0_wp
      !> Share of the deviations of the last interval that enters the velocities: `trust`, 1 after the first interval
      real(wp) :: share = 1.0_wp
      !> Places of the sides xmin, ymin, xmax, ymax at the start of the interval, if they were on their lines, (4, box)
      !> [m]
      real(sp), allocatable :: place(:, :)
      !> Velocities of the sides, (4, box) [m per step]
      real(sp), allocatable :: speed(:, :)
      !> Instruction set of the kernels
      integer :: isa = isa_base
      !> Step of the interval at which the lines of each box were drawn, (box)
      integer(ip), allocatable :: drawn(:)
   contains
      procedure :: gap_margin
      procedure :: tube
      procedure :: draw_lines
      procedure :: set_limit
      procedure :: redraw
      procedure :: reaches
      procedure :: stays_inside
      procedure :: find_strays
      procedure :: find_off_lines
      procedure :: classify_pairs
      procedure :: are_close
   end type box_lines_t

contains

   !> Margin of the gaps between two boxes [m]; its excess over two tolerances covers rounding
   pure real(sp) function gap_margin(self)
      class(box_lines_t), intent(in) :: self

      gap_margin = 2.0_sp*self%tolerance + rounding*self%limit
   end function gap_margin

   !> A median of the lower corners of a sample of boxes, along each axis [m]
   pure function median_corner(n_boxes, bounds) result(corner)
      !> Number of boxes
      integer(ip), intent(in) :: n_boxes
      !> Bounds of the boxes, (4, box) [m]
      real(wp), intent(in) :: bounds(4, n_boxes)
      real(wp) :: corner(2), sample(sample_size), x
      integer(ip) :: n, k, place
      integer :: a

      corner = 0.0_wp
      n = min(n_boxes, sample_size)
      do a = 1, 2
         do k = 1_ip, n
            x = bounds(a, 1_ip + (k - 1_ip)*(n_boxes/n))
            place = k
            do while (place > 1_ip)
               if (sample(place - 1_ip) <= x) exit
               sample(place) = sample(place - 1_ip)
               place = place - 1_ip
            end do
            sample(place) = x
         end do
         if (n == 0_ip) cycle
         if (abs(sample(1_ip + n/2_ip)) <= far) corner(a) = sample(1_ip + n/2_ip)
      end do
   end function median_corner

   !> Draw new lines through the present boxes low to high. The deviations from the old lines correct the velocities.
   pure subroutine draw_lines(self, low, high, n_boxes, bounds, origin, reach)
      class(box_lines_t), intent(inout) :: self
      !> First and last box
      integer(ip), intent(in) :: low, high
      !> Number of boxes
      integer(ip), intent(in) :: n_boxes
      !> Bounds of the boxes, (4, box) [m]
      real(wp), intent(in) :: bounds(4, n_boxes)
      !> Origin of the new places [m]
      real(wp), intent(in) :: origin(2)
      !> Largest distance of a place in use from the origin along an axis [m]
      real(sp), intent(out) :: reach
      real(wp) :: rates(3), origins(2, 2)

      reach = most_tolerances*self%tolerance
      rates = [self%share, least_speed*real(self%tolerance, wp), greatest(self)]
      origins = reshape([self%origin, origin], [2, 2])
      if (self%isa == isa_avx2) then
         call draw_avx2([low, high], self%step, rates, origins, n_boxes, bounds, self%drawn, self%place, self%speed, &
                        reach)
      else
         call draw([low, high], self%step, rates, origins, n_boxes, bounds, self%drawn, self%place, self%speed, reach)
      end if
      self%drawn(low:high) = 0_ip
   end subroutine draw_lines

   !> Set the origin of the places drawn, and the limit of places.
   pure subroutine set_limit(self, origin, reach)
      class(box_lines_t), intent(inout) :: self
      !> Origin [m]
      real(wp), intent(in) :: origin(2)
      !> Largest distance of a place in use from the origin along an axis [m]
      real(sp), intent(in) :: reach

      self%origin = origin
      self%limit = -1.0_sp
      if (self%tolerance >= least_tolerance) self%limit = reach + motion*real(self%side, sp) + &
         real(min(maxval(abs(origin))*(epsilon(1.0_wp)/real(epsilon(1.0_sp), wp)), most_place), sp)
   end subroutine set_limit

   !> Largest velocity of a line [m per step]
   pure real(wp) function greatest(self)
      type(box_lines_t), intent(in) :: self

      greatest = min(self%side*greatest_speed, most_speed)
   end function greatest

   !> Draw new lines through a box that left its lines in this step.
   pure subroutine redraw(self, i, box)
      class(box_lines_t), intent(inout) :: self
      !> Box
      integer(ip), intent(in) :: i
      !> Its bounds [m]
      real(wp), intent(in) :: box(4)
      real(wp) :: step, share, most, place, speed
      integer :: a

      step = real(self%step, wp)
      share = trust/max(step - real(self%drawn(i), wp), 1.0_wp)
      most = greatest(self)
      do a = 1, 4
         place = box(a) - self%origin(2 - modulo(a, 2))
         speed = real(self%speed(a, i), wp)
         speed = speed + (place - (real(self%place(a, i), wp) + speed*step))*share
         speed = max(-most, min(most, speed))
         self%speed(a, i) = real(sign(max(0.0_wp, abs(speed) - least_speed*real(self%tolerance, wp)), speed), sp)
         self%place(a, i) = real(max(-most_place, min(most_place, place - real(self%speed(a, i), wp)*step)), sp)
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

      reaches = real(self%speed(:, i), wp)*steps
   end function reaches

   !> Whether a box stays inside given bounds until the end of the interval while it is on its lines, and whether its
   !> lines may be used at all
   pure logical function stays_inside(self, i, bounds)
      class(box_lines_t), intent(in) :: self
      !> Box
      integer(ip), intent(in) :: i
      !> Bounds xmin, ymin, xmax, ymax [m]
      real(wp), intent(in) :: bounds(4)
      real(wp) :: from(4), to(4), room(4), widths(2)

      widths = self%tube()
      from = real(self%place(:, i), wp) + real(self%speed(:, i), wp)*real(self%drawn(i), wp)
      to = real(self%place(:, i), wp) + real(self%speed(:, i), wp)*real(self%length, wp)
      room(1:2) = min(from(1:2), to(1:2)) - (bounds(1:2) - self%origin + widths(1))
      room(3:4) = (bounds(3:4) - self%origin - widths(1)) - max(from(3:4), to(3:4))
      stays_inside = all(room >= 0.0_wp) .and. &
         all(abs(real(self%place(:, i), wp)) + abs(real(self%speed(:, i), wp)*real(self%length, wp)) <= widths(2))
   end function stays_inside

   !> Half width of the tubes around the lines in which the boxes on their lines are, and limit of places [m]
   pure function tube(self)
      class(box_lines_t), intent(in) :: self
      real(wp) :: tube(2)

      tube = real([self%tolerance + rounding*self%limit, self%limit], wp)
   end function tube

   !> List the boxes low to high that do not stay inside given bounds in an interval that begins.
   pure subroutine find_strays(self, low, high, n_boxes, bounds, strays)
      class(box_lines_t), intent(in) :: self
      !> First and last box
      integer(ip), intent(in) :: low, high
      !> Number of boxes
      integer(ip), intent(in) :: n_boxes
      !> Bounds xmin, ymin, xmax, ymax of each box, (4, box) [m]
      real(wp), intent(in) :: bounds(4, n_boxes)
      !> List of the boxes
      type(index_list_t), intent(inout) :: strays

      strays%n = 0_ip
      call strays%reserve(high - low + 2_ip)
      if (self%isa == isa_avx2) then
         call list_strays_avx2([low, high], [0.0_sp, real(self%length, sp)], self%tube(), self%origin, n_boxes, &
                               bounds, self%place, self%speed, strays%n, strays%at)
      else
         call list_strays([low, high], [0.0_sp, real(self%length, sp)], self%tube(), self%origin, n_boxes, bounds, &
                          self%place, self%speed, strays%n, strays%at)
      end if
   end subroutine find_strays

   !> List the boxes low to high of which a side is not on its line in this step.
   pure subroutine find_off_lines(self, low, high, n_boxes, bounds, off)
      class(box_lines_t), intent(in) :: self
      !> First and last box
      integer(ip), intent(in) :: low, high
      !> Number of boxes
      integer(ip), intent(in) :: n_boxes
      !> Bounds of the boxes, (4, box) [m]
      real(wp), intent(in) :: bounds(4, n_boxes)
      !> List of the boxes
      type(index_list_t), intent(inout) :: off

      off%n = 0_ip
      call off%reserve(high - low + 2_ip)
      if (self%isa == isa_avx2) then
         call find_off_avx2([low, high], real(self%step, sp), self%tolerance, self%origin, n_boxes, bounds, &
                            self%place, self%speed, off%n, off%at)
      else
         call find_off([low, high], real(self%step, sp), self%tolerance, self%origin, n_boxes, bounds, self%place, &
                       self%speed, off%n, off%at)
      end if
   end subroutine find_off_lines

   !> Classify pairs from a step to the end of the interval.
   pure subroutine classify_pairs(self, n, box, from, kind)
      class(box_lines_t), intent(in) :: self
      !> Number of pairs, at most `pair_block` of `polydem_line_lanes`
      integer(ip), intent(in) :: n
      !> Boxes of each pair, (2, n)
      integer(ip), intent(in) :: box(2, n)
      !> First step
      integer(ip), intent(in) :: from
      !> Class of each pair
      integer(bp), intent(out) :: kind(n)
      real(sp) :: steps(2)

      steps = [real(from, sp), real(self%length, sp)]
      if (self%isa == isa_avx2) then
         call classify_avx2(n, box, steps, self%gap_margin(), size(self%place, 2, ip), self%place, self%speed, kind)
      else
         call classify(n, box, steps, self%gap_margin(), size(self%place, 2, ip), self%place, self%speed, kind)
      end if
   end subroutine classify_pairs

   !> List the elements in which two lists of classes differ, without branches.
   pure subroutine list_differences(n, kind, state, n_listed, listed)
      !> Number of elements
      integer(ip), intent(in) :: n
      !> The lists
      integer(bp), intent(in) :: kind(n), state(n)
      !> Number of differences, and where they are
      integer(ip), intent(out) :: n_listed, listed(n + 1_ip)
      integer(ip) :: k

      n_listed = 0_ip
      do k = 1_ip, n
         listed(n_listed + 1_ip) = k
         n_listed = n_listed + merge(1_ip, 0_ip, kind(k) /= state(k))
      end do
   end subroutine list_differences

   !> Whether the largest gap of two boxes is close to zero at the start of an interval
   pure logical function are_close(self, i, j)
      class(box_lines_t), intent(in) :: self
      !> Boxes
      integer(ip), intent(in) :: i, j

      are_close = abs(max(max(self%place(1, i) - self%place(3, j), self%place(2, i) - self%place(4, j)), &
                          max(self%place(1, j) - self%place(3, i), self%place(2, j) - self%place(4, i)))) <= &
         self%gap_margin()
   end function are_close

end module polydem_box_lines
