!> Scene bed: grains that settle, or lie packed, between a floor and two side walls.
module polydem_bed
   use polydem_body_list, only: body_list_t
   use polydem_errors, only: error_t, input_error, raise
   use polydem_grains, only: draw_sizes, settled_area
   use polydem_kinds, only: wp
   use polydem_lattice, only: lattice_height
   use polydem_pour, only: loose_spacing, place_grains
   use polydem_settings, only: scene_settings_t, settings_t
   use polydem_walls, only: append_box, rectangle
   implicit none
   private
   public :: list_bed

   !> Ratio of width to depth of the settled bed if the width is not given
   real(wp), parameter :: aspect = 2.0_wp
   !> Fraction of a rectangle that cells of different sizes can always fill
   real(wp), parameter :: cells_share = 0.6_wp

contains

   !> List the bodies of the bed: grains first, then floor, left wall, right wall. The floor is at y = 0.
   subroutine list_bed(settings, list, error)
      !> Settings: bodies (grains), width, grains, packing; motions
      type(settings_t), intent(in) :: settings
      type(body_list_t), intent(inout) :: list
      !> Allocated if the grains do not fit
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: width, height, inside(2, 4)

      associate (scene => settings%scene)
         width = scene%width
         if (.not. width > 0.0_wp) then
            width = max(sqrt(aspect*settled_area(scene, scene%bodies)), 2.0_wp*scene%size_ratio*loose_spacing(scene))
         end if
         height = loose_height(scene, width)
         if (height < 0.0_wp) then
            call raise(error, input_error, 'width is too small for a grain; increase width')
            return
         end if
         ! Grains that start with a speed may rise above the lattice.
         inside = rectangle(-0.5_wp*width, 0.5_wp*width, 0.0_wp, height + 2.0_wp*loose_spacing(scene))
         call place_grains(list, scene, inside, scene%bodies, error, settings%motion)
         if (allocated(error)) return
         call append_box(list, inside, scene%long_axis_max*sqrt(scene%size_ratio), closed=.false.)
      end associate
   end subroutine list_bed

   !> Height that loose grains need [m]; negative if the bed is too narrow for one grain
   pure real(wp) function loose_height(scene, width)
      type(scene_settings_t), intent(in) :: scene
      real(wp), intent(in) :: width

      associate (spacing => loose_spacing(scene))
         if (.not. scene%size_ratio > 1.0_wp) then
            loose_height = lattice_height(scene%bodies, width, spacing)
         else if (width < scene%size_ratio*spacing) then
            loose_height = -1.0_wp
         else
            loose_height = scene%size_ratio*spacing &
                           + sum((draw_sizes(scene%size_ratio, scene%bodies)*spacing)**2)/(cells_share*width)
         end if
      end associate
   end function loose_height

end module polydem_bed
