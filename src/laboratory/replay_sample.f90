!> One sample of a replay: one pass of a trace through one finder, from an empty list of pairs.
!>
!> A timed section begins with the boxes of a step in memory and ends with the complete list of pairs. A checked pass
!> hashes the whole list of every step and collects finder statistics. A pass that is not checked compares only the
!> numbers of pairs and the last list, so the checks do not disturb its timings.
module polydem_replay_sample
   use polydem_boxes, only: boxes_t
   use polydem_choose_instruction_set, only: choose_instruction_set
   use polydem_errors, only: error_t
   use polydem_finder, only: finder_t
   use polydem_finder_meter, only: finder_meter_t
   use polydem_finder_statistics, only: n_counts, n_phases
   use polydem_finder_variants, only: new_finder_or_variant
   use polydem_host, only: load_average, utc_now
   use polydem_kinds, only: dp, ip, lp, min_parallel_size
   use polydem_neighbours, only: neighbours_t, start_neighbours
   use polydem_reference, only: check_list, reference_t
   use polydem_sample_file, only: sample_t
   use polydem_step_clock, only: step_clock_t
   use polydem_trace_reader, only: trace_t
   implicit none
   private
   public :: replay_sample, begin_sample, check_step, first_boxes

contains

   !> Replay a trace once.
   subroutine replay_sample(trace, boxes, checked, reference, sample, error)
      type(trace_t), intent(in) :: trace
      !> Boxes of the trace: on entry of any step, on return of the last one
      type(boxes_t), intent(inout) :: boxes
      !> Whether to check every list and to collect finder statistics
      logical, intent(in) :: checked
      !> Reference lists; a checked pass adds missing ones
      type(reference_t), intent(inout) :: reference
      !> The sample; its case sets the finder
      type(sample_t), intent(inout) :: sample
      !> Allocated if the finder is unknown or a list is wrong
      type(error_t), allocatable, intent(inout) :: error
      class(finder_t), allocatable :: finder
      type(neighbours_t) :: neighbours
      type(finder_meter_t) :: meter
      type(step_clock_t) :: clock
      integer(ip) :: s

      call new_finder_or_variant(finder, sample%case%finder, error)
      if (allocated(error)) return
      call choose_instruction_set(finder%isa, error)
      if (allocated(error)) return
      call start_neighbours(neighbours, finder, boxes)
      neighbours%finder%work%thorough = checked
      call begin_sample(trace%n_steps, checked, clock, sample)
      do s = 1_ip, trace%n_steps
         call place_boxes(trace, s, boxes)
         call clock%start()
         call neighbours%update(boxes)
         call clock%stop(sample%elapsed(s), sample%processor(s))
         call check_step(neighbours, s, checked, meter, reference, sample, error)
         if (allocated(error)) return
      end do
      if (.not. checked) call check_list(reference, trace%n_steps, sample%case%finder, neighbours%pairs, error)
   end subroutine replay_sample

   !> Copy the boxes of a step with all threads. Each thread copies its part, so the boxes lie near the same
   !> processors as in a run.
   subroutine place_boxes(trace, s, boxes)
      type(trace_t), intent(in) :: trace
      integer(ip), intent(in) :: s
      type(boxes_t), intent(inout) :: boxes
      integer(ip) :: b

      !$omp parallel do if (boxes%n > min_parallel_size) schedule(static) default(none) shared(trace, boxes, s) &
      !$omp    private(b)
      do b = 1_ip, boxes%n
         boxes%bounds(:, b) = trace%bounds(:, b, s)
      end do
      !$omp end parallel do
   end subroutine place_boxes

   !> Record the finder statistics of a step, and check its list of pairs.
   subroutine check_step(neighbours, s, checked, meter, reference, sample, error)
      type(neighbours_t), intent(inout) :: neighbours
      !> Number of the step, from 1
      integer(ip), intent(in) :: s
      !> Whether to compare the hash of the list and to record counts
      logical, intent(in) :: checked
      !> Statistics of the finder up to the previous step
      type(finder_meter_t), intent(inout) :: meter
      type(reference_t), intent(inout) :: reference
      type(sample_t), intent(inout) :: sample
      !> Allocated if the list is wrong
      type(error_t), allocatable, intent(inout) :: error

      sample%pairs(s) = neighbours%pairs%n
      if (checked) then
         call meter%read_all(neighbours%finder, sample%phase(:, s), sample%count(:, s))
         call check_list(reference, s, sample%case%finder, neighbours%pairs, error, sample%hash(s))
      else
         call meter%read_seconds(neighbours%finder, sample%phase(:, s))
         call check_list(reference, s, sample%case%finder, neighbours%pairs, error, only_number=.true.)
      end if
   end subroutine check_step

   !> Record the state of the machine, allocate the arrays of a sample, and calibrate its clock.
   subroutine begin_sample(n_steps, checked, clock, sample)
      !> Number of steps
      integer(ip), intent(in) :: n_steps
      !> Whether the sample has hashes and finder statistics
      logical, intent(in) :: checked
      type(step_clock_t), intent(inout) :: clock
      type(sample_t), intent(inout) :: sample

      sample%time_utc = utc_now()
      sample%load = load_average()
      call clock%calibrate()
      sample%clock_cost = clock%processor_cost
      allocate (sample%elapsed(n_steps), sample%processor(n_steps), source=0.0_dp)
      allocate (sample%pairs(n_steps), source=0_ip)
      allocate (sample%phase(n_phases, n_steps), source=0.0_dp)
      if (.not. checked) return
      allocate (sample%hash(n_steps), source=0_lp)
      allocate (sample%count(n_counts, n_steps), source=0_lp)
   end subroutine begin_sample

   !> Boxes of the first step of a trace
   subroutine first_boxes(trace, boxes)
      type(trace_t), intent(in) :: trace
      type(boxes_t), intent(out) :: boxes

      boxes%n = size(trace%fixed, kind=ip)
      boxes%n_pieces = trace%body(boxes%n)
      boxes%one_to_one = boxes%n_pieces == boxes%n
      boxes%piece = trace%body
      boxes%body = trace%body
      boxes%fixed = trace%fixed
      boxes%passive = trace%fixed
      boxes%reach = trace%reach
      boxes%bounds = trace%bounds(:, :, 1)
   end subroutine first_boxes

end module polydem_replay_sample
