!> Normal impact of squares face to face, for which the area law is a linear spring.
!>
!> With depth d of the overlap of width w, F = E w d/l: two equal squares have l = w, so k = E, m_eff = m/2, and the
!> damping ratio zeta = c/(2 sqrt(k m_eff)) = gamma/2. Without damping the contact lasts pi/w0 and is v/w0 deep,
!> w0 = sqrt(k/m_eff). With damping, the contact ends where the force vanishes (no attraction), and the restitution is
!> e = exp(-(zeta/s)(pi - atan2(2 zeta s, 1 - 2 zeta^2))), s = sqrt(1 - zeta^2) (T. Schwager & T. Poeschel, Granular
!> Matter 9 (2007) 465). The force of the dashpot jumps at first touch, so e depends on the phase of the step at first
!> touch. Without damping from touch, which this benchmark leaves out, the error of the mean over phases is of second
!> order in the step, that of the worst phase of first order.
module s32_flat_impact
   use outlines, only: gravity, integrate_text, pi
   use trial, only: area_law, begin, block_at, steps
   use verification_table, only: table_t
   use polydem_body_list, only: body_list_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: wp
   use polydem_simulation, only: simulation_t
   use polydem_strings, only: to_text
   use polydem_time_step, only: advance
   implicit none
   private
   public :: run_flat_impact

   !> Side of a square [m]
   real(wp), parameter :: width = 0.01_wp
   real(wp), parameter :: mass = 2500.0_wp*width**2
   real(wp), parameter :: young = 1.0e7_wp
   !> w0 of two equal squares [1/s]
   real(wp), parameter :: frequency = sqrt(young/(0.5_wp*mass))
   !> Half the speed of approach, so small that l changes by 1e-6 only [m/s]
   real(wp), parameter :: speed = 1.0e-4_wp

contains

   !> Run an elastic and a damped impact, and a block at rest on a floor.
   subroutine run_flat_impact(table, thorough)
      !> Table to fill
      type(table_t), intent(inout) :: table
      !> Whether to run five damping ratios instead of two
      logical, intent(in) :: thorough
      real(wp), parameter :: ratios(*) = [0.1_wp, 0.3_wp, 0.0343_wp, 0.5_wp, 0.7071_wp]
      integer :: k

      call table%begin('3.2', 'normal impact of two squares face to face')
      call collide_elastically(table)
      do k = 1, merge(size(ratios), 2, thorough)
         call compare(table, ratios(k))
      end do
      call rest_on_floor(table)
   end subroutine run_flat_impact

   subroutine collide_elastically(table)
      type(table_t), intent(inout) :: table
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      real(wp) :: depth, deepest, touched
      integer :: k

      call approach('damping = ''none''', 0.002_wp/frequency, 0.5_wp, simulation, error)
      deepest = 0.0_wp
      touched = 0.0_wp
      do k = 1, 2000
         if (.not. allocated(error)) call advance(simulation, error)
         depth = 0.0_wp
         if (simulation%contacts%n > 0) depth = simulation%contacts%row(1)%area/width
         if (depth > 0.0_wp) touched = touched + simulation%dt
         deepest = max(deepest, depth)
      end do
      call table%note_error(error)
      call table%expect_relative('elastic: greatest depth [m]', 2.0_wp*speed/frequency, deepest, 1.0e-4_wp)
      ! The duration is a whole number of steps of 0.002/w0.
      call table%expect_relative('elastic: duration [s]', pi/frequency, touched, 1.5e-3_wp)
      call table%expect_relative('elastic: restitution', 1.0_wp, separation_speed(simulation)/(2.0_wp*speed), 1.0e-4_wp)
   end subroutine collide_elastically

   !> Compare mean and worst of 64 phases of first touch, for two time steps.
   subroutine compare(table, ratio)
      type(table_t), intent(inout) :: table
      real(wp), intent(in) :: ratio
      real(wp) :: mean(2), worst(2)
      character(len=:), allocatable :: name

      name = 'zeta '//to_text(ratio, 3)//', w0 dt 0.03, 64 phases: '
      call over_phases(table, ratio, 0.03_wp, mean(1), worst(1))
      call over_phases(table, ratio, 0.06_wp, mean(2), worst(2))
      call table%expect_absolute(name//'mean restitution', restitution(ratio), restitution(ratio) + mean(1), 1.0e-3_wp)
      call table%expect_absolute(name//'worst error', 0.0_wp, worst(1), 5.0e-3_wp)
      call table%expect_least(name//'order of the mean', 1.5_wp, log(abs(mean(2)/mean(1)))/log(2.0_wp))
      call table%expect_least(name//'order of the worst', 0.8_wp, log(worst(2)/worst(1))/log(2.0_wp))
   end subroutine compare

   !> Find the mean and the worst error of the restitution.
   subroutine over_phases(table, ratio, step, mean, worst)
      type(table_t), intent(inout) :: table
      real(wp), intent(in) :: ratio, step
      real(wp), intent(out) :: mean, worst
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      real(wp) :: miss
      integer :: phase
      integer, parameter :: n_phases = 64

      mean = 0.0_wp
      worst = 0.0_wp
      do phase = 1, n_phases
         call approach('damping_from_touch = .false. damping_coefficient = '//to_text(2.0_wp*ratio, 17), &
                       step/frequency, (real(phase, wp) - 0.5_wp)/real(n_phases, wp), simulation, error)
         if (.not. allocated(error)) call steps(simulation, nint(5.0_wp/step), error)
         call table%note_error(error)
         if (allocated(error)) return
         miss = separation_speed(simulation)/(2.0_wp*speed) - restitution(ratio)
         mean = mean + miss/real(n_phases, wp)
         worst = max(worst, abs(miss))
      end do
   end subroutine over_phases

   !> Start a square at its static depth on a floor, m g/k with k = E w/l; it must stay there.
   subroutine rest_on_floor(table)
      type(table_t), intent(inout) :: table
      type(body_list_t) :: list
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      real(wp) :: length, sag
      ! The floor is so thick that l = 4 r1 r2/(r1 + r2) is nearly that of a half space, 4 r1 = 2 w.
      real(wp), parameter :: thickness = 100.0_wp

      length = 2.0_wp*width*thickness/(width + thickness)
      sag = mass*gravity*length/(young*width)
      call list%append(block_at(0.0_wp, 0.5_wp*width, width, width, 0.0_wp))
      call list%append(block_at(0.0_wp, -0.5_wp*thickness, 2.0_wp*width, thickness, 0.0_wp), fixed=.true.)
      call begin('&forces damping_coefficient = 1'//area_law//' /'//integrate_text(1.0e-5_wp), list, simulation, error)
      if (.not. allocated(error)) call steps(simulation, 4000, error)
      call table%note_error(error)
      if (allocated(error)) return
      call table%expect_relative('a square comes to rest on a thick floor: depth [m]', sag, &
                                 0.5_wp*width - simulation%bodies%position(2, 1), 1.0e-4_wp)
   end subroutine rest_on_floor

   !> Two squares that will touch after a fraction of a step.
   subroutine approach(forces, dt, phase, simulation, error)
      character(len=*), intent(in) :: forces
      real(wp), intent(in) :: dt, phase
      type(simulation_t), intent(out) :: simulation
      type(error_t), allocatable, intent(inout) :: error
      type(body_list_t) :: list
      real(wp) :: gap

      gap = 2.0_wp*speed*dt*phase
      call list%append(block_at(-0.5_wp*(width + gap), 0.0_wp, width, width, 0.0_wp), velocity=[speed, 0.0_wp])
      call list%append(block_at(0.5_wp*(width + gap), 0.0_wp, width, width, 0.0_wp), velocity=[-speed, 0.0_wp])
      call begin('&forces gravity = 0, 0 friction = ''none'' law = ''area'' '//forces//' /'//integrate_text(dt), &
                 list, simulation, error)
   end subroutine approach

   pure real(wp) function separation_speed(simulation)
      type(simulation_t), intent(in) :: simulation

      separation_speed = simulation%bodies%velocity(1, 2) - simulation%bodies%velocity(1, 1)
   end function separation_speed

   !> Restitution of a damped spring that is released when its force vanishes
   pure real(wp) function restitution(ratio)
      real(wp), intent(in) :: ratio
      real(wp) :: s

      s = sqrt(1.0_wp - ratio**2)
      restitution = exp(-(ratio/s)*(pi - atan2(2.0_wp*ratio*s, 1.0_wp - 2.0_wp*ratio**2)))
   end function restitution

end module s32_flat_impact
