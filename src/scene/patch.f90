!> Patches: the free bodies in the middle of a settled packing, cut out so that copies of them fit side by side.
!>
!> The packing is the last frame of a result, or a bodies file. A margin at its walls and under its surface is left
!> out. What is left has its centres in a rectangle, which is the period of the patch: of two grains that overlap
!> across the border of two copies one is dropped, so that copies touch but do not overlap.
module polydem_patch
   use polydem_bodies, only: bodies_t
   use polydem_bodies_file, only: read_bodies_file
   use polydem_body_list, only: body_list_t, new_bodies
   use polydem_convex_overlap, only: overlap_polygons, overlap_t
   use polydem_errors, only: error_t, input_error, raise
   use polydem_grains, only: grain_t
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_kinds, only: dp, ip, wp
   use polydem_paths, only: is_folder
   use polydem_segment_path, only: last_segment
   use polydem_sort_reals, only: sort_reals
   implicit none
   private
   public :: patch_t, read_patch, read_packing, cut_patch

   !> What is left out at walls and under the surface, in distances of grains
   real(wp), parameter :: margin = 3.0_wp
   !> Least width and height of a patch, in distances of grains
   real(wp), parameter :: least_size = 4.0_wp

   !> Grains to repeat
   type :: patch_t
      !> Grains, from the lowest to the highest; corners relative to the centre of mass
      type(grain_t), allocatable :: grains(:)
      !> Centres of mass, from (0, 0) to `period`, (2, grain) [m]
      real(wp), allocatable :: centres(:, :)
      !> Width and height, by which copies are apart [m]
      real(wp) :: period(2) = 0.0_wp
   end type patch_t

contains

   !> Read a packing and cut a patch from it.
   subroutine read_patch(path, patch, error)
      !> Result folder, segment of a trajectory, or bodies file
      character(len=*), intent(in) :: path
      !> Patch
      type(patch_t), intent(out) :: patch
      !> If there is no packing, or it is too small
      type(error_t), allocatable, intent(inout) :: error
      type(bodies_t) :: bodies

      call read_packing(path, bodies, error)
      if (.not. allocated(error)) call cut_patch(bodies, patch, error)
      if (allocated(error)) error%message = 'packing: '//error%message
   end subroutine read_patch

   !> Read the bodies of a packing.
   subroutine read_packing(path, bodies, error)
      !> Result folder, segment of a trajectory, or bodies file
      character(len=*), intent(in) :: path
      !> Bodies, at angle 0 and at rest
      type(bodies_t), intent(out) :: bodies
      !> What cannot be read
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: file_path
      type(hdf5_file_t) :: file
      type(body_list_t) :: list
      type(error_t), allocatable :: ignored
      logical :: is_segment

      file_path = path
      if (is_folder(path)) file_path = last_segment(path)
      if (file_path == '') then
         call raise(error, input_error, path//' holds no closed segment of a trajectory; has its run ended?')
         return
      end if
      call file%open(file_path, error)
      if (allocated(error)) return
      is_segment = file%has('frames')
      if (is_segment) call list_last_frame(file, list, error)
      call file%close(ignored)
      if (.not. is_segment) call read_bodies_file(file_path, 1.0_wp, list, error)
      if (.not. allocated(error)) call new_bodies(list, bodies, error)
   end subroutine read_packing

   !> List the bodies of a segment as they lie in its last frame.
   subroutine list_last_frame(file, list, error)
      type(hdf5_file_t), intent(in) :: file
      type(body_list_t), intent(inout) :: list
      type(error_t), allocatable, intent(inout) :: error
      integer(ip), allocatable :: fixed(:), start(:)
      real(dp), allocatable :: shape(:, :), position(:, :, :), angle(:, :)
      real(wp), allocatable :: corners(:, :)
      real(wp) :: c, s
      integer(ip) :: k, v, last

      call file%read('/bodies/fixed', fixed, error)
      if (.not. allocated(error)) call file%read('/bodies/vertex_start', start, error)
      if (.not. allocated(error)) call file%read('/bodies/vertex', shape, error)
      if (.not. allocated(error)) call file%read('/frames/position', position, error)
      if (.not. allocated(error)) call file%read('/frames/angle', angle, error)
      if (allocated(error)) return
      if (.not. fit(fixed, start, shape, position, angle)) then
         call raise(error, input_error, 'the parts of its segment of a trajectory do not fit together')
         return
      end if
      last = size(angle, 2, kind=ip)
      do k = 1_ip, size(fixed, kind=ip)
         c = cos(real(angle(k, last), wp))
         s = sin(real(angle(k, last), wp))
         corners = real(shape(:, start(k) + 1_ip:start(k + 1_ip)), wp)
         do v = 1_ip, size(corners, 2, kind=ip)
            corners(:, v) = [c*corners(1, v) - s*corners(2, v), s*corners(1, v) + c*corners(2, v)] &
                            + real(position(:, k, last), wp)
         end do
         call list%append(corners, fixed=fixed(k) == 1_ip)
      end do
   end subroutine list_last_frame

   !> Whether the parts of a segment belong to the same bodies and frames, at least one frame
   pure logical function fit(fixed, start, shape, position, angle)
      integer(ip), intent(in) :: fixed(:), start(:)
      real(dp), intent(in) :: shape(:, :), position(:, :, :), angle(:, :)
      integer :: n

      n = size(fixed)
      fit = size(start) == n + 1 .and. size(shape, 1) == 2 .and. size(angle, 1) == n .and. size(angle, 2) > 0 .and. &
            size(position, 1) == 2 .and. size(position, 2) == n .and. size(position, 3) == size(angle, 2)
      if (fit) fit = start(1) == 0_ip .and. start(n + 1) == size(shape, 2) .and. all(start(2:) >= start(:n))
   end function fit

   !> Cut a patch from the free bodies of a packing.
   subroutine cut_patch(bodies, patch, error)
      !> Bodies of the packing, turned to their angles
      type(bodies_t), intent(in) :: bodies
      !> Patch
      type(patch_t), intent(out) :: patch
      !> If the packing is too small
      type(error_t), allocatable, intent(inout) :: error
      real(wp), allocatable :: centres(:, :)
      real(wp) :: low(2), high(2), distance
      integer(ip), allocatable :: chosen(:), order(:)
      integer(ip) :: k

      centres = bodies%position(:, bodies%free)
      call find_middle(centres, low, high, distance)
      if (any(.not. high - low > least_size*distance)) then
         call raise(error, input_error, 'too few free bodies lie away from walls and surface to make a patch of '// &
                    'them; a bed of a thousand grains is enough')
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
            patch%grains(k)%corners = bodies%turned(:, bodies%vertex_start(s):bodies%vertex_start(s + 1_ip) - 1_ip)
         end associate
         associate (corners => patch%grains(k)%corners)
            patch%grains(k)%length = 2.0_wp*maxval(hypot(corners(1, :), corners(2, :)))
         end associate
      end do
      call drop_overlaps(patch)
   end subroutine cut_patch

   !> The rectangle that is left of a packing without its margins, whose surface is as low as in its lowest place.
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

   !> Drop grains that overlap a copy of one that is kept.
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

   !> Whether a grain sticks out of the rectangle
   pure logical function near_border(patch, k)
      type(patch_t), intent(in) :: patch
      integer(ip), intent(in) :: k

      near_border = any(min(patch%centres(:, k), patch%period - patch%centres(:, k)) <= maxval(patch%grains%length))
   end function near_border

   !> Whether grain k overlaps any of the eight copies of grain j around
   pure logical function meets_copy(patch, j, k)
      type(patch_t), intent(in) :: patch
      integer(ip), intent(in) :: j, k
      type(overlap_t) :: overlap
      real(wp) :: offset(2), near
      integer :: column, row

      meets_copy = .false.
      near = 0.5_wp*(patch%grains(j)%length + patch%grains(k)%length)
      do row = -1, 1
         do column = -1, 1
            if (row == 0 .and. column == 0) cycle
            offset = patch%centres(:, j) - patch%centres(:, k) + [column, row]*patch%period
            if (any(abs(offset) > near)) cycle
            call overlap_polygons(patch%grains(k)%corners, patch%grains(j)%corners, offset, 0_ip, overlap)
            if (overlap%area > 0.0_wp) meets_copy = .true.
         end do
      end do
   end function meets_copy

end module polydem_patch
