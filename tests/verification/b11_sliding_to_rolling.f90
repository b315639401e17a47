!> Benchmark B11: a 64-gon first slides and then rolls.
!>
!> Friction mu N slows the centre and turns the body, m du = -mu N dt and I dw = R mu N dt, until u = R w. Then u =
!> u0/(1 + I/(m R^2)), after the time (u0 - u)/(mu g), for any friction law. For a polygon with n corners this holds up
!> to the variation of its radius by the factor cos(pi/n), 0.9988 for 64.
module b11_sliding_to_rolling
   use outlines, only: gravity, inertia_ratio, integrate_text, pi, regular_polygon
   use trial, only: area_law, begin, block_at, steps
   use verification_table, only: table_t
   use polydem_body_list, only: body_list_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: wp
   use polydem_simulation, only: simulation_t
   implicit none
   private
   public :: run_sliding_to_rolling

contains

   !> Slide from 1 m/s until the body rolls.
   subroutine run_sliding_to_rolling(table)
      !> Table to fill
      type(table_t), intent(inout) :: table
      integer, parameter :: corners = 64
      real(wp), parameter :: radius = 0.01_wp, speed = 1.0_wp, mu = 0.3_wp, dt = 5.0e-6_wp
      type(body_list_t) :: list
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      real(wp) :: expected
      integer :: k

      call table%begin('B11', 'a 64-gon slides and then rolls')
      call list%append(regular_polygon(corners, radius, -0.1_wp, radius*cos(pi/64.0_wp), pi/64.0_wp - 0.5_wp*pi), &
                       velocity=[speed, 0.0_wp])
      call list%append(block_at(0.0_wp, -0.05_wp, 1.0_wp, 0.1_wp, 0.0_wp), fixed=.true.)
      call begin('&forces friction_coefficient = 0.3 damping_coefficient = 1'//area_law//' /'// &
                 integrate_text(dt), list, simulation, error)
      do k = 1, 100000
         if (.not. allocated(error)) call steps(simulation, 1, error)
         if (allocated(error)) exit
         if (simulation%bodies%velocity(1, 1) + radius*simulation%bodies%angular_velocity(1) <= 0.0_wp) exit
      end do
      call table%note_error(error)
      if (allocated(error)) return
      expected = speed/(1.0_wp + inertia_ratio(corners))
      call table%expect_relative('speed when it begins to roll [m/s]', expected, simulation%bodies%velocity(1, 1), &
                                 0.01_wp)
      call table%expect_relative('time until then [s]', (speed - expected)/(mu*gravity), real(k, wp)*dt, 0.01_wp)
   end subroutine run_sliding_to_rolling

end module b11_sliding_to_rolling
