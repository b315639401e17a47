!> Random grains: irregular convex polygons inscribed in ellipses.
!>
!> All grains share the short axis of their ellipses; long axis, number of corners, their places and the
!> orientation are random. A polygon inscribed in an ellipse is convex wherever its corners are.
module polydem_grains
   use polydem_body_list, only: body_list_t
   use polydem_kinds, only: ip, wp
   use polydem_polygon, only: mass_properties
   use polydem_random, only: random_t
   use polydem_settings, only: scene_settings_t
   implicit none
   private
   public :: grain_t, draw_grains, append_grains, settled_area, pi

   !> Circumference of a circle over its diameter
   real(wp), parameter :: pi = 3.141592653589793238462643383279503_wp

   !> Share of the area of a settled bed that the ellipses around its grains amount to
   real(wp), parameter :: settled_share = 0.895_wp

   !> One grain before it is placed
   type :: grain_t
      !> Corners relative to the centre of the ellipse, anticlockwise, (2, corner) [m]
      real(wp), allocatable :: corners(:, :)
      !> Area of the polygon [m2]
      real(wp) :: area = 0.0_wp
   end type grain_t

contains

   !> Draw grains of random shape and orientation.
   subroutine draw_grains(scene, random, grains)
      !> Numbers of corners and axes of the ellipses
      type(scene_settings_t), intent(in) :: scene
      !> Stream of random numbers
      type(random_t), intent(inout) :: random
      !> Grains to draw
      type(grain_t), intent(out) :: grains(:)
      real(wp) :: centroid(2), second_moment
      integer :: k

      do k = 1, size(grains)
         call draw_corners(scene, random, grains(k)%corners)
         call mass_properties(grains(k)%corners, grains(k)%area, centroid, second_moment)
      end do
   end subroutine draw_grains

   !> Append grains to the list of bodies, in their order.
   subroutine append_grains(list, grains, centres, velocities, density)
      !> List to extend
      type(body_list_t), intent(inout) :: list
      !> Grains
      type(grain_t), intent(in) :: grains(:)
      !> Centres of their ellipses, (2, grain) [m]
      real(wp), intent(in) :: centres(:, :)
      !> Velocities, (2, grain) [m/s]
      real(wp), intent(in) :: velocities(:, :)
      !> Density [kg/m3]
      real(wp), intent(in) :: density
      real(wp), allocatable :: corners(:, :)
      integer :: k

      do k = 1, size(grains)
         corners = grains(k)%corners
         corners(1, :) = corners(1, :) + centres(1, k)
         corners(2, :) = corners(2, :) + centres(2, k)
         call list%append(corners, density=density, velocity=velocities(:, k))
      end do
   end subroutine append_grains

   !> Area that grains cover after they have settled, voids included [m2]
   pure real(wp) function settled_area(scene, n)
      !> Axes of the ellipses
      type(scene_settings_t), intent(in) :: scene
      !> Number of grains
      integer(ip), intent(in) :: n
      real(wp) :: mean_ellipse

      mean_ellipse = 0.25_wp*pi*scene%short_axis*0.5_wp*(scene%long_axis_min + scene%long_axis_max)
      settled_area = real(n, wp)*mean_ellipse/settled_share
   end function settled_area

   !> Corners of one grain.
   !>
   !> The gaps between the corners, in the angle by which the ellipse is an image of the circle, are between
   !> half and twice each other: no edge is tiny, and no gap reaches half a turn, so that the centre lies
   !> inside.
   subroutine draw_corners(scene, random, corners)
      type(scene_settings_t), intent(in) :: scene
      type(random_t), intent(inout) :: random
      real(wp), allocatable, intent(out) :: corners(:, :)
      real(wp), allocatable :: gaps(:)
      real(wp) :: long_half, short_half, turn, place, total, x, y
      integer(ip) :: k, n

      n = random%whole(scene%corners_min, scene%corners_max)
      long_half = 0.5_wp*random%between(scene%long_axis_min, scene%long_axis_max)
      short_half = 0.5_wp*scene%short_axis
      turn = random%between(0.0_wp, 2.0_wp*pi)
      place = random%between(0.0_wp, 2.0_wp*pi)
      allocate (gaps(n), corners(2, n))
      total = 0.0_wp
      do k = 1_ip, n
         gaps(k) = random%between(2.0_wp/3.0_wp, 4.0_wp/3.0_wp)
         total = total + gaps(k)
      end do
      do k = 1_ip, n
         x = long_half*cos(place)
         y = short_half*sin(place)
         corners(1, k) = cos(turn)*x - sin(turn)*y
         corners(2, k) = sin(turn)*x + cos(turn)*y
         place = place + 2.0_wp*pi*gaps(k)/total
      end do
   end subroutine draw_corners

end module polydem_grains
