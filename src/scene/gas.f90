!> Scene gas: grains with random velocities and zero total momentum, spread over a closed container.
!>
!> Grains that may overlap at the start lie on a lattice with the density that the fraction requires. The walls then lie
!> half a long axis outside the rectangle to which the fraction refers, and no grain overlaps a wall.
module polydem_gas
   use polydem_body_list, only: body_list_t
   use polydem_cut_cells, only: fit_cells
   use polydem_errors, only: error_t, input_error, raise
   use polydem_grains, only: append_grains, draw_grains, grains_t
   use polydem_kinds, only: ip, wp
   use polydem_lattice, only: fill_lattice, row_height
   use polydem_pour, only: loose_spacing_ratio, loose_spacing, displace_randomly
   use polydem_random, only: new_random, random_t
   use polydem_settings, only: scene_settings_t
   use polydem_start_velocities, only: choose_moving_grains, draw_spins, draw_velocities, remove_momentum, set_speed
   use polydem_strings, only: to_text
   use polydem_walls, only: append_box, rectangle
   implicit none
   private
   public :: list_gas, total_area, append_moving_grains

contains

   !> List the bodies of the gas: grains first, then floor, left wall, right wall, lid. The centre is at the origin.
   subroutine list_gas(scene, list, error)
      !> Settings: bodies (grains), solid_fraction (of the container), width, speed, spin, grains
      type(scene_settings_t), intent(in) :: scene
      type(body_list_t), intent(inout) :: list
      !> Allocated if the solid_fraction is too large for a start without overlaps
      type(error_t), allocatable, intent(inout) :: error
      type(random_t) :: random, start
      type(grains_t) :: grains
      real(wp), allocatable :: centres(:, :)
      real(wp) :: inside(2, 4), spacing

      allocate (centres(2, scene%bodies))
      random = new_random(scene%seed)
      call draw_grains(scene, random, scene%bodies, grains)
      start = random
      call arrange(scene, grains, scene%solid_fraction, random, inside, centres, spacing)
      if (.not. spacing > 0.0_wp) then
         call raise(error, input_error, 'solid_fraction is too large for grains without overlap at the start; '// &
                    'lower solid_fraction'//largest_fraction(scene, grains, start)// &
                    ', or change width or long_axis_max')
         return
      end if
      call append_moving_grains(list, scene, random, grains, centres)
      call append_box(list, inside, scene%long_axis_max*sqrt(scene%size_ratio), closed=.true.)
   end subroutine list_gas

   !> Arrange the grains in the container that a fraction requires; the spacing is 0 if they do not fit.
   subroutine arrange(scene, grains, fraction, random, inside, centres, spacing)
      type(scene_settings_t), intent(in) :: scene
      type(grains_t), intent(in) :: grains
      real(wp), intent(in) :: fraction
      type(random_t), intent(inout) :: random
      !> Container (2, 4), centres (2, grain), distance of the centres [m]
      real(wp), intent(out) :: inside(2, 4), centres(:, :), spacing
      real(wp) :: area, width

      area = total_area(grains%area)/fraction
      width = scene%width
      if (.not. width > 0.0_wp) width = sqrt(area)
      inside = rectangle(-0.5_wp*width, 0.5_wp*width, -0.5_wp*area/width, 0.5_wp*area/width)
      if (scene%size_ratio > 1.0_wp) then
         call fit_cells(inside, loose_spacing_ratio*grains%length, random, centres, spacing)
      else if (scene%overlap) then
         call spread_out(inside, 0.0_wp, centres, spacing)
         call displace_randomly(random, spacing, centres)
         inside = inside + 0.5_wp*scene%long_axis_max*sign(1.0_wp, inside)
      else
         call spread_out(inside, loose_spacing(scene), centres, spacing)
         call displace_randomly(random, spacing - scene%long_axis_max, centres)
      end if
   end subroutine arrange

   !> The end of a message: ' to ' and a fraction with which the grains fit, near the largest one
   function largest_fraction(scene, grains, start) result(text)
      type(scene_settings_t), intent(in) :: scene
      type(grains_t), intent(in) :: grains
      !> State of the random numbers before the grains are arranged
      type(random_t), intent(in) :: start
      character(len=:), allocatable :: text
      type(random_t) :: random
      real(wp), allocatable :: centres(:, :)
      real(wp) :: inside(2, 4), spacing, fits, fails, trial
      ! Number of trials; below a millionth of the given fraction the bodies of the walls are the problem
      integer, parameter :: most_trials = 26
      integer :: k

      allocate (centres(2, size(grains%area)))
      fits = 0.0_wp
      fails = scene%solid_fraction
      do k = 1, most_trials
         if (fits >= 0.98_wp*fails) exit
         trial = 0.5_wp*(fits + fails)
         ! The number that the message names is the one that was tried.
         text = to_text(trial, 2)
         read (text, *) trial
         if (trial <= fits .or. trial >= fails) exit
         random = start
         call arrange(scene, grains, trial, random, inside, centres, spacing)
         if (spacing > 0.0_wp) then
            fits = trial
         else
            fails = trial
         end if
      end do
      text = ''
      if (fits > 0.0_wp) text = ' to '//to_text(fits, 2)
   end function largest_fraction

   !> Append grains with random velocities and angular velocities. The total momentum is zero unless one grain alone
   !> moves.
   subroutine append_moving_grains(list, scene, random, grains, centres)
      type(body_list_t), intent(inout) :: list
      !> Settings: speed, spin, moving_grains
      type(scene_settings_t), intent(in) :: scene
      type(random_t), intent(inout) :: random
      type(grains_t), intent(in) :: grains
      !> Centres of the grains, (2, grain) [m]
      real(wp), intent(in) :: centres(:, :)
      real(wp), allocatable :: velocities(:, :), spins(:)
      logical, allocatable :: moves(:)

      allocate (velocities(2, size(centres, 2)), spins(size(centres, 2)))
      call draw_velocities(random, 1.0_wp, velocities)
      moves = choose_moving_grains(size(centres, 2, kind=ip), scene%moving_grains)
      if (count(moves) > 1) call remove_momentum(grains%area, moves, velocities)
      call set_speed(scene%speed, moves, velocities)
      call draw_spins(random, scene%spin, spins)
      call append_grains(list, scene, grains, centres, velocities, spins)
   end subroutine append_moving_grains

   !> Total area of the grains [m2]
   pure real(wp) function total_area(areas)
      !> Area of each grain, (grain) [m2]
      real(wp), intent(in) :: areas(:)
      integer :: k

      total_area = 0.0_wp
      do k = 1, size(areas)
         total_area = total_area + areas(k)
      end do
   end function total_area

   !> Find the lattice with the largest spacing on which all points fit; the spacing is 0 if it would be below `least`.
   subroutine spread_out(inside, least, centres, spacing)
      real(wp), intent(in) :: inside(2, 4), least
      real(wp), intent(out) :: centres(:, :), spacing
      real(wp) :: area
      integer(ip) :: n_found

      area = (inside(1, 3) - inside(1, 1))*(inside(2, 3) - inside(2, 1))
      spacing = 1.1_wp*sqrt(area/(row_height*real(size(centres, 2), wp)))
      do while (spacing >= least)
         call fill_lattice(inside, spacing, centres, n_found)
         if (n_found == size(centres, 2)) return
         spacing = 0.998_wp*spacing
      end do
      spacing = 0.0_wp
   end subroutine spread_out

end module polydem_gas
