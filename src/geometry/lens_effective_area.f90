!> Measures of lenses by their moments (see `polydem_overlap_measure`), for all lanes of a batch at a time.
!>
!> The coordinates are x along the chord z from the first crossing X to the second one Y, in units of its length, and
!> y across it, so scaled that the greatest is 1; h is the area of their unit square. Then X is at (-1/2, 0), Y at
!> (1/2, 0), and P's arc lies at negative y. The second moments of the lens about its centroid c are the sums over
!> both arcs.
!>
!> The gradient of the effective area is the integral of (G/4) q n over P's arc. By the divergence theorem it is the
!> same integral over the chord plus the integral of the gradient of (G/4) q over the part of the lens on P's side; the
!> moment likewise. With
!> the moments m of the lens, the form L(x, y) = m_yy x^2 - 2 m_xy x y + m_xx y^2 = q det, and the first and second
!> moments F and D of P's part about c, the integrals over the chord are closed forms in m and c, those over the part
!> linear in F and D. The moments of Q's part are opposite, since those about c vanish for the whole. So half the
!> difference of both parts serves as F and D, and an exchange of P and Q changes no bit but signs.
!>
!> The weight of the area over the length is a constant, of which only the integral over the chord is left, and a
!> multiple of |x - c|^2, whose coefficients replace those of L(x, y). The moment of its gradient about c vanishes
!> everywhere.
module polydem_lens_effective_area
   use polydem_kinds, only: ip, wp
   use polydem_lens_work, only: lens_work_t
   use polydem_overlap_batch, only: column_length, overlap_columns_t
   use polydem_overlap_measure, only: overlap_measure_t
   use polydem_overlap_tolerances, only: least_square, no_length, sure_area
   implicit none
   private
   public :: integrate_effective_area

   !> Greatest coordinate along the chord in units of the chord; lenses that are longer are not certified
   real(wp), parameter :: longest = 64.0_wp
   !> Least determinant of the second moments. A lens contains a triangle of base 1 and height 1, so its own is 1/1728
   !> at least
   real(wp), parameter :: least_determinant = 2.0_wp**(-11)
   !> Least ratio of the determinant to the product of both moments; below, digits would be lost
   real(wp), parameter :: least_ratio = 2.0_wp**(-4)
   !> Least polar moment in units of the square of the chord and of the area of the unit square. It is below that of
   !> every certified lens, whose determinant is at least `least_determinant`, and whose moment across the chord is at
   !> most its area, less than 300
   real(wp), parameter :: least_polar = least_determinant*2.0_wp**(-9)
   real(wp), parameter :: third = 1.0_wp/3.0_wp, sixth = 1.0_wp/6.0_wp, twelfth = 1.0_wp/12.0_wp

   !> Work space of a batch
   type :: work_t
      !> Chord [m], square of its length, area of the unit square [m2]
      real(wp) :: chord(column_length, 2), square(column_length), unit_area(column_length)
      !> Corners, those of P relative to X, those of Q relative to Y (lane, x or y, corner, P or Q)
      real(wp) :: place(column_length, 2, 2, 2)
      !> Twice the area of each part, and six times its first moments about X (P) and Y (Q)
      real(wp) :: fan(column_length, 3, 2)
      !> Centroid relative to the middle of the chord
      real(wp) :: centroid(column_length, 2)
      !> Integrals over each arc for the second moments xx, xy, yy about the centroid
      real(wp) :: second(column_length, 3, 2)
      !> Constant part of the weight, and its part in proportion to |x - c|^2, in the unit of the form L(x, y); both are
      !> 0 for the effective area
      real(wp) :: even(column_length), polar(column_length)
   end type work_t

contains

   !> Measure, gradient, moments, and the centroid of all lenses.
   pure subroutine integrate_effective_area(n, measure, lens, columns)
      !> Number of lanes
      integer(ip), intent(in) :: n
      !> The measure, with moments
      type(overlap_measure_t), intent(in) :: measure
      !> The batch with crossings
      type(lens_work_t), intent(inout) :: lens
      !> Overlaps of these lanes
      type(overlap_columns_t), intent(inout) :: columns
      type(work_t) :: work

      call straighten(n, lens, work)
      call find_fan(n, work%place(:, :, :, 1), 1.0_wp, work%fan(:, :, 1))
      call find_fan(n, work%place(:, :, :, 2), -1.0_wp, work%fan(:, :, 2))
      call find_centroid(n, work%fan(:, :, 1), work%fan(:, :, 2), work%centroid)
      call find_second_moments(n, work%place(:, :, :, 1), work%centroid, -0.5_wp, work%second(:, :, 1))
      call find_second_moments(n, work%place(:, :, :, 2), work%centroid, 0.5_wp, work%second(:, :, 2))
      if (measure%per_length) then
         call find_parts_of_weight(n, work, columns)
      else
         work%even(:n) = 0.0_wp
         work%polar(:n) = 0.0_wp
         columns%length_square(:n) = 0.0_wp
      end if
      call weigh(n, merge(0.0_wp, 1.0_wp, measure%per_length), work, lens, columns)
      if (measure%with_area) call keep_area(n, work, columns)
   end subroutine integrate_effective_area

   !> Find the coordinates of the corners along and across the chord.
   pure subroutine straighten(n, lens, work)
      integer(ip), intent(in) :: n
      type(lens_work_t), intent(inout) :: lens
      type(work_t), intent(inout) :: work
      real(wp) :: zx, zy, least, along(4), across(4), ax, ay, scale_x, scale_y
      integer(ip) :: i

      do i = 1_ip, n
         zx = lens%crossing(i, 1, 2) - lens%crossing(i, 1, 1)
         zy = lens%crossing(i, 2, 2) - lens%crossing(i, 2, 1)
         least = least_square*lens%radius(i, 1)*lens%radius(i, 1)
         ax = lens%some(i, 1)*((lens%corner(i, 1, 2, 1) + lens%centre(i, 1)) - lens%crossing(i, 1, 1))
         ay = lens%some(i, 1)*((lens%corner(i, 2, 2, 1) + lens%centre(i, 2)) - lens%crossing(i, 2, 1))
         along(1) = zx*ax + zy*ay
         across(1) = zx*ay - zy*ax
         ax = lens%some(i, 1)*((lens%corner(i, 1, 3, 1) + lens%centre(i, 1)) - lens%crossing(i, 1, 1))
         ay = lens%some(i, 1)*((lens%corner(i, 2, 3, 1) + lens%centre(i, 2)) - lens%crossing(i, 2, 1))
         along(2) = zx*ax + zy*ay
         across(2) = zx*ay - zy*ax
         ax = lens%some(i, 2)*((lens%corner(i, 1, 2, 2) + lens%centre(i, 3)) - lens%crossing(i, 1, 2))
         ay = lens%some(i, 2)*((lens%corner(i, 2, 2, 2) + lens%centre(i, 4)) - lens%crossing(i, 2, 2))
         along(3) = zx*ax + zy*ay
         across(3) = zx*ay - zy*ax
         ax = lens%some(i, 2)*((lens%corner(i, 1, 3, 2) + lens%centre(i, 3)) - lens%crossing(i, 1, 2))
         ay = lens%some(i, 2)*((lens%corner(i, 2, 3, 2) + lens%centre(i, 4)) - lens%crossing(i, 2, 2))
         along(4) = zx*ax + zy*ay
         across(4) = zx*ay - zy*ax
         work%chord(i, 1) = zx
         work%chord(i, 2) = zy
         work%square(i) = max(zx*zx + zy*zy, least)
         work%unit_area(i) = max(max(max(abs(across(1)), abs(across(2))), max(abs(across(3)), abs(across(4)))), least)
         scale_x = 1.0_wp/work%square(i)
         scale_y = 1.0_wp/work%unit_area(i)
         lens%certified(i) = min(lens%certified(i), longest - scale_x*max(max(abs(along(1)), abs(along(2))), &
                                                                            max(abs(along(3)), abs(along(4)))))
         work%place(i, 1, 1, 1) = max(-longest, min(longest, along(1)*scale_x))
         work%place(i, 2, 1, 1) = across(1)*scale_y
         work%place(i, 1, 2, 1) = max(-longest, min(longest, along(2)*scale_x))
         work%place(i, 2, 2, 1) = across(2)*scale_y
         work%place(i, 1, 1, 2) = max(-longest, min(longest, along(3)*scale_x))
         work%place(i, 2, 1, 2) = across(3)*scale_y
         work%place(i, 1, 2, 2) = max(-longest, min(longest, along(4)*scale_x))
         work%place(i, 2, 2, 2) = across(4)*scale_y
      end do
   end subroutine straighten

   !> Integrate over the part between an arc and the chord, as a fan from the start of the arc.
   pure subroutine find_fan(n, place, end, fan)
      integer(ip), intent(in) :: n
      real(wp), intent(in) :: place(column_length, 2, 2)
      !> End of the arc along the chord, relative to its start
      real(wp), intent(in) :: end
      real(wp), intent(inout) :: fan(column_length, 3)
      real(wp) :: part(2)
      integer(ip) :: i

      do i = 1_ip, n
         part(1) = place(i, 1, 1)*place(i, 2, 2) - place(i, 2, 1)*place(i, 1, 2)
         part(2) = -end*place(i, 2, 2)
         fan(i, 1) = part(1) + part(2)
         fan(i, 2) = part(1)*(place(i, 1, 1) + place(i, 1, 2)) + part(2)*(place(i, 1, 2) + end)
         fan(i, 3) = part(1)*(place(i, 2, 1) + place(i, 2, 2)) + part(2)*place(i, 2, 2)
      end do
   end subroutine find_fan

   !> Find the centroid relative to the middle of the chord.
   pure subroutine find_centroid(n, fan_p, fan_q, centroid)
      integer(ip), intent(in) :: n
      real(wp), intent(in) :: fan_p(column_length, 3), fan_q(column_length, 3)
      real(wp), intent(inout) :: centroid(column_length, 2)
      real(wp) :: scale
      integer(ip) :: i

      do i = 1_ip, n
         scale = 1.0_wp/max(fan_p(i, 1) + fan_q(i, 1), sure_area)
         centroid(i, 1) = scale*(0.5_wp*(fan_q(i, 1) - fan_p(i, 1)) + third*(fan_p(i, 2) + fan_q(i, 2)))
         centroid(i, 2) = scale*third*(fan_p(i, 3) + fan_q(i, 3))
         ! It is among the corners; without a certificate it might be anywhere.
         centroid(i, 1) = max(-2.0_wp*longest, min(2.0_wp*longest, centroid(i, 1)))
         centroid(i, 2) = max(-2.0_wp, min(2.0_wp, centroid(i, 2)))
      end do
   end subroutine find_centroid

   !> Integrate over an arc for the second moments about the centroid.
   pure subroutine find_second_moments(n, place, centroid, start, second)
      integer(ip), intent(in) :: n
      real(wp), intent(in) :: place(column_length, 2, 2), centroid(column_length, 2)
      !> Start of the arc, relative to the middle of the chord; the end is opposite
      real(wp), intent(in) :: start
      real(wp), intent(inout) :: second(column_length, 3)
      real(wp) :: x(4), y(4), part(3)
      integer(ip) :: i

      do i = 1_ip, n
         x(1) = start - centroid(i, 1)
         y(1) = -centroid(i, 2)
         x(2) = (place(i, 1, 1) + start) - centroid(i, 1)
         y(2) = place(i, 2, 1) - centroid(i, 2)
         x(3) = (place(i, 1, 2) + start) - centroid(i, 1)
         y(3) = place(i, 2, 2) - centroid(i, 2)
         x(4) = -start - centroid(i, 1)
         y(4) = y(1)
         part(1) = twelfth*(x(1)*y(2) - y(1)*x(2))
         part(2) = twelfth*(x(2)*y(3) - y(2)*x(3))
         part(3) = twelfth*(x(3)*y(4) - y(3)*x(4))
         second(i, 1) = part(1)*(x(1)*x(1) + x(1)*x(2) + x(2)*x(2)) + part(2)*(x(2)*x(2) + x(2)*x(3) + x(3)*x(3)) &
                        + part(3)*(x(3)*x(3) + x(3)*x(4) + x(4)*x(4))
         second(i, 2) = part(1)*(x(1)*y(1) + x(2)*y(2) + 0.5_wp*(x(1)*y(2) + x(2)*y(1))) &
                        + part(2)*(x(2)*y(2) + x(3)*y(3) + 0.5_wp*(x(2)*y(3) + x(3)*y(2))) &
                        + part(3)*(x(3)*y(3) + x(4)*y(4) + 0.5_wp*(x(3)*y(4) + x(4)*y(3)))
         second(i, 3) = part(1)*(y(1)*y(1) + y(1)*y(2) + y(2)*y(2)) + part(2)*(y(2)*y(2) + y(2)*y(3) + y(3)*y(3)) &
                        + part(3)*(y(3)*y(3) + y(3)*y(4) + y(4)*y(4))
      end do
   end subroutine find_second_moments

   !> Find length and parts of the weight of the area over the length.
   pure subroutine find_parts_of_weight(n, work, columns)
      integer(ip), intent(in) :: n
      type(work_t), intent(inout) :: work
      type(overlap_columns_t), intent(inout) :: columns
      real(wp) :: mxx, mxy, myy, safe, root, area, polar, hz
      integer(ip) :: i

      do i = 1_ip, n
         mxx = work%second(i, 1, 1) + work%second(i, 1, 2)
         mxy = work%second(i, 2, 1) + work%second(i, 2, 2)
         myy = work%second(i, 3, 1) + work%second(i, 3, 2)
         safe = max(mxx*myy - mxy*mxy, least_determinant)
         root = sqrt(12.0_wp*sqrt(safe))
         area = max(0.5_wp*(work%fan(i, 1, 1) + work%fan(i, 1, 2)), 0.25_wp)
         hz = work%unit_area(i)*(work%unit_area(i)/work%square(i))
         polar = max(work%square(i)*mxx + hz*myy, least_polar*work%square(i))
         work%even(i) = 1.5_wp
         ! The form has the unit root/(4 determinant).
         work%polar(i) = 2.0_wp*(area*safe)/(root*polar)
         columns%length_square(i) = 12.0_wp*(polar/area)
      end do
   end subroutine find_parts_of_weight

   !> Compute the results from the moments.
   pure subroutine weigh(n, share, work, lens, columns)
      integer(ip), intent(in) :: n
      !> 1 if the measure is the effective area, 0 if it is the area over the length
      real(wp), intent(in) :: share
      type(work_t), intent(in) :: work
      type(lens_work_t), intent(inout) :: lens
      type(overlap_columns_t), intent(inout) :: columns
      real(wp) :: zx, zy, zz, h, cx, cy, mxx, mxy, myy, dxx, dxy, dyy, fx, fy, kxx, kxy, kyy
      real(wp) :: determinant, safe, root, unit, on_chord, slope, along, across, turn, gx, gy, area, worst
      integer(ip) :: i

      do i = 1_ip, n
         zx = work%chord(i, 1)
         zy = work%chord(i, 2)
         zz = work%square(i)
         h = work%unit_area(i)
         cx = work%centroid(i, 1)
         cy = work%centroid(i, 2)
         mxx = work%second(i, 1, 1) + work%second(i, 1, 2)
         mxy = work%second(i, 2, 1) + work%second(i, 2, 2)
         myy = work%second(i, 3, 1) + work%second(i, 3, 2)
         determinant = mxx*myy - mxy*mxy
         safe = max(determinant, least_determinant)
         root = sqrt(12.0_wp*sqrt(safe))
         unit = root/(24.0_wp*safe)
         area = 0.5_wp*h*(work%fan(i, 1, 1) + work%fan(i, 1, 2))
         ! First moments of P's part, and its second moments: its arc and the chord back
         fx = 0.5_wp*((sixth*work%fan(i, 2, 1) - 0.5_wp*work%fan(i, 1, 1)*(cx + 0.5_wp)) &
                      - (sixth*work%fan(i, 2, 2) - 0.5_wp*work%fan(i, 1, 2)*(cx - 0.5_wp)))
         fy = 0.5_wp*((sixth*work%fan(i, 3, 1) - 0.5_wp*work%fan(i, 1, 1)*cy) &
                      - (sixth*work%fan(i, 3, 2) - 0.5_wp*work%fan(i, 1, 2)*cy))
         dxx = 0.5_wp*(work%second(i, 1, 1) - work%second(i, 1, 2)) - cy*(0.25_wp*twelfth + 0.25_wp*cx*cx)
         dxy = 0.5_wp*(work%second(i, 2, 1) - work%second(i, 2, 2)) - 0.25_wp*cx*cy*cy
         dyy = 0.5_wp*(work%second(i, 3, 1) - work%second(i, 3, 2)) - 0.25_wp*cy*cy*cy
         ! Quadratic form of the weight, six times its mean on the chord, and half its slope along it at the middle
         kxx = share*myy - work%polar(i)*zz
         kxy = share*mxy
         kyy = share*mxx - work%polar(i)*(h*(h/zz))
         on_chord = 0.5_wp*kxx + 6.0_wp*((kxx*cx*cx + kyy*cy*cy) - 2.0_wp*kxy*cx*cy)
         slope = kxx*cx - kxy*cy
         along = 12.0_wp*unit*(h/zz)*(kxx*fx - kxy*fy)
         across = unit*(on_chord - 12.0_wp*(kyy*fy - kxy*fx)) + work%even(i)
         turn = unit*(zz*((cx*on_chord + slope) + 12.0_wp*share*(mxx*dxy - mxy*dxx)) &
                      - 12.0_wp*share*(h*(h/zz))*(myy*dxy - mxy*dyy)) + work%even(i)*(zz*cx)
         gx = (0.5_wp*(lens%crossing(i, 1, 1) + lens%crossing(i, 1, 2)) + cx*zx) - (h/zz)*cy*zy
         gy = (0.5_wp*(lens%crossing(i, 2, 1) + lens%crossing(i, 2, 2)) + cx*zy) + (h/zz)*cy*zx
         columns%area(i) = h*(share*root) + (1.0_wp - share)*area
         columns%normal(i, 1) = across*zy + along*zx
         columns%normal(i, 2) = along*zy - across*zx
         columns%length(i) = sqrt(columns%normal(i, 1)*columns%normal(i, 1) + columns%normal(i, 2)*columns%normal(i, 2))
         columns%arm_first(i, 1) = gx - lens%centre(i, 1)
         columns%arm_first(i, 2) = gy - lens%centre(i, 2)
         columns%arm_second(i, 1) = gx - lens%centre(i, 3)
         columns%arm_second(i, 2) = gy - lens%centre(i, 4)
         columns%moment(i, 1) = turn + cross(columns%arm_first(i, :), columns%normal(i, :))
         columns%moment(i, 2) = turn + cross(columns%arm_second(i, :), columns%normal(i, :))
         worst = certificate(zz, area, columns%length(i), columns%area(i), determinant, mxx*myy, lens%radius(i, 1))
         lens%certified(i) = min(lens%certified(i), worst)
      end do
   end subroutine weigh

   !> Keep the true area and its gradient, the chord turned by a right angle through the middle of the chord.
   pure subroutine keep_area(n, work, columns)
      integer(ip), intent(in) :: n
      type(work_t), intent(in) :: work
      type(overlap_columns_t), intent(inout) :: columns
      integer(ip) :: i

      do i = 1_ip, n
         columns%of_area(i, 1) = work%chord(i, 2)
         columns%of_area(i, 2) = -work%chord(i, 1)
         columns%of_area(i, 3) = work%square(i)*work%centroid(i, 1)
         columns%of_area(i, 4) = 0.5_wp*work%unit_area(i)*(work%fan(i, 1, 1) + work%fan(i, 1, 2))
      end do
   end subroutine keep_area

   !> Positive if chord, area, contact length and moments of a lens are beyond their rounding errors
   pure real(wp) function certificate(square, area, length, measured, determinant, product, radius)
      !> Square of the chord, area, contact length and measure
      real(wp), intent(in) :: square, area, length, measured
      !> Determinant of the moments, and product of both
      real(wp), intent(in) :: determinant, product
      !> Radius of P
      real(wp), intent(in) :: radius

      certificate = min(square - 4.0_wp*no_length**2*area, length*length - 4.0_wp*no_length**2*measured)
      certificate = min(certificate, min(determinant - least_determinant, determinant - least_ratio*product))
      certificate = min(certificate, area - sure_area*radius*radius)
   end function certificate

   !> Cross product of two vectors
   pure real(wp) function cross(a, b)
      real(wp), intent(in) :: a(2), b(2)

      cross = a(1)*b(2) - a(2)*b(1)
   end function cross

end module polydem_lens_effective_area
