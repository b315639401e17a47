!> Replay of recorded boxes through a neighbour finder, with a check of every list and a timing of every step.
!>
!> The first pass is a warm-up that checks every list and collects finder statistics; timed passes follow. A timed
!> section begins with the boxes of a step in memory and ends with the complete list of pairs. The result is the
!> shortest time of all timed passes for each step, averaged over steps and divided by the number of boxes including
!> fixed ones. The time is processor time for one thread, and elapsed time for more threads.
module polydem_replay
   use omp_lib, only: omp_set_num_threads
   use polydem_boxes, only: boxes_t
   use polydem_errors, only: error_t
   use polydem_file_system, only: make_folder
   use polydem_finder_statistics, only: count_names, n_counts, n_phases, n_sums, phase_names
   use polydem_hash, only: hexadecimal, mix_word
   use polydem_kinds, only: dp, ip, lp
   use polydem_line_writer, only: line_writer_t
   use polydem_neighbours, only: neighbours_t
   use polydem_provenance, only: collect_provenance, provenance_t
   use polydem_reference, only: set_by_all_pairs, new_reference, reference_t, total_hash
   use polydem_replay_sample, only: replay_sample, first_boxes
   use polydem_sample_file, only: case_t, sample_t, write_sample
   use polydem_strings, only: printable, to_text
   use polydem_trace_reader, only: read_trace, trace_t
   implicit none
   private
   public :: replay_trace, describe_trace, set_by_trace, sample_path

contains

   !> Replay a trace and print the results as key=value lines. The first step with a wrong list is an error.
   subroutine replay_trace(path, finder, threads, repeats, error, steps, samples, oracle)
      !> Path of the trace (HDF5)
      character(len=*), intent(in) :: path
      !> Name of the neighbour finder
      character(len=*), intent(in) :: finder
      !> Number of threads
      integer(ip), intent(in) :: threads
      !> Number of timed passes over the whole trace, each from an empty list
      integer(ip), intent(in) :: repeats
      !> Allocated if the file cannot be read, the finder is unknown or a list is wrong
      type(error_t), allocatable, intent(inout) :: error
      !> Number of steps to replay from the first one; 0 or absent: all
      integer(ip), intent(in), optional :: steps
      !> Folder for one sample file per pass; empty or absent: no samples
      character(len=*), intent(in), optional :: samples
      !> Whether to check all lists against all_pairs even if the trace holds numbers of pairs; no if absent
      logical, intent(in), optional :: oracle
      type(trace_t) :: trace
      type(boxes_t) :: boxes
      type(reference_t) :: reference
      type(case_t) :: case
      type(sample_t) :: warm_up, best
      logical :: use_oracle

      call omp_set_num_threads(int(threads))
      call read_trace(path, trace, error, steps)
      if (allocated(error)) return
      call first_boxes(trace, boxes)
      call describe_trace(trace, boxes, case)
      case%scene = stem(path)
      case%trace = path
      case%finder = finder
      case%threads = threads
      call new_reference(reference, trace%n_steps)
      call set_by_trace(trace, reference)
      use_oracle = .not. allocated(trace%n_pairs)
      if (present(oracle)) use_oracle = use_oracle .or. oracle
      if (use_oracle) call expect_all_pairs(trace, boxes, reference, error)
      if (allocated(error)) return
      case%checked = 'npairs'
      if (use_oracle) case%checked = 'all_pairs '//to_text(trace%n_steps)//' steps'
      call replay_all(trace, boxes, repeats, case, reference, warm_up, best, error, samples)
      if (.not. allocated(error)) call print_record(repeats, warm_up, best, error)
   end subroutine replay_trace

   !> Run the warm-up and all timed passes.
   subroutine replay_all(trace, boxes, repeats, case, reference, warm_up, best, error, samples)
      type(trace_t), intent(in) :: trace
      type(boxes_t), intent(inout) :: boxes
      integer(ip), intent(in) :: repeats
      type(case_t), intent(inout) :: case
      type(reference_t), intent(inout) :: reference
      !> Sample of the warm-up, and the shortest times of each step in the timed passes
      type(sample_t), intent(out) :: warm_up, best
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in), optional :: samples
      integer(ip) :: k

      warm_up%case = case
      call replay_sample(trace, boxes, .true., reference, warm_up, error)
      if (allocated(error)) return
      case%pairs_total = sum(int(warm_up%pairs, lp))
      case%pair_hash = total_hash(warm_up%hash)
      warm_up%case = case
      call write_sample_file(warm_up, error, samples)
      do k = 1_ip, repeats
         case%repeat = k
         call replay_timed(trace, boxes, case, reference, best, error, samples)
         if (allocated(error)) return
      end do
   end subroutine replay_all

   !> Run one timed pass.
   subroutine replay_timed(trace, boxes, case, reference, best, error, samples)
      type(trace_t), intent(in) :: trace
      type(boxes_t), intent(inout) :: boxes
      type(case_t), intent(in) :: case
      type(reference_t), intent(inout) :: reference
      type(sample_t), intent(inout) :: best
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in), optional :: samples
      type(sample_t) :: sample

      sample%case = case
      call replay_sample(trace, boxes, .false., reference, sample, error)
      if (allocated(error)) return
      call write_sample_file(sample, error, samples)
      if (case%repeat > 1_ip) then
         sample%elapsed = min(sample%elapsed, best%elapsed)
         sample%processor = min(sample%processor, best%processor)
         sample%phase = min(sample%phase, best%phase)
      end if
      best = sample
   end subroutine replay_timed

   !> Write a sample to the folder, if there is one.
   subroutine write_sample_file(sample, error, folder)
      type(sample_t), intent(in) :: sample
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in), optional :: folder
      type(provenance_t) :: provenance

      if (.not. present(folder)) return
      if (folder == '') return
      call make_folder(folder, error)
      if (allocated(error)) return
      call collect_provenance(provenance, sample%case%trace, '', '', 0_ip)
      call write_sample(sample_path(folder, sample%case), sample, phase_names, count_names, provenance, error)
   end subroutine write_sample_file

   !> Path of a sample: FOLDER/SCENE-FINDER-THREADS-REPEAT.h5
   function sample_path(folder, case) result(path)
      !> Folder of the samples
      character(len=*), intent(in) :: folder
      !> Case of the sample
      type(case_t), intent(in) :: case
      character(len=:), allocatable :: path

      path = folder//'/'//case%scene//'-'//case%finder//'-'//to_text(case%threads)//'-'//to_text(case%repeat)//'.h5'
   end function sample_path

   !> Set the properties of a case that follow from its trace.
   subroutine describe_trace(trace, boxes, case)
      !> Recorded boxes
      type(trace_t), intent(in) :: trace
      !> Boxes of one step of the trace
      type(boxes_t), intent(in) :: boxes
      !> The case
      type(case_t), intent(inout) :: case
      integer(ip) :: b, k, s

      case%mode = 'replay'
      case%boxes = boxes%n
      case%fixed = count(boxes%fixed, kind=ip)
      case%bodies = boxes%n_bodies
      case%steps = trace%n_steps
      case%dt = trace%dt
      case%input = trace%input
      case%identity = 0_lp
      do s = 1_ip, trace%n_steps
         do b = 1_ip, boxes%n
            do k = 1_ip, 4_ip
               case%identity = mix_word(case%identity, transfer(real(trace%bounds(k, b, s), dp), 0_lp))
            end do
         end do
      end do
   end subroutine describe_trace

   !> Set the reference lists from the numbers and hashes of pairs in the trace.
   subroutine set_by_trace(trace, reference)
      !> Recorded boxes
      type(trace_t), intent(in) :: trace
      type(reference_t), intent(inout) :: reference

      reference%other = 'the trace'
      if (allocated(trace%n_pairs)) then
         reference%pairs = trace%n_pairs(:trace%n_steps)
         reference%has_number = .true.
      end if
      if (allocated(trace%pair_hash)) then
         reference%hash = trace%pair_hash(:trace%n_steps)
         reference%has_hash = .true.
      end if
   end subroutine set_by_trace

   !> Set all reference lists from the finder all_pairs.
   subroutine expect_all_pairs(trace, boxes, reference, error)
      type(trace_t), intent(in) :: trace
      type(boxes_t), intent(inout) :: boxes
      type(reference_t), intent(inout) :: reference
      type(error_t), allocatable, intent(inout) :: error
      type(neighbours_t) :: oracle
      integer(ip) :: s

      do s = 1_ip, trace%n_steps
         boxes%bounds = trace%bounds(:, :, s)
         call set_by_all_pairs(reference, s, boxes, oracle, error)
         if (allocated(error)) return
      end do
   end subroutine expect_all_pairs

   !> Print the results as key=value lines.
   subroutine print_record(repeats, warm_up, best, error)
      integer(ip), intent(in) :: repeats
      type(sample_t), intent(in) :: warm_up, best
      type(error_t), allocatable, intent(inout) :: error
      type(line_writer_t) :: screen
      integer(lp) :: total(n_counts)
      integer :: k

      call screen%open_screen()
      associate (case => warm_up%case)
         call screen%put_line('trace='//printable(case%trace))
         call screen%put_line('finder='//case%finder)
         call screen%put_line('boxes='//to_text(case%boxes))
         call screen%put_line('walls='//to_text(case%fixed))
         call screen%put_line('bodies='//to_text(case%bodies))
         call screen%put_line('steps='//to_text(case%steps))
         call screen%put_line('threads='//to_text(case%threads))
         call screen%put_line('repeats='//to_text(repeats))
         if (case%threads == 1_ip) call print_times(screen, best%processor, case%boxes)
         if (case%threads > 1_ip) call print_times(screen, best%elapsed, case%boxes)
         do k = 1, n_phases
            call print_time(screen, 'ns_'//trim(phase_names(k))//'_after_first=', best%phase(k, 2:), case%boxes)
         end do
         call screen%put_line('pairs_total='//to_text(case%pairs_total))
         call screen%put_line('pair_hash=0x'//hexadecimal(case%pair_hash))
         call screen%put_line('checked_against='//case%checked(:index(case%checked//' ', ' ') - 1))
      end associate
      total = sum(warm_up%count, dim=2)
      total(n_sums + 1:) = warm_up%count(n_sums + 1:, size(warm_up%count, 2))
      do k = 1, n_counts
         if (total(k) /= 0_lp) call screen%put_line(trim(count_names(k))//'='//to_text(total(k)))
      end do
      call screen%put_line('result=ok')
      call screen%close(error)
   end subroutine print_record

   !> Print the mean time per box and step [ns] over all steps, and without the first one.
   subroutine print_times(screen, step_seconds, n_boxes)
      type(line_writer_t), intent(inout) :: screen
      real(dp), intent(in) :: step_seconds(:)
      integer(ip), intent(in) :: n_boxes

      call print_time(screen, 'ns_per_box_per_step=', step_seconds, n_boxes)
      call print_time(screen, 'ns_per_box_per_step_after_first=', step_seconds(2:), n_boxes)
   end subroutine print_times

   !> Print the mean time per box and step [ns].
   subroutine print_time(screen, key, step_seconds, n_boxes)
      type(line_writer_t), intent(inout) :: screen
      character(len=*), intent(in) :: key
      real(dp), intent(in) :: step_seconds(:)
      integer(ip), intent(in) :: n_boxes
      character(len=24) :: number

      if (size(step_seconds) == 0) return
      write (number, '(f24.3)') 1.0e9_dp*sum(step_seconds)/real(size(step_seconds), dp)/real(n_boxes, dp)
      call screen%put_line(key//trim(adjustl(number)))
   end subroutine print_time

   !> Name of a file without path and suffix
   pure function stem(path)
      character(len=*), intent(in) :: path
      character(len=:), allocatable :: stem
      integer :: first, last

      first = index(path, '/', back=.true.) + 1
      last = index(path, '.', back=.true.) - 1
      if (last < first) last = len(path)
      stem = path(first:last)
   end function stem

end module polydem_replay
