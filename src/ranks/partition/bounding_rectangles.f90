!> A few bounding rectangles that cover many boxes with little empty area.
!>
!> First, boxes much larger than the typical one form a group of their own; otherwise they would enlarge the rectangle
!> of all others. Then the group with the greatest saving of area is split in two by the centres of its boxes. This is
!> repeated until the number of rectangles reaches its limit, or until the best split saves little compared with the
!> area of a strip around all boxes, which the halo covers in any case. Candidates for splits are the borders of a few
!> equal bins along both axes (I. Wald, IEEE Symposium on Interactive Ray Tracing (2007) 33, for the construction of
!> bounding volume hierarchies).
module polydem_bounding_rectangles
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: cover, bounds_of, most_rectangles

   !> Greatest number of rectangles
   integer(ip), parameter :: most_rectangles = 16_ip
   !> Number of bins along an axis
   integer, parameter :: n_bins = 16
   !> A box is large if its size is at least this many binary orders of magnitude above the mean order
   integer, parameter :: large = 3
   !> Least area that a split must save, over the area of a strip of boxes around the rectangle of all boxes
   real(wp), parameter :: least_gain = 0.1_wp

   !> Neutral element of `joined`; its side lengths do not overflow
   real(wp), parameter :: no_bounds(4) = 0.25_wp*huge(1.0_wp)*[1.0_wp, 1.0_wp, -1.0_wp, -1.0_wp]

   !> Boxes that one rectangle covers, and their best split
   type :: group_t
      !> Index of its first box in the list
      integer(ip) :: first = 1_ip
      !> Index of its last box in the list
      integer(ip) :: last = 0_ip
      !> The rectangle: xmin, ymin, xmax, ymax [m]
      real(wp) :: bounds(4) = 0.0_wp
      !> Area that the best split saves [m^2]
      real(wp) :: gain = 0.0_wp
      !> Axis of that split
      integer :: axis = 1
      !> Last bin below that split
      integer :: bin = 0
      !> Least coordinate of a centre along that axis, times two [m]
      real(wp) :: low = 0.0_wp
      !> Greatest coordinate of a centre along that axis, times two [m]
      real(wp) :: high = 0.0_wp
   end type group_t

contains

   !> Cover boxes by a few rectangles.
   pure subroutine cover(boxes, rectangles)
      !> xmin, ymin, xmax, ymax of each box, (4, box) [m]
      real(wp), intent(in) :: boxes(:, :)
      !> xmin, ymin, xmax, ymax of each rectangle, (4, rectangle) [m]; every box lies in one of them. Their number is at
      !> most `most_rectangles`, and 0 without boxes
      real(wp), allocatable, intent(out) :: rectangles(:, :)
      type(group_t) :: groups(most_rectangles)
      integer(ip), allocatable :: list(:)
      real(wp) :: wanted
      integer(ip) :: n, k

      allocate (list(size(boxes, 2)))
      list = [(k, k=1_ip, size(boxes, 2, kind=ip))]
      n = 0_ip
      if (size(list) > 0) then
         wanted = least_gain*strip_area(boxes)
         call separate_large(boxes, list, groups, n)
         do k = 1_ip, n
            call measure(boxes, list, groups(k))
         end do
         do while (n < most_rectangles)
            k = maxloc(groups(1:n)%gain, 1, kind=ip)
            if (.not. groups(k)%gain > wanted) exit
            n = n + 1_ip
            call split(boxes, list, groups(k), groups(n))
            call measure(boxes, list, groups(k))
            call measure(boxes, list, groups(n))
         end do
      end if
      allocate (rectangles(4, n))
      do k = 1_ip, n
         rectangles(:, k) = groups(k)%bounds
      end do
   end subroutine cover

   !> Bounding rectangle of all boxes; without boxes xmin > xmax and ymin > ymax
   pure function bounds_of(boxes) result(bounds)
      !> xmin, ymin, xmax, ymax of each box, (4, box) [m]
      real(wp), intent(in) :: boxes(:, :)
      !> xmin, ymin, xmax, ymax of all boxes, (4) [m]
      real(wp) :: bounds(4)
      integer :: k

      bounds = no_bounds
      do k = 1, size(boxes, 2)
         bounds = joined(bounds, boxes(:, k))
      end do
   end function bounds_of

   !> Area of a strip around the rectangle of all boxes; its width is the mean size of a box
   pure real(wp) function strip_area(boxes)
      real(wp), intent(in) :: boxes(:, :)
      real(wp) :: bounds(4), sides
      integer :: k

      bounds = bounds_of(boxes)
      sides = 0.0_wp
      do k = 1, size(boxes, 2)
         sides = sides + (boxes(3, k) - boxes(1, k)) + (boxes(4, k) - boxes(2, k))
      end do
      strip_area = sum(bounds(3:4) - bounds(1:2))*sides/real(size(boxes, 2), wp)
   end function strip_area

   !> Form a group of the boxes of common size and, if there are large boxes, a group of these.
   pure subroutine separate_large(boxes, list, groups, n)
      real(wp), intent(in) :: boxes(:, :)
      integer(ip), intent(inout) :: list(:)
      type(group_t), intent(inout) :: groups(:)
      integer(ip), intent(out) :: n
      integer, allocatable :: order(:)
      integer :: k

      allocate (order(size(list)))
      do k = 1, size(list)
         order(k) = exponent(max(boxes(3, k) - boxes(1, k), boxes(4, k) - boxes(2, k)))
      end do
      groups(1)%first = 1_ip
      groups(1)%last = size(list, kind=ip)
      call divide_group(list, order < sum(order)/size(order) + large, groups(1), groups(2))
      n = merge(2_ip, 1_ip, groups(2)%first <= groups(2)%last)
   end subroutine separate_large

   !> Divide a group: some boxes stay, the others form a new group.
   pure subroutine divide_group(list, stays, group, new)
      integer(ip), intent(inout) :: list(:)
      !> Whether each box of the group stays, in the order of the list
      logical, intent(in) :: stays(:)
      type(group_t), intent(inout) :: group, new

      associate (part => list(group%first:group%last))
         part = [pack(part, stays), pack(part,.not. stays)]
      end associate
      new%last = group%last
      group%last = group%first + count(stays, kind=ip) - 1_ip
      new%first = group%last + 1_ip
   end subroutine divide_group

   !> Split a group at its best split.
   pure subroutine split(boxes, list, group, new)
      real(wp), intent(in) :: boxes(:, :)
      integer(ip), intent(inout) :: list(:)
      type(group_t), intent(inout) :: group, new
      logical, allocatable :: stays(:)
      integer(ip) :: k

      allocate (stays(group%first:group%last))
      do k = group%first, group%last
         stays(k) = bin_of(boxes(:, list(k)), group%axis, group%low, group%high) <= group%bin
      end do
      call divide_group(list, stays, group, new)
   end subroutine split

   !> Find the rectangle and the best split of a group.
   pure subroutine measure(boxes, list, group)
      real(wp), intent(in) :: boxes(:, :)
      integer(ip), intent(in) :: list(:)
      type(group_t), intent(inout) :: group
      real(wp) :: bins(4, n_bins), centres(4)
      integer(ip) :: k
      integer :: axis, bin

      group%bounds = no_bounds
      centres = no_bounds
      do k = group%first, group%last
         associate (box => boxes(:, list(k)))
            group%bounds = joined(group%bounds, box)
            centres = joined(centres, [box(1:2) + box(3:4), box(1:2) + box(3:4)])
         end associate
      end do
      group%gain = 0.0_wp
      do axis = 1, 2
         if (.not. centres(axis + 2) > centres(axis)) cycle
         bins = spread(no_bounds, 2, n_bins)
         do k = group%first, group%last
            bin = bin_of(boxes(:, list(k)), axis, centres(axis), centres(axis + 2))
            bins(:, bin) = joined(bins(:, bin), boxes(:, list(k)))
         end do
         call choose_split(bins, axis, centres, group)
      end do
   end subroutine measure

   !> Set the split of the group to the best one between the bins of an axis if that is better than the present one.
   pure subroutine choose_split(bins, axis, centres, group)
      !> Bounding rectangle of the boxes of each bin, (4, bin); the first and the last bin are not empty
      real(wp), intent(in) :: bins(:, :)
      integer, intent(in) :: axis
      !> Bounding rectangle of the centres, times two
      real(wp), intent(in) :: centres(4)
      type(group_t), intent(inout) :: group
      real(wp) :: lower(4), upper(4, n_bins), gain
      integer :: bin

      upper(:, n_bins) = bins(:, n_bins)
      do bin = n_bins - 1, 2, -1
         upper(:, bin) = joined(upper(:, bin + 1), bins(:, bin))
      end do
      lower = no_bounds
      do bin = 1, n_bins - 1
         lower = joined(lower, bins(:, bin))
         gain = area(group%bounds) - area(lower) - area(upper(:, bin + 1)) + area(overlap_of(lower, upper(:, bin + 1)))
         if (.not. gain > group%gain) cycle
         group%gain = gain
         group%axis = axis
         group%bin = bin
         group%low = centres(axis)
         group%high = centres(axis + 2)
      end do
   end subroutine choose_split

   !> Bin of the centre of a box
   pure integer function bin_of(box, axis, low, high)
      real(wp), intent(in) :: box(4)
      integer, intent(in) :: axis
      !> Least and greatest coordinate of the centres, times two
      real(wp), intent(in) :: low, high

      bin_of = min(n_bins, 1 + int((box(axis) + box(axis + 2) - low)/(high - low)*real(n_bins, wp)))
   end function bin_of

   !> Bounding rectangle of two rectangles
   pure function joined(a, b) result(bounds)
      real(wp), intent(in) :: a(4), b(4)
      real(wp) :: bounds(4)

      bounds(1:2) = min(a(1:2), b(1:2))
      bounds(3:4) = max(a(3:4), b(3:4))
   end function joined

   !> Intersection of two rectangles; its area is 0 if they are apart
   pure function overlap_of(a, b) result(bounds)
      real(wp), intent(in) :: a(4), b(4)
      real(wp) :: bounds(4)

      bounds(1:2) = max(a(1:2), b(1:2))
      bounds(3:4) = max(min(a(3:4), b(3:4)), bounds(1:2))
   end function overlap_of

   !> Area of a rectangle
   pure real(wp) function area(bounds)
      real(wp), intent(in) :: bounds(4)

      area = (bounds(3) - bounds(1))*(bounds(4) - bounds(2))
   end function area

end module polydem_bounding_rectangles
