!> Scene drum: a ring of convex segments around loose grains. The settled grains fill about half of the drum.
!>
!> The axis is at the origin. Neighbouring segments share the corners on their common radius and do not overlap. A
!> prescribed rotation about the pivot (0, 0) turns the ring.
module polydem_drum
   use polydem_arrange, only: loose_spacing
   use polydem_elementary, only: pi
   use polydem_errors, only: error_t, input_error, raise
   use polydem_grains, only: settled_area
   use polydem_kinds, only: ip, wp
   use polydem_lattice, only: row_height
   use polydem_parts, only: new_wall_part, parts_t
   use polydem_recipe, only: recipe_grains
   use polydem_settings, only: grains_settings_t, scene_settings_t, wall_settings_t
   implicit none
   private
   public :: make_drum

   !> Length of a segment over the mean long axis of the grains. The segment is short enough for a single box
   real(wp), parameter :: segment_length = 3.15_wp
   !> Thickness of a segment over the mean long axis of the grains
   real(wp), parameter :: segment_thickness = 1.05_wp
   !> Smallest number of segments of a ring
   integer(ip), parameter :: least_segments = 12_ip

contains

   !> Make the parts of the drum: grains inside the ring, whose segments follow each other anticlockwise from the right.
   subroutine make_drum(scene, parts, error)
      !> Settings: boxes (total) or bodies (grains), radius, grains
      type(scene_settings_t), intent(in) :: scene
      type(parts_t), intent(inout) :: parts
      !> Allocated if the segments need all boxes
      type(error_t), allocatable, intent(inout) :: error
      type(grains_settings_t) :: grains
      type(wall_settings_t) :: ring
      integer(ip) :: n

      grains = recipe_grains(scene)
      ring = new_wall_part('drum', 'ring')
      call choose_drum_size(scene, grains, n, ring%segments, ring%radius)
      grains%number = n
      if (grains%number < 1_ip) then
         call raise(error, input_error, 'the ring alone needs all boxes; increase boxes or decrease radius')
         return
      end if
      grains%region = 'inside'
      grains%wall = ring%name
      ring%thickness = segment_thickness*mean_axis(scene)
      call parts%add_grains(grains)
      call parts%add_wall(ring)
   end subroutine make_drum

   !> Choose the number of grains, the number of segments and the inner radius.
   !>
   !> If the given radius is 0, the settled grains fill half of the drum. For few grains the radius is larger, because
   !> their initial lattice must fit. The number of segments depends on the radius, the radius on the number of grains,
   !> and, for a given number of boxes, the number of grains on the number of segments. Ten fixed-point iterations solve
   !> these equations.
   pure subroutine choose_drum_size(scene, grains, n, segments, radius)
      !> Settings: boxes or bodies, radius, grains
      type(scene_settings_t), intent(in) :: scene
      type(grains_settings_t), intent(in) :: grains
      !> Number of grains; 0 or negative if the segments need all boxes
      integer(ip), intent(out) :: n
      !> Number of segments
      integer(ip), intent(out) :: segments
      !> Inner radius: distance of the inner corners from the axis [m]
      real(wp), intent(out) :: radius
      real(wp) :: loose_area
      integer :: k

      n = scene%bodies
      if (scene%boxes > 0_ip) n = scene%boxes
      do k = 1, 10
         radius = scene%radius
         if (.not. radius > 0.0_wp) then
            loose_area = row_height*loose_spacing(grains)**2*real(max(n, 1_ip), wp)
            radius = max(sqrt(2.0_wp*settled_area(grains, max(n, 1_ip))/pi), &
                         sqrt(loose_area/pi) + loose_spacing(grains))
         end if
         segments = max(least_segments, nint(2.0_wp*pi*radius/(segment_length*mean_axis(scene)), ip))
         if (scene%boxes > 0_ip) n = scene%boxes - segments
      end do
   end subroutine choose_drum_size

   !> Mean long axis of the grains (full length) [m]
   pure real(wp) function mean_axis(scene)
      type(scene_settings_t), intent(in) :: scene

      mean_axis = 0.5_wp*(scene%long_axis(1) + scene%long_axis(2))
   end function mean_axis

end module polydem_drum
