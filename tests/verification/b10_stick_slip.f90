!> Benchmark B10: an oscillator with dry friction (Matuttis & Chen 2014, Sec. 3.3).
!>
!> m x'' = -K (x - y) - D (x' - y') - S sgn(x'), y = a cos(w t), and x' = 0 as long as the sum of the other forces is
!> less than S. A block slides on a floor, S = mu m g, between two slender posts that press on its sides: two springs of
!> polygons, K = 2 E b/l for the thickness b of the posts, and D = gamma sqrt(m E) K/E. Both posts oscillate together.
!> The block has a very large moment of inertia and does not tilt.
!>
!> In units of the length L = S/(4 K) and the time 1/sqrt(K/m), Matuttis & Chen have D = 0.1, a = 1, w = pi, and start
!> from x = 3 with the velocity 4: the block oscillates and then sticks for ever. With a = 8 and w = 1/2 it alternates
!> between stick and slip. The reference is the equation above, where l changes with the depth as in the simulation. It
!> is integrated with a hundredth of the step, and the times of stick and slip are located.
!>
!> A friction spring yields by S/k_t before it slips. When the block reverses, the spring force goes from S to -S over
!> a distance of 2 S/k_t, which adds an energy of the order S^2/k_t. So the distance from the reference falls as
!> k_t^(-1/2), by a factor of about ten when k_t is a hundred times larger.
module b10_stick_slip
   use outlines, only: gravity, pi
   use trial, only: area_law, begin, block_at, steps
   use verification_table, only: table_t
   use polydem_body_list, only: body_list_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, wp
   use polydem_oscillation, only: oscillation_t
   use polydem_simulation, only: simulation_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: run_stick_slip

   !> Block: width and height [m]; posts: length and thickness [m], depth in the block at rest [m]
   real(wp), parameter :: width = 0.1_wp, height = 0.02_wp, post = 0.1_wp, thickness = 1.0e-4_wp, press = 5.0e-3_wp
   real(wp), parameter :: mass = 2500.0_wp*width*height
   real(wp), parameter :: young = 1.0e7_wp
   real(wp), parameter :: mu = 0.3_wp
   real(wp), parameter :: limit = mu*mass*gravity
   real(wp), parameter :: spring = 2.0_wp*young*thickness/(0.5_wp*(width + post) - press)
   real(wp), parameter :: unit = limit/(4.0_wp*spring)
   real(wp), parameter :: frequency = sqrt(spring/mass)
   real(wp), parameter :: gamma_coefficient = 0.1_wp*sqrt(young/spring)
   real(wp), parameter :: dt = 2.0e-5_wp

   !> Drive and start, in units of `unit` and 1/`frequency`
   type :: case_t
      character(len=12) :: name
      real(wp) :: amplitude, rate, place, velocity
   end type case_t

   !> State of the reference
   type :: reference_t
      real(wp) :: x = 0.0_wp, v = 0.0_wp, time = 0.0_wp
      logical :: sticks = .false.
      !> Times of the first changes between slip and stick [s]
      real(wp) :: events(4) = 0.0_wp
      integer :: n_events = 0
   end type reference_t

contains

   !> Run the case of Matuttis & Chen and a case of repeated stick and slip, with every friction law.
   subroutine run_stick_slip(table)
      !> Table to fill
      type(table_t), intent(inout) :: table
      type(case_t), parameter :: cases(2) = [case_t('book', 1.0_wp, pi, 3.0_wp, 4.0_wp), &
                                             case_t('stick-slip', 8.0_wp, 0.5_wp, 0.0_wp, 0.0_wp)]
      real(wp) :: soft, stiff, distance
      integer :: k

      call table%begin('B10', 'an oscillator with dry friction, in units L = S/(4 K)')
      do k = 1, size(cases)
         call compare(table, cases(k), 'k_t = 2 E/7', spring_text(1), soft)
         call table%show(trim(cases(k)%name)//', k_t = 2 E/7: greatest distance from the reference [L]', soft)
         call compare(table, cases(k), 'k_t = 200 E/7', spring_text(100), stiff)
         call table%show(trim(cases(k)%name)//', k_t = 200 E/7: greatest distance from the reference [L]', stiff)
         call table%expect_least(trim(cases(k)%name)//': the former over the latter', 4.0_wp, soft/stiff)
         call compare(table, cases(k), 'exact', 'friction = ''exact''', distance)
         call table%expect_absolute(trim(cases(k)%name)//', exact: greatest distance from the reference [L]', 0.0_wp, &
                                    distance, 0.005_wp)
      end do
   end subroutine run_stick_slip

   !> Namelist entry for a spring stiffer than the default by a factor
   function spring_text(factor) result(text)
      integer, intent(in) :: factor
      character(len=:), allocatable :: text

      text = 'tangential_stiffness = '//to_text(real(2*factor, wp)/7.0_wp)
   end function spring_text

   !> Greatest distance from the reference in four periods of the spring, in units of L; also adds rows for the first
   !> stop.
   subroutine compare(table, drive, law, friction, worst)
      type(table_t), intent(inout) :: table
      type(case_t), intent(in) :: drive
      character(len=*), intent(in) :: law, friction
      real(wp), intent(out) :: worst
      type(simulation_t) :: simulation
      type(reference_t) :: reference
      type(error_t), allocatable :: error
      real(wp) :: stop_time, before
      integer :: k

      call build(drive, friction, simulation, error)
      reference = reference_t(x=drive%place*unit, v=drive%velocity*unit*frequency)
      reference%sticks = .not. abs(reference%v) > 0.0_wp
      worst = 0.0_wp
      stop_time = 0.0_wp
      do k = 1, nint(8.0_wp*pi/(frequency*dt))
         if (allocated(error)) exit
         before = simulation%bodies%position(1, 1)
         call steps(simulation, 1, error)
         if (allocated(error)) exit
         call follow(drive, reference)
         worst = max(worst, abs(simulation%bodies%position(1, 1) - reference%x)/unit)
         ! The block starts with a speed. Positions follow the velocities in the middle of steps, so the last step
         ! forward ends at the stop, up to half a step.
         if (stop_time <= 0.0_wp .and. drive%velocity > 0.0_wp .and. simulation%bodies%position(1, 1) <= before) &
            stop_time = real(k - 1, wp)*dt
      end do
      call table%note_error(error)
      if (allocated(error)) return
      if (drive%velocity > 0.0_wp) call table%expect_absolute(trim(drive%name)//', '//law//': first stop [s]', &
                                                              reference%events(1), stop_time, dt)
   end subroutine compare

   !> The block, two posts and the floor.
   subroutine build(drive, friction, simulation, error)
      type(case_t), intent(in) :: drive
      character(len=*), intent(in) :: friction
      type(simulation_t), intent(out) :: simulation
      type(error_t), allocatable, intent(inout) :: error
      type(body_list_t) :: list
      type(oscillation_t) :: motion
      real(wp) :: depth, start, distance
      real(wp), parameter :: floor = 0.1_wp

      depth = mass*gravity/(young*width)*2.0_wp*height*floor/(height + floor)
      start = drive%place*unit
      distance = 0.5_wp*(width + post) - press
      call list%append(block_at(start, 0.5_wp*height - depth, width, height, 0.0_wp), masses=[0.0_wp, 1.0e6_wp], &
                       velocity=[drive%velocity*unit*frequency, 0.0_wp])
      call list%append(block_at(distance, 0.5_wp*height, post, thickness, 0.0_wp), fixed=.true.)
      call list%append(block_at(-distance, 0.5_wp*height, post, thickness, 0.0_wp), fixed=.true.)
      call list%append(block_at(0.0_wp, -0.5_wp*floor, 1.0_wp, floor, 0.0_wp), fixed=.true.)
      motion%amplitude = [drive%amplitude*unit, 0.0_wp]
      motion%frequency = drive%rate*frequency
      ! A cosine is a sine with the phase of a quarter of a period.
      motion%start = -0.5_wp*pi/motion%frequency
      call begin('&forces '//friction//' friction_coefficient = '//to_text(mu, 17)// &
                 ' damping_coefficient = '//to_text(gamma_coefficient, 17)//area_law//' / &integrate dt = '// &
                 to_text(dt, 17)// &
                 ' duration = 1000 / &output energy_balance = .false. /', list, simulation, error, motion, [2_ip, 3_ip])
   end subroutine build

   !> Advance the reference by one step of the simulation, in a hundred steps.
   subroutine follow(drive, reference)
      type(case_t), intent(in) :: drive
      type(reference_t), intent(inout) :: reference
      real(wp), parameter :: h = 0.01_wp*dt
      real(wp) :: force, x, v, share
      integer :: k

      do k = 1, 100
         associate (r => reference)
            if (r%sticks) then
               r%time = r%time + h
               force = push(drive, r%x, 0.0_wp, r%time)
               if (abs(force) <= limit) cycle
               r%sticks = .false.
               r%v = sign(tiny(1.0_wp), force)
               call note(r, r%time)
               cycle
            end if
            x = r%x
            v = r%v
            call slide(drive, sign(1.0_wp, v), r%time, h, x, v)
            if (v*r%v > 0.0_wp) then
               r%x = x
               r%v = v
            else
               ! The velocity is nearly linear in this short time.
               share = r%v/(r%v - v)
               r%x = r%x + 0.5_wp*share*h*r%v
               r%sticks = abs(push(drive, r%x, 0.0_wp, r%time + share*h)) <= limit
               if (r%sticks .or. r%n_events == 0) call note(r, r%time + share*h)
               r%v = merge(0.0_wp, sign(tiny(1.0_wp), v), r%sticks)
            end if
            r%time = r%time + h
         end associate
      end do
   end subroutine follow

   pure subroutine note(reference, time)
      type(reference_t), intent(inout) :: reference
      real(wp), intent(in) :: time

      reference%n_events = reference%n_events + 1
      if (reference%n_events <= size(reference%events)) reference%events(reference%n_events) = time
   end subroutine note

   !> One step of Heun's method with the direction of sliding given.
   pure subroutine slide(drive, direction, time, h, x, v)
      type(case_t), intent(in) :: drive
      real(wp), intent(in) :: direction, time, h
      real(wp), intent(inout) :: x, v
      real(wp) :: first, second

      first = (push(drive, x, v, time) - direction*limit)/mass
      second = (push(drive, x + h*v, v + h*first, time + h) - direction*limit)/mass
      x = x + h*(v + 0.5_wp*h*first)
      v = v + 0.5_wp*h*(first + second)
   end subroutine slide

   !> Force of both posts on the block [N/m]
   pure real(wp) function push(drive, x, v, time)
      type(case_t), intent(in) :: drive
      real(wp), intent(in) :: x, v, time
      real(wp) :: ahead, speed

      ahead = x - drive%amplitude*unit*cos(drive%rate*frequency*time)
      speed = v + drive%amplitude*unit*drive%rate*frequency*sin(drive%rate*frequency*time)
      push = one_post(press - ahead, -speed) - one_post(press + ahead, speed)
   end function push

   !> E A/l with damping, for a depth and its rate; l follows from the distances of the two centres from the middle of
   !> the overlap
   pure real(wp) function one_post(depth, rate)
      real(wp), intent(in) :: depth, rate
      real(wp) :: r1, r2

      r1 = 0.5_wp*(width - depth)
      r2 = 0.5_wp*(post - depth)
      one_post = max(0.0_wp, (young*depth + gamma_coefficient*sqrt(mass*young)*rate)*thickness*(r1 + r2)/(4.0_wp*r1*r2))
   end function one_post

end module b10_stick_slip
