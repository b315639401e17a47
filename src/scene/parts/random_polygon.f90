!> Random convex polygons: all corners are uniformly distributed, as in random points that happen to be convex.
!>
!> The method is that of P. Valtr, Probability that n random points are in convex position, Discrete & Computational
!> Geometry 13 (1995) 637. Random coordinates, sorted, are steps along an axis from the least to the greatest one and
!> back. Steps along x and along y form vectors at random; in the order of their directions they are the edges.
module polydem_random_polygon
   use polydem_elementary, only: hypotenuse
   use polydem_kinds, only: ip, wp
   use polydem_random, only: random_t
   use polydem_sort_reals, only: sort_reals
   implicit none
   private
   public :: draw_random_polygon

   !> Polygons with less of the area of their rectangle, shorter edges or flatter corners are drawn again: edge over the
   !> side of the rectangle, and sine of the turn, both times the number of corners
   real(wp), parameter :: least_area = 0.3_wp, least_edge = 0.1_wp, least_turn = 0.02_wp
   !> Greatest number of trials
   integer, parameter :: most_trials = 10000

contains

   !> Draw a convex polygon that just fits into a rectangle with its centre at the origin.
   subroutine draw_random_polygon(random, n, length, width, corners)
      type(random_t), intent(inout) :: random
      !> Number of corners
      integer(ip), intent(in) :: n
      !> Sides of the rectangle along x and y [m]
      real(wp), intent(in) :: length, width
      !> Corners, anticlockwise, (2, corner) [m]
      real(wp), allocatable, intent(out) :: corners(:, :)
      real(wp) :: edges(2, n), low(2), high(2)
      integer(ip) :: k
      integer :: trial

      allocate (corners(2, n))
      do trial = 1, most_trials
         call draw_steps(random, edges(1, :))
         call draw_steps(random, edges(2, :))
         call shuffle(random, edges(2, :))
         call sort_by_direction(edges)
         corners(:, 1) = 0.0_wp
         do k = 2_ip, n
            corners(:, k) = corners(:, k - 1_ip) + edges(:, k - 1_ip)
         end do
         low = minval(corners, 2)
         high = maxval(corners, 2)
         do k = 1_ip, n
            corners(:, k) = (corners(:, k) - 0.5_wp*(low + high))/(high - low)
         end do
         if (is_good(corners)) exit
      end do
      corners(1, :) = length*corners(1, :)
      corners(2, :) = width*corners(2, :)
   end subroutine draw_random_polygon

   !> Draw steps along an axis from the least of random coordinates to the greatest one and back.
   subroutine draw_steps(random, steps)
      type(random_t), intent(inout) :: random
      real(wp), intent(out) :: steps(:)
      real(wp) :: place(size(steps)), last(2)
      integer(ip) :: ranked(size(steps)), k, n

      n = size(steps, kind=ip)
      do k = 1_ip, n
         place(k) = random%uniform()
      end do
      call sort_reals(place, ranked)
      last = place(ranked(1))
      do k = 2_ip, n - 1_ip
         associate (here => place(ranked(k)))
            if (random%uniform() < 0.5_wp) then
               steps(k - 1_ip) = here - last(1)
               last(1) = here
            else
               steps(k - 1_ip) = last(2) - here
               last(2) = here
            end if
         end associate
      end do
      steps(n - 1_ip) = place(ranked(n)) - last(1)
      steps(n) = last(2) - place(ranked(n))
   end subroutine draw_steps

   !> Put numbers into a random order.
   subroutine shuffle(random, numbers)
      type(random_t), intent(inout) :: random
      real(wp), intent(inout) :: numbers(:)
      real(wp) :: number
      integer(ip) :: j, k

      do k = size(numbers, kind=ip), 2_ip, -1_ip
         j = random%whole(1_ip, k)
         number = numbers(j)
         numbers(j) = numbers(k)
         numbers(k) = number
      end do
   end subroutine shuffle

   !> Sort vectors by direction, anticlockwise from the positive x axis.
   pure subroutine sort_by_direction(vectors)
      real(wp), intent(inout) :: vectors(:, :)
      real(wp) :: vector(2)
      integer :: j, k

      do k = 2, size(vectors, 2)
         vector = vectors(:, k)
         j = k - 1
         do while (j >= 1)
            if (.not. is_before(vector, vectors(:, j))) exit
            vectors(:, j + 1) = vectors(:, j)
            j = j - 1
         end do
         vectors(:, j + 1) = vector
      end do
   end subroutine sort_by_direction

   !> Whether the direction of a comes before that of b
   pure logical function is_before(a, b)
      real(wp), intent(in) :: a(2), b(2)
      logical :: a_is_upper, b_is_upper

      a_is_upper = a(2) >= 0.0_wp
      b_is_upper = b(2) >= 0.0_wp
      is_before = a_is_upper .and. .not. b_is_upper
      if (a_is_upper .eqv. b_is_upper) is_before = a(1)*b(2) - a(2)*b(1) > 0.0_wp
   end function is_before

   !> Whether a polygon in a unit square has area, and no edge is very short and no corner very flat
   pure logical function is_good(corners)
      real(wp), intent(in) :: corners(:, :)
      real(wp) :: here(2), next(2), area, lengths(2)
      integer :: k, n

      n = size(corners, 2)
      area = 0.0_wp
      is_good = .false.
      do k = 1, n
         here = corners(:, modulo(k, n) + 1) - corners(:, k)
         next = corners(:, modulo(k + 1, n) + 1) - corners(:, modulo(k, n) + 1)
         lengths = [hypotenuse(here(1), here(2)), hypotenuse(next(1), next(2))]
         if (.not. lengths(1)*real(n, wp) >= least_edge) return
         if (.not. (here(1)*next(2) - here(2)*next(1))*real(n, wp) >= least_turn*lengths(1)*lengths(2)) return
         area = area + 0.5_wp*(corners(1, k)*here(2) - corners(2, k)*here(1))
      end do
      is_good = area >= least_area
   end function is_good

end module polydem_random_polygon
