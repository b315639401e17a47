!> Shapes for the tests of overlaps, and one call that computes a case in many positions.
module overlap_cases
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use polydem_convex_overlap, only: overlap_polygons, overlap_t
   use polydem_kinds, only: ip, wp
   use polydem_polygon, only: diameter
   use polydem_random, only: random_t
   implicit none
   private
   public :: rectangle, regular, irregular, turned, overlap_of, roundoff, two_pi
   public :: far, worst_area, worst_normal, worst_normal_far, worst_moment, worst_centroid

   !> Full turn [rad]
   real(wp), parameter :: two_pi = 6.283185307179586476925286766559_wp
   !> Angles of the positions: zero, two general angles, a quarter turn, half a turn [rad]
   real(wp), parameter :: angles(8) = [0.0_wp, 0.1_wp, 0.7853981_wp, 1.0_wp, 0.25_wp*two_pi, 2.3_wp, &
                                       0.5_wp*two_pi, 5.77_wp]
   !> Units of length of the positions
   real(wp), parameter :: scales(3) = [1.0_wp, 1.0e-9_wp, 1.0e9_wp]
   !> Number of positions: two orders at every angle in every unit
   integer, parameter :: n_positions = 2*size(angles)*size(scales)
   !> A place far from the origin, in these units: positions there leave three fifths of the digits to the shapes
   real(wp), parameter :: far(2) = [1.0_wp, -0.7_wp]*2.0_wp**int(0.4_wp*real(digits(1.0_wp), wp))

contains

   !> Rectangle about its centre
   pure function rectangle(width, height) result(vertices)
      !> Side along x
      real(wp), intent(in) :: width
      !> Side along y
      real(wp), intent(in) :: height
      real(wp) :: vertices(2, 4)

      vertices = reshape(0.5_wp*[-width, -height, width, -height, width, height, -width, height], [2, 4])
   end function rectangle

   !> Regular polygon about its centre, one vertex at an angle
   pure function regular(corners, radius, angle) result(vertices)
      !> Number of vertices
      integer(ip), intent(in) :: corners
      !> Radius of the circle around it
      real(wp), intent(in) :: radius
      !> Angle of the first vertex [rad]
      real(wp), intent(in) :: angle
      real(wp) :: vertices(2, corners)
      integer(ip) :: k

      do k = 1_ip, corners
         vertices(1, k) = radius*cos(angle + two_pi*real(k - 1_ip, wp)/real(corners, wp))
         vertices(2, k) = radius*sin(angle + two_pi*real(k - 1_ip, wp)/real(corners, wp))
      end do
   end function regular

   !> Irregular polygon in a circle about its centre
   function irregular(random, corners, radius) result(vertices)
      !> Source of its irregularity
      type(random_t), intent(inout) :: random
      !> Number of vertices
      integer(ip), intent(in) :: corners
      !> Radius of the circle around it
      real(wp), intent(in) :: radius
      real(wp) :: vertices(2, corners), angle, start
      integer(ip) :: k

      start = random%between(0.0_wp, two_pi)
      do k = 1_ip, corners
         angle = start + two_pi*(real(k, wp) + random%between(0.0_wp, 0.6_wp))/real(corners, wp)
         vertices(:, k) = radius*[cos(angle), sin(angle)]
      end do
   end function irregular

   !> Points turned about the origin
   pure function turned(points, angle) result(image)
      !> Points, (2, n)
      real(wp), intent(in) :: points(:, :)
      !> Angle, anticlockwise [rad]
      real(wp), intent(in) :: angle
      real(wp) :: image(2, size(points, 2)), c, s

      c = cos(angle)
      s = sin(angle)
      if (.not. abs(angle) > 0.0_wp) s = 0.0_wp
      image(1, :) = c*points(1, :) - s*points(2, :)
      image(2, :) = s*points(1, :) + c*points(2, :)
   end function turned

   !> Overlap of two polygons without a stored separating edge
   pure function overlap_of(a, b, offset) result(overlap)
      !> First polygon
      real(wp), intent(in), contiguous :: a(:, :)
      !> Second polygon
      real(wp), intent(in), contiguous :: b(:, :)
      !> Centre of b minus centre of a
      real(wp), intent(in) :: offset(2)
      type(overlap_t) :: overlap

      call overlap_polygons(a, b, offset, 0_ip, overlap)
   end function overlap_of

   !> Allowed rounding error: 16 u times perimeter times diameter of the smaller polygon
   pure real(wp) function roundoff(a, b)
      !> First polygon
      real(wp), intent(in) :: a(:, :)
      !> Second polygon
      real(wp), intent(in) :: b(:, :)

      if (diameter(a) <= diameter(b)) then
         roundoff = 8.0_wp*epsilon(1.0_wp)*diameter(a)*perimeter(a)
      else
         roundoff = 8.0_wp*epsilon(1.0_wp)*diameter(b)*perimeter(b)
      end if
   end function roundoff

   !> Length of an outline
   pure real(wp) function perimeter(vertices)
      real(wp), intent(in) :: vertices(:, :)
      integer(ip) :: k, n

      n = size(vertices, 2, kind=ip)
      perimeter = 0.0_wp
      do k = 1_ip, n
         perimeter = perimeter + norm2(vertices(:, 1_ip + modulo(k, n)) - vertices(:, k))
      end do
   end function perimeter

   !> Greatest error of the area over all positions, near the origin and far from it.
   !>
   !> Far from the origin a position is rounded to its last digit. The area changes by at most this rounding error times
   !> half of the perimeter. This is not an error of the overlap and is subtracted.
   pure real(wp) function worst_area(a, b, offset, area)
      !> First polygon
      real(wp), intent(in) :: a(:, :)
      !> Second polygon
      real(wp), intent(in) :: b(:, :)
      !> Centre of b minus centre of a
      real(wp), intent(in) :: offset(2)
      !> True area
      real(wp), intent(in) :: area
      type(overlap_t) :: near_by, far_off
      real(wp) :: rounding
      integer :: k

      rounding = 0.5_wp*min(perimeter(a), perimeter(b))*epsilon(1.0_wp)*maxval(abs(far))
      worst_area = 0.0_wp
      do k = 1, n_positions
         near_by = placed(a, b, offset, k, [0.0_wp, 0.0_wp])
         far_off = placed(a, b, offset, k, far)
         worst_area = worse(worst_area, abs(near_by%area - area))
         worst_area = worse(worst_area, max(0.0_wp, abs(far_off%area - area) - rounding))
         if (.not. (is_finite(near_by) .and. is_finite(far_off))) worst_area = huge(1.0_wp)
      end do
   end function worst_area

   !> Whether all numbers of an overlap are finite
   pure logical function is_finite(overlap)
      type(overlap_t), intent(in) :: overlap

      is_finite = all(ieee_is_finite([overlap%area, overlap%centroid, overlap%normal, overlap%moment_a, &
                                      overlap%moment_b]))
   end function is_finite

   !> Greatest error of the normal vector over all positions near the origin
   pure real(wp) function worst_normal(a, b, offset, normal)
      !> First polygon
      real(wp), intent(in) :: a(:, :)
      !> Second polygon
      real(wp), intent(in) :: b(:, :)
      !> Centre of b minus centre of a
      real(wp), intent(in) :: offset(2)
      !> True integral of the outward normal of a over its outline inside b
      real(wp), intent(in) :: normal(2)

      worst_normal = worst_normal_at([0.0_wp, 0.0_wp], a, b, offset, normal)
   end function worst_normal

   !> Greatest error of the normal vector over all positions far from the origin, for overlaps whose normal vector is a
   !> continuous function of the position
   pure real(wp) function worst_normal_far(a, b, offset, normal)
      !> First polygon
      real(wp), intent(in) :: a(:, :)
      !> Second polygon
      real(wp), intent(in) :: b(:, :)
      !> Centre of b minus centre of a
      real(wp), intent(in) :: offset(2)
      !> True integral of the outward normal of a over its outline inside b
      real(wp), intent(in) :: normal(2)

      worst_normal_far = worst_normal_at(far, a, b, offset, normal)
   end function worst_normal_far

   !> Greatest error of the normal vector over all positions at a place
   pure real(wp) function worst_normal_at(place, a, b, offset, normal)
      real(wp), intent(in) :: place(2)
      real(wp), intent(in) :: a(:, :)
      real(wp), intent(in) :: b(:, :)
      real(wp), intent(in) :: offset(2)
      real(wp), intent(in) :: normal(2)
      type(overlap_t) :: overlap
      real(wp) :: image(2, 1)
      integer :: k

      worst_normal_at = 0.0_wp
      do k = 1, n_positions
         overlap = placed(a, b, offset, k, place)
         image = turned(reshape(normal, [2, 1]), angle_of(k))
         if (modulo(k, 2) == 0) image = -image
         worst_normal_at = worse(worst_normal_at, norm2(overlap%normal - image(:, 1)))
      end do
   end function worst_normal_at

   !> Greatest error of both moments over all positions near the origin
   pure real(wp) function worst_moment(a, b, offset, moment_a, moment_b)
      !> First polygon
      real(wp), intent(in) :: a(:, :)
      !> Second polygon
      real(wp), intent(in) :: b(:, :)
      !> Centre of b minus centre of a
      real(wp), intent(in) :: offset(2)
      !> True moment of the normal vector about the centre of a
      real(wp), intent(in) :: moment_a
      !> True moment of the normal vector about the centre of b
      real(wp), intent(in) :: moment_b
      type(overlap_t) :: overlap
      real(wp) :: moments(2)
      integer :: k

      worst_moment = 0.0_wp
      do k = 1, n_positions
         overlap = placed(a, b, offset, k, [0.0_wp, 0.0_wp])
         if (modulo(k, 2) == 0) then
            moments = -[overlap%moment_b, overlap%moment_a]
         else
            moments = [overlap%moment_a, overlap%moment_b]
         end if
         worst_moment = worse(worst_moment, maxval(abs(moments - [moment_a, moment_b])))
      end do
   end function worst_moment

   !> Greatest error of the centroid over all positions near the origin
   pure real(wp) function worst_centroid(a, b, offset, centroid)
      !> First polygon
      real(wp), intent(in) :: a(:, :)
      !> Second polygon
      real(wp), intent(in) :: b(:, :)
      !> Centre of b minus centre of a
      real(wp), intent(in) :: offset(2)
      !> True centroid relative to the centre of a
      real(wp), intent(in) :: centroid(2)
      type(overlap_t) :: overlap
      real(wp) :: image(2, 1)
      integer :: k

      worst_centroid = 0.0_wp
      do k = 1, n_positions
         overlap = placed(a, b, offset, k, [0.0_wp, 0.0_wp])
         image(:, 1) = centroid
         if (modulo(k, 2) == 0) image(:, 1) = centroid - offset
         image = turned(image, angle_of(k))
         worst_centroid = worse(worst_centroid, norm2(overlap%centroid - image(:, 1)))
      end do
   end function worst_centroid

   !> The larger of two errors; an error that is not a number is the largest
   pure real(wp) function worse(a, b)
      real(wp), intent(in) :: a
      real(wp), intent(in) :: b

      worse = merge(max(a, b), huge(1.0_wp), a >= 0.0_wp .and. b >= 0.0_wp)
   end function worse

   !> The angle of a position: two positions, one for each order, share an angle
   pure real(wp) function angle_of(k)
      integer, intent(in) :: k

      angle_of = angles(1 + modulo((k - 1)/2, size(angles)))
   end function angle_of

   !> Overlap in one of the positions, back in units of 1: odd k in the order given, even k in the other.
   !>
   !> The first polygon lies at a place, and the offset is the difference of both places, as in a run.
   pure function placed(a, b, offset, k, place) result(overlap)
      real(wp), intent(in) :: a(:, :)
      real(wp), intent(in) :: b(:, :)
      real(wp), intent(in) :: offset(2)
      integer, intent(in) :: k
      real(wp), intent(in) :: place(2)
      type(overlap_t) :: overlap
      real(wp) :: arm(2, 1), first(2), second(2), scale, angle

      scale = scales(1 + (k - 1)/(2*size(angles)))
      angle = angle_of(k)
      arm = turned(reshape(scale*offset, [2, 1]), angle)
      first = scale*place
      second = first + arm(:, 1)
      if (modulo(k, 2) == 1) then
         overlap = overlap_of(turned(scale*a, angle), turned(scale*b, angle), second - first)
      else
         overlap = overlap_of(turned(scale*b, angle), turned(scale*a, angle), first - second)
      end if
      overlap%area = overlap%area/scale**2
      overlap%normal = overlap%normal/scale
      overlap%centroid = overlap%centroid/scale
      overlap%moment_a = overlap%moment_a/scale**2
      overlap%moment_b = overlap%moment_b/scale**2
   end function placed

end module overlap_cases
