!> Benchmark B28: bodies of several pieces.
!>
!> A block that is cut into columns or layers is pressed onto a floor: its force and its torque are known for both
!> elastic laws, whose characteristic lengths are those of the pieces. A key with a head hangs in a lock, two crosses
!> collide without losing energy, and an arch of three pieces rocks like the block with the same feet and inertia.
module b28_pieces
   use outlines, only: gravity
   use trial, only: begin, block_at, steps
   use verification_table, only: table_t
   use polydem_body_list, only: body_list_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, wp
   use polydem_simulation, only: simulation_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: run_pieces

   !> Width and height of the block, depth of its contact, side of the floor [m], stiffness [N/m2]
   real(wp), parameter :: width = 0.01_wp, height = 0.006_wp, depth = 1.0e-6_wp, floor_side = 0.2_wp, &
      stiffness = 1.0e7_wp
   !> Angle of a tilted block [rad]; its lower corner stays in the floor
   real(wp), parameter :: tilt = 1.0e-5_wp
   !> Thickness of lips, head and arms [m]
   real(wp), parameter :: thick = 0.003_wp

contains

   !> Cut blocks, key in a lock, colliding crosses, rocking arch.
   subroutine run_pieces(table, thorough)
      !> Table to fill
      type(table_t), intent(inout) :: table
      !> Whether to take all cuts, and the rocking arch
      logical, intent(in) :: thorough
      integer :: k

      call table%begin('B28', 'bodies of several pieces')
      do k = 1, merge(4, 2, thorough)
         call press(table, 'conservative', 2**k, .true.)
         call press(table, 'area', 2**k, .true.)
         call press(table, 'conservative', 2**k, .false.)
      end do
      call hang_key(table, 'polar')
      call hang_key(table, 'conservative')
      call collide(table)
      if (thorough) call rock(table)
   end subroutine run_pieces

   !> Append a block of n pieces, columns or layers, whose lower face has its middle at the depth below the floor.
   subroutine append_cut(list, n, columns, angle)
      type(body_list_t), intent(inout) :: list
      integer, intent(in) :: n
      !> Whether the cuts are vertical
      logical, intent(in) :: columns
      !> Angle of the block [rad]
      real(wp), intent(in) :: angle
      real(wp) :: vertices(2, 4*n), turn(2, 2), centre(2)
      integer(ip) :: piece(4*n)
      integer :: k

      do k = 1, n
         if (columns) then
            vertices(:, 4*k - 3:4*k) = block_at((k - 0.5_wp*(n + 1))*width/n, 0.5_wp*height, width/n, height, 0.0_wp)
         else
            vertices(:, 4*k - 3:4*k) = block_at(0.0_wp, (k - 0.5_wp)*height/n, width, height/n, 0.0_wp)
         end if
         piece(4*k - 3:4*k) = int(k - 1, ip)
      end do
      turn = reshape([cos(angle), sin(angle), -sin(angle), cos(angle)], [2, 2])
      centre = [0.0_wp, -depth]
      do k = 1, 4*n
         vertices(:, k) = matmul(turn, vertices(:, k)) + centre
      end do
      call list%append(vertices, piece=piece)
   end subroutine append_cut

   !> Force on a cut block that is pressed onto a floor, and torque if it is tilted
   subroutine press(table, law, n, columns)
      type(table_t), intent(inout) :: table
      character(len=*), intent(in) :: law
      !> Number of pieces
      integer, intent(in) :: n
      logical, intent(in) :: columns
      character(len=:), allocatable :: name
      real(wp) :: got(3), whole(3), tilted(3), tilted_whole(3)

      name = trim(law)//', '//to_text(n)//' '//trim(merge('columns', 'layers ', columns))
      call load_on(table, law, 1, columns, 0.0_wp, whole)
      call load_on(table, law, n, columns, 0.0_wp, got)
      if (n == 2 .and. columns) &
         call table%expect_relative(trim(law)//', whole: stiffness [N/m2]', press_force(law, 1, columns)/depth, &
                                    whole(2)/depth, 1.0e-9_wp)
      call table%expect_relative(name//': stiffness [N/m2]', press_force(law, n, columns)/depth, got(2)/depth, &
                                 1.0e-9_wp)
      call load_on(table, law, 1, columns, tilt, tilted_whole)
      call load_on(table, law, n, columns, tilt, tilted)
      call table%expect_relative(name//': stiffness against tilts, over the whole', &
                                 press_force(law, n, columns)/press_force(law, 1, columns), &
                                 tilted(3)/tilted_whole(3), 0.005_wp)
   end subroutine press

   !> Force of the elastic law on a block of n pieces at the depth: the sum over rectangles [N/m]
   pure real(wp) function press_force(law, n, columns) result(force)
      character(len=*), intent(in) :: law
      integer, intent(in) :: n
      logical, intent(in) :: columns
      real(wp) :: w, h, s, arm(2)
      integer :: k

      force = 0.0_wp
      w = merge(width/n, width, columns)
      h = merge(height, height/n, columns)
      do k = 1, merge(n, 1, columns)
         if (law == 'conservative') then
            s = sqrt(w*h)
            force = force + stiffness*w**2*depth*(s + floor_side)/(2.0_wp*s**2*floor_side)
         else
            arm(1) = 0.5_wp*(h - depth)
            arm(2) = norm2([merge((k - 0.5_wp*(n + 1))*w, 0.0_wp, columns), 0.5_wp*(floor_side - depth)])
            force = force + stiffness*w*depth*(arm(1) + arm(2))/(4.0_wp*arm(1)*arm(2))
         end if
      end do
   end function press_force

   !> Force and torque on a block of n pieces in a floor [N/m, N]
   subroutine load_on(table, law, n, columns, angle, load)
      type(table_t), intent(inout) :: table
      character(len=*), intent(in) :: law
      integer, intent(in) :: n
      logical, intent(in) :: columns
      real(wp), intent(in) :: angle
      real(wp), intent(out) :: load(3)
      type(body_list_t) :: list
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error

      load = huge(load)
      call list%append(block_at(0.0_wp, -0.5_wp*floor_side, floor_side, floor_side, 0.0_wp), fixed=.true.)
      call append_cut(list, n, columns, angle)
      call begin("&forces gravity = 0, 0 law = '"//trim(law)//"' stiffness = "//to_text(stiffness)// &
                 ' / &integrate dt = 1e-6 duration = 1e-5 /', list, simulation, error)
      call table%note_error(error)
      if (allocated(error)) return
      associate (bodies => simulation%bodies)
         load(1:2) = bodies%mass(2)*bodies%acceleration(:, 2)
         load(3) = bodies%inertia(2)*bodies%angular_acceleration(2)
      end associate
   end subroutine load_on

   !> A key hangs by its head on the two lips of a lock, which gravity pulls it through.
   subroutine hang_key(table, law)
      type(table_t), intent(inout) :: table
      character(len=*), intent(in) :: law
      type(body_list_t) :: list
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      real(wp) :: at_start, sunk, slot, head, face, weight
      integer :: k

      slot = 0.005_wp
      head = 0.01_wp
      ! Two lips, walls and a roof around the head
      call list%append(reshape([block_at(-0.5_wp*(slot + head), -0.5_wp*thick, head, thick, 0.0_wp), &
                                block_at(0.5_wp*(slot + head), -0.5_wp*thick, head, thick, 0.0_wp), &
                                block_at(-head, thick, thick, 2.0_wp*thick, 0.0_wp), &
                                block_at(head, thick, thick, 2.0_wp*thick, 0.0_wp), &
                                block_at(0.0_wp, 2.5_wp*thick, 3.0_wp*head, thick, 0.0_wp)], [2, 20]), fixed=.true., &
                       piece=[([k - 1, k - 1, k - 1, k - 1], k=1, 5)])
      call list%append(reshape([block_at(0.0_wp, 0.5_wp*thick, head, thick, 0.0_wp), &
                                block_at(0.0_wp, -head, 0.8_wp*slot, 2.0_wp*head, 0.0_wp)], [2, 8]), &
                       piece=[0, 0, 0, 0, 1, 1, 1, 1])
      call begin('&forces law = '''//law//''' restitution = 0.1 stiffness = '//to_text(stiffness)//' gravity = 0, -'// &
                 to_text(gravity)//' / &integrate duration = 0.2 /', list, simulation, error)
      if (.not. allocated(error)) then
         at_start = simulation%bodies%position(2, 2)
         call steps(simulation, int(simulation%n_steps), error)
      end if
      call table%note_error(error)
      if (allocated(error)) return
      associate (bodies => simulation%bodies)
         sunk = at_start - bodies%position(2, 2)
         weight = bodies%mass(2)*gravity
         ! Stiffness of a lip over E: 1, or w^2/(l b)
         face = 1.0_wp
         if (law == 'conservative') face = (0.5_wp*(head - slot))**2/(thick*head)
         call table%expect_relative('key in a lock, '//law//': depth of its head in the lips [m]', &
                                    weight/(2.0_wp*stiffness*face), sunk, 1.0e-6_wp)
         call table%expect_absolute('key in a lock, '//law//': speed at rest [m/s]', 0.0_wp, &
                                    norm2(bodies%velocity(:, 2)), 1.0e-9_wp)
      end associate
   end subroutine hang_key

   !> Two crosses collide without damping and friction; the error of their energy is of second order in the time step.
   subroutine collide(table)
      type(table_t), intent(inout) :: table
      real(wp) :: change(2)
      integer :: k

      do k = 1, 2
         call energy_change(table, 4.0e-6_wp/2**k, change(k))
      end do
      call table%expect_absolute('crosses that collide: relative change of energy', 0.0_wp, change(2), 1.0e-5_wp)
      call table%expect_least('crosses that collide: change of energy over that with half the step', 3.0_wp, &
                              abs(change(1)/change(2)))
   end subroutine collide

   !> Relative change of the energy of two crosses through their collisions
   subroutine energy_change(table, dt, change)
      type(table_t), intent(inout) :: table
      !> Time step [s]
      real(wp), intent(in) :: dt
      real(wp), intent(out) :: change
      type(body_list_t) :: list
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      real(wp) :: energy(2)

      change = huge(change)
      call append_cross(list, 0.0_wp, 0.0_wp, 0.1_wp, 30.0_wp)
      call append_cross(list, 0.012_wp, 0.002_wp, -1.0_wp, 0.0_wp)
      call begin("&forces gravity = 0, 0 friction = 'none' restitution = 1 tilt_damping = 0 stiffness = "// &
                 to_text(stiffness)//' / &integrate dt = '//to_text(dt)//' duration = 0.02 /', list, simulation, error)
      if (.not. allocated(error)) then
         energy(1) = kinetic(simulation)
         call steps(simulation, int(simulation%n_steps), error)
      end if
      call table%note_error(error)
      if (allocated(error)) return
      energy(2) = kinetic(simulation)
      change = energy(2)/energy(1) - 1.0_wp
   end subroutine energy_change

   !> Append a cross of three pieces.
   subroutine append_cross(list, x, y, speed, spin)
      type(body_list_t), intent(inout) :: list
      !> Centre [m]
      real(wp), intent(in) :: x, y
      !> Velocity along x [m/s] and angular velocity [rad/s]
      real(wp), intent(in) :: speed, spin

      call list%append(reshape([block_at(x, y, thick, 3.0_wp*thick, 0.0_wp), &
                                block_at(x - thick, y, thick, thick, 0.0_wp), &
                                block_at(x + thick, y, thick, thick, 0.0_wp)], [2, 12]), velocity=[speed, 0.0_wp], &
                       angular_velocity=spin, piece=[0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2])
   end subroutine append_cross

   !> Kinetic energy of all free bodies [J/m]
   real(wp) function kinetic(simulation)
      type(simulation_t), intent(in) :: simulation

      associate (b => simulation%bodies)
         kinetic = 0.5_wp*sum(b%mass*sum(b%velocity**2, 1) + b%inertia*b%angular_velocity**2)
      end associate
   end function kinetic

   !> An arch of three pieces with the mass and the inertia of a block rocks as the block does, in the limit of rigid
   !> bodies.
   subroutine rock(table)
      type(table_t), intent(inout) :: table
      real(wp) :: block(2), arch(2)
      integer :: k

      do k = 1, 2
         call rocking_time(table, .false., 1.0e6_wp*100.0_wp**k, block(k))
         call rocking_time(table, .true., 1.0e6_wp*100.0_wp**k, arch(k))
      end do
      call table%expect_relative('rocking arch: time of the fall of the block [s]', block(2), arch(2), 0.01_wp)
      call table%expect_least('rocking arch: fall of the difference for 100 times the stiffness', 4.0_wp, &
                              abs(block(1) - arch(1))/abs(block(2) - arch(2)))
   end subroutine rock

   !> Time until a tilted block or arch has turned back to its feet, between two steps by a straight line [s]
   subroutine rocking_time(table, is_arch, stiff, time)
      type(table_t), intent(inout) :: table
      logical, intent(in) :: is_arch
      !> Stiffness [N/m2]
      real(wp), intent(in) :: stiff
      real(wp), intent(out) :: time
      type(body_list_t) :: list
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      real(wp), parameter :: b = 0.02_wp, h = 0.06_wp, angle = 0.1_wp, foot = 0.005_wp, beam = 0.01_wp
      real(wp) :: before, inertia, mass
      real(wp), allocatable :: vertices(:, :)
      integer(ip), allocatable :: piece(:)
      integer :: k

      time = huge(time)
      mass = 2500.0_wp*b*h
      inertia = mass*(b**2 + h**2)/12.0_wp
      call list%append(block_at(0.0_wp, -0.05_wp, 0.2_wp, 0.1_wp, 0.0_wp), fixed=.true.)
      if (is_arch) then
         ! A beam in the middle keeps the centre of mass at half the height.
         vertices = reshape([block_at(0.5_wp*(foot - b), 0.5_wp*h, foot, h, 0.0_wp), &
                             block_at(0.5_wp*(b - foot), 0.5_wp*h, foot, h, 0.0_wp), &
                             block_at(0.0_wp, 0.5_wp*h, b - 2.0_wp*foot, beam, 0.0_wp)], [2, 12])
         piece = [0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2]
      else
         vertices = block_at(0.0_wp, 0.5_wp*h, b, h, 0.0_wp)
         piece = [0, 0, 0, 0]
      end if
      do k = 1, size(vertices, 2)
         ! Turned about the right foot
         vertices(:, k) = vertices(:, k) - [0.5_wp*b, 0.0_wp]
         vertices(:, k) = [cos(angle)*vertices(1, k) + sin(angle)*vertices(2, k), &
                           cos(angle)*vertices(2, k) - sin(angle)*vertices(1, k)]
      end do
      call list%append(vertices, masses=[mass, inertia], piece=piece)
      call begin('&forces restitution = 0.5 friction_coefficient = 1 stiffness = '//to_text(stiff)//' gravity = 0, '// &
                 to_text(-gravity)//' / &integrate duration = 1 /', list, simulation, error)
      if (allocated(error)) call table%note_error(error)
      do while (.not. allocated(error))
         before = simulation%bodies%angle(2)
         call steps(simulation, 1, error)
         if (simulation%bodies%angle(2) >= angle) exit
      end do
      call table%note_error(error)
      time = (real(simulation%step, wp) - (simulation%bodies%angle(2) - angle)/(simulation%bodies%angle(2) - before)) &
             *simulation%dt
   end subroutine rocking_time

end module b28_pieces
