!> Makes the bodies of a scene from its parts: first the groups of grains in their order, then the walls.
module polydem_place_parts
   use polydem_arrange, only: area_of, arrange_grains, region_t, total_area
   use polydem_body_list, only: body_list_t
   use polydem_column, only: pile_up
   use polydem_errors, only: error_t, input_error, raise
   use polydem_fit, only: explain
   use polydem_grain_list, only: grain_t, grains_t
   use polydem_grains, only: append_grains, draw_grains, greatest_length, most_corners_of
   use polydem_kinds, only: ip, lp, wp
   use polydem_outline_file, only: find_outlines
   use polydem_outlines, only: inner_circle, inner_circle_t, is_apart, lies
   use polydem_packing, only: rotate_with_walls
   use polydem_pair_parameters, only: density_of, material_number
   use polydem_parts, only: parts_t
   use polydem_polygon_list, only: polygon_list_t
   use polydem_random, only: new_random, random_t
   use polydem_regions, only: check_walls, draw_region, rounding_of
   use polydem_settings, only: grains_settings_t, settings_t
   use polydem_sizes, only: sizes_differ
   use polydem_source_locations, only: overrides_of, place_of
   use polydem_start_velocities, only: choose_moving_grains, draw_spins, draw_velocities, remove_momentum, set_speed
   use polydem_strings, only: quoted, to_text
   use polydem_voronoi, only: cut_blocks
   use polydem_wall, only: wall_t
   use polydem_wall_outlines, only: outline_wall, problem_t
   implicit none
   private
   public :: list_parts

   !> Greatest length of a region over the greatest length of a grain. Longer regions need too much time to fill
   real(wp), parameter :: longest_region = 1.0e5_wp
   !> Greatest number of corners of the grains of a group
   integer(lp), parameter :: most_corners = 2_lp**30
   !> Arrangements that fill an empty region with grains of their own
   character(len=*), parameter :: fills(2) = [character(len=7) :: 'packing', 'voronoi']

contains

   !> Append the bodies of the parts to a list.
   subroutine list_parts(parts, settings, others, list, walls, error)
      type(parts_t), intent(in) :: parts
      !> Settings: density and seed of &scene, groups &forces and &motion
      type(settings_t), intent(in) :: settings
      !> Polygons of bodies that are there already
      type(polygon_list_t), intent(in) :: others
      type(body_list_t), intent(inout) :: list
      !> The walls with their bodies
      type(wall_t), allocatable, intent(out) :: walls(:)
      !> First part that is wrong; the message begins with its place if it is a part of the namelist
      type(error_t), allocatable, intent(inout) :: error
      type(polygon_list_t) :: outlines, placed
      type(problem_t) :: problem
      integer(ip), allocatable :: wall_of(:)
      integer(ip) :: k

      call outline_walls(parts, outlines, wall_of, problem, k)
      if (allocated(problem%text)) then
         call raise_problem(parts, settings, 'wall', parts%walls(k)%name, problem, error)
         return
      end if
      placed = others
      do k = 1_ip, size(parts%grains, kind=ip)
         call list_group(parts, settings, k, outlines, wall_of, placed, list, problem, error)
         if (allocated(problem%text)) &
            call raise_problem(parts, settings, 'grains', parts%grains(k)%name, problem, error)
         if (allocated(error)) return
      end do
      allocate (walls(size(parts%walls)))
      do k = 1_ip, size(walls, kind=ip)
         walls(k)%name = parts%walls(k)%name
         walls(k)%id = parts%walls(k)%bodies
      end do
      do k = 1_ip, outlines%n
         call list%append(outlines%polygon(k), fixed=.true., material=material_of_wall(settings, parts, wall_of(k)))
         walls(wall_of(k))%id = [walls(wall_of(k))%id, list%last_id()]
      end do
   end subroutine list_parts

   !> Number of the material of a wall
   pure integer(ip) function material_of_wall(settings, parts, w) result(material)
      type(settings_t), intent(in) :: settings
      type(parts_t), intent(in) :: parts
      !> Number of the wall
      integer(ip), intent(in) :: w

      associate (scene => settings%scene, wall => parts%walls(w))
         if (wall%material /= '') then
            material = material_number(settings, wall%material)
         else if (scene%wall_material /= '') then
            material = material_number(settings, scene%wall_material)
         else
            material = material_number(settings, scene%material)
         end if
      end associate
   end function material_of_wall

   !> Raise an error about an entry of a part. The error of a recipe names no entry; its place is known to the caller.
   subroutine raise_problem(parts, settings, kind, name, problem, error)
      type(parts_t), intent(in) :: parts
      type(settings_t), intent(in) :: settings
      !> Group and name of the part
      character(len=*), intent(in) :: kind, name
      type(problem_t), intent(in) :: problem
      type(error_t), allocatable, intent(inout) :: error

      if (parts%recipe /= '') then
         call raise(error, input_error, problem%text)
      else
         call raise(error, input_error, place_of(settings, kind//'.'//name, problem%key)//': '''//problem%key// &
                    ''' in &'//kind//' '//name//' '//problem%text//overrides_of(settings, 'grains')// &
                    overrides_of(settings, 'wall'))
      end if
   end subroutine raise_problem

   !> List the polygons of all walls.
   subroutine outline_walls(parts, outlines, wall_of, problem, w)
      type(parts_t), intent(in) :: parts
      !> Polygons, wall after wall
      type(polygon_list_t), intent(inout) :: outlines
      !> Wall of each polygon
      integer(ip), allocatable, intent(out) :: wall_of(:)
      type(problem_t), intent(inout) :: problem
      !> Wall that has the problem
      integer(ip), intent(out) :: w
      type(polygon_list_t) :: polygons
      integer(ip) :: k

      allocate (wall_of(0))
      do w = 1_ip, size(parts%walls, kind=ip)
         call outline_wall(parts%walls(w), polygons, problem)
         if (allocated(problem%text)) return
         do k = 1_ip, polygons%n
            call outlines%append_polygon(polygons%polygon(k))
         end do
         wall_of = [wall_of, spread(w, 1, polygons%n)]
      end do
   end subroutine outline_walls

   !> Append the grains of a group to the list.
   subroutine list_group(parts, settings, number, walls, wall_of, placed, list, problem, error)
      type(parts_t), intent(in) :: parts
      type(settings_t), intent(in) :: settings
      !> Number of the group
      integer(ip), intent(in) :: number
      !> Polygons of all walls, and the wall of each of them
      type(polygon_list_t), intent(in) :: walls
      integer(ip), intent(in) :: wall_of(:)
      !> Polygons of all bodies before this group; those of the group are added
      type(polygon_list_t), intent(inout) :: placed
      type(body_list_t), intent(inout) :: list
      type(problem_t), intent(inout) :: problem
      type(error_t), allocatable, intent(inout) :: error
      type(grains_settings_t) :: group
      type(region_t) :: region
      type(random_t) :: random
      type(grains_t) :: grains
      real(wp), allocatable :: centres(:, :), velocities(:, :), spins(:)
      real(wp) :: density
      integer(ip) :: material, n_found, seed

      group = parts%grains(number)
      if (group%material == '') group%material = settings%scene%material
      material = material_number(settings, group%material)
      density = group%density
      if (.not. density > 0.0_wp) density = density_of(settings, material)
      seed = group%seed
      if (seed == 0_ip) seed = int(modulo(int(settings%scene%seed, lp) + number - 1_lp, int(huge(seed), lp)), ip)
      if (group%shape == 'outline') call find_outlines(settings, group, problem, error)
      if (allocated(error)) return
      if (allocated(problem%text)) return
      random = new_random(seed)
      if (group%arrangement == 'column' .or. group%arrangement == 'single') then
         call place_bodies(parts, group, density, settings, walls, wall_of, random, grains, centres, problem)
      else
         call prepare_region(parts, walls, wall_of, placed, seed, group, region, problem)
         if (allocated(problem%text)) return
         allocate (centres(2, group%number))
         call fill_region(group, region, seed, random, grains, centres, n_found, problem, error)
         if (allocated(error) .and. parts%recipe == '') error%message = &
            place_of(settings, 'grains.'//group%name, 'packing')//': &grains '//group%name//': '//error%message
         if (allocated(error)) return
         if (n_found < group%number) then
            call explain(parts%recipe, parts%grains(number), group, region, seed, n_found, problem)
            return
         end if
      end if
      if (allocated(problem%text)) return
      allocate (velocities(2, group%number), spins(group%number))
      call find_velocities(group, grains%area, random, velocities, spins)
      if (group%arrangement == 'packing') &
         call rotate_with_walls(settings%motion, group%wall, centres, velocities, spins)
      call append_grains(list, group, density, material, grains, centres, velocities, spins)
      if (number < size(parts%grains)) call add_pieces(grains, centres, placed)
   end subroutine list_group

   !> Add the pieces of grains to the polygons that later groups must leave.
   subroutine add_pieces(grains, centres, placed)
      type(grains_t), intent(in) :: grains
      real(wp), intent(in) :: centres(:, :)
      type(polygon_list_t), intent(inout) :: placed
      real(wp), allocatable :: corners(:, :)
      integer(ip) :: k, p

      do k = 1_ip, grains%n
         do p = 0_ip, grains%n_pieces(k) - 1_ip
            corners = grains%piece_polygon(k, p)
            call placed%append_polygon(corners + spread(centres(:, k), 2, size(corners, 2)))
         end do
      end do
   end subroutine add_pieces

   !> Fill a region with blocks, or arrange grains in it.
   subroutine fill_region(group, region, seed, random, grains, centres, n_found, problem, error)
      type(grains_settings_t), intent(in) :: group
      type(region_t), intent(in) :: region
      integer(ip), intent(in) :: seed
      type(random_t), intent(inout) :: random
      type(grains_t), intent(out) :: grains
      real(wp), intent(out) :: centres(:, :)
      !> Number of grains that fit
      integer(ip), intent(out) :: n_found
      type(problem_t), intent(inout) :: problem
      type(error_t), allocatable, intent(inout) :: error

      n_found = group%number
      if (group%arrangement == 'voronoi') then
         call cut_blocks(region%corners, area_of(region), group, random, grains, centres, problem)
      else
         call arrange_grains(group, region, seed, random, grains, centres, n_found, error)
      end if
   end subroutine fill_region

   !> Place a single body, or a column of bodies, where the group says.
   subroutine place_bodies(parts, group, density, settings, walls, wall_of, random, grains, centres, problem)
      type(parts_t), intent(in) :: parts
      type(grains_settings_t), intent(in) :: group
      real(wp), intent(in) :: density
      type(settings_t), intent(in) :: settings
      !> Polygons of all walls, and the wall of each of them
      type(polygon_list_t), intent(in) :: walls
      integer(ip), intent(in) :: wall_of(:)
      type(random_t), intent(inout) :: random
      type(grains_t), intent(out) :: grains
      real(wp), allocatable, intent(out) :: centres(:, :)
      type(problem_t), intent(inout) :: problem
      type(error_t), allocatable :: too_heavy
      type(grain_t) :: grain
      real(wp), allocatable :: corners(:, :, :)
      integer(ip) :: materials(size(wall_of)), k

      allocate (centres(2, group%number))
      if (group%arrangement == 'single') then
         centres = spread(group%at, 2, 1)
         call draw_grains(group, random, 1_ip, grains)
         return
      end if
      materials = [(material_of_wall(settings, parts, wall_of(k)), k=1_ip, size(wall_of, kind=ip))]
      call pile_up(group, density, settings, walls, materials, corners, too_heavy)
      if (allocated(too_heavy)) then
         problem%key = 'height'
         problem%text = too_heavy%message
         if (parts%recipe == '') problem%text = 'does not bear the load: '//problem%text
         return
      end if
      centres = 0.0_wp
      call grains%start(group%number, 4_ip)
      grain%length = greatest_length(group)
      grain%area = group%width*group%height
      do k = 1_ip, group%number
         grain%corners = corners(:, :, k)
         call grains%append(grain)
      end do
   end subroutine place_bodies

   !> Find the region of a group with its obstacles, and the number of its grains.
   subroutine prepare_region(parts, walls, wall_of, placed, seed, group, region, problem)
      type(parts_t), intent(in) :: parts
      !> Polygons of all walls, the wall of each of them, and polygons of the bodies before the group
      type(polygon_list_t), intent(in) :: walls, placed
      integer(ip), intent(in) :: wall_of(:), seed
      !> The number is set unless it is given
      type(grains_settings_t), intent(inout) :: group
      type(region_t), intent(out) :: region
      type(problem_t), intent(inout) :: problem

      call draw_region(group, parts, region, problem)
      if (.not. allocated(problem%text)) call check_walls(group, parts, walls, wall_of, region, problem)
      if (.not. allocated(problem%text)) call add_obstacles(group, placed, region, problem)
      if (allocated(problem%text)) return
      if (group%number == 0_ip) call choose_number(region, seed, group)
      call check_size(region, group, problem)
   end subroutine prepare_region

   !> Add the bodies that meet a region to its obstacles.
   subroutine add_obstacles(group, placed, region, problem)
      type(grains_settings_t), intent(in) :: group
      type(polygon_list_t), intent(in) :: placed
      type(region_t), intent(inout) :: region
      type(problem_t), intent(inout) :: problem
      type(inner_circle_t) :: circle
      real(wp) :: low(2), high(2), rounding
      integer(ip) :: k

      rounding = rounding_of(region)
      circle = inner_circle(region%corners)
      low = minval(region%corners, 2)
      high = maxval(region%corners, 2)
      do k = 1_ip, placed%n
         associate (corners => placed%vertex(:, placed%first(k):placed%first(k + 1_ip) - 1_ip))
            if (any(minval(corners, 2) > high) .or. any(maxval(corners, 2) < low)) cycle
            if (lies(corners, region%corners, circle, rounding) == is_apart) cycle
            call region%obstacles%add(corners)
         end associate
      end do
      if (group%arrangement == 'random' .or. (all(group%arrangement /= fills) .and. .not. sizes_differ(group))) return
      problem%key = 'region'
      if (region%obstacles%polygons%n > 0_ip) then
         problem%text = 'contains other bodies, but '
         if (any(group%arrangement == fills)) then
            problem%text = problem%text//'arrangement = '//quoted(group%arrangement)
         else
            problem%text = problem%text//'sizes = '//quoted(group%sizes)
         end if
         problem%text = problem%text//' needs an empty one; choose another region, or put the group before the others'
      else if (all(group%arrangement /= fills) .and. .not. region%is_box) then
         problem%text = 'must be ''box'' for grains of many sizes in rows; or write arrangement = ''random'''
      end if
   end subroutine add_obstacles

   !> Choose the number of grains that cover the given fraction of a region.
   subroutine choose_number(region, seed, group)
      type(region_t), intent(in) :: region
      integer(ip), intent(in) :: seed
      !> The number is set
      type(grains_settings_t), intent(inout) :: group
      type(random_t) :: random
      type(grains_t) :: grains
      real(wp) :: wanted
      integer(ip) :: former
      integer :: k

      wanted = group%solid_fraction*area_of(region)
      group%number = 1000_ip
      do k = 1, 10
         random = new_random(seed)
         call draw_grains(group, random, group%number, grains)
         former = group%number
         group%number = int(min(1.0e9_wp, max(1.0_wp, anint(real(former, wp)*(wanted/total_area(grains%area))))), ip)
         if (group%number == former .or. group%number*most_corners_of(group) > most_corners) exit
      end do
   end subroutine choose_number

   !> Check that a region is not much larger than a grain, and that there are not too many corners.
   pure subroutine check_size(region, group, problem)
      type(region_t), intent(in) :: region
      type(grains_settings_t), intent(in) :: group
      type(problem_t), intent(inout) :: problem
      real(wp) :: extent

      if (any(group%arrangement == fills)) return
      extent = maxval(maxval(region%corners, 2) - minval(region%corners, 2))
      problem%key = 'region'
      if (extent > longest_region*greatest_length(group)) problem%text = 'is '//to_text(extent, 3)// &
         ' m long, more than 1e5 times the greatest length of a grain, '//to_text(greatest_length(group), 3)// &
         ' m; give larger grains, or a region of at most '// &
         to_text(0.99_wp*longest_region*greatest_length(group), 2)//' m'
      if (group%number*most_corners_of(group) <= most_corners) return
      problem%key = 'solid_fraction'
      problem%text = 'asks for '//to_text(group%number)//' grains, but at most '// &
         to_text(most_corners/most_corners_of(group))//' with so many corners are possible; lower it to '// &
         to_text(0.9_wp*group%solid_fraction*real(most_corners/most_corners_of(group), wp)/real(group%number, wp), 2)
   end subroutine check_size

   !> Find the velocities and angular velocities of the grains of a group.
   subroutine find_velocities(group, areas, random, velocities, spins)
      type(grains_settings_t), intent(in) :: group
      !> Area of each grain, (grain) [m2]
      real(wp), intent(in) :: areas(:)
      type(random_t), intent(inout) :: random
      !> Velocities, (2, grain) [m/s], and angular velocities, (grain) [rad/s]
      real(wp), intent(out) :: velocities(:, :), spins(:)
      logical, allocatable :: moves(:)

      if (group%momentum == 'zero') then
         call draw_velocities(random, 1.0_wp, velocities)
         moves = choose_moving_grains(size(areas, kind=ip), group%moving_grains)
         if (count(moves) > 1) call remove_momentum(areas, moves, velocities)
         call set_speed(group%speed, moves, velocities)
      else if (group%speed > 0.0_wp .or. group%region /= 'at') then
         call draw_velocities(random, group%speed, velocities)
      else
         velocities = spread(group%velocity, 2, size(areas))
      end if
      if (any(abs(group%velocity) > 0.0_wp) .and. (group%speed > 0.0_wp .or. group%region /= 'at')) &
         velocities = velocities + spread(group%velocity, 2, size(areas))
      call draw_spins(random, group%spin, spins)
   end subroutine find_velocities

end module polydem_place_parts
