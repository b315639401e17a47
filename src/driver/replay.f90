!> Replay of recorded boxes through a neighbour finder: every step is checked and timed.
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
   use polydem_errors, only: error_t, raise, run_error
   use polydem_hash, only: add_modulo, hexadecimal, pair_hash
   use polydem_kinds, only: dp, ip, lp
   use polydem_neighbours, only: neighbours_t, new_neighbours
   use polydem_strings, only: to_text
   use polydem_trace, only: read_trace, trace_t
   implicit none
   private
   public :: replay_trace

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
