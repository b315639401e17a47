!> The bodies of a wall: convex polygons that follow from its outline.
module polydem_wall_outlines
   use polydem_elementary, only: cosine, hypotenuse, sine, pi
   use polydem_kinds, only: ip, wp
   use polydem_namelist_values, only: list_text
   use polydem_outlines, only: as_corners, draw_ring, rectangle
   use polydem_polygon, only: clean_polygon, cross
   use polydem_polygon_list, only: polygon_list_t
   use polydem_settings, only: wall_settings_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: outline_wall, inner_corners, draw_segments, problem_t, check_corners, box_text, is_anticlockwise

   !> What is wrong with an entry of a part
   type :: problem_t
      !> Key of the entry
      character(len=:), allocatable :: key
      !> What is wrong and what would be right, as a predicate; not allocated if nothing is wrong
      character(len=:), allocatable :: text
   end type problem_t

   !> Shares of the length of a face, and of the thickness, that count as nothing
   real(wp), parameter :: nothing = 1.0e-9_wp

contains

   !> List the polygons of a wall, anticlockwise.
   subroutine outline_wall(wall, polygons, problem)
      !> The wall
      type(wall_settings_t), intent(in) :: wall
      !> Polygons; none if the wall consists of bodies of a file
      type(polygon_list_t), intent(out) :: polygons
      !> Its text is allocated if the outline cannot be drawn
      type(problem_t), intent(inout) :: problem

      select case (wall%outline)
      case ('line')
         call outline_faces(reshape([wall%from, wall%to], [2, 2]), .false., wall%thickness, polygons, problem)
         if (allocated(problem%text)) problem%key = 'to'
      case ('polyline')
         call outline_polyline(wall, polygons, problem)
      case ('rectangle')
         call outline_rectangle(wall, polygons, problem)
      case ('ring')
         call outline_ring(wall, polygons)
      case ('row')
         call outline_row(wall, polygons, problem)
      case ('polygon')
         call outline_polygon(wall, polygons, problem)
      case default
         ! The bodies of a file have outlines of their own.
      end select
      if (.not. allocated(problem%text)) call check_thickness(wall, polygons, problem)
   end subroutine outline_wall

   !> Check that the bodies of a wall have an area in spite of rounding errors.
   subroutine check_thickness(wall, polygons, problem)
      type(wall_settings_t), intent(in) :: wall
      type(polygon_list_t), intent(in) :: polygons
      type(problem_t), intent(inout) :: problem
      real(wp), allocatable :: cleaned(:, :)
      integer(ip) :: k

      do k = 1_ip, polygons%n
         call clean_polygon(polygons%polygon(k), cleaned, problem%text)
         if (.not. allocated(problem%text)) cycle
         problem%key = 'thickness'
         if (wall%outline == 'rectangle') problem%key = 'high'
         if (wall%outline == 'row') problem%key = 'radius'
         problem%text = 'makes a body that '//problem%text//'; give more thickness, for example '// &
            to_text(1.0e-4_wp*maxval(abs(polygons%polygon(k))), 2)
         return
      end do
   end subroutine check_thickness

   !> Corners of the space that a wall encloses, anticlockwise, (2, corner) [m]; none if it encloses none
   subroutine inner_corners(wall, corners)
      !> A ring, or a closed polyline
      type(wall_settings_t), intent(in) :: wall
      !> The corners
      real(wp), allocatable, intent(out) :: corners(:, :)
      integer(ip) :: k

      if (wall%outline == 'ring') then
         call draw_ring(wall%radius, wall%segments, corners)
         do k = 1_ip, wall%segments
            corners(:, k) = corners(:, k) + wall%centre
         end do
      else if (wall%outline == 'polyline' .and. wall%closed) then
         corners = as_corners(wall%vertices)
      else
         allocate (corners(2, 0))
      end if
   end subroutine inner_corners

   !> List the rectangle, turned about its centre.
   subroutine outline_rectangle(wall, polygons, problem)
      type(wall_settings_t), intent(in) :: wall
      type(polygon_list_t), intent(inout) :: polygons
      type(problem_t), intent(inout) :: problem
      real(wp) :: corners(2, 4), arm(2), middle(2), c, s
      integer :: k

      if (.not. all(wall%high > wall%low)) then
         problem%key = 'high'
         problem%text = 'must be on the right of and above ''low''; write '//box_text(wall%low, wall%high)
         return
      end if
      corners = rectangle(wall%low(1), wall%high(1), wall%low(2), wall%high(2))
      if (abs(wall%angle) > 0.0_wp) then
         middle = 0.5_wp*(wall%low + wall%high)
         c = cosine(wall%angle*pi/180.0_wp)
         s = sine(wall%angle*pi/180.0_wp)
         do k = 1, 4
            arm = corners(:, k) - middle
            corners(:, k) = middle + [c*arm(1) - s*arm(2), s*arm(1) + c*arm(2)]
         end do
      end if
      call polygons%append_polygon(corners)
   end subroutine outline_rectangle

   !> Both corners of a rectangle as namelist entries; sides without a length get one
   pure function box_text(low, high) result(text)
      !> Any two opposite corners [m]
      real(wp), intent(in) :: low(2), high(2)
      character(len=:), allocatable :: text
      real(wp) :: upper(2)

      upper = max(low, high)
      where (.not. upper > min(low, high)) upper = upper + max(1.0e-2_wp, maxval(abs(high - low)))
      text = 'low = '//list_text(min(low, high))//', high = '//list_text(upper)
   end function box_text

   !> List the segments of a ring.
   subroutine outline_ring(wall, polygons)
      type(wall_settings_t), intent(in) :: wall
      type(polygon_list_t), intent(inout) :: polygons
      real(wp), allocatable :: corners(:, :, :)
      integer(ip) :: k

      call draw_segments(wall%radius, wall%thickness, wall%segments, corners)
      do k = 1_ip, wall%segments
         call polygons%append_polygon(corners(:, :, k) + spread(wall%centre, 2, 4))
      end do
   end subroutine outline_ring

   !> List the grains of a row: regular polygons at even distances along a line. Those of a line that is as long as a
   !> periodic cell have this distance across its border, too.
   subroutine outline_row(wall, polygons, problem)
      type(wall_settings_t), intent(in) :: wall
      type(polygon_list_t), intent(inout) :: polygons
      type(problem_t), intent(inout) :: problem
      real(wp), allocatable :: corners(:, :)
      real(wp) :: centre(2)
      integer(ip) :: k

      if (.not. any(abs(wall%to - wall%from) > 0.0_wp)) then
         problem%key = 'to'
         problem%text = 'is the same point as ''from''; give another one, for example '// &
            list_text(wall%from + [2.0_wp*wall%radius*real(wall%segments, wp), 0.0_wp])
         return
      end if
      call draw_ring(wall%radius, wall%corners, corners)
      do k = 1_ip, wall%segments
         centre = wall%from + (real(k, wp) - 0.5_wp)/real(wall%segments, wp)*(wall%to - wall%from)
         call polygons%append_polygon(corners + spread(centre, 2, int(wall%corners)))
      end do
   end subroutine outline_row

   !> Compute the corners of the segments of a ring. Neighbouring segments share corners with identical bits.
   subroutine draw_segments(radius, thickness, n, corners)
      !> Distance of the inner corners from the origin [m]
      real(wp), intent(in) :: radius
      !> Radial distance between inner and outer corners [m]
      real(wp), intent(in) :: thickness
      !> Number of segments
      integer(ip), intent(in) :: n
      !> Corners of each segment, anticlockwise, (2, 4, n) [m]: inner and outer corner at its start, outer and inner
      !> corner at its end
      real(wp), allocatable, intent(out) :: corners(:, :, :)
      real(wp), allocatable :: inner(:, :), outer(:, :)
      integer(ip) :: k, next

      call draw_ring(radius, n, inner)
      call draw_ring(radius + thickness, n, outer)
      allocate (corners(2, 4, n))
      do k = 1_ip, n
         next = modulo(k, n) + 1_ip
         corners(:, 1, k) = inner(:, k)
         corners(:, 2, k) = outer(:, k)
         corners(:, 3, k) = outer(:, next)
         corners(:, 4, k) = inner(:, next)
      end do
   end subroutine draw_segments

   !> List a convex polygon.
   subroutine outline_polygon(wall, polygons, problem)
      type(wall_settings_t), intent(in) :: wall
      type(polygon_list_t), intent(inout) :: polygons
      type(problem_t), intent(inout) :: problem
      real(wp), allocatable :: cleaned(:, :)
      real(wp) :: corners(2, size(wall%vertices)/2)

      call check_corners(wall%vertices, 3, 'vertices', problem)
      if (allocated(problem%text)) return
      corners = as_corners(wall%vertices)
      call clean_polygon(corners, cleaned, problem%text)
      if (allocated(problem%text)) then
         problem%text = problem%text//'; make it of several walls, each with a convex outline'//hull_text(corners)
      else if (is_anticlockwise(corners)) then
         call polygons%append_polygon(corners)
      else
         call polygons%append_polygon(corners(:, size(corners, 2):1:-1))
      end if
   end subroutine outline_polygon

   !> List the bodies of a polyline, one for each of its faces.
   subroutine outline_polyline(wall, polygons, problem)
      type(wall_settings_t), intent(in) :: wall
      type(polygon_list_t), intent(inout) :: polygons
      type(problem_t), intent(inout) :: problem

      call check_corners(wall%vertices, merge(3, 2, wall%closed), 'vertices', problem)
      if (allocated(problem%text)) return
      call outline_faces(as_corners(wall%vertices), wall%closed, wall%thickness, polygons, problem)
   end subroutine outline_polyline

   !> Check that a list contains the x and y of enough corners.
   pure subroutine check_corners(values, least, key, problem)
      !> List x1, y1, x2, y2, ... [m]
      real(wp), intent(in) :: values(:)
      !> Smallest number of corners
      integer, intent(in) :: least
      !> Key of the list
      character(len=*), intent(in) :: key
      !> Its text is allocated if there are not enough corners, or half a one
      type(problem_t), intent(inout) :: problem

      problem%key = key
      if (modulo(size(values), 2) == 1) then
         problem%text = 'has '//to_text(int(size(values), ip))//' values; give x and y of each corner, as in '// &
            '0, 0, 0.1, 0, 0.1, 0.1'
      else if (size(values) < 2*least) then
         problem%text = 'has '//to_text(int(size(values)/2, ip))//' corners, but needs at least '// &
            to_text(int(least, ip))//'; for example 0, 0, 0.1, 0, 0.1, 0.1'
      end if
   end subroutine check_corners

   !> List the bodies behind the faces of a polyline. The joints are mitred: neighbours share an edge, so that there is
   !> neither a gap nor a step.
   subroutine outline_faces(corners, closed, thickness, polygons, problem)
      !> Corners, (2, corner) [m]
      real(wp), intent(in) :: corners(:, :)
      !> Whether a face joins the last corner to the first
      logical, intent(in) :: closed
      !> Thickness on the right of the faces [m]
      real(wp), intent(in) :: thickness
      type(polygon_list_t), intent(inout) :: polygons
      type(problem_t), intent(inout) :: problem
      real(wp) :: miter(2, size(corners, 2)), outer(2, size(corners, 2)), least, most
      integer :: k, next, n, n_faces

      problem%key = 'vertices'
      n = size(corners, 2)
      n_faces = merge(n, n - 1, closed)
      least = nothing*maxval(abs(corners)) + tiny(1.0_wp)
      do k = 1, n_faces
         next = modulo(k, n) + 1
         if (hypotenuse(corners(1, next) - corners(1, k), corners(2, next) - corners(2, k)) > least) cycle
         problem%text = 'is a line of zero length from '//list_text(corners(:, k))//' to the same point; for '// &
            'example '//list_text(corners(:, k) + [max(1.0_wp, 10.0_wp*thickness), 0.0_wp])//' is another'
         return
      end do
      call find_miters(corners, closed, miter, problem)
      if (allocated(problem%text)) return
      outer = corners + thickness*miter
      do k = 1, n_faces
         next = modulo(k, n) + 1
         ! How far a face may be shifted until mitred joints meet
         associate (face => corners(:, next) - corners(:, k), shift => miter(:, next) - miter(:, k))
            most = -(shift(1)*face(1) + shift(2)*face(2))
            if (most*thickness < (1.0_wp - nothing)*(face(1)**2 + face(2)**2)) cycle
            most = (face(1)**2 + face(2)**2)/most
         end associate
         problem%key = 'thickness'
         problem%text = 'is too large for the corners of the face from '//list_text(corners(:, k))//' to '// &
            list_text(corners(:, next))//'; it must be below '//to_text(most, 3)//', for example '// &
            to_text(0.5_wp*most, 2)
         return
      end do
      do k = 1, n_faces
         next = modulo(k, n) + 1
         call polygons%append_polygon(reshape([corners(:, k), outer(:, k), outer(:, next), corners(:, next)], [2, 4]))
      end do
   end subroutine outline_faces

   !> Find how far each corner is shifted for a wall of unit thickness.
   pure subroutine find_miters(corners, closed, miter, problem)
      real(wp), intent(in) :: corners(:, :)
      logical, intent(in) :: closed
      !> Shift to the right of the faces, (2, corner)
      real(wp), intent(out) :: miter(:, :)
      type(problem_t), intent(inout) :: problem
      real(wp) :: normal(2, 0:size(corners, 2)), length
      integer :: k, n
      ! Smallest square of the cosine of half the angle between neighbouring faces. Joints are at most ten times as
      ! long as the wall is thick
      real(wp), parameter :: sharpest = 0.01_wp

      n = size(corners, 2)
      do k = 1, n
         associate (face => corners(:, modulo(k, n) + 1) - corners(:, k))
            length = hypotenuse(face(1), face(2))
            normal(:, k) = [face(2), -face(1)]/length
         end associate
      end do
      normal(:, 0) = normal(:, n)
      if (.not. closed) normal(:, 0) = normal(:, 1)
      if (.not. closed) normal(:, n) = normal(:, n - 1)
      do k = 1, n
         associate (before => normal(:, k - 1), behind => normal(:, k))
            length = 1.0_wp + before(1)*behind(1) + before(2)*behind(2)
            if (length < 2.0_wp*sharpest) then
               problem%text = 'turns back at '//list_text(corners(:, k))//'; leave out this corner, or make two walls'
               return
            end if
            miter(:, k) = (before + behind)/length
         end associate
      end do
   end subroutine find_miters

   !> Whether a convex polygon is anticlockwise
   pure logical function is_anticlockwise(corners)
      !> Corners, (2, corner) [m]
      real(wp), intent(in) :: corners(:, :)
      real(wp) :: area
      integer :: k

      area = 0.0_wp
      do k = 2, size(corners, 2) - 1
         area = area + cross(corners(:, k) - corners(:, 1), corners(:, k + 1) - corners(:, 1))
      end do
      is_anticlockwise = area > 0.0_wp
   end function is_anticlockwise

   !> End of a message: the corners of the convex hull of points, if there are not too many
   pure function hull_text(points) result(text)
      !> Points, (2, :) [m]
      real(wp), intent(in) :: points(:, :)
      character(len=:), allocatable :: text
      real(wp) :: hull(2, size(points, 2))
      ! Most corners that a message lists
      integer, parameter :: most = 8
      integer :: first, n, next

      text = ''
      ! Walk round the points (Jarvis 1973), from the lowest of the leftmost ones.
      first = minloc(points(2, :), 1, points(1, :) <= minval(points(1, :)))
      next = first
      do n = 1, min(most, size(points, 2))
         hull(:, n) = points(:, next)
         next = rightmost(points, hull(:, n))
         if (next == 0) return
         if (all(abs(points(:, next) - points(:, first)) <= 0.0_wp)) then
            if (n > 2) text = '; the convex hull is '//list_text(reshape(hull(:, :n), [2*n]))
            return
         end if
      end do
   end function hull_text

   !> The point such that all points are on the left of the line to it; the farthest of several, 0 if there is no other
   pure integer function rightmost(points, from)
      real(wp), intent(in) :: points(:, :), from(2)
      real(wp) :: turn
      integer :: k

      rightmost = 0
      do k = 1, size(points, 2)
         if (all(abs(points(:, k) - from) <= 0.0_wp)) cycle
         if (rightmost == 0) rightmost = k
         turn = cross(points(:, rightmost) - from, points(:, k) - from)
         if (turn < 0.0_wp .or. (.not. abs(turn) > 0.0_wp .and. &
             sum((points(:, k) - from)**2) > sum((points(:, rightmost) - from)**2))) rightmost = k
      end do
   end function rightmost

end module polydem_wall_outlines
