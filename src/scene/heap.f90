!> Scene heap: a column of loose grains that collapses on a long floor.
!>
!> The end walls of the floor are as high as the column and stop bouncing grains.
module polydem_heap
   use polydem_arrange, only: loose_spacing
   use polydem_errors, only: error_t, input_error, raise
   use polydem_grains, only: settled_area
   use polydem_kinds, only: wp
   use polydem_lattice, only: lattice_height
   use polydem_parts, only: parts_t
   use polydem_recipe, only: recipe_grains
   use polydem_settings, only: grains_settings_t, scene_settings_t
   implicit none
   private
   public :: make_heap

   !> Width of the column over the square root of the settled area
   real(wp), parameter :: column_width = 1.2_wp
   !> Length of the floor over the square root of the settled area if the length is not given
   real(wp), parameter :: floor_length = 8.0_wp

contains

   !> Make the parts of the heap: grains in a column, floor, left end, right end. The floor is at y = 0.
   subroutine make_heap(scene, parts, error)
      !> Settings: bodies (grains), width (length of the floor), grains
      type(scene_settings_t), intent(in) :: scene
      type(parts_t), intent(inout) :: parts
      !> Allocated if the column is wider than the floor
      type(error_t), allocatable, intent(inout) :: error
      type(grains_settings_t) :: grains
      real(wp) :: size, column, length, height

      grains = recipe_grains(scene)
      grains%number = scene%bodies
      size = sqrt(settled_area(grains, scene%bodies))
      column = max(column_width*size, 2.0_wp*loose_spacing(grains))
      length = scene%width
      if (.not. length > 0.0_wp) length = max(floor_length*size, 2.0_wp*column)
      if (length < column) then
         call raise(error, input_error, 'width (length of the floor) is less than the width of the column; '// &
                    'increase width')
         return
      end if
      height = lattice_height(scene%bodies, column, loose_spacing(grains))
      grains%region = 'box'
      grains%low = [-0.5_wp*column, 0.0_wp]
      grains%high = [0.5_wp*column, height]
      call parts%add_grains(grains)
      call parts%add_box([-0.5_wp*length, 0.0_wp], [0.5_wp*length, height], scene%long_axis(2), closed=.false.)
   end subroutine make_heap

end module polydem_heap
