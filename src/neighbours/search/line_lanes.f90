!> Passes over all boxes or over many candidates: a kernel, compiled for several instruction sets
!> (`cmake/polydem_kernel.cmake`). `polydem_inner_list` explains what they compute.
!>
!> Lines are numbers of single precision, with places relative to an origin; `polydem_inner_list` bounds the rounding
!> errors. The lines of two boxes fill one register of AVX2. Lists are written without branches: an entry is always
!> written, and counted only if it belongs there. All comparisons are false for NaN, so a box that is nowhere is off its
!> lines.
module polydem_line_lanes
   use polydem_kinds, only: bp, ip, sp, wp
   implicit none
   private
   public :: pair_block, most_place, overlapping, active, find_off, list_strays, draw, classify, find_states

   !> Classes of candidates; the sure ones are also their states in `polydem_candidates`
   integer(bp), parameter :: separate = 0_bp, overlapping = 1_bp, active = 2_bp
   !> Number of boxes that are compared with their lines at once, of their sides, and of integers that join these
   integer(ip), parameter :: box_block = 16_ip, n_sides = 4_ip*box_block, n_joined = 8_ip
   !> Kind of an integer with as many bits as a number of single precision
   integer, parameter :: bits = ip
   !> Largest number of pairs that are classified at once, and of boxes whose room is found at once
   integer(ip), parameter :: pair_block = 128_ip
   !> Largest place that is stored [m]
   real(wp), parameter :: most_place = real(0.25_sp*huge(1.0_sp), wp)

contains

   !> List the boxes of which a side is farther from its line than the tolerance.
   pure subroutine find_off(range, step, tolerance, origin, n_boxes, bounds, place, speed, n_off, off)
      !> First and last box
      integer(ip), intent(in) :: range(2)
      !> Number of steps since the start of the interval
      real(sp), intent(in) :: step
      !> Tolerance [m]
      real(sp), intent(in) :: tolerance
      !> Origin of the places [m]
      real(wp), intent(in) :: origin(2)
      !> Number of boxes
      integer(ip), intent(in) :: n_boxes
      !> Bounds of the boxes [m]
      real(wp), intent(in) :: bounds(4_ip*n_boxes)
      !> Places of the lines at the start of the interval [m]
      real(sp), intent(in) :: place(4_ip*n_boxes)
      !> Velocities of the lines [m per step]
      real(sp), intent(in) :: speed(4_ip*n_boxes)
      !> Number of boxes in the list
      integer(ip), intent(out) :: n_off
      !> The list
      integer(ip), intent(out) :: off(range(2) - range(1) + 2_ip)
      real(wp) :: base(n_joined)
      ! Bits of the distances of the sides of a block, moved down, from their lines
      integer(bits) :: below(n_sides), joined(n_joined), least
      integer(ip) :: from, to, sides, k, l

      n_off = 0_ip
      below = 0_bits
      ! Each side is moved down by the tolerance and compared with its line. On its line it is between zero and two
      ! tolerances below. The bits of such negative numbers, as integers, are below those of all others. Zero itself is
      ! accepted when the boxes are looked at one by one.
      base = [origin, origin, origin, origin] + real(tolerance, wp)
      least = transfer(-2.0_sp*tolerance, least)
      do from = range(1), range(2), box_block
         to = min(from + box_block - 1_ip, range(2))
         sides = 4_ip*(from - 1_ip)
         if (to - from == box_block - 1_ip) then
            joined = -huge(joined) - 1_bits
            do k = 0_ip, n_sides - n_joined, n_joined
               do l = 1_ip, n_joined
                  below(k + l) = transfer(real(bounds(sides + k + l) - base(l), sp) - &
                                          (place(sides + k + l) + speed(sides + k + l)*step), least)
                  joined(l) = max(joined(l), below(k + l))
               end do
            end do
            if (maxval(joined) <= least) cycle
         else
            do k = 0_ip, 4_ip*(to - from), 4_ip
               do l = 1_ip, 4_ip
                  below(k + l) = transfer(real(bounds(sides + k + l) - base(l), sp) - &
                                          (place(sides + k + l) + speed(sides + k + l)*step), least)
               end do
            end do
         end if
         call append_off(from, to, below, least, n_off, off)
      end do
   end subroutine find_off

   !> Append the boxes of a block of which a side is off its line to a list.
   pure subroutine append_off(from, to, below, least, n_off, off)
      !> First and last box
      integer(ip), intent(in) :: from, to
      !> Bits of the distances of all sides, moved down, from their lines, and of the least one on a line
      integer(bits), intent(in) :: below(n_sides), least
      !> Number of boxes in the list
      integer(ip), intent(inout) :: n_off
      !> The list; must have room for one box more than it can get
      integer(ip), intent(inout) :: off(*)
      real(sp) :: on(n_sides)
      integer(ip) :: i, k

      do k = 1_ip, n_sides
         on(k) = merge(1.0_sp, 0.0_sp, below(k) <= least .or. below(k) == 0_bits)
      end do
      do i = from, to
         k = 4_ip*(i - from)
         off(n_off + 1_ip) = i
         n_off = n_off + merge(0_ip, 1_ip, (on(k + 1_ip) + on(k + 2_ip)) + (on(k + 3_ip) + on(k + 4_ip)) > 3.5_sp)
      end do
   end subroutine append_off

   !> List the boxes whose tubes, of a given half width around their lines, leave given bounds between two steps, or
   !> whose lines go beyond a limit.
   pure subroutine list_strays(range, steps, widths, origin, n_boxes, bounds, place, speed, n_strays, strays)
      !> First and last box
      integer(ip), intent(in) :: range(2)
      !> First and last step
      real(sp), intent(in) :: steps(2)
      !> Half width of the tubes, and limit of places [m]
      real(wp), intent(in) :: widths(2)
      !> Origin of the places [m]
      real(wp), intent(in) :: origin(2)
      !> Number of boxes
      integer(ip), intent(in) :: n_boxes
      !> Bounds xmin, ymin, xmax, ymax, (4, box) [m]
      real(wp), intent(in) :: bounds(4, n_boxes)
      !> Places of the lines at the start of the interval [m]
      real(sp), intent(in) :: place(4, n_boxes)
      !> Velocities of the lines [m per step]
      real(sp), intent(in) :: speed(4, n_boxes)
      !> Number of boxes in the list
      integer(ip), intent(out) :: n_strays
      !> The list
      integer(ip), intent(out) :: strays(range(2) - range(1) + 2_ip)
      real(sp) :: start(4), end(4), far(4)
      real(wp) :: room(2, pair_block)
      integer(ip) :: from, to, i, k, a

      n_strays = 0_ip
      do from = range(1), range(2), pair_block
         to = min(from + pair_block - 1_ip, range(2))
         do i = from, to
            k = i - from + 1_ip
            start = place(:, i) + speed(:, i)*steps(1)
            end = place(:, i) + speed(:, i)*steps(2)
            far = abs(place(:, i)) + abs(speed(:, i)*steps(2))
            do a = 1_ip, 2_ip
               room(a, k) = min(widths(2) - real(max(far(a), far(a + 2_ip)), wp), min( &
                                real(min(start(a), end(a)), wp) - (bounds(a, i) - origin(a) + widths(1)), &
                                (bounds(a + 2_ip, i) - origin(a) - widths(1)) - &
                                real(max(start(a + 2_ip), end(a + 2_ip)), wp)))
            end do
         end do
         do k = 1_ip, to - from + 1_ip
            strays(n_strays + 1_ip) = from + k - 1_ip
            n_strays = n_strays + merge(0_ip, 1_ip, min(room(1, k), room(2, k)) >= 0.0_wp)
         end do
      end do
   end subroutine list_strays

   !> Draw new lines through boxes. The deviations from the old lines correct the velocities.
   pure subroutine draw(range, step, rates, origin, n_boxes, bounds, drawn, place, speed, reach)
      !> First and last box
      integer(ip), intent(in) :: range(2)
      !> Number of steps since the start of the last interval
      integer(ip), intent(in) :: step
      !> Share of the deviations that enters the velocities, reduction of all velocities, which makes the least ones
      !> zero, and largest velocity [m per step]
      real(wp), intent(in) :: rates(3)
      !> Origin of the places before and now, (2, 2) [m]
      real(wp), intent(in) :: origin(2, 2)
      !> Number of boxes
      integer(ip), intent(in) :: n_boxes
      !> Bounds of the boxes [m]
      real(wp), intent(in) :: bounds(4_ip*n_boxes)
      !> Step of the last interval at which the lines of each box were drawn
      integer(ip), intent(in) :: drawn(n_boxes)
      !> Places of the lines at the start of the interval [m]
      real(sp), intent(inout) :: place(4_ip*n_boxes)
      !> Velocities of the lines [m per step]
      real(sp), intent(inout) :: speed(4_ip*n_boxes)
      !> Limit of places; then the largest distance of a place below it from the origin, along an axis [m]
      real(sp), intent(inout) :: reach
      ! The same for each side of a block of boxes, so that the loop over them is simple
      real(wp) :: before(n_sides), base(n_sides), rate(n_sides), now, v
      integer(ip) :: from, to, sides, i, k

      now = real(step, wp)
      before = [(origin(:, 1), k=1_ip, n_sides, 2_ip)]
      base = [(origin(:, 2), k=1_ip, n_sides, 2_ip)]
      do from = range(1), range(2), box_block
         to = min(from + box_block - 1_ip, range(2))
         sides = 4_ip*(from - 1_ip)
         do i = from, to
            k = 4_ip*(i - from)
            rate(k + 1_ip:k + 4_ip) = rates(1)*merge(1.0_wp, 0.0_wp, step > drawn(i))/ &
               max(1.0_wp, now - real(drawn(i), wp))
         end do
         do k = 1_ip, 4_ip*(to - from + 1_ip)
            v = real(speed(sides + k), wp) + ((bounds(sides + k) - before(k)) - &
                                              (real(place(sides + k), wp) + real(speed(sides + k), wp)*now))*rate(k)
            v = max(-rates(3), min(rates(3), v))
            speed(sides + k) = real(sign(max(0.0_wp, abs(v) - rates(2)), v), sp)
            place(sides + k) = real(max(-most_place, min(most_place, bounds(sides + k) - base(k))), sp)
         end do
      end do
      reach = farthest(4_ip*(range(2) - range(1) + 1_ip), place(4_ip*range(1) - 3_ip:4_ip*range(2)), reach)
   end subroutine draw

   !> Largest distance of places from the origin, along an axis, that does not exceed a limit [m]
   pure real(sp) function farthest(n, place, limit)
      !> Number of places
      integer(ip), intent(in) :: n
      !> Places [m]
      real(sp), intent(in) :: place(n)
      !> Limit [m]
      real(sp), intent(in) :: limit
      integer(bits) :: distance, most
      integer(ip) :: k

      ! Bits of numbers that are not negative, as integers, are in the order of the numbers, and NaN is last.
      most = 0_bits
      do k = 1_ip, n
         distance = transfer(abs(place(k)), distance)
         most = max(most, merge(distance, 0_bits, distance <= transfer(limit, distance)))
      end do
      farthest = transfer(most, limit)
   end function farthest

   !> Classify pairs between two steps.
   pure subroutine classify(n, box, steps, margin, n_boxes, place, speed, kind)
      !> Number of pairs, at most `pair_block`
      integer(ip), intent(in) :: n
      !> Boxes of each pair, (2, n)
      integer(ip), intent(in) :: box(2, n)
      !> First and last step
      real(sp), intent(in) :: steps(2)
      !> Margin of gaps [m]
      real(sp), intent(in) :: margin
      !> Number of boxes
      integer(ip), intent(in) :: n_boxes
      !> Places of the lines at the start of the interval [m]
      real(sp), intent(in) :: place(4, n_boxes)
      !> Velocities of the lines [m per step]
      real(sp), intent(in) :: speed(4, n_boxes)
      !> Class of each pair: `separate`, `overlapping` or `active`
      integer(bp), intent(out) :: kind(n)
      real(sp) :: gap(4), rate(4), most(4, pair_block), least(4, pair_block), greatest(2, pair_block), &
         smallest(2, pair_block)
      integer(ip) :: k, i, j, a

      ! Elements 1 and 2 of gap, rate, most and least belong to the gaps left of box i and below it, 3 and 4 to the
      ! negative gaps right of it and above it.
      do k = 1_ip, n
         i = box(1, k)
         j = box(2, k)
         gap(1) = place(1, i) - place(3, j)
         gap(2) = place(2, i) - place(4, j)
         gap(3) = place(3, i) - place(1, j)
         gap(4) = place(4, i) - place(2, j)
         rate(1) = speed(1, i) - speed(3, j)
         rate(2) = speed(2, i) - speed(4, j)
         rate(3) = speed(3, i) - speed(1, j)
         rate(4) = speed(4, i) - speed(2, j)
         most(:, k) = max(gap + rate*steps(1), gap + rate*steps(2))
         least(:, k) = min(gap + rate*steps(1), gap + rate*steps(2))
      end do
      do k = 1_ip, n
         do a = 1_ip, 2_ip
            greatest(a, k) = max(most(a, k), -least(a + 2_ip, k))
            smallest(a, k) = max(least(a, k), -most(a + 2_ip, k))
         end do
      end do
      do k = 1_ip, n
         kind(k) = merge(overlapping, active, max(greatest(1, k), greatest(2, k)) < -margin)
         kind(k) = merge(separate, kind(k), max(smallest(1, k), smallest(2, k)) > margin)
      end do
   end subroutine classify

   !> Find which pairs of boxes overlap: 1 or 0. The widths that two boxes share along both axes are found at once.
   pure subroutine find_states(n, box, n_boxes, bounds, state)
      !> Number of pairs and of boxes
      integer(ip), intent(in) :: n, n_boxes
      !> Boxes of each pair, (2, pair)
      integer(ip), intent(in) :: box(2, n)
      !> Bounds of the boxes, (4, box) [m]
      real(wp), intent(in) :: bounds(4, n_boxes)
      !> 1 if the boxes overlap, else 0, (pair)
      integer(bp), intent(out) :: state(n)
      real(wp) :: shared(2, pair_block)
      integer(ip) :: from, to, k, i, j, a

      do from = 1_ip, n, pair_block
         to = min(from + pair_block - 1_ip, n)
         do k = from, to
            i = box(1, k)
            j = box(2, k)
            do a = 1_ip, 2_ip
               shared(a, k - from + 1_ip) = min(bounds(a + 2_ip, j) - bounds(a, i), bounds(a + 2_ip, i) - bounds(a, j))
            end do
         end do
         do k = from, to
            state(k) = merge(overlapping, separate, &
                             min(shared(1, k - from + 1_ip), shared(2, k - from + 1_ip)) >= 0.0_wp)
         end do
      end do
   end subroutine find_states

end module polydem_line_lanes
