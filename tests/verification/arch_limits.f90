!> What a semicircular arch of straight wedges of mean radius 1 m bears, in the theory of rigid blocks.
!>
!> By the safe theorem an arch with enough friction stands if a line of thrust fits into it. For the part from the crown
!> to the joint at angle a, with weight V at x, horizontal thrust H and its moment M at the crown, the thrust crosses
!> the joint at the radius r = (M + V x)/P, P = H sin a + V cos a. The conditions r_in <= r <= r_out for all joints are
!> linear inequalities in H and M. An odd number of wedges has no joint at the crown. Friction mu bounds H: the
!> tangential force V sin a - H cos a of a joint is between -mu P and mu P. These conditions are necessary; friction is
!> not associated, so they are no proof that the arch stands (G. Cocchetti & E. Rizzi, Frattura Integr. Strutt. 51
!> (2020) 356, find that it does).
!>
!> An arch in gravity that is tilted falls by four hinges, at inner and outer ends of joints in turn. By the kinematic
!> theorem the tangent of the tilt is the least, over all such mechanisms, at which the weight does work.
module arch_limits
   use outlines, only: gravity, pi
   use polydem_kinds, only: ip, wp
   use polydem_polygon, only: mass_properties
   implicit none
   private
   public :: wedge, critical_thickness, critical_tilt, widest_gap

contains

   !> Corners of wedge k of n, counted from the right springing, (2, 4) [m]
   pure function wedge(n, k, thickness) result(corners)
      !> Number of wedges, and which one
      integer(ip), intent(in) :: n, k
      !> Thickness of the arch at its joints [m]
      real(wp), intent(in) :: thickness
      real(wp) :: corners(2, 4), low(2), high(2)

      low = direction(real(k - 1_ip, wp)/real(n, wp))
      high = direction(real(k, wp)/real(n, wp))
      corners(:, 1) = (1.0_wp - 0.5_wp*thickness)*low
      corners(:, 2) = (1.0_wp + 0.5_wp*thickness)*low
      corners(:, 3) = (1.0_wp + 0.5_wp*thickness)*high
      corners(:, 4) = (1.0_wp - 0.5_wp*thickness)*high
   end function wedge

   pure function direction(share) result(unit)
      real(wp), intent(in) :: share
      real(wp) :: unit(2)

      unit = [cos(pi*share), sin(pi*share)]
   end function direction

   !> Thickness over radius below which no line of thrust fits into an arch: bisection.
   pure real(wp) function critical_thickness(n, friction)
      !> Number of wedges
      integer(ip), intent(in) :: n
      !> Friction coefficient
      real(wp), intent(in) :: friction
      real(wp) :: low, high
      integer :: k

      low = 0.02_wp
      high = 0.4_wp
      do k = 1, 50
         critical_thickness = 0.5_wp*(low + high)
         if (widest_gap(n, critical_thickness, friction) > 0.0_wp) then
            high = critical_thickness
         else
            low = critical_thickness
         end if
      end do
   end function critical_thickness

   !> Greatest range of M over all H, negative if there is none [N]. It is concave in H; golden-section search
   pure real(wp) function widest_gap(n, thickness, friction)
      !> Number of wedges
      integer(ip), intent(in) :: n
      !> Thickness of the arch at its joints [m]
      real(wp), intent(in) :: thickness
      !> Friction coefficient
      real(wp), intent(in) :: friction
      real(wp), parameter :: golden = 0.618033988749895_wp
      real(wp) :: low, high, left, right
      integer :: k

      call bound_thrust(n, thickness, friction, low, high)
      widest_gap = high - low
      if (widest_gap < 0.0_wp) return
      do k = 1, 100
         left = high - golden*(high - low)
         right = low + golden*(high - low)
         if (gap(n, thickness, left) > gap(n, thickness, right)) then
            high = right
         else
            low = left
         end if
      end do
      widest_gap = gap(n, thickness, 0.5_wp*(low + high))
   end function widest_gap

   !> Find the weight above each joint of the right half, and its moment, from the crown down.
   pure subroutine hang(n, thickness, weight, moment)
      integer(ip), intent(in) :: n
      real(wp), intent(in) :: thickness
      real(wp), intent(out) :: weight((n + 1_ip)/2_ip), moment((n + 1_ip)/2_ip)
      real(wp) :: corners(2, 4), area, centroid(2), ignored, v, m
      integer(ip) :: k

      v = 0.0_wp
      m = 0.0_wp
      do k = (n + 1_ip)/2_ip, 1_ip, -1_ip
         corners = wedge(n, k, thickness)
         ! The right half of the wedge at the crown of an odd number
         if (2_ip*k == n + 1_ip) corners(1, 3:4) = 0.0_wp
         call mass_properties(corners, area, centroid, ignored)
         v = v + 2500.0_wp*area*gravity
         m = m + 2500.0_wp*area*gravity*centroid(1)
         weight(k) = v
         moment(k) = m
      end do
   end subroutine hang

   !> Bounds of the thrust H by friction in all joints [N]
   pure subroutine bound_thrust(n, thickness, friction, low, high)
      integer(ip), intent(in) :: n
      real(wp), intent(in) :: thickness, friction
      real(wp), intent(out) :: low, high
      real(wp) :: weight((n + 1_ip)/2_ip), moment((n + 1_ip)/2_ip), joint(2)
      integer(ip) :: k

      call hang(n, thickness, weight, moment)
      low = 0.0_wp
      high = 2500.0_wp*thickness*gravity*pi
      do k = 1_ip, size(weight, kind=ip)
         joint = direction(real(k - 1_ip, wp)/real(n, wp))
         low = max(low, weight(k)*(joint(2) - friction*joint(1))/(joint(1) + friction*joint(2)))
         if (joint(1) > friction*joint(2)) &
            high = min(high, weight(k)*(joint(2) + friction*joint(1))/(joint(1) - friction*joint(2)))
      end do
   end subroutine bound_thrust

   !> Range of the moment M between the inequalities of all joints of the right half [N]
   pure real(wp) function gap(n, thickness, thrust)
      integer(ip), intent(in) :: n
      real(wp), intent(in) :: thickness, thrust
      real(wp) :: inner, outer, weight((n + 1_ip)/2_ip), moment((n + 1_ip)/2_ip), joint(2), least, greatest
      integer(ip) :: k

      inner = 1.0_wp - 0.5_wp*thickness
      outer = 1.0_wp + 0.5_wp*thickness
      call hang(n, thickness, weight, moment)
      least = -huge(1.0_wp)
      greatest = huge(1.0_wp)
      if (modulo(n, 2_ip) == 0_ip) then
         least = inner*thrust
         greatest = outer*thrust
      end if
      do k = size(weight, kind=ip), 1_ip, -1_ip
         joint = direction(real(k - 1_ip, wp)/real(n, wp))
         least = max(least, inner*(thrust*joint(2) + weight(k)*joint(1)) - moment(k))
         greatest = min(greatest, outer*(thrust*joint(2) + weight(k)*joint(1)) - moment(k))
      end do
      gap = greatest - least
   end function gap

   !> Tangent of the tilt of gravity, to the right, at which four hinges turn
   pure real(wp) function critical_tilt(n, thickness)
      !> Number of wedges
      integer(ip), intent(in) :: n
      !> Thickness of the arch at its joints [m]
      real(wp), intent(in) :: thickness
      !> Area and its first moments up to each joint, from the right springing
      real(wp) :: sums(3, 0:n), end_of_joint(2, 0:n, 2), corners(2, 4), area, centroid(2), ignored
      integer(ip) :: k, a, b, c, d
      integer :: first

      sums = 0.0_wp
      do k = 1_ip, n
         corners = wedge(n, k, thickness)
         call mass_properties(corners, area, centroid, ignored)
         sums(:, k) = sums(:, k - 1_ip) + area*[1.0_wp, centroid]
         end_of_joint(:, k - 1_ip, 1) = corners(:, 1)
         end_of_joint(:, k - 1_ip, 2) = corners(:, 2)
      end do
      end_of_joint(:, n, 1) = corners(:, 4)
      end_of_joint(:, n, 2) = corners(:, 3)
      critical_tilt = huge(1.0_wp)
      do first = 1, 2
         do a = 0_ip, n - 3_ip
            do b = a + 1_ip, n - 2_ip
               do c = b + 1_ip, n - 1_ip
                  do d = c + 1_ip, n
                     critical_tilt = min(critical_tilt, tilt_of_mechanism(first, [a, b, c, d]))
                  end do
               end do
            end do
         end do
      end do

   contains

      !> Tangent at which the weight does work on a mechanism, huge if a hinge cannot turn so. Its first hinge is at an
      !> inner (1) or outer (2) end
      pure real(wp) function tilt_of_mechanism(first, joint) result(tilt)
         integer, intent(in) :: first
         integer(ip), intent(in) :: joint(4)
         real(wp) :: hinge(2, 4), rate(3), velocity(2, 3), power(2), turned(4), mass, arm(2), denominator, sign_of
         integer :: m
         integer, parameter :: pivot(3) = [1, 2, 4]

         tilt = huge(1.0_wp)
         do m = 1, 4
            hinge(:, m) = end_of_joint(:, joint(m), 1 + modulo(first + m, 2))
         end do
         sign_of = real(3 - 2*first, wp)
         rate(1) = sign_of
         velocity = 0.0_wp
         velocity(:, 2) = rate(1)*across(hinge(:, 2) - hinge(:, 1))
         denominator = dot_product(across(hinge(:, 3) - hinge(:, 2)), hinge(:, 3) - hinge(:, 4))
         if (abs(denominator) < 1.0e-12_wp) return
         rate(2) = -dot_product(velocity(:, 2), hinge(:, 3) - hinge(:, 4))/denominator
         arm = hinge(:, 3) - hinge(:, 4)
         rate(3) = dot_product(velocity(:, 2) + rate(2)*across(hinge(:, 3) - hinge(:, 2)), across(arm)) &
                   /dot_product(arm, arm)
         turned = sign_of*[rate(1), rate(1) - rate(2), rate(3) - rate(2), rate(3)]
         if (any(turned < 0.0_wp)) return
         power = 0.0_wp
         do m = 1, 3
            mass = sums(1, joint(m + 1)) - sums(1, joint(m))
            arm = sums(2:3, joint(m + 1)) - sums(2:3, joint(m)) - mass*hinge(:, pivot(m))
            power = power + mass*velocity(:, m) + rate(m)*across(arm)
         end do
         if (power(1) > 1.0e-12_wp) tilt = power(2)/power(1)
      end function tilt_of_mechanism

   end function critical_tilt

   !> A vector turned anticlockwise by a right angle
   pure function across(vector) result(turned)
      real(wp), intent(in) :: vector(2)
      real(wp) :: turned(2)

      turned = [-vector(2), vector(1)]
   end function across

end module arch_limits
