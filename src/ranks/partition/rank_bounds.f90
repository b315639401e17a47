!> Bounds of all ranks: bounding rectangles of the bodies of each rank, known on all ranks.
!>
!> Contract. Each rank publishes rectangles that cover the boxes of its bodies. A rank needs a body if the box of the
!> body overlaps one of its rectangles (touching counts). If the boxes of two bodies overlap, the owner of each
!> therefore needs the other. Rectangles follow the bodies and are independent of the partition of space: bodies may
!> leave the region of their rank, and large bodies may extend beyond it.
!>
!> In a periodic cell a rectangle stands for all its copies, and so does a box. Each copy of a rank, also of this rank
!> itself, bounds the zone as another rank would.
module polydem_rank_bounds
   use polydem_bounding_rectangles, only: bounds_of, cover
   use polydem_communicator, only: communicator_t
   use polydem_kinds, only: dp, ip, wp
   implicit none
   private
   public :: rank_bounds_t

   !> Number of cells of the map along each axis
   integer, parameter :: n_cells = 32

   !> Bounding rectangles of all other ranks, with a map of the bounds of this rank
   type :: rank_bounds_t
      private
      !> xmin, ymin, xmax, ymax of the rectangles of the other ranks, (4, rectangle) [m]
      real(wp), allocatable :: rectangle(:, :)
      !> Rank of each rectangle, ascending, (rectangle)
      integer(ip), allocatable :: owner(:)
      !> Number of the copy of each rectangle, ascending for each rank; 0 for all in the plane, (rectangle)
      integer, allocatable :: copy(:)
      !> Bounds of the copies of the boxes of this rank, (4, copy) [m]
      real(wp), allocatable :: own_copies(:, :)
      !> Indices of the rectangles that overlap `own`
      integer(ip), allocatable :: near(:)
      !> Number of rectangles of all ranks
      integer(ip) :: n_published = 0_ip
      !> Bounding rectangle of all boxes of this rank [m]
      real(wp) :: own(4) = 0.0_wp
      !> A part of `own` without a point in common with the bounding rectangle of all boxes of any other rank; empty if
      !> xmin > xmax. The zones of two ranks are disjoint, and so are the zone of a rank and the boxes of another. A
      !> body of this rank may therefore move anywhere before the next call of `publish` while its box is in the zone
      !> [m]
      real(wp), public :: zone(4) = [1.0_wp, 1.0_wp, -1.0_wp, -1.0_wp]
      !> Map of `own`: whether a rectangle of another rank overlaps each cell
      logical :: shared(n_cells, n_cells) = .false.
   contains
      procedure :: publish
      procedure :: needed_by
      procedure :: n_rectangles
   end type rank_bounds_t

contains

   !> Exchange the bounding rectangles of all ranks. Collective.
   subroutine publish(self, comm, boxes, period, is_sheared)
      class(rank_bounds_t), intent(inout) :: self
      class(communicator_t), intent(inout) :: comm
      !> xmin, ymin, xmax, ymax of the padded boxes of the bodies that this rank owns; the padding is the distance that
      !> they may move before the next call, (4, body) [m]
      real(wp), intent(in) :: boxes(:, :)
      !> Width and height of the periodic cell, 0 along an axis that is not periodic; absent: the plane [m]
      real(wp), intent(in), optional :: period(2)
      !> Whether copies of the cell above and below slide along x: they are then anywhere along x; default: no
      logical, intent(in), optional :: is_sheared
      real(wp), allocatable :: mine(:, :), shift(:, :)
      real(dp), allocatable :: all_bounds(:)
      integer(ip), allocatable :: counts(:)
      integer(ip) :: rank, k, r, n
      integer :: c
      logical :: slides

      slides = .false.
      if (present(is_sheared)) slides = is_sheared
      allocate (shift(2, 0))
      if (present(period)) call list_shifts(period, shift)
      call cover(boxes, mine)
      call comm%gather(rounded_outwards(mine), all_bounds, counts)
      counts = counts/4_ip
      self%n_published = sum(counts)
      n = (self%n_published - counts(comm%rank))*(1_ip + size(shift, 2, kind=ip))
      if (allocated(self%owner)) deallocate (self%owner, self%copy, self%near, self%rectangle, self%own_copies)
      allocate (self%owner(n), self%copy(n), self%rectangle(4, n), self%own_copies(4, size(shift, 2)))
      n = 0_ip
      k = 0_ip
      do rank = 0_ip, comm%size - 1_ip
         do c = 0, merge(-1, size(shift, 2), rank == comm%rank)
            do r = 1_ip, counts(rank)
               n = n + 1_ip
               self%owner(n) = rank
               self%copy(n) = c
               self%rectangle(:, n) = real(all_bounds(4_ip*(k + r) - 3_ip:4_ip*(k + r)), wp)
               if (c > 0) self%rectangle(:, n) = moved(self%rectangle(:, n), shift(:, c), slides)
            end do
         end do
         k = k + counts(rank)
      end do
      self%own = bounds_of(boxes)
      do c = 1, size(shift, 2)
         self%own_copies(:, c) = moved(self%own, shift(:, c), slides)
      end do
      call build_map(self)
      self%zone = zone_of(self)
   end subroutine publish

   !> List the vectors to the copies of a periodic cell around it.
   pure subroutine list_shifts(period, shift)
      !> Width and height of the cell, 0 along an axis that is not periodic [m]
      real(wp), intent(in) :: period(2)
      !> The vectors, (2, copy) [m]
      real(wp), allocatable, intent(out) :: shift(:, :)
      integer :: i, j, n, most(2)

      most = merge(1, 0, period > 0.0_wp)
      allocate (shift(2, product(2*most + 1) - 1))
      n = 0
      do j = -most(2), most(2)
         do i = -most(1), most(1)
            if (i == 0 .and. j == 0) cycle
            n = n + 1
            shift(:, n) = real([i, j], wp)*period
         end do
      end do
   end subroutine list_shifts

   !> A rectangle that covers another one after a shift, in spite of rounding [m]
   pure function moved(rectangle, shift, slides)
      real(wp), intent(in) :: rectangle(4), shift(2)
      !> Whether copies above and below are anywhere along x
      logical, intent(in) :: slides
      real(wp) :: moved(4), extra(2)

      extra = 8.0_wp*epsilon(1.0_wp)*(max(abs(rectangle(1:2)), abs(rectangle(3:4))) + abs(shift))
      moved = rectangle + [shift - extra, shift + extra]
      if (slides .and. abs(shift(2)) > 0.0_wp) moved([1, 3]) = 0.125_wp*huge(1.0_wp)*[-1.0_wp, 1.0_wp]
   end function moved

   !> Cut the bounding rectangle of this rank at those of the other ranks and at all copies. Each of the four parts at a
   !> rectangle would do; the largest one is kept.
   pure function zone_of(self) result(zone)
      type(rank_bounds_t), intent(in) :: self
      real(wp) :: zone(4)
      integer(ip) :: first, last
      integer :: c

      zone = self%own
      do c = 1, size(self%own_copies, 2)
         call cut_zone(self%own_copies(:, c), zone)
      end do
      first = 1_ip
      do while (first <= size(self%owner, kind=ip))
         last = first
         do while (last < size(self%owner, kind=ip))
            if (self%owner(last + 1_ip) /= self%owner(first) .or. self%copy(last + 1_ip) /= self%copy(first)) exit
            last = last + 1_ip
         end do
         call cut_zone(bounds_of(self%rectangle(:, first:last)), zone)
         first = last + 1_ip
      end do
   end function zone_of

   !> Cut a zone at a rectangle.
   pure subroutine cut_zone(other, zone)
      !> The rectangle [m]
      real(wp), intent(in) :: other(4)
      !> The zone; afterwards its largest part without a point in common with the rectangle [m]
      real(wp), intent(inout) :: zone(4)
      real(wp) :: parts(4, 4)

      if (.not. boxes_overlap(zone, other)) return
      parts = spread(zone, 2, 4)
      parts(3, 1) = nearest(other(1), -1.0_wp)
      parts(4, 2) = nearest(other(2), -1.0_wp)
      parts(1, 3) = nearest(other(3), 1.0_wp)
      parts(2, 4) = nearest(other(4), 1.0_wp)
      zone = parts(:, maxloc(max(0.0_wp, parts(3, :) - parts(1, :))*max(0.0_wp, parts(4, :) - parts(2, :)), 1))
   end subroutine cut_zone

   !> Number of rectangles of all ranks in the last call of `publish`
   pure integer(ip) function n_rectangles(self)
      class(rank_bounds_t), intent(in) :: self

      n_rectangles = self%n_published
   end function n_rectangles

   !> List the rectangles near this rank, and mark the cells of the map that they overlap.
   pure subroutine build_map(self)
      class(rank_bounds_t), intent(inout) :: self
      integer :: low(2), high(2)
      integer(ip) :: r

      self%near = pack([(r, r=1_ip, size(self%owner, kind=ip))], [(boxes_overlap(self%rectangle(:, r), self%own), &
                                                                  r=1_ip, size(self%owner, kind=ip))])
      self%shared = .false.
      do r = 1_ip, size(self%near, kind=ip)
         call find_cells(self, self%rectangle(:, self%near(r)), low, high)
         self%shared(low(1):high(1), low(2):high(2)) = .true.
      end do
   end subroutine build_map

   !> List the other ranks that need a body.
   pure subroutine needed_by(self, box, ranks, n)
      class(rank_bounds_t), intent(in) :: self
      !> xmin, ymin, xmax, ymax of its box, padded as in `publish` [m]
      real(wp), intent(in) :: box(4)
      !> Ranks, ascending; the array must have room for all other ranks
      integer(ip), intent(inout) :: ranks(:)
      !> Number of these ranks
      integer(ip), intent(out) :: n
      integer :: low(2), high(2)
      integer(ip) :: k

      n = 0_ip
      if (all(box(1:2) >= self%own(1:2)) .and. all(box(3:4) <= self%own(3:4))) then
         call find_cells(self, box, low, high)
         if (.not. any(self%shared(low(1):high(1), low(2):high(2)))) return
         do k = 1_ip, size(self%near, kind=ip)
            if (.not. boxes_overlap(self%rectangle(:, self%near(k)), box)) cycle
            call append_once(self%owner(self%near(k)), ranks, n)
         end do
      else
         do k = 1_ip, size(self%owner, kind=ip)
            if (boxes_overlap(self%rectangle(:, k), box)) call append_once(self%owner(k), ranks, n)
         end do
      end if
   end subroutine needed_by

   !> Append a rank to an ascending list unless it is the last entry.
   pure subroutine append_once(rank, ranks, n)
      integer(ip), intent(in) :: rank
      integer(ip), intent(inout) :: ranks(:), n

      if (n > 0_ip) then
         if (ranks(n) == rank) return
      end if
      n = n + 1_ip
      ranks(n) = rank
   end subroutine append_once

   !> Cells of the map that a box overlaps. The cell is a monotonic function of the coordinate: boxes that overlap share
   !> a cell.
   pure subroutine find_cells(self, box, low, high)
      class(rank_bounds_t), intent(in) :: self
      real(wp), intent(in) :: box(4)
      !> First and last cell along both axes
      integer, intent(out) :: low(2), high(2)
      real(wp) :: side
      integer :: axis

      do axis = 1, 2
         side = self%own(axis + 2) - self%own(axis)
         low(axis) = 1
         high(axis) = n_cells
         if (.not. side > 0.0_wp) cycle
         low(axis) = cell_at((box(axis) - self%own(axis))/side)
         high(axis) = cell_at((box(axis + 2) - self%own(axis))/side)
      end do
   end subroutine find_cells

   !> Cell at a fraction of a side
   pure integer function cell_at(share)
      real(wp), intent(in) :: share

      cell_at = min(1 + int(min(max(share, 0.0_wp), 1.0_wp)*real(n_cells, wp)), n_cells)
   end function cell_at

   !> Whether two boxes share a point
   pure logical function boxes_overlap(a, b)
      real(wp), intent(in) :: a(4), b(4)

      boxes_overlap = a(1) <= b(3) .and. b(1) <= a(3) .and. a(2) <= b(4) .and. b(2) <= a(4)
   end function boxes_overlap

   !> Rectangles in double precision, rounded outwards, one after the other
   pure function rounded_outwards(rectangles) result(bounds)
      real(wp), intent(in) :: rectangles(:, :)
      real(dp) :: bounds(size(rectangles))
      integer :: k, r

      do r = 1, size(rectangles, 2)
         do k = 1, 4
            associate (rounded => bounds(4*(r - 1) + k))
               rounded = real(rectangles(k, r), dp)
               if (k <= 2 .and. real(rounded, wp) > rectangles(k, r)) rounded = nearest(rounded, -1.0_dp)
               if (k > 2 .and. real(rounded, wp) < rectangles(k, r)) rounded = nearest(rounded, 1.0_dp)
            end associate
         end do
      end do
   end function rounded_outwards

end module polydem_rank_bounds
