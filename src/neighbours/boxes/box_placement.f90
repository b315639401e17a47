!> Boxes from the extents of turned vertices and the positions of bodies.
module polydem_box_placement
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: place_whole, place_box, extent_of, turn

contains

   !> Update the boxes of those bodies that are not cut.
   pure subroutine place_whole(n, slots, n_bodies, box, margin, extent, position, n_boxes, bounds, n_cut)
      !> Number of bodies, and their slots
      integer(ip), intent(in) :: n, slots(n)
      !> Number of all bodies
      integer(ip), intent(in) :: n_bodies
      !> Box of each body, (slot); negative if it is cut
      integer(ip), intent(in) :: box(n_bodies)
      !> Padding of the boxes [m]
      real(wp), intent(in) :: margin
      !> Extents of the turned vertices, (4, body) [m]
      real(wp), intent(in) :: extent(4, n)
      !> Centres of all bodies [m]
      real(wp), intent(in) :: position(2, n_bodies)
      !> Number of all boxes
      integer(ip), intent(in) :: n_boxes
      !> Their bounds [m]
      real(wp), intent(inout) :: bounds(4, n_boxes)
      !> Number of bodies that are cut
      integer(ip), intent(out) :: n_cut
      integer(ip) :: k

      n_cut = 0_ip
      do k = 1_ip, n
         if (box(slots(k)) < 0_ip) then
            n_cut = n_cut + 1_ip
         else
            call place_box(extent(:, k), margin, position(:, slots(k)), bounds(:, box(slots(k))))
         end if
      end do
   end subroutine place_whole

   !> Box of vertices with an extent. The padding is applied before the position is added: rounding then remains
   !> monotonic.
   pure subroutine place_box(extent, padding, position, box)
      !> Extent of the turned vertices, padding on each side, and centre of the body [m]
      real(wp), intent(in) :: extent(4), padding, position(2)
      !> xmin, ymin, xmax, ymax [m]
      real(wp), intent(out) :: box(4)

      box(1:2) = position + (extent(1:2) - padding)
      box(3:4) = position + (extent(3:4) + padding)
   end subroutine place_box

   !> Least x and y and greatest x and y of vertices [m]
   pure function extent_of(vertices) result(extent)
      !> Vertices, (2, vertex) [m]
      real(wp), intent(in) :: vertices(:, :)
      real(wp) :: extent(4)
      integer(ip) :: v

      extent(1:2) = vertices(:, 1)
      extent(3:4) = vertices(:, 1)
      do v = 2_ip, size(vertices, 2, kind=ip)
         extent(1:2) = min(extent(1:2), vertices(:, v))
         extent(3:4) = max(extent(3:4), vertices(:, v))
      end do
   end function extent_of

   !> Vertices turned by an angle
   pure function turn(vertices, direction) result(turned)
      !> Vertices, (2, vertex) [m]
      real(wp), intent(in) :: vertices(:, :)
      !> Cosine and sine of the angle
      real(wp), intent(in) :: direction(2)
      real(wp) :: turned(2, size(vertices, 2))
      integer(ip) :: v

      do v = 1_ip, size(vertices, 2, kind=ip)
         turned(1, v) = direction(1)*vertices(1, v) - direction(2)*vertices(2, v)
         turned(2, v) = direction(2)*vertices(1, v) + direction(1)*vertices(2, v)
      end do
   end function turn

end module polydem_box_placement
