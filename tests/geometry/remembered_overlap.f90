!> What a time step does with a remembered pair, and shapes and positions for the tests of it.
module remembered_overlap
   use overlap_cases, only: irregular, rectangle, regular, turned, two_pi
   use polydem_convex_overlap, only: find_overlap, overlap_t
   use polydem_instruction_set, only: isa_base
   use polydem_kinds, only: ip, lp, wp
   use polydem_lens_kernel_base, only: evaluate_batch
   use polydem_overlap_batch, only: add_lane, lanes, overlap_batch_t, overlap_columns_t
   use polydem_overlap_measure, only: area_per_length, effective_area, overlap_measure_t, true_area
   use polydem_random, only: random_t
   use polydem_separation, only: test_edges
   implicit none
   private
   public :: pair_t, overlap_with_memory, separated_by, certified_lens, same_bits, radius_of
   public :: random_pair, grid_pair, any_integer, n_kinds, measure_of

   !> Kinds of random pairs
   integer, parameter :: n_kinds = 8

   !> Two polygons; those of a test have at most 12 corners
   type :: pair_t
      !> Vertices of P and of Q, (2, n)
      real(wp), allocatable :: p(:, :), q(:, :)
      !> Centre of Q minus centre of P
      real(wp) :: offset(2) = 0.0_wp
   end type pair_t

contains

   !> Every measure of overlaps in turn, with the gradient of the true area
   pure type(overlap_measure_t) function measure_of(k)
      integer, intent(in) :: k
      type(overlap_measure_t), parameter :: all_measures(0:2) = [true_area, effective_area, area_per_length]

      measure_of = all_measures(modulo(k, size(all_measures)))
      measure_of%with_area = .true.
   end function measure_of

   !> Overlap of a pair from what is remembered; `features` becomes what the next step remembers, as in `fill_block`
   subroutine overlap_with_memory(pair, measure, features, overlap)
      !> The pair, P first
      type(pair_t), intent(in) :: pair
      !> How the overlap is measured
      type(overlap_measure_t), intent(in) :: measure
      !> Any integer
      integer(ip), intent(inout) :: features
      !> The overlap
      type(overlap_t), intent(out) :: overlap
      integer(ip) :: rejected
      logical :: done

      call separated_by(pair, features, done)
      if (done) return
      call certified_lens(pair, measure, features, overlap, done)
      if (done) return
      rejected = max(0_ip, features)
      call find_overlap(pair%p, pair%q, pair%offset, radius_of(pair%p), radius_of(pair%q), measure, overlap, &
                        features, rejected)
      if (features == 0_ip) features = rejected
   end subroutine overlap_with_memory

   !> Test whether a remembered edge separates a pair
   subroutine separated_by(pair, features, apart)
      !> The pair, P first
      type(pair_t), intent(in) :: pair
      !> Any integer; the corner is brought up to date
      integer(ip), intent(inout) :: features
      !> Whether an edge is remembered, and the polygons are apart
      logical, intent(out) :: apart
      type(overlap_batch_t) :: batch
      logical :: lane_apart(lanes)
      integer(ip) :: n, m

      apart = .false.
      if (features >= 0_ip) return
      n = size(pair%p, 2, kind=ip)
      m = size(pair%q, 2, kind=ip)
      call add_lane(batch, 1_ip, features, [1_ip, n, n + 1_ip, n + m], pair%offset, radius_of(pair%p), &
                    radius_of(pair%q))
      call test_edges(batch, 1_ip, n + m, vertices_of(pair), isa_base, lane_apart)
      apart = lane_apart(1)
      features = batch%features(1)
   end subroutine separated_by

   !> Vertices of both polygons of a pair
   function vertices_of(pair) result(vertices)
      type(pair_t), intent(in) :: pair
      real(wp) :: vertices(2, size(pair%p, 2) + size(pair%q, 2))

      vertices(:, :size(pair%p, 2)) = pair%p
      vertices(:, size(pair%p, 2) + 1:) = pair%q
   end function vertices_of

   !> Overlap of a pair if a remembered lens is certified
   subroutine certified_lens(pair, measure, features, overlap, certified)
      !> The pair, P first
      type(pair_t), intent(in) :: pair
      !> How the overlap is measured
      type(overlap_measure_t), intent(in) :: measure
      !> Any integer
      integer(ip), intent(in) :: features
      !> The overlap; zero if it is not certified
      type(overlap_t), intent(out) :: overlap
      !> Whether it is certified
      logical, intent(out) :: certified
      type(overlap_batch_t) :: batch
      type(overlap_columns_t) :: columns
      integer(ip) :: n, m

      n = size(pair%p, 2, kind=ip)
      m = size(pair%q, 2, kind=ip)
      call add_lane(batch, 1_ip, features, [1_ip, n, n + 1_ip, n + m], pair%offset, radius_of(pair%p), &
                    radius_of(pair%q))
      call evaluate_batch(batch, 1_ip, vertices_of(pair), measure, columns)
      certified = batch%certified(1) > 0.0_wp
      if (.not. certified) return
      overlap%area = columns%area(1)
      overlap%centroid = columns%arm_first(1, :)
      overlap%centroid_b = columns%arm_second(1, :)
      overlap%normal = columns%normal(1, :)
      overlap%moment_a = columns%moment(1, 1)
      overlap%moment_b = columns%moment(1, 2)
      overlap%length_square = columns%length_square(1)
      if (measure%with_area) overlap%of_area = columns%of_area(1, :)
   end subroutine certified_lens

   !> Whether two overlaps are equal
   pure logical function same_bits(first, second)
      !> One overlap
      type(overlap_t), intent(in) :: first
      !> Another one
      type(overlap_t), intent(in) :: second

      same_bits = all(abs(numbers(first) - numbers(second)) <= 0.0_wp)
   end function same_bits

   !> All numbers of an overlap
   pure function numbers(overlap)
      type(overlap_t), intent(in) :: overlap
      real(wp) :: numbers(14)

      numbers = [overlap%area, overlap%centroid, overlap%centroid_b, overlap%normal, overlap%moment_a, &
                 overlap%moment_b, overlap%length_square, overlap%of_area]
   end function numbers

   !> Greatest distance of a vertex from the centre
   pure real(wp) function radius_of(vertices)
      !> Vertices, (2, n)
      real(wp), intent(in) :: vertices(:, :)

      radius_of = sqrt(maxval(vertices(1, :)*vertices(1, :) + vertices(2, :)*vertices(2, :)))
   end function radius_of

   !> The pair with the smaller polygon first
   function ordered(pair) result(roles)
      !> A pair in any order
      type(pair_t), intent(in) :: pair
      type(pair_t) :: roles

      roles = pair
      if (radius_of(pair%p) <= radius_of(pair%q)) return
      roles%p = pair%q
      roles%q = pair%p
      roles%offset = -pair%offset
   end function ordered

   !> A random pair of a kind, smaller polygon first
   function random_pair(random, kind) result(pair)
      !> Source of numbers
      type(random_t), intent(inout) :: random
      !> 1 to 8: grains, grains deep in each other, equal squares, copies, grains at a wall, bars, a grain in a
      !> triangle, corners near an edge
      integer, intent(in) :: kind
      type(pair_t) :: pair
      real(wp) :: angle, distance, arm(2, 1)
      integer(ip) :: n, m

      n = int(random%between(3.0_wp, 12.99_wp), ip)
      m = int(random%between(3.0_wp, 12.99_wp), ip)
      angle = random%between(0.0_wp, two_pi)
      distance = random%between(0.8_wp, 2.0_wp)
      pair%p = irregular(random, n, 1.0_wp)
      pair%q = irregular(random, m, random%between(1.0_wp, 3.0_wp))
      select case (kind)
      case (1)
         distance = distance*0.5_wp*(1.0_wp + radius_of(pair%q))
      case (2)
         distance = 0.5_wp*distance
      case (3)
         pair%p = turned(rectangle(1.0_wp, 1.0_wp), angle)
         pair%q = turned(rectangle(1.0_wp, 1.0_wp), random%between(0.0_wp, two_pi))
         distance = 0.7_wp*distance
      case (4)
         pair%q = pair%p
      case (5)
         pair%q = rectangle(10.0_wp**random%between(1.0_wp, 3.0_wp), 2.0_wp)
      case (6)
         pair%p = turned(rectangle(1.0_wp, 0.05_wp), random%between(0.0_wp, two_pi))
         pair%q = turned(rectangle(2.0_wp, 0.05_wp), random%between(0.0_wp, two_pi))
         distance = 0.4_wp*distance
      case (7)
         pair%p = 0.3_wp*pair%p
         pair%q = regular(3_ip, 1.0_wp, angle)
         distance = 0.4_wp*distance
      case default
         ! A corner of P to within 1e-14 to 0.1 of the first edge of Q
         pair%offset = pair%p(:, 1) - 0.5_wp*(pair%q(:, 1) + pair%q(:, 2)) &
                       + 10.0_wp**random%between(-14.0_wp, -1.0_wp)*pair%q(:, 1)
         pair = ordered(pair)
         return
      end select
      if (kind == 5) then
         pair%offset = [random%between(-0.45_wp, 0.45_wp)*pair%q(1, 2), -1.0_wp - 0.5_wp*distance]
      else
         arm = turned(reshape([distance, 0.0_wp], [2, 1]), random%between(0.0_wp, two_pi))
         pair%offset = arm(:, 1)
      end if
      pair = ordered(pair)
   end function random_pair

   !> Two small polygons with whole coordinates, half of them copies: full of common edges and corners on edges
   function grid_pair(random) result(pair)
      !> Source of numbers
      type(random_t), intent(inout) :: random
      type(pair_t) :: pair

      pair%p = grid_polygon(random)
      pair%q = grid_polygon(random)
      if (random%between(0.0_wp, 1.0_wp) < 0.5_wp) pair%q = pair%p
      pair%offset = [real(nint(random%between(-4.5_wp, 4.5_wp)), wp), real(nint(random%between(-4.5_wp, 4.5_wp)), wp)]
      pair = ordered(pair)
   end function grid_pair

   !> Hull of six points with whole coordinates around the origin
   function grid_polygon(random) result(vertices)
      type(random_t), intent(inout) :: random
      real(wp), allocatable :: vertices(:, :)
      real(wp) :: point(2, 6), hull(2, 7)
      integer :: k, next, n

      do
         do k = 1, 6
            point(1, k) = real(nint(random%between(-3.5_wp, 3.5_wp)), wp)
            point(2, k) = real(nint(random%between(-3.5_wp, 3.5_wp)), wp)
         end do
         hull(:, 1) = point(:, minloc(100.0_wp*point(2, :) + point(1, :), dim=1))
         do n = 1, 6
            next = 0
            do k = 1, 6
               if (all(abs(point(:, k) - hull(:, n)) <= 0.0_wp)) cycle
               if (next == 0) next = k
               if (is_right_of(point(:, k), hull(:, n), point(:, next))) next = k
            end do
            if (next == 0) exit
            hull(:, n + 1) = point(:, next)
            if (all(abs(hull(:, n + 1) - hull(:, 1)) <= 0.0_wp)) exit
         end do
         if (next == 0 .or. n < 3 .or. n > 6) cycle
         vertices = hull(:, :n)
         if (all(vertices(1, :)*hull(2, 2:n + 1) - vertices(2, :)*hull(1, 2:n + 1) > 0.0_wp)) exit
      end do
   end function grid_polygon

   !> Whether a point is right of the line from one point to another, or on it and farther
   pure logical function is_right_of(point, from, to)
      real(wp), intent(in) :: point(2)
      real(wp), intent(in) :: from(2)
      real(wp), intent(in) :: to(2)
      real(wp) :: side

      side = (to(1) - from(1))*(point(2) - from(2)) - (to(2) - from(2))*(point(1) - from(1))
      is_right_of = side < 0.0_wp
      if (.not. abs(side) > 0.0_wp) is_right_of = sum((point - from)**2) > sum((to - from)**2)
   end function is_right_of

   !> Any integer
   integer(ip) function any_integer(random)
      !> Source of numbers
      type(random_t), intent(inout) :: random

      any_integer = int(floor(random%between(-2147483648.0_wp, 2147483647.0_wp), lp), ip)
   end function any_integer

end module remembered_overlap
