!> Replay of recorded boxes through a neighbour finder, with a check of every list and a timing of every step.
!>
!> The first pass is a warm-up that checks every list and collects finder statistics; timed passes follow. A timed
!> section begins with the boxes of a step in memory and ends with the complete list of pairs. The result is the
!> shortest time of all timed passes for each step, averaged over steps and divided by the number of boxes including
!> fixed ones. The time is processor time for one thread, and elapsed time for more threads.
module polydem_replay
   use omp_lib, only: omp_set_num_threads
   use polydem_bench_subject, only: compare_all_pairs, load_trace, subject_t, take_sample
   use polydem_errors, only: error_t
   use polydem_file_system, only: make_folder
   use polydem_finder_statistics, only: count_names, n_counts, n_phases, n_sums, phase_names
   use polydem_hash, only: hexadecimal
   use polydem_kinds, only: dp, ip, lp
   use polydem_line_writer, only: line_writer_t
   use polydem_provenance, only: collect_provenance, provenance_t
   use polydem_reference, only: total_hash
   use polydem_result_files, only: stem
   use polydem_sample_file, only: sample_path, sample_t, write_sample
   use polydem_strings, only: decimal, printable, to_text
   implicit none
   private
   public :: replay_trace

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
      type(subject_t) :: subject
      type(sample_t) :: warm_up, best
      logical :: use_oracle

      call omp_set_num_threads(int(threads))
      call load_trace(path, subject, error, steps)
      if (allocated(error)) return
      subject%case%scene = stem(path)
      subject%case%trace = path
      subject%case%finder = finder
      subject%case%threads = threads
      use_oracle = .not. allocated(subject%trace%n_pairs)
      if (present(oracle)) use_oracle = use_oracle .or. oracle
      if (use_oracle) call compare_all_pairs(subject, spread(.true., 1, int(subject%case%steps)), error)
      if (allocated(error)) return
      subject%case%checked = 'npairs'
      if (use_oracle) subject%case%checked = 'all_pairs '//to_text(subject%case%steps)//' steps'
      call replay_all(subject, repeats, warm_up, best, error, samples)
      if (.not. allocated(error)) call print_record(repeats, warm_up, best, error)
   end subroutine replay_trace

   !> Run the warm-up and all timed passes.
   subroutine replay_all(subject, repeats, warm_up, best, error, samples)
      type(subject_t), intent(inout) :: subject
      integer(ip), intent(in) :: repeats
      !> Sample of the warm-up, and the shortest times of each step in the timed passes
      type(sample_t), intent(out) :: warm_up, best
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in), optional :: samples
      type(sample_t) :: sample
      integer(ip) :: k

      warm_up%case = subject%case
      call take_sample(subject, warm_up, error)
      if (allocated(error)) return
      subject%case%pairs_total = sum(int(warm_up%pairs, lp))
      subject%case%pair_hash = total_hash(warm_up%hash)
      warm_up%case = subject%case
      call write_sample_file(warm_up, error, samples)
      do k = 1_ip, repeats
         sample = sample_t(case=subject%case)
         sample%case%repeat = k
         call take_sample(subject, sample, error)
         if (allocated(error)) return
         call write_sample_file(sample, error, samples)
         if (k > 1_ip) then
            sample%elapsed = min(sample%elapsed, best%elapsed)
            sample%processor = min(sample%processor, best%processor)
            sample%phase = min(sample%phase, best%phase)
         end if
         best = sample
      end do
   end subroutine replay_all

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

      if (size(step_seconds) == 0) return
      call screen%put_line(key//decimal(1.0e9_dp*sum(step_seconds)/real(size(step_seconds), dp)/real(n_boxes, dp), 3))
   end subroutine print_time

end module polydem_replay
