!> Benchmark B34: semicircular arches of straight wedges, with the default law and a slow load.
!>
!> The expected limits are those of rigid wedges (`arch_limits`): the thickness of arches of odd and even numbers of
!> wedges, that of arches with little friction, and the tilt of gravity at which an arch falls. The theory itself is
!> compared with published limits: 0.1075 of the radius (M. Milankovitch 1907; N. Makris & H. Alexakis, Arch. Appl.
!> Mech. 83 (2013)), and friction of 0.309215, below which no arch stands (G. Cocchetti & E. Rizzi 2020).
module b34_arches
   use arch_limits, only: critical_thickness, critical_tilt, wedge, widest_gap
   use outlines, only: gravity
   use slow_load, only: load_slowly, slow_integration
   use trial, only: begin, block_at
   use verification_table, only: table_t
   use polydem_body_list, only: body_list_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, wp
   use polydem_simulation, only: simulation_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: run_arches

   !> Friction that prevents slip
   real(wp), parameter :: rough = 2.0_wp

contains

   !> Thickness, friction, tilt.
   subroutine run_arches(table, thorough)
      !> Table to fill
      type(table_t), intent(inout) :: table
      !> Whether to run all numbers of wedges, all frictions and all thicknesses
      logical, intent(in) :: thorough
      integer(ip), parameter :: wedges(*) = [7_ip, 10_ip, 14_ip, 15_ip, 20_ip, 28_ip]
      real(wp), parameter :: frictions(*) = [0.39_wp, 0.33_wp, 0.312_wp]
      real(wp), parameter :: thicknesses(*) = [0.12_wp, 0.15_wp, 0.25_wp]
      integer :: k

      call table%begin('B34', 'semicircular arches, t/R their thickness over the mean radius')
      call table%expect_relative('400 wedges: critical t/R by lines of thrust', 0.1075_wp, &
                                 critical_thickness(400_ip, rough), 5.0e-4_wp)
      call table%expect_relative('400 wedges, t/R = 0.2: friction below which none fits', 0.309215_wp, &
                                 least_friction(400_ip, 0.200637_wp), 5.0e-3_wp)
      call find_thickness(table, 9_ip, [1.0e7_wp, 1.0e8_wp])
      call slip(table, 28_ip, 0.36_wp)
      call tilt(table, 15_ip, 0.2_wp)
      if (.not. thorough) return
      do k = 1, size(wedges)
         call stand_or_fall(table, wedges(k), 1.01_wp, 0.99_wp, critical_thickness(wedges(k), rough), rough, 1.0e9_wp)
      end do
      do k = 1, size(frictions)
         call slip(table, 28_ip, frictions(k))
      end do
      call table%expect_true('28 wedges, t/R = 0.3, mu = 0.3: falls', &
                             falls(table, 28_ip, 0.3_wp, 1.0e8_wp, 0.3_wp, 0.0_wp))
      do k = 1, size(thicknesses)
         call tilt(table, 15_ip, thicknesses(k))
         call tilt(table, 28_ip, thicknesses(k))
      end do
   end subroutine run_arches

   !> Friction below which no line of thrust fits into an arch: bisection
   pure real(wp) function least_friction(n, thickness)
      integer(ip), intent(in) :: n
      real(wp), intent(in) :: thickness
      real(wp) :: low, high
      integer :: k

      low = 0.2_wp
      high = 0.5_wp
      do k = 1, 40
         least_friction = 0.5_wp*(low + high)
         if (widest_gap(n, thickness, least_friction) > 0.0_wp) then
            high = least_friction
         else
            low = least_friction
         end if
      end do
   end function least_friction

   !> Thickness at which an arch falls, with two stiffnesses. Hinges press corners into joints as deep as F/E: the error
   !> is of first order in 1/E.
   subroutine find_thickness(table, n, young)
      type(table_t), intent(inout) :: table
      integer(ip), intent(in) :: n
      real(wp), intent(in) :: young(2)
      real(wp) :: critical, low, high, share, excess(2)
      integer :: e, k
      character(len=:), allocatable :: name

      critical = critical_thickness(n, rough)
      name = to_text(n)//' wedges, t/R at which they fall over '//to_text(critical, 6)//': '
      do e = 1, 2
         low = 0.98_wp
         high = 1.0_wp + 0.15_wp*young(1)/young(e)
         do k = 1, 9
            share = 0.5_wp*(low + high)
            if (falls(table, n, share*critical, young(e), rough, 0.0_wp)) then
               low = share
            else
               high = share
            end if
         end do
         excess(e) = share - 1.0_wp
      end do
      call table%show(name//'E = '//to_text(young(1), 1), 1.0_wp + excess(1))
      call table%expect_absolute(name//'E = '//to_text(young(2), 1), 1.0_wp, 1.0_wp + excess(2), 0.01_wp)
      call table%expect_least(name//'order of the error in E', 0.9_wp, &
                              log(excess(1)/excess(2))/log(young(2)/young(1)))
   end subroutine find_thickness

   !> An arch with little friction, in which wedges slide.
   subroutine slip(table, n, friction)
      type(table_t), intent(inout) :: table
      integer(ip), intent(in) :: n
      real(wp), intent(in) :: friction

      call stand_or_fall(table, n, 1.05_wp, 0.95_wp, critical_thickness(n, friction), friction, 1.0e8_wp)
   end subroutine slip

   subroutine stand_or_fall(table, n, high, low, critical, friction, young)
      type(table_t), intent(inout) :: table
      integer(ip), intent(in) :: n
      real(wp), intent(in) :: high, low, critical, friction, young
      character(len=:), allocatable :: name

      name = to_text(n)//' wedges, mu = '//to_text(friction, 3)//', critical t/R '//to_text(critical, 6)//': '
      call table%expect_true(name//'stands at '//to_text(high, 3), &
                             .not. falls(table, n, high*critical, young, friction, 0.0_wp))
      call table%expect_true(name//'falls at '//to_text(low, 3), falls(table, n, low*critical, young, friction, 0.0_wp))
   end subroutine stand_or_fall

   !> An arch in gravity that is tilted.
   subroutine tilt(table, n, thickness)
      type(table_t), intent(inout) :: table
      integer(ip), intent(in) :: n
      real(wp), intent(in) :: thickness
      real(wp) :: critical, young
      character(len=:), allocatable :: name

      critical = critical_tilt(n, thickness)
      ! With 28 wedges and 1e9 arches fall at 0.98: it falls by 1.5 to 8 times the share that hinges take of t.
      young = merge(1.0e9_wp, 1.0e10_wp, n < 20_ip)
      name = to_text(n)//' wedges, t/R = '//to_text(thickness, 3)//', critical tilt '//to_text(critical, 6)//': '
      call table%expect_true(name//'stands at 0.98', &
                             .not. falls(table, n, thickness, young, 0.7_wp, 0.98_wp*critical))
      call table%expect_true(name//'falls at 1.02', falls(table, n, thickness, young, 0.7_wp, 1.02_wp*critical))
   end subroutine tilt

   !> Whether an arch falls when gravity has risen
   logical function falls(table, n, thickness, young, friction, tilt)
      type(table_t), intent(inout) :: table
      integer(ip), intent(in) :: n
      real(wp), intent(in) :: thickness, young, friction, tilt
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      type(body_list_t) :: list
      real(wp) :: moved
      integer(ip) :: k

      do k = 1_ip, n
         call list%append(wedge(n, k, thickness))
      end do
      call list%append(block_at(1.0_wp, -0.1_wp, 0.5_wp, 0.2_wp, 0.0_wp), fixed=.true.)
      call list%append(block_at(-1.0_wp, -0.1_wp, 0.5_wp, 0.2_wp, 0.0_wp), fixed=.true.)
      call begin('&forces friction_coefficient = '//to_text(friction, 6)//' stiffness = '//to_text(young)//' /'// &
                 slow_integration, list, simulation, error)
      call load_slowly(simulation, gravity/sqrt(1.0_wp + tilt**2)*[tilt, -1.0_wp], 1.0_wp, 3.0_wp, (n + 1_ip)/2_ip, &
                       0.1_wp, moved, error)
      call table%note_error(error)
      falls = moved > 0.1_wp
   end function falls

end module b34_arches
