!> Replay of recorded boxes through a neighbour finder: every step is checked and timed.
!>
!> A trace holds `aabb` (steps, boxes, 4), the bounds of every box at every step; `is_wall` (boxes), not zero
!> for fixed ones; and may hold `npairs` (steps), the exact number of pairs, and the polygons `vertices` and
!> `vertex_offset` (boxes + 1), from which the greatest extent of a box at any angle is known.
!>
!> What is timed begins with the boxes of a step in memory and ends with the complete list; ordering the
!> changes is timed by itself. Per step the shortest of all repeats counts, then the mean over the steps,
!> divided by the number of boxes, fixed ones included. One thread: its processor time; more: elapsed time.
module polydem_replay
   use, intrinsic :: iso_fortran_env, only: output_unit
   use omp_lib, only: omp_set_num_threads
   use polydem_boxes, only: boxes_t
   use polydem_clock, only: thread_cpu_seconds, wall_seconds
   use polydem_counters, only: counters_t
   use polydem_errors, only: error_t, input_error, raise, run_error
   use polydem_hash, only: add_modulo, hexadecimal, pair_hash
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_neighbours, only: neighbours_t, new_neighbours
   use polydem_strings, only: to_text
   implicit none
   private
   public :: replay_trace

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

   !> What a replay measures and sums up
   type :: record_t
      !> Shortest time of each step to find and merge the changes [s]
      real(dp), allocatable :: list_seconds(:)
      !> Shortest time of each step to order the changes [s]
      real(dp), allocatable :: order_seconds(:)
      !> Pairs of all steps
      integer(lp) :: pairs_total = 0_lp
      !> Sum of the hashes of all pairs of all steps
      integer(lp) :: hash = 0_lp
   end type record_t

contains

   !> Replay a trace, print what was measured as key=value lines, fail at the first wrong step.
   subroutine replay_trace(path, finder, threads, repeats, error)
      !> HDF5 file
      character(len=*), intent(in) :: path
      !> Name of the neighbour finder
      character(len=*), intent(in) :: finder
      !> Number of threads
      integer(ip), intent(in) :: threads
      !> How often the whole trace is replayed, each time from an empty list
      integer(ip), intent(in) :: repeats
      !> Allocated if the file cannot be read, the finder is unknown or a step is wrong
      type(error_t), allocatable, intent(inout) :: error
      type(trace_t) :: trace
      type(boxes_t) :: boxes
      type(neighbours_t) :: neighbours, oracle
      type(record_t) :: record
      integer(ip) :: k

      call omp_set_num_threads(int(threads))
      call read_trace(path, trace, error)
      if (allocated(error)) return
      call first_boxes(trace, boxes)
      allocate (record%list_seconds(trace%n_steps), record%order_seconds(trace%n_steps), source=huge(1.0_dp))
      do k = 1_ip, repeats
         call new_neighbours(neighbours, finder, boxes, error)
         if (.not. allocated(trace%n_pairs)) call new_neighbours(oracle, 'all_pairs', boxes, error)
         if (allocated(error)) return
         call replay_once(trace, threads == 1_ip, k == 1_ip, boxes, neighbours, oracle, record, error)
         if (allocated(error)) return
      end do
      call print_record(path, finder, threads, repeats, trace, boxes, neighbours, record)
   end subroutine replay_trace

   !> Replay all steps once.
   subroutine replay_once(trace, one_thread, first_repeat, boxes, neighbours, oracle, record, error)
      type(trace_t), intent(in) :: trace
      logical, intent(in) :: one_thread, first_repeat
      type(boxes_t), intent(inout) :: boxes
      type(neighbours_t), intent(inout) :: neighbours
      !> Finder to check against if the trace has no numbers of pairs; used in the first repeat
      type(neighbours_t), intent(inout) :: oracle
      type(record_t), intent(inout) :: record
      type(error_t), allocatable, intent(inout) :: error
      real(dp) :: began, found, ordered, merged
      integer(ip) :: s, k

      do s = 1_ip, trace%n_steps
         boxes%bounds = trace%bounds(:, :, s)
         began = seconds(one_thread)
         call neighbours%find(boxes)
         found = seconds(one_thread)
         call neighbours%order()
         ordered = seconds(one_thread)
         call neighbours%merge()
         merged = seconds(one_thread)
         record%list_seconds(s) = min(record%list_seconds(s), (found - began) + (merged - ordered))
         record%order_seconds(s) = min(record%order_seconds(s), ordered - found)
         if (allocated(trace%n_pairs)) then
            call check_number(s, neighbours, trace%n_pairs(s), error)
         else if (first_repeat) then
            call oracle%update(boxes)
            call check_list(s, neighbours, oracle, error)
         end if
         if (allocated(error)) return
         if (.not. first_repeat) cycle
         record%pairs_total = record%pairs_total + int(neighbours%pairs%n, lp)
         do k = 1_ip, neighbours%pairs%n
            record%hash = add_modulo(record%hash, pair_hash(neighbours%pairs%first(k) - 1_ip, &
                                                            neighbours%pairs%second(k) - 1_ip))
         end do
      end do
   end subroutine replay_once

   real(dp) function seconds(one_thread)
      logical, intent(in) :: one_thread

      if (one_thread) then
         seconds = thread_cpu_seconds()
      else
         seconds = wall_seconds()
      end if
   end function seconds

   !> Compare the number of pairs with the recorded one.
   subroutine check_number(step, neighbours, expected, error)
      integer(ip), intent(in) :: step, expected
      type(neighbours_t), intent(in) :: neighbours
      type(error_t), allocatable, intent(inout) :: error

      if (neighbours%pairs%n == expected .and. neighbours%pairs%contradictions == 0_lp) return
      call raise(error, run_error, 'step '//to_text(step - 1_ip)//': '//neighbours%name//' found '// &
                 to_text(neighbours%pairs%n)//' pairs, the trace says '//to_text(expected))
   end subroutine check_number

   !> Compare the list of pairs with that of the oracle.
   subroutine check_list(step, neighbours, oracle, error)
      integer(ip), intent(in) :: step
      type(neighbours_t), intent(in) :: neighbours, oracle
      type(error_t), allocatable, intent(inout) :: error
      logical :: same
      integer(ip) :: n

      n = oracle%pairs%n
      same = neighbours%pairs%n == n .and. neighbours%pairs%contradictions == 0_lp
      if (same) same = all(neighbours%pairs%first(1:n) == oracle%pairs%first(1:n)) .and. &
                       all(neighbours%pairs%second(1:n) == oracle%pairs%second(1:n))
      if (same) return
      call raise(error, run_error, 'step '//to_text(step - 1_ip)//': '//neighbours%name//' found '// &
                 to_text(neighbours%pairs%n)//' pairs, all_pairs '//to_text(n)//', and not the same ones')
   end subroutine check_list

   !> Read a trace and check that its parts fit together.
   subroutine read_trace(path, trace, error)
      character(len=*), intent(in) :: path
      type(trace_t), intent(out) :: trace
      type(error_t), allocatable, intent(inout) :: error
      type(hdf5_file_t) :: file
      real(dp), allocatable :: bounds(:, :, :)
      integer(lp), allocatable :: extent(:)
      integer(ip), allocatable :: is_wall(:)

      call file%open(path, error)
      if (allocated(error)) return
      call file%shape_of('/aabb', extent, error)
      if (.not. allocated(error)) call file%read('/is_wall', is_wall, error)
      if (.not. allocated(error)) call check_shapes(path, extent, size(is_wall, kind=lp), error)
      if (allocated(error)) return
      trace%n_steps = int(extent(1), ip)
      trace%fixed = is_wall /= 0_ip
      ! All steps at once: in a compressed trace one step alone costs as much as all of its chunk.
      call file%read('/aabb', bounds, error)
      if (allocated(error)) return
      trace%bounds = real(bounds, wp)
      if (file%has('/npairs')) call file%read('/npairs', trace%n_pairs, error)
      if (allocated(error)) return
      if (allocated(trace%n_pairs)) then
         if (size(trace%n_pairs) /= trace%n_steps) call raise(error, input_error, &
                                               path//': npairs must have one entry per step of aabb')
      end if
      if (.not. allocated(error)) call read_reach(path, file, trace, error)
      if (.not. allocated(error)) call file%close(error)
   end subroutine read_trace

   subroutine check_shapes(path, extent, n_walls, error)
      character(len=*), intent(in) :: path
      integer(lp), intent(in) :: extent(:), n_walls
      type(error_t), allocatable, intent(inout) :: error

      if (size(extent) == 3) then
         if (extent(1) >= 1_lp .and. extent(2) == n_walls .and. extent(3) == 4_lp) return
      end if
      call raise(error, input_error, &
                 path//': aabb must have the shape (steps, boxes, 4) and is_wall one entry per box')
   end subroutine check_shapes

   !> Greatest half sides, from the polygons if there are any, else from the boxes.
   subroutine read_reach(path, file, trace, error)
      character(len=*), intent(in) :: path
      type(hdf5_file_t), intent(in) :: file
      type(trace_t), intent(inout) :: trace
      type(error_t), allocatable, intent(inout) :: error
      real(dp), allocatable :: vertices(:, :)
      integer(ip), allocatable :: offset(:)
      integer(ip) :: b, n

      n = size(trace%fixed, kind=ip)
      allocate (trace%reach(n))
      do b = 1_ip, n
         trace%reach(b) = 0.5_wp*max(maxval(trace%bounds(3, b, :) - trace%bounds(1, b, :)), &
                                     maxval(trace%bounds(4, b, :) - trace%bounds(2, b, :)))
      end do
      if (.not. file%has('/vertices')) return
      call file%read('/vertices', vertices, error)
      if (.not. allocated(error)) call file%read('/vertex_offset', offset, error)
      if (allocated(error)) return
      if (size(offset) /= n + 1_ip .or. offset(1) /= 0_ip .or. &
          offset(size(offset)) /= size(vertices, 2) .or. any(offset(2:) < offset(:size(offset) - 1))) then
         call raise(error, input_error, path//': vertex_offset must ascend from 0 to the number of vertices '// &
                    'and have one entry more than there are boxes')
         return
      end if
      do b = 1_ip, n
         trace%reach(b) = max(trace%reach(b), &
                              0.5_wp*real(diameter(vertices(:, offset(b) + 1_ip:offset(b + 1_ip))), wp))
      end do
   end subroutine read_reach

   !> Greatest distance of two vertices [m]
   pure real(dp) function diameter(vertices)
      real(dp), intent(in) :: vertices(:, :)
      integer(ip) :: j, k

      diameter = 0.0_dp
      do k = 2_ip, size(vertices, 2, kind=ip)
         do j = 1_ip, k - 1_ip
            diameter = max(diameter, hypot(vertices(1, k) - vertices(1, j), vertices(2, k) - vertices(2, j)))
         end do
      end do
   end function diameter

   !> Boxes of the trace, at their first step; body k has box k.
   subroutine first_boxes(trace, boxes)
      type(trace_t), intent(in) :: trace
      type(boxes_t), intent(out) :: boxes
      integer(ip) :: k

      boxes%n = size(trace%fixed, kind=ip)
      boxes%n_bodies = boxes%n
      boxes%body = [(k, k=1_ip, boxes%n)]
      boxes%fixed = trace%fixed
      boxes%reach = trace%reach
      boxes%bounds = trace%bounds(:, :, 1)
   end subroutine first_boxes

   !> Print key=value lines.
   subroutine print_record(path, finder, threads, repeats, trace, boxes, neighbours, record)
      character(len=*), intent(in) :: path, finder
      integer(ip), intent(in) :: threads, repeats
      type(trace_t), intent(in) :: trace
      type(boxes_t), intent(in) :: boxes
      type(neighbours_t), intent(in) :: neighbours
      type(record_t), intent(in) :: record
      type(counters_t) :: counters
      integer(ip) :: n
      integer :: k

      n = trace%n_steps
      write (output_unit, '(2a)') 'trace=', path, 'finder=', finder
      write (output_unit, '(a,i0)') 'boxes=', boxes%n, 'walls=', count(boxes%fixed), 'steps=', n, &
         'threads=', threads, 'repeats=', repeats
      call print_time('ns_per_box_per_step=', record%list_seconds, boxes%n)
      call print_time('ns_per_box_per_step_after_first=', record%list_seconds(2:), boxes%n)
      call print_time('ns_ordering=', record%order_seconds, boxes%n)
      call print_time('ns_ordering_after_first=', record%order_seconds(2:), boxes%n)
      write (output_unit, '(a,i0)') 'pairs_total=', record%pairs_total
      write (output_unit, '(2a)') 'pair_hash=0x', hexadecimal(record%hash)
      if (allocated(trace%n_pairs)) write (output_unit, '(a)') 'checked_against=npairs'
      if (.not. allocated(trace%n_pairs)) write (output_unit, '(a)') 'checked_against=all_pairs'
      call neighbours%report(counters)
      do k = 1, size(counters%name)
         write (output_unit, '(2a,i0)') trim(counters%name(k)), '=', counters%value(k)
      end do
      write (output_unit, '(a)') 'result=ok'
   end subroutine print_record

   !> Print the mean time of a step per box in nanoseconds.
   subroutine print_time(key, step_seconds, n_boxes)
      character(len=*), intent(in) :: key
      real(dp), intent(in) :: step_seconds(:)
      integer(ip), intent(in) :: n_boxes
      character(len=24) :: number

      if (size(step_seconds) == 0) return
      write (number, '(f24.3)') 1.0e9_dp*sum(step_seconds)/real(size(step_seconds), dp)/real(n_boxes, dp)
      write (output_unit, '(2a)') key, trim(adjustl(number))
   end subroutine print_time

end module polydem_replay
