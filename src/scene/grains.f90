!> Random grains: irregular convex polygons inscribed in ellipses.
!>
!> All grains share the short axis of their ellipses; long axis, number of corners, their places and the
!> orientation are random. A polygon inscribed in an ellipse is convex wherever its corners are. Where grains
!> differ in size, both axes are multiplied by it.
module polydem_grains
   use polydem_body_list, only: body_list_t
   use polydem_kinds, only: ip, wp
   use polydem_polygon, only: mass_properties
   use polydem_random, only: random_t
   use polydem_settings, only: scene_settings_t
   use polydem_sort_reals, only: sort_reals
   implicit none
   private
   public :: grain_t, draw_grains, draw_sizes, append_grains, settled_area, pi

   !> Circumference of a circle over its diameter
   real(wp), parameter :: pi = 3.141592653589793238462643383279503_wp

   !> Share of the area of a settled bed that the ellipses around its grains amount to
   real(wp), parameter :: settled_share = 0.895_wp

   !> One grain before it is placed
   type :: grain_t
      !> Corners relative to a point inside, the centre of the ellipse, anticlockwise, (2, corner) [m]
      real(wp), allocatable :: corners(:, :)
      !> Long axis (full length) of the ellipse, or another bound of the diameter about that point [m]
      real(wp) :: length = 0.0_wp
      !> Area of the polygon [m2]
      real(wp) :: area = 0.0_wp
   end type grain_t

contains

   !> Draw grains of random shape and orientation.
   subroutine draw_grains(scene, random, grains, sizes)
      !> Numbers of corners and axes of the ellipses
      type(scene_settings_t), intent(in) :: scene
      !> Stream of random numbers
      type(random_t), intent(inout) :: random
      !> Grains to draw
      type(grain_t), intent(out) :: grains(:)
      !> Factor of the axes of each grain, 1 if absent
      real(wp), intent(in), optional :: sizes(:)
      real(wp) :: centroid(2), second_moment, factor
      integer :: k

      factor = 1.0_wp
      do k = 1, size(grains)
         if (present(sizes)) factor = sizes(k)
         call draw_corners(scene, factor, random, grains(k)%corners, grains(k)%length)
         call mass_properties(grains(k)%corners, grains(k)%area, centroid, second_moment)
      end do
   end subroutine draw_grains

   !> Sizes between 1 and the size ratio, in descending order, as evenly spread as can be.
   !>
   !> The number of grains per size goes with size**-3, so that each octave of sizes covers the same area:
   !> the share of grains smaller than s is (1 - s**-2)/(1 - ratio**-2), and grain k of n takes the size at
   !> which this share is (n - k)/(n - 1). Both extremes are there.
   pure function draw_sizes(ratio, n) result(sizes)
      !> Greatest size, at least 1
      real(wp), intent(in) :: ratio
      !> Number of grains
      integer(ip), intent(in) :: n
      real(wp) :: sizes(n)
      real(wp) :: share
      integer(ip) :: k

      sizes = 1.0_wp
      if (ratio <= 1.0_wp) return
      sizes(1) = ratio
      do k = 2_ip, n - 1_ip
         share = real(n - k, wp)/real(n - 1_ip, wp)
         sizes(k) = 1.0_wp/sqrt(1.0_wp - share*(1.0_wp - ratio**(-2)))
      end do
   end function draw_sizes

   !> Append grains to the list of bodies: as they stand, or if the order is 'descending', from right to left.
   !>
   !> The latter is the worst start of a sweep that exchanges neighbours in lists of box ends: it has every
   !> pair of boxes the wrong way round on x, and every second one on y; no other order has more in sum. With
   !> two ends a box, n grains that hardly overlap make about 2 n**2 exchanges on x and n**2 on y.
   subroutine append_grains(list, scene, grains, centres, velocities, spins)
      !> List to extend
      type(body_list_t), intent(inout) :: list
      !> Order and density
      type(scene_settings_t), intent(in) :: scene
      !> Grains
      type(grain_t), intent(in) :: grains(:)
      !> Where the corners of each are counted from, (2, grain) [m]
      real(wp), intent(in) :: centres(:, :)
      !> Velocities, (2, grain) [m/s]
      real(wp), intent(in) :: velocities(:, :)
      !> Angular velocities, 0 if absent [rad/s]
      real(wp), intent(in), optional :: spins(:)
      real(wp), allocatable :: corners(:, :)
      real(wp) :: spin
      integer(ip) :: order(size(grains)), j, k

      order = [(k, k=1_ip, size(grains, kind=ip))]
      if (scene%order == 'descending') call sort_reals(-centres(1, :), order)
      spin = 0.0_wp
      do j = 1_ip, size(grains, kind=ip)
         k = order(j)
         corners = grains(k)%corners
         corners(1, :) = corners(1, :) + centres(1, k)
         corners(2, :) = corners(2, :) + centres(2, k)
         if (present(spins)) spin = spins(k)
         call list%append(corners, density=scene%density, velocity=velocities(:, k), angular_velocity=spin)
      end do
   end subroutine append_grains

   !> Area that grains cover after they have settled, voids included [m2]
   pure real(wp) function settled_area(scene, n)
      !> Axes of the ellipses, size ratio
      type(scene_settings_t), intent(in) :: scene
      !> Number of grains
      integer(ip), intent(in) :: n
      real(wp) :: mean_ellipse

      mean_ellipse = 0.25_wp*pi*scene%short_axis*0.5_wp*(scene%long_axis_min + scene%long_axis_max)
      settled_area = real(n, wp)*mean_ellipse/settled_share
      if (scene%size_ratio > 1.0_wp) settled_area = settled_area*sum(draw_sizes(scene%size_ratio, n)**2)/real(n, wp)
   end function settled_area

   !> Corners of one grain.
   !>
   !> The gaps between the corners, in the angle by which the ellipse is an image of the circle, are between
   !> half and twice each other: no edge is tiny, and no gap reaches half a turn, so that the centre lies
   !> inside.
   subroutine draw_corners(scene, factor, random, corners, length)
      type(scene_settings_t), intent(in) :: scene
      real(wp), intent(in) :: factor
      type(random_t), intent(inout) :: random
      real(wp), allocatable, intent(out) :: corners(:, :)
      real(wp), intent(out) :: length
      real(wp), allocatable :: gaps(:)
      real(wp) :: long_half, short_half, turn, place, total, x, y
      integer(ip) :: k, n

      n = random%whole(scene%corners_min, scene%corners_max)
      length = factor*random%between(scene%long_axis_min, scene%long_axis_max)
      long_half = 0.5_wp*length
      short_half = 0.5_wp*factor*scene%short_axis
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
