!> Benchmark B16: a semicircular arch of wedges under its own weight (Couplet's problem).
!>
!> The thinnest stable arch of this kind is 0.1075 of its mean radius thick (M. Milankovitch 1907; J. Heyman: 0.106).
!> With n wedges, hinges form at joints only, so the arch may be thinner (`arch_limits`). The thickness 0.12 must stand
!> and 0.095 must fall; both are compared with that critical thickness.
module b16_arch
   use arch_limits, only: critical_thickness, wedge
   use outlines, only: integrate_text
   use trial, only: area_law, begin, block_at, steps
   use verification_table, only: table_t
   use polydem_body_list, only: body_list_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, wp
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
      real(wp) :: sunk, thinnest

      call table%begin('B16', 'semicircular arches, t/R their thickness over the mean radius, mu = 2')
      call stand_or_fall(table, 14_ip, 0.12_wp, 0.095_wp, 1.0e10_wp)
      if (.not. thorough) return
      call stand_or_fall(table, 28_ip, 0.12_wp, 0.095_wp, 1.0e10_wp)
      thinnest = critical_thickness(28_ip, 2.0_wp)
      ! A hinge of a soft arch uses a share of its thickness, which falls only with E^(-1/3) (see b08_incline).
      call load(table, 28_ip, 1.03_wp*thinnest, 1.0_wp, 1.0e10_wp, sunk)
      call table%show('28 wedges, E = 1e10, 1.03 of the critical t/R: the crown sinks in 1 s by [m]', sunk)
      call stand_or_fall(table, 28_ip, 1.03_wp*thinnest, 0.97_wp*thinnest, 1.0e12_wp)
   end subroutine run_arch

   subroutine stand_or_fall(table, n, thick, thin, young)
      type(table_t), intent(inout) :: table
      integer(ip), intent(in) :: n
      real(wp), intent(in) :: thick, thin, young
      real(wp) :: sunk
      character(len=:), allocatable :: name

      name = to_text(n)//' wedges, E = '//to_text(young, 1)//', t/R = '
      call table%show(to_text(n)//' wedges: critical t/R by lines of thrust', critical_thickness(n, 2.0_wp))
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

end module b16_arch
