!> Benchmark B29: accelerations that change with time, and local damping.
!>
!> A block on a level floor slips when gravity has turned by the arc tangent of the friction coefficient. A block in
!> shaken gravity moves as one on a floor that shakes, seen from the floor; both have errors of second order in dt.
!> Local damping takes energy that the balance counts.
module b29_accelerations
   use outlines, only: gravity
   use trial, only: begin_scene, steps
   use verification_table, only: table_t
   use polydem_energy_balance, only: balance_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: wp
   use polydem_simulation, only: compute_balance, simulation_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: run_accelerations

   !> A block on a floor
   character(len=*), parameter :: block = &
      '&wall name = ''floor'' outline = ''rectangle'' low = -0.1, -0.02 high = 0.1, 0 / '// &
      '&grains name = ''block'' region = ''at'' at = 0, 0.00499 shape = ''rectangle'' width = 0.02 height = 0.01 '

contains

   !> Slip, shake, damp.
   subroutine run_accelerations(table)
      !> Table to fill
      type(table_t), intent(inout) :: table

      call table%begin('B29', 'accelerations that change, local damping')
      call slip(table)
      call shake(table)
      call damp(table)
   end subroutine run_accelerations

   !> Turn gravity until the block slips. Its velocity then grows as the square of time.
   subroutine slip(table)
      type(table_t), intent(inout) :: table
      real(wp), parameter :: mu = 0.3_wp, turn = 0.08_wp*6.283185307179586_wp, slow = 2.0e-3_wp
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      real(wp) :: angle
      integer :: k

      call begin_scene(block//'/ &forces friction_coefficient = 0.3 turn_rate = 0.08 / &integrate duration = 1 /', &
                       simulation, error)
      do k = 1, merge(0, int(simulation%n_steps), allocated(error))
         call steps(simulation, 1, error)
         if (allocated(error)) exit
         if (simulation%bodies%velocity(1, simulation%bodies%free(1)) > slow) exit
      end do
      call table%note_error(error)
      if (allocated(error)) return
      angle = turn*real(k, wp)*simulation%dt - sqrt(2.0_wp*slow*turn/(gravity*sqrt(1.0_wp + mu**2)))
      call table%expect_relative('angle of gravity at which the block slips [rad]', atan(mu), angle, 5.0e-3_wp)
   end subroutine slip

   !> Place and speed of a block above a floor that shakes, and in gravity that does.
   subroutine shake(table)
      type(table_t), intent(inout) :: table
      real(wp), parameter :: depth = 1.0e-4_wp, frequency = 20.0_wp
      character(len=*), parameter :: smooth = &
         '&forces stiffness = 1e5 damping = ''none'' friction = ''none'' '
      type(simulation_t) :: floor, frame
      type(error_t), allocatable :: error
      real(wp) :: angular, difference(2)
      integer :: k, n

      angular = 6.283185307179586_wp*frequency
      do k = 1, 2
         n = 2000*k
         call begin_scene(block//'velocity = 0, '//to_text(depth*angular, 17)//' / '//smooth// &
                          '/ &motion name = ''m'' kind = ''oscillation'' amplitude = 0, 1e-4 frequency = 20 / '// &
                          '&integrate duration = 0.1 dt = '//to_text(0.1_wp/real(n, wp), 17)//' /', floor, error)
         if (.not. allocated(error)) call steps(floor, n, error)
         call table%note_error(error)
         if (allocated(error)) return
         call begin_scene(block//'/ '//smooth//'shake_frequency = 20 shake = 0, '//to_text(depth*angular**2, 17)// &
                          ' / &integrate duration = 0.1 dt = '//to_text(0.1_wp/real(n, wp), 17)//' /', frame, error)
         if (.not. allocated(error)) call steps(frame, n, error)
         call table%note_error(error)
         if (allocated(error)) return
         difference(k) = (floor%bodies%position(2, floor%bodies%free(1)) - depth*sin(angular*0.1_wp)) &
                         - frame%bodies%position(2, frame%bodies%free(1))
      end do
      call table%expect_absolute('shaken gravity and shaken floor: difference of the places [m]', 0.0_wp, &
                                 difference(2), 1.0e-8_wp)
      call table%expect_relative('its fall when dt is a half', 4.0_wp, difference(1)/difference(2), 0.1_wp)
   end subroutine shake

   !> Drop grains in a box.
   subroutine damp(table)
      type(table_t), intent(inout) :: table
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      type(balance_t) :: balance(2)
      integer :: k

      do k = 1, 2
         call begin_scene(block//'/ &forces local_damping = 0.5 damping = ''none'' friction = ''none'' '// &
                          'stiffness = 1e6 gravity = 0, -1000 / &integrate duration = 0.1 dt = '// &
                          to_text(2.0e-5_wp/real(k, wp), 17)//' /', simulation, error)
         if (.not. allocated(error)) call steps(simulation, int(simulation%n_steps), error)
         call table%note_error(error)
         if (allocated(error)) return
         call compute_balance(simulation, balance(k))
      end do
      call table%expect_absolute('local damping: energy that is missing, over its work [1]', 0.0_wp, &
                                 balance(2)%energy_residual/balance(2)%damping_work, 1.0e-2_wp)
      call table%expect_absolute('local damping: speed at the end [m/s]', 0.0_wp, &
                                 simulation%bodies%velocity(2, simulation%bodies%free(1)), 1.0e-3_wp)
   end subroutine damp

end module b29_accelerations
