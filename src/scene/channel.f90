!> Scene channel: one row of grains with random velocities between two long walls. Grains can hardly pass each other.
!>
!> The scene is nearly one-dimensional. It tests neighbour finders that work along one axis.
module polydem_channel
   use polydem_arrange, only: loose_spacing
   use polydem_errors, only: error_t, input_error, raise
   use polydem_gas, only: area_of_grains, moving_grains
   use polydem_kinds, only: wp
   use polydem_parts, only: parts_t
   use polydem_settings, only: grains_settings_t, scene_settings_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: make_channel

   !> Height of the channel over the largest long axis of a grain
   real(wp), parameter :: height_share = 1.2_wp

contains

   !> Make the parts of the channel: grains from left to right, floor, left end, right end, lid. The centre of the
   !> channel is at the origin.
   subroutine make_channel(scene, parts, error)
      !> Settings: bodies (grains), fraction (of the channel that the polygons cover), speed, grains
      type(scene_settings_t), intent(in) :: scene
      type(parts_t), intent(inout) :: parts
      !> Allocated if the solid_fraction is too large for a start without overlaps
      type(error_t), allocatable, intent(inout) :: error
      type(grains_settings_t) :: grains
      real(wp) :: height, length, spacing

      grains = moving_grains(scene)
      grains%arrangement = 'row'
      height = height_share*scene%long_axis(2)
      length = area_of_grains(grains, scene%seed)/(scene%solid_fraction*height)
      spacing = length/real(scene%bodies, wp)
      if (spacing < loose_spacing(grains)) then
         call raise(error, input_error, 'solid_fraction is too large for a row of grains without overlap at the '// &
                    'start; lower solid_fraction to '// &
                    to_text(0.99_wp*scene%solid_fraction*spacing/loose_spacing(grains), 3)//', or lower long_axis')
         return
      end if
      grains%low = [-0.5_wp*length, -0.5_wp*height]
      grains%high = [0.5_wp*length, 0.5_wp*height]
      call parts%add_grains(grains)
      call parts%add_box(grains%low, grains%high, scene%long_axis(2), closed=.true.)
   end subroutine make_channel

end module polydem_channel
