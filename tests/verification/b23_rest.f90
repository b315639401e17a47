!> Benchmark B23: what must rest, rests. Bars, blocks on slopes, stacks and a heap, with the time step that polydem
!> chooses.
!>
!> A bar of any shape that falls on a floor must come to rest, as must a block on a slope below its friction angle, and
!> blocks that fall on each other. Measured are the root mean square speed of the mass, sqrt(2 K/m), in the last quarter
!> of the time, and the creep, which is the greatest mean velocity of a body in that quarter. Both must be below a
!> bound, and the kinetic energy below that of the quarter before: it falls, until it is rounding error.
!>
!> The default model must keep the bounds in all scenes. Weaker damping needs more time and must only still fall. With
!> the area law, whose work on closed paths is not zero, slender bars do not come to rest: its rows are shown.
module b23_rest
   use outlines, only: gravity, regular_polygon
   use trial, only: begin, block_at
   use verification_table, only: table_t
   use polydem_body_list, only: body_list_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, lp, wp
   use polydem_simulation, only: simulation_t
   use polydem_strings, only: to_text
   use polydem_time_step, only: advance
   implicit none
   private
   public :: run_rest

   !> Bounds of speed and creep at rest, and speed of rounding errors [m/s]
   real(wp), parameter :: slow = 1.0e-4_wp, creeping = 1.0e-6_wp, rounding = 1.0e-9_wp
   !> Area of a block [m2]
   real(wp), parameter :: area = 1.0e-4_wp

   !> The worst of several scenes
   type :: worst_t
      !> Speed and creep in the last quarter [m/s]
      real(wp) :: speed = 0.0_wp, creep = 0.0_wp
      !> Number of scenes, and of those whose energy did not fall
      integer :: scenes = 0, restless = 0
   end type worst_t

contains

   !> Bars, slopes, stacks and a heap.
   subroutine run_rest(table, thorough)
      !> Table to fill
      type(table_t), intent(inout) :: table
      !> Whether to run the whole grid instead of a sample
      logical, intent(in) :: thorough
      character(len=16), parameter :: frictions(3) = [character(len=16) :: 'cundall_strack', 'exact', 'none']
      character(len=60), parameter :: dampings(7) = [character(len=60) :: 'restitution = 0.3', 'restitution = 0.8', &
         'damping_coefficient = 0.5', 'damping_coefficient = 0.1', &
         "damping = 'hunt_crossley' damping_coefficient = 300", &
         "damping = 'matuttis_chen' damping_coefficient = 0.5", 'restitution = 0.5 tilt_damping = 0']
      integer :: k

      call table%begin('B23', 'what must rest, rests')
      do k = 1, merge(3, 1, thorough)
         call all_scenes(table, '', trim(frictions(k)), thorough, .true.)
      end do
      if (.not. thorough) return
      do k = 1, size(dampings)
         call all_scenes(table, trim(dampings(k)), 'cundall_strack', .false., .false.)
      end do
      do k = 1, 2
         call all_scenes(table, "law = 'area' "//trim(dampings(k)), 'cundall_strack', .false., .false.)
      end do
      call all_scenes(table, "law = 'area' damping_coefficient = 0.0251 tilt_damping = 0", 'cundall_strack', .false., &
                      .false.)
   end subroutine run_rest

   !> All scenes with one model.
   subroutine all_scenes(table, model, friction, whole, must_rest)
      type(table_t), intent(inout) :: table
      !> Entries of &forces besides friction; empty: the defaults
      character(len=*), intent(in) :: model, friction
      !> Whether to run the whole grid
      logical, intent(in) :: whole
      !> Whether the bounds must be kept
      logical, intent(in) :: must_rest
      character(len=:), allocatable :: name

      name = friction
      if (model /= '') name = model
      call bars(table, model, friction, name, whole, must_rest)
      ! Without friction a stack glides apart, and a block glides down.
      if (friction == 'none') return
      call slopes(table, model, friction, name, whole, must_rest)
      call stacks(table, model, friction, name, whole, must_rest)
      if (whole .or. .not. must_rest) call heap(table, model, friction, name, must_rest)
   end subroutine all_scenes

   !> Bars of one area and aspect ratios from 1 to 30 fall 5 mm, flat or tilted.
   subroutine bars(table, model, friction, name, whole, must_rest)
      type(table_t), intent(inout) :: table
      character(len=*), intent(in) :: model, friction, name
      logical, intent(in) :: whole, must_rest
      real(wp), parameter :: aspects(7) = [1.0_wp, 10.0_wp, 20.0_wp, 30.0_wp, 2.0_wp, 3.0_wp, 5.0_wp]
      real(wp), parameter :: tilts(3) = [0.0_wp, 0.05_wp, 0.3_wp]
      type(body_list_t) :: list
      type(worst_t) :: worst
      real(wp) :: w, h
      integer :: j, k

      do k = 1, merge(size(aspects), merge(2, 4, must_rest), whole)
         w = sqrt(area*aspects(k))
         h = area/w
         do j = 1, merge(3, 2, whole)
            call put_floor(list)
            call list%append(block_at(0.0_wp, 0.5_wp*(h*cos(tilts(j)) + w*sin(tilts(j))) + 0.005_wp, w, h, tilts(j)))
            call settle(table, list, model, friction, 0.5_wp, 0.0_wp, &
                        merge(3.0_wp, 1.5_wp, whole .or. .not. must_rest), worst)
         end do
      end do
      call judge(table, 'bars', name, worst, must_rest)
   end subroutine bars

   !> Blocks on slopes up to 0.98 of the friction angle, which fall by 10 um. Gravity is turned instead of the slope.
   subroutine slopes(table, model, friction, name, whole, must_rest)
      type(table_t), intent(inout) :: table
      character(len=*), intent(in) :: model, friction, name
      logical, intent(in) :: whole, must_rest
      real(wp), parameter :: coefficients(4) = [0.5_wp, 0.1_wp, 0.3_wp, 1.0_wp]
      real(wp), parameter :: shares(3) = [0.98_wp, 0.7_wp, 0.9_wp]
      type(body_list_t) :: list
      type(worst_t) :: worst
      real(wp) :: aspect, w, h
      integer :: j, k

      do k = 1, merge(4, 2, whole)
         ! High blocks would topple on steep slopes.
         aspect = merge(4.0_wp, 1.0_wp, coefficients(k) >= 0.5_wp)
         w = sqrt(area*aspect)
         h = area/w
         do j = 1, merge(3, 1, whole)
            call put_floor(list)
            call list%append(block_at(0.0_wp, 0.5_wp*h + 1.0e-5_wp, w, h, 0.0_wp))
            call settle(table, list, model, friction, coefficients(k), shares(j)*atan(coefficients(k)), &
                        merge(3.0_wp, 1.5_wp, whole .or. .not. must_rest), worst)
         end do
      end do
      call judge(table, 'slopes', name, worst, must_rest)
   end subroutine slopes

   !> Stacks of 2 to 5 blocks, a little out of plumb, which fall by 0.1 mm each.
   subroutine stacks(table, model, friction, name, whole, must_rest)
      type(table_t), intent(inout) :: table
      character(len=*), intent(in) :: model, friction, name
      logical, intent(in) :: whole, must_rest
      real(wp), parameter :: aspects(2) = [1.0_wp, 4.0_wp]
      type(body_list_t) :: list
      type(worst_t) :: worst
      real(wp) :: w, h
      integer :: i, k, n

      do n = 2, merge(5, 3, whole)
         do k = 1, 2
            w = sqrt(area*aspects(k))
            h = area/w
            call put_floor(list)
            do i = 1, n
               call list%append(block_at(merge(0.02_wp, -0.02_wp, mod(i, 2) == 0)*w, &
                                         (i - 0.5_wp)*h + i*1.0e-4_wp, w, h, 0.0_wp))
            end do
            call settle(table, list, model, friction, 0.5_wp, 0.0_wp, &
                        merge(4.0_wp, 2.0_wp, whole .or. .not. must_rest), worst)
         end do
      end do
      call judge(table, 'stacks', name, worst, must_rest)
   end subroutine stacks

   !> A heap of 21 heptagons that are let loose in a triangle.
   subroutine heap(table, model, friction, name, must_rest)
      type(table_t), intent(inout) :: table
      character(len=*), intent(in) :: model, friction, name
      logical, intent(in) :: must_rest
      real(wp), parameter :: radius = 5.0e-3_wp
      type(body_list_t) :: list
      type(worst_t) :: worst
      integer :: i, k

      call put_floor(list)
      do k = 1, 6
         do i = 1, 7 - k
            call list%append(regular_polygon(7, radius, (2*i + k - 8)*1.05_wp*radius, (2*k - 1)*radius, &
                                             0.3_wp*real(i + k, wp)))
         end do
      end do
      call settle(table, list, model, friction, 0.5_wp, 0.0_wp, 5.0_wp, worst)
      call judge(table, 'heap', name, worst, must_rest)
   end subroutine heap

   !> Start a list of bodies with a floor.
   subroutine put_floor(list)
      type(body_list_t), intent(out) :: list

      call list%append(block_at(0.0_wp, -0.05_wp, 10.0_wp, 0.1_wp, 0.0_wp), fixed=.true.)
   end subroutine put_floor

   !> Run a scene, and keep the worst of its last quarter.
   subroutine settle(table, list, model, friction, coefficient, slope, duration, worst)
      type(table_t), intent(inout) :: table
      !> The floor and the free bodies
      type(body_list_t), intent(in) :: list
      character(len=*), intent(in) :: model, friction
      !> Friction coefficient
      real(wp), intent(in) :: coefficient
      !> Angle of gravity [rad]
      real(wp), intent(in) :: slope
      !> Simulated time [s]
      real(wp), intent(in) :: duration
      type(worst_t), intent(inout) :: worst
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      character(len=:), allocatable :: text
      real(wp), allocatable :: before(:, :)
      real(wp) :: energy(4), mass
      integer(lp) :: k
      integer :: quarter

      text = "&forces friction = '"//friction//"' "//model//' gravity = '//to_text(gravity*sin(slope), 17)//', '// &
             to_text(-gravity*cos(slope), 17)
      if (friction /= 'none') text = text//' friction_coefficient = '//to_text(coefficient, 17)
      text = text//' / &boxes largest_ratio = 1e4 / &output energy_balance = .false. / &integrate duration = '// &
             to_text(duration, 17)//' /'
      call begin(text, list, simulation, error)
      call table%note_error(error)
      if (allocated(error)) return
      energy = 0.0_wp
      do k = 1_lp, simulation%n_steps
         quarter = int(4_lp*(k - 1_lp)/simulation%n_steps) + 1
         call advance(simulation, error)
         call table%note_error(error)
         if (allocated(error)) return
         associate (b => simulation%bodies)
            energy(quarter) = max(energy(quarter), 0.5_wp*sum(b%mass(2:)*(b%velocity(1, 2:)**2 + b%velocity(2, 2:)**2) &
                                                              + b%inertia(2:)*b%angular_velocity(2:)**2))
            if (4_lp*k <= 3_lp*simulation%n_steps) before = b%position(:, 2:)
         end associate
      end do
      associate (b => simulation%bodies)
         mass = sum(b%mass(2:))
         worst%speed = max(worst%speed, sqrt(2.0_wp*energy(4)/mass))
         worst%creep = max(worst%creep, maxval(abs(b%position(:, 2:) - before))/(0.25_wp*duration))
      end associate
      worst%scenes = worst%scenes + 1
      if (energy(4) > energy(3) .and. sqrt(2.0_wp*energy(4)/mass) > rounding) worst%restless = worst%restless + 1
   end subroutine settle

   !> Write the rows of one kind of scene.
   subroutine judge(table, scenes, name, worst, must_rest)
      type(table_t), intent(inout) :: table
      character(len=*), intent(in) :: scenes, name
      type(worst_t), intent(in) :: worst
      logical, intent(in) :: must_rest
      character(len=:), allocatable :: start

      start = to_text(worst%scenes)//' '//scenes//', '//name//': '
      if (must_rest) then
         call table%expect_absolute(start//'greatest speed [m/s]', 0.0_wp, worst%speed, slow)
         call table%expect_absolute(start//'greatest creep [m/s]', 0.0_wp, worst%creep, creeping)
         call table%expect_absolute(start//'not falling', 0.0_wp, real(worst%restless, wp), 0.0_wp)
      else
         call table%show(start//'speed [m/s]', worst%speed)
         call table%show(start//'not falling', real(worst%restless, wp))
      end if
   end subroutine judge

end module b23_rest
