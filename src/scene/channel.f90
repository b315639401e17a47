!> Scene channel: one row of grains with random velocities between two long walls. Grains can hardly pass each other.
!>
!> The scene is nearly one-dimensional. It tests neighbour finders that work along one axis.
module polydem_channel
   use polydem_body_list, only: body_list_t
   use polydem_errors, only: error_t, input_error, raise
   use polydem_gas, only: append_moving_grains, total_area
   use polydem_grains, only: draw_grains, grains_t
   use polydem_kinds, only: ip, wp
   use polydem_pour, only: loose_spacing, displace_randomly
   use polydem_random, only: new_random, random_t
   use polydem_settings, only: scene_settings_t
   use polydem_strings, only: to_text
   use polydem_walls, only: append_box, rectangle
   implicit none
   private
   public :: list_channel

   !> Height of the channel over the largest long axis of a grain
   real(wp), parameter :: height_share = 1.2_wp

contains

   !> List the bodies of the channel: grains from left to right, then floor, left end, right end, lid. The centre of the
   !> channel is at the origin.
   subroutine list_channel(scene, list, error)
      !> Settings: bodies (grains), solid_fraction (of the channel that the polygons cover), speed, grains
      type(scene_settings_t), intent(in) :: scene
      type(body_list_t), intent(inout) :: list
      !> Allocated if the solid_fraction is too large for a start without overlaps
      type(error_t), allocatable, intent(inout) :: error
      type(random_t) :: random
      type(grains_t) :: grains
      real(wp), allocatable :: centres(:, :)
      real(wp) :: height, length, spacing
      integer(ip) :: k, n

      n = scene%bodies
      allocate (centres(2, n))
      random = new_random(scene%seed)
      call draw_grains(scene, random, n, grains)
      height = height_share*scene%long_axis_max
      length = total_area(grains%area)/(scene%solid_fraction*height)
      spacing = length/real(n, wp)
      if (spacing < loose_spacing(scene)) then
         call raise(error, input_error, 'solid_fraction is too large for a row of grains without overlap at the '// &
                    'start; lower solid_fraction to '// &
                    to_text(0.99_wp*scene%solid_fraction*spacing/loose_spacing(scene), 3)//', or lower long_axis_max')
         return
      end if
      do k = 1_ip, n
         centres(:, k) = [spacing*(real(k, wp) - 0.5_wp*real(n + 1_ip, wp)), 0.0_wp]
      end do
      call displace_randomly(random, min(spacing, height) - scene%long_axis_max, centres)
      call append_moving_grains(list, scene, random, grains, centres)
      call append_box(list, rectangle(-0.5_wp*length, 0.5_wp*length, -0.5_wp*height, 0.5_wp*height), &
                      scene%long_axis_max, closed=.true.)
   end subroutine list_channel

end module polydem_channel
