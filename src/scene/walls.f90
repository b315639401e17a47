!> Straight walls. Each wall is one rectangle of any length. Walls of a container share edges and do not overlap.
module polydem_walls
   use polydem_body_list, only: body_list_t
   use polydem_kinds, only: wp
   implicit none
   private
   public :: rectangle, append_box

contains

   !> Corners of an upright rectangle, anticlockwise, (2, 4) [m]
   pure function rectangle(left, right, bottom, top) result(corners)
      !> Bounds in x and in y [m]
      real(wp), intent(in) :: left, right, bottom, top
      real(wp) :: corners(2, 4)

      corners(:, 1) = [left, bottom]
      corners(:, 2) = [right, bottom]
      corners(:, 3) = [right, top]
      corners(:, 4) = [left, top]
   end function rectangle

   !> Append the walls of a container around an upright rectangle: floor, left, right and, if closed, a lid.
   subroutine append_box(list, inside, thickness, closed)
      type(body_list_t), intent(inout) :: list
      !> Corners of the rectangle in the order of `rectangle`, (2, 4) [m]
      real(wp), intent(in) :: inside(2, 4)
      !> Thickness of the walls [m]
      real(wp), intent(in) :: thickness
      !> Whether there is a lid
      logical, intent(in) :: closed
      real(wp) :: top

      associate (left => inside(1, 1), right => inside(1, 3), bottom => inside(2, 1))
         top = inside(2, 3)
         call list%append(rectangle(left, right, bottom - thickness, bottom), fixed=.true.)
         if (closed) top = top + thickness
         call list%append(rectangle(left - thickness, left, bottom - thickness, top), fixed=.true.)
         call list%append(rectangle(right, right + thickness, bottom - thickness, top), fixed=.true.)
         if (closed) call list%append(rectangle(left, right, inside(2, 3), top), fixed=.true.)
      end associate
   end subroutine append_box

end module polydem_walls
