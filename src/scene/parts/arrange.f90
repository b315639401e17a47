!> Places the grains of a group in a convex region: loose in rows from the bottom up, spread over the region, in one
!> row, at random, in cells of many sizes, or packed as in an earlier result.
module polydem_arrange
   use polydem_cut_cells, only: fit_cells
   use polydem_errors, only: error_t
   use polydem_grain_list, only: grains_t
   use polydem_grains, only: draw_grains, greatest_length
   use polydem_kinds, only: ip, wp
   use polydem_lattice, only: fill_lattice, row_height
   use polydem_obstacles, only: obstacles_t
   use polydem_outlines, only: contains_point, inner_circle, inner_circle_t
   use polydem_packing, only: pack_grains
   use polydem_polygon, only: mass_properties
   use polydem_random, only: new_random, random_t
   use polydem_settings, only: grains_settings_t
   use polydem_sizes, only: sizes_differ
   implicit none
   private
   public :: region_t, arrange_grains, area_of, loose_spacing, total_area

   !> Distance of loose grains over the greatest length of a grain
   real(wp), parameter :: loose_spacing_ratio = 1.02_wp
   !> Number of places that are tried for a grain at random
   integer, parameter :: most_trials = 5000

   !> Where the grains of a group start
   type :: region_t
      !> Corners of the convex region, anticlockwise, (2, corner) [m]
      real(wp), allocatable :: corners(:, :)
      !> Whether it is an upright rectangle, whose first corner is the lower left one
      logical :: is_box = .false.
      !> Bodies inside the region that are there before the group
      type(obstacles_t) :: obstacles
   end type region_t

contains

   !> Draw the grains of a group and find their places. The places of grains that are loose or spread out deviate a
   !> little from a lattice.
   subroutine arrange_grains(group, region, seed, random, grains, centres, n_found, error)
      !> Arrangement, shape, sizes and number of the grains
      type(grains_settings_t), intent(in) :: group
      type(region_t), intent(in) :: region
      !> Seed of the group
      integer(ip), intent(in) :: seed
      !> Random numbers of the group from their start
      type(random_t), intent(inout) :: random
      type(grains_t), intent(out) :: grains
      !> Centres of the grains, (2, grain) [m]; their number is given
      real(wp), intent(out) :: centres(:, :)
      !> Number of grains that fit; 0 if no such number is known
      integer(ip), intent(out) :: n_found
      !> Allocated if a packing cannot be read
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: play
      integer(ip) :: n

      n = size(centres, 2, kind=ip)
      if (group%arrangement == 'packing') then
         call pack_grains(group%packing, region%corners, grains, centres, n_found, error)
         return
      end if
      call draw_grains(group, random, n, grains)
      if (group%arrangement == 'random') then
         call place_at_random(region, seed, grains, centres, n_found)
      else if (sizes_differ(group)) then
         call fit_cells(region%corners, loose_spacing_ratio*grains%length, random, centres, play)
         n_found = merge(n, 0_ip, play > 0.0_wp)
      else
         select case (group%arrangement)
         case ('spread')
            call spread_out(group, region, centres, n_found, play)
         case ('row')
            call place_in_row(group, region, centres, n_found, play)
         case default
            call fill_lattice(region%corners, loose_spacing(group), centres, n_found, region%obstacles)
            play = loose_spacing(group) - greatest_length(group)
         end select
         if (n_found == n) call displace_randomly(random, play, centres)
      end if
   end subroutine arrange_grains

   !> Distance of the centres of loose grains on the lattice [m]
   pure real(wp) function loose_spacing(group)
      !> Shape of the grains
      type(grains_settings_t), intent(in) :: group

      loose_spacing = loose_spacing_ratio*greatest_length(group)
   end function loose_spacing

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

   !> Area of a region [m2]
   pure real(wp) function area_of(region)
      type(region_t), intent(in) :: region
      real(wp) :: centroid(2), second_moment

      associate (corners => region%corners)
         if (region%is_box) then
            area_of = (corners(1, 3) - corners(1, 1))*(corners(2, 3) - corners(2, 1))
         else
            call mass_properties(corners, area_of, centroid, second_moment)
         end if
      end associate
   end function area_of

   !> Find the lattice with the largest spacing on which all grains fit. Grains that may overlap need no least spacing.
   subroutine spread_out(group, region, centres, n_found, play)
      type(grains_settings_t), intent(in) :: group
      type(region_t), intent(in) :: region
      real(wp), intent(out) :: centres(:, :)
      !> Number of grains that fit
      integer(ip), intent(out) :: n_found
      !> Gap between neighbours [m]
      real(wp), intent(out) :: play
      real(wp) :: least, spacing

      least = 0.0_wp
      if (.not. group%overlap) least = loose_spacing(group)
      spacing = 1.1_wp*sqrt(area_of(region)/(row_height*real(size(centres, 2), wp)))
      do while (spacing >= least)
         call fill_lattice(region%corners, spacing, centres, n_found, region%obstacles)
         if (n_found == size(centres, 2)) then
            play = spacing
            if (.not. group%overlap) play = spacing - greatest_length(group)
            return
         end if
         spacing = 0.998_wp*spacing
      end do
      call fill_lattice(region%corners, least, centres, n_found, region%obstacles)
      play = 0.0_wp
   end subroutine spread_out

   !> Place grains in one row, evenly from left to right in the middle of the region.
   subroutine place_in_row(group, region, centres, n_found, play)
      type(grains_settings_t), intent(in) :: group
      type(region_t), intent(in) :: region
      real(wp), intent(out) :: centres(:, :)
      !> Number of grains that fit
      integer(ip), intent(out) :: n_found
      !> Gap between neighbours, or to the sides of the region [m]
      real(wp), intent(out) :: play
      real(wp) :: low(2), high(2), spacing
      integer(ip) :: k, n

      n = size(centres, 2, kind=ip)
      low = minval(region%corners, 2)
      high = maxval(region%corners, 2)
      spacing = (high(1) - low(1))/real(n, wp)
      play = min(spacing, high(2) - low(2)) - greatest_length(group)
      n_found = n
      if (spacing < loose_spacing(group) .or. play < 0.0_wp) then
         n_found = 0_ip
         if (high(2) - low(2) >= greatest_length(group)) n_found = int((high(1) - low(1))/loose_spacing(group), ip)
         return
      end if
      do k = 1_ip, n
         centres(:, k) = 0.5_wp*(low + high) + [spacing*(real(k, wp) - 0.5_wp*real(n + 1_ip, wp)), 0.0_wp]
         if (.not. region%obstacles%leaves(centres(:, k), 0.5_wp*(greatest_length(group) + play))) n_found = 0_ip
      end do
   end subroutine place_in_row

   !> Place grains one after the other, each at a random place where it touches nothing.
   subroutine place_at_random(region, seed, grains, centres, n_found)
      type(region_t), intent(in) :: region
      !> Seed of the group; the places have random numbers of their own, so that the first grains do not depend on the
      !> number of grains
      integer(ip), intent(in) :: seed
      type(grains_t), intent(in) :: grains
      real(wp), intent(out) :: centres(:, :)
      !> Number of grains that fit
      integer(ip), intent(out) :: n_found
      type(inner_circle_t) :: circle
      type(obstacles_t) :: obstacles
      type(random_t) :: random
      real(wp), allocatable :: corners(:, :)
      real(wp) :: low(2), high(2), place(2)
      integer(ip) :: k, p
      integer :: trial

      low = minval(region%corners, 2)
      high = maxval(region%corners, 2)
      circle = inner_circle(region%corners)
      obstacles = region%obstacles
      random = new_random(-1_ip - seed)
      do k = 1_ip, size(centres, 2, kind=ip)
         n_found = k
         do trial = 1, most_trials
            place(1) = random%between(low(1), high(1))
            place(2) = random%between(low(2), high(2))
            if (.not. contains_point(region%corners, circle, place, 0.5_wp*grains%length(k))) cycle
            if (obstacles%leaves(place, 0.5_wp*grains%length(k))) exit
         end do
         if (trial > most_trials) then
            n_found = k - 1_ip
            return
         end if
         centres(:, k) = place
         do p = 0_ip, grains%n_pieces(k) - 1_ip
            corners = grains%piece_polygon(k, p)
            call obstacles%add(corners + spread(place, 2, size(corners, 2)))
         end do
      end do
   end subroutine place_at_random

   !> Displace points at random. The distance of two points decreases by less than `play`.
   subroutine displace_randomly(random, play, centres)
      type(random_t), intent(inout) :: random
      !> Gap between neighbours [m]
      real(wp), intent(in) :: play
      !> Points, (2, point) [m]
      real(wp), intent(inout) :: centres(:, :)
      real(wp) :: most
      integer :: k

      ! The displacement of each point is less than sqrt(2) 0.35 play < play/2.
      most = 0.35_wp*play
      do k = 1, size(centres, 2)
         centres(1, k) = centres(1, k) + random%between(-most, most)
         centres(2, k) = centres(2, k) + random%between(-most, most)
      end do
   end subroutine displace_randomly

end module polydem_arrange
