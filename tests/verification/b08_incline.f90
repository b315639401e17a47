!> Benchmark B8: a block on an incline slides, rests or topples.
!>
!> A sliding block accelerates with g (sin a - mu cos a). Below tan a = mu it rests; with friction by a spring it first
!> moves downhill by m g sin a/k_t.
!>
!> With enough friction a rigid block topples when its weight points beside its base, tan a = w/h. A soft block stands
!> on a triangle of area A = m g l/E and length 3 s, where s is the distance of the weight from the edge. It is tilted
!> by t = 2 A/(9 s^2), which moves the weight towards the edge: s = s_0 - h t/2, s_0 = (w - h tan a)/2. Both equations
!> have a solution if s_0^3 > 3 h A/4. So the block topples at tan a = (w - 2 (3 h A/4)^(1/3))/h, which tends to w/h
!> only with E^(-1/3).
!>
!> With the default law the force of an edge passes through its tip and is 0.375 E d, so the block topples about the tip
!> like a rigid one. Before, it tilts until only the tip is inside, by d/w with d = rho g w h cos(a)/(0.375 E): tan a is
!> too small by the share rho g h (1 + (w/h)^2)^(1/2) h/(0.375 E w), of first order in 1/E.
module b08_incline
   use outlines, only: gravity, integrate_text
   use slow_load, only: load_slowly, slow_integration
   use trial, only: area_law, begin, block_at, steps
   use verification_table, only: table_t
   use polydem_body_list, only: body_list_t
   use polydem_contact_history, only: column_of
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, wp
   use polydem_simulation, only: simulation_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: run_incline, put_on_slope

   real(wp), parameter :: young = 1.0e7_wp
   real(wp), parameter :: density = 2500.0_wp
   !> Friction coefficient, and sides of the block [m], except for toppling
   real(wp), parameter :: mu = 0.3_wp, size_of_block(2) = [0.02_wp, 0.01_wp]
   !> Thickness of the plank [m]
   real(wp), parameter :: thickness = 0.05_wp

contains

   !> Slide, rest, topple.
   subroutine run_incline(table, thorough)
      !> Table to fill
      type(table_t), intent(inout) :: table
      !> Whether to rest for a million steps instead of 1e5
      logical, intent(in) :: thorough

      call table%begin('B8', 'block on an incline')
      call slide(table, 0.5_wp, 'cundall_strack')
      call slide(table, 0.32_wp, 'cundall_strack')
      call slide(table, atan(1.01_wp*mu), 'exact')
      call rest(table, merge(500000, 50000, thorough))
      call rest_exactly(table, merge(500000, 50000, thorough))
      call topple(table, 1.0e7_wp)
      if (thorough) call topple(table, 1.0e9_wp)
      call topple_slowly(table, [1.0e5_wp, 1.0e6_wp])
      if (.not. thorough) return
      call topple_slowly(table, [1.0e6_wp, 1.0e7_wp])
      call topple_softly(table, 'conservative')
      call topple_softly(table, 'area')
   end subroutine run_incline

   subroutine slide(table, slope, friction)
      type(table_t), intent(inout) :: table
      real(wp), intent(in) :: slope
      character(len=*), intent(in) :: friction
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      real(wp) :: early, late

      call put_on_slope(slope, 0.0_wp, size_of_block, mu, 'friction = '''//friction//''' tilt_damping = 0', &
                        simulation, error)
      if (.not. allocated(error)) call steps(simulation, 10000, error)
      early = downhill(slope, simulation%bodies%velocity(:, 2))
      if (.not. allocated(error)) call steps(simulation, 10000, error)
      late = downhill(slope, simulation%bodies%velocity(:, 2))
      call table%note_error(error)
      if (allocated(error)) return
      call table%expect_relative(friction//', tan a = '//to_text(tan(slope)/mu, 3)//' mu: acceleration [m/s2]', &
                                 gravity*(sin(slope) - mu*cos(slope)), (late - early)/0.1_wp, 1.0e-3_wp)
   end subroutine slide

   !> The load starts suddenly. The slope is less than half the critical one, so the spring does not reach its limit.
   subroutine rest(table, n)
      type(table_t), intent(inout) :: table
      integer, intent(in) :: n
      real(wp), parameter :: slope = 0.1_wp, size(2) = size_of_block
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      real(wp) :: start(2), middle(2), load

      call put_on_slope(slope, 0.0_wp, size, mu, 'tilt_damping = 0', simulation, error)
      if (allocated(error)) return
      start = simulation%bodies%position(:, 2)
      call steps(simulation, n, error)
      middle = simulation%bodies%position(:, 2)
      load = density*size(1)*size(2)*gravity*sin(slope)
      call table%note_error(error)
      if (allocated(error)) return
      ! The block also tilts; the displacement of the base extends the spring.
      call table%expect_relative('rests at 0.1 rad: sag of the spring [m]', load/(2.0_wp/7.0_wp*young), &
                                 downhill(slope, middle - start) + 0.5_wp*size(2)*simulation%bodies%angle(2), 0.01_wp)
      call table%expect_relative('rests: force of the spring [N/m]', load, &
                                 abs(simulation%history%column(column_of(simulation%history, 'tangential'))%value(1)), &
                                 1.0e-6_wp)
      call steps(simulation, n, error)
      call table%note_error(error)
      call table%expect_absolute('rests: move in the second half of '//to_text(2*n)//' steps [m]', 0.0_wp, &
                                 downhill(slope, simulation%bodies%position(:, 2) - middle), 1.0e-14_wp)
   end subroutine rest

   !> At 0.99 of the critical slope, a block with exact friction does not creep once it is at rest. The tolerance is 2
   !> units in the last place of 1 m.
   subroutine rest_exactly(table, n)
      type(table_t), intent(inout) :: table
      integer, intent(in) :: n
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      real(wp) :: middle(2), slope

      slope = atan(0.99_wp*mu)
      call put_on_slope(slope, 0.0_wp, size_of_block, mu, 'friction = ''exact'' tilt_damping = 0', simulation, error)
      if (.not. allocated(error)) call steps(simulation, n, error)
      if (.not. allocated(error)) middle = simulation%bodies%position(:, 2)
      if (.not. allocated(error)) call steps(simulation, n, error)
      call table%note_error(error)
      if (allocated(error)) return
      call table%expect_absolute('exact, tan a = 0.99 mu: move in the second half of '//to_text(2*n)//' steps [m]', &
                                 0.0_wp, downhill(slope, simulation%bodies%position(:, 2) - middle), &
                                 2.0_wp*epsilon(1.0_wp))
   end subroutine rest_exactly

   !> A block four times as high as wide. It starts in equilibrium on a slope just below the critical one, and flat on a
   !> slope just above it.
   subroutine topple(table, young)
      type(table_t), intent(inout) :: table
      real(wp), intent(in) :: young
      real(wp), parameter :: size(2) = [0.01_wp, 0.04_wp]
      real(wp) :: area, least, critical, turned
      character(len=:), allocatable :: name

      area = overlap_area(size, young)
      least = (0.75_wp*size(2)*area)**(1.0_wp/3.0_wp)
      critical = atan((size(1) - 2.0_wp*least)/size(2))
      name = 'h/w = 4, mu = 1, E = '//to_text(young, 1)//': '
      call table%show(name//'toppling tan a over w/h', tan(critical)*size(2)/size(1))
      call turn_within(0.97_wp*critical, turned)
      call table%expect_absolute(name//'at 0.97 of that: turns within 0.5 s by [rad]', 0.0_wp, turned, 1.0e-3_wp)
      call turn_within(1.03_wp*critical, turned)
      call table%expect_true(name//'at 1.03 of that: topples within 0.5 s', turned > 0.5_wp)

   contains

      subroutine turn_within(slope, turned)
         real(wp), intent(in) :: slope
         real(wp), intent(out) :: turned
         type(simulation_t) :: simulation
         type(error_t), allocatable :: error
         integer :: k

         call put_on_edge(slope, size, young, area, simulation, error)
         turned = 0.0_wp
         do k = 1, 500
            if (.not. allocated(error)) call steps(simulation, nint(1.0e-3_wp/simulation%dt), error)
            if (allocated(error)) exit
            turned = abs(simulation%bodies%angle(2))
            if (turned > 0.5_wp) exit
         end do
         call table%note_error(error)
      end subroutine turn_within

   end subroutine topple

   !> Compare the tangent at which the same block topples with the default law, when gravity rises slowly.
   subroutine topple_slowly(table, young)
      type(table_t), intent(inout) :: table
      real(wp), intent(in) :: young(2)
      real(wp) :: expected, deficit(2)
      real(wp), parameter :: size(2) = [0.01_wp, 0.04_wp]
      integer :: e
      character(len=*), parameter :: name = 'h/w = 4, default law, error of the toppling tangent, '

      do e = 1, 2
         expected = density*size(2)*gravity/(0.375_wp*young(e))*hypot(size(1), size(2))/size(1)
         call find_deficit(table, '', young(e), [-0.5_wp, 2.0_wp]*expected, deficit(e))
         call table%expect_relative(name//'E = '//to_text(young(e), 1), expected, deficit(e), 0.2_wp)
      end do
      call table%expect_least(name//'order in E from '//to_text(young(1), 1), 0.9_wp, &
                              log(deficit(1)/deficit(2))/log(young(2)/young(1)))
   end subroutine topple_slowly

   !> Show the same error of a law whose edges give way.
   subroutine topple_softly(table, law)
      type(table_t), intent(inout) :: table
      character(len=*), intent(in) :: law
      real(wp) :: deficit
      integer :: e

      do e = 6, 7
         call find_deficit(table, 'law = '''//law//'''', 10.0_wp**e, [0.0_wp, 1.0_wp], deficit)
         call table%show('h/w = 4, '//law//' law, error of the toppling tangent, E = '//to_text(10.0_wp**e, 1), deficit)
      end do
   end subroutine topple_softly

   !> Find by how much the tangent at which a block topples is below that of a rigid one, relative to it.
   subroutine find_deficit(table, entries, young, range, deficit)
      type(table_t), intent(inout) :: table
      !> Entries of &forces
      character(len=*), intent(in) :: entries
      real(wp), intent(in) :: young
      !> Least and greatest value that is tried
      real(wp), intent(in) :: range(2)
      real(wp), intent(out) :: deficit
      real(wp), parameter :: size(2) = [0.01_wp, 0.04_wp], limit = 0.005_wp
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      type(body_list_t) :: list
      real(wp) :: least, greatest, tangent, moved
      integer :: k

      call list%append(block_at(0.0_wp, -0.5_wp*thickness, 0.5_wp, thickness, 0.0_wp), fixed=.true.)
      call list%append(block_at(0.0_wp, 0.5_wp*size(2), size(1), size(2), 0.0_wp))
      least = range(1)
      greatest = range(2)
      do k = 1, 8
         deficit = 0.5_wp*(least + greatest)
         tangent = (1.0_wp - deficit)*size(1)/size(2)
         call begin('&forces friction_coefficient = 1 '//entries//' stiffness = '//to_text(young)//' /'// &
                    slow_integration, list, simulation, error)
         call load_slowly(simulation, gravity/sqrt(1.0_wp + tangent**2)*[tangent, -1.0_wp], 0.5_wp, 1.0_wp, 2_ip, &
                          limit, moved, error)
         call table%note_error(error)
         if (allocated(error)) return
         if (moved > limit) then
            least = deficit
         else
            greatest = deficit
         end if
      end do
   end subroutine find_deficit

   !> Area of the overlap that carries the weight of a block that is about to topple, A = m g l/E [m2]
   pure real(wp) function overlap_area(size, young)
      real(wp), intent(in) :: size(2), young
      real(wp) :: r1, r2

      r1 = 0.5_wp*hypot(size(1), size(2))
      r2 = 0.5_wp*hypot(size(1), thickness)
      overlap_area = density*size(1)*size(2)*gravity/young*4.0_wp*r1*r2/(r1 + r2)
   end function overlap_area

   !> Equilibrium tilt of a block on its lower edge: the overlap is a triangle of length 3 s and angle t = 2 A/(3 s)^2,
   !> and the line of the weight is at the distance s = (w - h tan(a + t))/2 from the corner. The smaller of the two
   !> solutions is stable. If there is no solution, the result is the tilt at which the two coincide.
   subroutine put_on_edge(slope, size, young, area, simulation, error)
      real(wp), intent(in) :: slope, size(2), young, area
      type(simulation_t), intent(out) :: simulation
      type(error_t), allocatable, intent(inout) :: error
      type(body_list_t) :: list
      real(wp) :: tilt, margin, corner(2), centre(2)
      integer :: k

      tilt = 0.0_wp
      margin = 0.5_wp*(size(1) - size(2)*tan(slope))
      do k = 1, 200
         tilt = min(2.0_wp*area/(9.0_wp*(margin - 0.5_wp*size(2)*tilt)**2), 2.0_wp*margin/(3.0_wp*size(2)))
      end do
      ! In the frame of the plank, whose face is y = 0 and whose x axis points downhill.
      corner = [0.0_wp, -3.0_wp*(margin - 0.5_wp*size(2)*tilt)*tilt]
      centre = corner + 0.5_wp*[-size(1)*cos(tilt) + size(2)*sin(tilt), size(1)*sin(tilt) + size(2)*cos(tilt)]
      centre = centre + [0.0_wp, 0.5_wp*thickness]
      call list%append(block_at(0.0_wp, 0.0_wp, 0.5_wp, thickness, -slope), fixed=.true.)
      call list%append(block_at(cos(slope)*centre(1) + sin(slope)*centre(2), &
                       cos(slope)*centre(2) - sin(slope)*centre(1), &
                                size(1), size(2), -slope - tilt))
      call begin('&forces friction_coefficient = 1 damping_coefficient = 1'//area_law//' stiffness = '// &
                 to_text(young)//' /'// &
                 integrate_text(5.0e-6_wp*sqrt(1.0e7_wp/young)), list, simulation, error)
   end subroutine put_on_edge

   !> Start a block, body 2, at its static depth on a long fixed plank, with steps of 1e-5 s.
   subroutine put_on_slope(slope, speed, size, mu, forces, simulation, error)
      !> Angle of the plank, downhill to the right [rad]
      real(wp), intent(in) :: slope
      !> Speed downhill at the start [m/s]
      real(wp), intent(in) :: speed
      !> Width and height of the block [m]
      real(wp), intent(in) :: size(2)
      !> Friction coefficient
      real(wp), intent(in) :: mu
      !> Further entries of &forces
      character(len=*), intent(in) :: forces
      !> Ready to advance
      type(simulation_t), intent(out) :: simulation
      !> What went wrong
      type(error_t), allocatable, intent(inout) :: error
      type(body_list_t) :: list
      real(wp) :: distance, depth

      ! The load is E w d/l with l = 2 h T/(h + T), up to relative errors of d/h.
      depth = density*size(2)*gravity*cos(slope)/young*2.0_wp*size(2)*thickness/(size(2) + thickness)
      distance = 0.5_wp*(size(2) + thickness) - depth
      call list%append(block_at(0.0_wp, 0.0_wp, 2.0_wp, thickness, -slope), fixed=.true.)
      call list%append(block_at(sin(slope)*distance, cos(slope)*distance, size(1), size(2), -slope), &
                       velocity=[speed*cos(slope), -speed*sin(slope)])
      call begin('&forces '//forces//' friction_coefficient = '//to_text(mu, &
                 17)//' damping_coefficient = 1 law = ''area'' /'// &
                 integrate_text(1.0e-5_wp), list, simulation, error)
   end subroutine put_on_slope

   pure real(wp) function downhill(slope, vector)
      real(wp), intent(in) :: slope, vector(2)

      downhill = cos(slope)*vector(1) - sin(slope)*vector(2)
   end function downhill

end module b08_incline
