!> The regions in which groups of grains start.
module polydem_regions
   use polydem_arrange, only: loose_spacing, region_t
   use polydem_grains, only: greatest_length
   use polydem_kinds, only: ip, wp
   use polydem_namelist_values, only: list_text
   use polydem_outlines, only: as_corners, draw_ring, inner_circle, inner_circle_t, is_across, is_apart, is_inside, &
      lies, rectangle
   use polydem_parts, only: parts_t
   use polydem_polygon, only: clean_polygon
   use polydem_polygon_list, only: polygon_list_t
   use polydem_settings, only: grains_settings_t
   use polydem_strings, only: to_text
   use polydem_wall_outlines, only: box_text, check_corners, inner_corners, is_anticlockwise, outline_wall, problem_t
   implicit none
   private
   public :: draw_region, check_walls, rounding_of, is_beside_walls

   !> Number of corners of the polygon in a disc
   integer(ip), parameter :: disc_corners = 96_ip

contains

   !> Draw the region of a group.
   subroutine draw_region(group, parts, region, problem)
      !> The group
      type(grains_settings_t), intent(in) :: group
      !> Parts, among which is the wall around the region
      type(parts_t), intent(in) :: parts
      !> Its corners; without obstacles
      type(region_t), intent(out) :: region
      !> Its text is allocated if there is no such region
      type(problem_t), intent(inout) :: problem
      real(wp), allocatable :: cleaned(:, :)
      integer :: k

      select case (group%region)
      case ('box')
         problem%key = 'high'
         if (.not. all(group%high > group%low)) problem%text = 'must be on the right of and above ''low''; write '// &
            box_text(group%low, group%high)
         region%corners = rectangle(group%low(1), group%high(1), group%low(2), group%high(2))
         region%is_box = .true.
         return
      case ('disc')
         call draw_ring(group%radius, disc_corners, region%corners)
         region%corners = region%corners + spread(group%centre, 2, size(region%corners, 2))
         return
      case ('polygon')
         problem%key = 'vertices'
         call check_corners(group%vertices, 3, 'vertices', problem)
         region%corners = as_corners(group%vertices)
      case default
         problem%key = 'wall'
         do k = 1, size(parts%walls)
            if (parts%walls(k)%name == group%wall) call inner_corners(parts%walls(k), region%corners)
         end do
         if (size(region%corners) == 0) problem%text = 'is '//group%wall//', which encloses nothing; name a wall '// &
            'with outline = ''ring'' or with closed = .true., or give another region'
      end select
      if (allocated(problem%text)) return
      call clean_polygon(region%corners, cleaned, problem%text)
      if (allocated(problem%text)) then
         problem%text = 'is a region that '//problem%text//'; make it of several groups, each with a convex region'
      else if (.not. is_anticlockwise(region%corners)) then
         region%corners = region%corners(:, size(region%corners, 2):1:-1)
         if (group%region == 'inside') problem%text = 'is '//group%wall//', whose corners are clockwise, so that '// &
            'its faces look outwards; give them in the opposite order'
      end if
   end subroutine draw_region

   !> Lengths in a region that are below rounding errors [m]
   pure real(wp) function rounding_of(region)
      type(region_t), intent(in) :: region

      associate (corners => region%corners)
         rounding_of = max(1.0e-9_wp*maxval(maxval(corners, 2) - minval(corners, 2)), &
                           64.0_wp*epsilon(1.0_wp)*maxval(abs(corners)))
      end associate
   end function rounding_of

   !> Check that no wall crosses the border of a region. Walls inside become obstacles.
   subroutine check_walls(group, parts, walls, wall_of, region, problem)
      !> The group that starts in the region
      type(grains_settings_t), intent(in) :: group
      !> Parts, of which the names of walls are used
      type(parts_t), intent(in) :: parts
      !> Polygons of all walls
      type(polygon_list_t), intent(in) :: walls
      !> Wall of each polygon
      integer(ip), intent(in) :: wall_of(:)
      !> Corners of the region; its obstacles are set
      type(region_t), intent(inout) :: region
      !> Its text is allocated if a wall crosses the region
      type(problem_t), intent(inout) :: problem
      type(inner_circle_t) :: circle
      real(wp) :: rounding
      integer(ip) :: k

      rounding = rounding_of(region)
      circle = inner_circle(region%corners)
      associate (corners => region%corners)
         call region%obstacles%start(minval(corners, 2), maxval(corners, 2), 2.0_wp*loose_spacing(group))
         do k = 1_ip, walls%n
            ! The bodies of the wall around a convex region are outside it, behind its edges.
            if (group%region == 'inside' .and. parts%walls(wall_of(k))%name == group%wall) cycle
            select case (lies(walls%polygon(k), corners, circle, rounding))
            case (is_apart)
               cycle
            case (is_inside)
               call region%obstacles%add(walls%polygon(k))
            case default
               problem%key = 'region'
               problem%text = 'is crossed by the wall '//parts%walls(wall_of(k))%name//remedy(group, region, walls)
               return
            end select
         end do
      end associate
   end subroutine check_walls

   !> Whether a group starts beside all walls, and its grains go nowhere that brings them to one
   logical function is_beside_walls(group, parts, ways) result(is_beside)
      !> The group
      type(grains_settings_t), intent(in) :: group
      !> Parts, of which the walls are used
      type(parts_t), intent(in) :: parts
      !> Whether its grains go against and along each axis, (axis, sense)
      logical, intent(in) :: ways(2, 2)
      type(region_t) :: region
      type(polygon_list_t) :: polygons
      type(problem_t) :: problem
      real(wp) :: low(2), high(2), bounds(4)
      integer :: k

      is_beside = .false.
      ! What a file of outlines has is not known here.
      if (group%shape == 'outline' .and. size(group%outline) == 0) return
      if (group%region == 'at') then
         ! A single grain is centred there, a column stands there.
         low = group%at - 0.5_wp*greatest_length(group)
         high = group%at + 0.5_wp*greatest_length(group)
         if (group%arrangement == 'column') high(2) = high(2) + real(group%number, wp)*group%height
      else
         call draw_region(group, parts, region, problem)
         low = minval(region%corners, 2)
         high = maxval(region%corners, 2)
      end if
      bounds = [huge(1.0_wp), huge(1.0_wp), -huge(1.0_wp), -huge(1.0_wp)]
      do k = 1, size(parts%walls)
         call outline_wall(parts%walls(k), polygons, problem)
         if (polygons%n == 0_ip) cycle
         associate (vertex => polygons%vertex(:, :polygons%first(polygons%n + 1_ip) - 1_ip))
            bounds = [min(bounds(1:2), minval(vertex, 2)), max(bounds(3:4), maxval(vertex, 2))]
         end associate
      end do
      where (ways(:, 1)) low = -huge(1.0_wp)
      where (ways(:, 2)) high = huge(1.0_wp)
      is_beside = any(low > bounds(3:4)) .or. any(high < bounds(1:2))
   end function is_beside_walls

   !> End of a message: a region that no wall crosses
   function remedy(group, region, walls) result(text)
      type(grains_settings_t), intent(in) :: group
      type(region_t), intent(in) :: region
      type(polygon_list_t), intent(in) :: walls
      character(len=:), allocatable :: text
      real(wp) :: low(2), high(2), middle(2), share
      type(region_t) :: smaller

      text = '; move the wall, or choose another region'
      select case (group%region)
      case ('box')
         low = group%low
         high = group%high
         call shrink_box(walls, rounding_of(region), low, high)
         if (all(high > low)) text = '; choose one between the walls, such as '//box_text(low, high)
      case ('disc', 'polygon')
         middle = sum(region%corners, 2)/real(size(region%corners, 2), wp)
         share = 0.95_wp
         do while (share > 0.01_wp)
            smaller%corners = spread(middle, 2, size(region%corners, 2)) &
                              + share*(region%corners - spread(middle, 2, size(region%corners, 2)))
            if (first_crossing(smaller%corners, walls, rounding_of(region)) == 0_ip) exit
            share = 0.95_wp*share
         end do
         if (share <= 0.01_wp) return
         if (group%region == 'disc') then
            text = '; choose one between the walls, such as radius = '//to_text(0.99_wp*share*group%radius, 3)
         else if (size(region%corners, 2) <= 8) then
            text = '; choose one between the walls, such as vertices = '//list_text(reshape(smaller%corners, &
                                                                              [size(smaller%corners)]))
         end if
      case default
         ! The wall around the region decides where it is.
      end select
   end function remedy

   !> First polygon that crosses the border of a convex outline; 0 if none does
   pure integer(ip) function first_crossing(corners, polygons, rounding) result(k)
      !> Corners of the outline, anticlockwise, (2, corner) [m]
      real(wp), intent(in) :: corners(:, :)
      type(polygon_list_t), intent(in) :: polygons
      !> Lengths that do not count [m]
      real(wp), intent(in) :: rounding
      type(inner_circle_t) :: circle

      circle = inner_circle(corners)
      do k = 1_ip, polygons%n
         if (lies(polygons%polygon(k), corners, circle, rounding) == is_across) return
      end do
      k = 0_ip
   end function first_crossing

   !> Cut pieces from the sides of a box until no polygon crosses it, each time the piece that leaves the largest box.
   pure subroutine shrink_box(polygons, rounding, low, high)
      type(polygon_list_t), intent(in) :: polygons
      real(wp), intent(in) :: rounding
      !> Corners of the box; high <= low if nothing is left [m]
      real(wp), intent(inout) :: low(2), high(2)
      real(wp) :: bounds(4), lows(2, 4), highs(2, 4), areas(4)
      integer(ip) :: k
      integer :: c

      do while (all(high > low))
         k = first_crossing(rectangle(low(1), high(1), low(2), high(2)), polygons, rounding)
         if (k == 0_ip) return
         bounds = [minval(polygons%polygon(k), 2), maxval(polygons%polygon(k), 2)]
         lows = spread(low, 2, 4)
         highs = spread(high, 2, 4)
         do c = 1, 2
            highs(c, c) = min(high(c), bounds(c))
            lows(c, c + 2) = max(low(c), bounds(c + 2))
         end do
         areas = product(max(0.0_wp, highs - lows), 1)
         c = maxloc(areas, 1)
         low = lows(:, c)
         high = highs(:, c)
      end do
   end subroutine shrink_box

end module polydem_regions
