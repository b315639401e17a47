!> Single polygons: checking and cleaning of input, mass properties, size, clipping.
!>
!> There is no absolute length in this module: every tolerance is a fraction of the size of the polygon, or of the
!> spacing of floating-point numbers at its coordinates.
module polydem_polygon
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use polydem_elementary, only: hypotenuse
   use polydem_kinds, only: ip, lp, wp
   use polydem_strings, only: counted, to_text
   implicit none
   private
   public :: clean_polygon, mass_properties, signed_area, diameter, greatest_radius, thickness, clip_half_plane, cross

   !> A vertex is dropped if it is closer to its neighbour, or to the line of its neighbours, than this fraction of
   !> the size: far above the rounding errors of a text file, far below any effect on a result.
   real(wp), parameter :: redundant_share = 1.0e-9_wp

   !> Number of vertices, neighbours in their list, that `diameter` compares together
   integer(ip), parameter :: run = 64_ip

contains

   !> Bring a polygon into standard form, or report why this is impossible.
   !>
   !> Standard form is strictly convex and anticlockwise, without repeated vertices and without vertices on
   !> the line of their neighbours. The remaining vertices have the bits and the cyclic order of the input; the
   !> order is reversed if the input is clockwise.
   pure subroutine clean_polygon(vertices, cleaned, problem)
      !> Vertices in order, clockwise or anticlockwise, (2, n) [m]
      real(wp), intent(in) :: vertices(:, :)
      !> Vertices in standard form, (2, m) [m]; not allocated if rejected
      real(wp), allocatable, intent(out) :: cleaned(:, :)
      !> Predicate of an error message, such as 'has no area'; not allocated if the polygon is valid
      character(len=:), allocatable, intent(out) :: problem
      integer(ip), allocatable :: kept(:)
      integer(ip) :: n, m, k
      real(wp) :: extent, tolerance, area

      n = size(vertices, 2, kind=ip)
      do k = 1_ip, n
         if (.not. (ieee_is_finite(vertices(1, k)) .and. ieee_is_finite(vertices(2, k)))) then
            problem = 'has a coordinate that is not a finite number at vertex '//to_text(k)
            return
         end if
      end do
      if (n < 3_ip) then
         problem = 'has '//counted(int(n, lp), 'corner')//', but a polygon needs at least 3'
         return
      end if

      extent = diameter(vertices)
      if (.not. extent < sqrt(huge(extent))) then
         problem = 'is so large that squares of its lengths overflow'
         return
      end if
      tolerance = redundant_share*extent + 16.0_wp*epsilon(1.0_wp)*maxval(abs(vertices))
      area = signed_area(vertices)
      if (abs(area) <= tolerance*extent) then
         problem = 'has no area, or crosses itself and its parts cancel'
         return
      end if
      allocate (kept(n))
      do k = 1_ip, n
         kept(k) = merge(k, 1_ip + modulo(1_ip - k, n), area > 0.0_wp)
      end do

      m = n
      call drop_redundant(vertices, tolerance, kept, m)
      call check_convex(vertices, kept(1:m), problem)
      if (allocated(problem)) return
      cleaned = vertices(:, kept(1:m))
   end subroutine clean_polygon

   !> Drop vertices that repeat a neighbour or lie between their neighbours on one line.
   pure subroutine drop_redundant(vertices, tolerance, kept, m)
      real(wp), intent(in) :: vertices(:, :), tolerance
      integer(ip), intent(inout) :: kept(:), m
      integer(ip), allocatable :: next(:), former(:)
      integer(ip) :: here, in_order, k, n
      logical, allocatable :: stays(:)

      n = m
      if (n < 1_ip) return
      next = [(1_ip + modulo(k, n), k=1_ip, n)]
      former = [(1_ip + modulo(k - 2_ip, n), k=1_ip, n)]
      allocate (stays(n), source=.true.)
      here = 1_ip
      in_order = 0_ip
      do while (in_order < m .and. m > 2_ip)
         associate (before => vertices(:, kept(former(here))), corner => vertices(:, kept(here)), &
                    after => vertices(:, kept(next(here))))
            if (is_redundant(corner - before, after - corner, tolerance)) then
               stays(here) = .false.
               next(former(here)) = next(here)
               former(next(here)) = former(here)
               m = m - 1_ip
               in_order = 0_ip
            else
               in_order = in_order + 1_ip
            end if
         end associate
         here = next(here)
      end do
      kept(1:m) = pack(kept(1:n), stays)
   end subroutine drop_redundant

   !> Whether a vertex is redundant: it repeats a neighbour or lies between its neighbours. The tip of a spike, where
   !> the outline turns back, is not redundant.
   pure logical function is_redundant(arriving, leaving, tolerance)
      real(wp), intent(in) :: arriving(2), leaving(2), tolerance

      if (hypotenuse(leaving(1), leaving(2)) <= tolerance) then
         is_redundant = .true.
      else
         is_redundant = abs(cross(arriving, leaving)) <= &
                   tolerance*hypotenuse(arriving(1) + leaving(1), arriving(2) + leaving(2)) .and. &
                   arriving(1)*leaving(1) + arriving(2)*leaving(2) > 0.0_wp
      end if
   end function is_redundant

   !> Set `problem` unless the outline turns left at every vertex and goes round once.
   pure subroutine check_convex(vertices, kept, problem)
      real(wp), intent(in) :: vertices(:, :)
      integer(ip), intent(in) :: kept(:)
      character(len=:), allocatable, intent(inout) :: problem
      integer(ip) :: k, m, rounds
      real(wp) :: arriving(2), leaving(2)

      m = size(kept, kind=ip)
      if (m < 3_ip) then
         problem = 'has no area'
         return
      end if
      rounds = 0_ip
      do k = 1_ip, m
         arriving = vertices(:, kept(k)) - vertices(:, kept(1_ip + modulo(k - 2_ip, m)))
         leaving = vertices(:, kept(1_ip + modulo(k, m))) - vertices(:, kept(k))
         if (cross(arriving, leaving) <= 0.0_wp) then
            problem = 'is not convex at vertex '//to_text(kept(k))
            return
         end if
         if (points_down(arriving) .and. .not. points_down(leaving)) rounds = rounds + 1_ip
      end do
      if (rounds /= 1_ip) problem = 'crosses itself: its outline goes round '//to_text(rounds)//' times'
   end subroutine check_convex

   !> Whether the angle of a direction lies in [pi, 2 pi)
   pure logical function points_down(direction)
      real(wp), intent(in) :: direction(2)

      points_down = direction(2) < 0.0_wp .or. (.not. abs(direction(2)) > 0.0_wp .and. direction(1) < 0.0_wp)
   end function points_down

   !> Area, centroid and second moment of area of an anticlockwise polygon.
   !>
   !> Sums over the triangles of a fan from the first vertex. All triangles of a convex polygon have a positive area,
   !> and coordinates are differences of vertices: no digits cancel, even far from the origin.
   pure subroutine mass_properties(vertices, area, centroid, second_moment)
      !> Vertices, anticlockwise, (2, n) [m]
      real(wp), intent(in) :: vertices(:, :)
      !> Area [m2]
      real(wp), intent(out) :: area
      !> Centroid [m]
      real(wp), intent(out) :: centroid(2)
      !> Polar second moment of area about the centroid [m4]
      real(wp), intent(out) :: second_moment
      real(wp) :: p(2), q(2), arm(2), middle(2), part
      integer(ip) :: k

      area = 0.0_wp
      arm = 0.0_wp
      do k = 2_ip, size(vertices, 2, kind=ip) - 1_ip
         p = vertices(:, k) - vertices(:, 1)
         q = vertices(:, k + 1_ip) - vertices(:, 1)
         part = 0.5_wp*cross(p, q)
         area = area + part
         arm = arm + part*(p + q)/3.0_wp
      end do
      arm = arm/area
      centroid = vertices(:, 1) + arm

      second_moment = 0.0_wp
      do k = 2_ip, size(vertices, 2, kind=ip) - 1_ip
         p = vertices(:, k) - vertices(:, 1)
         q = vertices(:, k + 1_ip) - vertices(:, 1)
         middle = (p + q)/3.0_wp
         second_moment = second_moment + 0.5_wp*cross(p, q)*(square(middle - arm) &
                         + (square(middle) + square(p - middle) + square(q - middle))/12.0_wp)
      end do
   end subroutine mass_properties

   !> Greatest distance between two vertices [m]
   !>
   !> Many vertices are divided into runs. Two runs are compared only if their boxes leave room for a greater distance.
   pure real(wp) function diameter(vertices)
      !> Vertices in any order, fast if neighbours in the list are near each other, (2, n) [m]
      real(wp), intent(in) :: vertices(:, :)
      real(wp), allocatable :: low(:, :), high(:, :)
      real(wp) :: greatest
      integer(ip) :: a, b, n
      ! Distances whose squares are less than this share of the greatest square are shorter, in spite of rounding.
      real(wp), parameter :: share = 1.0_wp - 32.0_wp*epsilon(1.0_wp)

      n = size(vertices, 2, kind=ip)
      call bound_runs(vertices, low, high)
      ! A great distance to begin with
      greatest = 0.0_wp
      if (n > run) greatest = greatest_square(vertices, [1_ip, n], [1_ip, 1_ip])
      do a = 1_ip, size(low, 2, kind=ip)
         do b = 1_ip, a
            if (square_of_boxes(a, b) < greatest) cycle
            greatest = max(greatest, greatest_square(vertices, run_of(a, n), run_of(b, n)))
         end do
      end do
      ! Of subnormal squares, all distances are measured.
      if (greatest < tiny(greatest)/epsilon(greatest)) greatest = 0.0_wp
      diameter = 0.0_wp
      do a = 1_ip, size(low, 2, kind=ip)
         do b = 1_ip, a
            if (square_of_boxes(a, b) < share*greatest) cycle
            diameter = max(diameter, greatest_distance(vertices, run_of(a, n), run_of(b, n), share*greatest))
         end do
      end do

   contains

      !> Upper bound of the squares of distances between two runs, rounded like these [m2]
      pure real(wp) function square_of_boxes(r, s)
         integer(ip), intent(in) :: r, s

         square_of_boxes = max(high(1, r) - low(1, s), high(1, s) - low(1, r))**2 &
                           + max(high(2, r) - low(2, s), high(2, s) - low(2, r))**2
      end function square_of_boxes

   end function diameter

   !> First and last vertex of a run of neighbours in a list of n vertices
   pure function run_of(r, n) result(range)
      integer(ip), intent(in) :: r, n
      integer(ip) :: range(2)

      range = [(r - 1_ip)*run + 1_ip, min(r*run, n)]
   end function run_of

   !> Find the boxes of the runs of a list of vertices.
   pure subroutine bound_runs(vertices, low, high)
      real(wp), intent(in) :: vertices(:, :)
      !> Lower left and upper right corners, (2, run) [m]
      real(wp), allocatable, intent(out) :: low(:, :), high(:, :)
      integer(ip) :: n, n_runs, r, range(2)

      n = size(vertices, 2, kind=ip)
      n_runs = (n + run - 1_ip)/run
      allocate (low(2, n_runs), high(2, n_runs))
      do r = 1_ip, n_runs
         range = run_of(r, n)
         low(:, r) = minval(vertices(:, range(1):range(2)), dim=2)
         high(:, r) = maxval(vertices(:, range(1):range(2)), dim=2)
      end do
   end subroutine bound_runs

   !> Greatest square of the distance between vertices of two ranges, which are equal or do not overlap [m2]
   pure real(wp) function greatest_square(vertices, a, b)
      real(wp), intent(in) :: vertices(:, :)
      integer(ip), intent(in) :: a(2), b(2)
      integer(ip) :: j, k

      greatest_square = 0.0_wp
      do k = a(1), a(2)
         do j = b(1), min(b(2), merge(k - 1_ip, b(2), a(1) == b(1)))
            greatest_square = max(greatest_square, (vertices(1, k) - vertices(1, j))**2 &
                                                    + (vertices(2, k) - vertices(2, j))**2)
         end do
      end do
   end function greatest_square

   !> Greatest distance between vertices of two ranges whose square is not below a bound [m]
   pure real(wp) function greatest_distance(vertices, a, b, least)
      real(wp), intent(in) :: vertices(:, :), least
      integer(ip), intent(in) :: a(2), b(2)
      integer(ip) :: j, k

      greatest_distance = 0.0_wp
      do k = a(1), a(2)
         do j = b(1), min(b(2), merge(k - 1_ip, b(2), a(1) == b(1)))
            if ((vertices(1, k) - vertices(1, j))**2 + (vertices(2, k) - vertices(2, j))**2 < least) cycle
            greatest_distance = max(greatest_distance, &
                                    hypotenuse(vertices(1, k) - vertices(1, j), vertices(2, k) - vertices(2, j)))
         end do
      end do
   end function greatest_distance

   !> Greatest distance of a vertex from the origin [m]
   pure real(wp) function greatest_radius(vertices)
      !> Vertices in any order, (2, n) [m]
      real(wp), intent(in) :: vertices(:, :)
      integer(ip) :: k

      greatest_radius = 0.0_wp
      do k = 1_ip, size(vertices, 2, kind=ip)
         greatest_radius = max(greatest_radius, square(vertices(:, k)))
      end do
      greatest_radius = sqrt(greatest_radius)
   end function greatest_radius

   !> Twice the least distance of an edge of a polygon from the origin [m]
   pure real(wp) function thickness(vertex)
      !> Vertices, anticlockwise, (2, n) [m]
      real(wp), intent(in), contiguous :: vertex(:, :)
      real(wp) :: numerator(size(vertex, 2)), edge(2, size(vertex, 2)), square(size(vertex, 2)), least
      integer(ip) :: v, w
      ! Edges whose squared distance is greater than the least by this factor are farther away, in spite of rounding.
      real(wp), parameter :: share = 1.0_wp + 64.0_wp*epsilon(1.0_wp)

      w = size(vertex, 2, kind=ip)
      do v = 1_ip, size(vertex, 2, kind=ip)
         edge(:, v) = vertex(:, v) - vertex(:, w)
         numerator(v) = 2.0_wp*abs(edge(1, v)*vertex(2, w) - edge(2, v)*vertex(1, w))
         square(v) = numerator(v)/(edge(1, v)**2 + edge(2, v)**2)*numerator(v)
         w = v
      end do
      least = minval(square)
      ! Where squares may underflow or overflow, the distances of all edges are measured.
      if (least < tiny(least)/epsilon(least) .or. .not. maxval(square) < huge(least)) least = huge(least)
      thickness = huge(1.0_wp)
      do v = 1_ip, size(vertex, 2, kind=ip)
         if (square(v) > share*least) cycle
         thickness = min(thickness, numerator(v)/hypotenuse(edge(1, v), edge(2, v)))
      end do
   end function thickness

   !> The part of a convex polygon on one side of a line: (r - point) . normal <= 0.
   !>
   !> I. E. Sutherland and G. W. Hodgman, Commun. ACM 17 (1974) 32.
   pure subroutine clip_half_plane(vertices, point, normal, clipped)
      !> Vertices in order, (2, n) [m]
      real(wp), intent(in) :: vertices(:, :)
      !> A point on the line [m]
      real(wp), intent(in) :: point(2)
      !> Normal of the line, of any length, towards the part that is removed
      real(wp), intent(in) :: normal(2)
      !> The remaining polygon, (2, m) [m]; m = 0 if it has no area
      real(wp), allocatable, intent(out) :: clipped(:, :)
      real(wp) :: outside(size(vertices, 2)), work(2, 2*size(vertices, 2)), share
      integer(ip) :: j, k, n, m

      n = size(vertices, 2, kind=ip)
      do k = 1_ip, n
         outside(k) = (vertices(1, k) - point(1))*normal(1) + (vertices(2, k) - point(2))*normal(2)
      end do
      m = 0_ip
      if (any(outside < 0.0_wp)) then
         do k = 1_ip, n
            j = 1_ip + modulo(k, n)
            if (outside(k) <= 0.0_wp) then
               m = m + 1_ip
               work(:, m) = vertices(:, k)
            end if
            if (min(outside(k), outside(j)) < 0.0_wp .and. max(outside(k), outside(j)) > 0.0_wp) then
               m = m + 1_ip
               share = outside(k)/(outside(k) - outside(j))
               work(:, m) = vertices(:, k) + share*(vertices(:, j) - vertices(:, k))
            end if
         end do
      end if
      clipped = work(:, 1:m)
   end subroutine clip_half_plane

   !> Area, positive if anticlockwise [m2]
   pure real(wp) function signed_area(vertices)
      !> Vertices in order, (2, n) [m]
      real(wp), intent(in) :: vertices(:, :)
      integer(ip) :: k

      signed_area = 0.0_wp
      do k = 2_ip, size(vertices, 2, kind=ip) - 1_ip
         signed_area = signed_area &
                       + 0.5_wp*cross(vertices(:, k) - vertices(:, 1), vertices(:, k + 1_ip) - vertices(:, 1))
      end do
   end function signed_area

   !> Third component of the cross product
   pure real(wp) function cross(p, q)
      !> The vectors
      real(wp), intent(in) :: p(2), q(2)

      cross = p(1)*q(2) - p(2)*q(1)
   end function cross

   !> Square of the length
   pure real(wp) function square(p)
      real(wp), intent(in) :: p(2)

      square = p(1)*p(1) + p(2)*p(2)
   end function square

end module polydem_polygon
