!> Scene hopper: a silo with long inclined walls above an opening, and a bin below that collects the outflow.
!>
!> The opening is at y = 0. Each of the five walls is one polygon (Krengel et al. 2026, Fig. 7).
module polydem_hopper
   use polydem_body_list, only: body_list_t
   use polydem_elementary, only: cosine, tangent
   use polydem_errors, only: error_t, input_error, raise
   use polydem_grains, only: pi, settled_area
   use polydem_kinds, only: wp
   use polydem_lattice, only: lattice_height
   use polydem_pour, only: loose_spacing, place_grains
   use polydem_settings, only: scene_settings_t
   use polydem_walls, only: append_box, rectangle
   implicit none
   private
   public :: list_hopper

contains

   !> List the bodies of the hopper: grains first, then floor, left and right wall, left and right incline.
   subroutine list_hopper(scene, list, error)
      !> Settings: bodies (grains), opening, slope (of the inclined walls), width, grains
      type(scene_settings_t), intent(in) :: scene
      type(body_list_t), intent(inout) :: list
      !> Allocated if the opening is not less than the width, or if the grains do not fit
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: half, lip, rise, top, bottom, thickness

      thickness = scene%long_axis_max
      half = 0.5_wp*hopper_width(scene)
      lip = 0.5_wp*scene%opening
      if (lip >= half) then
         call raise(error, input_error, 'opening must be less than width')
         return
      end if
      rise = (half - lip)*tangent(scene%slope*pi/180.0_wp)
      top = rise + max(lattice_height(scene%bodies, 2.0_wp*half, loose_spacing(scene)), thickness)
      call place_grains(list, scene, funnel(half, lip, rise, top), scene%bodies, error)
      if (allocated(error)) return
      bottom = -bin_depth(scene, half) - thickness/cosine(scene%slope*pi/180.0_wp)
      call append_box(list, rectangle(-half, half, bottom, top), thickness, closed=.false.)
      call append_inclines(list, half, lip, rise, thickness/cosine(scene%slope*pi/180.0_wp))
   end subroutine list_hopper

   !> Given width, or the width of a square silo that is at least three openings wide [m]
   pure real(wp) function hopper_width(scene)
      type(scene_settings_t), intent(in) :: scene

      hopper_width = scene%width
      if (hopper_width > 0.0_wp) return
      hopper_width = max(sqrt(settled_area(scene, scene%bodies)), 3.0_wp*scene%opening)
   end function hopper_width

   !> Depth of a bin that holds all grains below the opening, as a heap with a slope of at most one half [m]
   pure real(wp) function bin_depth(scene, half)
      type(scene_settings_t), intent(in) :: scene
      real(wp), intent(in) :: half

      bin_depth = settled_area(scene, scene%bodies)/(2.0_wp*half) + 0.5_wp*half + scene%opening
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

   !> Append the inclined walls: parallelograms that share a face with the upright walls.
   subroutine append_inclines(list, half, lip, rise, drop)
      type(body_list_t), intent(inout) :: list
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
      call list%append(left, fixed=.true.)
      call list%append(right, fixed=.true.)
   end subroutine append_inclines

end module polydem_hopper
