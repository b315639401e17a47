!> Bodies of several convex pieces: their mass properties, and the check that pieces do not overlap.
module polydem_piece_properties
   use polydem_convex_overlap, only: find_overlap, overlap_t
   use polydem_kinds, only: ip, wp
   use polydem_overlap_measure, only: true_area
   use polydem_polygon, only: clean_polygon, greatest_radius, mass_properties
   use polydem_sort_reals, only: sort_reals
   use polydem_strings, only: to_text
   implicit none
   private
   public :: join_pieces

   !> Overlaps below this share of the smaller area are rounding errors of edges in common
   real(wp), parameter :: least_share = 1.0e-9_wp + 64.0_wp*epsilon(1.0_wp)

contains

   !> Clean the pieces of a body, and find the mass properties of all: sums over the pieces, with Steiner's terms.
   subroutine join_pieces(vertices, first, joined, number, area, centroid, second_moment, problem)
      !> Vertices of each piece in turn, (2, vertex) [m]
      real(wp), intent(in) :: vertices(:, :)
      !> Number of vertices before each piece, and of all, (number of pieces + 1)
      integer(ip), intent(in) :: first(:)
      !> Vertices of each cleaned piece in turn, anticlockwise, (2, vertex) [m]
      real(wp), allocatable, intent(out) :: joined(:, :)
      !> Number of the piece of each of these vertices, from 0
      integer(ip), allocatable, intent(out) :: number(:)
      !> Area of all pieces [m2]
      real(wp), intent(out) :: area
      !> Their centroid [m], and second moment of area about it [m4]
      real(wp), intent(out) :: centroid(2), second_moment
      !> Allocated if a piece is invalid or two overlap
      character(len=:), allocatable, intent(out) :: problem
      real(wp), allocatable :: cleaned(:, :), room(:, :)
      real(wp) :: areas(size(first) - 1), centres(2, size(first) - 1), moments(size(first) - 1)
      integer(ip) :: ends(0:size(first) - 1)
      integer(ip) :: p, n

      n = size(first, kind=ip) - 1_ip
      allocate (room(2, size(vertices, 2)), number(size(vertices, 2)))
      ends(0) = 0_ip
      area = 0.0_wp
      centroid = 0.0_wp
      second_moment = 0.0_wp
      do p = 1_ip, n
         call clean_polygon(vertices(:, first(p) + 1_ip:first(p + 1_ip)), cleaned, problem)
         if (allocated(problem)) then
            problem = 'piece '//to_text(p - 1_ip)//', counted from 0, '//problem// &
               '; ./polydem import --decompose cuts concave outlines into convex pieces'
            return
         end if
         ends(p) = ends(p - 1_ip) + size(cleaned, 2, kind=ip)
         room(:, ends(p - 1_ip) + 1_ip:ends(p)) = cleaned
         number(ends(p - 1_ip) + 1_ip:ends(p)) = p - 1_ip
         call mass_properties(cleaned, areas(p), centres(:, p), moments(p))
      end do
      joined = room(:, :ends(n))
      number = number(:ends(n))
      area = sum_of(areas)
      ! Relative to the first centre, so that the precision does not depend on the distance from the origin
      centroid(1) = centres(1, 1) + sum_of(areas*(centres(1, :) - centres(1, 1)))/area
      centroid(2) = centres(2, 1) + sum_of(areas*(centres(2, :) - centres(2, 1)))/area
      second_moment = sum_of(moments + areas*((centres(1, :) - centroid(1))**2 + (centres(2, :) - centroid(2))**2))
      call check_overlaps(joined, ends, areas, centres, problem)
   end subroutine join_pieces

   !> Check that no two pieces overlap. Those are compared whose bounds meet: a sweep along the axis along which the
   !> pieces are more spread out.
   subroutine check_overlaps(joined, ends, areas, centres, problem)
      !> Vertices of all pieces [m], and last vertex of each, (0:number of pieces)
      real(wp), intent(in) :: joined(:, :)
      integer(ip), intent(in) :: ends(0:)
      !> Areas and centroids of the pieces [m2, m]
      real(wp), intent(in) :: areas(:), centres(:, :)
      !> Allocated if two overlap
      character(len=:), allocatable, intent(inout) :: problem
      real(wp) :: low(2, size(areas)), high(2, size(areas))
      integer(ip) :: ranked(size(areas)), pair(2), least(2), j, k, p, n
      integer :: axis

      n = size(areas, kind=ip)
      do p = 1_ip, n
         low(:, p) = minval(joined(:, ends(p - 1_ip) + 1_ip:ends(p)), 2)
         high(:, p) = maxval(joined(:, ends(p - 1_ip) + 1_ip:ends(p)), 2)
      end do
      axis = maxloc((maxval(high, 2) - minval(low, 2))/sum(high - low, 2), 1)
      call sort_reals(low(axis, :), ranked)
      ! The message names the first two that overlap.
      least = n + 1_ip
      do k = 1_ip, n
         do j = k + 1_ip, n
            if (low(axis, ranked(j)) > high(axis, ranked(k))) exit
            pair = [min(ranked(j), ranked(k)), max(ranked(j), ranked(k))]
            if (low(3 - axis, pair(1)) > high(3 - axis, pair(2))) cycle
            if (low(3 - axis, pair(2)) > high(3 - axis, pair(1))) cycle
            if (pair(1) > least(1) .or. (pair(1) == least(1) .and. pair(2) > least(2))) cycle
            if (overlap_of(pair(1), pair(2)) > least_share*minval(areas(pair))) least = pair
         end do
      end do
      if (least(1) > n) return
      problem = 'its pieces '//to_text(least(1) - 1_ip)//' and '//to_text(least(2) - 1_ip)// &
         ', counted from 0, overlap; pieces may touch only, as ./polydem import --decompose makes them'

   contains

      !> Overlap of two pieces [m2]
      real(wp) function overlap_of(i, j) result(common)
         integer(ip), intent(in) :: i, j
         type(overlap_t) :: overlap
         real(wp), allocatable :: a(:, :), b(:, :)
         integer(ip) :: features, rejected

         a = joined(:, ends(i - 1_ip) + 1_ip:ends(i)) - spread(centres(:, i), 2, ends(i) - ends(i - 1_ip))
         b = joined(:, ends(j - 1_ip) + 1_ip:ends(j)) - spread(centres(:, j), 2, ends(j) - ends(j - 1_ip))
         rejected = 0_ip
         call find_overlap(a, b, centres(:, j) - centres(:, i), greatest_radius(a), greatest_radius(b), true_area, &
                           overlap, features, rejected)
         common = overlap%area
      end function overlap_of

   end subroutine check_overlaps

   !> Sum in order
   pure real(wp) function sum_of(values)
      real(wp), intent(in) :: values(:)
      integer(ip) :: k

      sum_of = 0.0_wp
      do k = 1_ip, size(values, kind=ip)
         sum_of = sum_of + values(k)
      end do
   end function sum_of

end module polydem_piece_properties
