!> Benchmark B2: mass properties of random convex polygons.
!>
!> The program sums over a fan of triangles. The expected values are sums over edges (Green's theorem), with the cross
!> product c_i = x_i y_(i+1) - x_(i+1) y_i of neighbouring corners: A = sum c_i/2, centroid sum c_i (r_i + r_(i+1))/(6
!> A) and, about the centroid, J = sum c_i (r_i.r_i + r_i.r_(i+1) + r_(i+1).r_(i+1))/12. A translation and a rotation do
!> not change the area and the second moment, and they move the centroid with the polygon.
module b02_mass_properties
   use outlines, only: pi
   use polydem_kinds, only: ip, wp
   use polydem_polygon, only: mass_properties
   use polydem_random, only: new_random, random_t
   use verification_table, only: table_t
   implicit none
   private
   public :: run_mass_properties

contains

   !> Compare many polygons of 3 to 16 corners; each row has the greatest error.
   subroutine run_mass_properties(table, thorough)
      !> Table to fill
      type(table_t), intent(inout) :: table
      !> Whether to compare a million polygons instead of 20 000
      logical, intent(in) :: thorough
      type(random_t) :: random
      real(wp) :: worst(6)
      integer :: k, n

      n = merge(1000000, 20000, thorough)
      call table%begin('B2', 'mass properties of random convex polygons of size 1')
      random = new_random(11_ip)
      worst = 0.0_wp
      do k = 1, n
         call compare(random, worst)
      end do
      call table%expect_absolute('worst relative error of the area', 0.0_wp, worst(1), 1.0e-13_wp)
      call table%expect_absolute('worst error of the centroid [m]', 0.0_wp, worst(2), 1.0e-13_wp)
      call table%expect_absolute('worst relative error of the second moment', 0.0_wp, worst(3), 1.0e-13_wp)
      call table%expect_absolute('worst relative change of the area when moved and turned', 0.0_wp, worst(4), &
                                 1.0e-13_wp)
      call table%expect_absolute('worst change of the centroid when moved and turned [m]', 0.0_wp, worst(5), 1.0e-13_wp)
      call table%expect_absolute('worst relative change of the second moment', 0.0_wp, worst(6), 1.0e-13_wp)
   end subroutine run_mass_properties

   subroutine compare(random, worst)
      type(random_t), intent(inout) :: random
      real(wp), intent(inout) :: worst(6)
      real(wp), allocatable :: corners(:, :), moved(:, :)
      real(wp) :: area, centroid(2), moment, expected_area, expected_centroid(2), expected_moment
      real(wp) :: area_moved, centroid_moved(2), moment_moved, angle, shift(2)
      integer(ip) :: k

      call draw(random, corners)
      call mass_properties(corners, area, centroid, moment)
      call sum_over_edges(corners, expected_area, expected_centroid, expected_moment)
      worst(1) = max(worst(1), abs(area/expected_area - 1.0_wp))
      worst(2) = max(worst(2), maxval(abs(centroid - expected_centroid)))
      worst(3) = max(worst(3), abs(moment/expected_moment - 1.0_wp))

      angle = random%between(0.0_wp, 2.0_wp*pi)
      shift = [random%between(-1.0_wp, 1.0_wp), random%between(-1.0_wp, 1.0_wp)]
      moved = corners
      do k = 1_ip, size(corners, 2, kind=ip)
         moved(:, k) = turned(corners(:, k), angle) + shift
      end do
      call mass_properties(moved, area_moved, centroid_moved, moment_moved)
      worst(4) = max(worst(4), abs(area_moved/area - 1.0_wp))
      worst(5) = max(worst(5), maxval(abs(centroid_moved - turned(centroid, angle) - shift)))
      worst(6) = max(worst(6), abs(moment_moved/moment - 1.0_wp))
   end subroutine compare

   !> Corners on an ellipse with axes 1 and 0.2 to 1, at random angles that are neither too near nor too far apart.
   subroutine draw(random, corners)
      type(random_t), intent(inout) :: random
      real(wp), allocatable, intent(out) :: corners(:, :)
      real(wp), allocatable :: gaps(:)
      real(wp) :: place, ratio
      integer(ip) :: k, n

      n = random%whole(3_ip, 16_ip)
      allocate (gaps(n), corners(2, n))
      do k = 1_ip, n
         gaps(k) = random%between(0.7_wp, 1.3_wp)
      end do
      ratio = random%between(0.2_wp, 1.0_wp)
      place = random%between(0.0_wp, 2.0_wp*pi)
      do k = 1_ip, n
         corners(:, k) = [0.5_wp*cos(place), 0.5_wp*ratio*sin(place)]
         place = place + 2.0_wp*pi*gaps(k)/sum(gaps)
      end do
   end subroutine draw

   pure subroutine sum_over_edges(corners, area, centroid, moment)
      real(wp), intent(in) :: corners(:, :)
      real(wp), intent(out) :: area, centroid(2), moment
      real(wp) :: p(2), q(2), c
      integer :: k, n

      n = size(corners, 2)
      area = 0.0_wp
      centroid = 0.0_wp
      do k = 1, n
         p = corners(:, k)
         q = corners(:, 1 + modulo(k, n))
         c = p(1)*q(2) - q(1)*p(2)
         area = area + 0.5_wp*c
         centroid = centroid + c*(p + q)/6.0_wp
      end do
      centroid = centroid/area
      moment = 0.0_wp
      do k = 1, n
         p = corners(:, k) - centroid
         q = corners(:, 1 + modulo(k, n)) - centroid
         c = p(1)*q(2) - q(1)*p(2)
         moment = moment + c*(sum(p*p) + sum(p*q) + sum(q*q))/12.0_wp
      end do
   end subroutine sum_over_edges

   pure function turned(point, angle) result(image)
      real(wp), intent(in) :: point(2), angle
      real(wp) :: image(2)

      image = [cos(angle)*point(1) - sin(angle)*point(2), sin(angle)*point(1) + cos(angle)*point(2)]
   end function turned

end module b02_mass_properties
