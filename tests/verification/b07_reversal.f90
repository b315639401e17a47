!> Benchmark B7: an elastic gas returns to its start after all velocities are reversed.
!>
!> Velocity Verlet is symmetric in time, and without damping and friction the forces depend on positions alone. So only
!> rounding errors, which collisions amplify, separate the way back from the way out.
module b07_reversal
   use trial, only: steps
   use verification_table, only: table_t
   use polydem_bodies, only: bodies_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: wp
   use polydem_read_settings, only: read_settings_text
   use polydem_settings, only: settings_t
   use polydem_simulation, only: simulation_t
   use polydem_start, only: new_simulation
   implicit none
   private
   public :: run_reversal

contains

   !> Run nine grains in a box with each law.
   subroutine run_reversal(table)
      !> Table to fill
      type(table_t), intent(inout) :: table

      call table%begin('B7', 'nine grains of 1 cm in a box there and back, 5000 steps of 1e-5 s each')
      call turn_back(table, 'area')
      call turn_back(table, 'conservative')
   end subroutine run_reversal

   subroutine turn_back(table, law)
      type(table_t), intent(inout) :: table
      character(len=*), intent(in) :: law
      integer, parameter :: n = 5000
      character(len=1) :: no_overrides(0)
      type(settings_t) :: settings
      type(simulation_t) :: simulation
      type(bodies_t) :: start
      type(error_t), allocatable :: error
      real(wp) :: turned

      call read_settings_text('gas.nml', '&scene name = ''gas'' bodies = 9 solid_fraction = 0.3 speed = 0.4 '// &
                              'spin = 10 / &forces gravity = 0, 0 damping = ''none'' friction = ''none'' law = '''// &
                              law//''' / &integrate dt = 1e-5 duration = 1000 /', no_overrides, settings, error)
      if (.not. allocated(error)) call new_simulation(settings, simulation, error)
      if (.not. allocated(error)) start = simulation%bodies
      if (.not. allocated(error)) call steps(simulation, n, error)
      if (.not. allocated(error)) then
         turned = maxval(abs(simulation%bodies%velocity - start%velocity))
         simulation%bodies%velocity = -simulation%bodies%velocity
         simulation%bodies%angular_velocity = -simulation%bodies%angular_velocity
         ! The velocities in mid-step are not reversed: no body has coasted with the new velocities.
         call simulation%motion%flight%forget_velocities()
         call steps(simulation, n, error)
      end if
      call table%note_error(error)
      if (allocated(error)) return
      call table%show(law//' law: greatest change of a velocity on the way [m/s]', turned)
      call table%expect_absolute(law//' law: greatest distance from the start [m]', 0.0_wp, &
                                 maxval(abs(simulation%bodies%position - start%position)), 1.0e-9_wp)
      call table%expect_absolute(law//' law: greatest difference of a velocity [m/s]', 0.0_wp, &
                                 maxval(abs(simulation%bodies%velocity + start%velocity)), 1.0e-9_wp)
   end subroutine turn_back

end module b07_reversal
