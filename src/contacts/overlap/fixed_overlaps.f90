!> Overlaps between fixed bodies at the start: parts of walls that lie twice in the same place.
module polydem_fixed_overlaps
   use polydem_bodies, only: bodies_t
   use polydem_convex_overlap, only: find_overlap, overlap_t
   use polydem_kinds, only: ip, lp, wp
   use polydem_overlap_measure, only: true_area
   use polydem_sort_reals, only: sort_reals
   implicit none
   private
   public :: find_fixed_overlaps

   !> Overlaps below this share of the smaller area are rounding errors of edges in common
   real(wp), parameter :: least_share = 1.0e-9_wp

contains

   !> Count the pairs of fixed bodies that overlap, and find the one with the largest overlap.
   subroutine find_fixed_overlaps(bodies, is_loaded, n, first, second, area, place)
      !> Bodies with rotated polygons
      type(bodies_t), intent(in) :: bodies
      !> Whether a body belongs to a load-controlled wall; its overlaps do not count
      logical, intent(in) :: is_loaded(:)
      !> Number of pairs
      integer(lp), intent(out) :: n
      !> Slots of the pair with the largest overlap, 0 if there is none
      integer(ip), intent(out) :: first, second
      !> Area of the largest overlap, and its centroid [m2, m]
      real(wp), intent(out) :: area, place(2)
      integer(ip), allocatable :: slot(:), ranked(:)
      real(wp), allocatable :: low(:, :), high(:, :)
      type(overlap_t) :: overlap
      integer(ip) :: a, b, j, k, s

      n = 0_lp
      first = 0_ip
      second = 0_ip
      area = 0.0_wp
      place = 0.0_wp
      slot = pack([(s, s=1_ip, bodies%n)], bodies%fixed(:bodies%n) .and. .not. is_loaded)
      if (size(slot) < 2) return
      allocate (low(2, size(slot)), high(2, size(slot)), ranked(size(slot)))
      do k = 1_ip, size(slot, kind=ip)
         low(:, k) = bodies%position(:, slot(k)) + minval(bodies%pieces%turned_polygon(slot(k)), dim=2)
         high(:, k) = bodies%position(:, slot(k)) + maxval(bodies%pieces%turned_polygon(slot(k)), dim=2)
      end do
      call sort_reals(low(1, :), ranked)
      ! Boxes in ascending order of their left ends: those that begin before a box ends may overlap it.
      do k = 1_ip, size(slot, kind=ip)
         a = ranked(k)
         do j = k + 1_ip, size(slot, kind=ip)
            b = ranked(j)
            if (low(1, b) >= high(1, a)) exit
            if (low(2, b) >= high(2, a) .or. low(2, a) >= high(2, b)) cycle
            overlap = overlap_of(bodies, slot(a), slot(b))
            if (.not. overlap%area > least_share*min(area_of(bodies, slot(a)), area_of(bodies, slot(b)))) cycle
            n = n + 1_lp
            if (overlap%area <= area) cycle
            area = overlap%area
            first = min(slot(a), slot(b))
            second = max(slot(a), slot(b))
            place = bodies%position(:, smaller_of(bodies, slot(a), slot(b))) + overlap%centroid
         end do
      end do
   end subroutine find_fixed_overlaps

   !> The body with the smaller radius
   pure integer(ip) function smaller_of(bodies, i, j)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: i, j

      smaller_of = merge(j, i, bodies%radius(j) < bodies%radius(i))
   end function smaller_of

   !> Overlap of two bodies: area of the greatest overlap of their pieces, and its centroid relative to the centre of
   !> the body with the smaller radius
   function overlap_of(bodies, i, j) result(greatest)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: i, j
      type(overlap_t) :: greatest
      type(overlap_t) :: overlap
      real(wp) :: offset(2)
      integer(ip) :: a, b, features, p, q, rejected, of_p(2), of_q(2)

      p = smaller_of(bodies, i, j)
      q = i + j - p
      offset = bodies%position(:, q) - bodies%position(:, p)
      of_p = bodies%pieces%pieces_of(p)
      of_q = bodies%pieces%pieces_of(q)
      greatest%area = 0.0_wp
      do a = of_p(1), of_p(2)
         do b = of_q(1), of_q(2)
            rejected = 0_ip
            if (bodies%pieces%most == 1_ip) then
               call find_overlap(bodies%pieces%turned_polygon(p), bodies%pieces%turned_polygon(q), offset, &
                                 bodies%radius(p), bodies%radius(q), true_area, overlap, &
                                 features, rejected)
            else
               call find_overlap(outline_of(bodies, a), outline_of(bodies, b), &
                                 offset + (bodies%pieces%arm(:, b) - bodies%pieces%arm(:, a)), &
                                 bodies%pieces%radius(a), bodies%pieces%radius(b), true_area, overlap, &
                                 features, rejected)
               overlap%centroid = overlap%centroid + bodies%pieces%arm(:, a)
            end if
            if (overlap%area > greatest%area) greatest = overlap
         end do
      end do
   end function overlap_of

   !> Turned vertices of a piece relative to its centroid, (2, vertex) [m]
   pure function outline_of(bodies, p) result(outline)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: p
      real(wp) :: outline(2, bodies%pieces%start(p + 1_ip) - bodies%pieces%start(p))

      outline = bodies%pieces%outline(:, bodies%pieces%start(p):bodies%pieces%start(p + 1_ip) - 1_ip)
   end function outline_of

   !> Area of a body [m2]
   pure real(wp) function area_of(bodies, s)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: s

      area_of = bodies%pieces%area_of(s)
   end function area_of

end module polydem_fixed_overlaps
