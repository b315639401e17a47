!> One sample of a replay: a trace, from an empty list through one finder.
!>
!> What is timed begins with the boxes of a step in memory and ends with the complete list. A pass is either
!> checked, step by step with the hash of the whole list, and counted; or it is left alone with the clock, and only
!> the numbers of pairs and the last list are compared.
module polydem_replay_sample
   use polydem_boxes, only: boxes_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: dp, ip, lp, worth_threads
   use polydem_machine, only: load_average, utc_now
   use polydem_neighbours, only: neighbours_t, new_neighbours
   use polydem_reference, only: check_list, check_number, reference_t
   use polydem_sample_file, only: sample_t
   use polydem_step_clock, only: step_clock_t
   use polydem_trace, only: trace_t
   use polydem_work, only: n_counts, n_phases
   use polydem_work_meter, only: work_meter_t
   implicit none
   private
   public :: replay_sample, reserve_sample

contains

   !> Replay a trace once.
   subroutine replay_sample(trace, boxes, checked, reference, sample, error)
      !> Recorded boxes
      type(trace_t), intent(in) :: trace
      !> Boxes of the trace, at any step before and at the last one after
      type(boxes_t), intent(inout) :: boxes
      !> Whether every list is compared and work is counted
      logical, intent(in) :: checked
      !> Expected lists; learns what it did not know in a checked pass
      type(reference_t), intent(inout) :: reference
      !> Its case says which finder; the rest is measured
      type(sample_t), intent(inout) :: sample
      !> Allocated if there is no such finder or a list is wrong
      type(error_t), allocatable, intent(inout) :: error
      type(neighbours_t) :: neighbours
      type(work_meter_t) :: meter
      type(step_clock_t) :: clock
      integer(ip) :: s

      sample%time_utc = utc_now()
      sample%load = load_average()
      call new_neighbours(neighbours, sample%case%finder, boxes, error)
      if (allocated(error)) return
      neighbours%finder%work%thorough = checked
      call reserve_sample(trace%n_steps, checked, sample)
      call clock%calibrate()
      sample%clock_cost = clock%processor_cost
      do s = 1_ip, trace%n_steps
         call place_boxes(trace, s, boxes)
         call clock%start()
         call neighbours%update(boxes)
         call clock%stop(sample%elapsed(s), sample%processor(s))
         sample%pairs(s) = neighbours%pairs%n
         if (checked) then
            call meter%look(neighbours%finder, sample%phase(:, s), sample%count(:, s))
            call check_list(reference, s, sample%case%finder, neighbours%pairs, error, sample%hash(s))
         else
            call meter%look_at_seconds(neighbours%finder, sample%phase(:, s))
            call check_number(reference, s, sample%case%finder, neighbours%pairs, error)
         end if
         if (allocated(error)) return
      end do
      if (.not. checked) call check_list(reference, trace%n_steps, sample%case%finder, neighbours%pairs, error)
   end subroutine replay_sample

   !> Copy the boxes of a step, each thread its part: so they lie near the processors as they do when a run makes them.
   subroutine place_boxes(trace, s, boxes)
      type(trace_t), intent(in) :: trace
      integer(ip), intent(in) :: s
      type(boxes_t), intent(inout) :: boxes
      integer(ip) :: b

      !$omp parallel do if (boxes%n > worth_threads) schedule(static) default(none) shared(trace, boxes, s) private(b)
      do b = 1_ip, boxes%n
         boxes%bounds(:, b) = trace%bounds(:, b, s)
      end do
      !$omp end parallel do
   end subroutine place_boxes

   !> Make room for the measurements.
   subroutine reserve_sample(n_steps, checked, sample)
      !> Number of steps
      integer(ip), intent(in) :: n_steps
      !> Whether lists are hashed and work is counted
      logical, intent(in) :: checked
      !> Sample
      type(sample_t), intent(inout) :: sample

      allocate (sample%elapsed(n_steps), sample%processor(n_steps), source=0.0_dp)
      allocate (sample%pairs(n_steps), source=0_ip)
      allocate (sample%phase(n_phases, n_steps), source=0.0_dp)
      if (.not. checked) return
      allocate (sample%hash(n_steps), source=0_lp)
      allocate (sample%count(n_counts, n_steps), source=0_lp)
   end subroutine reserve_sample

end module polydem_replay_sample
