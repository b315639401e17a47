!> Scene heap: a column of loose grains that collapses on a long floor.
!>
!> The end walls of the floor are as high as the column and stop bouncing grains.
module polydem_heap
   use polydem_body_list, only: body_list_t
   use polydem_errors, only: error_t, input_error, raise
   use polydem_grains, only: settled_area
   use polydem_kinds, only: wp
   use polydem_lattice, only: lattice_height
   use polydem_pour, only: loose_spacing, place_grains
   use polydem_settings, only: scene_settings_t
   use polydem_walls, only: append_box, rectangle
   implicit none
   private
   public :: list_heap

   !> Width of the column over the square root of the settled area
   real(wp), parameter :: column_width = 1.2_wp
   !> Length of the floor over the square root of the settled area if the length is not given
   real(wp), parameter :: floor_length = 8.0_wp

contains

   !> List the bodies of the heap: grains first, then floor, left end, right end. The floor is at y = 0.
   subroutine list_heap(scene, list, error)
      !> Settings: bodies (grains), width (length of the floor), grains
      type(scene_settings_t), intent(in) :: scene
      type(body_list_t), intent(inout) :: list
      !> Allocated if the column is wider than the floor
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: size, column, length, height, inside(2, 4)

      size = sqrt(settled_area(scene, scene%bodies))
      column = max(column_width*size, 2.0_wp*loose_spacing(scene))
      length = scene%width
      if (.not. length > 0.0_wp) length = max(floor_length*size, 2.0_wp*column)
      if (length < column) then
         call raise(error, input_error, 'width (length of the floor) is less than the width of the column; '// &
                    'increase width')
         return
      end if
      height = lattice_height(scene%bodies, column, loose_spacing(scene))
      inside = rectangle(-0.5_wp*column, 0.5_wp*column, 0.0_wp, height)
      call place_grains(list, scene, inside, scene%bodies, error)
      if (allocated(error)) return
      inside = rectangle(-0.5_wp*length, 0.5_wp*length, 0.0_wp, height)
      call append_box(list, inside, scene%long_axis_max, closed=.false.)
   end subroutine list_heap

end module polydem_heap
