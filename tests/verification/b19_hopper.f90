!> Benchmark B19: flow out of a hopper.
!>
!> In two dimensions the rate is Q = C rho sqrt(g) (D - k d)^(3/2) (W.A. Beverloo, H.A. Leniger & J. van de Velde,
!> Chem. Eng. Sci. 15 (1961) 260, with one dimension less), independent of the filling height. The exponent is the slope
!> of log Q over log(D - k d) with the mean axis d of the grains. It depends on k. Here k = 1, because centres of
!> grains pass through D - d (C. Mankoc et al., Granular Matter 9 (2007) 407). Also shown are the exponent for
!> Beverloo's k = 1.4, which was measured with spheres, and the k for which Q^(2/3) is linear in D. Q is measured while
!> the discharged share of the grains grows from 20 % to 60 %, and in both halves of this interval.
module b19_hopper
   use trial, only: area_law, steps
   use verification_table, only: table_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, wp
   use polydem_read_settings, only: read_settings_text
   use polydem_settings, only: settings_t
   use polydem_simulation, only: simulation_t, time_of
   use polydem_start, only: new_simulation
   use polydem_strings, only: to_text
   implicit none
   private
   public :: run_hopper

   !> Mean of short and mean long axis of the grains [m]
   real(wp), parameter :: mean_axis = 0.00875_wp
   integer(ip), parameter :: n_grains = 1500_ip

contains

   !> Run openings of 6 to 12 mean axes; wider ones would empty the silo before the flow is steady.
   subroutine run_hopper(table)
      !> Table to fill
      type(table_t), intent(inout) :: table
      real(wp), parameter :: openings(*) = [6.0_wp, 8.0_wp, 10.0_wp, 12.0_wp]
      real(wp) :: rate(size(openings)), early(size(openings)), late(size(openings)), change
      integer :: k

      call table%begin('B19', 'flow of 1500 grains out of a hopper')
      do k = 1, size(openings)
         call flow(table, openings(k)*mean_axis, early(k), late(k))
         rate(k) = 2.0_wp/(1.0_wp/early(k) + 1.0_wp/late(k))
         call table%show('D = '//to_text(openings(k), 2)//' d: grains per second', rate(k))
      end do
      call table%expect_absolute('exponent for k = 1', 1.5_wp, power_of(openings - 1.0_wp, rate), 0.1_wp)
      call table%show('exponent for k = 1.4', power_of(openings - 1.4_wp, rate))
      call table%show('k for which the exponent is 1.5', offset_of(openings, rate**(2.0_wp/3.0_wp)))
      change = sum(late/early)/real(size(openings), wp)
      call table%expect_absolute('later over earlier rate, mean over openings', 1.0_wp, change, 0.05_wp)
   end subroutine run_hopper

   !> Grains per second while the discharged share grows from 20 % to 40 % and from 40 % to 60 %
   subroutine flow(table, opening, early, late)
      type(table_t), intent(inout) :: table
      real(wp), intent(in) :: opening
      real(wp), intent(out) :: early, late
      character(len=1) :: no_overrides(0)
      type(settings_t) :: settings
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      real(wp) :: times(3)
      integer :: mark, out

      call read_settings_text('hopper.nml', '&scene name = ''hopper'' slope = 60 bodies = '//to_text(n_grains)// &
                              ' width = 0.45 opening = '//to_text(opening, 17)// &
                              ' / &forces friction_coefficient = 0.3 damping_coefficient = 0.3 stiffness = 1e6'// &
                              area_law//' /'// &
                              ' &integrate duration = 100 / &output energy_balance = .false. /', &
                              no_overrides, settings, error)
      if (.not. allocated(error)) call new_simulation(settings, simulation, error)
      times = 0.0_wp
      mark = 1
      do while (mark <= 3)
         if (.not. allocated(error)) call steps(simulation, 20, error)
         if (allocated(error)) exit
         if (time_of(simulation) > 20.0_wp) exit
         out = count(simulation%bodies%position(2, simulation%bodies%free) < 0.0_wp)
         if (real(out, wp) < 0.2_wp*real(mark, wp)*real(n_grains, wp)) cycle
         times(mark) = time_of(simulation)
         mark = mark + 1
      end do
      call table%note_error(error)
      early = 0.2_wp*real(n_grains, wp)/(times(2) - times(1))
      late = 0.2_wp*real(n_grains, wp)/(times(3) - times(2))
   end subroutine flow

   !> Slope of log(rate) over log(opening) by least squares
   pure real(wp) function power_of(opening, rate)
      real(wp), intent(in) :: opening(:), rate(:)
      real(wp) :: x(size(opening)), y(size(opening))

      x = log(opening)
      y = log(rate)
      x = x - sum(x)/real(size(x), wp)
      power_of = sum(x*y)/sum(x*x)
   end function power_of

   !> Zero of the least-squares line through values
   pure real(wp) function offset_of(opening, values)
      real(wp), intent(in) :: opening(:), values(:)
      real(wp) :: x(size(opening)), mean

      mean = sum(opening)/real(size(opening), wp)
      x = opening - mean
      offset_of = mean - sum(values)/real(size(values), wp)*sum(x*x)/sum(x*values)
   end function offset_of

end module b19_hopper
