!> Runs the examples of the recipes; check_recipes.py checks the output.
program try_recipes
   use trial, only: begin, block_at, steps
   use polydem_bodies, only: state_hash
   use polydem_body_list, only: body_list_t
   use polydem_contact_history, only: column_of
   use polydem_energy_balance, only: balance_t
   use polydem_end_condition, only: measure_condition
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, wp
   use polydem_log, only: log_t
   use polydem_named_values, only: named_values_t
   use polydem_pair_parameters, only: pair_parameters, pair_parameters_t
   use polydem_monitor, only: check_step, monitor_t, new_monitor
   use polydem_read_settings, only: read_settings_text
   use polydem_sample_columns, only: set_sample_columns
   use polydem_settings, only: settings_t
   use polydem_simulation, only: simulation_t, compute_balance
   use polydem_start, only: new_simulation
   use polydem_strings, only: index_of
   use polydem_time_step, only: advance
   implicit none

   !> Side of a square [m], and speed against a plate [m/s]
   real(wp), parameter :: side = 0.01_wp, speed = 0.1_wp

   call hit_plate('area')
   call hit_plate('conservative')
   call compare_stiffness()
   call mix()
   call run_gas('all_pairs')
   call run_gas('plain_loop')
   call turn()
   call go_round()
   call fall()
   call slow_down()
   call speed_up()
   call draw_triangle()
   call spin()

contains

   !> Let a square hit a plate face to face; print its restitution and the share of its energy dissipated by damping.
   subroutine hit_plate(law)
      character(len=*), intent(in) :: law
      type(simulation_t) :: simulation
      type(balance_t) :: balance
      type(error_t), allocatable :: error
      real(wp) :: energy, stored
      integer :: k

      call start(law, 'damping = ''walton_braun'' plasticity = 3', simulation, error)
      if (failed(error)) return
      energy = 0.5_wp*simulation%bodies%mass(1)*speed**2
      stored = 0.0_wp
      do k = 1, 20000
         call advance(simulation, error)
         if (failed(error)) return
         if (simulation%search%neighbours%pairs%n > 0_ip) stored = &
            max(stored, simulation%history%column(column_of(simulation%history, 'greatest_area'))%value(1))
         if (simulation%contacts%n == 0_ip .and. simulation%bodies%velocity(2, 1) > 0.0_wp) exit
      end do
      call compute_balance(simulation, balance)
      print '(a, es24.16)', law//'_restitution ', simulation%bodies%velocity(2, 1)/speed
      print '(a, es24.16)', law//'_damping_work ', balance%damping_work/energy
      print '(a, es24.16)', law//'_greatest_area ', stored
   end subroutine hit_plate

   !> Print the ratio of the expected stable steps with and without the example part.
   subroutine compare_stiffness()
      type(simulation_t) :: simple, stiff
      type(error_t), allocatable :: error

      call start('area', 'damping = ''none''', simple, error)
      call start('area', 'damping = ''walton_braun'' plasticity = 3', stiff, error)
      if (failed(error)) return
      print '(a, es24.16)', 'stable_step_share ', stiff%expected_stable_step/simple%expected_stable_step
   end subroutine compare_stiffness

   !> Print the parameter of the example part for a pair of two materials, and for a pair that states its own.
   subroutine mix()
      character(len=*), parameter :: text = '&scene name = ''gas'' bodies = 60 speed = 1 '// &
         'material = ''a'' / &material name = ''a'' plasticity = 2 / &material name = ''b'' plasticity = 5 / '// &
         '&contact_pair name = ''aa'' materials = ''a'', ''a'' plasticity = 7 / '// &
         '&forces damping = ''walton_braun'' / &integrate duration = 1 /'
      character(len=1) :: no_overrides(0)
      type(settings_t) :: settings
      type(pair_parameters_t) :: pairs
      type(error_t), allocatable :: error

      call read_settings_text('mixed.nml', text, no_overrides, settings, error)
      if (failed(error)) return
      pairs = pair_parameters(settings, settings%forces)
      print '(a, 2es24.16)', 'plasticity', pairs%plasticity%of([1_ip, 2_ip]), pairs%plasticity%of([1_ip, 1_ip])
   end subroutine mix

   !> Start a square above a fixed plate.
   subroutine start(law, damping, simulation, error)
      character(len=*), intent(in) :: law, damping
      type(simulation_t), intent(out) :: simulation
      type(error_t), allocatable, intent(inout) :: error
      type(body_list_t) :: list

      call list%append(block_at(0.0_wp, 0.5_wp*side + 1.0e-6_wp, side, side, 0.0_wp), velocity=[0.0_wp, -speed])
      call list%append(block_at(0.0_wp, -side, 10.0_wp*side, 2.0_wp*side, 0.0_wp), fixed=.true.)
      call begin('&forces gravity = 0, 0 friction = ''none'' law = '''//law//''' '//damping//' / '// &
                 '&integrate duration = 1 safety_factor = 0.002 speed = 1e-12 /', list, simulation, error)
   end subroutine start

   !> Run a gas with a finder; print its state hash and its pair counts.
   subroutine run_gas(finder)
      character(len=*), intent(in) :: finder
      character(len=*), parameter :: text = '&scene name = ''gas'' bodies = 60 solid_fraction = 0.35 speed = 1 / '// &
         '&forces stiffness = 2e5 / &integrate duration = 0.1 / '
      character(len=1) :: no_overrides(0)
      type(settings_t) :: settings
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error

      call read_settings_text('gas.nml', text//'&neighbours finder = '''//finder//''' /', no_overrides, settings, error)
      if (failed(error)) return
      call new_simulation(settings, simulation, error)
      if (failed(error)) return
      call steps(simulation, 400, error)
      if (failed(error)) return
      print '(a, z16.16, 3(1x, i0))', finder//'_result ', state_hash(simulation%bodies), simulation%sums(1:3)
   end subroutine run_gas

   !> Print the angle by which the velocity of a body that spins turns in 0.4 s, and the relative change of its energy.
   subroutine turn()
      type(simulation_t) :: simulation
      type(body_list_t) :: list
      type(error_t), allocatable :: error

      call list%append(block_at(0.0_wp, 0.0_wp, side, side, 0.0_wp), velocity=[1.0_wp, 0.0_wp], angular_velocity=3.0_wp)
      call begin('&forces gravity = 0, 0 magnus = 0.5 / &integrate duration = 1 dt = 1e-3 /', &
                 list, simulation, error)
      if (failed(error)) return
      call steps(simulation, 400, error)
      if (failed(error)) return
      associate (v => simulation%bodies%velocity(:, 1))
         print '(a, 2es24.16)', 'magnus', atan2(v(2), v(1)), sum(v**2) - 1.0_wp
      end associate
   end subroutine turn

   !> Move a wall by three eighths of a circle; print how far its centre is from where it should be, over the radius.
   subroutine go_round()
      character(len=*), parameter :: text = '&grains name = ''g'' region = ''at'' at = 0, 1 / &wall name = ''w'' '// &
         'outline = ''rectangle'' low = -1, -1 high = 1, 0 / &motion name = ''m'' wall = ''w'' kind = ''orbit'' '// &
         'amplitude = 0.5, 0 frequency = 2 / &forces gravity = 0, 0 / &integrate duration = 1 dt = 1e-4 /'
      character(len=1) :: no_overrides(0)
      real(wp), parameter :: root = sqrt(0.5_wp)
      type(settings_t) :: settings
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error

      call read_settings_text('orbit.nml', text, no_overrides, settings, error)
      if (failed(error)) return
      call new_simulation(settings, simulation, error)
      if (failed(error)) return
      call steps(simulation, 1875, error)
      if (failed(error)) return
      associate (slots => simulation%walls%wall(1)%slots)
         print '(a, 2es24.16)', 'orbit', (simulation%bodies%position(:, slots(1)) &
                                          - ([0.0_wp, -0.5_wp] + 0.5_wp*[-root - 1.0_wp, root]))/0.5_wp
      end associate
   end subroutine go_round

   !> Print the order of the example integrator for a body that falls.
   subroutine fall()
      type(simulation_t) :: simulation
      type(body_list_t) :: list
      type(error_t), allocatable :: error
      character(len=8) :: dt
      real(wp) :: wrong(2)
      integer :: k

      call list%append(block_at(0.0_wp, 0.0_wp, side, side, 0.0_wp))
      do k = 1, 2
         write (dt, '(es8.1)') 1.0e-3_wp/real(k, wp)
         call begin('&forces gravity = 0, -10 / &integrate scheme = ''symplectic_euler'' duration = 1 dt = '// &
                    dt//' /', list, simulation, error)
         if (failed(error)) return
         call steps(simulation, 100*k, error)
         if (failed(error)) return
         wrong(k) = simulation%bodies%position(2, 1) + 0.5_wp*10.0_wp*0.1_wp**2
      end do
      print '(a, es24.16)', 'euler_order ', log(wrong(1)/wrong(2))/log(2.0_wp)
   end subroutine fall

   !> Print the speed that a brake leaves after 0.4 s, and the residual of the energy.
   subroutine slow_down()
      type(simulation_t) :: simulation
      type(body_list_t) :: list
      type(balance_t) :: balance
      type(error_t), allocatable :: error

      call list%append(block_at(0.0_wp, 0.0_wp, side, side, 0.0_wp), velocity=[1.0_wp, 0.0_wp])
      call begin('&forces gravity = 0, 0 drag = 1e-9 / &integrate duration = 1 dt = 1e-3 /', list, simulation, error)
      if (failed(error)) return
      call steps(simulation, 400, error)
      if (failed(error)) return
      call compute_balance(simulation, balance)
      print '(a, 2es24.16)', 'brake', simulation%bodies%velocity(1, 1), balance%energy_residual
   end subroutine slow_down

   !> Print the greatest speed of two bodies as a column of the series, and as the quantity of a stage.
   subroutine speed_up()
      type(simulation_t) :: simulation
      type(body_list_t) :: list
      type(named_values_t) :: row
      type(error_t), allocatable :: error

      call list%append(block_at(0.0_wp, 0.0_wp, side, side, 0.0_wp), velocity=[1.0_wp, 0.0_wp])
      call list%append(block_at(1.0_wp, 0.0_wp, side, side, 0.0_wp), velocity=[0.0_wp, 2.0_wp])
      call begin('&forces gravity = 0, 0 / &integrate dt = 1e-3 / &stage name = ''one'' until = ''speed'' '// &
                 'below = 1 longest = 1 check = 1 / &stage name = ''two'' duration = 1 /', list, simulation, error)
      if (failed(error)) return
      call advance(simulation, error, tabulate=.true.)
      if (failed(error)) return
      call measure_condition(simulation)
      call set_sample_columns(simulation, row)
      print '(a, 2es24.16)', 'greatest_speed', row%value(index_of('greatest_speed', row%label%name)), &
         simulation%stages%value
   end subroutine speed_up

   !> Print the area of a triangle.
   subroutine draw_triangle()
      character(len=*), parameter :: text = '&scene density = 1 / &grains name = ''g'' region = ''at'' at = 0, 0 '// &
         'shape = ''triangle'' width = 1 height = 1 / &forces gravity = 0, 0 / &integrate duration = 1 dt = 1e-4 /'
      character(len=1) :: no_overrides(0)
      type(settings_t) :: settings
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error

      call read_settings_text('triangle.nml', text, no_overrides, settings, error)
      if (failed(error)) return
      call new_simulation(settings, simulation, error)
      if (failed(error)) return
      print '(a, es24.16)', 'triangle_area ', simulation%bodies%mass(1)
   end subroutine draw_triangle

   !> Print the warnings of the example guard about a body that spins slowly, and about one that spins fast.
   subroutine spin()
      type(simulation_t) :: simulation
      type(monitor_t) :: monitor
      type(log_t) :: log
      type(body_list_t) :: list
      type(error_t), allocatable :: error
      integer(ip) :: counts(2), k, n

      do n = 1_ip, 2_ip
         list = body_list_t()
         call list%append(block_at(0.0_wp, 0.0_wp, 1.0e-4_wp, 1.0e-4_wp, 0.0_wp), angular_velocity=6.0e3_wp*real(n, wp))
         call begin('&forces gravity = 0, 0 / &integrate duration = 1 dt = 1e-6 /', list, simulation, error)
         if (failed(error)) return
         call log%open('', error, quiet=.true.)
         call new_monitor(monitor, simulation)
         call check_step(monitor, simulation, .false., log, error)
         do k = 1_ip, 250_ip
            call steps(simulation, 1, error)
            call check_step(monitor, simulation, .false., log, error)
            if (failed(error)) return
         end do
         associate (last => simulation%guards(size(simulation%guards))%guard)
            counts(n) = int(last%warning%count, ip)
         end associate
      end do
      print '(a, 2(1x, i0))', 'spin_warnings', counts
   end subroutine spin

   !> Print an error.
   logical function failed(error)
      type(error_t), allocatable, intent(in) :: error

      failed = allocated(error)
      if (failed) print '(a)', 'error '//error%message
   end function failed

end program try_recipes
