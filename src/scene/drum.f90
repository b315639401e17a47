!> Scene drum: a ring of convex segments around loose grains. The settled grains fill about half of the drum.
!>
!> The axis is at the origin. Neighbouring segments share the corners on their common radius and do not overlap. A
!> prescribed rotation about the pivot (0, 0) turns the ring.
module polydem_drum
   use polydem_body_list, only: body_list_t
   use polydem_elementary, only: sine_and_cosine
   use polydem_errors, only: error_t, input_error, raise
   use polydem_grains, only: pi, settled_area
   use polydem_kinds, only: ip, wp
   use polydem_lattice, only: row_height
   use polydem_pour, only: loose_spacing, place_grains
   use polydem_settings, only: scene_settings_t, settings_t
   implicit none
   private
   public :: list_drum, draw_segments

   !> Length of a segment over the mean long axis of the grains. The segment is short enough for a single box
   real(wp), parameter :: segment_length = 3.15_wp
   !> Thickness of a segment over the mean long axis of the grains
   real(wp), parameter :: segment_thickness = 1.05_wp
   !> Smallest number of segments of a ring
   integer(ip), parameter :: least_segments = 12_ip

contains

   !> List the bodies of the drum: grains first, then the segments of the ring, anticlockwise from the right.
   subroutine list_drum(settings, list, error)
      !> Settings: boxes (total) or bodies (grains), radius, grains; motions
      type(settings_t), intent(in) :: settings
      type(body_list_t), intent(inout) :: list
      !> Allocated if the segments need all boxes, or if the grains do not fit
      type(error_t), allocatable, intent(inout) :: error
      real(wp), allocatable :: inner(:, :), corners(:, :, :)
      real(wp) :: radius
      integer(ip) :: k, n, segments

      call choose_drum_size(settings%scene, n, segments, radius)
      if (n < 1_ip) then
         call raise(error, input_error, 'the ring alone needs all boxes; increase boxes or decrease radius')
         return
      end if
      call draw_ring(radius, segments, inner)
      call place_grains(list, settings%scene, inner, n, error, settings%motion)
      if (allocated(error)) return
      call draw_segments(radius, segment_thickness*mean_axis(settings%scene), segments, corners)
      do k = 1_ip, segments
         call list%append(corners(:, :, k), fixed=.true.)
      end do
   end subroutine list_drum

   !> Choose the number of grains, the number of segments and the inner radius.
   !>
   !> If the given radius is 0, the settled grains fill half of the drum. For few grains the radius is larger, because
   !> their initial lattice must fit. The number of segments depends on the radius, the radius on the number of grains,
   !> and, for a given number of boxes, the number of grains on the number of segments. Ten fixed-point iterations solve
   !> these equations.
   pure subroutine choose_drum_size(scene, n, segments, radius)
      !> Settings: boxes or bodies, radius, grains
      type(scene_settings_t), intent(in) :: scene
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
            loose_area = row_height*loose_spacing(scene)**2*real(max(n, 1_ip), wp)
            radius = max(sqrt(2.0_wp*settled_area(scene, max(n, 1_ip))/pi), &
                         sqrt(loose_area/pi) + loose_spacing(scene))
         end if
         segments = max(least_segments, nint(2.0_wp*pi*radius/(segment_length*mean_axis(scene)), ip))
         if (scene%boxes > 0_ip) n = scene%boxes - segments
      end do
   end subroutine choose_drum_size

   !> Compute the corners of a regular polygon around the origin, anticlockwise from the right.
   subroutine draw_ring(radius, n, corners)
      !> Distance of the corners from the origin [m]
      real(wp), intent(in) :: radius
      !> Number of corners
      integer(ip), intent(in) :: n
      !> Corners, (2, n) [m]
      real(wp), allocatable, intent(out) :: corners(:, :)
      real(wp) :: angle, c, s
      integer(ip) :: k

      allocate (corners(2, n))
      do k = 1_ip, n
         angle = 2.0_wp*pi*real(k - 1_ip, wp)/real(n, wp)
         call sine_and_cosine(angle, s, c)
         corners(:, k) = [radius*c, radius*s]
      end do
   end subroutine draw_ring

   !> Compute the corners of the segments of a ring. Neighbouring segments share corners with identical bits.
   subroutine draw_segments(radius, thickness, n, corners)
      !> Distance of the inner corners from the origin [m]
      real(wp), intent(in) :: radius
      !> Radial distance between inner and outer corners [m]
      real(wp), intent(in) :: thickness
      !> Number of segments
      integer(ip), intent(in) :: n
      !> Corners of each segment, anticlockwise, (2, 4, n) [m]: inner and outer corner at its start, outer and inner
      !> corner at its end
      real(wp), allocatable, intent(out) :: corners(:, :, :)
      real(wp), allocatable :: inner(:, :), outer(:, :)
      integer(ip) :: k, next

      call draw_ring(radius, n, inner)
      call draw_ring(radius + thickness, n, outer)
      allocate (corners(2, 4, n))
      do k = 1_ip, n
         next = modulo(k, n) + 1_ip
         corners(:, 1, k) = inner(:, k)
         corners(:, 2, k) = outer(:, k)
         corners(:, 3, k) = outer(:, next)
         corners(:, 4, k) = inner(:, next)
      end do
   end subroutine draw_segments

   !> Mean long axis of the grains (full length) [m]
   pure real(wp) function mean_axis(scene)
      type(scene_settings_t), intent(in) :: scene

      mean_axis = 0.5_wp*(scene%long_axis_min + scene%long_axis_max)
   end function mean_axis

end module polydem_drum
