!> Benchmark B14: a stack of squares that starts at its static depths stays there, unless it is so high that it buckles.
!>
!> Interface i from the top carries i blocks. Its depth is d_i = i m g l/(E w), where l = w - d_i because both force
!> points are half a depth inside the blocks. All forces are in equilibrium from the start; only rounding errors could
!> move the stack. The damping must be strong, because the slowest mode of 50 blocks decays with 2 gamma 1/s only.
!>
!> A face that tilts by t shifts the centroid of its overlap by w^2 t/(12 d). Its restoring moment is E w^2 t/12 under
!> any load. So a stack is a column of bending stiffness B = E w^3/12 under its own weight q = rho g w per height. It
!> buckles at the height (7.837 B/q)^(1/3) (A.G. Greenhill, Proc. Camb. Phil. Soc. 4 (1881) 65), that is n = (0.653
!> E/(rho g w))^(1/3) blocks, 29.9 at E = 1e7 and 64 at E = 1e8. Stacks of 24 and 36 blocks get a small push. With the
!> default law the force is E d/(1 + (d/w)^2)^2, and the same restoring moment.
module b14_stack
   use outlines, only: gravity
   use trial, only: area_law, steps
   use verification_table, only: table_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, wp
   use polydem_read_settings, only: read_settings_text
   use polydem_settings, only: settings_t
   use polydem_simulation, only: simulation_t
   use polydem_start, only: new_simulation
   use polydem_strings, only: to_text
   implicit none
   private
   public :: run_stack

   real(wp), parameter :: width = 0.01_wp
   real(wp), parameter :: weight = 2500.0_wp*width**2*gravity

contains

   !> Run ten blocks for 2e4 steps, or fifty for a million.
   subroutine run_stack(table, thorough)
      !> Table to fill
      type(table_t), intent(inout) :: table
      !> Whether to run the high stack
      logical, intent(in) :: thorough

      if (thorough) then
         call stand(table, 50, 1000000, 1.0e8_wp, 'cundall_strack')
         call stand(table, 50, 1000000, 1.0e8_wp, 'exact')
      else
         call stand(table, 10, 20000, 1.0e7_wp, 'cundall_strack')
         call stand(table, 10, 20000, 1.0e7_wp, 'exact')
      end if
      call table%show('blocks at which a stack buckles, E = 1e7', &
                      (7.837_wp/12.0_wp*1.0e7_wp*width/weight)**(1.0_wp/3.0_wp))
      if (thorough) then
         call buckle(table, 'area law', area_law, [24_ip, 36_ip], 7)
         call buckle(table, 'default law', '', [24_ip, 36_ip], 7)
      else
         ! At E = 1e6 stacks buckle at 13.9 blocks.
         call buckle(table, 'area law', area_law, [11_ip, 17_ip], 6)
         call buckle(table, 'default law', '', [11_ip, 17_ip], 6)
      end if
      call sink(table, 10_ip)
   end subroutine run_stack

   !> A stack below the height at which it buckles stands, and one above it falls.
   subroutine buckle(table, name, law, heights, power)
      type(table_t), intent(inout) :: table
      !> Law in words, and its entries
      character(len=*), intent(in) :: name, law
      !> Blocks of the low and of the high stack
      integer(ip), intent(in) :: heights(2)
      !> Stiffness, as a power of ten [N/m2]
      integer, intent(in) :: power
      character(len=:), allocatable :: middle
      real(wp) :: leaning

      middle = ' blocks, E = 1e'//to_text(power)//', '//name//', nudged: the top leans '
      call nudge(table, heights(1), 10.0_wp**power, law, leaning)
      call table%expect_absolute(to_text(heights(1))//middle//'after 2 s by [m]', 0.0_wp, leaning, 0.1_wp*width)
      call nudge(table, heights(2), 10.0_wp**power, law, leaning)
      call table%expect_true(to_text(heights(2))//middle//'by a width within 2 s', leaning > width)
   end subroutine buckle

   !> A stack with the default law from its static depths
   subroutine sink(table, n)
      type(table_t), intent(inout) :: table
      integer(ip), intent(in) :: n
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      real(wp), allocatable :: start(:, :)
      real(wp) :: depth, expected

      call build(n, 1.0e7_wp, 'cundall_strack', '', simulation, error)
      if (.not. allocated(error)) start = simulation%bodies%position
      if (.not. allocated(error)) call steps(simulation, 20000, error)
      call table%note_error(error)
      if (allocated(error)) return
      depth = 0.5_wp*width - simulation%bodies%position(2, 1)
      expected = real(n, wp)*weight/1.0e7_wp
      expected = expected*(1.0_wp + (expected/width)**2)**2
      call table%expect_relative('default law: depth of the lowest interface [m]', expected, depth, 1.0e-6_wp)
      call table%expect_absolute('default law: greatest speed [m/s]', 0.0_wp, &
                                 maxval(abs(simulation%bodies%velocity)), 1.0e-10_wp)
      call table%expect_absolute('default law: greatest move of a block [m]', 0.0_wp, &
                                 maxval(abs(simulation%bodies%position - start)), 1.0e-12_wp)
   end subroutine sink

   !> Push a stack sideways: its top gets 1 mm/s. Find the distance of the top from the middle after 2 s, or when it
   !> exceeds a width.
   subroutine nudge(table, n, young, law, leaning)
      type(table_t), intent(inout) :: table
      integer(ip), intent(in) :: n
      real(wp), intent(in) :: young
      character(len=*), intent(in) :: law
      real(wp), intent(out) :: leaning
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      integer(ip) :: k

      call build(n, young, 'cundall_strack', law, simulation, error)
      leaning = 0.0_wp
      do k = 1_ip, n
         if (.not. allocated(error)) simulation%bodies%velocity(1, k) = 1.0e-3_wp*real(k, wp)/real(n, wp)
      end do
      do k = 1_ip, 20_ip
         if (.not. allocated(error)) call steps(simulation, nint(0.1_wp/simulation%dt), error)
         if (allocated(error)) exit
         leaning = abs(simulation%bodies%position(1, n))
         if (leaning > width) exit
      end do
      call table%note_error(error)
   end subroutine nudge

   subroutine build(n, young, friction, law, simulation, error)
      integer(ip), intent(in) :: n
      real(wp), intent(in) :: young
      character(len=*), intent(in) :: friction, law
      type(simulation_t), intent(out) :: simulation
      type(error_t), allocatable, intent(inout) :: error
      character(len=1) :: no_overrides(0)
      type(settings_t) :: settings

      call read_settings_text('stack.nml', '&scene name = ''stack'' width = 0.01 height = 0.01 bodies = '// &
                              to_text(n)// &
                              ' / &forces friction = '''//friction//''' damping_coefficient = 1'// &
                              law//' stiffness = '//to_text(young)// &
                              ' / &integrate duration = 1000 / &output energy_balance = .false. /', &
                              no_overrides, settings, error)
      if (.not. allocated(error)) call new_simulation(settings, simulation, error)
   end subroutine build

   subroutine stand(table, n, n_steps, young, friction)
      type(table_t), intent(inout) :: table
      integer, intent(in) :: n, n_steps
      real(wp), intent(in) :: young
      character(len=*), intent(in) :: friction
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      real(wp), allocatable :: start(:, :)
      real(wp) :: worst, depth
      integer :: c

      call table%begin('B14', 'a stack of '//to_text(int(n, ip))//' squares from its static depths, '// &
                       to_text(int(n_steps, ip))//' steps, friction '//friction)
      call build(int(n, ip), young, friction, area_law, simulation, error)
      if (.not. allocated(error)) start = simulation%bodies%position
      if (.not. allocated(error)) call steps(simulation, n_steps, error)
      call table%note_error(error)
      if (allocated(error)) return
      ! Contacts are in the order of the lower block. The contact of block 1 with the floor follows that with block 2.
      worst = 0.0_wp
      associate (contacts => simulation%contacts)
         do c = 1, contacts%n
            depth = contacts%row(c)%area/width
            worst = max(worst, abs(depth/(weight*above(c)/(young*width)*(width - depth)) - 1.0_wp))
         end do
         call table%expect_absolute(friction//': number of contacts', real(n, wp), real(contacts%n, wp), 0.0_wp)
         call table%expect_relative(friction//': depth of the lowest interface [m]', depth_below(n, young), &
                                    contacts%row(2)%area/width, 1.0e-6_wp)
         call table%expect_absolute(friction//': worst relative error of a depth', 0.0_wp, worst, 1.0e-6_wp)
      end associate
      call table%expect_absolute(friction//': greatest speed [m/s]', 0.0_wp, &
                                 maxval(abs(simulation%bodies%velocity)), 1.0e-10_wp)
      call table%expect_absolute(friction//': greatest move of a block [m]', 0.0_wp, &
                                 maxval(abs(simulation%bodies%position - start)), 1.0e-12_wp)
      call table%expect_absolute(friction//': greatest turn of a block [rad]', 0.0_wp, &
                                 maxval(abs(simulation%bodies%angle)), 1.0e-12_wp)

   contains

      !> Number of blocks that a contact carries
      real(wp) function above(c)
         integer, intent(in) :: c

         associate (contacts => simulation%contacts)
            if (simulation%bodies%fixed(contacts%row(c)%second)) then
               above = real(n, wp)
            else
               above = real(n - contacts%row(c)%first, wp)
            end if
         end associate
      end function above

   end subroutine stand

   !> Depth d of an interface below n blocks, d = n weight (w - d)/(E w) [m]
   pure real(wp) function depth_below(n, young)
      integer, intent(in) :: n
      real(wp), intent(in) :: young

      depth_below = real(n, wp)*weight/(young*width)
      depth_below = depth_below*width/(1.0_wp + depth_below)
   end function depth_below

end module b14_stack
