!> Benchmark B33: a periodic cell whose size is stress-controlled.
!>
!> A column of blocks in a stress-controlled cell is an oscillator of known frequency. At rest the contacts bear the
!> stress that is asked for, and in a steady shear flow their mean stress is that. The energy that is missing, with the
!> work of the cell, is of first order in dt, since places are stretched before the motion of a step. The place of the
!> border has no meaning.
module b33_controlled_cell
   use trial, only: begin_scene, find_missing_energy, steps
   use verification_table, only: table_t
   use polydem_bodies, only: bodies_t
   use polydem_cell, only: shear_flow
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, wp
   use polydem_quantities, only: stress
   use polydem_sample_area, only: find_area, sample_area_t
   use polydem_simulation, only: simulation_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: run_controlled_cell

contains

   !> Oscillator, rest, energy, border, flow.
   subroutine run_controlled_cell(table, thorough)
      !> Table to fill
      type(table_t), intent(inout) :: table
      !> Whether to take 100 grains instead of 36 or, for the energy, 64, and a long mean of the flow, which then has a
      !> tolerance of 1 instead of 3 %
      logical, intent(in) :: thorough
      integer :: number

      number = merge(100, 36, thorough)
      call table%begin('B33', 'stress-controlled cell')
      call oscillate(table)
      call rest(table, number)
      call close_energy(table, merge(100, 64, thorough))
      call move_border(table, 'another border', 'stress_controlled = ''xy'' stress = 1e4, 1.2e4 damping_ratio = 0.2')
      call move_border(table, 'another border of a sheared cell', &
                       'shear_rate = 2 shear_ramp = 0.03 stress_controlled = ''y'' stress = 0, 1.2e4 '// &
                       'damping_ratio = 0.2')
      call flow(table, number, merge(12.0_wp, 2.0_wp, thorough), merge(0.01_wp, 0.03_wp, thorough))
   end subroutine run_controlled_cell

   !> Three blocks on top of each other, pressed together and released. They do not part in this time.
   subroutine oscillate(table)
      type(table_t), intent(inout) :: table
      real(wp), parameter :: depth = 1.0e-5_wp, duration = 0.03_wp, mass = 20.0_wp
      character(len=*), parameter :: blocks = &
         '&cell periodic = ''xy'' low = -0.15, 0 size = 0.3, 0.29997 stress_controlled = ''y'' mass = 20 '// &
         'damping_ratio = 0 / '// &
         '&grains name = ''b'' region = ''at'' at = 0, 0.049995 shape = ''rectangle'' width = 0.1 height = 0.1 '// &
         'density = 1000 / '// &
         '&grains name = ''c'' region = ''at'' at = 0, 0.149985 shape = ''rectangle'' width = 0.1 height = 0.1 '// &
         'density = 1000 / '// &
         '&grains name = ''d'' region = ''at'' at = 0, 0.249975 shape = ''rectangle'' width = 0.1 height = 0.1 '// &
         'density = 1000 / '// &
         '&forces gravity = 0, 0 stiffness = 1e5 damping = ''none'' friction = ''none'' / '
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      real(wp) :: growth(3), stiffness, exact, start
      integer :: k, n

      stiffness = 0.0_wp
      do k = 1, 3
         n = 100*4**(k - 1)
         call begin_scene(blocks//'&integrate duration = 0.03 dt = '//to_text(duration/real(n, wp), 17)//' /', &
                          simulation, error)
         if (allocated(error)) exit
         start = simulation%bodies%cell%size(2)
         if (k == 1) stiffness = mass*simulation%bodies%cell%load%axis(2)%change/depth
         call steps(simulation, n, error)
         if (allocated(error)) exit
         growth(k) = simulation%bodies%cell%size(2) - start
      end do
      call table%note_error(error)
      if (allocated(error)) return
      exact = 3.0_wp*depth*(1.0_wp - cos(duration*sqrt(stiffness/(3.0_wp*mass))))
      call table%expect_relative('oscillator: growth of the cell after 30 ms [m]', exact, growth(3), 1.0e-3_wp)
      call table%expect_relative('oscillator: fall of the error when dt is a quarter', 16.0_wp, &
                                 (growth(1) - growth(2))/(growth(2) - growth(3)), 0.05_wp)
   end subroutine oscillate

   !> Groups of some grains in a cell
   function sample(number, cell, entries, shift) result(text)
      integer, intent(in) :: number
      !> Further entries of &cell, and those of &integrate
      character(len=*), intent(in) :: cell, entries
      !> Distance from the middle of the cell to that of the grains [m]; default: 0
      real(wp), intent(in), optional :: shift
      character(len=:), allocatable :: text
      real(wp) :: half, low

      half = 0.07_wp*sqrt(0.01_wp*real(number, wp))
      low = -half
      if (present(shift)) low = low + shift
      text = '&cell periodic = ''xy'' low = '//twice(low)//' size = '//twice(2.0_wp*half)//' '//cell// &
         ' / &grains name = ''sample'' region = ''box'' low = '//twice(-half)//' high = '//twice(half)// &
         ' arrangement = ''spread'' number = '//to_text(number)//' shape = ''regular'' corners = 5, 7 '// &
         'diameter = 0.01, 0.013 speed = 0.1 / &forces gravity = 0, 0 stiffness = 1e6 friction_coefficient = 0.3 / '// &
         '&integrate '//entries//' /'

   contains

      !> Two equal numbers of a namelist
      function twice(value)
         real(wp), intent(in) :: value
         character(len=:), allocatable :: twice

         twice = to_text(value, 8)//', '//to_text(value, 8)
      end function twice

   end function sample

   !> Grains that come to rest under two stresses.
   subroutine rest(table, number)
      type(table_t), intent(inout) :: table
      integer, intent(in) :: number
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      real(wp) :: tensor(2, 2)

      call begin_scene(sample(number, 'stress_controlled = ''xy'' stress = 1e4, 1.2e4', 'duration = 1.2'), simulation, &
                       error)
      if (.not. allocated(error)) call steps(simulation, int(simulation%n_steps), error)
      call table%note_error(error)
      if (allocated(error)) return
      tensor = stress_in(simulation)
      call table%expect_relative('at rest: stress along x [N/m2]', 1.0e4_wp, tensor(1, 1), 1.0e-3_wp)
      call table%expect_relative('at rest: stress along y [N/m2]', 1.2e4_wp, tensor(2, 2), 1.0e-3_wp)
   end subroutine rest

   !> Stress of the contacts in the cell [N/m2]
   function stress_in(simulation) result(tensor)
      type(simulation_t), intent(inout) :: simulation
      real(wp) :: tensor(2, 2)
      type(sample_area_t) :: area

      call find_area(simulation, area)
      call stress(simulation%bodies, simulation%contacts, simulation%comm, area, tensor)
   end function stress_in

   !> The energy that is missing after a fast compression, with the time step and with a half of it.
   subroutine close_energy(table, number)
      type(table_t), intent(inout) :: table
      integer, intent(in) :: number
      character(len=*), parameter :: &
         cell = 'stress_controlled = ''xy'' stress = 1e4, 1.2e4 damping_ratio = 0.2 mass = ', &
         shear = 'stress_controlled = ''y'' stress = 0, 1.2e4 damping_ratio = 0.2 shear_rate = 2 shear_ramp = 0.1'
      type(error_t), allocatable :: error
      real(wp) :: missing(2), work
      character(len=:), allocatable :: mass

      mass = to_text(0.21_wp*real(number, wp), 8)
      call find_missing_energy(sample(number, cell//mass, 'duration = 0.2 dt = 5e-6'), &
                               sample(number, cell//mass, 'duration = 0.2 dt = 2.5e-6'), missing, work, error)
      call table%note_error(error)
      if (allocated(error)) return
      call table%expect_absolute('energy that is missing, over the work of the cell', 0.0_wp, missing(2)/abs(work), &
                                 1.0e-5_wp)
      call table%expect_least('its fall when dt is halved', 1.8_wp, missing(1)/missing(2))
      call find_missing_energy(sample(number, shear, 'duration = 0.2 dt = 5e-6'), &
                               sample(number, shear, 'duration = 0.2 dt = 2.5e-6'), missing, work, error)
      call table%note_error(error)
      if (allocated(error)) return
      call table%expect_absolute('energy that is missing in a sheared cell, over its work', 0.0_wp, &
                                 missing(2)/abs(work), 2.0e-5_wp)
      call table%expect_least('its fall when dt is halved, sheared', 1.8_wp, missing(1)/missing(2))
   end subroutine close_energy

   !> The same grains in a cell whose border is elsewhere. Velocities are compared relative to the shear, which are
   !> those of all copies.
   subroutine move_border(table, name, cell)
      type(table_t), intent(inout) :: table
      !> Name of the case, and entries of &cell
      character(len=*), intent(in) :: name, cell
      character(len=*), parameter :: entries = 'duration = 1 dt = 1e-5'
      type(simulation_t) :: simulation, moved
      type(error_t), allocatable :: error

      call begin_scene(sample(100, cell, entries), simulation, error)
      if (.not. allocated(error)) call begin_scene(sample(100, cell, entries, 0.043_wp), moved, error)
      if (.not. allocated(error)) call steps(simulation, 6000, error)
      if (.not. allocated(error)) call steps(moved, 6000, error)
      call table%note_error(error)
      if (allocated(error)) return
      call table%expect_true(name//': there are as many contacts', &
                             simulation%contacts%n > 20_ip .and. simulation%contacts%n == moved%contacts%n)
      call table%expect_absolute(name//': size of the cell', 0.0_wp, &
         maxval(abs(moved%bodies%cell%size/simulation%bodies%cell%size - 1.0_wp)), 1.0e-12_wp)
      call table%expect_absolute(name//': velocities [m/s]', 0.0_wp, &
         maxval(abs(beyond_shear(moved%bodies) - beyond_shear(simulation%bodies))), 1.0e-10_wp)
   end subroutine move_border

   !> Velocities of all bodies beyond that of the shear at their height, (2, body) [m/s]
   pure function beyond_shear(bodies) result(velocity)
      type(bodies_t), intent(in) :: bodies
      real(wp), allocatable :: velocity(:, :)
      real(wp) :: flow(3)
      integer(ip) :: s

      velocity = bodies%velocity
      do s = 1_ip, bodies%n
         flow = shear_flow(bodies%cell, bodies%position(2, s))
         velocity(:, s) = velocity(:, s) - flow(1:2)
      end do
   end function beyond_shear

   !> Shear under a constant stress.
   subroutine flow(table, number, duration, tolerance)
      type(table_t), intent(inout) :: table
      integer, intent(in) :: number
      !> Time over which the mean is taken [s]
      real(wp), intent(in) :: duration
      real(wp), intent(in) :: tolerance
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      real(wp) :: tensor(2, 2), mean(2, 2)
      integer :: k, n

      call begin_scene(sample(number, 'stress_controlled = ''y'' stress = 0, 1e4 shear_rate = 2 shear_ramp = 0.1', &
                              'duration = '//to_text(1.0_wp + duration, 6)), simulation, error)
      mean = 0.0_wp
      n = 0
      do k = 1, merge(0, int(simulation%n_steps), allocated(error))
         call steps(simulation, 1, error)
         if (allocated(error)) exit
         if (real(k, wp)*simulation%dt < 1.0_wp .or. modulo(k, 10) > 0) cycle
         tensor = stress_in(simulation)
         mean = mean + tensor
         n = n + 1
      end do
      call table%note_error(error)
      if (allocated(error)) return
      mean = mean/real(n, wp)
      call table%expect_relative('shear flow: mean stress along y [N/m2]', 1.0e4_wp, mean(2, 2), tolerance)
      call table%show('shear flow: mean stress ratio', -mean(2, 1)/mean(2, 2))
   end subroutine flow

end module b33_controlled_cell
