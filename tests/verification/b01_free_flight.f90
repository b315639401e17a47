!> Benchmark B1: a body in free flight, for which velocity Verlet is exact up to rounding.
!>
!> x = x0 + v0 t - g t^2/2 and phi = w0 t. The errors of a million plain additions are biased, because the same numbers
!> are added again and again, and grow with the distance from the origin. The error of a compensated sum is that of its
!> last addition only.
module b01_free_flight
   use outlines, only: gravity
   use trial, only: begin, block_at, steps
   use verification_table, only: table_t
   use polydem_body_list, only: body_list_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: wp
   use polydem_simulation, only: simulation_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: run_free_flight

   real(wp), parameter :: velocity(2) = [1.5_wp, 4.0_wp]
   real(wp), parameter :: spin = 2.0_wp

contains

   !> Fly for one second, near the origin and far from it.
   subroutine run_free_flight(table, thorough)
      !> Table to fill
      type(table_t), intent(inout) :: table
      !> Whether to take a million steps instead of 1e5
      logical, intent(in) :: thorough
      integer :: n_steps

      n_steps = merge(1000000, 100000, thorough)
      call table%begin('B1', 'free flight for 1 s in '//trim(merge('1e6 steps', '1e5 steps', thorough)))
      call fly(table, n_steps, 'plain', 0.0_wp, 1.0e-10_wp, 1.0e-10_wp)
      ! The spacing of numbers near 1e4 is 1.8e-12: a drift of half of it per step would be 9e-7 after 1e6 steps.
      call fly(table, n_steps, 'plain', 1.0e4_wp, 1.0e-6_wp, 1.0e-10_wp)
      call fly(table, n_steps, 'compensated', 1.0e4_wp, 2.0e-12_wp, 1.0e-13_wp)
   end subroutine run_free_flight

   !> Fly from (offset, 0). One tolerance is for x, which is as large as the offset, the other for all other quantities,
   !> which are of order one.
   subroutine fly(table, n_steps, accumulation, offset, tolerance, own_tolerance)
      type(table_t), intent(inout) :: table
      integer, intent(in) :: n_steps
      character(len=*), intent(in) :: accumulation
      real(wp), intent(in) :: offset, tolerance, own_tolerance
      character(len=:), allocatable :: name
      type(body_list_t) :: list
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error

      call list%append(block_at(offset, 0.0_wp, 0.02_wp, 0.01_wp, 0.3_wp), velocity=velocity, angular_velocity=spin)
      call begin('&integrate duration = 1 accumulation = '''//accumulation//''' dt = '// &
                 to_text(1.0_wp/real(n_steps, wp), 17)//' / &output energy_balance = .false. /', list, simulation, &
                 error)
      if (.not. allocated(error)) call steps(simulation, n_steps, error)
      call table%note_error(error)
      if (allocated(error)) return
      name = accumulation//' sums, '//trim(merge('1e4 m away   ', 'at the origin', offset > 0.0_wp))//': '
      associate (bodies => simulation%bodies)
         call table%expect_absolute(name//'x after 1 s [m]', offset + velocity(1), bodies%position(1, 1), tolerance)
         call table%expect_absolute(name//'y [m]', velocity(2) - 0.5_wp*gravity, bodies%position(2, 1), own_tolerance)
         call table%expect_absolute(name//'vertical velocity [m/s]', velocity(2) - gravity, bodies%velocity(2, 1), &
                                    own_tolerance)
         call table%expect_absolute(name//'angle [rad]', spin, bodies%angle(1), own_tolerance)
      end associate
   end subroutine fly

end module b01_free_flight
