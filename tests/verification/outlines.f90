!> Outlines of bodies and phrases of namelists that the verification benchmarks share.
module outlines
   use polydem_kinds, only: wp
   use polydem_strings, only: to_text
   implicit none
   private
   public :: regular_polygon, inertia_ratio, integrate_text, pi, gravity

   !> Ratio of the circumference of a circle to its diameter
   real(wp), parameter :: pi = 3.141592653589793238462643383279503_wp
   !> Acceleration of gravity, the default of the namelist [m/s2]
   real(wp), parameter :: gravity = 9.81_wp

contains

   !> Corners of a regular polygon, anticlockwise, (2, n) [m]
   pure function regular_polygon(n, radius, x, y, angle) result(corners)
      !> Number of corners
      integer, intent(in) :: n
      !> Distance of the corners from the centre [m]
      real(wp), intent(in) :: radius
      !> Centre [m]
      real(wp), intent(in) :: x, y
      !> Direction of the first corner from the centre [rad]
      real(wp), intent(in) :: angle
      real(wp) :: corners(2, n), direction
      integer :: k

      do k = 1, n
         direction = angle + 2.0_wp*pi*real(k - 1, wp)/real(n, wp)
         corners(:, k) = [x + radius*cos(direction), y + radius*sin(direction)]
      end do
   end function regular_polygon

   !> I/(m R^2) of a regular polygon: (2 + cos(2 pi/n))/6, from second moments of its n triangles
   pure real(wp) function inertia_ratio(n)
      !> Number of corners
      integer, intent(in) :: n

      inertia_ratio = (2.0_wp + cos(2.0_wp*pi/real(n, wp)))/6.0_wp
   end function inertia_ratio

   !> Group &integrate with a time step and a duration longer than any benchmark; the energy balance is off
   pure function integrate_text(dt) result(text)
      !> Time step [s]
      real(wp), intent(in) :: dt
      character(len=:), allocatable :: text

      text = ' &integrate dt = '//to_text(dt, 17)//' duration = 1000 / &output energy_balance = .false. /'
   end function integrate_text

end module outlines
