!> Benchmark B27: sources and sinks.
!>
!> A body that enters moves as one that starts then, in every bit, whatever the scheme. The mass that has entered is the
!> mass that is there and the mass that has left. A hopper whose grains are replaced flows steadily: its rate is that of
!> any part of the time, and it hardly depends on the height of the filling (Beverloo et al. 1961).
module b27_sources
   use trial, only: begin, steps
   use verification_table, only: table_t
   use polydem_body_list, only: body_list_t
   use polydem_energy_balance, only: balance_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, lp, wp
   use polydem_read_settings, only: read_settings_text
   use polydem_settings, only: settings_t
   use polydem_simulation, only: compute_balance, simulation_t
   use polydem_source, only: candidate_t, source_t
   use polydem_start, only: new_simulation
   use polydem_strings, only: to_text
   implicit none
   private
   public :: run_sources

   character(len=*), parameter :: rest = ' &output energy_balance = .true. /'

contains

   !> Flight, masses, and steady flow.
   subroutine run_sources(table, thorough)
      !> Table to fill
      type(table_t), intent(inout) :: table
      !> Whether to follow the flow for five times as long
      logical, intent(in) :: thorough

      call table%begin('B27', 'sources and sinks')
      call enter(table, 'velocity Verlet', 'dt = 1e-4')
      call enter(table, 'Gear', 'dt = 1e-4 scheme = ''gear''')
      call enter(table, 'compensated sums', 'dt = 1e-4 accumulation = ''compensated''')
      call flow(table, thorough)
   end subroutine run_sources

   !> A body that enters at step 350, and the same body at time 0 of a run of its own
   subroutine enter(table, name, scheme)
      type(table_t), intent(inout) :: table
      character(len=*), intent(in) :: name, scheme
      character(len=:), allocatable :: groups
      type(body_list_t) :: list, alone
      type(simulation_t) :: entering, starting
      type(source_t) :: source
      type(candidate_t), allocatable :: candidates(:)
      type(error_t), allocatable :: error
      integer(ip) :: one, other

      groups = ' &forces gravity = 1, -10 drag = 2 / &integrate duration = 100 '//scheme//' /'//rest
      call list%append(square(-50.0_wp), fixed=.true.)
      call list%append(square(50.0_wp), velocity=[1.0_wp, 2.0_wp])
      call begin('&source name = ''feed'' low = -1, -1 high = 1, 1 rate = 29 interval = 350 velocity = 3, -2 /'// &
                 groups, list, entering, error)
      call table%note_error(error)
      if (allocated(error)) return
      source = entering%sources_and_sinks%sources(1)
      call source%draw_candidates(1_lp, candidates)
      call alone%append(square(-50.0_wp), fixed=.true.)
      associate (first => candidates(1))
         call alone%append(first%corners + spread(first%place(:, 1), 2, size(first%corners, 2)), &
                           density=source%density, velocity=source%settings%velocity)
      end associate
      call begin(groups, alone, starting, error)
      if (.not. allocated(error)) call steps(entering, 350 + 300, error)
      if (.not. allocated(error)) call steps(starting, 300, error)
      call table%note_error(error)
      if (allocated(error)) return
      one = entering%bodies%n
      other = starting%bodies%n
      call table%expect_absolute('flight with '//name//': distance from that of a body that starts then [m]', 0.0_wp, &
         maxval(abs(entering%bodies%position(:, one) - starting%bodies%position(:, other))), 0.0_wp)
      call table%expect_absolute('flight with '//name//': difference of the velocities [m/s]', 0.0_wp, &
         maxval(abs(entering%bodies%velocity(:, one) - starting%bodies%velocity(:, other))), 0.0_wp)
      call table%expect_true('one body has entered', entering%sources_and_sinks%sources(1)%entered == 1_lp &
                             .and. one == 3_ip)
   end subroutine enter

   !> A square of 2 m
   pure function square(x) result(corners)
      real(wp), intent(in) :: x
      real(wp) :: corners(2, 4)

      corners = reshape([x - 1.0_wp, -1.0_wp, x + 1.0_wp, -1.0_wp, x + 1.0_wp, 1.0_wp, x - 1.0_wp, 1.0_wp], [2, 4])
   end function square

   !> A hopper whose grains come back, with one or two fillings
   subroutine flow(table, thorough)
      type(table_t), intent(inout) :: table
      logical, intent(in) :: thorough
      real(wp) :: rate(2)

      call measure(table, thorough, 300, rate(1))
      if (.not. thorough) return
      call measure(table, thorough, 450, rate(2))
      call table%expect_relative('rate with 450 grains over that with 300', 1.0_wp, rate(2)/rate(1), 0.1_wp)
   end subroutine flow

   !> Measure the rate of a hopper with some grains, in four parts of the time.
   subroutine measure(table, thorough, n_grains, rate)
      type(table_t), intent(inout) :: table
      logical, intent(in) :: thorough
      integer, intent(in) :: n_grains
      !> Grains per second
      real(wp), intent(out) :: rate
      character(len=1) :: no_overrides(0)
      type(settings_t) :: settings
      type(simulation_t) :: simulation
      type(balance_t) :: balance
      type(error_t), allocatable :: error
      character(len=:), allocatable :: name
      real(wp) :: there
      integer(lp) :: mark(0:4)
      integer :: k, part

      name = to_text(int(n_grains, ip))//' grains: '
      rate = 1.0_wp
      part = merge(50000, 7000, thorough)
      call read_settings_text('flow.nml', &
         '&wall name = ''l'' outline = ''polyline'' vertices = -0.1, 0.6, -0.1, 0.1, -0.0225, 0 thickness = 0.01 / '// &
         '&wall name = ''r'' outline = ''polyline'' vertices = 0.0225, 0, 0.1, 0.1, 0.1, 0.6 thickness = 0.01 / '// &
         '&source name = ''feed'' low = -0.09, 0.4 high = 0.09, 0.58 velocity = 0, -1 count = '// &
         to_text(int(n_grains, ip))//' / &sink name = ''bin'' low = -1, -0.2 high = 1, -0.02 interval = 100 / '// &
         '&forces stiffness = 2e5 friction_coefficient = 0.3 / &integrate duration = 1000 dt = 5e-5 /'//rest, &
         no_overrides, settings, error)
      if (.not. allocated(error)) call new_simulation(settings, simulation, error)
      if (.not. allocated(error)) call steps(simulation, 15000, error)
      if (.not. allocated(error)) mark(0) = simulation%sources_and_sinks%sinks(1)%departed
      do k = 1, 4
         if (.not. allocated(error)) call steps(simulation, part, error)
         if (.not. allocated(error)) mark(k) = simulation%sources_and_sinks%sinks(1)%departed
      end do
      call table%note_error(error)
      if (allocated(error)) return
      rate = real(mark(4) - mark(0), wp)/(4.0_wp*real(part, wp)*simulation%dt)
      call table%show(name//'grains per second', rate)
      call table%expect_relative(name//'rate in the second half over that in the first', 1.0_wp, &
                                 real(mark(4) - mark(2), wp)/real(mark(2) - mark(0), wp), 0.1_wp)
      associate (source => simulation%sources_and_sinks%sources(1), sink => simulation%sources_and_sinks%sinks(1), &
                 bodies => simulation%bodies)
         call table%expect_true(name//'number in = number out + number there', &
                                source%entered == sink%departed + size(bodies%free, kind=lp))
         there = sum(bodies%mass(bodies%free))
         call table%expect_relative(name//'mass out + mass there over mass in', 1.0_wp, &
                                    (sink%mass + there)/source%mass, 1.0e-13_wp)
         call table%expect_true(name//'no identifier is used twice', &
                                int(bodies%last_id, lp) == source%entered + count(bodies%fixed))
      end associate
      call compute_balance(simulation, balance)
      call table%expect_absolute(name//'unexplained momentum, relative', 0.0_wp, balance%relative_momentum_residual, &
                                 1.0e-11_wp)
   end subroutine measure

end module b27_sources
