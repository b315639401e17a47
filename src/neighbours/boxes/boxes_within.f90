!> Whether the boxes of bodies have stayed where they are allowed to be.
module polydem_boxes_within
   use polydem_bodies, only: block_size
   use polydem_box_maker, only: box_maker_t
   use polydem_boxes, only: boxes_t
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: have_boxes_within

contains

   !> Whether every box of some bodies lies within a zone, or within a limit of its own. Touching counts as within.
   pure logical function have_boxes_within(maker, slots, boxes, zone, limit)
      type(box_maker_t), intent(in) :: maker
      !> Slots of the bodies
      integer(ip), intent(in), contiguous :: slots(:)
      type(boxes_t), intent(in) :: boxes
      !> xmin, ymin, xmax, ymax of the zone [m]
      real(wp), intent(in) :: zone(4)
      !> xmin, ymin, xmax, ymax of the limit of each box, (4, box) [m]
      real(wp), intent(in) :: limit(:, :)
      integer(ip) :: others(block_size + 1_ip), low, high, b, k, n, first, last

      have_boxes_within = .true.
      do low = 1_ip, size(slots, kind=ip), block_size
         high = min(low + block_size - 1_ip, size(slots, kind=ip))
         call list_outside(slots(low:high), maker%box, boxes%bounds, zone, n, others)
         do k = 1_ip, n
            first = maker%box(others(k))
            last = first
            if (first < 0_ip) then
               last = maker%cut(-first)%first_box + maker%cut(-first)%n - 1_ip
               first = maker%cut(-first)%first_box
            end if
            do b = first, last
               have_boxes_within = have_boxes_within .and. &
                  (is_within(boxes%bounds(:, b), zone) .or. is_within(boxes%bounds(:, b), limit(:, b)))
            end do
         end do
      end do
   end function have_boxes_within

   !> List the bodies that are cut, and those whose box is not within a zone. There is no branch, since a processor
   !> cannot predict which bodies these are.
   pure subroutine list_outside(slots, box, bounds, zone, n, outside)
      !> Slots of the bodies, at most `block_size`
      integer(ip), intent(in), contiguous :: slots(:)
      !> Box of each body, (slot); negative if it is cut
      integer(ip), intent(in), contiguous :: box(:)
      !> Bounds of all boxes, and xmin, ymin, xmax, ymax of the zone [m]
      real(wp), intent(in), contiguous :: bounds(:, :)
      real(wp), intent(in) :: zone(4)
      !> Number and slots of the listed bodies. A slot is written before it is known to count, so there is a spare one
      integer(ip), intent(out) :: n
      integer(ip), intent(inout) :: outside(block_size + 1_ip)
      real(wp) :: room
      integer(ip) :: b, k

      n = 0_ip
      do k = 1_ip, size(slots, kind=ip)
         outside(n + 1_ip) = slots(k)
         b = max(box(slots(k)), 1_ip)
         room = min(min(bounds(1, b) - zone(1), bounds(2, b) - zone(2)), &
                    min(zone(3) - bounds(3, b), zone(4) - bounds(4, b)))
         n = n + ior(merge(0_ip, 1_ip, room >= 0.0_wp), shiftr(box(slots(k)), bit_size(n) - 1))
      end do
   end subroutine list_outside

   !> Whether a box lies within a rectangle
   pure logical function is_within(box, rectangle)
      !> xmin, ymin, xmax, ymax [m]
      real(wp), intent(in) :: box(4), rectangle(4)

      is_within = box(1) >= rectangle(1) .and. box(2) >= rectangle(2) .and. box(3) <= rectangle(3) &
                  .and. box(4) <= rectangle(4)
   end function is_within

end module polydem_boxes_within
