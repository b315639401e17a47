!> Benchmark B25: a periodic cell.
!>
!> Nothing may depend on where its border is: a body that flies over it, and two bodies that meet across an edge or a
!> corner, move as in the plane; a cell with another border has the same pairs in every step; four copies in a cell of
!> twice the size move as the cell does, until chaos amplifies rounding errors. Distances are those of centres without
!> the cell, over the side of the cell. Momentum is conserved without walls.
module b25_periodic_cell
   use outlines, only: pi
   use trial, only: begin, steps
   use verification_table, only: table_t
   use polydem_body_list, only: body_list_t
   use polydem_energy_balance, only: balance_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: wp
   use polydem_simulation, only: simulation_t, compute_balance
   use polydem_strings, only: to_text
   implicit none
   private
   public :: run_periodic_cell

   !> Side of the cell, and radius of the bodies [m]
   real(wp), parameter :: side = 0.1_wp, radius = 0.01_wp
   !> Number of grains of a cell along each axis
   integer, parameter :: along = 4

contains

   !> Flight, impacts, borders, copies and momentum.
   subroutine run_periodic_cell(table, thorough)
      !> Table to fill
      type(table_t), intent(inout) :: table
      !> Whether to follow the momentum for a million steps instead of 20 000
      logical, intent(in) :: thorough

      call table%begin('B25', 'periodic cell')
      call fly(table)
      call meet(table, 'edge', [0.0_wp, 0.4_wp*side])
      call meet(table, 'corner', [0.0_wp, 0.0_wp])
      call move_border(table)
      call copy_cell(table)
      call keep_momentum(table, merge(1000000, 20000, thorough))
   end subroutine run_periodic_cell

   !> Groups of a namelist for a cell
   function groups(periodic, low, size, accumulation) result(text)
      logical, intent(in) :: periodic
      real(wp), intent(in) :: low(2), size
      !> Entry of &integrate; default: plain
      character(len=*), intent(in), optional :: accumulation
      character(len=:), allocatable :: text

      text = ''
      if (periodic) text = '&cell periodic = ''xy'' low = '//to_text(low(1), 17)//', '//to_text(low(2), 17)// &
         ' size = '//to_text(size, 17)//', '//to_text(size, 17)//' / '
      text = text//'&forces gravity = 0, 0 / &guards displacement = ''off'' / &integrate dt = 1e-5 duration = 100'
      if (present(accumulation)) text = text//' accumulation = '''//accumulation//''''
      text = text//' /'
   end function groups

   !> Corners of an irregular polygon, (2, corners) [m]
   pure function grain(number, place) result(corners)
      integer, intent(in) :: number
      real(wp), intent(in) :: place(2)
      real(wp) :: corners(2, 5 + modulo(number, 4)), angle, r
      integer :: k, n

      n = size(corners, 2)
      do k = 1, n
         angle = 2.0_wp*pi*(real(k, wp) + 0.1_wp*real(modulo(number, 7), wp))/real(n, wp)
         r = radius*(1.0_wp - 0.01_wp*real(number, wp))
         corners(:, k) = place + r*[cos(angle), 0.8_wp*sin(angle)]
      end do
   end function grain

   !> Centres without the cell, (2, slot) [m]
   pure function paths(simulation)
      type(simulation_t), intent(in) :: simulation
      real(wp) :: paths(2, simulation%bodies%n)
      integer :: axis

      paths = simulation%bodies%position
      if (.not. allocated(simulation%bodies%image)) return
      do axis = 1, 2
         paths(axis, :) = paths(axis, :) + real(simulation%bodies%image(:, axis), wp)*simulation%bodies%cell%size(axis)
      end do
   end function paths

   !> A body that crosses the border several times along each axis
   subroutine fly(table)
      type(table_t), intent(inout) :: table
      type(body_list_t) :: list
      type(simulation_t) :: cell, plane
      type(error_t), allocatable :: error

      call list%append(grain(3, [0.02_wp, 0.03_wp]), velocity=[3.0_wp, -2.0_wp], angular_velocity=30.0_wp)
      ! In 20 000 steps plain sums would leave more rounding errors in the plane, where coordinates grow.
      call begin(groups(.true., [0.0_wp, 0.0_wp], side, 'compensated'), list, cell, error)
      if (.not. allocated(error)) &
         call begin(groups(.false., [0.0_wp, 0.0_wp], side, 'compensated'), list, plane, error)
      if (.not. allocated(error)) call steps(cell, 20000, error)
      if (.not. allocated(error)) call steps(plane, 20000, error)
      call table%note_error(error)
      if (allocated(error)) return
      call table%expect_absolute('flight over the border: distance from that in the plane, over the side', 0.0_wp, &
                                 maxval(abs(paths(cell) - paths(plane)))/side, 1.0e-13_wp)
      call table%expect_true('it has left the cell along both axes', all(abs(cell%bodies%image(1, :)) >= 3))
   end subroutine fly

   !> Two bodies that meet across the border.
   subroutine meet(table, name, place)
      type(table_t), intent(inout) :: table
      character(len=*), intent(in) :: name
      !> Where they meet in the plane: on the border of the cell [m]
      real(wp), intent(in) :: place(2)
      type(body_list_t) :: list, other
      type(simulation_t) :: cell, plane
      type(error_t), allocatable :: error
      real(wp) :: gap(2), apart(2)

      ! They come from both sides of the border.
      apart = merge(side, 0.0_wp, abs(place) <= 0.0_wp)
      gap = merge(0.75_wp*radius, 0.0_wp, abs(place) <= 0.0_wp)
      if (abs(place(2)) > 0.0_wp) gap(1) = 1.1_wp*radius
      call list%append(grain(1, place + gap), velocity=-5.0_wp*gap/radius, angular_velocity=10.0_wp)
      other = list
      call list%append(grain(2, place - gap), velocity=6.0_wp*gap/radius)
      call other%append(grain(2, place - gap + apart), velocity=6.0_wp*gap/radius)
      call begin(groups(.true., [0.0_wp, 0.0_wp], side), other, cell, error)
      if (.not. allocated(error)) call begin(groups(.false., [0.0_wp, 0.0_wp], side), list, plane, error)
      if (.not. allocated(error)) call steps(cell, 1000, error)
      if (.not. allocated(error)) call steps(plane, 1000, error)
      call table%note_error(error)
      if (allocated(error)) return
      associate (moved => paths(cell) - paths(plane))
         call table%expect_absolute('impact across the '//name//': distance from that in the plane, over the side', &
            0.0_wp, max(maxval(abs(moved(:, 1))), maxval(abs(moved(:, 2) - apart)))/side, 1.0e-13_wp)
      end associate
      call table%expect_absolute('impact across the '//name//': velocities [m/s]', 0.0_wp, &
                                 maxval(abs(cell%bodies%velocity - plane%bodies%velocity)), 1.0e-11_wp)
      call table%expect_true('the '//name//' is crossed by a contact', &
                             abs(cell%bodies%angular_velocity(1) - 10.0_wp) > 0.1_wp .and. cell%sums(1) > 0 .and. &
                             cell%sums(1) == plane%sums(1))
   end subroutine meet

   !> Grains on a lattice of m x m cells, each with the same grains
   subroutine list_grains(m, low, list)
      integer, intent(in) :: m
      !> Lower left corner of the first cell [m]
      real(wp), intent(in) :: low(2)
      type(body_list_t), intent(inout) :: list
      integer :: i, j, k, number

      do k = 0, m*m - 1
         do j = 0, along - 1
            do i = 0, along - 1
               number = along*j + i
               call list%append(grain(number, low + side*real([modulo(k, m), k/m], wp) + &
                                      side/real(along, wp)*(real([i, j], wp) + 0.5_wp)), &
                                velocity=[cos(real(5*number, wp)), sin(real(3*number, wp))], &
                                angular_velocity=real(3*number - 20, wp))
            end do
         end do
      end do
   end subroutine list_grains

   !> The same grains in cells with other borders
   subroutine move_border(table)
      type(table_t), intent(inout) :: table
      real(wp), parameter :: shares(2, 4) = reshape([0.13_wp, 0.0_wp, 0.5_wp, 0.37_wp, 0.9_wp, 0.98_wp, 2.71_wp, &
                                                     -3.14_wp], [2, 4])
      type(body_list_t) :: list
      type(simulation_t) :: cell, other
      type(error_t), allocatable :: error
      real(wp), allocatable :: former(:, :), moved(:, :)
      real(wp) :: worst
      logical :: same
      integer :: k, step

      same = .true.
      worst = 0.0_wp
      call list_grains(1, [0.0_wp, 0.0_wp], list)
      do k = 1, size(shares, 2)
         call begin(groups(.true., [0.0_wp, 0.0_wp], side), list, cell, error)
         if (.not. allocated(error)) call begin(groups(.true., side*shares(:, k), side), list, other, error)
         if (.not. allocated(error)) then
            former = paths(cell)
            moved = paths(other)
         end if
         do step = 1, 1500
            if (.not. allocated(error)) call steps(cell, 1, error)
            if (.not. allocated(error)) call steps(other, 1, error)
            call table%note_error(error)
            if (allocated(error)) return
            associate (a => cell%search%neighbours%pairs, b => other%search%neighbours%pairs)
               same = same .and. a%n == b%n .and. cell%loop%n_contacts == other%loop%n_contacts
               if (same) same = all(a%first(:a%n) == b%first(:b%n) .and. a%second(:a%n) == b%second(:b%n))
            end associate
         end do
         worst = max(worst, maxval(abs((paths(cell) - former) - (paths(other) - moved))))
      end do
      call table%expect_true('moved border: the same pairs in 4 x 1500 steps', same)
      call table%expect_absolute('moved border: distance from the paths, over the side', 0.0_wp, worst/side, 1.0e-12_wp)
   end subroutine move_border

   !> Four copies in a cell of twice the size
   subroutine copy_cell(table)
      type(table_t), intent(inout) :: table
      type(body_list_t) :: one, four
      type(simulation_t) :: cell, other
      type(error_t), allocatable :: error
      real(wp), allocatable :: from_cell(:, :), from_other(:, :)
      real(wp) :: worst
      integer :: k, n

      call list_grains(1, [0.0_wp, 0.0_wp], one)
      call list_grains(2, [0.0_wp, 0.0_wp], four)
      call begin(groups(.true., [0.0_wp, 0.0_wp], side), one, cell, error)
      if (.not. allocated(error)) call begin(groups(.true., [0.0_wp, 0.0_wp], 2.0_wp*side), four, other, error)
      if (.not. allocated(error)) then
         from_cell = paths(cell)
         from_other = paths(other)
         call steps(cell, 1500, error)
      end if
      if (.not. allocated(error)) call steps(other, 1500, error)
      call table%note_error(error)
      if (allocated(error)) return
      n = cell%bodies%n
      worst = 0.0_wp
      do k = 0, 3
         worst = max(worst, maxval(abs((paths(cell) - from_cell) - &
            columns(paths(other) - from_other, k*n + 1, k*n + n))))
      end do
      call table%expect_absolute('2 x 2 cells: distance from the paths of one, over the side', 0.0_wp, worst/side, &
                                 1.0e-12_wp)
      call table%expect_true('2 x 2 cells: four times the contacts', other%sums(1) == 4*cell%sums(1) .and. &
                             cell%sums(1) > 100)
   end subroutine copy_cell

   !> Some columns of a table
   pure function columns(values, first, last)
      real(wp), intent(in) :: values(:, :)
      integer, intent(in) :: first, last
      real(wp) :: columns(size(values, 1), last - first + 1)

      columns = values(:, first:last)
   end function columns

   !> Momentum of a gas with damping and friction, without walls
   subroutine keep_momentum(table, n_steps)
      type(table_t), intent(inout) :: table
      integer, intent(in) :: n_steps
      type(body_list_t) :: list
      type(simulation_t) :: cell
      type(balance_t) :: start, end
      type(error_t), allocatable :: error
      real(wp) :: scale

      call list_grains(1, [0.0_wp, 0.0_wp], list)
      call begin(groups(.true., [0.0_wp, 0.0_wp], side), list, cell, error)
      if (.not. allocated(error)) then
         call compute_balance(cell, start)
         scale = sum(cell%bodies%mass*sqrt(sum(cell%bodies%velocity**2, 1)))
         call steps(cell, n_steps, error)
      end if
      call table%note_error(error)
      if (allocated(error)) return
      call compute_balance(cell, end)
      call table%expect_absolute('momentum that is missing, over its sum', 0.0_wp, &
                                 norm2(end%momentum - start%momentum)/scale, 1.0e-15_wp)
      call table%expect_absolute('energy that is missing, over that at the start', 0.0_wp, &
                                 end%energy_residual/start%kinetic, 1.0e-3_wp)
      call table%show('kinetic energy at the end over that at the start', end%kinetic/start%kinetic)
   end subroutine keep_momentum

end module b25_periodic_cell
