!> Recorded boxes, read from a file and checked.
!>
!> A trace holds `aabb` (steps, boxes, 4), the bounds of every box at every step; `is_wall` (boxes), not zero
!> for fixed ones; and may hold `npairs` (steps), the exact number of pairs, and the polygons `vertices` (n, 2)
!> and `vertex_offset` (boxes + 1), from which the greatest extent of a box at any angle is known. Steps and
!> boxes count from 0, as in the file.
module polydem_trace
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use polydem_errors, only: error_t, input_error, raise
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_polygon, only: diameter
   use polydem_strings, only: to_text
   implicit none
   private
   public :: trace_t, read_trace

   !> Recorded boxes
   type :: trace_t
      !> Number of steps
      integer(ip) :: n_steps = 0_ip
      !> Bounds, (4, box, step) [m]
      real(wp), allocatable :: bounds(:, :, :)
      !> Whether each box is fixed
      logical, allocatable :: fixed(:)
      !> Greatest half side of each box at any angle [m]
      real(wp), allocatable :: reach(:)
      !> Number of pairs of each step; not allocated if the trace has none
      integer(ip), allocatable :: n_pairs(:)
   end type trace_t

contains

   !> Read a trace and check that it holds boxes and that its parts fit together.
   subroutine read_trace(path, trace, error)
      !> HDF5 file
      character(len=*), intent(in) :: path
      !> What it holds
      type(trace_t), intent(out) :: trace
      !> Allocated if the file cannot be read or is no trace
      type(error_t), allocatable, intent(inout) :: error
      type(hdf5_file_t) :: file
      type(error_t), allocatable :: ignored

      call file%open(path, error)
      if (allocated(error)) return
      call read_boxes(path, file, trace, error)
      if (.not. allocated(error)) call read_numbers(path, file, trace, error)
      if (.not. allocated(error)) call read_polygons(path, file, trace, error)
      if (allocated(error)) then
         call file%close(ignored)
      else
         call file%close(error)
      end if
   end subroutine read_trace

   !> Read the bounds of all boxes, and which are fixed; until polygons say more, reach is the greatest half side.
   subroutine read_boxes(path, file, trace, error)
      character(len=*), intent(in) :: path
      type(hdf5_file_t), intent(in) :: file
      type(trace_t), intent(inout) :: trace
      type(error_t), allocatable, intent(inout) :: error
      real(dp), allocatable :: bounds(:, :, :)
      integer(lp), allocatable :: extent(:)
      integer(ip), allocatable :: is_wall(:)
      logical :: fit

      call file%shape_of('/aabb', extent, error)
      if (.not. allocated(error)) call file%read('/is_wall', is_wall, error)
      if (allocated(error)) return
      fit = size(extent) == 3
      if (fit) fit = minval(extent) >= 1_lp .and. extent(3) == 4_lp
      if (.not. fit) then
         call raise(error, input_error, path//': aabb must have the shape (steps, boxes, 4), with at least one '// &
                    'step and one box')
      else if (size(is_wall, kind=lp) /= extent(2)) then
         call raise(error, input_error, path//': is_wall has '//to_text(size(is_wall, kind=ip))// &
                    ' entries, but aabb '//to_text(extent(2))//' boxes')
      end if
      if (allocated(error)) return
      trace%n_steps = int(extent(1), ip)
      trace%fixed = is_wall /= 0_ip
      ! All steps at once: in a compressed trace one step alone costs as much as all of its chunk.
      call file%read('/aabb', bounds, error)
      if (allocated(error)) return
      trace%bounds = real(bounds, wp)
      call check_boxes(path, trace, error)
   end subroutine read_boxes

   !> Insist on finite bounds, the lower ones not above the upper ones, and keep the greatest half sides.
   subroutine check_boxes(path, trace, error)
      character(len=*), intent(in) :: path
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
            if (sound) sound = all(box(1:2) <= box(3:4))
            if (.not. sound) then
               call raise(error, input_error, path//': aabb of step '//to_text(s - 1_ip)//', box '// &
                          to_text(b - 1_ip)//': bounds must be finite numbers, xmin <= xmax and ymin <= ymax')
               return
            end if
            trace%reach(b) = max(trace%reach(b), maxval(0.5_wp*box(3:4) - 0.5_wp*box(1:2)))
         end do
      end do
   end subroutine check_boxes

   !> Read the numbers of pairs, if there are any.
   subroutine read_numbers(path, file, trace, error)
      character(len=*), intent(in) :: path
      type(hdf5_file_t), intent(in) :: file
      type(trace_t), intent(inout) :: trace
      type(error_t), allocatable, intent(inout) :: error

      if (.not. file%has('/npairs')) return
      call file%read('/npairs', trace%n_pairs, error)
      if (allocated(error)) return
      if (size(trace%n_pairs) == trace%n_steps) return
      call raise(error, input_error, path//': npairs has '//to_text(size(trace%n_pairs, kind=ip))// &
                 ' entries, but aabb '//to_text(trace%n_steps)//' steps')
   end subroutine read_numbers

   !> Read the polygons, if there are any: their diameters are greater than the boxes that were seen.
   subroutine read_polygons(path, file, trace, error)
      character(len=*), intent(in) :: path
      type(hdf5_file_t), intent(in) :: file
      type(trace_t), intent(inout) :: trace
      type(error_t), allocatable, intent(inout) :: error
      real(dp), allocatable :: vertices(:, :)
      integer(ip), allocatable :: offset(:)
      integer(ip) :: b, n

      if (.not. file%has('/vertices')) return
      call file%read('/vertices', vertices, error)
      if (.not. allocated(error)) call file%read('/vertex_offset', offset, error)
      if (.not. allocated(error)) call check_polygons(path, vertices, offset, size(trace%fixed, kind=ip), error)
      if (allocated(error)) return
      n = size(trace%fixed, kind=ip)
      do b = 1_ip, n
         trace%reach(b) = max(trace%reach(b), &
                              0.5_wp*diameter(real(vertices(:, offset(b) + 1_ip:offset(b + 1_ip)), wp)))
      end do
   end subroutine read_polygons

   subroutine check_polygons(path, vertices, offset, n_boxes, error)
      character(len=*), intent(in) :: path
      real(dp), intent(in) :: vertices(:, :)
      integer(ip), intent(in) :: offset(:), n_boxes
      type(error_t), allocatable, intent(inout) :: error
      logical :: fit

      if (size(vertices, 1) /= 2) then
         call raise(error, input_error, path//': vertices must have the shape (n, 2)')
      else if (.not. all(ieee_is_finite(real(vertices, wp)))) then
         call raise(error, input_error, path//': vertices must be finite numbers')
      end if
      if (allocated(error)) return
      fit = size(offset) == n_boxes + 1_ip
      if (fit) fit = offset(1) == 0_ip .and. offset(n_boxes + 1_ip) == size(vertices, 2) .and. &
                     all(offset(2:) >= offset(:n_boxes))
      if (.not. fit) call raise(error, input_error, path//': vertex_offset must ascend from 0 to the number of '// &
                                'vertices and have one entry more than there are boxes')
   end subroutine check_polygons

end module polydem_trace
