!> Benchmark B18: a dilute gas of 16-gons cools (P.K. Haff, J. Fluid Mech. 134 (1983) 401).
!>
!> With a constant restitution T = T0/(1 + t/tau)^2. With the area law and rate damping, restitution depends on the
!> speed. Two round bodies overlap by an area A ~ x^(3/2) at the depth x, so m x'' = -k x^(3/2) - c x^(1/2) x', as for
!> viscoelastic spheres: in units of the greatest depth X ~ v^(4/5) the damping is proportional to v/X, and for weak
!> damping the loss 1 - e^2 goes with v^p, p = 1/5 (N.V. Brilliantov & T. Poeschel, Phys. Rev. E 61 (2000) 5573; for a
!> sharp corner on a face, A ~ x^2, it is 1/3). Then dT/dt ~ -T^(3/2 + p/2) and T = T0 (1 + t/tau)^(-2/(1 + p)), -5/3
!> for round bodies instead of Haff's -2.
!>
!> The benchmark first measures the loss of a collision: for relative speeds c, at random orientations and impact
!> parameters b up to b_max, the mean loss is L(c) = (m/4) c^2 C c^p. Then the energy T of a gas particle obeys
!>
!>     dT/dt = -(1/2) n chi int_0^inf 2 b_max c L(c) f(c) dc,     f(c) = (m c/(2 T)) exp(-m c^2/(4 T))
!>           = -(1/4) n chi b_max m C (4 T/m)^((3 + p)/2) Gamma((5 + p)/2)
!>
!> with chi = (1 - 7 nu/16)/(1 - nu)^2 of hard discs (D. Henderson 1975). The particles have a very large moment of
!> inertia, so they do not turn. The damping at walls uses a very small mass, so impacts on walls lose no energy.
module b18_cooling_gas
   use outlines, only: pi, regular_polygon
   use trial, only: area_law, begin, block_at, steps
   use verification_table, only: table_t
   use polydem_body_list, only: body_list_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, wp
   use polydem_random, only: new_random, random_t
   use polydem_simulation, only: simulation_t, time_of
   use polydem_strings, only: to_text
   implicit none
   private
   public :: run_cooling_gas

   integer, parameter :: corners = 16
   real(wp), parameter :: radius = 0.005_wp
   !> Area of a particle [m2], its mass [kg/m]
   real(wp), parameter :: area = 0.5_wp*real(corners, wp)*sin(2.0_wp*pi/real(corners, wp))*radius**2
   real(wp), parameter :: mass = 2500.0_wp*area
   !> Damping coefficient of the gas
   real(wp), parameter :: gas_damping = 0.3_wp
   !> Namelist without the damping coefficient
   character(len=*), parameter :: rest = area_law//' gravity = 0, 0 friction = ''none'' stiffness = 1e8 / '// &
      '&integrate dt = 1e-5 duration = 1000 / &output energy_balance = .false. /'

contains

   !> Run single collisions, and with `thorough` the gas.
   subroutine run_cooling_gas(table, thorough)
      !> Table to fill
      type(table_t), intent(inout) :: table
      !> Whether to run more collisions, and the gas
      logical, intent(in) :: thorough
      real(wp) :: slope, factor

      call table%begin('B18', 'a gas of 16-gons cools')
      call measure_loss(table, 64, 0.03_wp, merge(1000, 200, thorough), slope, factor)
      call table%expect_absolute('64-gons: exponent p of the loss with the speed', 0.2_wp, slope, 0.03_wp)
      if (.not. thorough) return
      call measure_loss(table, corners, gas_damping, 2000, slope, factor)
      call table%show('16-gons: exponent p', slope)
      call table%show('16-gons: mean 1 - e^2 at 1 m/s, misses included', factor)
      call cool(table, slope, factor)
   end subroutine run_cooling_gas

   !> Fit the mean lost share of the relative energy by factor*c^slope, for speeds c of 0.25 to 2 m/s.
   subroutine measure_loss(table, n_corners, damping, n, slope, factor)
      type(table_t), intent(inout) :: table
      integer, intent(in) :: n_corners, n
      real(wp), intent(in) :: damping
      real(wp), intent(out) :: slope, factor
      integer, parameter :: n_speeds = 4
      real(wp) :: speed(n_speeds), loss(n_speeds)
      integer :: k

      do k = 1, n_speeds
         speed(k) = 0.25_wp*2.0_wp**(k - 1)
         loss(k) = mean_loss(table, n_corners, damping, speed(k), n)
      end do
      slope = log(loss(n_speeds)/loss(1))/log(speed(n_speeds)/speed(1))
      factor = exp(sum(log(loss) - slope*log(speed))/real(n_speeds, wp))
   end subroutine measure_loss

   !> Mean lost share of the relative energy, over evenly spaced impact parameters, at the same random orientations for
   !> all speeds
   real(wp) function mean_loss(table, n_corners, damping, speed, n)
      type(table_t), intent(inout) :: table
      integer, intent(in) :: n_corners
      real(wp), intent(in) :: damping, speed
      integer, intent(in) :: n
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      type(random_t) :: random
      real(wp) :: offset, first, second, after(2)
      logical :: has_touched
      integer :: k, step

      random = new_random(3_ip)
      mean_loss = 0.0_wp
      do k = 1, n
         offset = 2.0_wp*radius*(2.0_wp*(real(k, wp) - 0.5_wp)/real(n, wp) - 1.0_wp)
         first = random%between(0.0_wp, 2.0_wp*pi)
         second = random%between(0.0_wp, 2.0_wp*pi)
         call aim(n_corners, damping, offset, first, second, speed, simulation, error)
         has_touched = .false.
         do step = 1, 100000
            if (.not. allocated(error)) call steps(simulation, 1, error)
            if (allocated(error)) exit
            if (has_touched .and. simulation%contacts%n == 0) exit
            has_touched = simulation%contacts%n > 0
            if (real(step, wp)*simulation%dt*speed > 4.0_wp*radius .and. .not. has_touched) exit
         end do
         call table%note_error(error)
         if (allocated(error)) return
         after = simulation%bodies%velocity(:, 2) - simulation%bodies%velocity(:, 1)
         mean_loss = mean_loss + (1.0_wp - (after(1)**2 + after(2)**2)/speed**2)/real(n, wp)
      end do
   end function mean_loss

   !> Two approaching particles, nearly in touch
   subroutine aim(n_corners, damping, offset, first, second, speed, simulation, error)
      integer, intent(in) :: n_corners
      real(wp), intent(in) :: damping, offset, first, second, speed
      type(simulation_t), intent(out) :: simulation
      type(error_t), allocatable, intent(inout) :: error
      type(body_list_t) :: list
      real(wp) :: distance

      distance = sqrt(max(0.0_wp, 4.0_wp*radius**2 - offset**2)) + 0.01_wp*radius
      call list%append(regular_polygon(n_corners, radius, 0.0_wp, 0.0_wp, first), velocity=[0.5_wp*speed, 0.0_wp], &
                       masses=[0.0_wp, 1.0e6_wp])
      call list%append(regular_polygon(n_corners, radius, distance, offset, second), velocity=[-0.5_wp*speed, 0.0_wp], &
                       masses=[0.0_wp, 1.0e6_wp])
      call begin('&forces damping_coefficient = '//to_text(damping)//rest, list, simulation, error)
   end subroutine aim

   !> Compare the energy of the gas over a decade of 1 + t/tau.
   subroutine cool(table, slope, factor)
      type(table_t), intent(inout) :: table
      real(wp), intent(in) :: slope, factor
      real(wp), parameter :: fraction = 0.1_wp, start = 1.0_wp
      integer, parameter :: across = 20
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      real(wp) :: side, density, chi, temperature, late, tau, exponent, fitted

      side = real(across, wp)*sqrt(area/fraction)
      density = real(across**2, wp)/side**2
      chi = (1.0_wp - 7.0_wp*fraction/16.0_wp)/(1.0_wp - fraction)**2
      call fill(across, side, start, simulation, error)
      ! A few collisions per particle make the velocities Maxwellian.
      if (.not. allocated(error)) call steps(simulation, 2500, error)
      temperature = energy(simulation)
      tau = temperature*2.0_wp/(1.0_wp + slope)/(0.25_wp*density*chi*2.0_wp*radius*mass*factor &
                                                *(4.0_wp*temperature/mass)**(0.5_wp*(3.0_wp + slope)) &
                                                *gamma(0.5_wp*(5.0_wp + slope)))
      call table%show('expected tau [s]', tau)
      if (.not. allocated(error)) call steps(simulation, nint(9.0_wp*tau/simulation%dt), error)
      call table%note_error(error)
      if (allocated(error)) return
      late = energy(simulation)
      exponent = 2.0_wp/(1.0_wp + slope)
      fitted = 9.0_wp*tau/((temperature/late)**(1.0_wp/exponent) - 1.0_wp)
      call table%expect_relative('tau from the energies at 0 and 9 tau [s]', tau, fitted, 0.05_wp)
      call table%expect_absolute('exponent of T over a decade of 1 + t/tau', -exponent, &
                                 log(late/temperature)/log(10.0_wp), 0.05_wp)
      call table%show('time simulated [s]', time_of(simulation))
   end subroutine cool

   !> Particles on a square lattice with random velocities and no momentum, in a box.
   subroutine fill(across, side, speed, simulation, error)
      integer, intent(in) :: across
      real(wp), intent(in) :: side, speed
      type(simulation_t), intent(out) :: simulation
      type(error_t), allocatable, intent(inout) :: error
      type(body_list_t) :: list
      type(random_t) :: random
      real(wp) :: velocity(2, across**2), x, y
      integer :: k

      random = new_random(7_ip)
      do k = 1, across**2
         velocity(:, k) = speed*[random%normal(), random%normal()]
      end do
      do k = 1, across**2
         x = side*((real(modulo(k - 1, across), wp) + 0.5_wp)/real(across, wp) - 0.5_wp)
         y = side*((real((k - 1)/across, wp) + 0.5_wp)/real(across, wp) - 0.5_wp)
         call list%append(regular_polygon(corners, radius, x, y, random%between(0.0_wp, 2.0_wp*pi)), &
                          velocity=velocity(:, k) - sum(velocity, 2)/real(across**2, wp), masses=[0.0_wp, 1.0e6_wp])
      end do
      do k = -1, 1, 2
         call list%append(block_at(real(k, wp)*(0.5_wp*side + 0.01_wp), 0.0_wp, 0.02_wp, side, 0.0_wp), fixed=.true., &
                          masses=[1.0e-12_wp, 0.0_wp])
         call list%append(block_at(0.0_wp, real(k, wp)*(0.5_wp*side + 0.01_wp), side + 0.04_wp, 0.02_wp, 0.0_wp), &
                          fixed=.true., masses=[1.0e-12_wp, 0.0_wp])
      end do
      call begin('&forces damping_coefficient = '//to_text(gas_damping)//rest, list, simulation, error)
   end subroutine fill

   !> Kinetic energy per particle, which equals T in two dimensions [J/m]
   pure real(wp) function energy(simulation)
      type(simulation_t), intent(in) :: simulation
      integer(ip) :: k

      energy = 0.0_wp
      do k = 1_ip, size(simulation%bodies%free, kind=ip)
         associate (velocity => simulation%bodies%velocity(:, simulation%bodies%free(k)))
            energy = energy + 0.5_wp*mass*(velocity(1)**2 + velocity(2)**2)
         end associate
      end do
      energy = energy/real(size(simulation%bodies%free), wp)
   end function energy

end module b18_cooling_gas
