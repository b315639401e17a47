!> Scene incline: a rectangular block on a long slope, in equilibrium in the normal direction.
!>
!> The centre of the contact is at the origin at the start. The slope falls to the right and has a stop at each end.
module polydem_incline
   use polydem_elementary, only: cosine, sine, pi
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, wp
   use polydem_outlines, only: rectangle
   use polydem_pair_parameters, only: density_of, material_number
   use polydem_parts, only: new_grains, parts_t
   use polydem_settings, only: grains_settings_t, settings_t
   use polydem_static_depth, only: resting_block_t, static_depth
   implicit none
   private
   public :: make_incline

   !> Distance from the start to the upper end of the slope, in widths of the block
   real(wp), parameter :: uphill = 10.0_wp
   !> Distance from the start to the lower end of the slope, in widths of the block
   real(wp), parameter :: downhill = 90.0_wp

contains

   !> Make the parts of the incline: block, slope, upper stop, lower stop.
   subroutine make_incline(settings, parts, error)
      !> Settings: slope, width and height of the block, speed (downhill); gravity, stiffness and law
      type(settings_t), intent(in) :: settings
      type(parts_t), intent(inout) :: parts
      !> Allocated if the block is too heavy for the stiffness
      type(error_t), allocatable, intent(inout) :: error
      type(grains_settings_t) :: block
      real(wp) :: along(2), density, depth, load, top, bottom
      integer(ip) :: material, floor_material

      along = [cosine(settings%scene%slope*pi/180.0_wp), -sine(settings%scene%slope*pi/180.0_wp)]
      associate (width => settings%scene%width, height => settings%scene%height, &
                 gravity => settings%forces%gravity)
         material = material_number(settings, settings%scene%material)
         density = density_of(settings, material)
         floor_material = material
         if (settings%scene%wall_material /= '') &
            floor_material = material_number(settings, settings%scene%wall_material)
         load = density*width*height*max(0.0_wp, gravity(1)*along(2) - gravity(2)*along(1))
         call static_depth(settings, resting_block_t(load, width, height, (uphill + downhill)*width, height, &
            0.5_wp*(downhill - uphill)*width, [material, floor_material]), depth, error)
         if (allocated(error)) return
         block = new_grains('block')
         block%region = 'at'
         block%arrangement = 'single'
         block%number = 1_ip
         block%shape = 'outline'
         block%outline = reshape(tilted(rectangle(-0.5_wp*width, 0.5_wp*width, -depth, height - depth), along), [8])
         block%velocity = settings%scene%speed*along
         call parts%add_grains(block)
         top = -uphill*width
         bottom = downhill*width
         call parts%add_polygon('slope', tilted(rectangle(top, bottom, -height, 0.0_wp), along))
         call parts%add_polygon('upper_stop', tilted(rectangle(top - width, top, -height, height), along))
         call parts%add_polygon('lower_stop', tilted(rectangle(bottom, bottom + width, -height, height), along))
      end associate
   end subroutine make_incline

   !> Corners rotated about the origin; the rotation turns the x axis to the unit vector `along`
   pure function tilted(corners, along)
      real(wp), intent(in) :: corners(2, 4), along(2)
      real(wp) :: tilted(2, 4)

      tilted(1, :) = along(1)*corners(1, :) - along(2)*corners(2, :)
      tilted(2, :) = along(2)*corners(1, :) + along(1)*corners(2, :)
   end function tilted

end module polydem_incline
