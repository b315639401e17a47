!> Scene hopper: a silo with long inclined walls above an opening, and a bin below that collects the outflow.
!>
!> The opening is at y = 0. Each of the five walls is one polygon (Krengel et al. 2026, Fig. 7).
module polydem_hopper
   use polydem_arrange, only: loose_spacing
   use polydem_elementary, only: cosine, tangent, pi
   use polydem_errors, only: error_t, input_error, raise
   use polydem_grains, only: settled_area
   use polydem_kinds, only: wp
   use polydem_lattice, only: lattice_height
   use polydem_parts, only: parts_t
   use polydem_recipe, only: recipe_grains
   use polydem_settings, only: grains_settings_t, scene_settings_t
   implicit none
   private
   public :: make_hopper

contains

   !> Make the parts of the hopper: grains above the inclines, floor, left and right wall, left and right incline.
   subroutine make_hopper(scene, parts, error)
      !> Settings: bodies (grains), opening, slope (of the inclined walls), width, grains
      type(scene_settings_t), intent(in) :: scene
      type(parts_t), intent(inout) :: parts
      !> Allocated if the opening is not less than the width
      type(error_t), allocatable, intent(inout) :: error
      type(grains_settings_t) :: grains
      real(wp) :: half, lip, rise, top, bottom, thickness

      grains = recipe_grains(scene)
      grains%number = scene%bodies
      thickness = scene%long_axis(2)
      half = 0.5_wp*hopper_width(scene, grains)
      lip = 0.5_wp*scene%opening
      if (lip >= half) then
         call raise(error, input_error, 'opening must be less than width')
         return
      end if
      rise = (half - lip)*tangent(scene%slope*pi/180.0_wp)
      top = rise + max(lattice_height(scene%bodies, 2.0_wp*half, loose_spacing(grains)), thickness)
      grains%region = 'polygon'
      grains%vertices = reshape(funnel(half, lip, rise, top), [12])
      call parts%add_grains(grains)
      bottom = -bin_depth(scene, grains, half) - thickness/cosine(scene%slope*pi/180.0_wp)
      call parts%add_box([-half, bottom], [half, top], thickness, closed=.false.)
      call add_inclines(parts, half, lip, rise, thickness/cosine(scene%slope*pi/180.0_wp))
   end subroutine make_hopper

   !> Given width, or the width of a square silo that is at least three openings wide [m]
   pure real(wp) function hopper_width(scene, grains)
      type(scene_settings_t), intent(in) :: scene
      type(grains_settings_t), intent(in) :: grains

      hopper_width = scene%width
      if (hopper_width > 0.0_wp) return
      hopper_width = max(sqrt(settled_area(grains, scene%bodies)), 3.0_wp*scene%opening)
   end function hopper_width

   !> Depth of a bin that holds all grains below the opening, as a heap with a slope of at most one half [m]
   pure real(wp) function bin_depth(scene, grains, half)
      type(scene_settings_t), intent(in) :: scene
      type(grains_settings_t), intent(in) :: grains
      real(wp), intent(in) :: half

      bin_depth = settled_area(grains, scene%bodies)/(2.0_wp*half) + 0.5_wp*half + scene%opening
   end function bin_depth

   !> Convex hexagon in which the grains start, between the inclined walls and the walls above them, (2, 6) [m]
   pure function funnel(half, lip, rise, top) result(corners)
      real(wp), intent(in) :: half, lip, rise, top
      real(wp) :: corners(2, 6)

      corners(:, 1) = [-lip, 0.0_wp]
      corners(:, 2) = [lip, 0.0_wp]
      corners(:, 3) = [half, rise]
      corners(:, 4) = [half, top]
      corners(:, 5) = [-half, top]
      corners(:, 6) = [-half, rise]
   end function funnel

   !> Add the inclined walls: parallelograms that share a face with the upright walls.
   pure subroutine add_inclines(parts, half, lip, rise, drop)
      type(parts_t), intent(inout) :: parts
      real(wp), intent(in) :: half, lip, rise, drop
      real(wp) :: left(2, 4), right(2, 4)

      left(:, 1) = [-half, rise - drop]
      left(:, 2) = [-lip, -drop]
      left(:, 3) = [-lip, 0.0_wp]
      left(:, 4) = [-half, rise]
      right(:, 1) = [lip, -drop]
      right(:, 2) = [half, rise - drop]
      right(:, 3) = [half, rise]
      right(:, 4) = [lip, 0.0_wp]
      call parts%add_polygon('left_incline', left)
      call parts%add_polygon('right_incline', right)
   end subroutine add_inclines

end module polydem_hopper
