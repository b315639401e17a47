!> Scene stack: blocks on top of each other at rest. The depth of each contact carries the weight above it.
module polydem_stack
   use polydem_kinds, only: wp
   use polydem_parts, only: new_grains, parts_t
   use polydem_settings, only: grains_settings_t, scene_settings_t
   implicit none
   private
   public :: make_stack

   !> Width of the floor over width of a block
   real(wp), parameter :: floor_width = 10.0_wp

contains

   !> Make the parts of the stack: a column of blocks, and the floor. The floor is as thick as a block and its top is at
   !> y = 0.
   subroutine make_stack(scene, parts)
      !> Settings: bodies (blocks), width and height of a block
      type(scene_settings_t), intent(in) :: scene
      type(parts_t), intent(inout) :: parts
      type(grains_settings_t) :: blocks

      blocks = new_grains('blocks')
      blocks%region = 'at'
      blocks%arrangement = 'column'
      blocks%number = scene%bodies
      blocks%shape = 'rectangle'
      blocks%width = scene%width
      blocks%height = scene%height
      call parts%add_grains(blocks)
      call parts%add_rectangle('floor', -0.5_wp*floor_width*scene%width, 0.5_wp*floor_width*scene%width, &
                               -scene%height, 0.0_wp)
   end subroutine make_stack

end module polydem_stack
