!> Benchmark B9: a block slides on a level floor until it stops.
!>
!> Distance v^2/(2 mu g), time v/(mu g). With a spring for friction it then swings with the frequency sqrt(k_t/m_t)
!> about its place and comes to rest.
module b09_stopping
   use b08_incline, only: put_on_slope
   use outlines, only: gravity
   use polydem_errors, only: error_t
   use polydem_kinds, only: wp
   use polydem_simulation, only: simulation_t
   use trial, only: steps
   use verification_table, only: table_t
   implicit none
   private
   public :: run_stopping

contains

   !> Slide from 0.5 m/s to rest.
   subroutine run_stopping(table)
      !> Table to fill
      type(table_t), intent(inout) :: table
      real(wp), parameter :: mu = 0.3_wp, speed = 0.5_wp
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      real(wp) :: start, travelled
      integer :: k

      call table%begin('B9', 'a block slides on a level floor until it stops')
      call put_on_slope(0.0_wp, speed, [0.02_wp, 0.01_wp], mu, simulation, error)
      if (.not. allocated(error)) start = simulation%bodies%position(1, 2)
      do k = 1, 40000
         if (.not. allocated(error)) call steps(simulation, 1, error)
         if (allocated(error)) exit
         if (simulation%bodies%velocity(1, 2) <= 0.0_wp) exit
      end do
      call table%note_error(error)
      if (allocated(error)) return
      travelled = simulation%bodies%position(1, 2) - start
      call table%expect_relative('distance [m]', speed**2/(2.0_wp*mu*gravity), travelled, 1.0e-3_wp)
      call table%expect_relative('time [s]', speed/(mu*gravity), real(k, wp)*simulation%dt, 1.0e-3_wp)
      call steps(simulation, 40000, error)
      call table%note_error(error)
      call table%expect_absolute('speed 0.4 s after it stopped [m/s]', 0.0_wp, norm2(simulation%bodies%velocity(:, &
                                 2)), &
                                 1.0e-12_wp)
   end subroutine run_stopping

end module b09_stopping
