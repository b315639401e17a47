!> Normal impact of a right-angled corner on a floor.
!>
!> At depth d the overlap is a triangle with area A = d^2, whose centroid is 2 d/3 above the corner, so F = E d^2/l with
!> l = 4 r1 r2/(r1 + r2), r1 = w/sqrt(2) - 2 d/3, and r2 = h/2 - d/3 for a floor of thickness h. With the constant l of
!> d = 0, d_max = (3 m v^2 l/(2 E))^(1/3) and the duration is 2 I d_max/v with I = int_0^1 du/sqrt(1 - u^3) = 1.402182.
!> With the variable l, both follow from the equation of motion, which is integrated here with such small steps that its
!> error is negligible.
module s33_corner_impact
   use outlines, only: integrate_text, pi
   use trial, only: begin, block_at
   use verification_table, only: table_t
   use polydem_body_list, only: body_list_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: wp
   use polydem_simulation, only: simulation_t
   use polydem_time_step, only: advance
   implicit none
   private
   public :: run_corner_impact

   real(wp), parameter :: width = 0.01_wp
   real(wp), parameter :: thickness = 10.0_wp
   real(wp), parameter :: mass = 2500.0_wp*width**2
   real(wp), parameter :: young = 1.0e7_wp
   real(wp), parameter :: speed = 0.1_wp
   !> Half the diagonal: distance of the corner from the centre [m]
   real(wp), parameter :: reach = width*sqrt(0.5_wp)
   real(wp), parameter :: dt = 1.0e-6_wp

contains

   !> Run one elastic impact without gravity.
   subroutine run_corner_impact(table)
      !> Table to fill
      type(table_t), intent(inout) :: table
      type(body_list_t) :: list
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      real(wp) :: deepest, duration, length, expected_depth, expected_duration
      integer :: k

      call table%begin('3.3', 'normal impact of the corner of a square on a thick floor, elastic')
      call list%append(block_at(0.0_wp, reach + 0.5_wp*speed*dt, width, width, 0.25_wp*pi), velocity=[0.0_wp, -speed])
      call list%append(block_at(0.0_wp, -0.5_wp*thickness, 4.0_wp*width, thickness, 0.0_wp), fixed=.true.)
      call begin('&forces gravity = 0, 0 friction = ''none'' damping = ''none'' law = ''area'' /'//integrate_text(dt), &
                 list, simulation, error)
      deepest = 0.0_wp
      duration = 0.0_wp
      do k = 1, 10000
         if (.not. allocated(error)) call advance(simulation, error)
         if (simulation%contacts%n == 0) cycle
         deepest = max(deepest, reach - simulation%bodies%position(2, 1))
         duration = duration + dt
      end do
      call table%note_error(error)
      if (allocated(error)) return

      length = 4.0_wp*reach*0.5_wp*thickness/(reach + 0.5_wp*thickness)
      expected_depth = (1.5_wp*mass*speed**2*length/young)**(1.0_wp/3.0_wp)
      expected_duration = 2.0_wp*1.402182_wp*expected_depth/speed
      call table%expect_relative('depth [m], l of first touch', expected_depth, deepest, 0.03_wp)
      call table%expect_relative('duration [s], l of first touch', expected_duration, duration, 0.03_wp)
      call integrate(expected_depth, expected_duration)
      call table%expect_relative('depth [m], l as it is', expected_depth, deepest, 1.0e-4_wp)
      call table%expect_relative('duration [s], l as it is', expected_duration, duration, 1.0e-3_wp)
      call table%expect_relative('restitution', 1.0_wp, simulation%bodies%velocity(2, 1)/speed, 1.0e-4_wp)
      call table%expect_absolute('spin over speed/width: a symmetric corner does not turn', 0.0_wp, &
                                 simulation%bodies%angular_velocity(1)*width/speed, 1.0e-9_wp)
   end subroutine run_corner_impact

   !> Integrate m d'' = -F(d) up to the deepest point, with a thousandth of the step of the simulation, for depth and
   !> duration; the way back is the mirror image.
   pure subroutine integrate(depth, duration)
      real(wp), intent(out) :: depth, duration
      real(wp), parameter :: h = 1.0e-3_wp*dt
      real(wp) :: v

      depth = 0.0_wp
      v = speed
      duration = 0.0_wp
      do
         v = v - 0.5_wp*h*force(depth)/mass
         if (v <= 0.0_wp) exit
         depth = depth + h*v
         v = v - 0.5_wp*h*force(depth)/mass
         duration = duration + 2.0_wp*h
      end do
   end subroutine integrate

   pure real(wp) function force(depth)
      real(wp), intent(in) :: depth
      real(wp) :: r1, r2

      r1 = reach - 2.0_wp*depth/3.0_wp
      r2 = 0.5_wp*thickness - depth/3.0_wp
      force = young*depth**2*(r1 + r2)/(4.0_wp*r1*r2)
   end function force

end module s33_corner_impact
