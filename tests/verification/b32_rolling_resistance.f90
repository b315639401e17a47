!> Benchmark B32: rolling resistance of a polygon with many corners on a plane.
!>
!> With the radius r of the circle of the same area and the height h of the centre above the contact, the couple
!> mu_r r N holds a disc on a slope up to tan(a) = mu_r r/h, and a polygon by so much more than its faces, at most
!> tan(pi/n), do: gravity turns slowly until it rolls. A disc that rolls has the acceleration
!> (g sin(a) - mu_r g cos(a))/(1 + I/(m r^2)), on a level floor that for a = 0. A disc that spins on a smooth floor, by
!> less than the spring yields, oscillates with the frequency (k_r/I)^(1/2), k_r = 3 E mu_r^2 r^2. The disc is a polygon
!> with 1024 corners, whose contact spans many faces.
module b32_rolling_resistance
   use outlines, only: gravity, inertia_ratio, pi, regular_polygon
   use trial, only: begin, block_at, steps
   use verification_table, only: table_t
   use polydem_body_list, only: body_list_t
   use polydem_energy_balance, only: balance_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: wp
   use polydem_simulation, only: compute_balance, simulation_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: run_rolling_resistance

   integer, parameter :: many = 1024
   real(wp), parameter :: radius = 0.01_wp, mu = 0.1_wp
   !> Entries of &forces for a disc that rolls, and for one that spins
   character(len=*), parameter :: hard = 'stiffness = 1e8 friction_coefficient = 0.5 '// &
      'tilt_damping = 0 rolling_friction = 0.1', &
      soft = 'stiffness = 1e5 friction = ''none'' tilt_damping = 0 rolling_friction = 0.1 '

contains

   !> Begin to roll, roll, stop, oscillate.
   subroutine run_rolling_resistance(table, thorough)
      !> Table to fill
      type(table_t), intent(inout) :: table
      !> Whether to roll three polygons instead of two, on a slope that grows from zero, and to rest for longer
      logical, intent(in) :: thorough
      integer, parameter :: corners(3) = [many, 16, 64]
      integer :: k

      call table%begin('B32', 'rolling resistance of polygons of radius 1 cm')
      do k = 1, merge(3, 2, thorough)
         call roll_off(table, corners(k), merge(0.0_wp, 0.75_wp, thorough))
      end do
      call hold(table)
      call accelerate(table)
      call stop_on_floor(table, 'level floor', '', thorough)
      call stop_on_floor(table, 'level floor with exact friction', ' friction = ''exact''', thorough)
      call oscillate(table)
      call converge(table)
   end subroutine run_rolling_resistance

   !> A polygon with a face on a plane, in gravity that is turned by the slope.
   subroutine put_on_plane(corners, slope, depth, motion, forces, integrate, simulation, error)
      integer, intent(in) :: corners
      !> Angle of the slope [rad], depth in the plane [m], speed down the slope [m/s] and angular velocity [rad/s]
      real(wp), intent(in) :: slope, depth, motion(2)
      !> Entries of &forces, and of &integrate
      character(len=*), intent(in) :: forces, integrate
      type(simulation_t), intent(out) :: simulation
      type(error_t), allocatable, intent(inout) :: error
      type(body_list_t) :: list

      call list%append(regular_polygon(corners, radius, 0.0_wp, height_of(corners) - depth, &
                                       pi/real(corners, wp) - 0.5_wp*pi), &
                       velocity=[motion(1), 0.0_wp], angular_velocity=motion(2))
      call list%append(block_at(0.0_wp, -0.05_wp, 2.0_wp, 0.1_wp, 0.0_wp), fixed=.true.)
      call begin('&forces gravity = '//to_text(gravity*sin(slope), 17)//', '//to_text(-gravity*cos(slope), 17)//' '// &
                 forces//' / &integrate duration = 1000 '//integrate//' /', &
                 list, simulation, error)
   end subroutine put_on_plane

   !> Distance of a face from the centre [m]
   pure real(wp) function height_of(corners)
      integer, intent(in) :: corners

      height_of = radius*cos(pi/real(corners, wp))
   end function height_of

   !> Radius of the circle of the same area [m]
   pure real(wp) function round_radius(corners)
      integer, intent(in) :: corners

      round_radius = radius*sqrt(0.5_wp*real(corners, wp)*sin(2.0_wp*pi/real(corners, wp))/pi)
   end function round_radius

   !> Turn gravity until the polygon has rolled over a face, with rolling resistance and without.
   subroutine roll_off(table, corners, start)
      type(table_t), intent(inout) :: table
      integer, intent(in) :: corners
      !> First slope over the one at which it is to roll
      real(wp), intent(in) :: start
      real(wp), parameter :: turn = 0.02_wp*2.0_wp*pi
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      real(wp) :: couple, slope, tangent(2)
      integer :: j, k

      do j = 1, 2
         couple = merge(0.0_wp, mu, j == 1)
         slope = start*atan(tan(pi/real(corners, wp)) + couple)
         call put_on_plane(corners, slope, 0.0_wp, [0.0_wp, 0.0_wp], 'stiffness = 1e8 friction_coefficient = 2 '// &
                           'turn_rate = 0.02 rolling_friction = '//to_text(couple, 8), '', simulation, error)
         do k = 1, 10000000
            if (.not. allocated(error)) call steps(simulation, 1, error)
            if (allocated(error)) exit
            if (-simulation%bodies%angle(1) > 2.0_wp*pi/real(corners, wp)) exit
         end do
         call table%note_error(error)
         if (allocated(error)) return
         tangent(j) = tan(slope + turn*real(k, wp)*simulation%dt)
      end do
      call table%show(to_text(corners)//' corners: tan a at which they roll without the couple', tangent(1))
      call table%expect_relative(to_text(corners)//' corners: more by the couple', &
                                 mu*round_radius(corners)/height_of(corners), tangent(2) - tangent(1), 0.02_wp)
   end subroutine roll_off

   !> Lie on a slope that is a little less than the greatest one.
   subroutine hold(table)
      type(table_t), intent(inout) :: table
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error

      call put_on_plane(many, atan(0.97_wp*mu), 0.0_wp, [0.0_wp, 0.0_wp], hard, '', simulation, error)
      if (.not. allocated(error)) call steps(simulation, nint(0.5_wp/simulation%dt), error)
      call table%note_error(error)
      if (allocated(error)) return
      call table%expect_absolute('disc on 0.97 of the greatest slope: speed after 0.5 s [m/s]', 0.0_wp, &
                                 norm2(simulation%bodies%velocity(:, 1)), 1.0e-9_wp)
   end subroutine hold

   !> Roll down a steep slope.
   subroutine accelerate(table)
      type(table_t), intent(inout) :: table
      real(wp), parameter :: slope = 0.3_wp
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      real(wp) :: early
      integer :: n

      call put_on_plane(many, slope, 0.0_wp, [0.0_wp, 0.0_wp], hard, '', simulation, error)
      n = 0
      early = 0.0_wp
      if (.not. allocated(error)) n = nint(0.1_wp/simulation%dt)
      if (.not. allocated(error)) call steps(simulation, n, error)
      if (.not. allocated(error)) early = simulation%bodies%velocity(1, 1)
      if (.not. allocated(error)) call steps(simulation, n, error)
      call table%note_error(error)
      if (allocated(error)) return
      call table%expect_relative('acceleration down a slope [m/s2]', &
                                 gravity*(sin(slope) - mu*cos(slope))/(1.0_wp + inertia_ratio(many)), &
                                 (simulation%bodies%velocity(1, 1) - early)/(real(n, wp)*simulation%dt), 5.0e-3_wp)
   end subroutine accelerate

   !> Roll on a level floor until the body stops, and wait.
   subroutine stop_on_floor(table, name, friction, thorough)
      type(table_t), intent(inout) :: table
      character(len=*), intent(in) :: name, friction
      logical, intent(in) :: thorough
      real(wp), parameter :: speed = 0.2_wp
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      integer :: k

      call put_on_plane(many, 0.0_wp, 0.0_wp, [speed, -speed/radius], hard//friction, '', simulation, &
                        error)
      do k = 1, 100000
         if (.not. allocated(error)) call steps(simulation, 1, error)
         if (allocated(error)) exit
         if (simulation%bodies%velocity(1, 1) <= 0.5_wp*speed) exit
      end do
      call table%note_error(error)
      if (allocated(error)) return
      call table%expect_relative('deceleration on a '//name//' [m/s2]', mu*gravity/(1.0_wp + inertia_ratio(many)), &
                                 (speed - simulation%bodies%velocity(1, 1))/(real(k, wp)*simulation%dt), 5.0e-3_wp)
      call steps(simulation, nint(merge(1.0_wp, 0.4_wp, thorough)/simulation%dt), error)
      call table%note_error(error)
      call table%expect_absolute(name//': speed '//trim(merge('1  ', '0.4', thorough))//' s later [m/s]', 0.0_wp, &
                                 norm2(simulation%bodies%velocity(:, 1)), 1.0e-9_wp)
   end subroutine stop_on_floor

   !> Spin on a smooth floor, by less than the spring yields: time between the first and the eleventh extreme angle.
   subroutine oscillate(table)
      type(table_t), intent(inout) :: table
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      real(wp) :: before, frequency, now, times(2)
      integer :: k, n

      call start_spring(2.0e-5_wp, 'rolling_damping = 0', simulation, error)
      n = 0
      times = 0.0_wp
      if (.not. allocated(error)) now = simulation%bodies%angular_velocity(1)
      do k = 1, 100000
         if (.not. allocated(error)) call steps(simulation, 1, error)
         if (allocated(error)) exit
         before = now
         now = simulation%bodies%angular_velocity(1)
         if (before*now >= 0.0_wp) cycle
         n = n + 1
         if (n == 1 .or. n == 11) times(merge(1, 2, n == 1)) = (real(k, wp) - now/(now - before))*simulation%dt
         if (n == 11) exit
      end do
      call table%note_error(error)
      if (allocated(error)) return
      frequency = sqrt(spring_stiffness()/simulation%bodies%inertia(1))
      call table%expect_relative('frequency of the spring [1/s]', frequency, 10.0_wp*pi/(times(2) - times(1)), &
                                 1.0e-3_wp)
   end subroutine oscillate

   !> Stiffness of the spring of a body on the floor [N]
   pure real(wp) function spring_stiffness()
      spring_stiffness = 3.0_wp*1.0e5_wp*mu**2*round_radius(many)**2
   end function spring_stiffness

   !> A disc that spins on a smooth floor, at the depth at which it floats there.
   subroutine start_spring(dt, entry, simulation, error)
      real(wp), intent(in) :: dt
      character(len=*), intent(in) :: entry
      type(simulation_t), intent(out) :: simulation
      type(error_t), allocatable, intent(inout) :: error
      type(simulation_t) :: calm

      call put_on_plane(many, 0.0_wp, 0.0_wp, [0.0_wp, 0.0_wp], soft//'drag = 100', 'dt = 1e-4', calm, error)
      if (.not. allocated(error)) call steps(calm, 5000, error)
      if (allocated(error)) return
      call put_on_plane(many, 0.0_wp, height_of(many) - calm%bodies%position(2, 1), [0.0_wp, 0.4_wp], soft//entry, &
                        'dt = '//to_text(dt, 17), simulation, error)
   end subroutine start_spring

   !> Angle and unexplained energy of an oscillation with its dashpot, for three time steps.
   subroutine converge(table)
      type(table_t), intent(inout) :: table
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      type(balance_t) :: balance
      real(wp) :: angle(3), residual(3), work
      integer :: k

      do k = 1, 3
         call start_spring(4.0e-4_wp/2.0_wp**k, '', simulation, error)
         if (.not. allocated(error)) call steps(simulation, nint(0.1_wp/simulation%dt), error)
         call table%note_error(error)
         if (allocated(error)) return
         call compute_balance(simulation, balance)
         angle(k) = simulation%bodies%angle(1)
         residual(k) = balance%energy_residual
         work = balance%damping_work
      end do
      call table%expect_relative('fall of the error of the angle when dt is a half', 4.0_wp, &
                                 (angle(1) - angle(2))/(angle(2) - angle(3)), 0.1_wp)
      call table%expect_absolute('energy that is missing, over the work of the couple', 0.0_wp, residual(3)/work, &
                                 1.0e-4_wp)
      call table%expect_relative('its fall when dt is a half', 4.0_wp, residual(2)/residual(3), 0.1_wp)
   end subroutine converge

end module b32_rolling_resistance
