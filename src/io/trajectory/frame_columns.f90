!> The columns of one frame of a segment.
module polydem_frame_columns
   use polydem_errors, only: error_t, input_error, raise
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_kinds, only: dp, ip, lp
   use polydem_sort, only: place_in
   implicit none
   private
   public :: frame_columns_t, insist_on_layout, read_frame

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

   !> Refuse a segment of an earlier version, which had no /frames/start.
   subroutine insist_on_layout(file, path, error)
      !> An open segment
      type(hdf5_file_t), intent(in) :: file
      !> Its path
      character(len=*), intent(in) :: path
      !> Allocated if it is one
      type(error_t), allocatable, intent(inout) :: error

      if (.not. file%has('/frames/start', error)) call raise(error, input_error, path// &
         ': is a segment of an earlier file layout. Run its scene again with this version of polydem')
   end subroutine insist_on_layout

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
      integer(lp), allocatable :: start(:)
      integer(lp) :: rows(2)

      call file%read('/frames/start', start, error, rows=[row, 2_lp])
      if (allocated(error)) return
      rows = [start(1), start(2) - start(1)]
      if (any(rows < 0_lp)) then
         call raise(error, input_error, 'its /frames/start does not ascend')
         return
      end if
      call file%read('/frames/position', columns%position, error, rows=rows)
      call file%read('/frames/angle', columns%angle, error, rows=rows)
      call file%read('/frames/velocity', columns%velocity, error, rows=rows)
      call file%read('/frames/angular_velocity', columns%spin, error, rows=rows)
      call find_bodies(file, rows, id, columns%body, error)
      if (allocated(error)) return
      associate (n => size(columns%body))
         if (size(columns%position, 1) == 2 .and. size(columns%velocity, 1) == 2 .and. &
             all([size(columns%position, 2), size(columns%angle), size(columns%velocity, 2), &
                  size(columns%spin)] == n)) return
      end associate
      call raise(error, input_error, 'its frames and bodies have different numbers of bodies')
   end subroutine read_frame

   !> Find which bodies a frame has: all, unless bodies enter or leave.
   subroutine find_bodies(file, rows, id, body, error)
      type(hdf5_file_t), intent(in) :: file
      !> Number of rows before those of the frame, and number of these
      integer(lp), intent(in) :: rows(2)
      integer(ip), intent(in) :: id(:)
      !> Row of each body in /bodies, from 1
      integer(ip), allocatable, intent(out) :: body(:)
      type(error_t), allocatable, intent(inout) :: error
      integer(lp), allocatable :: present_ids(:)
      integer(ip) :: k

      if (.not. file%has('/frames/id', error)) then
         body = [(k, k=1_ip, size(id, kind=ip))]
         return
      end if
      call file%read('/frames/id', present_ids, error, rows=rows)
      if (allocated(error)) return
      allocate (body(size(present_ids)))
      do k = 1_ip, size(present_ids, kind=ip)
         body(k) = min(place_in(id, int(present_ids(k), ip)), size(id, kind=ip))
         if (body(k) < 1_ip) exit
         if (int(id(body(k)), lp) /= present_ids(k)) exit
      end do
      if (k <= size(present_ids)) call raise(error, input_error, &
         '/frames/id names a body that /bodies/id does not have')
   end subroutine find_bodies

end module polydem_frame_columns
