!> Reads and checks a trace of recorded boxes.
!>
!>     aabb           (steps, boxes, 4)  bounds of every box at every step [m]
!>     is_wall        (boxes)            non-zero for boxes of fixed bodies
!>     npairs         (steps)            optional, exact number of pairs
!>     pair_hash      (steps)            optional, sum of the hashes of the pairs
!>     body           (boxes)            optional, body of each box, from 1, ascending
!>     reach          (boxes)            optional, greatest half side of each box at any angle [m]
!>     vertices       (n, 2)             optional, polygons, from which the reach follows [m]
!>     vertex_offset  (boxes + 1)        first vertex of each box, from 0; the last entry is n
!>     dt                                optional attribute, time between steps [s]
!>     provenance/resolved_input         optional, settings of the run that recorded the trace
!>
!> In messages steps and boxes are counted from 0, as in the file.
module polydem_trace_reader
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use polydem_errors, only: error_t
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_kinds, only: far, dp, ip, lp, wp
   use polydem_polygon, only: diameter
   use polydem_strings, only: to_text
   implicit none
   private
   public :: trace_t, read_trace

   !> A trace of recorded boxes
   type :: trace_t
      !> Number of steps
      integer(ip) :: n_steps = 0_ip
      !> Time between steps [s]; 0 if unknown
      real(dp) :: dt = 0.0_dp
      !> Bounds, (4, box, step) [m]
      real(wp), allocatable :: bounds(:, :, :)
      !> Whether the body of each box is fixed, (box)
      logical, allocatable :: fixed(:)
      !> Slot of the body of each box, (box)
      integer(ip), allocatable :: body(:)
      !> Greatest half side of each box at any angle, (box) [m]
      real(wp), allocatable :: reach(:)
      !> Number of pairs of each step, (step); unallocated if not recorded
      integer(ip), allocatable :: n_pairs(:)
      !> Sum of the hashes of the pairs of each step, (step); unallocated if not recorded
      integer(lp), allocatable :: pair_hash(:)
      !> Resolved settings of the run that recorded the trace; empty if not recorded
      character(len=:), allocatable :: input
   end type trace_t

   !> Approximate number of values per block read from aabb; reading in blocks avoids a second copy of all bounds
   integer(lp), parameter :: block_numbers = 8388608_lp

contains

   !> Read a trace and check that its data sets are consistent.
   subroutine read_trace(path, trace, error, most_steps)
      !> Path of the HDF5 file
      character(len=*), intent(in) :: path
      type(trace_t), intent(out) :: trace
      !> Allocated if the file cannot be read or is not a valid trace
      type(error_t), allocatable, intent(inout) :: error
      !> Maximum number of steps to read; 0 or absent: all steps
      integer(ip), intent(in), optional :: most_steps
      type(hdf5_file_t) :: file

      call file%open(path, error)
      if (allocated(error)) return
      if (present(most_steps)) trace%n_steps = most_steps
      if (.not. file%has('/aabb', error)) call file%reject('the file is not a trace: it has no data set /aabb with '// &
         'the boxes of each step. A run with trace_steps in &output writes one, trace.h5', error)
      if (.not. allocated(error)) call read_boxes(file, trace, error)
      if (.not. allocated(error)) call read_bodies(file, trace, error)
      if (.not. allocated(error)) call read_numbers(file, trace, error)
      if (.not. allocated(error)) call read_reach(file, trace, error)
      if (.not. allocated(error)) call read_polygons(file, trace, error)
      call file%read_real_attribute('/', 'dt', trace%dt, error)
      trace%input = ''
      if (file%has('/provenance/resolved_input', error)) &
         call file%read('/provenance/resolved_input', trace%input, error)
      if (.not. ieee_is_finite(trace%dt) .or. trace%dt < 0.0_dp) &
         call file%reject('the attribute dt must be finite and not negative', error)
      call file%close(error)
   end subroutine read_trace

   !> Read the bounds of all boxes and the flags of fixed ones. The reach is set to the greatest recorded half side.
   subroutine read_boxes(file, trace, error)
      type(hdf5_file_t), intent(in) :: file
      type(trace_t), intent(inout) :: trace
      type(error_t), allocatable, intent(inout) :: error
      real(dp), allocatable :: bounds(:, :, :)
      integer(lp), allocatable :: extent(:)
      integer(ip), allocatable :: is_wall(:)
      integer(ip) :: first, n_rows, s
      integer :: status
      logical :: fit

      call file%shape_of('/aabb', extent, error)
      call file%read('/is_wall', is_wall, error)
      if (allocated(error)) return
      fit = size(extent) == 3
      if (fit) fit = minval(extent) >= 1_lp .and. maxval(extent) < huge(1_ip) .and. extent(3) == 4_lp
      if (.not. fit) then
         call file%reject('aabb must have the shape (steps, boxes, 4), from 1 to '//to_text(huge(1_ip) - 1_ip)// &
                          ' steps and boxes', error)
         return
      end if
      call check_size(file, 'is_wall', size(is_wall, kind=lp), extent(2), 'boxes', error)
      if (allocated(error)) return
      if (trace%n_steps == 0_ip) trace%n_steps = int(extent(1), ip)
      trace%n_steps = min(trace%n_steps, int(extent(1), ip))
      trace%fixed = is_wall /= 0_ip
      allocate (trace%bounds(4, extent(2), trace%n_steps), stat=status)
      if (status /= 0) then
         call file%reject('not enough memory for '//to_text(trace%n_steps)//' steps of '//to_text(extent(2))// &
                          ' boxes; replay fewer steps with --steps', error)
         return
      end if
      ! Several steps are read at once: in a compressed trace, one step costs as much as its whole chunk.
      n_rows = int(max(1_lp, block_numbers/(4_lp*extent(2))), ip)
      do first = 1_ip, trace%n_steps, n_rows
         call file%read('/aabb', bounds, error, &
                        [int(first - 1_ip, lp), int(min(n_rows, trace%n_steps - first + 1_ip), lp)])
         if (allocated(error)) return
         do s = 1_ip, size(bounds, 3, kind=ip)
            trace%bounds(:, :, first + s - 1_ip) = real(bounds(:, :, s), wp)
         end do
      end do
      call check_boxes(file, trace, error)
   end subroutine read_boxes

   !> Check that a data set has one entry per box or per step.
   subroutine check_size(file, name, n, expected, what, error)
      type(hdf5_file_t), intent(in) :: file
      character(len=*), intent(in) :: name, what
      integer(lp), intent(in) :: n, expected
      type(error_t), allocatable, intent(inout) :: error

      if (allocated(error) .or. n == expected) return
      call file%reject(name//' has '//to_text(n)//' entries, but aabb has '//to_text(expected)//' '//what, error)
   end subroutine check_size

   !> Read the body of each box. Without this data set every box is a body. The boxes of a body must be all fixed or all
   !> free.
   subroutine read_bodies(file, trace, error)
      type(hdf5_file_t), intent(in) :: file
      type(trace_t), intent(inout) :: trace
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: k, n
      logical :: sound

      n = size(trace%fixed, kind=ip)
      if (.not. file%has('/body', error)) then
         trace%body = [(k, k=1_ip, n)]
         return
      end if
      call file%read('/body', trace%body, error)
      if (allocated(error)) return
      call check_size(file, 'body', size(trace%body, kind=lp), int(n, lp), 'boxes', error)
      if (allocated(error)) return
      sound = trace%body(1) == 1_ip
      do k = 2_ip, n
         if (.not. sound) exit
         sound = trace%body(k) == trace%body(k - 1_ip) .or. trace%body(k) == trace%body(k - 1_ip) + 1_ip
      end do
      if (.not. sound) then
         call file%reject('body must start with 1 and ascend without gaps', error)
         return
      end if
      do k = 2_ip, n
         if (trace%body(k) /= trace%body(k - 1_ip)) cycle
         if (trace%fixed(k) .eqv. trace%fixed(k - 1_ip)) cycle
         call file%reject('is_wall differs between the boxes of body '//to_text(trace%body(k)), error)
         return
      end do
   end subroutine read_bodies

   !> Read the greatest half sides at any angle, if present. The recorded bounds remain lower limits.
   subroutine read_reach(file, trace, error)
      type(hdf5_file_t), intent(in) :: file
      type(trace_t), intent(inout) :: trace
      type(error_t), allocatable, intent(inout) :: error
      real(dp), allocatable :: reach(:)
      logical :: good

      if (.not. file%has('/reach', error)) return
      call file%read('/reach', reach, error)
      if (allocated(error)) return
      call check_size(file, 'reach', size(reach, kind=lp), size(trace%fixed, kind=lp), 'boxes', error)
      if (allocated(error)) return
      good = all(ieee_is_finite(reach))
      ! The comparison is in the working precision, because `far` may not be representable in double precision.
      if (good) good = all(reach >= 0.0_dp .and. real(reach, wp) <= far)
      if (.not. good) then
         call file%reject('every entry of reach must be from 0 to '//to_text(far), error)
         return
      end if
      trace%reach = max(trace%reach, real(reach, wp))
   end subroutine read_reach

   !> Check that all bounds are finite and ordered. Set the reach to the greatest recorded half side.
   subroutine check_boxes(file, trace, error)
      type(hdf5_file_t), intent(in) :: file
      type(trace_t), intent(inout) :: trace
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: box(4)
      integer(ip) :: s, b
      logical :: sound

      allocate (trace%reach(size(trace%fixed)), source=0.0_wp)
      do s = 1_ip, trace%n_steps
         do b = 1_ip, size(trace%fixed, kind=ip)
            box = trace%bounds(:, b, s)
            sound = all(ieee_is_finite(box))
            if (sound) sound = all(abs(box) <= far) .and. all(box(1:2) <= box(3:4))
            if (.not. sound) then
               call file%reject('aabb of step '//to_text(s - 1_ip)//', box '//to_text(b - 1_ip)// &
                                ': bounds must be finite and at most '//to_text(far)// &
                                ' in magnitude, with xmin <= xmax and ymin <= ymax', error)
               return
            end if
            trace%reach(b) = max(trace%reach(b), maxval(0.5_wp*box(3:4) - 0.5_wp*box(1:2)))
         end do
      end do
   end subroutine check_boxes

   !> Read the numbers of pairs and their hashes, if present.
   subroutine read_numbers(file, trace, error)
      type(hdf5_file_t), intent(in) :: file
      type(trace_t), intent(inout) :: trace
      type(error_t), allocatable, intent(inout) :: error
      integer(lp), allocatable :: extent(:)

      call file%shape_of('/aabb', extent, error)
      if (allocated(error)) return
      if (file%has('/npairs', error)) then
         call file%read('/npairs', trace%n_pairs, error)
         if (allocated(error)) return
         call check_size(file, 'npairs', size(trace%n_pairs, kind=lp), extent(1), 'steps', error)
      end if
      if (file%has('/pair_hash', error)) then
         call file%read('/pair_hash', trace%pair_hash, error)
         if (allocated(error)) return
         call check_size(file, 'pair_hash', size(trace%pair_hash, kind=lp), extent(1), 'steps', error)
      end if
   end subroutine read_numbers

   !> Read the polygons, if present. Half their diameter is an upper bound of the recorded half sides.
   subroutine read_polygons(file, trace, error)
      type(hdf5_file_t), intent(in) :: file
      type(trace_t), intent(inout) :: trace
      type(error_t), allocatable, intent(inout) :: error
      real(dp), allocatable :: vertices(:, :)
      integer(ip), allocatable :: offset(:)
      integer(ip) :: b, n

      if (.not. file%has('/vertices', error)) return
      call file%read('/vertices', vertices, error)
      call file%read('/vertex_offset', offset, error)
      if (.not. allocated(error)) call check_polygons(file, vertices, offset, size(trace%fixed, kind=ip), error)
      if (allocated(error)) return
      n = size(trace%fixed, kind=ip)
      do b = 1_ip, n
         trace%reach(b) = max(trace%reach(b), &
                              0.5_wp*diameter(real(vertices(:, offset(b) + 1_ip:offset(b + 1_ip)), wp)))
      end do
   end subroutine read_polygons

   !> Check the shape and the values of `vertices` and `vertex_offset`.
   subroutine check_polygons(file, vertices, offset, n_boxes, error)
      type(hdf5_file_t), intent(in) :: file
      real(dp), intent(in) :: vertices(:, :)
      integer(ip), intent(in) :: offset(:), n_boxes
      type(error_t), allocatable, intent(inout) :: error
      logical :: fit

      if (size(vertices, 1) /= 2) then
         call file%reject('vertices must have the shape (n, 2)', error)
         return
      end if
      fit = all(ieee_is_finite(vertices))
      if (fit) fit = all(abs(real(vertices, wp)) <= far)
      if (.not. fit) then
         call file%reject('vertices must be finite and at most '//to_text(far)//' in magnitude', error)
         return
      end if
      fit = size(offset) == n_boxes + 1_ip
      if (fit) fit = offset(1) == 0_ip .and. offset(n_boxes + 1_ip) == size(vertices, 2) .and. &
                     all(offset(2:) >= offset(:n_boxes))
      if (.not. fit) call file%reject('vertex_offset must ascend from 0 to the number of vertices and have one '// &
                                      'entry more than there are boxes', error)
   end subroutine check_polygons

end module polydem_trace_reader
