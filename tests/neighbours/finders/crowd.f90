!> Moving boxes for tests of neighbour finders, and the pairs that a direct search finds.
module crowd
   use omp_lib, only: omp_set_num_threads
   use polydem_boxes, only: boxes_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, wp
   use polydem_namelist_entries, only: choices_of
   use polydem_neighbours, only: neighbours_t
   use polydem_new_neighbours, only: new_neighbours
   use polydem_random, only: random_t, new_random
   implicit none
   private
   public :: new_boxes, scatter, wrong_steps, count_wrong, direct_pairs, grow_reach

contains

   !> Boxes with given bounds, one per piece and body, all free.
   subroutine new_boxes(boxes, bounds)
      type(boxes_t), intent(out) :: boxes
      real(wp), intent(in) :: bounds(:, :)
      integer(ip) :: k

      boxes%n = size(bounds, 2, kind=ip)
      boxes%n_pieces = boxes%n
      boxes%bounds = bounds
      boxes%piece = [(k, k=1_ip, boxes%n)]
      boxes%body = boxes%piece
      allocate (boxes%fixed(boxes%n), boxes%passive(boxes%n), source=.false.)
      boxes%reach = 0.5_wp*max(bounds(3, :) - bounds(1, :), bounds(4, :) - bounds(2, :))
   end subroutine new_boxes

   !> Set reaches of the boxes that are sufficient for all frames.
   subroutine grow_reach(boxes, frames)
      type(boxes_t), intent(inout) :: boxes
      real(wp), intent(in) :: frames(:, :, :)
      integer :: s

      do s = 1, size(frames, 3)
         boxes%reach = max(boxes%reach, 0.5_wp*max(frames(3, :, s) - frames(1, :, s), &
                                                  frames(4, :, s) - frames(2, :, s)))
      end do
   end subroutine grow_reach

   !> Boxes at random positions in a square, with sides between two values.
   subroutine scatter(seed, n, width, side_min, side_max, bounds)
      integer(ip), intent(in) :: seed, n
      real(wp), intent(in) :: width, side_min, side_max
      real(wp), allocatable, intent(out) :: bounds(:, :)
      type(random_t) :: random
      integer(ip) :: k

      allocate (bounds(4, n))
      random = new_random(seed)
      do k = 1_ip, n
         bounds(1, k) = random%between(0.0_wp, width)
         bounds(2, k) = random%between(0.0_wp, width)
         bounds(3, k) = bounds(1, k) + random%between(side_min, side_max)
         bounds(4, k) = bounds(2, k) + random%between(side_min, side_max)
      end do
   end subroutine scatter

   !> Overlapping pairs of pieces of different bodies in ascending order, as keys first*(pieces + 1) + second.
   subroutine direct_pairs(boxes, keys)
      type(boxes_t), intent(in) :: boxes
      integer(ip), allocatable, intent(out) :: keys(:)
      logical, allocatable :: touch(:, :)
      integer(ip) :: i, j, a, b, n

      allocate (touch(boxes%n_pieces, boxes%n_pieces), source=.false.)
      do j = 1_ip, boxes%n
         do i = 1_ip, boxes%n
            a = boxes%piece(i)
            b = boxes%piece(j)
            if (a >= b .or. boxes%body(i) == boxes%body(j)) cycle
            if (boxes%passive(i) .and. boxes%passive(j)) cycle
            if (boxes%bounds(1, i) > boxes%bounds(3, j) .or. boxes%bounds(1, j) > boxes%bounds(3, i)) cycle
            if (boxes%bounds(2, i) > boxes%bounds(4, j) .or. boxes%bounds(2, j) > boxes%bounds(4, i)) cycle
            touch(b, a) = .true.
         end do
      end do
      n = count(touch, kind=ip)
      allocate (keys(n))
      n = 0_ip
      do a = 1_ip, boxes%n_pieces
         do b = a + 1_ip, boxes%n_pieces
            if (.not. touch(b, a)) cycle
            n = n + 1_ip
            keys(n) = a*(boxes%n_pieces + 1_ip) + b
         end do
      end do
   end subroutine direct_pairs

   !> Number of steps of all finders in which the list of pairs or values carried with the pairs are wrong.
   integer(ip) function wrong_steps(boxes, frames)
      type(boxes_t), intent(in) :: boxes
      !> Bounds, (4, box, step)
      real(wp), intent(in) :: frames(:, :, :)
      character(len=300), allocatable :: finders(:)
      integer :: f

      wrong_steps = 0_ip
      finders = choices_of('neighbours', 'finder')
      do f = 1, size(finders)
         wrong_steps = wrong_steps + count_wrong(trim(finders(f)), boxes, frames)
      end do
   end function wrong_steps

   !> Number of steps of one finder in which the list of pairs or values carried with the pairs are wrong.
   integer(ip) function count_wrong(finder, boxes, frames, threads)
      character(len=*), intent(in) :: finder
      type(boxes_t), intent(in) :: boxes
      real(wp), intent(in) :: frames(:, :, :)
      !> Numbers of threads of successive steps, in turn
      integer, intent(in), optional :: threads(:)
      type(boxes_t) :: now
      type(neighbours_t) :: neighbours
      type(error_t), allocatable :: error
      integer(ip), allocatable :: expected(:), before(:), rider(:)
      integer(ip) :: s

      now = boxes
      allocate (before(0), rider(0))
      call new_neighbours(neighbours, finder, now, error)
      count_wrong = merge(1_ip, 0_ip, allocated(error))
      do s = 1_ip, size(frames, 3, kind=ip)
         now%bounds = frames(:, :, s)
         if (present(threads)) call omp_set_num_threads(threads(1 + modulo(int(s), size(threads))))
         call neighbours%update(now)
         call direct_pairs(now, expected)
         if (.not. as_expected(neighbours, now%n_pieces, expected, before, rider)) &
            count_wrong = count_wrong + 1_ip
         before = expected
      end do
   end function count_wrong

   !> Whether the list and its changes are as expected, and carried values stayed with their pairs.
   logical function as_expected(neighbours, n_pieces, expected, before, rider)
      type(neighbours_t), intent(in) :: neighbours
      integer(ip), intent(in) :: n_pieces
      integer(ip), intent(in) :: expected(:), before(:)
      !> Value carried with each pair: the key of the pair, set when the pair began
      integer(ip), allocatable, intent(inout) :: rider(:)
      integer(ip), allocatable :: keys(:)
      integer(ip) :: n, k

      associate (pairs => neighbours%pairs)
         n = pairs%n
         keys = pairs%first(1:n)*(n_pieces + 1_ip) + pairs%second(1:n)
         as_expected = size(expected) == n .and. pairs%contradictions == 0
         if (as_expected) as_expected = all(keys == expected)
         as_expected = as_expected .and. size(before) + pairs%n_began - pairs%n_ended == n
         if (.not. as_expected) return
         do k = 1_ip, pairs%n_ended
            as_expected = as_expected .and. .not. any(expected == before(pairs%ended(k)))
         end do
         do k = 1_ip, pairs%n_began
            as_expected = as_expected .and. .not. any(before == expected(pairs%began(k)))
         end do
         call pairs%carry(rider, -1_ip)
         do k = 1_ip, pairs%n_began
            as_expected = as_expected .and. rider(pairs%began(k)) == -1_ip
            rider(pairs%began(k)) = keys(pairs%began(k))
         end do
         as_expected = as_expected .and. all(rider(1:n) == keys)
      end associate
   end function as_expected

end module crowd
