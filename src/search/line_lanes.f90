!> Passes over all boxes or over many candidates: a kernel, compiled for several instruction sets
!> (`cmake/polydem_kernel.cmake`). `polydem_line_filter` explains what they compute.
!>
!> The four bounds of a box fill one register of AVX2. Lists are written without branches: an entry is always written,
!> and counted only if it belongs there. All comparisons are false for NaN, so a box that is nowhere is off its lines.
module polydem_line_lanes
   use polydem_kinds, only: bp, ip, sp, wp
   implicit none
   private
   public :: pair_block, overlapping, active, find_off, list_strays, draw, classify, find_states

   !> Classes of candidates; the sure ones are also their states in `polydem_candidates`
   integer(bp), parameter :: separate = 0_bp, overlapping = 1_bp, active = 2_bp
   !> Number of boxes that are compared with their lines at once, of their sides, and of integers that join these
   integer(ip), parameter :: box_block = 16_ip, n_sides = 4_ip*box_block, n_rooms = 8_ip
   !> Kind of an integer with as many bits as a number of the working precision
   integer, parameter :: bits = selected_int_kind(merge(38, merge(18, 9, digits(1.0_wp) > 24), digits(1.0_wp) > 53))
   !> Largest number of pairs that are classified at once, and of boxes whose room is found at once
   integer(ip), parameter :: pair_block = 128_ip

contains

   !> List the boxes of which a side is farther from its line than the tolerance.
   pure subroutine find_off(low, high, step, tolerance, n_boxes, bounds, place, speed, n_off, off)
      !> First and last box
      integer(ip), intent(in) :: low, high
      !> Number of steps since the start of the interval
      real(wp), intent(in) :: step
      !> Tolerance [m]
      real(wp), intent(in) :: tolerance
      !> Number of boxes
      integer(ip), intent(in) :: n_boxes
      !> Bounds of the boxes [m]
      real(wp), intent(in) :: bounds(4_ip*n_boxes)
      !> Places of the lines at the start of the interval [m]
      real(wp), intent(in) :: place(4_ip*n_boxes)
      !> Velocities of the lines [m per step]
      real(sp), intent(in) :: speed(4_ip*n_boxes)
      !> Number of boxes in the list
      integer(ip), intent(out) :: n_off
      !> The list
      integer(ip), intent(out) :: off(high - low + 2_ip)
      real(wp) :: on(n_sides)
      integer(bits) :: rooms(n_rooms), whole
      integer(ip) :: from, to, sides, i, k, l

      n_off = 0_ip
      whole = transfer(tolerance, whole)
      do from = low, high, box_block
         to = min(from + box_block - 1_ip, high)
         sides = 4_ip*(from - 1_ip)
         if (to - from == box_block - 1_ip) then
            ! Bits of numbers that are not negative, as integers, are in the order of the numbers, and NaN is last. So a
            ! difference is negative exactly where a side is off, and the sign of the disjunction shows this.
            rooms = 0_bits
            do k = 0_ip, n_sides - n_rooms, n_rooms
               do l = 1_ip, n_rooms
                  rooms(l) = ior(rooms(l), whole - transfer(abs(bounds(sides + k + l) - (place(sides + k + l) + &
                                    real(speed(sides + k + l), wp)*step)), whole))
               end do
            end do
            if (iany(rooms) >= 0_bits) cycle
         end if
         do k = 1_ip, 4_ip*(to - from + 1_ip)
            on(k) = merge(1.0_wp, 0.0_wp, abs(bounds(sides + k) - (place(sides + k) + &
                          real(speed(sides + k), wp)*step)) <= tolerance)
         end do
         do i = from, to
            k = 4_ip*(i - from)
            off(n_off + 1_ip) = i
            n_off = n_off + merge(0_ip, 1_ip, (on(k + 1_ip) + on(k + 2_ip)) + (on(k + 3_ip) + on(k + 4_ip)) > 3.5_wp)
         end do
      end do
   end subroutine find_off

   !> List the boxes whose tubes, of a given half width around their lines, leave given bounds between two steps, or
   !> whose lines go beyond a limit.
   pure subroutine list_strays(low_box, high_box, steps, widths, n_boxes, bounds, place, speed, n_strays, strays)
      !> First and last box
      integer(ip), intent(in) :: low_box, high_box
      !> First and last step
      real(wp), intent(in) :: steps(2)
      !> Half width of the tubes, and limit of coordinates [m]
      real(wp), intent(in) :: widths(2)
      !> Number of boxes
      integer(ip), intent(in) :: n_boxes
      !> Bounds xmin, ymin, xmax, ymax, (4, box) [m]
      real(wp), intent(in) :: bounds(4, n_boxes)
      !> Places of the lines at the start of the interval [m]
      real(wp), intent(in) :: place(4, n_boxes)
      !> Velocities of the lines [m per step]
      real(sp), intent(in) :: speed(4, n_boxes)
      !> Number of boxes in the list
      integer(ip), intent(out) :: n_strays
      !> The list
      integer(ip), intent(out) :: strays(high_box - low_box + 2_ip)
      real(wp) :: low, high, low_end, high_end, far_low, far_high, room(2, pair_block)
      integer(ip) :: from, to, i, k, a

      n_strays = 0_ip
      do from = low_box, high_box, pair_block
         to = min(from + pair_block - 1_ip, high_box)
         do i = from, to
            k = i - from + 1_ip
            do a = 1_ip, 2_ip
               low = place(a, i) + real(speed(a, i), wp)*steps(1)
               low_end = place(a, i) + real(speed(a, i), wp)*steps(2)
               high = place(a + 2_ip, i) + real(speed(a + 2_ip, i), wp)*steps(1)
               high_end = place(a + 2_ip, i) + real(speed(a + 2_ip, i), wp)*steps(2)
               far_low = abs(place(a, i)) + abs(real(speed(a, i), wp)*steps(2))
               far_high = abs(place(a + 2_ip, i)) + abs(real(speed(a + 2_ip, i), wp)*steps(2))
               room(a, k) = min(widths(2) - max(far_low, far_high), min( &
                                min(low, low_end) - (bounds(a, i) + widths(1)), &
                                (bounds(a + 2_ip, i) - widths(1)) - max(high, high_end)))
            end do
         end do
         do k = 1_ip, to - from + 1_ip
            strays(n_strays + 1_ip) = from + k - 1_ip
            n_strays = n_strays + merge(0_ip, 1_ip, min(room(1, k), room(2, k)) >= 0.0_wp)
         end do
      end do
   end subroutine list_strays

   !> Draw new lines through boxes. The deviations from the old lines correct the velocities.
   pure subroutine draw(low, high, step, share, greatest, n_boxes, bounds, drawn, place, speed)
      !> First and last box
      integer(ip), intent(in) :: low, high
      !> Number of steps since the start of the last interval
      integer(ip), intent(in) :: step
      !> Share of the deviations that enters the velocities, and largest velocity [m per step]
      real(wp), intent(in) :: share, greatest
      !> Number of boxes
      integer(ip), intent(in) :: n_boxes
      !> Bounds of the boxes, (4, box) [m]
      real(wp), intent(in) :: bounds(4, n_boxes)
      !> Step of the last interval at which the lines of each box were drawn
      integer(ip), intent(in) :: drawn(n_boxes)
      !> Places of the lines at the start of the interval [m]
      real(wp), intent(inout) :: place(4, n_boxes)
      !> Velocities of the lines [m per step]
      real(sp), intent(inout) :: speed(4, n_boxes)
      real(wp) :: rate, now
      integer(ip) :: i, a

      now = real(step, wp)
      do i = low, high
         rate = share*merge(1.0_wp, 0.0_wp, step > drawn(i))/max(1.0_wp, now - real(drawn(i), wp))
         do a = 1_ip, 4_ip
            speed(a, i) = real(max(-greatest, min(greatest, real(speed(a, i), wp) + &
                               (bounds(a, i) - (place(a, i) + real(speed(a, i), wp)*now))*rate)), sp)
            place(a, i) = bounds(a, i)
         end do
      end do
   end subroutine draw

   !> Classify pairs between two steps.
   pure subroutine classify(n, box, steps, margin, n_boxes, place, speed, kind)
      !> Number of pairs, at most `pair_block`
      integer(ip), intent(in) :: n
      !> Boxes of each pair, (2, n)
      integer(ip), intent(in) :: box(2, n)
      !> First and last step
      real(wp), intent(in) :: steps(2)
      !> Margin of gaps [m]
      real(wp), intent(in) :: margin
      !> Number of boxes
      integer(ip), intent(in) :: n_boxes
      !> Places of the lines at the start of the interval [m]
      real(wp), intent(in) :: place(4, n_boxes)
      !> Velocities of the lines [m per step]
      real(sp), intent(in) :: speed(4, n_boxes)
      !> Class of each pair: `separate`, `overlapping` or `active`
      integer(bp), intent(out) :: kind(n)
      real(wp) :: gap(4), rate(4), most(4, pair_block), least(4, pair_block), greatest(2, pair_block), &
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
         rate(1) = real(speed(1, i), wp) - real(speed(3, j), wp)
         rate(2) = real(speed(2, i), wp) - real(speed(4, j), wp)
         rate(3) = real(speed(3, i), wp) - real(speed(1, j), wp)
         rate(4) = real(speed(4, i), wp) - real(speed(2, j), wp)
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
