!> Scene incline: a rectangular block on a long slope, in equilibrium in the normal direction.
!>
!> The centre of the contact is at the origin at the start. The slope falls to the right and has a stop at each end.
module polydem_incline
   use polydem_body_list, only: body_list_t
   use polydem_elementary, only: cosine, sine
   use polydem_grains, only: pi
   use polydem_errors, only: error_t
   use polydem_kinds, only: wp
   use polydem_settings, only: settings_t
   use polydem_static_depth, only: resting_block_t, static_depth
   use polydem_walls, only: rectangle
   implicit none
   private
   public :: list_incline

   !> Distance from the start to the upper end of the slope, in widths of the block
   real(wp), parameter :: uphill = 10.0_wp
   !> Distance from the start to the lower end of the slope, in widths of the block
   real(wp), parameter :: downhill = 90.0_wp

contains

   !> List the bodies of the incline: block, slope, upper stop, lower stop.
   subroutine list_incline(settings, list, error)
      !> Settings: slope, width and height of the block, speed (downhill); gravity, stiffness and law
      type(settings_t), intent(in) :: settings
      type(body_list_t), intent(inout) :: list
      !> Allocated if the block is too heavy for the stiffness
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: along(2), depth, load, top, bottom

      along = [cosine(settings%scene%slope*pi/180.0_wp), -sine(settings%scene%slope*pi/180.0_wp)]
      associate (width => settings%scene%width, height => settings%scene%height, &
                 density => settings%scene%density, gravity => settings%forces%gravity)
         load = density*width*height*max(0.0_wp, gravity(1)*along(2) - gravity(2)*along(1))
         call static_depth(settings%forces, resting_block_t(load, width, height, (uphill + downhill)*width, height, &
                                                            0.5_wp*(downhill - uphill)*width), depth, error)
         if (allocated(error)) return
         call list%append(tilted(rectangle(-0.5_wp*width, 0.5_wp*width, -depth, height - depth), along), &
                          density=density, velocity=settings%scene%speed*along)
         top = -uphill*width
         bottom = downhill*width
         call list%append(tilted(rectangle(top, bottom, -height, 0.0_wp), along), fixed=.true.)
         call list%append(tilted(rectangle(top - width, top, -height, height), along), fixed=.true.)
         call list%append(tilted(rectangle(bottom, bottom + width, -height, height), along), fixed=.true.)
      end associate
   end subroutine list_incline

   !> Corners rotated about the origin; the rotation turns the x axis to the unit vector `along`
   pure function tilted(corners, along)
      real(wp), intent(in) :: corners(2, 4), along(2)
      real(wp) :: tilted(2, 4)

      tilted(1, :) = along(1)*corners(1, :) - along(2)*corners(2, :)
      tilted(2, :) = along(2)*corners(1, :) + along(1)*corners(2, :)
   end function tilted

end module polydem_incline
