!> Benchmark B31: bodies of two materials.
!>
!> A block slides down a slope with the friction coefficient of the pair, and rebounds with its restitution: the smaller
!> ones of the two materials, or those of a group &contact_pair. A ladder leans against a wall, with other friction
!> there than on the floor. Foot and top slip when, with length L and width w of the ladder at an angle a to the floor,
!> tan a = (1 - mu_f mu_w)/(2 mu_f + (w/L) (1 + mu_f mu_w)): the forces of both contacts are at their limits, and their
!> moments about the centre cancel. For w = 0 this is the ladder of textbooks.
module b31_materials
   use outlines, only: gravity, pi
   use trial, only: begin_scene, steps
   use verification_table, only: table_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: wp
   use polydem_simulation, only: simulation_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: run_materials

   !> Materials of a block and of a floor, and a pair of their own
   character(len=*), parameter :: materials = &
      '&material name = ''block'' friction_coefficient = 0.4 restitution = 0.3 stiffness = 4e6 / '// &
      '&material name = ''floor'' friction_coefficient = 0.2 restitution = 0.8 stiffness = 1.2e7 / '
   character(len=*), parameter :: pair = '&contact_pair name = ''p'' materials = ''block'', ''floor'' '// &
      'friction_coefficient = 0.3 restitution = 0.6 stiffness = 2e6 / '

contains

   !> Slope, impact, depth, ladder.
   subroutine run_materials(table)
      !> Table to fill
      type(table_t), intent(inout) :: table

      call table%begin('B31', 'two materials')
      call slide(table, 'the smaller mu', materials, 0.2_wp)
      call slide(table, 'mu of the pair', materials//pair, 0.3_wp)
      call rebound(table, 'the smaller restitution', materials, 0.3_wp)
      call rebound(table, 'restitution of the pair', materials//pair, 0.6_wp)
      call sink_in(table, 'harmonic mean of the stiffness', materials, 6.0e6_wp)
      call sink_in(table, 'stiffness of the pair', materials//pair, 2.0e6_wp)
      call lean(table, 0.4_wp, 0.2_wp)
      call lean(table, 0.2_wp, 0.4_wp)
   end subroutine run_materials

   !> A block on a floor, with gravity in some direction
   function block_on_floor(groups, direction, velocity, forces) result(text)
      !> Materials
      character(len=*), intent(in) :: groups
      !> Acceleration [m/s2]; velocity of the block [m/s]
      real(wp), intent(in) :: direction(2), velocity(2)
      !> More entries of &forces
      character(len=*), intent(in) :: forces
      character(len=:), allocatable :: text

      text = groups//'&scene wall_material = ''floor'' material = ''block'' / '// &
         '&wall name = ''floor'' outline = ''rectangle'' low = -0.1, -0.1 high = 5, 0 / '// &
         '&grains name = ''block'' region = ''at'' at = 0, 0.0051 shape = ''rectangle'' width = 0.02 height = 0.01 '// &
         'velocity = '//to_text(velocity(1), 8)//', '//to_text(velocity(2), 8)//' / '// &
         '&forces gravity = '//to_text(direction(1), 17)//', '//to_text(direction(2), 17)//' '//forces//' / '// &
         '&integrate duration = 100 /'
   end function block_on_floor

   !> Compare the acceleration down a slope with Coulomb's.
   subroutine slide(table, name, groups, mu)
      type(table_t), intent(inout) :: table
      character(len=*), intent(in) :: name, groups
      real(wp), intent(in) :: mu
      real(wp), parameter :: slope = 0.5_wp
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      real(wp) :: early, duration
      integer :: n

      call begin_scene(block_on_floor(groups, gravity*[sin(slope), -cos(slope)], [0.0_wp, 0.0_wp], ''), simulation, &
                       error)
      n = 0
      if (.not. allocated(error)) n = nint(0.1_wp/simulation%dt)
      if (.not. allocated(error)) call steps(simulation, n, error)
      if (.not. allocated(error)) early = simulation%bodies%velocity(1, free_body(simulation))
      if (.not. allocated(error)) call steps(simulation, n, error)
      call table%note_error(error)
      if (allocated(error)) return
      duration = real(n, wp)*simulation%dt
      call table%expect_relative(name//': acceleration down a slope [m/s2]', gravity*(sin(slope) - mu*cos(slope)), &
                                 (simulation%bodies%velocity(1, free_body(simulation)) - early)/duration, 1.0e-3_wp)
   end subroutine slide

   !> Compare the rebound of a block that falls flat on the floor.
   subroutine rebound(table, name, groups, restitution)
      type(table_t), intent(inout) :: table
      character(len=*), intent(in) :: name, groups
      real(wp), intent(in) :: restitution
      real(wp), parameter :: speed = 0.01_wp
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error

      call begin_scene(block_on_floor(groups, [0.0_wp, 0.0_wp], [0.0_wp, -speed], ''), simulation, error)
      if (.not. allocated(error)) call steps(simulation, nint(0.1_wp/simulation%dt), error)
      call table%note_error(error)
      if (allocated(error)) return
      call table%expect_relative(name//': rebound over impact', restitution, &
                                 simulation%bodies%velocity(2, free_body(simulation))/speed, 0.01_wp)
   end subroutine rebound

   !> Compare the depth of a block at rest with that of one material.
   subroutine sink_in(table, name, groups, stiffness)
      type(table_t), intent(inout) :: table
      character(len=*), intent(in) :: name, groups
      real(wp), intent(in) :: stiffness
      real(wp) :: places(2)
      character(len=*), parameter :: equal = '&material name = ''block'' / &material name = ''floor'' / '

      call rest_at(groups, '', places(1))
      call rest_at(equal, 'stiffness = '//to_text(stiffness, 8), places(2))
      call table%expect_relative(name//': depth over that of one material', 1.0_wp, &
                                 (0.005_wp - places(1))/(0.005_wp - places(2)), 1.0e-6_wp)

   contains

      !> Height of the block at rest
      subroutine rest_at(text, forces, place)
         character(len=*), intent(in) :: text, forces
         real(wp), intent(out) :: place
         type(simulation_t) :: simulation
         type(error_t), allocatable :: error

         place = 0.0_wp
         call begin_scene(block_on_floor(text, [0.0_wp, -gravity], [0.0_wp, 0.0_wp], forces), simulation, error)
         if (.not. allocated(error)) call steps(simulation, nint(0.5_wp/simulation%dt), error)
         call table%note_error(error)
         if (.not. allocated(error)) place = simulation%bodies%position(2, free_body(simulation))
      end subroutine rest_at

   end subroutine sink_in

   !> A ladder stands above the critical angle and slides below it. A drag loads the contacts slowly, since those of a
   !> ladder that is let go swing beyond their limits. Its soft corners sink in by millimetres, which changes the
   !> critical angle by more than 1 %.
   subroutine lean(table, floor_mu, wall_mu)
      type(table_t), intent(inout) :: table
      real(wp), intent(in) :: floor_mu, wall_mu
      !> Length and width of the ladder [m]
      real(wp), parameter :: length = 1.0_wp, width = 0.02_wp
      real(wp) :: critical, moved
      character(len=:), allocatable :: name

      critical = (1.0_wp - floor_mu*wall_mu)/(2.0_wp*floor_mu + width/length*(1.0_wp + floor_mu*wall_mu))
      name = 'ladder, mu '//to_text(floor_mu, 1)//' below, '//to_text(wall_mu, 1)//' above: at '
      call lean_at(1.05_wp*critical, moved)
      call table%expect_absolute(name//'1.05 critical tan a moves [m]', 0.0_wp, moved, 1.0e-6_wp)
      call lean_at(0.95_wp*critical, moved)
      call table%expect_true(name//'0.95 critical tan a slides', moved > 5.0e-3_wp)

   contains

      subroutine lean_at(tangent, moved)
         real(wp), intent(in) :: tangent
         !> Distance that the centre moves in the second second [m]
         real(wp), intent(out) :: moved
         type(simulation_t) :: simulation
         type(error_t), allocatable :: error
         real(wp) :: angle, start(2)

         angle = atan(tangent)
         call begin_scene('&material name = ''ladder'' friction_coefficient = 1 / &material name = ''floor'' '// &
            'friction_coefficient = '//to_text(floor_mu, 8)//' / &material name = ''wall'' friction_coefficient = '// &
            to_text(wall_mu, 8)//' / &wall name = ''floor'' outline = ''rectangle'' low = -0.1, -0.1 high = 2, 0 '// &
            'material = ''floor'' / &wall name = ''wall'' outline = ''rectangle'' low = -0.1, 0 high = 0, 2 '// &
            'material = ''wall'' / &grains name = ''ladder'' region = ''at'' material = ''ladder'' at = '// &
            to_text(0.5_wp*(length*cos(angle) + width*sin(angle)), 17)//', '// &
            to_text(0.5_wp*(length*sin(angle) + width*cos(angle)), 17)//' shape = ''rectangle'' width = '// &
            to_text(width, 8)//' height = '//to_text(length, 8)//' angle = '//degrees(angle)//', '//degrees(angle)// &
            ' / &forces stiffness = 1e8 drag = 20 / &integrate duration = 2 /', simulation, error)
         moved = 0.0_wp
         if (.not. allocated(error)) then
            call steps(simulation, int(simulation%n_steps)/2, error)
            start = simulation%bodies%position(:, free_body(simulation))
         end if
         if (.not. allocated(error)) call steps(simulation, int(simulation%n_steps)/2, error)
         call table%note_error(error)
         if (.not. allocated(error)) moved = norm2(simulation%bodies%position(:, free_body(simulation)) - start)
      end subroutine lean_at

      !> Turn from the vertical [degree]
      function degrees(angle) result(text)
         real(wp), intent(in) :: angle
         character(len=:), allocatable :: text

         text = to_text((0.5_wp*pi - angle)*180.0_wp/pi, 17)
      end function degrees

   end subroutine lean

   !> Slot of the only free body
   pure integer function free_body(simulation)
      type(simulation_t), intent(in) :: simulation

      free_body = int(simulation%bodies%free(1))
   end function free_body

end module b31_materials
