!> The contact that a body is expected to have with an equal body that it hits at a given speed.
!>
!> It is described for each edge of the body: the overlap of the body with its mirror image beyond the edge. At the
!> greatest depth, the kinetic energy of the approach has become that of the spring: m_eff v^2 = K d^2, where the
!> depth d is the area of the overlap over its length L, and K the stiffness of a contact of this length. (The
!> conservative law has this energy; the area law has more, so the depth is an upper bound.) A contact of a round
!> polygon thus spans many edges. A wall is half as stiff as an equal body, and a round body sinks 2^(1/3) times as
!> deep into it; the frequency of both is less than with the equal body.
module polydem_expected_contact
   use polydem_bodies, only: bodies_t
   use polydem_linearised_contact, only: linearised_contact_t
   use polydem_force_law, only: force_law_t
   use polydem_kinds, only: ip, wp
   use polydem_pieces, only: pieces_t
   implicit none
   private
   public :: expect_contact, cut_body

   !> Greatest depth of an overlap in each body, as a share of the distance of the edge from the centre
   real(wp), parameter :: deepest = 0.5_wp
   !> Greatest number of iterations of the depth; the error of its logarithm falls to a half or less in each
   integer, parameter :: most_iterations = 12
   !> Number of edges of a body at which cuts begin. A cut spans many edges of a body that has more, and the cuts at
   !> their neighbours differ little
   integer(ip), parameter :: most_cuts = 512_ip

   !> Cut through a body, parallel to an edge
   type :: cut_t
      !> Depth, and distance from the centre [m]
      real(wp) :: depth = 0.0_wp, distance = 0.0_wp
      !> Length of the cut, and the greatest length of all cuts up to it [m]
      real(wp) :: length = 0.0_wp, widest = 0.0_wp
      !> Area between edge and cut [m2]
      real(wp) :: area = 0.0_wp
   end type cut_t

contains

   !> Describe the expected contact of a body: the greatest length, and the greatest ratios of all edges.
   subroutine expect_contact(law, bodies, s, materials, speed, element, outline, across, turning)
      type(force_law_t), intent(in) :: law
      type(bodies_t), intent(in) :: bodies
      !> Slot of the body
      integer(ip), intent(in) :: s
      !> Its material, and that of the other body. If they differ, the other body is heavy
      integer(ip), intent(in) :: materials(2)
      !> Speed of approach [m/s]
      real(wp), intent(in) :: speed
      !> The contact, without springs and dashpots
      type(linearised_contact_t), intent(out) :: element
      !> Length of the outline [m]
      real(wp), intent(out) :: outline
      !> Sum of the lengths of all edges, each times the square of the component of its normal along one direction; the
      !> greatest of all directions [m]
      real(wp), intent(out) :: across
      !> Sum of the lengths of all edges, each times the square of the length of the contact there [m3]
      real(wp), intent(out) :: turning
      type(cut_t) :: cut
      real(wp), allocatable :: shape(:, :)
      real(wp) :: area, length, distance
      integer(ip) :: n, p, pieces(2), stride, v, w

      call start_contact(bodies, s, speed, element, outline, across)
      element%materials = materials
      if (materials(1) /= materials(2)) then
         element%normal_mass = bodies%mass(s)
         element%normal_mobility = bodies%inverse_mass(s)
      end if
      turning = 0.0_wp
      pieces = bodies%pieces%pieces_of(s)
      do p = pieces(1), pieces(2)
         shape = centred(bodies%pieces, p)
         n = size(shape, 2, kind=ip)
         area = area_of(shape)
         stride = 1_ip + (n - 1_ip)/most_cuts
         do v = 1_ip, n, stride
            w = merge(n, v - 1_ip, v == 1_ip)
            call measure_edge(shape(:, w), shape(:, v), length, distance)
            call find_depth(law, shape, w, v, area, element, cut)
            element%edge_ratio = max(element%edge_ratio, cut%widest/(2.0_wp*cut%distance))
            element%square_ratio = max(element%square_ratio, cut%widest**2/area)
            turning = turning + real(stride, wp)*length*cut%widest**2
            if (cut%widest >= element%length) then
               element%length = cut%widest
               element%depth = 2.0_wp*cut%area/cut%length
            end if
         end do
      end do
   end subroutine expect_contact

   !> Start the expected contact with those of faces, at depth 0.
   pure subroutine start_contact(bodies, s, speed, element, outline, across)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: s
      real(wp), intent(in) :: speed
      type(linearised_contact_t), intent(out) :: element
      !> As in `expect_contact`
      real(wp), intent(out) :: outline, across
      real(wp), allocatable :: shape(:, :)
      real(wp) :: skew(2)
      integer(ip) :: p, pieces(2), v

      element%is_expected = .true.
      element%speed = speed
      element%inertia = bodies%inertia(s)
      element%normal_mass = 0.5_wp*bodies%mass(s)
      element%normal_mobility = 2.0_wp*bodies%inverse_mass(s)
      element%inverse_square = bodies%mass(s)/(6.0_wp*bodies%inertia(s))
      outline = 0.0_wp
      skew = 0.0_wp
      do v = bodies%pieces%vertex_start(s), bodies%pieces%vertex_start(s + 1_ip) - 1_ip
         element%radius_square = max(element%radius_square, sum(bodies%pieces%vertex(:, v)**2))
      end do
      pieces = bodies%pieces%pieces_of(s)
      do p = pieces(1), pieces(2)
         shape = centred(bodies%pieces, p)
         call measure_faces(shape, element, outline, skew)
      end do
      across = 0.5_wp*(outline + sqrt(skew(1)**2 + skew(2)**2))
      element%tangential_mass = 1.0_wp/(bodies%inverse_mass(s) + element%radius_square*bodies%inverse_inertia(s))
      element%rolling_radius = sqrt(element%radius_square)
      element%rolling_inertia = bodies%inertia(s) + bodies%mass(s)*element%radius_square
   end subroutine start_contact

   !> Vertices of a piece relative to its centroid, (2, vertex) [m]
   pure function centred(pieces, p) result(shape)
      type(pieces_t), intent(in) :: pieces
      integer(ip), intent(in) :: p
      real(wp), allocatable :: shape(:, :)

      shape = pieces%piece_polygon(p)
      if (pieces%most > 1_ip) shape = shape - spread(pieces%centre(:, p), 2, size(shape, 2))
   end function centred

   !> Add the faces of a piece.
   pure subroutine measure_faces(shape, element, outline, skew)
      !> Vertices, anticlockwise, (2, :) [m]
      real(wp), intent(in) :: shape(:, :)
      type(linearised_contact_t), intent(inout) :: element
      !> Length of the outline so far, and sum of the lengths of edges as vectors along twice their angles [m]
      real(wp), intent(inout) :: outline, skew(2)
      real(wp) :: length, distance, longest, edge(2)
      integer(ip) :: v, w

      longest = 0.0_wp
      w = size(shape, 2, kind=ip)
      do v = 1_ip, size(shape, 2, kind=ip)
         call measure_edge(shape(:, w), shape(:, v), length, distance)
         outline = outline + length
         edge = shape(:, v) - shape(:, w)
         skew = skew + [edge(1)**2 - edge(2)**2, 2.0_wp*edge(1)*edge(2)]/length
         longest = max(longest, length)
         element%edge_ratio = max(element%edge_ratio, length/(2.0_wp*distance))
         w = v
      end do
      element%length = max(element%length, longest)
      element%square_ratio = max(element%square_ratio, longest*longest/area_of(shape))
   end subroutine measure_faces

   !> Area of a piece [m2]
   pure real(wp) function area_of(shape) result(area)
      !> Vertices, anticlockwise, relative to a point inside, (2, :) [m]
      real(wp), intent(in) :: shape(:, :)
      real(wp) :: length, distance
      integer(ip) :: v, w

      area = 0.0_wp
      w = size(shape, 2, kind=ip)
      do v = 1_ip, size(shape, 2, kind=ip)
         call measure_edge(shape(:, w), shape(:, v), length, distance)
         area = area + 0.5_wp*length*distance
         w = v
      end do
   end function area_of

   !> Find the cut at the greatest depth of an impact on an edge. The depth of a face of the same length is an upper
   !> bound. From there the depth falls to the solution: the energy of the spring grows at most like its fourth power.
   subroutine find_depth(law, shape, from, to, area, element, cut)
      type(force_law_t), intent(in) :: law
      !> Vertices, anticlockwise, (2, :) [m]
      real(wp), intent(in) :: shape(:, :)
      !> First and second vertex of the edge
      integer(ip), intent(in) :: from, to
      !> Area of the piece [m2]
      real(wp), intent(in) :: area
      !> Expected contact of the body so far
      type(linearised_contact_t), intent(in) :: element
      type(cut_t), intent(out) :: cut
      real(wp) :: energy, ratio, distance
      integer :: k

      call measure_edge(shape(:, from), shape(:, to), cut%length, distance)
      cut%widest = cut%length
      cut%distance = distance
      energy = element%normal_mass*element%speed**2
      ratio = spring_of(law, element, cut, area)
      if (.not. (ratio > 0.0_wp .and. energy > 0.0_wp)) return
      cut%depth = 0.5_wp*sqrt(energy/ratio)
      do k = 1, most_iterations
         cut%depth = min(cut%depth, deepest*distance)
         cut%distance = distance - cut%depth
         call cut_body(shape, from, to, cut%depth, cut%length, cut%widest, cut%area)
         ! Most edges are much shorter than the longest.
         if (cut%widest <= element%length .and. cut%widest <= 2.0_wp*cut%distance*element%edge_ratio) exit
         ratio = spring_of(law, element, cut, area)*(2.0_wp*cut%area/cut%length)**2/energy
         if (ratio <= 1.01_wp) exit
         cut%depth = cut%depth/sqrt(sqrt(ratio))
      end do
   end subroutine find_depth

   !> Stiffness of the contact of a cut [N/m2]
   real(wp) function spring_of(law, element, cut, area)
      type(force_law_t), intent(in) :: law
      !> Masses, speed and radius
      type(linearised_contact_t), intent(in) :: element
      type(cut_t), intent(in) :: cut
      !> Area of the piece [m2]
      real(wp), intent(in) :: area
      type(linearised_contact_t) :: edge

      edge = element
      edge%speed = 0.0_wp
      edge%depth = 0.0_wp
      edge%length = cut%length
      edge%edge_ratio = cut%length/(2.0_wp*cut%distance)
      edge%square_ratio = cut%length**2/area
      call law%stiffen(edge)
      spring_of = edge%normal_stiffness
   end function spring_of

   !> Length of an edge, and its distance from the centre of mass [m]
   pure subroutine measure_edge(from, to, length, distance)
      real(wp), intent(in) :: from(2), to(2)
      real(wp), intent(out) :: length, distance
      real(wp) :: x, y

      x = to(1) - from(1)
      y = to(2) - from(2)
      length = sqrt(x*x + y*y)
      distance = abs(x*from(2) - y*from(1))/length
   end subroutine measure_edge

   !> Cut a body parallel to an edge. The work is proportional to the number of edges that the cut spans.
   pure subroutine cut_body(shape, from, to, depth, length, widest, area)
      !> Vertices, anticlockwise, (2, :) [m]
      real(wp), intent(in) :: shape(:, :)
      !> First and second vertex of the edge
      integer(ip), intent(in) :: from, to
      !> Depth of the cut, less than the width of the body [m]
      real(wp), intent(in) :: depth
      !> Length of the cut, and the greatest length of all cuts up to it [m]
      real(wp), intent(out) :: length, widest
      !> Area between edge and cut [m2]
      real(wp), intent(out) :: area
      real(wp) :: along(2), z, rise, grown, side(2, 2), next(2, 2)
      integer(ip) :: ends(2), k

      along = shape(:, to) - shape(:, from)
      length = sqrt(along(1)**2 + along(2)**2)
      along = along/length
      widest = length
      area = 0.0_wp
      z = 0.0_wp
      ends = [from, to]
      do k = 1_ip, 2_ip
         side(:, k) = place(shape(:, ends(k)) - shape(:, from), along)
         call take_next(k, ends(k), next(:, k))
      end do
      do
         rise = min(depth, next(2, 1), next(2, 2)) - z
         if (rise > 0.0_wp) then
            grown = length + rise*(slope(side(:, 2), next(:, 2)) - slope(side(:, 1), next(:, 1)))
            area = area + 0.5_wp*rise*(length + grown)
            z = z + rise
            length = grown
            widest = max(widest, length)
         end if
         if (min(next(2, 1), next(2, 2)) >= depth) exit
         k = merge(1_ip, 2_ip, next(2, 1) <= next(2, 2))
         side(:, k) = next(:, k)
         call take_next(k, ends(k), next(:, k))
         ! The far end of the body
         if (next(2, k) <= side(2, k)) exit
      end do

   contains

      !> Go to the next vertex on the first or second side of the edge.
      pure subroutine take_next(k, vertex, found)
         integer(ip), intent(in) :: k
         integer(ip), intent(inout) :: vertex
         !> Its place [m]
         real(wp), intent(out) :: found(2)

         vertex = 1_ip + modulo(vertex + 2_ip*k - 4_ip, size(shape, 2, kind=ip))
         found = place(shape(:, vertex) - shape(:, from), along)
      end subroutine take_next

   end subroutine cut_body

   !> Components of a vector along an edge, and into the body [m]
   pure function place(vector, along)
      real(wp), intent(in) :: vector(2), along(2)
      real(wp) :: place(2)

      place = [vector(1)*along(1) + vector(2)*along(2), vector(2)*along(1) - vector(1)*along(2)]
   end function place

   !> Change of the place along the edge with the depth
   pure real(wp) function slope(low, high)
      real(wp), intent(in) :: low(2), high(2)

      slope = (high(1) - low(1))/(high(2) - low(2))
   end function slope

end module polydem_expected_contact
