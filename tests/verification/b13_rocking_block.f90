!> Benchmark B13: a block rocks from corner to corner (G.W. Housner, Bull. Seismol. Soc. Am. 53 (1963) 403).
!>
!> With the angle alpha = atan(b/h) and the half diagonal R, a block that is tilted by t turns about its corner with J
!> t'' = -m g R sin(alpha - t), J = (4/3) m R^2. From rest at t0 it takes the time int dt/w, w^2 = 2 p^2 (cos(alpha -
!> t0) - cos(alpha - t)), p^2 = 3 g/(4 R), to fall flat. The impact conserves the angular momentum about the other
!> corner: w+/w- = 1 - 1.5 sin^2(alpha). The potential m g R (cos(alpha - t) - cos(alpha)) of the next greatest tilt is
!> that of the first one times the square of this ratio.
!>
!> This theory assumes that the impact acts on the other corner alone. So the block stands on two supports that reach
!> under it by a hundredth of its width. On a plane the force of the soft face passes from one corner to the other
!> during the impact, at any stiffness, and much less energy is lost (shown). The damping is so strong that an impact on
!> a support is plastic. The block pivots about a point above a support.
module b13_rocking_block
   use outlines, only: gravity, integrate_text
   use trial, only: area_law, begin, block_at, steps
   use verification_table, only: table_t
   use polydem_body_list, only: body_list_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: wp
   use polydem_simulation, only: simulation_t, time_of
   use polydem_strings, only: to_text
   implicit none
   private
   public :: run_rocking_block

   real(wp), parameter :: width = 0.02_wp
   real(wp), parameter :: height = 0.1_wp
   real(wp), parameter :: alpha = atan(width/height)
   real(wp), parameter :: half_diagonal = 0.5_wp*sqrt(width**2 + height**2)
   real(wp), parameter :: start = 0.5_wp*alpha

contains

   !> Fall from half the toppling angle, on a plane and on two supports.
   subroutine run_rocking_block(table, thorough)
      !> Table to fill
      type(table_t), intent(inout) :: table
      !> Whether to run what is only shown as well: another stiffness, and a plane
      logical, intent(in) :: thorough

      call table%begin('B13', 'a block rocks: h = 10 cm, b = 2 cm, from half the toppling angle')
      if (thorough) call rock(table, 'on a plane, E = 1e10: ', 0.5_wp*width, with_area(1.0e10_wp, 1.0_wp), .false.)
      if (thorough) call rock(table, 'on supports, E = 1e9: ', 0.01_wp*width, with_area(1.0e9_wp, 150.0_wp), &
                              .false.)
      call rock(table, 'on supports, E = 1e10: ', 0.01_wp*width, with_area(1.0e10_wp, 150.0_wp), .true.)
      if (thorough) call rock(table, 'on supports, default law, E = 1e7: ', 0.01_wp*width, with_default(1.0e7_wp), &
                              .false.)
      call rock(table, 'on supports, default law, E = 1e8: ', 0.01_wp*width, with_default(1.0e8_wp), .true.)
      if (.not. thorough) return
      call rock(table, 'on a plane, default law, E = 1e8: ', 0.5_wp*width, with_default(1.0e8_wp), .false.)
      call rock(table, 'on a plane, default law, E = 1e9: ', 0.5_wp*width, with_default(1.0e9_wp), .false.)
   end subroutine run_rocking_block

   !> Compare one fall. `under` is the length of a support under the block [m].
   subroutine rock(table, name, under, forces, must_hold)
      type(table_t), intent(inout) :: table
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: under
      !> Groups of the namelist
      character(len=*), intent(in) :: forces
      logical, intent(in) :: must_hold
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      real(wp) :: time, tilt, ratio
      logical :: has_fallen

      call put_on_corner(under, forces, simulation, error)
      time = 0.0_wp
      tilt = 0.0_wp
      has_fallen = .false.
      do while (time < 1.0_wp)
         if (.not. allocated(error)) call steps(simulation, 1, error)
         if (allocated(error)) exit
         ! The block starts tilted to the left, with the body angle 0. It is flat at -start and tilted right beyond.
         associate (to_the_right => -start - simulation%bodies%angle(1))
            if (.not. has_fallen) time = time_of(simulation)
            if (has_fallen .and. to_the_right < 0.0_wp) exit
            has_fallen = to_the_right >= 0.0_wp
            tilt = max(tilt, to_the_right)
         end associate
      end do
      call table%note_error(error)
      if (allocated(error)) return
      ratio = sqrt((cos(alpha - tilt) - cos(alpha))/(cos(alpha - start) - cos(alpha)))
      if (must_hold) then
         call table%expect_relative(name//'a quarter of the first period [s]', time_to_fall(), time, 0.01_wp)
         call table%expect_relative(name//'rate after over before the impact', 1.0_wp - 1.5_wp*sin(alpha)**2, ratio, &
                                    0.01_wp)
      else
         call table%show(name//'a quarter of the first period [s]', time)
         call table%show(name//'rate after over before the impact', ratio)
      end if
   end subroutine rock

   !> Area law with a damping coefficient
   function with_area(young, damping) result(text)
      real(wp), intent(in) :: young, damping
      character(len=:), allocatable :: text

      text = '&forces friction_coefficient = 5 damping_coefficient = '//to_text(damping)//area_law//' stiffness = '// &
             to_text(young)//' /'//integrate_text(1.0e-6_wp*sqrt(1.0e10_wp/young))
   end function with_area

   !> Default law, with a restitution near that of a plastic impact
   function with_default(young) result(text)
      real(wp), intent(in) :: young
      character(len=:), allocatable :: text

      text = '&forces friction_coefficient = 5 restitution = 0.01 stiffness = '//to_text(young)// &
             ' / &integrate duration = 1000 speed = 0.5 / &output energy_balance = .false. /'
   end function with_default

   !> A block that stands on its left corner, tilted to the left.
   subroutine put_on_corner(under, forces, simulation, error)
      real(wp), intent(in) :: under
      character(len=*), intent(in) :: forces
      type(simulation_t), intent(out) :: simulation
      type(error_t), allocatable, intent(inout) :: error
      type(body_list_t) :: list

      call list%append(block_at(half_diagonal*sin(alpha - start), half_diagonal*cos(alpha - start), width, height, &
                       start))
      call list%append(block_at(under - 0.5_wp*width, -0.05_wp, width, 0.1_wp, 0.0_wp), fixed=.true.)
      call list%append(block_at(1.5_wp*width - under, -0.05_wp, width, 0.1_wp, 0.0_wp), fixed=.true.)
      call begin(forces, list, simulation, error)
   end subroutine put_on_corner

   !> Time from rest to flat [s]. The substitution t = t0 (1 - u^2) removes the singularity; then the midpoint rule.
   pure real(wp) function time_to_fall()
      real(wp) :: u, tilt
      integer :: k
      integer, parameter :: n = 20000

      time_to_fall = 0.0_wp
      do k = 1, n
         u = (real(k, wp) - 0.5_wp)/real(n, wp)
         tilt = start*(1.0_wp - u**2)
         time_to_fall = time_to_fall + 2.0_wp*start*u/real(n, wp) &
            /sqrt(1.5_wp*gravity/half_diagonal*(cos(alpha - start) - cos(alpha - tilt)))
      end do
   end function time_to_fall

end module b13_rocking_block
