!> A batch of pairs of polygons whose outlines are expected to cross twice, for evaluation many at a time.
!>
!> In a pair, P is the polygon with the smaller radius and Q the other. The radius is the greatest distance of a
!> vertex from the centre of mass. A caller computes it once from the polygon before it turns, so roles do not change
!> with time. If the radii are equal, either may be P: the evaluation is symmetric.
module polydem_overlap_batch
   use polydem_kinds, only: ip, wp
   use polydem_overlap_tolerances, only: far
   use polydem_pair_memory, only: lens_bits, most_lens_corners
   implicit none
   private
   public :: lanes, column_length, overlap_batch_t, add_lane, copy_lane

   !> Number of pairs in a batch
   integer(ip), parameter :: lanes = 64_ip
   !> Length of the columns. Columns of 64 numbers would begin at multiples of 512 bytes, and the cache would hold few
   !> of them at once
   integer(ip), parameter :: column_length = lanes + 8_ip

   !> A batch of pairs, one lane each. Its numbers are not initialised. Last indices (2) are P and Q, (4) x and y of P
   !> and of Q.
   type :: overlap_batch_t
      !> Places in the array of vertices: start and end of the edge of P that enters Q, of the edge of P that leaves it,
      !> of the edge of Q that enters P, of the edge of Q that leaves it
      integer(ip) :: vertex(column_length, 8)
      !> 1 if a polygon has corners inside the other, otherwise 0
      real(wp) :: some(column_length, 2)
      !> 1 if it has two of them, otherwise 0
      real(wp) :: two(column_length, 2)
      !> Radii [m]
      real(wp) :: radius(column_length, 2)
      !> Centres. The origin is that of P or, if the radii are equal, half-way between the centres [m]
      real(wp) :: centre(column_length, 4)
      !> 1 if a crossing is computed on the entering edge, 0 if on the leaving one: 1 where P enters Q; where Q enters
      !> P, 1 if the radii are equal, otherwise 0
      real(wp) :: on_entering(column_length, 2)
      !> Radius of P, and greatest coordinate of a certified lens [m]
      real(wp) :: scale(column_length, 2)

      !> Work space: the vertices, (lane, x or y, vertex, P or Q) [m]
      real(wp) :: corner(column_length, 2, 4, 2)
      !> Work space: where P enters Q and where Q enters P, (lane, x or y, crossing) [m]
      real(wp) :: crossing(column_length, 2, 2)
      !> Work space: positive if the edges cross properly, and if corners between are inside the other polygon
      real(wp) :: crossed(column_length, 2), inside(column_length, 2)

      !> Positive if the result is certified; the rest may not be read otherwise
      real(wp) :: certified(column_length)
      !> Area or effective area [m2]
      real(wp) :: area(column_length)
      !> Its gradient: integral of the outward normal of P over its outline inside Q, for the effective area weighted
      !> [m]
      real(wp) :: normal(column_length, 2)
      !> Length of the gradient [m]
      real(wp) :: length(column_length)
      !> Moments of that integral about the centres of P and of Q [m2]
      real(wp) :: moment(column_length, 2)
      !> Centroid relative to the centres of P and of Q [m]
      real(wp) :: centroid(column_length, 4)
   end type overlap_batch_t

contains

   !> Write a remembered pair into a lane.
   pure subroutine add_lane(batch, lane, memory, vertices, offset, radius_p, radius_q, usable)
      !> The batch
      type(overlap_batch_t), intent(inout) :: batch
      !> The lane, from 1
      integer(ip), intent(in) :: lane
      !> What is remembered, see `polydem_pair_memory`; any integer
      integer(ip), intent(in) :: memory
      !> Places of the first and the last vertex of P and of Q in the array of vertices that `evaluate_batch` gets
      integer(ip), intent(in) :: vertices(4)
      !> Centre of Q minus centre of P [m]
      real(wp), intent(in) :: offset(2)
      !> Radius of P [m]
      real(wp), intent(in) :: radius_p
      !> Radius of Q, at least that of P [m]
      real(wp), intent(in) :: radius_q
      !> Whether this is a lens of these polygons with at most two corners of each inside the other; otherwise the lane
      !> is not changed
      logical, intent(out) :: usable
      integer(ip) :: edge(4), corners_p, corners_q, inside_p, inside_q
      real(wp) :: equal

      usable = .false.
      if (memory <= 0_ip) return
      edge(1:2) = [ibits(memory, 0, lens_bits), ibits(memory, lens_bits, lens_bits)]
      edge(3:4) = [ibits(memory, 2*lens_bits, lens_bits), ibits(memory, 3*lens_bits, lens_bits)]
      corners_p = vertices(2) - vertices(1) + 1_ip
      corners_q = vertices(4) - vertices(3) + 1_ip
      ! The search without memory leaves larger polygons to clipping.
      if (max(corners_p, corners_q) > most_lens_corners) return
      if (max(edge(1), edge(2)) >= corners_p .or. max(edge(3), edge(4)) >= corners_q) return
      inside_p = edge(2) - edge(1)
      if (inside_p < 0_ip) inside_p = inside_p + corners_p
      inside_q = edge(4) - edge(3)
      if (inside_q < 0_ip) inside_q = inside_q + corners_q
      if (max(inside_p, inside_q) > 2_ip) return
      usable = .true.

      edge(1:2) = edge(1:2) + vertices(1)
      edge(3:4) = edge(3:4) + vertices(3)
      batch%vertex(lane, 1) = edge(1)
      batch%vertex(lane, 2) = merge(vertices(1), edge(1) + 1_ip, edge(1) == vertices(2))
      batch%vertex(lane, 3) = edge(2)
      batch%vertex(lane, 4) = merge(vertices(1), edge(2) + 1_ip, edge(2) == vertices(2))
      batch%vertex(lane, 5) = edge(3)
      batch%vertex(lane, 6) = merge(vertices(3), edge(3) + 1_ip, edge(3) == vertices(4))
      batch%vertex(lane, 7) = edge(4)
      batch%vertex(lane, 8) = merge(vertices(3), edge(4) + 1_ip, edge(4) == vertices(4))
      batch%some(lane, 1) = real(min(1_ip, inside_p), wp)
      batch%some(lane, 2) = real(min(1_ip, inside_q), wp)
      batch%two(lane, 1) = real(ishft(inside_p, -1), wp)
      batch%two(lane, 2) = real(ishft(inside_q, -1), wp)
      batch%radius(lane, :) = [radius_p, radius_q]
      equal = merge(0.0_wp, 1.0_wp, radius_p < radius_q)
      batch%on_entering(lane, :) = [1.0_wp, equal]
      batch%scale(lane, :) = [radius_p, (1.0_wp - 0.5_wp*equal)*far*radius_p]
      batch%centre(lane, 1) = -0.5_wp*equal*offset(1)
      batch%centre(lane, 2) = -0.5_wp*equal*offset(2)
      batch%centre(lane, 3) = offset(1) + batch%centre(lane, 1)
      batch%centre(lane, 4) = offset(2) + batch%centre(lane, 2)
   end subroutine add_lane

   !> Copy the inputs of a lane to another.
   pure subroutine copy_lane(batch, from, to)
      !> The batch
      type(overlap_batch_t), intent(inout) :: batch
      !> The lane
      integer(ip), intent(in) :: from
      !> Lane of the copy
      integer(ip), intent(in) :: to

      batch%vertex(to, :) = batch%vertex(from, :)
      batch%some(to, :) = batch%some(from, :)
      batch%two(to, :) = batch%two(from, :)
      batch%radius(to, :) = batch%radius(from, :)
      batch%centre(to, :) = batch%centre(from, :)
      batch%on_entering(to, :) = batch%on_entering(from, :)
      batch%scale(to, :) = batch%scale(from, :)
   end subroutine copy_lane

end module polydem_overlap_batch
