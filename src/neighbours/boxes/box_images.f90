!> Images of bounding boxes in a periodic cell.
!>
!> A pair across the border of the cell is a box of a body and an image, a copy of the box of the other body on the far
!> side of the cell. Images stand behind all other boxes and are passive, so a finder treats them as the boxes of halo
!> bodies, and knows nothing of the cell. The pair is found from both sides; the pair list counts how often.
!>
!> Images are chosen when the boxes are made, with room for the distance that boxes may move before they are made
!> again. A box gets those copies that may meet a box of a body that this rank moves.
!>
!> In a sheared cell the copies above and below slide along x. Boxes near these borders have three images there, side by
!> side, of which the middle one is placed in the cell: they follow the slide without being chosen again.
!>
!> Sums of a bound and a side of the cell are rounded. Images, and boxes that are copies themselves, are therefore
!> widened by a few roundings, so that bodies that touch have boxes that touch.
module polydem_box_images
   use polydem_boxes, only: boxes_t
   use polydem_cell, only: cell_t
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: box_images_t, add_images, place_images, place_near

   !> Allowance for rounding, in units of epsilon times the greatest coordinate
   real(wp), parameter :: roundings = 4.0_wp

   !> Images of boxes, behind all other boxes
   type :: box_images_t
      !> Number of boxes before the first image
      integer(ip) :: n_before = 0_ip
      !> Box of which each image is a copy; not allocated in the plane
      integer(ip), allocatable :: source(:)
      !> Number of cells along x and y from the box to its image, (2, image)
      real(wp), allocatable :: copy(:, :)
   end type box_images_t

contains

   !> Choose the images of all boxes, and append them.
   pure subroutine add_images(cell, room, boxes, images)
      type(cell_t), intent(in) :: cell
      !> Distance that boxes may move before images are chosen again [m]
      real(wp), intent(in) :: room
      !> Boxes of all bodies; afterwards with images
      type(boxes_t), intent(inout) :: boxes
      !> The images
      type(box_images_t), intent(out) :: images
      real(wp) :: own(4), copy(4), shift(2)
      integer(ip) :: b, n, pass
      integer :: i, j, most(2)

      own = [huge(own), huge(own), -huge(own), -huge(own)]
      do b = 1_ip, boxes%n
         if (boxes%passive(b)) cycle
         own(1:2) = min(own(1:2), boxes%bounds(1:2, b) - room)
         own(3:4) = max(own(3:4), boxes%bounds(3:4, b) + room)
      end do
      most = merge(1, 0, cell%size > 0.0_wp)
      images%n_before = boxes%n
      do pass = 1_ip, 2_ip
         n = 0_ip
         do b = 1_ip, boxes%n
            do j = -most(2), most(2)
               do i = -most(1), most(1)
                  if (i == 0 .and. j == 0) cycle
                  shift = real([i, j], wp)*cell%size
                  copy = widened(boxes%bounds(:, b) + [shift - room, shift + room], cell%size)
                  if (copy(2) > own(4) .or. copy(4) < own(2)) cycle
                  if (.not. (cell%is_sheared .and. j /= 0) .and. (copy(1) > own(3) .or. copy(3) < own(1))) cycle
                  n = n + 1_ip
                  if (pass == 1_ip) cycle
                  images%source(n) = b
                  images%copy(:, n) = real([i, j], wp)
               end do
            end do
         end do
         if (pass == 1_ip) allocate (images%source(n), images%copy(2, n))
      end do
      call append_images(cell, images, boxes)
      call place_images(images, cell, boxes)
   end subroutine add_images

   !> Append boxes for images.
   pure subroutine append_images(cell, images, boxes)
      type(cell_t), intent(in) :: cell
      type(box_images_t), intent(in) :: images
      !> Boxes; the bounds of images are not set
      type(boxes_t), intent(inout) :: boxes
      real(wp), allocatable :: bounds(:, :)
      real(wp) :: most

      if (size(images%source) == 0) return
      boxes%n = images%n_before + size(images%source, kind=ip)
      boxes%one_to_one = .false.
      ! Images are wider than their boxes. Coordinates stay below twice the greatest ones.
      most = maxval(abs(boxes%bounds)) + maxval(cell%size)
      allocate (bounds(4, boxes%n))
      bounds(:, :images%n_before) = boxes%bounds
      call move_alloc(bounds, boxes%bounds)
      boxes%piece = [boxes%piece, boxes%piece(images%source)]
      boxes%body = [boxes%body, boxes%body(images%source)]
      boxes%fixed = [boxes%fixed, boxes%fixed(images%source)]
      boxes%passive = [boxes%passive, spread(.true., 1, size(images%source))]
      boxes%reach = [boxes%reach, boxes%reach(images%source) + 8.0_wp*roundings*epsilon(most)*most]
   end subroutine append_images

   !> Update the bounds of all images to those of their boxes. Nothing is done in the plane.
   pure subroutine place_images(images, cell, boxes)
      type(box_images_t), intent(in) :: images
      type(cell_t), intent(in) :: cell
      !> Boxes; only the bounds of images change
      type(boxes_t), intent(inout) :: boxes
      real(wp) :: shift(2), slide
      integer(ip) :: k

      if (.not. allocated(images%source)) return
      do k = 1_ip, size(images%source, kind=ip)
         associate (copy => images%copy(:, k), source => boxes%bounds(:, images%source(k)))
            shift = copy*cell%size
            if (cell%is_sheared .and. abs(copy(2)) > 0.0_wp) then
               slide = 0.5_wp*(source(1) + source(3)) + copy(2)*cell%shift - cell%low(1)
               shift(1) = shift(1) + copy(2)*cell%shift - floor(slide*cell%inverse(1))*cell%size(1)
            end if
            boxes%bounds(:, images%n_before + k) = widened(source + [shift, shift], abs(shift))
         end associate
      end do
   end subroutine place_images

   !> Replace the bounds of the boxes of a body by those of the copy that is nearest to its former boxes.
   pure subroutine place_near(cell, inverse_period, former, bounds)
      type(cell_t), intent(in) :: cell
      !> 1/size along both axes, 0 where the body does not repeat [1/m]
      real(wp), intent(in) :: inverse_period(2)
      !> Former bounds of the first box [m]
      real(wp), intent(in) :: former(4)
      !> Bounds of the boxes at the position of the body, (4, box) [m]
      real(wp), intent(inout) :: bounds(:, :)
      real(wp) :: shift(2)
      integer :: b

      shift(2) = anint((former(2) - bounds(2, 1))*inverse_period(2))
      shift(1) = shift(2)*cell%shift
      shift(1) = shift(1) + anint((former(1) - (bounds(1, 1) + shift(1)))*inverse_period(1))*cell%size(1)
      shift(2) = shift(2)*cell%size(2)
      if (.not. any(abs(shift) > 0.0_wp)) return
      do b = 1, size(bounds, 2)
         bounds(:, b) = widened(bounds(:, b) + [shift, shift], abs(shift))
      end do
   end subroutine place_near

   !> Bounds widened by the rounding errors of a shift [m]
   pure function widened(bounds, shift) result(wider)
      !> Bounds after the shift, and the size of the shift along each axis [m]
      real(wp), intent(in) :: bounds(4), shift(2)
      real(wp) :: wider(4), extra(2)

      extra = roundings*epsilon(1.0_wp)*(max(abs(bounds(1:2)), abs(bounds(3:4))) + shift)
      wider(1:2) = bounds(1:2) - extra
      wider(3:4) = bounds(3:4) + extra
   end function widened

end module polydem_box_images
