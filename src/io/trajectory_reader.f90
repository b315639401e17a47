!> Reads a packing: bodies from the last frame of a trajectory, or from a bodies file.
module polydem_trajectory_reader
   use polydem_bodies, only: bodies_t
   use polydem_bodies_reader, only: read_bodies_file
   use polydem_body_list, only: body_list_t, new_bodies
   use polydem_elementary, only: sine_and_cosine
   use polydem_errors, only: error_t, input_error, raise
   use polydem_file_system, only: is_folder
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_kinds, only: dp, ip, wp
   use polydem_result_files, only: last_segment
   implicit none
   private
   public :: read_packing

contains

   !> Read the bodies of a packing.
   subroutine read_packing(path, bodies, error)
      !> Result folder, segment of a trajectory, or bodies file
      character(len=*), intent(in) :: path
      !> Bodies, with angle 0 and at rest
      type(bodies_t), intent(out) :: bodies
      !> Names the path and the defect
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: file_path
      type(hdf5_file_t) :: file
      type(body_list_t) :: list
      logical :: is_segment

      file_path = path
      if (is_folder(path, error)) file_path = last_segment(path, error)
      if (allocated(error)) return
      if (file_path == '') then
         call raise(error, input_error, path//' contains no closed segment of a trajectory. Check that its run has '// &
                    'ended')
         return
      end if
      call file%open(file_path, error)
      if (allocated(error)) return
      is_segment = file%has('frames', error)
      if (is_segment) call list_last_frame(file, list, error)
      call file%close(error)
      if (.not. is_segment .and. .not. allocated(error)) call read_bodies_file(file_path, 1.0_wp, list, error)
      if (.not. allocated(error)) call new_bodies(list, bodies, error)
   end subroutine read_packing

   !> Append the bodies of a segment to a list, with vertices in world coordinates of the last frame.
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
      call file%read('/bodies/vertex_start', start, error)
      call file%read('/bodies/vertex', shape, error)
      call file%read('/frames/position', position, error)
      call file%read('/frames/angle', angle, error)
      if (allocated(error)) return
      if (.not. fit(fixed, start, shape, position, angle)) then
         call raise(error, input_error, 'the data sets of its segment of a trajectory are inconsistent')
         return
      end if
      last = size(angle, 2, kind=ip)
      do k = 1_ip, size(fixed, kind=ip)
         call sine_and_cosine(real(angle(k, last), wp), s, c)
         corners = real(shape(:, start(k) + 1_ip:start(k + 1_ip)), wp)
         do v = 1_ip, size(corners, 2, kind=ip)
            corners(:, v) = [c*corners(1, v) - s*corners(2, v), s*corners(1, v) + c*corners(2, v)] &
                            + real(position(:, k, last), wp)
         end do
         call list%append(corners, fixed=fixed(k) == 1_ip)
      end do
   end subroutine list_last_frame

   !> Whether the shapes of the data sets of a segment are consistent, with at least one frame
   pure logical function fit(fixed, start, shape, position, angle)
      integer(ip), intent(in) :: fixed(:), start(:)
      real(dp), intent(in) :: shape(:, :), position(:, :, :), angle(:, :)
      integer :: n

      n = size(fixed)
      fit = size(start) == n + 1 .and. size(shape, 1) == 2 .and. size(angle, 1) == n .and. size(angle, 2) > 0 .and. &
            size(position, 1) == 2 .and. size(position, 2) == n .and. size(position, 3) == size(angle, 2)
      if (fit) fit = start(1) == 0_ip .and. start(n + 1) == size(shape, 2) .and. all(start(2:) >= start(:n))
   end function fit

end module polydem_trajectory_reader
