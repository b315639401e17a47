!> Granular gas: grains with random velocities and no total momentum, spread over a closed box.
module polydem_gas
   use polydem_body_list, only: body_list_t
   use polydem_errors, only: error_t, input_error, raise
   use polydem_grains, only: append_grains, draw_grains, grain_t
   use polydem_kinds, only: ip, wp
   use polydem_lattice, only: fill_lattice, row_height
   use polydem_pour, only: draw_velocities, loose_spacing, shake
   use polydem_random, only: new_random, random_t
   use polydem_settings, only: scene_settings_t
   use polydem_walls, only: append_box, rectangle
   implicit none
   private
   public :: list_gas

contains

   !> List the bodies of the gas: grains first, then floor, left wall, right wall, lid. The centre is at 0.
   subroutine list_gas(scene, list, error)
      !> Settings: bodies (grains), fraction (of the box that the polygons cover), width, speed, grains
      type(scene_settings_t), intent(in) :: scene
      !> List to extend
      type(body_list_t), intent(inout) :: list
      !> If the fraction is too large for a start without overlaps
      type(error_t), allocatable, intent(inout) :: error
      type(random_t) :: random
      type(grain_t), allocatable :: grains(:)
      real(wp), allocatable :: centres(:, :), velocities(:, :)
      real(wp) :: area, width, inside(2, 4), spacing

      allocate (grains(scene%bodies), centres(2, scene%bodies), velocities(2, scene%bodies))
      random = new_random(scene%seed)
      call draw_grains(scene, random, grains)
      area = total_area(grains)/scene%fraction
      width = scene%width
      if (.not. width > 0.0_wp) width = sqrt(area)
      inside = rectangle(-0.5_wp*width, 0.5_wp*width, -0.5_wp*area/width, 0.5_wp*area/width)
      call spread_out(inside, loose_spacing(scene), centres, spacing)
      if (.not. spacing > 0.0_wp) then
         call raise(error, input_error, 'fraction is too large for grains that must not overlap at the start')
         return
      end if
      call shake(random, spacing - scene%long_axis_max, centres)
      call draw_velocities(random, 1.0_wp, velocities)
      call remove_momentum(grains, velocities)
      call set_speed(scene%speed, velocities)
      call append_grains(list, grains, centres, velocities, scene%density)
      call append_box(list, inside, scene%long_axis_max, closed=.true.)
   end subroutine list_gas

   pure real(wp) function total_area(grains)
      type(grain_t), intent(in) :: grains(:)
      integer :: k

      total_area = 0.0_wp
      do k = 1, size(grains)
         total_area = total_area + grains(k)%area
      end do
   end function total_area

   !> Widest lattice that has room for all points; spacing 0 if there is none as wide as the least.
   subroutine spread_out(inside, least, centres, spacing)
      real(wp), intent(in) :: inside(2, 4), least
      real(wp), intent(out) :: centres(:, :)
      real(wp), intent(out) :: spacing
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

   !> Subtract the velocity of the common centre of mass. All grains have the same density.
   pure subroutine remove_momentum(grains, velocities)
      type(grain_t), intent(in) :: grains(:)
      real(wp), intent(inout) :: velocities(:, :)
      real(wp) :: drift(2)
      integer :: k

      drift = 0.0_wp
      do k = 1, size(grains)
         drift = drift + grains(k)%area*velocities(:, k)
      end do
      drift = drift/total_area(grains)
      do k = 1, size(grains)
         velocities(:, k) = velocities(:, k) - drift
      end do
   end subroutine remove_momentum

   !> Scale the velocities to a given root of the mean square of the speed; a single grain stays at rest.
   pure subroutine set_speed(speed, velocities)
      real(wp), intent(in) :: speed
      real(wp), intent(inout) :: velocities(:, :)
      real(wp) :: squares
      integer :: k

      squares = 0.0_wp
      do k = 1, size(velocities, 2)
         squares = squares + velocities(1, k)**2 + velocities(2, k)**2
      end do
      if (size(velocities, 2) < 2) then
         velocities = 0.0_wp
      else
         velocities = speed*sqrt(real(size(velocities, 2), wp)/squares)*velocities
      end if
   end subroutine set_speed

end module polydem_gas
