!> Benchmark B16: a semicircular arch of wedges under its own weight (Couplet's problem).
!>
!> The thinnest stable arch of this kind is 0.1075 of its mean radius thick (M. Milankovitch 1907; J. Heyman: 0.106).
!> With n wedges, hinges form at joints only, so the arch may be thinner. By the safe theorem an arch with enough
!> friction stands if a line of thrust fits into it. For the part from the crown to the joint at angle a, with weight V
!> at x, horizontal thrust H and its moment M at the crown, the thrust crosses the joint at the radius r = (M + V x)/(H
!> cos a + V sin a). The conditions r_in <= r <= r_out for all joints are linear inequalities in H and M. This module
!> finds the thickness at which they have exactly one solution. The thickness 0.12 must stand and 0.095 must fall; both
!> are compared with that critical thickness.
module b16_arch
   use outlines, only: gravity, integrate_text, pi
   use trial, only: area_law, begin, block_at, steps
   use verification_table, only: table_t
   use polydem_body_list, only: body_list_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, wp
   use polydem_polygon, only: mass_properties
   use polydem_simulation, only: simulation_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: run_arch

contains

   !> Run arches of mean radius 1 m.
   subroutine run_arch(table, thorough)
      !> Table to fill
      type(table_t), intent(inout) :: table
      !> Whether to run 28 wedges as well as 14, and thicknesses nearer to the critical one
      logical, intent(in) :: thorough
      real(wp) :: sunk

      call table%begin('B16', 'semicircular arches, t/R their thickness over the mean radius, mu = 2')
      call stand_or_fall(table, 14_ip, 0.12_wp, 0.095_wp, 1.0e10_wp)
      if (.not. thorough) return
      call stand_or_fall(table, 28_ip, 0.12_wp, 0.095_wp, 1.0e10_wp)
      ! A hinge of a soft arch uses a share of its thickness, which falls only with E^(-1/3) (see b08_incline).
      call load(table, 28_ip, 1.03_wp*critical_thickness(28_ip), 1.0_wp, 1.0e10_wp, sunk)
      call table%show('28 wedges, E = 1e10, 1.03 of the critical t/R: the crown sinks in 1 s by [m]', sunk)
      call stand_or_fall(table, 28_ip, 1.03_wp*critical_thickness(28_ip), 0.97_wp*critical_thickness(28_ip), 1.0e12_wp)
   end subroutine run_arch

   subroutine stand_or_fall(table, n, thick, thin, young)
      type(table_t), intent(inout) :: table
      integer(ip), intent(in) :: n
      real(wp), intent(in) :: thick, thin, young
      real(wp) :: sunk
      character(len=:), allocatable :: name

      name = to_text(n)//' wedges, E = '//to_text(young, 1)//', t/R = '
      call table%show(to_text(n)//' wedges: critical t/R by lines of thrust', critical_thickness(n))
      call load(table, n, thick, 1.0_wp, young, sunk)
      call table%expect_absolute(name//to_text(thick, 4)//' stands: the crown sinks in 1 s by [m]', 0.0_wp, sunk, &
                                 1.0e-3_wp)
      call load(table, n, thin, 4.0_wp, young, sunk)
      call table%expect_true(name//to_text(thin, 4)//' falls: the crown sinks by more than 0.2 m within 4 s', &
                             sunk > 0.2_wp)
   end subroutine stand_or_fall

   !> Load an arch with its weight for a time, or until its highest wedge has sunk by 0.2 m.
   subroutine load(table, n, thickness, time, young, sunk)
      type(table_t), intent(inout) :: table
      integer(ip), intent(in) :: n
      real(wp), intent(in) :: thickness, time, young
      real(wp), intent(out) :: sunk
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      type(body_list_t) :: list
      real(wp) :: start
      integer(ip) :: k

      do k = 1_ip, n
         call list%append(wedge(n, k, thickness))
      end do
      call list%append(block_at(1.0_wp, -0.1_wp, 0.5_wp, 0.2_wp, 0.0_wp), fixed=.true.)
      call list%append(block_at(-1.0_wp, -0.1_wp, 0.5_wp, 0.2_wp, 0.0_wp), fixed=.true.)
      call begin('&forces friction_coefficient = 2 damping_coefficient = 1'//area_law//' stiffness = '// &
                 to_text(young)//' /'// &
                 integrate_text(1.0e-5_wp*sqrt(1.0e10_wp/young)), list, simulation, error)
      sunk = 0.0_wp
      if (.not. allocated(error)) start = simulation%bodies%position(2, n/2_ip)
      do k = 1_ip, 100_ip
         if (.not. allocated(error)) call steps(simulation, nint(0.01_wp*time/simulation%dt), error)
         if (allocated(error)) exit
         sunk = start - simulation%bodies%position(2, n/2_ip)
         if (sunk > 0.2_wp) exit
      end do
      call table%note_error(error)
   end subroutine load

   !> Corners of wedge k of n, counted from the right springing, (2, 4) [m]
   pure function wedge(n, k, thickness) result(corners)
      integer(ip), intent(in) :: n, k
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

   !> Thickness over radius below which no line of thrust fits into an arch of an even number of wedges: bisection.
   pure real(wp) function critical_thickness(n)
      integer(ip), intent(in) :: n
      real(wp) :: low, high
      integer :: k

      low = 0.02_wp
      high = 0.3_wp
      do k = 1, 50
         critical_thickness = 0.5_wp*(low + high)
         if (widest_gap(n, critical_thickness) > 0.0_wp) then
            high = critical_thickness
         else
            low = critical_thickness
         end if
      end do
   end function critical_thickness

   !> Greatest range of M over all H, negative if there is none. It is a concave function of H; golden-section search.
   pure real(wp) function widest_gap(n, thickness)
      integer(ip), intent(in) :: n
      real(wp), intent(in) :: thickness
      real(wp), parameter :: golden = 0.618033988749895_wp
      real(wp) :: low, high, left, right
      integer :: k

      low = 0.0_wp
      high = 2500.0_wp*thickness*gravity*pi
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

   !> Range of the moment M between the inequalities of all joints of the right half [N]
   pure real(wp) function gap(n, thickness, thrust)
      integer(ip), intent(in) :: n
      real(wp), intent(in) :: thickness, thrust
      real(wp) :: inner, outer, weight, moment, area, centroid(2), ignored, joint(2), least, greatest
      integer(ip) :: k

      inner = 1.0_wp - 0.5_wp*thickness
      outer = 1.0_wp + 0.5_wp*thickness
      weight = 0.0_wp
      moment = 0.0_wp
      least = inner*thrust
      greatest = outer*thrust
      do k = n/2_ip, 1_ip, -1_ip
         call mass_properties(wedge(n, k, thickness), area, centroid, ignored)
         weight = weight + 2500.0_wp*area*gravity
         moment = moment + 2500.0_wp*area*gravity*centroid(1)
         joint = direction(real(k - 1_ip, wp)/real(n, wp))
         least = max(least, inner*(thrust*joint(2) + weight*joint(1)) - moment)
         greatest = min(greatest, outer*(thrust*joint(2) + weight*joint(1)) - moment)
      end do
      gap = greatest - least
   end function gap

end module b16_arch
