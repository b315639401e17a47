!> Room for bodies that enter: they are compared with others by circles around them, with fixed ones by their outlines.
module polydem_room
   use polydem_bodies, only: bodies_t
   use polydem_cell, only: into_cell, minimum_image
   use polydem_elementary, only: hypotenuse
   use polydem_kinds, only: ip, wp
   use polydem_source, only: candidate_t
   implicit none
   private
   public :: put_candidates, list_near, meets_any, meets_fixed

contains

   !> Put the places of candidates into the cell, if there is one.
   pure subroutine put_candidates(bodies, candidates)
      !> Bodies, of which the cell is used
      type(bodies_t), intent(in) :: bodies
      !> Bodies that may enter; their places change
      type(candidate_t), intent(inout) :: candidates(:)
      integer :: j, k

      if (.not. bodies%cell%is_periodic) return
      do k = 1, size(candidates)
         do j = 1, size(candidates(k)%place, 2)
            candidates(k)%place(:, j) = into_cell(bodies%cell, candidates(k)%place(:, j))
         end do
      end do
   end subroutine put_candidates

   !> List the circles around the free bodies near a point: centre and radius, (3, body) [m].
   subroutine list_near(bodies, point, reach, kept, near)
      type(bodies_t), intent(in) :: bodies
      !> The point, and the distance to the farthest circle [m]
      real(wp), intent(in) :: point(2), reach
      !> Whether each body stays
      logical, intent(in) :: kept(:)
      !> Centres and radii
      real(wp), allocatable, intent(out) :: near(:, :)
      real(wp) :: offset(2)
      integer(ip) :: k, n

      allocate (near(3, size(bodies%free)))
      n = 0_ip
      do k = 1_ip, size(bodies%free, kind=ip)
         associate (s => bodies%free(k))
            if (.not. kept(s)) cycle
            offset = minimum_image(bodies%cell, bodies%cell%inverse, bodies%position(:, s) - point)
            ! Copies above and below that slide may be nearer along x.
            if (bodies%cell%is_sheared) offset(1) = 0.0_wp
            if (hypotenuse(offset(1), offset(2)) >= reach + bodies%radius(s)) cycle
            n = n + 1_ip
            near(:, n) = [bodies%position(:, s), bodies%radius(s)]
         end associate
      end do
      near = near(:, :n)
   end subroutine list_near

   !> Whether a circle meets one of others
   pure logical function meets_any(bodies, centre, radius, circles)
      !> Bodies, of which the cell is used
      type(bodies_t), intent(in) :: bodies
      !> Centre and radius [m]
      real(wp), intent(in) :: centre(2), radius
      !> Centres and radii of the others, (3, circle) [m]
      real(wp), intent(in) :: circles(:, :)
      real(wp) :: offset(2)
      integer :: k

      meets_any = .true.
      do k = 1, size(circles, 2)
         offset = minimum_image(bodies%cell, bodies%cell%inverse, circles(1:2, k) - centre)
         if (sum(offset**2) < (radius + circles(3, k))**2) return
      end do
      meets_any = .false.
   end function meets_any

   !> Whether a circle meets a fixed body that is there
   pure logical function meets_fixed(bodies, centre, radius)
      !> Bodies with the turned vertices of the fixed ones
      type(bodies_t), intent(in) :: bodies
      !> Centre and radius [m]
      real(wp), intent(in) :: centre(2), radius
      real(wp) :: offset(2), inverse_period(2)
      integer(ip) :: p, pieces(2), s

      meets_fixed = .true.
      do s = 1_ip, bodies%n
         if (.not. bodies%fixed(s)) cycle
         if (allocated(bodies%removed)) then
            if (bodies%removed(s)) cycle
         end if
         offset = centre - bodies%position(:, s)
         inverse_period = 0.0_wp
         if (allocated(bodies%inverse_period)) inverse_period = bodies%inverse_period(:, s)
         offset = minimum_image(bodies%cell, inverse_period, offset)
         if (hypotenuse(offset(1), offset(2)) >= radius + bodies%radius(s)) cycle
         pieces = bodies%pieces%pieces_of(s)
         do p = pieces(1), pieces(2)
            if (distance_from(bodies%pieces%turned_piece(p), offset) < radius) return
         end do
      end do
      meets_fixed = .false.
   end function meets_fixed

   !> Greatest distance of a point from the lines of the edges of a convex polygon, outwards: at most its distance from
   !> the polygon [m]
   pure real(wp) function distance_from(polygon, point) result(distance)
      !> Vertices, anticlockwise, (2, vertex) [m]
      real(wp), intent(in) :: polygon(:, :)
      !> The point [m]
      real(wp), intent(in) :: point(2)
      real(wp) :: edge(2), from(2)
      integer :: k, n

      distance = -huge(1.0_wp)
      n = size(polygon, 2)
      do k = 1, n
         edge = polygon(:, mod(k, n) + 1) - polygon(:, k)
         from = point - polygon(:, k)
         distance = max(distance, (from(1)*edge(2) - from(2)*edge(1))/hypotenuse(edge(1), edge(2)))
      end do
   end function distance_from

end module polydem_room
