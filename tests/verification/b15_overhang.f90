!> Benchmark B15: a stack of blocks with the greatest overhang.
!>
!> The overhang of block i from the top, counted from 1, is at most w/(2 i): then the centre of mass of blocks 1 to i is
!> above the edge of the next lower block. At 0.98 of all these overhangs the stack stands, at 1.02 it falls.
!>
!> This holds for rigid blocks. At a share f of the overhangs every centre of mass is s = (1 - f) w/2 inside the edge. A
!> soft edge fails below s^3 = 3 H A/2, where A = m g l/E is the overlap and H the height of the centre of mass of the
!> load (`b08_incline`). For ten blocks and f = 0.98 this gives E = 7e9. All other edges also tilt, so ten blocks with
!> E = 1e10 fall (shown).
!>
!> With the default law a block leans on the edge below it like a rigid one, when it has tilted by its depth over its
!> width: the share at which the stack falls differs from 1 by an error of first order in 1/E.
module b15_overhang
   use outlines, only: gravity, integrate_text
   use slow_load, only: load_slowly, slow_integration
   use trial, only: area_law, begin, block_at, steps
   use verification_table, only: table_t
   use polydem_body_list, only: body_list_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, wp
   use polydem_simulation, only: simulation_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: run_overhang

   real(wp), parameter :: width = 0.1_wp
   real(wp), parameter :: height = 0.02_wp

contains

   !> Run three blocks, and ten.
   subroutine run_overhang(table, thorough)
      !> Table to fill
      type(table_t), intent(inout) :: table
      !> Whether to run the high stack as well
      logical, intent(in) :: thorough
      real(wp) :: fallen

      call table%begin('B15', 'blocks of 10 cm x 2 cm, each as far out as it can be')
      call lean(table, 3_ip, 1.0e10_wp, 1.0e-4_wp)
      call lean_slowly(table, 3_ip, [1.0e6_wp, 1.0e7_wp], 0.01_wp)
      if (.not. thorough) return
      call lean_slowly(table, 10_ip, [1.0e7_wp, 1.0e8_wp], 0.05_wp)
      call fall_within(table, 10_ip, 0.98_wp, 1.0e10_wp, 0.5_wp, fallen)
      call table%show('10 blocks, E = 1e10, at 0.98: the top block sinks in 0.5 s by [m]', fallen)
      call lean(table, 10_ip, 1.0e12_wp, 5.0e-5_wp)
   end subroutine run_overhang

   !> A stack of n blocks stands at 0.98 of its overhangs, and falls at 1.02.
   subroutine lean(table, n, young, sag)
      type(table_t), intent(inout) :: table
      integer(ip), intent(in) :: n
      !> Stiffness [N/m2], and how far its top block may sink where it stands [m]
      real(wp), intent(in) :: young, sag
      real(wp) :: fallen
      character(len=:), allocatable :: name

      name = to_text(n)//' blocks, E = '//to_text(young, 1)//', '
      call fall_within(table, n, 0.98_wp, young, 0.5_wp, fallen)
      call table%expect_absolute(name//'at 0.98: the top block sinks in 0.5 s by [m]', 0.0_wp, fallen, sag)
      call fall_within(table, n, 1.02_wp, young, 2.0_wp, fallen)
      call table%expect_true(name//'at 1.02: the top block falls by its height within 2 s', fallen > height)
   end subroutine lean

   !> Share of its overhangs at which a stack falls with the default law, gravity rising slowly, with two stiffnesses.
   subroutine lean_slowly(table, n, young, range)
      type(table_t), intent(inout) :: table
      integer(ip), intent(in) :: n
      real(wp), intent(in) :: young(2)
      !> Largest difference of the share from 1 that is tried with the first stiffness
      real(wp), intent(in) :: range
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      real(wp) :: low, high, share, deficit(2), moved
      integer :: e, k
      character(len=:), allocatable :: name

      name = to_text(n)//' blocks, default law, 1 - share at which they fall, '
      do e = 1, 2
         low = 1.0_wp - range*young(1)/young(e)
         high = 1.0_wp + 0.1_wp*range*young(1)/young(e)
         do k = 1, 8
            share = 0.5_wp*(low + high)
            call build(n, share, '&forces friction_coefficient = 1 stiffness = '//to_text(young(e))//' /'// &
                       slow_integration, simulation, error)
            call load_slowly(simulation, [0.0_wp, -gravity], 1.0_wp, 2.0_wp, n, 0.5_wp*height, moved, error)
            call table%note_error(error)
            if (allocated(error)) return
            if (moved > 0.5_wp*height) then
               high = share
            else
               low = share
            end if
         end do
         deficit(e) = 1.0_wp - share
      end do
      call table%show(name//'E = '//to_text(young(1), 1), deficit(1))
      call table%expect_absolute(name//'E = '//to_text(young(2), 1), 0.0_wp, deficit(2), 2.0e-3_wp)
      call table%expect_least(name//'order in E', 0.9_wp, log(deficit(1)/deficit(2))/log(young(2)/young(1)))
   end subroutine lean_slowly

   !> Let a stack fall for a time, or until its top block has fallen by its height.
   subroutine fall_within(table, n, share, young, time, fallen)
      type(table_t), intent(inout) :: table
      integer(ip), intent(in) :: n
      real(wp), intent(in) :: share, young, time
      real(wp), intent(out) :: fallen
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      real(wp) :: start
      integer :: k

      call build(n, share, '&forces friction_coefficient = 1 damping_coefficient = 1'//area_law//' stiffness = '// &
                 to_text(young)//' /'//integrate_text(2.0e-6_wp*sqrt(1.0e10_wp/young)), simulation, error)
      fallen = 0.0_wp
      if (.not. allocated(error)) start = simulation%bodies%position(2, n)
      do k = 1, 100
         if (.not. allocated(error)) call steps(simulation, nint(0.01_wp*time/simulation%dt), error)
         if (allocated(error)) exit
         fallen = start - simulation%bodies%position(2, n)
         if (fallen > height) exit
      end do
      call table%note_error(error)
   end subroutine fall_within

   !> Blocks from the bottom up, face on face; the lowest one leans over the edge of a fixed body.
   subroutine build(n, share, text, simulation, error)
      integer(ip), intent(in) :: n
      real(wp), intent(in) :: share
      character(len=*), intent(in) :: text
      type(simulation_t), intent(out) :: simulation
      type(error_t), allocatable, intent(inout) :: error
      type(body_list_t) :: list
      real(wp) :: x
      integer(ip) :: k

      x = 0.0_wp
      do k = 1_ip, n
         x = x + share*width/(2.0_wp*real(n - k + 1_ip, wp))
         call list%append(block_at(x, (real(k, wp) - 0.5_wp)*height, width, height, 0.0_wp))
      end do
      call list%append(block_at(0.0_wp, -0.5_wp*height, width, height, 0.0_wp), fixed=.true.)
      call begin(text, list, simulation, error)
   end subroutine build

end module b15_overhang
