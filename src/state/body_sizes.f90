!> Thickness and radius of bodies, measured from their centres of mass, and diameters.
module polydem_body_sizes
   use polydem_bodies, only: bodies_t
   use polydem_elementary, only: hypotenuse
   use polydem_kinds, only: ip, wp
   use polydem_polygon, only: diameter
   use polydem_sort_reals, only: sort_reals
   implicit none
   private
   public :: measure_body, thickness_of_bodies, diameter_of, diameters_of, median_of_diameters

contains

   !> Thickness and radius of one body.
   pure subroutine measure_body(bodies, s, thickness, radius)
      type(bodies_t), intent(in) :: bodies
      !> Slot
      integer(ip), intent(in) :: s
      !> Twice the least distance of an edge from the centre [m]
      real(wp), intent(out) :: thickness
      !> Greatest distance of a vertex from the centre [m]
      real(wp), intent(out) :: radius
      integer(ip) :: v

      associate (vertex => bodies%shape(:, bodies%vertex_start(s):bodies%vertex_start(s + 1_ip) - 1_ip))
         thickness = thickness_of(vertex)
         radius = 0.0_wp
         do v = 1_ip, size(vertex, 2, kind=ip)
            radius = max(radius, hypotenuse(vertex(1, v), vertex(2, v)))
         end do
      end associate
   end subroutine measure_body

   !> Twice the least distance of an edge of a polygon from the origin [m]
   pure real(wp) function thickness_of(vertex)
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
      thickness_of = huge(1.0_wp)
      do v = 1_ip, size(vertex, 2, kind=ip)
         if (square(v) > share*least) cycle
         thickness_of = min(thickness_of, numerator(v)/hypotenuse(edge(1, v), edge(2, v)))
      end do
   end function thickness_of

   !> Thickness of every body [m], (slot)
   pure function thickness_of_bodies(bodies) result(thickness)
      type(bodies_t), intent(in) :: bodies
      real(wp), allocatable :: thickness(:)
      integer(ip) :: s

      allocate (thickness(bodies%n))
      do s = 1_ip, bodies%n
         thickness(s) = thickness_of(bodies%shape(:, bodies%vertex_start(s):bodies%vertex_start(s + 1_ip) - 1_ip))
      end do
   end function thickness_of_bodies

   !> Diameter of one body [m]
   pure real(wp) function diameter_of(bodies, s)
      type(bodies_t), intent(in) :: bodies
      !> Slot
      integer(ip), intent(in) :: s

      diameter_of = diameter(bodies%shape(:, bodies%vertex_start(s):bodies%vertex_start(s + 1_ip) - 1_ip))
   end function diameter_of

   !> Diameters of the free bodies, (body) [m]
   pure function diameters_of(bodies) result(length)
      type(bodies_t), intent(in) :: bodies
      real(wp), allocatable :: length(:)
      integer(ip) :: k

      allocate (length(size(bodies%free)))
      do k = 1_ip, size(bodies%free, kind=ip)
         length(k) = diameter_of(bodies, bodies%free(k))
      end do
   end function diameters_of

   !> Median diameter of the free bodies; huge if there are none [m]
   pure real(wp) function median_of_diameters(bodies)
      type(bodies_t), intent(in) :: bodies
      real(wp), allocatable :: length(:)
      integer(ip), allocatable :: ranked(:)
      integer(ip) :: n

      n = size(bodies%free, kind=ip)
      median_of_diameters = huge(1.0_wp)
      if (n == 0_ip) return
      allocate (ranked(n))
      length = diameters_of(bodies)
      call sort_reals(length, ranked)
      median_of_diameters = length(ranked((n + 1_ip)/2_ip))
   end function median_of_diameters

end module polydem_body_sizes
