!> Overlap of two convex polygons by clipping: area, centroid, and the integrals over its outline that the forces need.
!>
!> This serves where the outlines do not cross twice, or not properly; `polydem_lens_kernel` has the usual case.
!>
!> One polygon, the *subject*, is clipped by the half-planes of the edges of the other, the *clipper*
!> (Sutherland & Hodgman, Commun. ACM 17 (1974) 32). Each edge of the result has a flag: it lies on the outline
!> of the clipper, or on that of the subject. The result is a closed loop by construction. Vertices on edges,
!> common edges, containment and any number of crossings therefore need no special case, and no part of the
!> outline is counted twice or left out.
!>
!> Accuracy. The subject is the smaller body, and coordinates are relative to its centre. Errors therefore scale
!> with its size, even against a wall a thousand times as long. A vertex lies on a clip line if its distance is
!> at most `roundoff` times that size. An edge on the clip line belongs to the clipper. Hence bodies that touch
!> up to rounding do not overlap, and a body inside another is pushed out through an edge that they share.
module polydem_clipping
   use polydem_effective_area, only: weigh_by_shape
   use polydem_exact_cross, only: exact_cross
   use polydem_kinds, only: ip, wp
   use polydem_overlap_integrals, only: integrate_loop, overlap_t
   use polydem_overlap_measure, only: overlap_measure_t
   use polydem_overlap_tolerances, only: far, roundoff, separable_area
   implicit none
   private
   public :: clip_overlap, clip_loop, usual_corners

   !> Capacity of the work arrays of fixed size, in vertices of both polygons together
   integer(ip), parameter :: usual_corners = 48_ip

contains

   !> Overlap of two convex polygons P and Q by clipping.
   !>
   !> If the radii are equal, each polygon clips the other and the results are averaged: half of a common edge belongs
   !> to each, and an exchange of the polygons changes no bit but signs. Complexity: O(n m) at worst for n and m
   !> vertices.
   pure subroutine clip_overlap(p, q, offset, radius_p, radius_q, measure, overlap)
      !> Vertices of P and of Q, anticlockwise, each relative to its own centre, which is inside, (2, n) and (2, m) [m]
      real(wp), intent(in), contiguous :: p(:, :), q(:, :)
      !> Centre of Q minus centre of P [m]
      real(wp), intent(in) :: offset(2)
      !> Radii of P and of Q, that of P not greater than that of Q [m]
      real(wp), intent(in) :: radius_p, radius_q
      !> How the overlap is measured
      type(overlap_measure_t), intent(in) :: measure
      !> The overlap; a is P, b is Q
      type(overlap_t), intent(out) :: overlap
      type(overlap_t) :: other
      integer(ip) :: edge

      call clip(p, q, offset, radius_p, measure, overlap)
      overlap%centroid_b = overlap%centroid - offset
      overlap%normal = -overlap%normal
      overlap%moment_a = -overlap%moment_a
      overlap%moment_b = -overlap%moment_b
      overlap%of_area(:3) = -overlap%of_area(:3)
      if (.not. radius_p < radius_q) then
         call clip(q, p, -offset, radius_q, measure, other)
         overlap = mean(overlap, other, offset)
      end if
      if (overlap%area > separable_area*radius_p*radius_p) return
      edge = first_separating(p, q, offset, radius_q, radius_p)
      if (edge == 0_ip) edge = -first_separating(q, p, -offset, radius_p, radius_p)
      if (edge /= 0_ip .or. .not. overlap%area > 0.0_wp) overlap = overlap_t(separating_edge=edge)
   end subroutine clip_overlap

   !> Mean of both orders. Where one of them finds nothing, the polygons are apart up to rounding
   pure type(overlap_t) function mean(forward, back, offset)
      !> Q has clipped P; a is P
      type(overlap_t), intent(in) :: forward
      !> P has clipped Q; a is Q, normal and moments are those of P
      type(overlap_t), intent(in) :: back
      !> Centre of Q minus centre of P
      real(wp), intent(in) :: offset(2)

      if (.not. (forward%area > 0.0_wp .and. back%area > 0.0_wp)) return
      mean%area = 0.5_wp*(forward%area + back%area)
      mean%centroid = 0.5_wp*(forward%centroid + (back%centroid + offset))
      mean%centroid_b = 0.5_wp*(forward%centroid_b + back%centroid)
      mean%normal = 0.5_wp*(forward%normal + back%normal)
      mean%moment_a = 0.5_wp*(forward%moment_a + back%moment_b)
      mean%moment_b = 0.5_wp*(forward%moment_b + back%moment_a)
      mean%length_square = 0.5_wp*(forward%length_square + back%length_square)
      mean%of_area = 0.5_wp*(forward%of_area + back%of_area)
   end function mean

   !> First edge of one polygon that separates it from another, 0 if there is none
   pure integer(ip) function first_separating(polygon, other, offset, reach_other, scale)
      real(wp), intent(in), contiguous :: polygon(:, :), other(:, :)
      !> Centre of the other minus centre of the polygon
      real(wp), intent(in) :: offset(2)
      real(wp), intent(in) :: reach_other
      !> Size of the smaller of the two
      real(wp), intent(in) :: scale

      do first_separating = 1_ip, size(polygon, 2, kind=ip)
         if (separates(polygon, first_separating, other, offset, reach_other, scale)) return
      end do
      first_separating = 0_ip
   end function first_separating

   !> Whether an edge separates the polygons: no vertex of the other polygon lies on its inner side
   pure logical function separates(polygon, k, other, offset, reach_other, scale)
      real(wp), intent(in), contiguous :: polygon(:, :)
      integer(ip), intent(in) :: k
      real(wp), intent(in), contiguous :: other(:, :)
      real(wp), intent(in) :: offset(2), reach_other, scale
      real(wp) :: start(2), end(2), edge(2), tolerance, level, depth
      integer(ip) :: i

      start = polygon(:, k)
      end = polygon(:, merge(1_ip, k + 1_ip, k == size(polygon, 2, kind=ip)))
      edge = end - start
      tolerance = roundoff*scale*(abs(edge(1)) + abs(edge(2)))
      level = depth_of(offset, start, end, scale)
      separates = .false.
      ! The other polygon contains its centre. If the centre is on the inner side, the edge does not separate.
      if (level > tolerance) return
      depth = level
      if (reach_other <= far*scale) then
         do i = 1_ip, size(other, 2, kind=ip)
            depth = max(depth, (edge(1)*other(2, i) - edge(2)*other(1, i)) + level)
         end do
      else
         do i = 1_ip, size(other, 2, kind=ip)
            depth = max(depth, exact_cross(start, end, offset, other(:, i)))
         end do
      end if
      separates = depth <= tolerance
   end function separates

   !> Depth of a point below the line of an edge, positive on its inner side, times the length of the edge [m2]
   pure real(wp) function depth_of(point, start, end, scale)
      real(wp), intent(in) :: point(2), start(2), end(2), scale
      real(wp) :: arm(2)

      arm = point - start
      if (max(abs(arm(1)), abs(arm(2))) <= far*scale) then
         depth_of = (end(1) - start(1))*arm(2) - (end(2) - start(2))*arm(1)
      else
         depth_of = exact_cross(start, end, point, [0.0_wp, 0.0_wp])
      end if
   end function depth_of

   !> Clip the subject by all edges of the clipper, and integrate over the remaining loop.
   !>
   !> The normal and the moments are those of the clipper's outline inside the subject; `moment_a` is about
   !> the subject's centre, `moment_b` about the clipper's.
   pure subroutine clip(subject, clipper, offset, scale, by, overlap)
      real(wp), intent(in), contiguous :: subject(:, :), clipper(:, :)
      !> Centre of the clipper minus centre of the subject
      real(wp), intent(in) :: offset(2)
      !> Size of the subject
      real(wp), intent(in) :: scale
      !> How the overlap is measured
      type(overlap_measure_t), intent(in) :: by
      type(overlap_t), intent(inout) :: overlap
      real(wp) :: vertex(usual_corners, 2, 2), work(usual_corners, 2)
      logical :: on_clipper(usual_corners, 2)
      integer(ip) :: corners

      ! Each edge of the clipper adds at most one vertex.
      corners = size(subject, 2, kind=ip) + size(clipper, 2, kind=ip)
      if (corners <= usual_corners) then
         call clip_in(subject, clipper, offset, scale, by, usual_corners, vertex, on_clipper, work, &
                      overlap)
      else
         call clip_many(subject, clipper, offset, scale, by, corners, overlap)
      end if
   end subroutine clip

   !> As `clip`, with work arrays for `corners` vertices
   pure subroutine clip_many(subject, clipper, offset, scale, by, corners, overlap)
      real(wp), intent(in), contiguous :: subject(:, :), clipper(:, :)
      real(wp), intent(in) :: offset(2), scale
      type(overlap_measure_t), intent(in) :: by
      integer(ip), intent(in) :: corners
      type(overlap_t), intent(inout) :: overlap
      real(wp) :: vertex(corners, 2, 2), work(corners, 2)
      logical :: on_clipper(corners, 2)

      call clip_in(subject, clipper, offset, scale, by, corners, vertex, on_clipper, work, overlap)
   end subroutine clip_many

   !> As `clip`, in given work arrays; their last index selects the loop before or after a cut
   pure subroutine clip_in(subject, clipper, offset, scale, by, corners, vertex, on_clipper, work, overlap)
      real(wp), intent(in), contiguous :: subject(:, :), clipper(:, :)
      real(wp), intent(in) :: offset(2), scale
      type(overlap_measure_t), intent(in) :: by
      !> Capacity of the arrays, in vertices
      integer(ip), intent(in) :: corners
      !> Vertices (corner, x or y, loop)
      real(wp), intent(inout) :: vertex(corners, 2, 2)
      !> Whether the edge that starts at a vertex lies on the clipper's outline
      logical, intent(inout) :: on_clipper(corners, 2)
      !> Depths times the length of the edge: of each vertex below the clip line, and of the centre below each line
      real(wp), intent(inout) :: work(corners, 2)
      type(overlap_t), intent(inout) :: overlap
      integer(ip) :: n, now

      call cut_all(subject, clipper, offset, scale, corners, vertex, on_clipper, work, n, now)
      if (n == 0_ip) return
      call integrate_loop(n, corners, vertex(:, :, now), on_clipper(:, now), offset, overlap)
      if (by%with_area) overlap%of_area = [overlap%normal, overlap%moment_a - (overlap%centroid(1)*overlap%normal(2) &
                                                                            - overlap%centroid(2)*overlap%normal(1)), &
                                           overlap%area]
      if (.not. (by%has_moments .and. overlap%area > 0.0_wp)) return
      call weigh_by_shape(n, corners, vertex(:, :, now), on_clipper(:, now), offset, by, vertex(:, :, 3_ip - now), &
                          overlap)
   end subroutine clip_in

   !> The loop around the overlap of two polygons with at most `usual_corners` corners together; none for more.
   pure subroutine clip_loop(subject, clipper, offset, scale, n, vertex, on_clipper)
      !> Vertices, anticlockwise, each relative to its own centre, (2, n) and (2, m) [m]
      real(wp), intent(in), contiguous :: subject(:, :), clipper(:, :)
      !> Centre of the clipper minus centre of the subject, and radius of the subject [m]
      real(wp), intent(in) :: offset(2), scale
      !> Number of vertices; 0: there is no overlap
      integer(ip), intent(out) :: n
      !> Vertices, anticlockwise, relative to the centre of the subject [m]
      real(wp), intent(out) :: vertex(usual_corners, 2)
      !> Whether the edge that starts at a vertex lies on the clipper's outline
      logical, intent(out) :: on_clipper(usual_corners)
      real(wp) :: loops(usual_corners, 2, 2), work(usual_corners, 2)
      logical :: flags(usual_corners, 2)
      integer(ip) :: now

      n = 0_ip
      if (size(subject, 2) + size(clipper, 2) > usual_corners) return
      call cut_all(subject, clipper, offset, scale, usual_corners, loops, flags, work, n, now)
      vertex(:n, :) = loops(:n, :, now)
      on_clipper(:n) = flags(:n, now)
   end subroutine clip_loop

   !> Cut the subject along all edges of the clipper, in given work arrays as those of `clip_in`.
   pure subroutine cut_all(subject, clipper, offset, scale, corners, vertex, on_clipper, work, n, now)
      real(wp), intent(in), contiguous :: subject(:, :), clipper(:, :)
      real(wp), intent(in) :: offset(2), scale
      integer(ip), intent(in) :: corners
      real(wp), intent(inout) :: vertex(corners, 2, 2)
      logical, intent(inout) :: on_clipper(corners, 2)
      real(wp), intent(inout) :: work(corners, 2)
      !> Number of vertices that are left, 0 if there is no overlap, and the loop that they are in
      integer(ip), intent(out) :: n, now
      integer(ip) :: i, k, m
      real(wp) :: edge(2), lowest, highest

      n = size(subject, 2, kind=ip)
      m = size(clipper, 2, kind=ip)
      do i = 1_ip, n
         vertex(i, 1, 1) = subject(1, i)
         vertex(i, 2, 1) = subject(2, i)
         on_clipper(i, 1) = .false.
      end do
      now = 1_ip
      call find_levels(clipper, offset, scale, work(:, 2), k)
      do i = 1_ip, m
         edge = clipper(:, merge(1_ip, k + 1_ip, k == m)) - clipper(:, k)
         ! An edge farther from the centre than the size of the subject cuts nothing: its length is sqrt(2) max at most.
         if (work(k, 2) <= 1.43_wp*scale*max(abs(edge(1)), abs(edge(2)))) then
            call measure(n, corners, vertex(:, :, now), edge, work(k, 2), scale, work(:, 1), lowest, highest)
            if (.not. highest > 0.0_wp) then
               n = 0_ip
               return
            end if
            if (lowest < 0.0_wp) then
               call cut(n, corners, vertex(:, :, now), on_clipper(:, now), work(:, 1), &
                        vertex(:, :, 3_ip - now), on_clipper(:, 3_ip - now))
               now = 3_ip - now
            else if (.not. lowest > 0.0_wp) then
               call mark_edges_on_line(n, work(:, 1), on_clipper(:, now))
            end if
         end if
         k = merge(1_ip, k + 1_ip, k == m)
      end do
   end subroutine cut_all

   !> Depth of the subject's centre below all edges of the clipper
   pure subroutine find_levels(clipper, offset, scale, level, lowest)
      real(wp), intent(in), contiguous :: clipper(:, :)
      real(wp), intent(in) :: offset(2), scale
      real(wp), intent(inout) :: level(:)
      !> Edge with the least depth; the cuts start with it because it removes most of the subject
      integer(ip), intent(out) :: lowest
      real(wp) :: least
      integer(ip) :: k, m

      m = size(clipper, 2, kind=ip)
      least = huge(1.0_wp)
      lowest = 1_ip
      do k = 1_ip, m
         level(k) = depth_of(-offset, clipper(:, k), clipper(:, merge(1_ip, k + 1_ip, k == m)), scale)
         if (level(k) < least) lowest = k
         least = min(least, level(k))
      end do
   end subroutine find_levels

   !> Depth of all vertices below a clip line; zero for those on it
   pure subroutine measure(n, corners, vertex, edge, level, scale, depth, lowest, highest)
      integer(ip), intent(in) :: n, corners
      real(wp), intent(in) :: vertex(corners, 2), edge(2)
      !> Depth of the origin, times the length of the edge
      real(wp), intent(in) :: level
      real(wp), intent(in) :: scale
      real(wp), intent(inout) :: depth(n)
      !> Least depth
      real(wp), intent(out) :: lowest
      !> Greatest depth
      real(wp), intent(out) :: highest
      real(wp) :: tolerance
      integer(ip) :: i

      tolerance = roundoff*scale*(abs(edge(1)) + abs(edge(2)))
      lowest = huge(1.0_wp)
      highest = -huge(1.0_wp)
      do i = 1_ip, n
         depth(i) = (edge(1)*vertex(i, 2) - edge(2)*vertex(i, 1)) + level
         depth(i) = merge(0.0_wp, depth(i), abs(depth(i)) <= tolerance)
         lowest = min(lowest, depth(i))
         highest = max(highest, depth(i))
      end do
   end subroutine measure

   !> Mark the edges that lie on the clip line as edges of the clipper.
   pure subroutine mark_edges_on_line(n, depth, on_clipper)
      integer(ip), intent(in) :: n
      real(wp), intent(in) :: depth(n)
      logical, intent(inout) :: on_clipper(n)
      integer(ip) :: i

      do i = 1_ip, n
         if (max(depth(i), depth(merge(1_ip, i + 1_ip, i == n))) <= 0.0_wp) on_clipper(i) = .true.
      end do
   end subroutine mark_edges_on_line

   !> Keep the vertices around the deepest one up to the clip line, and close the loop along that line.
   !>
   !> The remaining vertices are consecutive even if rounding has made the loop slightly concave. A cut therefore
   !> adds at most two vertices and drops at least one.
   pure subroutine cut(n, corners, vertex, on_clipper, depth, vertex_cut, on_clipper_cut)
      !> Number of vertices before and after
      integer(ip), intent(inout) :: n
      integer(ip), intent(in) :: corners
      real(wp), intent(in) :: vertex(corners, 2)
      logical, intent(in) :: on_clipper(corners)
      real(wp), intent(in) :: depth(n)
      real(wp), intent(inout) :: vertex_cut(corners, 2)
      logical, intent(inout) :: on_clipper_cut(corners)
      integer(ip) :: i, m, before, after

      before = maxloc(depth, dim=1)
      do while (depth(before) >= 0.0_wp)
         before = merge(n, before - 1_ip, before == 1_ip)
      end do
      i = merge(1_ip, before + 1_ip, before == n)
      m = 0_ip
      if (depth(i) > 0.0_wp) then
         m = 1_ip
         vertex_cut(m, :) = crossing(i, before)
         on_clipper_cut(m) = on_clipper(before)
      end if
      do
         m = m + 1_ip
         vertex_cut(m, 1) = vertex(i, 1)
         vertex_cut(m, 2) = vertex(i, 2)
         after = merge(1_ip, i + 1_ip, i == n)
         on_clipper_cut(m) = on_clipper(i) .or. max(depth(i), depth(after)) <= 0.0_wp
         if (depth(after) < 0.0_wp) exit
         i = after
      end do
      if (depth(i) > 0.0_wp) then
         m = m + 1_ip
         vertex_cut(m, :) = crossing(i, after)
         on_clipper_cut(m) = .true.
      end if
      n = m

   contains

      !> Intersection of the line with the edge from a vertex below it to a vertex above it
      pure function crossing(below, above) result(point)
         integer(ip), intent(in) :: below, above
         real(wp) :: point(2)
         real(wp) :: share

         share = depth(below)/(depth(below) - depth(above))
         point(1) = vertex(below, 1) + share*(vertex(above, 1) - vertex(below, 1))
         point(2) = vertex(below, 2) + share*(vertex(above, 2) - vertex(below, 2))
      end function crossing
   end subroutine cut

end module polydem_clipping
