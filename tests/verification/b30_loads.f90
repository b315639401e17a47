!> Benchmark B30: load-controlled walls.
!>
!> A plate and a block that touches it are an oscillator of known frequency. At rest the contacts bear the stress that
!> is asked for. In a biaxial test between walls without friction, the stress of the contacts in the sample is that of
!> the walls, and the energy that is missing is of second order in dt.
module b30_loads
   use trial, only: begin_scene, find_missing_energy, steps
   use verification_table, only: table_t
   use polydem_contacts, only: contact_force
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, wp
   use polydem_quantities, only: stress
   use polydem_sample_area, only: sample_area_t
   use polydem_simulation, only: simulation_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: run_loads

   !> Stress of the side wall, along x [N/m]
   real(wp), parameter :: side_stress = 2.0e3_wp
   !> Velocity of the top wall in the biaxial test [m/s]
   real(wp), parameter :: speed = 0.03_wp

contains

   !> Oscillator, rest, biaxial test.
   subroutine run_loads(table, thorough)
      !> Table to fill
      type(table_t), intent(inout) :: table
      !> Whether to shear 400 grains instead of 64, for longer, with a tolerance of 1 instead of 3 %
      logical, intent(in) :: thorough

      call table%begin('B30', 'load-controlled walls')
      call oscillate(table)
      call rest(table)
      call shear(table, merge(400, 64, thorough), merge('2.5', '1.7', thorough), merge(0.01_wp, 0.03_wp, thorough))
      call close_energy(table, merge(100, 36, thorough))
   end subroutine run_loads

   !> A block of 10 kg/m and a plate of 20 kg/m, pressed together and released.
   subroutine oscillate(table)
      type(table_t), intent(inout) :: table
      real(wp), parameter :: depth = 1.0e-4_wp, duration = 0.01_wp
      character(len=*), parameter :: pair = &
         '&grains name = ''block'' region = ''at'' at = 0, 0.05 shape = ''rectangle'' width = 0.1 height = 0.1 '// &
         'density = 1000 / &wall name = ''plate'' outline = ''rectangle'' low = -0.05, -0.1 high = 0.05, 1e-4 / '// &
         '&load name = ''l'' wall = ''plate'' direction = ''y'' force = 0 mass = 20 damping_ratio = 0 / '// &
         '&forces gravity = 0, 0 stiffness = 1e5 damping = ''none'' friction = ''none'' / '
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      real(wp) :: place(3), stiffness, exact
      integer :: k, n

      stiffness = 0.0_wp
      do k = 1, 3
         n = 50*4**(k - 1)
         call begin_scene(pair//'&integrate duration = 0.01 dt = '//to_text(duration/real(n, wp), 17)//' /', &
                          simulation, error)
         if (allocated(error)) exit
         if (k == 1) stiffness = abs(simulation%walls%loads(1)%contact)/depth
         call steps(simulation, n, error)
         if (allocated(error)) exit
         place(k) = simulation%walls%loads(1)%place
      end do
      call table%note_error(error)
      if (allocated(error)) return
      exact = -depth/3.0_wp*(1.0_wp - cos(duration*sqrt(stiffness*(1.0_wp/10.0_wp + 1.0_wp/20.0_wp))))
      call table%expect_relative('oscillator: displacement of the plate after 10 ms [m]', exact, place(3), 1.0e-3_wp)
      call table%expect_relative('oscillator: fall of the error when dt is a quarter', 16.0_wp, &
                                 (place(1) - place(2))/(place(2) - place(3)), 0.05_wp)
   end subroutine oscillate

   !> Three blocks between two load-controlled walls and two that rest.
   subroutine rest(table)
      type(table_t), intent(inout) :: table
      character(len=*), parameter :: box = &
         '&wall name = ''left'' outline = ''rectangle'' low = -0.1, -0.1 high = 0, 0.3 / '// &
         '&wall name = ''right'' outline = ''rectangle'' low = 0.1, -0.1 high = 0.2, 0.3 / '// &
         '&wall name = ''bottom'' outline = ''rectangle'' low = -0.1, -0.1 high = 0.2, 0 / '// &
         '&wall name = ''top'' outline = ''rectangle'' low = -0.1, 0.301 high = 0.2, 0.4 / '// &
         '&grains name = ''a'' region = ''at'' at = 0.05, 0 arrangement = ''column'' number = 3 '// &
         'shape = ''rectangle'' width = 0.098 height = 0.1 / '// &
         '&load name = ''press'' wall = ''top'' direction = ''y'' stress = -2e3 between = ''left'', ''right'' / '// &
         '&load name = ''side'' wall = ''right'' direction = ''x'' stress = -1e3 width = 0.3 / '// &
         '&forces gravity = 0, 0 stiffness = 1e7 friction = ''none'' / &integrate duration = 1 /'
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      real(wp) :: tensor(2, 2), width, height

      call begin_scene(box, simulation, error)
      if (.not. allocated(error)) call steps(simulation, int(simulation%n_steps), error)
      call table%note_error(error)
      if (allocated(error)) return
      width = 0.1_wp + simulation%walls%loads(2)%place
      height = 0.301_wp + simulation%walls%loads(1)%place
      call stress(simulation%bodies, simulation%contacts, simulation%comm, everywhere(width, height), tensor)
      call table%expect_relative('at rest: stress of the contacts, ''between'' two walls [N/m]', 2.0e3_wp, &
                                 tensor(2, 2), 1.0e-3_wp)
      call table%expect_relative('at rest: stress of the contacts, on a given width [N/m]', 1.0e3_wp*0.3_wp/height, &
                                 tensor(1, 1), 1.0e-3_wp)
   end subroutine rest

   !> Area of a sample that has all bodies in it
   pure type(sample_area_t) function everywhere(width, height)
      !> Width and height of the sample [m]
      real(wp), intent(in) :: width, height

      everywhere = sample_area_t(low=[-1.0_wp, -1.0_wp], high=[1.0_wp, 1.0_wp], size=[width, height])
   end function everywhere

   !> Groups of a biaxial test: walls of another material have no friction. The sample is pressed for 1 s. The side wall
   !> is light, so that it follows the sample, and hardly damped, since its damping bears a part of the stress.
   function biaxial(number, entries) result(text)
      integer, intent(in) :: number
      !> Entries of &integrate
      character(len=*), intent(in) :: entries
      character(len=:), allocatable :: text
      real(wp) :: half, outside

      half = side_of(number)
      outside = half + 0.04_wp
      text = &
         '&material name = ''smooth'' friction_coefficient = 0 / &scene wall_material = ''smooth'' / '// &
         rectangle('left', -outside, -half, -half, half)//rectangle('right', half, -half, outside, half)// &
         rectangle('bottom', -outside, -outside, outside, -half)//rectangle('top', -outside, half, outside, outside)// &
         '&grains name = ''sample'' region = ''box'' low = '//numbers([-half, -half])//' high = '// &
         numbers([half, half])//' number = '//to_text(number)//' shape = ''regular'' corners = 5, 7 '// &
         'diameter = 0.014, 0.02 speed = 0.1 / '// &
         '&load name = ''side'' wall = ''right'' direction = ''x'' stress = -2e3 between = ''bottom'', ''top'' '// &
         'mass = 2 damping_ratio = 0.02 / '// &
         '&load name = ''press'' wall = ''top'' direction = ''y'' stress = -2e3 between = ''left'', ''right'' '// &
         'mass = 2 damping_ratio = 0.02 end = 1 / '// &
         '&motion name = ''shear'' wall = ''top'' kind = ''translation'' velocity = 0, '//to_text(-speed, 3)// &
         ' start = 1 ramp = 0.1 / &forces gravity = 0, 0 stiffness = 1e6 friction_coefficient = 0.3 / '// &
         '&integrate '//entries//' /'
   end function biaxial

   !> A group &wall
   function rectangle(name, left, bottom, right, top) result(text)
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: left, bottom, right, top
      character(len=:), allocatable :: text

      text = '&wall name = '''//name//''' outline = ''rectangle'' low = '//numbers([left, bottom])//' high = '// &
         numbers([right, top])//' / '
   end function rectangle

   !> Two numbers of a namelist
   function numbers(values) result(text)
      real(wp), intent(in) :: values(2)
      character(len=:), allocatable :: text

      text = to_text(values(1), 8)//', '//to_text(values(2), 8)
   end function numbers

   !> Half the side of the box of so many grains [m]
   pure real(wp) function side_of(number)
      integer, intent(in) :: number

      side_of = 0.2_wp*sqrt(real(number, wp)/350.0_wp)
   end function side_of

   !> Compare contacts with walls, while the top comes down.
   subroutine shear(table, number, duration, tolerance)
      type(table_t), intent(inout) :: table
      integer, intent(in) :: number
      !> Of all of the test [s]
      character(len=*), intent(in) :: duration
      real(wp), intent(in) :: tolerance
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      real(wp) :: sums(3), tensor(2, 2), width, height
      integer :: k, n

      call begin_scene(biaxial(number, 'duration = '//duration), simulation, error)
      sums = 0.0_wp
      n = 0
      do k = 1, merge(0, int(simulation%n_steps), allocated(error))
         call steps(simulation, 1, error)
         if (allocated(error)) exit
         if (real(k, wp)*simulation%dt < 1.2_wp .or. modulo(k, 10) > 0) cycle
         width = 2.0_wp*side_of(number) + simulation%walls%loads(1)%place
         ! Top and bottom bodies belong to walls that are nowhere else.
         height = top_of(simulation) - (-side_of(number))
         call stress(simulation%bodies, simulation%contacts, simulation%comm, everywhere(width, height), tensor)
         sums = sums + [tensor(1, 1), tensor(2, 2)*width, force_of_top(simulation)]
         n = n + 1
      end do
      call table%note_error(error)
      if (allocated(error)) return
      sums = sums/real(n, wp)
      call table%expect_relative('biaxial test: mean stress of the contacts across [N/m]', side_stress, sums(1), &
                                 tolerance)
      call table%expect_relative('biaxial test: mean force along, of the contacts over the top wall', 1.0_wp, &
                                 sums(2)/sums(3), tolerance)
      call table%show('biaxial test: mean stress ratio', sums(2)/(sums(1)*width))
   end subroutine shear

   !> Height of the face of the top wall [m]
   real(wp) function top_of(simulation)
      type(simulation_t), intent(in) :: simulation

      associate (wall => simulation%walls%wall(4))
         top_of = simulation%bodies%position(2, wall%slots(1)) - 0.02_wp
      end associate
   end function top_of

   !> Force of the contacts on the top wall, along y [N/m]
   real(wp) function force_of_top(simulation)
      type(simulation_t), intent(in) :: simulation
      integer :: c

      force_of_top = 0.0_wp
      associate (contacts => simulation%contacts, slot => simulation%walls%wall(4)%slots(1))
         do c = 1, int(contacts%n)
            if (contacts%row(c)%first == slot) force_of_top = force_of_top + force_along(c)
            if (contacts%row(c)%second == slot) force_of_top = force_of_top - force_along(c)
         end do
      end associate

   contains

      real(wp) function force_along(c)
         integer, intent(in) :: c
         real(wp) :: force(2)

         force = contact_force(simulation%contacts, int(c, ip))
         force_along = force(2)
      end function force_along

   end function force_of_top

   !> The energy that is missing after 0.2 s, with the time step and with a half of it.
   subroutine close_energy(table, number)
      type(table_t), intent(inout) :: table
      integer, intent(in) :: number
      type(error_t), allocatable :: error
      real(wp) :: missing(2), work

      call find_missing_energy(biaxial(number, 'duration = 0.2 dt = 4e-6'), &
                               biaxial(number, 'duration = 0.2 dt = 2e-6'), missing, work, error)
      call table%note_error(error)
      if (allocated(error)) return
      call table%expect_absolute('biaxial test: energy that is missing, over the work of the walls', 0.0_wp, &
                                 missing(2)/abs(work), 1.0e-6_wp)
      call table%expect_least('biaxial test: its fall when dt is halved', 3.5_wp, missing(1)/missing(2))
   end subroutine close_energy

end module b30_loads
