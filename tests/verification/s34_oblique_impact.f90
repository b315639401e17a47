!> Oblique impact with gross sliding, of a corner directly below the centre.
!>
!> If the corner slides during the whole impact, the impulse is J = (1 + e) m v_n along the normal and mu J against the
!> sliding. Then v_t' = v_t - s mu (1 + e) v_n and w' = w - s mu (1 + e) v_n m R/I, where s is the sign of the sliding
!> velocity v_t + R w. It slides to the end if |v_t + R w| > mu (1 + e) v_n beta, beta = 1 + m R^2/I: 4 for a square on
!> its corner, nearly 3 for a 64-gon. The formula holds for a rigid body. In a contact of finite duration t_c the corner
!> moves by s_t = v_t t_c, and the normal force turns the body; this error falls with the stiffness (shown at 100 E).
module s34_oblique_impact
   use outlines, only: inertia_ratio, integrate_text, pi, regular_polygon
   use trial, only: begin, block_at
   use verification_table, only: table_t
   use polydem_body_list, only: body_list_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: wp
   use polydem_simulation, only: simulation_t
   use polydem_strings, only: to_text
   use polydem_time_step, only: advance
   implicit none
   private
   public :: run_oblique_impact

   real(wp), parameter :: mu = 0.2_wp

contains

   !> Run a square and a 64-gon, at two stiffnesses.
   subroutine run_oblique_impact(table)
      !> Table to fill
      type(table_t), intent(inout) :: table

      call table%begin('3.4', 'oblique impact with gross sliding, elastic, mu = 0.2')
      call collide(table, 'square', 4, 1.0e9_wp, .false.)
      call collide(table, 'square', 4, 1.0e11_wp, .true.)
      call collide(table, '64-gon', 64, 1.0e9_wp, .false.)
      call collide(table, '64-gon', 64, 1.0e11_wp, .true.)
   end subroutine run_oblique_impact

   subroutine collide(table, name, corners, young, must_hold)
      type(table_t), intent(inout) :: table
      character(len=*), intent(in) :: name
      integer, intent(in) :: corners
      real(wp), intent(in) :: young
      logical, intent(in) :: must_hold
      !> Distance of the corner from the centre [m], velocities before [m/s], spin before [1/s]
      real(wp), parameter :: radius = 0.01_wp, normal = 0.1_wp, along = 0.5_wp, spin = 3.0_wp
      type(body_list_t) :: list
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      real(wp) :: dt, change, expected(3), got(3)
      character(len=:), allocatable :: suffix
      logical :: has_touched
      integer :: k

      dt = 2.0e-6_wp*sqrt(1.0e9_wp/young)
      call list%append(regular_polygon(corners, radius, 0.0_wp, radius + 0.5_wp*normal*dt, -0.5_wp*pi), &
                       velocity=[along, -normal], angular_velocity=spin)
      call list%append(block_at(0.0_wp, -0.5_wp, 1.0_wp, 1.0_wp, 0.0_wp), fixed=.true.)
      call begin('&forces gravity = 0, 0 damping = ''none'' law = ''area'' friction_coefficient = '//to_text(mu)// &
                 ' stiffness = '//to_text(young)//' /'//integrate_text(dt), list, simulation, error)
      has_touched = .false.
      do k = 1, 100000
         if (.not. allocated(error)) call advance(simulation, error)
         if (allocated(error)) exit
         if (has_touched .and. simulation%contacts%n == 0) exit
         has_touched = simulation%contacts%n > 0
      end do
      call table%note_error(error)
      if (allocated(error)) return
      change = 2.0_wp*mu*normal
      expected = [along - change, normal, spin - change/(radius*inertia_ratio(corners))]
      got = [simulation%bodies%velocity(:, 1), simulation%bodies%angular_velocity(1)]
      suffix = name//', E = '//to_text(young, 1)//': '
      if (must_hold) then
         call table%expect_relative(suffix//'change of v_t [m/s]', -change, got(1) - along, 0.02_wp)
         call table%expect_relative(suffix//'v_n [m/s]', expected(2), got(2), 0.02_wp)
         call table%expect_relative(suffix//'change of the spin [1/s]', expected(3) - spin, got(3) - spin, 0.02_wp)
      else
         call table%show(suffix//'relative error of the change of v_t', abs((got(1) - expected(1))/change))
         call table%show(suffix//'relative error of the change of the spin', &
                         abs((got(3) - expected(3))/(expected(3) - spin)))
      end if
   end subroutine collide

end module s34_oblique_impact
