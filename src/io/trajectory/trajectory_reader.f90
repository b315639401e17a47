!> Reads a packing: bodies from the last frame of a trajectory, or from a bodies file.
module polydem_trajectory_reader
   use polydem_bodies, only: bodies_t
   use polydem_bodies_reader, only: read_bodies_file
   use polydem_body_list, only: body_list_t, new_bodies
   use polydem_elementary, only: sine_and_cosine
   use polydem_errors, only: error_t, input_error, raise
   use polydem_file_system, only: is_folder
   use polydem_frame_columns, only: frame_columns_t, read_frame
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_kinds, only: dp, ip, lp, wp
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
      integer(ip), allocatable :: id(:), fixed(:), start(:)
      real(dp), allocatable :: shape(:, :), times(:)
      real(wp), allocatable :: corners(:, :)
      type(frame_columns_t) :: frame
      real(wp) :: c, s
      integer(ip) :: j, k, v

      call file%read('/bodies/id', id, error)
      call file%read('/bodies/fixed', fixed, error)
      call file%read('/bodies/vertex_start', start, error)
      call file%read('/bodies/vertex', shape, error)
      call file%read('/frames/time', times, error)
      if (allocated(error)) return
      if (.not. fit(id, fixed, start, shape) .or. size(times) == 0) then
         call raise(error, input_error, 'the data sets of its segment of a trajectory are inconsistent')
         return
      end if
      call read_frame(file, size(times, kind=lp) - 1_lp, id, frame, error)
      if (allocated(error)) return
      do j = 1_ip, size(frame%body, kind=ip)
         k = frame%body(j)
         call sine_and_cosine(real(frame%angle(j), wp), s, c)
         corners = real(shape(:, start(k) + 1_ip:start(k + 1_ip)), wp)
         do v = 1_ip, size(corners, 2, kind=ip)
            corners(:, v) = [c*corners(1, v) - s*corners(2, v), s*corners(1, v) + c*corners(2, v)] &
                            + real(frame%position(:, j), wp)
         end do
         call list%append(corners, fixed=fixed(k) == 1_ip)
      end do
   end subroutine list_last_frame

   !> Whether the shapes of the data sets of the bodies of a segment are consistent
   pure logical function fit(id, fixed, start, shape)
      integer(ip), intent(in) :: id(:), fixed(:), start(:)
      real(dp), intent(in) :: shape(:, :)
      integer :: n

      n = size(fixed)
      fit = size(id) == n .and. size(start) == n + 1 .and. size(shape, 1) == 2
      if (fit) fit = start(1) == 0_ip .and. start(n + 1) == size(shape, 2) .and. all(start(2:) >= start(:n))
   end function fit

end module polydem_trajectory_reader
