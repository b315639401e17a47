!> Scene gas: grains with random velocities and zero total momentum, spread over a closed container.
!>
!> Grains that may overlap at the start lie on a lattice with the density that the fraction requires. The walls then lie
!> half a long axis outside the rectangle to which the fraction refers, and no grain overlaps a wall.
module polydem_gas
   use polydem_arrange, only: arrange_grains, region_t, total_area
   use polydem_errors, only: error_t
   use polydem_grain_list, only: grains_t
   use polydem_grains, only: draw_grains
   use polydem_kinds, only: ip, wp
   use polydem_outlines, only: rectangle
   use polydem_parts, only: parts_t
   use polydem_random, only: new_random, random_t
   use polydem_recipe, only: recipe_grains
   use polydem_settings, only: grains_settings_t, scene_settings_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: make_gas, explain_gas, moving_grains, area_of_grains

contains

   !> Make the parts of the gas: grains, floor, left wall, right wall, lid. The centre is at the origin.
   subroutine make_gas(scene, parts)
      !> Settings: bodies (grains), fraction (of the container that the polygons cover), width, speed, spin, grains
      type(scene_settings_t), intent(in) :: scene
      type(parts_t), intent(inout) :: parts
      type(grains_settings_t) :: grains
      real(wp) :: low(2), high(2)

      grains = moving_grains(scene)
      grains%arrangement = 'spread'
      grains%overlap = scene%overlap
      call choose_box(scene, area_of_grains(grains, scene%seed)/scene%solid_fraction, grains%low, grains%high)
      call parts%add_grains(grains)
      low = grains%low
      high = grains%high
      if (scene%overlap) then
         low = low + 0.5_wp*scene%long_axis(2)*sign(1.0_wp, low)
         high = high + 0.5_wp*scene%long_axis(2)*sign(1.0_wp, high)
      end if
      call parts%add_box(low, high, scene%long_axis(2)*sqrt(scene%size_ratio), closed=.true.)
   end subroutine make_gas

   !> Grains in a box with random velocities. Their total momentum is zero unless one grain alone moves
   pure function moving_grains(scene) result(grains)
      !> Settings: bodies, speed, spin, moving_grains, grains
      type(scene_settings_t), intent(in) :: scene
      type(grains_settings_t) :: grains

      grains = recipe_grains(scene)
      grains%number = scene%bodies
      grains%region = 'box'
      grains%momentum = 'zero'
      grains%spin = scene%spin
      grains%moving_grains = scene%moving_grains
   end function moving_grains

   !> Total area of the polygons of the grains [m2]
   real(wp) function area_of_grains(grains, seed)
      !> Number and shape of the grains
      type(grains_settings_t), intent(in) :: grains
      !> Seed of the random numbers
      integer(ip), intent(in) :: seed
      type(random_t) :: random
      type(grains_t) :: drawn

      random = new_random(seed)
      call draw_grains(grains, random, grains%number, drawn)
      area_of_grains = total_area(drawn%area)
   end function area_of_grains

   !> Choose the box of a given area around the origin.
   pure subroutine choose_box(scene, area, low, high)
      type(scene_settings_t), intent(in) :: scene
      real(wp), intent(in) :: area
      real(wp), intent(out) :: low(2), high(2)
      real(wp) :: width

      width = scene%width
      if (.not. width > 0.0_wp) width = sqrt(area)
      low = [-0.5_wp*width, -0.5_wp*area/width]
      high = [0.5_wp*width, 0.5_wp*area/width]
   end subroutine choose_box

   !> What is said of grains that do not fit, with a fraction near the largest one with which they do
   subroutine explain_gas(scene, grains, text)
      !> Settings of the gas
      type(scene_settings_t), intent(in) :: scene
      !> The grains of the gas
      type(grains_settings_t), intent(in) :: grains
      !> The message
      character(len=:), allocatable, intent(out) :: text
      type(error_t), allocatable :: error
      type(grains_t) :: drawn
      type(random_t) :: random
      type(region_t) :: region
      real(wp), allocatable :: centres(:, :)
      character(len=:), allocatable :: fraction
      real(wp) :: area, fits, fails, low(2), high(2), trial
      ! Number of trials; below a millionth of the given fraction the bodies of the walls are the problem
      integer, parameter :: most_trials = 26
      integer(ip) :: n_found
      integer :: k

      area = area_of_grains(grains, scene%seed)
      allocate (centres(2, grains%number))
      region%is_box = .true.
      fits = 0.0_wp
      fails = scene%solid_fraction
      do k = 1, most_trials
         if (fits >= 0.98_wp*fails) exit
         trial = 0.5_wp*(fits + fails)
         ! The number that the message names is the one that was tried.
         fraction = to_text(trial, 2)
         read (fraction, *) trial
         if (trial <= fits .or. trial >= fails) exit
         call choose_box(scene, area/trial, low, high)
         region%corners = rectangle(low(1), high(1), low(2), high(2))
         random = new_random(scene%seed)
         call arrange_grains(grains, region, scene%seed, random, drawn, centres, n_found, error)
         if (n_found == grains%number) then
            fits = trial
         else
            fails = trial
         end if
      end do
      fraction = ''
      if (fits > 0.0_wp) fraction = ' to '//to_text(fits, 2)
      text = 'solid_fraction is too large for grains without overlap at the start; lower solid_fraction'//fraction// &
             ', or change width or long_axis'
   end subroutine explain_gas

end module polydem_gas
