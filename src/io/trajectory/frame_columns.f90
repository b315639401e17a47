!> The columns of one frame of a segment, in either form of a segment: with one row per frame or, if bodies enter or
!> leave, with one row per body of each frame.
module polydem_frame_columns
   use polydem_errors, only: error_t, input_error, raise
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_kinds, only: dp, ip, lp
   use polydem_sort, only: place_in
   implicit none
   private
   public :: frame_columns_t, read_frame

   !> Poses and velocities of the bodies of a frame
   type :: frame_columns_t
      !> Row of each body in /bodies, from 1
      integer(ip), allocatable :: body(:)
      !> Centres of mass, (2, body) [m]
      real(dp), allocatable :: position(:, :)
      !> Angles [rad]
      real(dp), allocatable :: angle(:)
      !> Velocities, (2, body) [m/s]
      real(dp), allocatable :: velocity(:, :)
      !> Angular velocities [rad/s]
      real(dp), allocatable :: spin(:)
   end type frame_columns_t

contains

   !> Read a frame.
   subroutine read_frame(file, row, id, columns, error)
      !> An open segment
      type(hdf5_file_t), intent(in) :: file
      !> Number of frames before it in the segment
      integer(lp), intent(in) :: row
      !> Identifiers of /bodies, ascending
      integer(ip), intent(in) :: id(:)
      type(frame_columns_t), intent(out) :: columns
      !> Allocated if the data sets do not fit together
      type(error_t), allocatable, intent(inout) :: error
      logical :: is_ragged, fits

      is_ragged = file%has('/frames/start', error)
      if (allocated(error)) return
      if (is_ragged) then
         call read_ragged(file, row, id, columns, error)
      else
         call read_rectangular(file, row, id, columns, error)
      end if
      if (allocated(error)) return
      associate (n => size(columns%body))
         fits = size(columns%position, 1) == 2 .and. size(columns%velocity, 1) == 2 .and. &
                all([size(columns%position, 2), size(columns%angle), size(columns%velocity, 2), &
                     size(columns%spin)] == n)
      end associate
      if (.not. fits) call raise(error, input_error, 'its frames and bodies have different numbers of bodies')
   end subroutine read_frame

   !> Read a frame of a segment with one row per frame.
   subroutine read_rectangular(file, row, id, columns, error)
      type(hdf5_file_t), intent(in) :: file
      integer(lp), intent(in) :: row
      integer(ip), intent(in) :: id(:)
      type(frame_columns_t), intent(inout) :: columns
      type(error_t), allocatable, intent(inout) :: error
      real(dp), allocatable :: vectors(:, :, :), numbers(:, :)
      integer(ip) :: k

      columns%body = [(k, k=1_ip, size(id, kind=ip))]
      call file%read('/frames/position', vectors, error, rows=[row, 1_lp])
      if (.not. allocated(error)) columns%position = vectors(:, :, 1)
      call file%read('/frames/angle', numbers, error, rows=[row, 1_lp])
      if (.not. allocated(error)) columns%angle = numbers(:, 1)
      call file%read('/frames/velocity', vectors, error, rows=[row, 1_lp])
      if (.not. allocated(error)) columns%velocity = vectors(:, :, 1)
      call file%read('/frames/angular_velocity', numbers, error, rows=[row, 1_lp])
      if (.not. allocated(error)) columns%spin = numbers(:, 1)
   end subroutine read_rectangular

   !> Read a frame of a segment with one row per body of each frame.
   subroutine read_ragged(file, row, id, columns, error)
      type(hdf5_file_t), intent(in) :: file
      integer(lp), intent(in) :: row
      integer(ip), intent(in) :: id(:)
      type(frame_columns_t), intent(inout) :: columns
      type(error_t), allocatable, intent(inout) :: error
      integer(lp), allocatable :: start(:), present_ids(:)
      integer(lp) :: rows(2)
      integer(ip) :: k

      call file%read('/frames/start', start, error, rows=[row, 2_lp])
      if (allocated(error)) return
      rows = [start(1), start(2) - start(1)]
      if (any(rows < 0_lp)) then
         call raise(error, input_error, 'its /frames/start does not ascend')
         return
      end if
      call file%read('/frames/id', present_ids, error, rows=rows)
      call file%read('/frames/position', columns%position, error, rows=rows)
      call file%read('/frames/angle', columns%angle, error, rows=rows)
      call file%read('/frames/velocity', columns%velocity, error, rows=rows)
      call file%read('/frames/angular_velocity', columns%spin, error, rows=rows)
      if (allocated(error)) return
      allocate (columns%body(size(present_ids)))
      do k = 1_ip, size(present_ids, kind=ip)
         columns%body(k) = min(place_in(id, int(present_ids(k), ip)), size(id, kind=ip))
         if (columns%body(k) < 1_ip) exit
         if (int(id(columns%body(k)), lp) /= present_ids(k)) exit
      end do
      if (k <= size(present_ids)) call raise(error, input_error, &
         '/frames/id names a body that /bodies/id does not have')
   end subroutine read_ragged

end module polydem_frame_columns
