!> Overlaps of one body with neighbouring pieces of another as one overlap, for a measure that is not a sum over pieces.
!>
!> A law that divides by the length of the overlap (`polydem_overlap_measure`) is stiffer the more pieces a body has:
!> each piece has a shorter overlap. Where two overlaps have a whole edge in common, and together are convex, a body is
!> only cut there. Such overlaps count as one. With the sums A, A c and J of their areas, first moments and polar
!> moments, the measure X = A/L, L^2 = 12 J/A, has the gradient of `polydem_overlap_measure`, with one weight for all,
!>
!>     p(x) = 3/2 - A |x - c|^2/(2 J),
!>
!> under the integrals over the outlines of both bodies inside each piece. Common edges are no outline. What a cut does
!> not make convex stays apart: the faces of a notch, two feet, a joint that is not flush.
!>
!> So cuts change no force, and a piece that begins to overlap begins with the area 0: the force is continuous as long
!> as the parts of a cut end flush, or in a convex corner, where another body reaches.
module polydem_joined_overlaps
   use polydem_clipping, only: usual_corners
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: overlap_loop_t, join_loops, integrate_joined

   !> The outline of an overlap
   type :: overlap_loop_t
      !> Number of vertices; 0: there is no overlap
      integer(ip) :: n = 0_ip
      !> Vertices, anticlockwise, relative to the centre of the body, (corner, x or y) [m]
      real(wp) :: vertex(usual_corners, 2) = 0.0_wp
      !> Whether the edge from a vertex to the next one is on the outline of the body, not of the other one; and whether
      !> it is an edge in common with another overlap
      logical :: on_outline(usual_corners) = .false., is_common(usual_corners) = .false.
      !> Number of the first overlap among those that it is joined with; its own number if it is the first
      integer(ip) :: part_of = 0_ip
      !> Area [m2], centroid relative to the centre of the body [m], and polar moment about the centroid [m4]
      real(wp) :: area = 0.0_wp, centroid(2) = 0.0_wp, polar = 0.0_wp
   end type overlap_loop_t

   !> Greatest sine of an angle by which two joined overlaps may be concave: rounding
   real(wp), parameter :: flat = 1.0e-7_wp

contains

   !> Find which overlaps are joined, and measure them.
   pure subroutine join_loops(tolerance, loops)
      !> Distance of points that count as one [m]
      real(wp), intent(in) :: tolerance
      !> Overlaps of one body; all but their vertices is set or changed
      type(overlap_loop_t), intent(inout) :: loops(:)
      integer(ip) :: i, j, k, l, m, from, to

      do k = 1_ip, size(loops, kind=ip)
         loops(k)%part_of = k
         loops(k)%is_common = .false.
         call measure(loops(k))
      end do
      do l = 2_ip, size(loops, kind=ip)
         do k = 1_ip, l - 1_ip
            call find_common_edge(loops(k), loops(l), tolerance, i, j)
            if (i == 0_ip) cycle
            loops(k)%is_common(i) = .true.
            loops(l)%is_common(j) = .true.
            from = max(loops(k)%part_of, loops(l)%part_of)
            to = min(loops(k)%part_of, loops(l)%part_of)
            do m = 1_ip, size(loops, kind=ip)
               if (loops(m)%part_of == from) loops(m)%part_of = to
            end do
         end do
      end do
   end subroutine join_loops

   !> Area, centroid and polar moment of a loop; a loop without area becomes none.
   pure subroutine measure(loop)
      type(overlap_loop_t), intent(inout) :: loop
      real(wp) :: p(2), q(2), part, moment, first(2)
      integer(ip) :: i

      loop%area = 0.0_wp
      first = 0.0_wp
      moment = 0.0_wp
      do i = 2_ip, loop%n - 1_ip
         p = loop%vertex(i, :) - loop%vertex(1, :)
         q = loop%vertex(i + 1_ip, :) - loop%vertex(1, :)
         part = 0.5_wp*(p(1)*q(2) - p(2)*q(1))
         loop%area = loop%area + part
         first = first + part*(p + q)/3.0_wp
         moment = moment + part*(dot_product(p, p) + dot_product(p, q) + dot_product(q, q))/6.0_wp
      end do
      if (.not. loop%area > 0.0_wp) then
         loop%n = 0_ip
         return
      end if
      loop%centroid = loop%vertex(1, :) + first/loop%area
      loop%polar = moment - dot_product(first, first)/loop%area
   end subroutine measure

   !> Find the edges that two overlaps have in common if they are convex together; 0 if there are none.
   pure subroutine find_common_edge(a, b, tolerance, edge_a, edge_b)
      type(overlap_loop_t), intent(in) :: a, b
      real(wp), intent(in) :: tolerance
      !> Vertices at which the edges start
      integer(ip), intent(out) :: edge_a, edge_b
      integer(ip) :: i, j

      do i = 1_ip, a%n
         do j = 1_ip, b%n
            if (maxval(abs(a%vertex(i, :) - b%vertex(after(b, j), :))) > tolerance) cycle
            if (maxval(abs(a%vertex(after(a, i), :) - b%vertex(j, :))) > tolerance) cycle
            if (.not. is_convex(a%vertex(before(a, i), :), a%vertex(i, :), b%vertex(after(b, after(b, j)), :))) cycle
            if (.not. is_convex(b%vertex(before(b, j), :), b%vertex(j, :), a%vertex(after(a, after(a, i)), :))) cycle
            edge_a = i
            edge_b = j
            return
         end do
      end do
      edge_a = 0_ip
      edge_b = 0_ip
   end subroutine find_common_edge

   !> Whether a path does not turn right
   pure logical function is_convex(from, at, to)
      real(wp), intent(in) :: from(2), at(2), to(2)
      real(wp) :: p(2), q(2)

      p = at - from
      q = to - at
      is_convex = p(1)*q(2) - p(2)*q(1) >= -flat*sqrt(dot_product(p, p)*dot_product(q, q))
   end function is_convex

   !> The next vertex of a loop
   pure integer(ip) function after(loop, i)
      type(overlap_loop_t), intent(in) :: loop
      integer(ip), intent(in) :: i

      after = merge(1_ip, i + 1_ip, i == loop%n)
   end function after

   !> The vertex before one of a loop
   pure integer(ip) function before(loop, i)
      type(overlap_loop_t), intent(in) :: loop
      integer(ip), intent(in) :: i

      before = merge(loop%n, i - 1_ip, i == 1_ip)
   end function before

   !> Gradient of the measure of joined overlaps, the part of one of them. It is half the integral over the outline of
   !> the body and half the opposite one over that of the other body: the sums over all parts are equal, and a part does
   !> not depend on which of both is called the body.
   pure subroutine integrate_joined(loops, k, normal, moment, square)
      !> Overlaps of one body after `join_loops`
      type(overlap_loop_t), intent(in) :: loops(:)
      !> Number of the overlap
      integer(ip), intent(in) :: k
      !> Integral of p n [m], and its moment about the centre [m2]
      real(wp), intent(out) :: normal(2), moment
      !> Square of the length L of all, times the share of this overlap in their area: so the forces and the energies
      !> E/2 area^2/square of the parts add up [m2]
      real(wp), intent(out) :: square
      real(wp) :: area, centre(2), polar, c(2), r(2), s(2), step(2), weight(3), along(2), half
      integer(ip) :: i, l

      area = 0.0_wp
      centre = 0.0_wp
      do l = 1_ip, size(loops, kind=ip)
         if (loops(l)%n == 0_ip .or. loops(l)%part_of /= loops(k)%part_of) cycle
         area = area + loops(l)%area
         centre = centre + loops(l)%area*loops(l)%centroid
      end do
      centre = centre/area
      polar = 0.0_wp
      do l = 1_ip, size(loops, kind=ip)
         if (loops(l)%n == 0_ip .or. loops(l)%part_of /= loops(k)%part_of) cycle
         c = loops(l)%centroid - centre
         polar = polar + loops(l)%polar + loops(l)%area*dot_product(c, c)
      end do
      square = 12.0_wp*polar/area*(loops(k)%area/area)
      normal = 0.0_wp
      moment = 0.0_wp
      do i = 1_ip, loops(k)%n
         if (loops(k)%is_common(i)) cycle
         half = merge(0.5_wp, -0.5_wp, loops(k)%on_outline(i))
         r = loops(k)%vertex(i, :)
         s = loops(k)%vertex(after(loops(k), i), :)
         step = s - r
         ! Terms of Simpson's rule at both ends and in the middle, the latter four times as large
         weight = half*([p(r), p(s), 4.0_wp*p(0.5_wp*(r + s))]/6.0_wp)
         normal = normal + sum(weight)*[step(2), -step(1)]
         along = [dot_product(step, r), dot_product(step, s)]
         moment = moment - (weight(1)*along(1) + weight(2)*along(2) + weight(3)*0.5_wp*(along(1) + along(2)))
      end do

   contains

      !> The weight at a point
      pure real(wp) function p(x)
         real(wp), intent(in) :: x(2)

         p = 1.5_wp - 0.5_wp*area*dot_product(x - centre, x - centre)/polar
      end function p

   end subroutine integrate_joined

end module polydem_joined_overlaps
