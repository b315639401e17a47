!> Boxes that can leave their leaf in an interval of the filter.
!>
!> A box on its lines (`polydem_inner_list`) is inside straight tubes. If they keep its centre in its leaf, and its
!> sides below the largest one for which its reach is sufficient, until the end of the interval, the box need not be
!> tested as long as it is on its lines. All others are *watched*: a step tests only these. A box is judged when an
!> interval begins, when it gets new lines or is marked as off, and when its leaf changes. Boxes that are off are always
!> watched.
!>
!> A tube bounds each side within its half width, so it bounds the sum of two opposite sides, twice the centre, and
!> their difference, the length of a side, within twice the half width. The path is straight: its ends bound it. The
!> slack of the tree covers the rounding errors of coordinates in finest cells.
module polydem_leaf_exits
   use polydem_index_list, only: index_list_t
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_inner_list, only: inner_list_t
   use polydem_quadtree_nodes, only: tree_t
   use polydem_thread_changes, only: part
   implicit none
   private
   public :: leaf_exits_t

   !> Watched boxes of one part
   type :: watched_part_t
      !> Number of boxes
      integer(ip) :: n = 0_ip
      !> The boxes, (watched box)
      integer(ip), allocatable :: box(:)
      !> Bounds of the leaf [finest cells], and largest side [m], of each, (5, watched box). Copies are read in order
      real(dp), allocatable :: leaf(:, :)
   end type watched_part_t

   !> Watched boxes, in parts for several threads
   type :: leaf_exits_t
      private
      !> Parts of equal numbers of boxes, (part)
      type(watched_part_t), allocatable :: watched(:)
      !> Place of each box in its part, 0 if it is not watched, (box)
      integer(ip), allocatable :: place(:)
   contains
      procedure :: set_parts
      procedure :: judge_part
      procedure :: judge
      procedure :: find_outside
      procedure :: bytes
   end type leaf_exits_t

contains

   !> Set the number of parts. If it changes, all boxes must be judged.
   pure subroutine set_parts(self, n_parts, n_boxes, changed)
      class(leaf_exits_t), intent(inout) :: self
      !> Number of parts
      integer, intent(in) :: n_parts
      !> Number of boxes
      integer(ip), intent(in) :: n_boxes
      !> Whether it changes
      logical, intent(out) :: changed
      integer(ip) :: low, high
      integer :: w

      changed = .true.
      if (allocated(self%watched)) then
         changed = size(self%watched) /= n_parts
         if (.not. changed) return
         deallocate (self%watched, self%place)
      end if
      allocate (self%watched(n_parts))
      allocate (self%place(n_boxes), source=0_ip)
      do w = 1, n_parts
         call part(n_boxes, n_parts, w, low, high)
         allocate (self%watched(w)%box(high - low + 1_ip), self%watched(w)%leaf(5, high - low + 1_ip))
      end do
   end subroutine set_parts

   !> Judge all boxes of a part at the start of an interval.
   pure subroutine judge_part(self, w, filter, tree, greatest_side)
      class(leaf_exits_t), intent(inout) :: self
      !> Number of the part
      integer, intent(in) :: w
      !> Lines of the boxes
      class(inner_list_t), intent(in) :: filter
      !> Tree with the leaves
      type(tree_t), intent(in) :: tree
      !> Largest side of each box for which its reach is sufficient, (box) [m]
      real(wp), intent(in), contiguous :: greatest_side(:)
      integer(ip) :: low, high, i

      call part(size(self%place, kind=ip), size(self%watched), w, low, high)
      self%watched(w)%n = 0_ip
      self%place(low:high) = 0_ip
      do i = low, high
         if (stays(filter, tree, greatest_side, i)) cycle
         call watch(self%watched(w), i, self%place(i), tree, greatest_side)
      end do
   end subroutine judge_part

   !> Judge a box that has new lines or a new leaf.
   pure subroutine judge(self, i, filter, tree, greatest_side)
      class(leaf_exits_t), intent(inout) :: self
      !> Box
      integer(ip), intent(in) :: i
      !> Lines of the boxes
      class(inner_list_t), intent(in) :: filter
      !> Tree with the leaves
      type(tree_t), intent(in) :: tree
      !> Largest side of each box for which its reach is sufficient, (box) [m]
      real(wp), intent(in), contiguous :: greatest_side(:)
      integer :: w

      if (self%place(i) == 0_ip) then
         if (stays(filter, tree, greatest_side, i)) return
      end if
      w = int((int(i, lp)*size(self%watched, kind=lp) - 1_lp)/size(self%place, kind=lp)) + 1
      call watch(self%watched(w), i, self%place(i), tree, greatest_side)
   end subroutine judge

   !> Add a box to a list, or renew the copy of its leaf.
   pure subroutine watch(watched, i, place, tree, greatest_side)
      type(watched_part_t), intent(inout) :: watched
      integer(ip), intent(in) :: i
      !> Place of the box in the list; 0 before it is added
      integer(ip), intent(inout) :: place
      type(tree_t), intent(in) :: tree
      real(wp), intent(in), contiguous :: greatest_side(:)

      if (place == 0_ip) then
         watched%n = watched%n + 1_ip
         watched%box(watched%n) = i
         place = watched%n
      end if
      watched%leaf(1:4, place) = tree%cell(:, i)
      watched%leaf(5, place) = real(greatest_side(i), dp)
   end subroutine watch

   !> List the watched boxes of a part whose centre is not in its leaf or whose side exceeds the largest one.
   pure subroutine find_outside(self, w, tree, bounds, outside)
      class(leaf_exits_t), intent(in) :: self
      !> Number of the part
      integer, intent(in) :: w
      !> Tree with the leaves
      type(tree_t), intent(in) :: tree
      !> Bounds of the boxes, (4, box) [m]
      real(wp), intent(in), contiguous :: bounds(:, :)
      !> List of the boxes
      type(index_list_t), intent(inout) :: outside
      real(dp) :: x, y, inside, below, side
      integer(ip) :: k, i, n

      n = 0_ip
      associate (watched => self%watched(w))
         call outside%reserve(watched%n + 1_ip)
         do k = 1_ip, watched%n
            i = watched%box(k)
            x = (real(bounds(1, i), dp) + real(bounds(3, i), dp))*tree%half_scale + tree%shift(1)
            y = (real(bounds(2, i), dp) + real(bounds(4, i), dp))*tree%half_scale + tree%shift(2)
            outside%at(n + 1_ip) = i
            ! Differences of numbers have the sign of their comparison. There is no NaN: poses are tested before.
            inside = min(x - watched%leaf(1, k), y - watched%leaf(2, k))
            below = min(watched%leaf(3, k) - x, watched%leaf(4, k) - y)
            side = real(max(bounds(3, i) - bounds(1, i), bounds(4, i) - bounds(2, i)), dp)
            n = n + merge(0_ip, 1_ip, inside >= 0.0_dp .and. below > 0.0_dp .and. side <= watched%leaf(5, k))
         end do
      end associate
      outside%n = n
   end subroutine find_outside

   !> Allocated memory [B]
   pure integer(lp) function bytes(self)
      class(leaf_exits_t), intent(in) :: self

      bytes = 0_lp
      if (allocated(self%place)) bytes = size(self%place, kind=lp)* &
         int((2*storage_size(self%place) + 5*storage_size(1.0_dp))/8, lp)
   end function bytes

   !> Whether a box surely stays in its leaf, and its sides small enough, from this step to the end of the interval
   !> while it is on its lines
   pure logical function stays(filter, tree, greatest_side, i)
      class(inner_list_t), intent(in) :: filter
      type(tree_t), intent(in) :: tree
      real(wp), intent(in), contiguous :: greatest_side(:)
      integer(ip), intent(in) :: i
      real(wp) :: now(4), end(4), widths(2), side
      real(dp) :: from, to, margin
      integer :: a

      stays = .false.
      if (filter%is_off(i)) return
      widths = filter%tube()
      now = real(filter%place(:, i), wp) + real(filter%speed(:, i), wp)*real(filter%step, wp)
      end = real(filter%place(:, i), wp) + real(filter%speed(:, i), wp)*real(filter%length, wp)
      side = 0.0_wp
      stays = .true.
      margin = 2.0_dp*real(widths(1), dp)*tree%half_scale + tree%slack
      do a = 1, 2
         from = (real(now(a), dp) + real(now(a + 2), dp))
         to = (real(end(a), dp) + real(end(a + 2), dp))
         from = (from + 2.0_dp*real(filter%origin(a), dp))*tree%half_scale + tree%shift(a)
         to = (to + 2.0_dp*real(filter%origin(a), dp))*tree%half_scale + tree%shift(a)
         stays = stays .and. min(from, to) - margin >= tree%cell(a, i) .and. &
            max(from, to) + margin < tree%cell(a + 2, i)
         side = max(side, max(now(a + 2) - now(a), end(a + 2) - end(a)))
      end do
      stays = stays .and. side + 2.0_wp*widths(1) <= greatest_side(i)
   end function stays

end module polydem_leaf_exits
