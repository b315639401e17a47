!> Patches: free bodies from the middle of a settled packing. Copies of a patch fit side by side.
!>
!> The packing is the last frame of a result, or a bodies file. A margin along its walls and below its surface is left
!> out. The centres of the other bodies lie in a rectangle, which is the period of the patch. If two grains overlap
!> across the border of two copies, one of them is removed. Copies touch but do not overlap.
module polydem_patch
   use polydem_bodies, only: bodies_t
   use polydem_convex_overlap, only: overlap_polygons, overlap_t
   use polydem_elementary, only: hypotenuse
   use polydem_errors, only: error_t, input_error, raise
   use polydem_grain_list, only: area_of_grain, corners_of_piece, grain_t
   use polydem_kinds, only: ip, wp
   use polydem_polygon, only: mass_properties
   use polydem_sort_reals, only: sort_reals
   use polydem_trajectory_reader, only: read_packing
   implicit none
   private
   public :: patch_t, read_patch, cut_patch

   !> Width of the margin at walls and below the surface, in mean distances of grains
   real(wp), parameter :: margin = 3.0_wp
   !> Smallest width and height of a patch, in mean distances of grains
   real(wp), parameter :: least_size = 4.0_wp

   !> Patch of grains that is repeated periodically
   type :: patch_t
      !> Grains, from the lowest to the highest; corners relative to the centre of mass
      type(grain_t), allocatable :: grains(:)
      !> Centres of mass, between (0, 0) and `period`, (2, grain) [m]
      real(wp), allocatable :: centres(:, :)
      !> Width and height of the patch, which are the distances between neighbouring copies [m]
      real(wp) :: period(2) = 0.0_wp
   end type patch_t

contains

   !> Read a packing and cut a patch from it.
   subroutine read_patch(path, patch, error)
      !> Result folder, segment of a trajectory, or bodies file
      character(len=*), intent(in) :: path
      type(patch_t), intent(out) :: patch
      !> Allocated if the packing cannot be read or is too small
      type(error_t), allocatable, intent(inout) :: error
      type(bodies_t) :: bodies

      call read_packing(path, bodies, error)
      if (.not. allocated(error)) call cut_patch(bodies, patch, error)
      if (allocated(error)) error%message = 'packing: '//error%message
   end subroutine read_patch

   !> Cut a patch from the free bodies of a packing.
   subroutine cut_patch(bodies, patch, error)
      !> Bodies of the packing; their corners must be rotated to their angles
      type(bodies_t), intent(in) :: bodies
      type(patch_t), intent(out) :: patch
      !> Allocated if the packing is too small
      type(error_t), allocatable, intent(inout) :: error
      real(wp), allocatable :: centres(:, :)
      real(wp) :: low(2), high(2), distance
      integer(ip), allocatable :: chosen(:), order(:)
      integer(ip) :: k

      centres = bodies%position(:, bodies%free)
      call find_middle(centres, low, high, distance)
      if (any(.not. high - low > least_size*distance)) then
         call raise(error, input_error, 'too few free bodies away from walls and surface to cut a patch; '// &
                    'a bed of a thousand grains is enough')
         return
      end if
      chosen = pack([(k, k=1_ip, size(centres, 2, kind=ip))], &
                    centres(1, :) >= low(1) .and. centres(1, :) < high(1) .and. &
                    centres(2, :) >= low(2) .and. centres(2, :) < high(2))
      allocate (order(size(chosen)))
      call sort_reals(centres(2, chosen), order)
      chosen = chosen(order)
      patch%period = high - low
      allocate (patch%grains(size(chosen)), patch%centres(2, size(chosen)))
      do k = 1_ip, size(chosen, kind=ip)
         patch%centres(:, k) = centres(:, chosen(k)) - low
         associate (s => bodies%free(chosen(k)))
            patch%grains(k)%corners = bodies%pieces%turned_polygon(s)
            if (bodies%pieces%most > 1_ip) patch%grains(k)%piece = bodies%pieces%numbers_of(s)
            patch%grains(k)%area = area_of_grain(patch%grains(k))
         end associate
         associate (corners => patch%grains(k)%corners)
            patch%grains(k)%length = 2.0_wp*maxval(hypotenuse(corners(1, :), corners(2, :)))
         end associate
      end do
      call drop_overlaps(patch)
   end subroutine cut_patch

   !> Find the rectangle inside the margins of a packing. Its upper side is below the lowest point of the surface.
   pure subroutine find_middle(centres, low, high, distance)
      real(wp), intent(in) :: centres(:, :)
      real(wp), intent(out) :: low(2), high(2)
      !> Mean distance of grains [m]
      real(wp), intent(out) :: distance
      real(wp) :: strip, surface
      integer(ip) :: k, n_strips

      low = 0.0_wp
      high = 0.0_wp
      distance = 1.0_wp
      if (size(centres, 2) < 2) return
      low = minval(centres, 2)
      high = maxval(centres, 2)
      distance = sqrt((high(1) - low(1))*(high(2) - low(2))/real(size(centres, 2), wp))
      if (.not. distance > 0.0_wp) return
      n_strips = max(1_ip, floor((high(1) - low(1))/(margin*distance), ip))
      surface = high(2)
      do k = 1_ip, n_strips
         strip = (high(1) - low(1))/real(n_strips, wp)
         surface = min(surface, maxval(centres(2, :), mask=abs(centres(1, :) - low(1) &
                                                              - (real(k, wp) - 0.5_wp)*strip) <= 0.5_wp*strip))
      end do
      high(2) = surface
      low = low + margin*distance
      high = high - margin*distance
   end subroutine find_middle

   !> Remove grains that overlap a copy of another grain of the patch.
   pure subroutine drop_overlaps(patch)
      type(patch_t), intent(inout) :: patch
      logical :: kept(size(patch%grains))
      integer(ip) :: j, k
      type(grain_t), allocatable :: grains(:)

      kept = .true.
      do k = 1_ip, size(kept, kind=ip)
         if (.not. near_border(patch, k)) cycle
         do j = 1_ip, k - 1_ip
            if (kept(j) .and. kept(k)) kept(k) = .not. meets_copy(patch, j, k)
         end do
      end do
      grains = pack(patch%grains, kept)
      call move_alloc(grains, patch%grains)
      patch%centres = reshape(pack(patch%centres, spread(kept, 1, 2)), [2, count(kept)])
   end subroutine drop_overlaps

   !> Whether a grain is so near the border of the rectangle that it may overlap a copy of a grain
   pure logical function near_border(patch, k)
      type(patch_t), intent(in) :: patch
      integer(ip), intent(in) :: k

      near_border = any(min(patch%centres(:, k), patch%period - patch%centres(:, k)) <= maxval(patch%grains%length))
   end function near_border

   !> Whether grain k overlaps any of the eight neighbouring copies of grain j
   pure logical function meets_copy(patch, j, k)
      type(patch_t), intent(in) :: patch
      integer(ip), intent(in) :: j, k
      real(wp) :: offset(2), near
      integer :: column, row

      meets_copy = .false.
      near = 0.5_wp*(patch%grains(j)%length + patch%grains(k)%length)
      do row = -1, 1
         do column = -1, 1
            if (row == 0 .and. column == 0) cycle
            offset = patch%centres(:, j) - patch%centres(:, k) + [column, row]*patch%period
            if (any(abs(offset) > near)) cycle
            meets_copy = meets_copy .or. overlap_grains(patch%grains(k), patch%grains(j), offset)
         end do
      end do
   end function meets_copy

   !> Whether any pieces of two grains overlap
   pure logical function overlap_grains(a, b, offset)
      type(grain_t), intent(in) :: a, b
      !> Centre of b minus centre of a [m]
      real(wp), intent(in) :: offset(2)
      type(overlap_t) :: overlap
      real(wp), allocatable :: p(:, :), q(:, :)
      real(wp) :: centre_p(2), centre_q(2)
      integer(ip) :: j, k

      overlap_grains = .false.
      do k = 0_ip, last_piece(a)
         call take_piece(a, k, p, centre_p)
         do j = 0_ip, last_piece(b)
            call take_piece(b, j, q, centre_q)
            call overlap_polygons(p, q, offset + centre_q - centre_p, 0_ip, overlap)
            if (overlap%area > 0.0_wp) overlap_grains = .true.
         end do
      end do
   end function overlap_grains

   !> Number of the last piece of a grain, from 0
   pure integer(ip) function last_piece(grain)
      type(grain_t), intent(in) :: grain

      last_piece = 0_ip
      if (allocated(grain%piece)) last_piece = maxval(grain%piece)
   end function last_piece

   !> Take a piece of a grain, relative to its own centre if the grain has several.
   pure subroutine take_piece(grain, k, corners, centre)
      type(grain_t), intent(in) :: grain
      !> Number of the piece
      integer(ip), intent(in) :: k
      real(wp), allocatable, intent(out) :: corners(:, :)
      !> The centre relative to that of the grain [m]
      real(wp), intent(out) :: centre(2)
      real(wp) :: area, second_moment

      corners = grain%corners
      centre = 0.0_wp
      if (.not. allocated(grain%piece)) return
      corners = corners_of_piece(grain%corners, grain%piece, k)
      call mass_properties(corners, area, centre, second_moment)
      corners = corners - spread(centre, 2, size(corners, 2))
   end subroutine take_piece

end module polydem_patch
