!> Benchmark B6: the rate of change of the overlap area, from positions and velocities, against central differences.
!>
!> dA/dt = N . (v_A - v_B) + M_A w_A - M_B w_B with the integrals N and M over the outline of one body inside the
!> other. The difference quotient over 2 h has a rounding error of 1e-16/h and a truncation error of h^2, or of h where
!> a corner enters or leaves. With h = 1e-7 both are small against 1e-7 of the scale of the rate, |N| |v| + |M| |w|.
module b06_area_rate
   use outlines, only: pi
   use polydem_kinds, only: ip, wp
   use polydem_random, only: new_random, random_t
   use posed_pair, only: new_pair, pair_t, press
   use verification_table, only: table_t
   implicit none
   private
   public :: run_area_rate

contains

   !> Compare random pairs of convex polygons of size 1 with random velocities.
   subroutine run_area_rate(table, thorough)
      !> Table to fill
      type(table_t), intent(inout) :: table
      !> Whether to compare 1e5 pairs instead of 1e4
      logical, intent(in) :: thorough
      real(wp), parameter :: h = 1.0e-7_wp
      type(random_t) :: random
      type(pair_t) :: pair
      real(wp) :: rate, before, after, scale, worst
      integer :: s, n

      call table%begin('B6', 'rate of the overlap area against central differences')
      random = new_random(5_ip)
      worst = 0.0_wp
      n = 0
      do while (n < merge(100000, 10000, thorough))
         call new_pair('area', polygon(random, 0.0_wp), polygon(random, 1.2_wp), pair)
         do s = 1, 2
            pair%bodies%velocity(:, s) = [random%normal(), random%normal()]
            pair%bodies%angular_velocity(s) = random%normal()
         end do
         call press(pair)
         ! A corner that enters within h changes the area by h^2 only, unless the overlap itself is that small.
         if (pair%contacts%n == 0_ip .or. pair%contacts%n_degenerate > 0_ip) cycle
         if (pair%contacts%row(1)%area < 1.0e-6_wp) cycle
         n = n + 1
         rate = pair%contacts%row(1)%rate
         associate (bodies => pair%bodies)
            scale = norm2(pair%contacts%row(1)%normal)*(norm2(bodies%velocity(:, 1)) + norm2(bodies%velocity(:, 2))) &
               + sum(abs(pair%contacts%row(1)%moment*bodies%angular_velocity))
         end associate
         call move(h, pair, after)
         call move(-2.0_wp*h, pair, before)
         worst = max(worst, abs((after - before)/(2.0_wp*h) - rate)/scale)
      end do
      call table%expect_absolute('worst error over the scale of the rate', 0.0_wp, worst, 1.0e-7_wp)
   end subroutine run_area_rate

   !> Move both bodies by their velocities and find the area of the overlap.
   subroutine move(time, pair, area)
      real(wp), intent(in) :: time
      type(pair_t), intent(inout) :: pair
      real(wp), intent(out) :: area

      pair%bodies%position = pair%bodies%position + time*pair%bodies%velocity
      pair%bodies%angle = pair%bodies%angle + time*pair%bodies%angular_velocity
      call press(pair)
      area = 0.0_wp
      if (pair%contacts%n > 0_ip) area = pair%contacts%row(1)%area
   end subroutine move

   !> Corners on an ellipse around a point near (x, 0).
   function polygon(random, x) result(corners)
      type(random_t), intent(inout) :: random
      real(wp), intent(in) :: x
      real(wp), allocatable :: corners(:, :)
      real(wp) :: centre(2), axes(2), angle
      integer(ip) :: k, n

      n = random%whole(3_ip, 9_ip)
      allocate (corners(2, n))
      centre = [x + 0.4_wp*random%uniform(), 0.4_wp*random%uniform()]
      axes = [0.5_wp + 0.5_wp*random%uniform(), 0.5_wp + 0.5_wp*random%uniform()]
      do k = 1_ip, n
         angle = 2.0_wp*pi*(real(k, wp) + 0.7_wp*random%uniform())/real(n, wp)
         corners(:, k) = centre + axes*[cos(angle), sin(angle)]
      end do
   end function polygon

end module b06_area_rate
