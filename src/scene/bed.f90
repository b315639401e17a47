!> Scene bed: grains that settle, or lie packed, between a floor and two side walls.
module polydem_bed
   use polydem_arrange, only: loose_spacing
   use polydem_errors, only: error_t, input_error, raise
   use polydem_grains, only: settled_area
   use polydem_kinds, only: wp
   use polydem_lattice, only: lattice_height
   use polydem_parts, only: parts_t
   use polydem_recipe, only: recipe_grains
   use polydem_settings, only: grains_settings_t, scene_settings_t
   use polydem_sizes, only: draw_sizes
   implicit none
   private
   public :: make_bed

   !> Ratio of width to depth of the settled bed if the width is not given
   real(wp), parameter :: aspect = 2.0_wp
   !> Fraction of a rectangle that cells of different sizes can always fill
   real(wp), parameter :: cells_share = 0.6_wp

contains

   !> Make the parts of the bed: grains in a box, floor, left wall, right wall. The floor is at y = 0.
   subroutine make_bed(scene, parts, error)
      !> Settings: bodies (grains), width, grains, packing
      type(scene_settings_t), intent(in) :: scene
      type(parts_t), intent(inout) :: parts
      !> Allocated if the bed is too narrow
      type(error_t), allocatable, intent(inout) :: error
      type(grains_settings_t) :: grains
      real(wp) :: height, width

      grains = recipe_grains(scene)
      grains%number = scene%bodies
      width = scene%width
      if (.not. width > 0.0_wp) &
         width = max(sqrt(aspect*settled_area(grains, scene%bodies)), 2.0_wp*scene%size_ratio*loose_spacing(grains))
      height = loose_height(grains, width)
      if (height < 0.0_wp) then
         call raise(error, input_error, 'width is too small for a grain; increase width')
         return
      end if
      grains%region = 'box'
      grains%low = [-0.5_wp*width, 0.0_wp]
      ! Grains that start with a speed may rise above the lattice.
      grains%high = [0.5_wp*width, height + 2.0_wp*loose_spacing(grains)]
      call parts%add_grains(grains)
      call parts%add_box(grains%low, grains%high, scene%long_axis(2)*sqrt(scene%size_ratio), closed=.false.)
   end subroutine make_bed

   !> Height that loose grains need [m]; negative if the bed is too narrow for one grain
   pure real(wp) function loose_height(grains, width)
      type(grains_settings_t), intent(in) :: grains
      real(wp), intent(in) :: width

      associate (spacing => loose_spacing(grains))
         if (.not. grains%size_ratio > 1.0_wp) then
            loose_height = lattice_height(grains%number, width, spacing)
         else if (width < grains%size_ratio*spacing) then
            loose_height = -1.0_wp
         else
            loose_height = grains%size_ratio*spacing &
                           + sum((draw_sizes(grains%size_ratio, grains%number)*spacing)**2)/(cells_share*width)
         end if
      end associate
   end function loose_height

end module polydem_bed
