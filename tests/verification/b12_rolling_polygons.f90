!> Benchmark B12: regular polygons roll down a slope, corner after corner.
!>
!> Without slip and bounce, an impact conserves the angular momentum about the next corner: w+ = eta w-, eta = (I + m
!> R^2 cos(2 pi/n))/J, J = I + m R^2. From corner to corner the centre falls by s sin(a), s = 2 R sin(pi/n). So in the
!> steady state J w-^2/2 = J (eta w-)^2/2 + m g s sin(a), and w-^2 = 2 m g s sin(a)/(J (1 - eta^2)). The body rolls on
!> if it passes over its corner, J (eta w-)^2/2 > m g R (1 - cos(pi/n - a)); squares at 15 degrees do not. It must not
!> lift off: w-^2 R must be less than g cos(a + pi/n), which holds for 12 and 16 corners on a gentle slope only.
!>
!> This theory assumes that the impact acts on the next corner alone. So the corners land on a row of narrow supports,
!> which reach under a face by 1 % of it at either end. On a plane the force of a soft face passes from corner to corner
!> during the impact, at any stiffness, and much less energy is lost (shown for 8 corners). Normal and tangential
!> damping are so strong that impacts are plastic.
module b12_rolling_polygons
   use outlines, only: gravity, inertia_ratio, integrate_text, pi, regular_polygon
   use trial, only: area_law, begin, block_at, steps
   use verification_table, only: table_t
   use polydem_body_list, only: body_list_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: wp
   use polydem_simulation, only: simulation_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: run_rolling_polygons

   real(wp), parameter :: radius = 0.01_wp

contains

   !> Run polygons of 5 to 16 corners.
   subroutine run_rolling_polygons(table, thorough)
      !> Table to fill
      type(table_t), intent(inout) :: table
      !> Whether to run five polygons instead of one, wider supports, a plane, and a square
      logical, intent(in) :: thorough
      integer, parameter :: corners(*) = [5, 6, 8, 12, 16]
      real(wp), parameter :: slopes(*) = [15.0_wp, 15.0_wp, 15.0_wp, 6.0_wp, 6.0_wp]
      integer :: k

      call table%begin('B12', 'regular polygons of radius 1 cm roll down a slope')
      if (.not. thorough) then
         call compare(table, 8, 15.0_wp, 'on supports, E = 1e8', 0.01_wp, 1.0e8_wp, 40.0_wp, .true.)
         return
      end if
      do k = 1, size(corners)
         call compare(table, corners(k), slopes(k), 'on supports', 0.01_wp, 1.0e9_wp, 40.0_wp, .true.)
      end do
      call compare(table, 5, 15.0_wp, 'on supports three times as wide', 0.03_wp, 1.0e9_wp, 20.0_wp, .false.)
      call compare(table, 8, 15.0_wp, 'on a plane', 0.5_wp, 1.0e9_wp, 2.0_wp, .false.)
      call stop_square(table)
   end subroutine run_rolling_polygons

   !> Compare one polygon. `under` is the length of a support under a face, as a share of the face; one half is a plane.
   subroutine compare(table, n, degrees, floor, under, young, damping, must_hold)
      type(table_t), intent(inout) :: table
      integer, intent(in) :: n
      character(len=*), intent(in) :: floor
      real(wp), intent(in) :: degrees, under, young, damping
      logical, intent(in) :: must_hold
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      real(wp) :: slope, expected, before
      character(len=:), allocatable :: name

      slope = degrees*pi/180.0_wp
      expected = steady_rate(n, slope)
      ! The start is a tenth too slow. After 2 n impacts this error has decayed as eta^(4 n), to less than 0.002 of it.
      call put_on_slope(n, slope, 0.9_wp*survival(n)*expected, under, young, damping, simulation, error)
      if (.not. allocated(error)) call roll(simulation, n, 1, 2*n, before, error)
      if (.not. allocated(error)) call roll(simulation, n, 2*n + 1, 3*n, before, error)
      call table%note_error(error)
      if (allocated(error)) return
      name = to_text(n)//' corners, '//to_text(nint(degrees))//' degrees, '//floor//': rate before an impact [1/s]'
      if (must_hold) then
         call table%expect_relative(name, expected, before, 0.05_wp)
      else
         call table%show(name, before)
      end if
   end subroutine compare

   !> Roll from one face to another, for at most one second; mean of the greatest rates on each face
   subroutine roll(simulation, n, first, last, before, error)
      type(simulation_t), intent(inout) :: simulation
      integer, intent(in) :: n, first, last
      real(wp), intent(out) :: before
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: greatest
      integer :: face, k

      before = 0.0_wp
      do face = first, last
         greatest = 0.0_wp
         do k = 1, nint(1.0_wp/simulation%dt)
            call steps(simulation, 1, error)
            if (allocated(error)) return
            greatest = max(greatest, -simulation%bodies%angular_velocity(1))
            ! The greatest rate is the rate before an impact; impacts are an integer of faces from the start.
            if (-simulation%bodies%angle(1) > 2.0_wp*pi*(real(face, wp) + 0.5_wp)/real(n, wp)) exit
         end do
         before = before + greatest/real(last - first + 1, wp)
      end do
   end subroutine roll

   !> Start a square with the rate that the formula gives for a steady state; it stops.
   subroutine stop_square(table)
      type(table_t), intent(inout) :: table
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error

      call put_on_slope(4, pi/12.0_wp, survival(4)*steady_rate(4, pi/12.0_wp), 0.01_wp, 1.0e9_wp, 40.0_wp, &
                        simulation, error)
      if (.not. allocated(error)) call steps(simulation, nint(0.3_wp/simulation%dt), error)
      call table%note_error(error)
      if (allocated(error)) return
      call table%expect_absolute('4 corners come to rest: rate after 0.3 s [1/s]', 0.0_wp, &
                                 simulation%bodies%angular_velocity(1), 1.0e-3_wp)
      call table%expect_absolute('4 corners come to rest: turned by [rad]', 0.0_wp, simulation%bodies%angle(1), 0.01_wp)
   end subroutine stop_square

   !> A polygon with a face on the slope, which begins to turn clockwise about its lower corner, and supports where the
   !> next corners land.
   subroutine put_on_slope(n, slope, rate, under, young, damping, simulation, error)
      integer, intent(in) :: n
      real(wp), intent(in) :: slope, rate, under, young, damping
      type(simulation_t), intent(out) :: simulation
      type(error_t), allocatable, intent(inout) :: error
      type(body_list_t) :: list
      real(wp) :: half_face, height, face, place(2), downhill(2), up(2)
      real(wp), parameter :: thickness = 0.01_wp
      integer :: k

      half_face = pi/real(n, wp)
      height = radius*cos(half_face)
      face = 2.0_wp*radius*sin(half_face)
      downhill = [cos(slope), -sin(slope)]
      up = [sin(slope), cos(slope)]
      place = height*up
      call list%append(regular_polygon(n, radius, place(1), place(2), -0.5_wp*pi - slope + half_face), &
                       velocity=rate*(height*downhill + 0.5_wp*face*up), angular_velocity=-rate)
      do k = -1, 3*n + 4
         place = (real(k, wp) + 0.5_wp)*face*downhill - 0.5_wp*thickness*up
         call list%append(block_at(place(1), place(2), 2.0_wp*under*face, thickness, -slope), fixed=.true.)
      end do
      call begin('&forces friction_coefficient = 5 tangential_damping = 5 damping_coefficient = '// &
                 to_text(damping)//area_law//' stiffness = '//to_text(young)//' /'// &
                         integrate_text(1.0e-6_wp*sqrt(1.0e9_wp/young)), list, simulation, error)
   end subroutine put_on_slope

   !> Ratio of the rate after an impact to the rate before it
   pure real(wp) function survival(n)
      integer, intent(in) :: n

      survival = (inertia_ratio(n) + cos(2.0_wp*pi/real(n, wp)))/(inertia_ratio(n) + 1.0_wp)
   end function survival

   !> Rate before an impact in the steady state [1/s]
   pure real(wp) function steady_rate(n, slope)
      integer, intent(in) :: n
      real(wp), intent(in) :: slope

      steady_rate = sqrt(4.0_wp*gravity*sin(pi/real(n, wp))*sin(slope)/(radius*(1.0_wp + inertia_ratio(n)) &
                                                                         *(1.0_wp - survival(n)**2)))
   end function steady_rate

end module b12_rolling_polygons
