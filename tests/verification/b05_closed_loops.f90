!> Benchmark B5: work of the elastic force along closed paths of one body against another at rest.
!>
!> The body moves along an ellipse in the space of its three coordinates. A force with a potential does no work on this
!> path. If no corner enters or leaves the other body, the trapezoidal rule of the periodic integrand is exact to
!> rounding; otherwise it converges. The area law does work at any step. The work is given as a share of the sum of the
!> absolute works of all steps.
module b05_closed_loops
   use outlines, only: pi
   use polydem_kinds, only: ip, wp
   use polydem_strings, only: to_text
   use posed_pair, only: new_pair, pair_t, press, young
   use trial, only: block_at
   use verification_table, only: table_t
   implicit none
   private
   public :: run_closed_loops

   !> A path: the coordinates x, y and angle are middle + reach*cos(t + phase)
   type :: path_t
      !> Side of the moving square [m]; that of the other is 1 m
      real(wp) :: side
      !> Middle of x, y [m] and the angle [rad]
      real(wp) :: middle(3)
      !> Greatest distances from the middle, as above
      real(wp) :: reach(3)
      !> Phases [rad]
      real(wp) :: phase(3)
   end type path_t

   !> Corner in a side, with and without rotation; corner in corner; side in side; corner in a side, rotation only
   type(path_t), parameter :: smooth(5) = [ &
      path_t(1.0_wp, [0.1_wp, 1.1_wp, 0.25_wp*pi], [0.1_wp, 0.03_wp, 0.1_wp], [0.0_wp, 0.5_wp*pi, 1.0_wp]), &
      path_t(1.0_wp, [0.1_wp, 1.1_wp, 0.2_wp*pi], [0.2_wp, 0.03_wp, 0.0_wp], [0.0_wp, 0.5_wp*pi, 0.0_wp]), &
      path_t(1.0_wp, [0.85_wp, 0.85_wp, 0.0_wp], [0.1_wp, 0.1_wp, 0.1_wp], [0.0_wp, 0.5_wp*pi, 1.0_wp]), &
      path_t(0.3_wp, [0.1_wp, 0.6_wp, 0.0_wp], [0.2_wp, 0.03_wp, 0.1_wp], [0.0_wp, 0.5_wp*pi, 1.0_wp]), &
      path_t(1.0_wp, [0.1_wp, 1.1_wp, 0.25_wp*pi], [0.1_wp, 0.0_wp, 0.15_wp], [0.0_wp, 0.0_wp, 0.5_wp*pi])]

   !> A side tilts until one of its corners leaves
   type(path_t), parameter :: tilting = &
      path_t(0.6_wp, [0.0_wp, 0.75_wp, 0.0_wp], [0.1_wp, 0.02_wp, 0.25_wp], [0.0_wp, 0.5_wp*pi, 1.0_wp])

   !> Attraction that exceeds the repulsion on parts of the paths [N/m2]
   real(wp), parameter :: attraction = 0.1_wp*young

contains

   !> Run five smooth paths, and one on which corners enter and leave.
   subroutine run_closed_loops(table)
      !> Table to fill
      type(table_t), intent(inout) :: table
      character(len=12), parameter :: with_energy(2) = [character(len=12) :: 'polar', 'conservative']
      character(len=:), allocatable :: name
      real(wp) :: coarse, fine
      integer :: j, k

      call table%begin('B5', 'work of the elastic force on closed paths, as a share of the absolute work')
      do j = 1, size(with_energy)
         name = trim(with_energy(j))//' law, path '
         do k = 1, size(smooth)
            call table%expect_absolute(name//to_text(int(k, ip))//', 400 steps', 0.0_wp, &
                                       work(trim(with_energy(j)), smooth(k), 400), 1.0e-13_wp)
         end do
         coarse = work(trim(with_energy(j)), tilting, 250)
         fine = work(trim(with_energy(j)), tilting, 16000)
         call table%expect_absolute(name//'6 with events, 250 steps', 0.0_wp, coarse, 1.0e-4_wp)
         call table%expect_absolute(name//'6 with events, 16000 steps', 0.0_wp, fine, 1.0e-7_wp)
      end do
      do k = 1, size(smooth)
         call table%expect_absolute('conservative law with cohesion, path '//to_text(int(k, ip))//', 400 steps', &
                                    0.0_wp, work('conservative', smooth(k), 400, attraction), 1.0e-13_wp)
      end do
      do k = 1, size(smooth)
         fine = work('area', smooth(k), 1600)
         call table%expect_relative('area law, path '//to_text(int(k, ip))//': 400 steps as 1600 steps', fine, &
                                    work('area', smooth(k), 400), 2.0e-4_wp)
      end do
      fine = work('area', tilting, 16000)
      call table%expect_relative('area law, path 6: 4000 steps as 16000 steps', fine, work('area', tilting, 4000), &
                                 2.0e-4_wp)
   end subroutine run_closed_loops

   !> Work on a body along a path in n steps, as a share of the sum of absolute works
   function work(law, path, n, cohesion) result(share)
      character(len=*), intent(in) :: law
      type(path_t), intent(in) :: path
      integer, intent(in) :: n
      !> Attraction per length of a contact [N/m2]
      real(wp), intent(in), optional :: cohesion
      real(wp) :: share
      type(pair_t) :: pair
      real(wp) :: angle(3), pose(3), rate(3), piece, total
      integer :: k

      call new_pair(law, block_at(0.0_wp, 0.0_wp, 1.0_wp, 1.0_wp, 0.0_wp), &
                    block_at(0.0_wp, 0.0_wp, path%side, path%side, 0.0_wp), pair, cohesion)
      share = 0.0_wp
      total = 0.0_wp
      do k = 1, n
         angle = 2.0_wp*pi*real(k, wp)/real(n, wp) + path%phase
         pose = path%middle + path%reach*cos(angle)
         rate = -path%reach*sin(angle)
         pair%bodies%position(:, 2) = pose(1:2)
         pair%bodies%angle(2) = pose(3)
         call press(pair)
         piece = pair%bodies%force(1, 2)*rate(1) + pair%bodies%force(2, 2)*rate(2) + pair%bodies%torque(2)*rate(3)
         share = share + piece
         total = total + abs(piece)
      end do
      share = share/total
   end function work

end module b05_closed_loops
