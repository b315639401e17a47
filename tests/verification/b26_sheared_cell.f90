!> Benchmark B26: a sheared cell (Lees & Edwards).
!>
!> Two bodies that meet across the sheared border move as in the plane, where the lower one has that of its copy.
!> Energy closes with the work of the border, of second order in dt. In a steady flow this work is the shear stress in
!> the cell, from the contacts and the fluctuations of velocities, times rate and area, and the mean profile is linear.
module b26_sheared_cell
   use outlines, only: pi
   use trial, only: begin, steps
   use verification_table, only: table_t
   use polydem_body_list, only: body_list_t
   use polydem_cell, only: minimum_image
   use polydem_contacts, only: contact_force
   use polydem_energy_balance, only: balance_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, wp
   use polydem_simulation, only: simulation_t, compute_balance
   use polydem_strings, only: to_text
   implicit none
   private
   public :: run_sheared_cell

   !> Side of the cell, and radius of the bodies [m]; rate of the shear [1/s]
   real(wp), parameter :: side = 0.1_wp, radius = 0.01_wp, rate = 30.0_wp

contains

   !> Impact, energy and stress.
   subroutine run_sheared_cell(table, thorough)
      !> Table to fill
      type(table_t), intent(inout) :: table
      !> Whether to take a long mean of the stress, which then has a tolerance of 1 instead of 3 %
      logical, intent(in) :: thorough
      real(wp) :: coarse(4), fine(4), dt
      integer :: k

      call table%begin('B26', 'sheared cell')
      call meet(table)
      ! The error of a contact depends on the part of a step in which it begins, so some steps are tried.
      do k = 1, size(fine)
         dt = 1.0e-5_wp*(1.0_wp - 0.03_wp*real(k - 1, wp))
         call shear(table, dt, 4500, coarse(k))
         call shear(table, 0.5_wp*dt, 9000, fine(k))
      end do
      call table%expect_absolute('elastic: energy that is missing, over the work of the border', 0.0_wp, maxval(fine), &
                                 1.0e-2_wp)
      call table%expect_least('elastic: its fall when dt is halved', 3.5_wp, norm2(coarse)/norm2(fine))
      call compare_stress(table, merge(0.01_wp, 0.03_wp, thorough))
   end subroutine run_sheared_cell

   !> Groups of a namelist
   function groups(is_sheared, dt, forces) result(text)
      logical, intent(in) :: is_sheared
      real(wp), intent(in) :: dt
      !> Entries of &forces; default: none
      character(len=*), intent(in), optional :: forces
      character(len=:), allocatable :: text

      text = ''
      if (is_sheared) text = '&cell periodic = ''xy'' size = 0.1, 0.1 shear_rate = 30 profile = .true. / '
      text = text//'&guards displacement = ''off'' / &integrate dt = '//to_text(dt, 8)//' duration = 100 / &forces '// &
         'gravity = 0, 0 stiffness = 1e5'
      if (present(forces)) text = text//' '//forces
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

   !> Two bodies that meet across the upper border.
   subroutine meet(table)
      type(table_t), intent(inout) :: table
      type(body_list_t) :: list, other
      type(simulation_t) :: cell, plane
      type(error_t), allocatable :: error
      real(wp) :: moved(2, 2), upper(2)

      call list%append(grain(1, [0.03_wp, 0.9_wp*side]), velocity=[0.4_wp, 1.5_wp], angular_velocity=10.0_wp)
      other = list
      ! The lower one is below its copy by a side.
      call list%append(grain(2, [0.028_wp, 0.12_wp*side]), velocity=[-0.3_wp, -1.0_wp])
      call begin(groups(.true., 1.0e-5_wp), list, cell, error)
      if (.not. allocated(error)) then
         upper = cell%bodies%velocity(:, 2) + [rate*side, 0.0_wp]
         call other%append(grain(2, [0.028_wp, 1.12_wp*side]), velocity=upper)
         call begin(groups(.false., 1.0e-5_wp), other, plane, error)
      end if
      if (.not. allocated(error)) then
         plane%bodies%velocity(:, 1) = cell%bodies%velocity(:, 1)
         call steps(cell, 1000, error)
      end if
      if (.not. allocated(error)) call steps(plane, 1000, error)
      call table%note_error(error)
      if (allocated(error)) return
      ! Velocities without the cell: above each border they are greater by its jump.
      associate (b => cell%bodies, images => real(cell%bodies%image, wp))
         moved(1, :) = b%velocity(1, :) + images(:, 2)*rate*side
         moved(2, :) = b%velocity(2, :)
      end associate
      moved(1, 2) = moved(1, 2) + rate*side
      call table%expect_absolute('impact across the sheared border: velocities over the jump', 0.0_wp, &
                                 maxval(abs(moved - plane%bodies%velocity))/(rate*side), 1.0e-13_wp)
      call table%expect_absolute('impact across the sheared border: angular velocities times radius, over the jump', &
         0.0_wp, radius*maxval(abs(cell%bodies%angular_velocity - plane%bodies%angular_velocity))/(rate*side), &
         1.0e-13_wp)
      call table%expect_true('there is a contact', cell%sums(1) > 10 .and. cell%sums(1) == plane%sums(1))
   end subroutine meet

   !> List grains on a lattice.
   subroutine list_grains(list)
      type(body_list_t), intent(inout) :: list
      integer :: i, j, number

      do j = 0, 4
         do i = 0, 4
            number = 5*j + i
            call list%append(grain(number, 0.2_wp*side*(real([i, j], wp) + 0.5_wp)), &
                             velocity=0.3_wp*[cos(real(5*number, wp)), sin(real(3*number, wp))])
         end do
      end do
   end subroutine list_grains

   !> Energy that is missing after a flow, over the work of the border
   subroutine shear(table, dt, n_steps, missing)
      type(table_t), intent(inout) :: table
      real(wp), intent(in) :: dt
      integer, intent(in) :: n_steps
      real(wp), intent(out) :: missing
      type(body_list_t) :: list
      type(simulation_t) :: cell
      type(balance_t) :: balance
      type(error_t), allocatable :: error

      missing = huge(missing)
      call list_grains(list)
      call begin(groups(.true., dt, 'damping = ''none'' friction = ''none'''), list, cell, error)
      if (.not. allocated(error)) call steps(cell, n_steps, error)
      call table%note_error(error)
      if (allocated(error)) return
      call compute_balance(cell, balance)
      missing = abs(balance%energy_residual)/max(abs(balance%wall_work), tiny(dt))
   end subroutine shear

   !> Compare the work of the border with the mean stress in the cell.
   subroutine compare_stress(table, tolerance)
      type(table_t), intent(inout) :: table
      !> Of the ratio, a mean over a fluctuating flow
      real(wp), intent(in) :: tolerance
      integer, parameter :: first = 10000, n_steps = 400000
      type(body_list_t) :: list
      type(simulation_t) :: cell
      type(balance_t) :: start, end
      type(error_t), allocatable :: error
      real(wp) :: power, dt, wave(2)
      integer :: k

      dt = 2.0e-5_wp
      wave = 0.0_wp
      call list_grains(list)
      call begin(groups(.true., dt), list, cell, error)
      if (.not. allocated(error)) call steps(cell, first, error)
      power = 0.0_wp
      if (.not. allocated(error)) call compute_balance(cell, start)
      do k = 1, n_steps
         if (allocated(error)) exit
         call steps(cell, 1, error)
         power = power + power_of_stress(cell)
         if (modulo(k, 20) == 0) wave = wave + wave_of_profile(cell)*20.0_wp/real(n_steps, wp)
      end do
      call table%note_error(error)
      if (allocated(error)) return
      call compute_balance(cell, end)
      call table%expect_relative('power of the stress in the cell over that of the border', 1.0_wp, &
                                 dt*power/(end%wall_work - start%wall_work), tolerance)
      call table%expect_absolute('wave in the mean profile of velocities, over the jump', 0.0_wp, norm2(wave), 0.03_wp)
   end subroutine compare_stress

   !> First Fourier mode along y of the velocities along x that a linear profile leaves, over the jump, (2)
   function wave_of_profile(cell) result(wave)
      type(simulation_t), intent(in) :: cell
      real(wp) :: wave(2), phase
      integer(ip) :: s

      wave = 0.0_wp
      associate (bodies => cell%bodies)
         do s = 1_ip, bodies%n
            phase = 2.0_wp*pi*bodies%position(2, s)/side
            wave = wave + bodies%mass(s)*[cos(phase), sin(phase)]* &
               (bodies%velocity(1, s) - rate*(bodies%position(2, s) - 0.5_wp*side))
         end do
         wave = 2.0_wp*wave/(sum(bodies%mass)*rate*side)
      end associate
   end function wave_of_profile

   !> Shear stress in the cell times rate and area [W/m]
   real(wp) function power_of_stress(cell) result(power)
      type(simulation_t), intent(in) :: cell
      real(wp) :: branch(2), force(2), sum_xy
      integer(ip) :: c, s

      sum_xy = 0.0_wp
      associate (bodies => cell%bodies)
         do s = 1_ip, bodies%n
            sum_xy = sum_xy - bodies%mass(s)*bodies%velocity(2, s)* &
               (bodies%velocity(1, s) - rate*(bodies%position(2, s) - 0.5_wp*side))
         end do
         do c = 1_ip, cell%contacts%n
            branch = minimum_image(bodies%cell, bodies%cell%inverse, bodies%position(:, cell%contacts%row(c)%second) &
                                  - bodies%position(:, cell%contacts%row(c)%first))
            force = contact_force(cell%contacts, c)
            sum_xy = sum_xy + branch(2)*force(1)
         end do
      end associate
      power = rate*sum_xy
   end function power_of_stress

end module b26_sheared_cell
