!> Benchmark B9: a block slides on a level floor until it stops.
!>
!> The distance is v^2/(2 mu g), the time v/(mu g). With friction by a spring the block then oscillates with the
!> frequency sqrt(k_t/m_t) and comes to rest. Exact friction stops the base at once. The block tilts while it slides,
!> and afterwards rocks until damping of tilts stops it. Without that damping it rocks for ever (shown).
module b09_stopping
   use b08_incline, only: put_on_slope
   use outlines, only: gravity
   use trial, only: steps
   use verification_table, only: table_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: wp
   use polydem_simulation, only: simulation_t
   implicit none
   private
   public :: run_stopping

contains

   !> Run with friction by a spring and with exact friction.
   subroutine run_stopping(table)
      !> Table to fill
      type(table_t), intent(inout) :: table

      call table%begin('B9', 'a block slides on a level floor until it stops')
      call slide_to_rest(table, 'spring', 'tilt_damping = 0', .true.)
      call slide_to_rest(table, 'exact', 'friction = ''exact'' tilt_damping = 1', .true.)
      call slide_to_rest(table, 'exact, tilts undamped', 'friction = ''exact'' tilt_damping = 0', .false.)
   end subroutine run_stopping

   !> Slide from 0.5 m/s to rest.
   subroutine slide_to_rest(table, name, forces, must_rest)
      type(table_t), intent(inout) :: table
      character(len=*), intent(in) :: name, forces
      logical, intent(in) :: must_rest
      real(wp), parameter :: mu = 0.3_wp, speed = 0.5_wp
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      real(wp) :: start, travelled
      integer :: k

      call put_on_slope(0.0_wp, speed, [0.02_wp, 0.01_wp], mu, forces, simulation, error)
      if (.not. allocated(error)) start = simulation%bodies%position(1, 2)
      do k = 1, 40000
         if (.not. allocated(error)) call steps(simulation, 1, error)
         if (allocated(error)) exit
         if (simulation%bodies%velocity(1, 2) <= 0.0_wp) exit
      end do
      call table%note_error(error)
      if (allocated(error)) return
      travelled = simulation%bodies%position(1, 2) - start
      call table%expect_relative(name//': distance [m]', speed**2/(2.0_wp*mu*gravity), travelled, 1.0e-3_wp)
      call table%expect_relative(name//': time [s]', speed/(mu*gravity), real(k, wp)*simulation%dt, 1.0e-3_wp)
      call steps(simulation, 40000, error)
      call table%note_error(error)
      if (must_rest) then
         call table%expect_absolute(name//': speed 0.4 s after it stopped [m/s]', 0.0_wp, &
                                    norm2(simulation%bodies%velocity(:, 2)), 1.0e-12_wp)
      else
         call table%show(name//': speed 0.4 s after it stopped [m/s]', norm2(simulation%bodies%velocity(:, 2)))
      end if
   end subroutine slide_to_rest

end module b09_stopping
