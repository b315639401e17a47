!> Rectangles on top of each other at rest. The depth of each contact carries the weight above it.
module polydem_column
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, wp
   use polydem_outlines, only: rectangle
   use polydem_pair_parameters, only: material_number
   use polydem_polygon_list, only: polygon_list_t
   use polydem_settings, only: grains_settings_t, settings_t
   use polydem_static_depth, only: resting_block_t, static_depth
   implicit none
   private
   public :: pile_up

contains

   !> Compute the corners of the rectangles from the bottom up. The lowest one sinks into the wall below the foot, if
   !> there is one.
   subroutine pile_up(group, density, settings, walls, materials, corners, error)
      !> Number, width, height and material of the rectangles, and foot of the column
      type(grains_settings_t), intent(in) :: group
      !> Density [kg/m3]
      real(wp), intent(in) :: density
      !> Gravity, law and materials
      type(settings_t), intent(in) :: settings
      !> Polygons of all walls
      type(polygon_list_t), intent(in) :: walls
      !> Material of each polygon
      integer(ip), intent(in) :: materials(:)
      !> Corners of each rectangle, (2, 4, rectangle) [m]
      real(wp), allocatable, intent(out) :: corners(:, :, :)
      !> Allocated if the rectangles are too heavy for the stiffness
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: weight, bottom, depth, support(2), offset
      integer(ip) :: k, own, below

      allocate (corners(2, 4, group%number))
      own = material_number(settings, group%material)
      call find_support(group%at, walls, materials, support, offset, below)
      associate (n => group%number, width => group%width, height => group%height, foot => group%at)
         weight = density*width*height*max(0.0_wp, -settings%forces%gravity(2))
         bottom = foot(2)
         do k = 1_ip, n
            depth = 0.0_wp
            if (support(1) > 0.0_wp) call static_depth(settings, resting_block_t(real(n - k + 1_ip, wp)*weight, &
               width, height, max(width, support(1)), support(2), offset, [own, below]), depth, error)
            if (allocated(error)) return
            bottom = bottom - depth
            corners(:, :, k) = rectangle(foot(1) - 0.5_wp*width, foot(1) + 0.5_wp*width, bottom, bottom + height)
            bottom = bottom + height
            support = [width, height]
            offset = 0.0_wp
            below = own
         end do
      end associate
   end subroutine pile_up

   !> Find the wall whose upper side is below the foot of a column: its width and height, and how far its middle is from
   !> the foot. The width is 0 if there is none.
   pure subroutine find_support(foot, walls, materials, support, offset, below)
      real(wp), intent(in) :: foot(2)
      type(polygon_list_t), intent(in) :: walls
      integer(ip), intent(in) :: materials(:)
      !> Width and height of the wall [m]
      real(wp), intent(out) :: support(2)
      !> Distance of the middle from the foot [m]
      real(wp), intent(out) :: offset
      !> Material of the wall
      integer(ip), intent(out) :: below
      real(wp) :: low(2), high(2)
      integer(ip) :: k

      support = 0.0_wp
      offset = 0.0_wp
      below = 0_ip
      do k = 1_ip, walls%n
         associate (corners => walls%vertex(:, walls%first(k):walls%first(k + 1_ip) - 1_ip))
            low = minval(corners, 2)
            high = maxval(corners, 2)
         end associate
         if (foot(1) < low(1) .or. foot(1) > high(1)) cycle
         if (abs(foot(2) - high(2)) > 1.0e-6_wp*maxval(high - low)) cycle
         support = high - low
         offset = abs(foot(1) - 0.5_wp*(low(1) + high(1)))
         below = materials(k)
         return
      end do
   end subroutine find_support

end module polydem_column
