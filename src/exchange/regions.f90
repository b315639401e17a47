!> Where the bodies of each process are, as all processes know it.
!>
!> Contract. Each process publishes rectangles that cover the boxes of its bodies. A process needs a body if the box
!> of that meets one of its rectangles (touching counts). So if the boxes of two bodies overlap, each is needed by the
!> owner of the other. Rectangles follow the bodies, whatever the cuts were when space was divided: bodies may wander,
!> and the reach of a large body counts where it is.
module polydem_regions
   use polydem_cover, only: bounds_of, cover
   use polydem_kinds, only: dp, ip, wp
   use polydem_team, only: team_t
   implicit none
   private
   public :: regions_t

   !> Fields along each axis of the map of a region
   integer, parameter :: n_fields = 32

   !> The regions of all processes but this one
   type :: regions_t
      private
      !> xmin, ymin, xmax, ymax of the rectangles of the other processes, (4, rectangle) [m]
      real(wp), allocatable :: rectangle(:, :)
      !> Ranks of these processes, ascending, (rectangle)
      integer(ip), allocatable :: owner(:)
      !> Those of them that meet `own`
      integer(ip), allocatable :: near(:)
      !> Number of rectangles of all processes
      integer(ip) :: n_published = 0_ip
      !> Rectangle on all boxes of this process [m]
      real(wp) :: own(4) = 0.0_wp
      !> Whether others come into a field of that rectangle
      logical :: shared(n_fields, n_fields) = .false.
   contains
      procedure :: publish
      procedure :: needed_by
      procedure :: n_rectangles
   end type regions_t

contains

   !> Tell all processes where the bodies of this one are, and learn where theirs are. All of the team must call this.
   subroutine publish(self, team, boxes)
      class(regions_t), intent(inout) :: self
      !> Processes
      class(team_t), intent(inout) :: team
      !> xmin, ymin, xmax, ymax of the boxes of the bodies that this process owns, grown by how far they may move until
      !> regions are published anew, (4, body) [m]
      real(wp), intent(in) :: boxes(:, :)
      real(wp), allocatable :: mine(:, :)
      real(dp), allocatable :: all_bounds(:)
      integer(ip), allocatable :: counts(:)
      integer(ip) :: rank, k, r, n

      call cover(boxes, mine)
      call team%gather(rounded_outwards(mine), all_bounds, counts)
      counts = counts/4_ip
      self%n_published = sum(counts)
      n = self%n_published - counts(team%rank)
      if (allocated(self%owner)) deallocate (self%owner, self%near, self%rectangle)
      allocate (self%owner(n), self%rectangle(4, n))
      n = 0_ip
      k = 0_ip
      do rank = 0_ip, team%size - 1_ip
         do r = 1_ip, counts(rank)
            k = k + 1_ip
            if (rank == team%rank) cycle
            n = n + 1_ip
            self%owner(n) = rank
            self%rectangle(:, n) = real(all_bounds(4_ip*k - 3_ip:4_ip*k), wp)
         end do
      end do
      self%own = bounds_of(boxes)
      call draw_map(self)
   end subroutine publish

   !> Number of rectangles that were published last, those of all processes
   pure integer(ip) function n_rectangles(self)
      class(regions_t), intent(in) :: self

      n_rectangles = self%n_published
   end function n_rectangles

   !> List the rectangles near this process, and mark the fields that they come into.
   pure subroutine draw_map(self)
      class(regions_t), intent(inout) :: self
      integer :: low(2), high(2)
      integer(ip) :: r

      self%near = pack([(r, r=1_ip, size(self%owner, kind=ip))], [(meet(self%rectangle(:, r), self%own), &
                                                                  r=1_ip, size(self%owner, kind=ip))])
      self%shared = .false.
      do r = 1_ip, size(self%near, kind=ip)
         call find_fields(self, self%rectangle(:, self%near(r)), low, high)
         self%shared(low(1):high(1), low(2):high(2)) = .true.
      end do
   end subroutine draw_map

   !> List the other processes that need a body.
   pure subroutine needed_by(self, box, ranks, n)
      class(regions_t), intent(in) :: self
      !> xmin, ymin, xmax, ymax of its box, grown as those that were published [m]
      real(wp), intent(in) :: box(4)
      !> Ranks, ascending, of which there can be as many as there are other processes
      integer(ip), intent(inout) :: ranks(:)
      !> Their number
      integer(ip), intent(out) :: n
      integer :: low(2), high(2)
      integer(ip) :: k

      n = 0_ip
      if (all(box(1:2) >= self%own(1:2)) .and. all(box(3:4) <= self%own(3:4))) then
         call find_fields(self, box, low, high)
         if (.not. any(self%shared(low(1):high(1), low(2):high(2)))) return
         do k = 1_ip, size(self%near, kind=ip)
            if (meet(self%rectangle(:, self%near(k)), box)) call note(self%owner(self%near(k)), ranks, n)
         end do
      else
         do k = 1_ip, size(self%owner, kind=ip)
            if (meet(self%rectangle(:, k), box)) call note(self%owner(k), ranks, n)
         end do
      end if
   end subroutine needed_by

   !> Append a rank to an ascending list, once.
   pure subroutine note(rank, ranks, n)
      integer(ip), intent(in) :: rank
      integer(ip), intent(inout) :: ranks(:), n

      if (n > 0_ip) then
         if (ranks(n) == rank) return
      end if
      n = n + 1_ip
      ranks(n) = rank
   end subroutine note

   !> Fields that a box comes into. Fields ascend with coordinates, so boxes that meet have one in common.
   pure subroutine find_fields(self, box, low, high)
      class(regions_t), intent(in) :: self
      real(wp), intent(in) :: box(4)
      !> First and last field along both axes
      integer, intent(out) :: low(2), high(2)
      real(wp) :: side
      integer :: axis

      do axis = 1, 2
         side = self%own(axis + 2) - self%own(axis)
         low(axis) = 1
         high(axis) = n_fields
         if (.not. side > 0.0_wp) cycle
         low(axis) = field_at((box(axis) - self%own(axis))/side)
         high(axis) = field_at((box(axis + 2) - self%own(axis))/side)
      end do
   end subroutine find_fields

   !> Field at a share of a side
   pure integer function field_at(share)
      real(wp), intent(in) :: share

      field_at = min(1 + int(min(max(share, 0.0_wp), 1.0_wp)*real(n_fields, wp)), n_fields)
   end function field_at

   !> Whether two boxes have a point in common
   pure logical function meet(a, b)
      real(wp), intent(in) :: a(4), b(4)

      meet = a(1) <= b(3) .and. b(1) <= a(3) .and. a(2) <= b(4) .and. b(2) <= a(4)
   end function meet

   !> Rectangles in double precision, one after the other, none smaller than it was
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

end module polydem_regions
