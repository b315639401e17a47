!> The samples of a bench: one for each scene, finder, number of threads and repeat.
module polydem_bench_cases
   use omp_lib, only: omp_set_num_threads
   use polydem_bench_scene, only: scene_t
   use polydem_bench_settings, only: bench_settings_t
   use polydem_bench_subject, only: complete_case, find_reference, load_subject, subject_t, take_sample
   use polydem_check_sample, only: check_sample
   use polydem_clock, only: wall_seconds
   use polydem_errors, only: error_t
   use polydem_file_system, only: exists
   use polydem_finder_statistics, only: count_names, phase_names
   use polydem_folder_lock, only: folder_lock_t
   use polydem_kinds, only: dp, ip, lp
   use polydem_log, only: log_t
   use polydem_provenance, only: collect_provenance, provenance_t
   use polydem_reference_file, only: read_reference, write_reference
   use polydem_sample_file, only: case_t, sample_path, sample_t, write_sample
   use polydem_strings, only: decimal, to_text
   use polydem_waiting_cost, only: measure_waiting
   implicit none
   private
   public :: bench_t, measure_scene, write_end

   !> State of a bench
   type :: bench_t
      !> Settings of the bench
      type(bench_settings_t) :: settings
      !> Folder of traces, reference lists and samples
      character(len=:), allocatable :: folder
      !> Lock of the folder
      type(folder_lock_t) :: lock
      !> Log on the screen
      type(log_t) :: log
      !> Number of threads outside timed sections
      integer :: all_threads = 1
      !> Number of samples taken, found on disk, and in all
      integer :: n_taken = 0, n_found = 0, n_samples = 0
      !> Wall-clock time of the start [s]
      real(dp) :: began = 0.0_dp
   end type bench_t

contains

   !> Take all samples of a scene.
   subroutine measure_scene(bench, scene, n_boxes, error)
      type(bench_t), intent(inout) :: bench
      !> Scene to measure
      type(scene_t), intent(in) :: scene
      !> Number of boxes of the scene
      integer(ip), intent(out) :: n_boxes
      !> Allocated if a sample cannot be taken or a list is wrong
      type(error_t), allocatable, intent(inout) :: error
      type(subject_t) :: subject
      integer :: n_cases, c, k, r

      associate (settings => bench%settings)
         call announce(bench, scene)
         call load_subject(scene, settings%mode == 'live', settings%steps, subject, error)
         n_boxes = subject%case%boxes
         if (.not. allocated(error)) call provide_reference(bench, subject, error)
         n_cases = size(settings%finders)*size(settings%threads)
         do r = 0, settings%repeats
            do k = 0, n_cases - 1
               if (allocated(error)) return
               c = mod(k + r, n_cases)
               subject%case%finder = settings%finders(1 + c/size(settings%threads))%text
               subject%case%threads = settings%threads(1 + mod(c, size(settings%threads)))
               subject%case%repeat = int(r, ip)
               call measure_case(bench, subject, error)
            end do
         end do
      end associate
   end subroutine measure_scene

   !> Tell what takes long before the samples of a scene: the run that makes its boxes.
   subroutine announce(bench, scene)
      type(bench_t), intent(inout) :: bench
      type(scene_t), intent(in) :: scene

      if (bench%settings%mode == 'live') then
         call bench%log%show_line(scene%name//': running to its first step')
      else if (.not. scene%is_trace) then
         if (.not. exists(scene%path)) call bench%log%show_line(scene%name//': making its boxes '//scene%path)
      end if
   end subroutine announce

   !> Read the reference lists of pairs from disk, or compute and write them.
   subroutine provide_reference(bench, subject, error)
      type(bench_t), intent(inout) :: bench
      type(subject_t), intent(inout) :: subject
      type(error_t), allocatable, intent(inout) :: error
      type(provenance_t) :: provenance
      character(len=:), allocatable :: path

      path = bench%folder//'/oracle/'//subject%case%scene//'.h5'
      if (exists(path, error)) then
         call read_reference(path, subject%reference, error)
      else
         if (allocated(error)) return
         call bench%log%show_line(subject%case%scene//': '//to_text(subject%case%boxes)//' boxes, '// &
            to_text(subject%case%steps)//' steps; comparing all pairs')
         call find_reference(subject, bench%settings%finders(1)%text, error)
         if (allocated(error)) return
         call collect(bench, provenance)
         call write_reference(path, subject%reference, provenance, error)
      end if
      if (.not. allocated(error)) call complete_case(subject)
   end subroutine provide_reference

   !> Take one sample, or check the one on disk.
   subroutine measure_case(bench, subject, error)
      type(bench_t), intent(inout) :: bench
      type(subject_t), intent(inout) :: subject
      type(error_t), allocatable, intent(inout) :: error
      type(sample_t) :: sample
      type(provenance_t) :: provenance
      character(len=:), allocatable :: path

      sample%case = subject%case
      call omp_set_num_threads(int(sample%case%threads))
      call collect(bench, provenance)
      path = sample_path(bench%folder//'/samples', sample%case)
      if (exists(path, error)) then
         call check_sample(path, sample%case, provenance, error)
         bench%n_found = bench%n_found + 1
         return
      end if
      if (allocated(error)) return
      if (sample%case%threads > 1_ip) call measure_waiting(sample%barrier_cost, sample%region_cost)
      call take_sample(subject, sample, error)
      if (.not. allocated(error)) call write_sample(path, sample, phase_names, count_names, provenance, error)
      if (allocated(error)) return
      bench%n_taken = bench%n_taken + 1
      call show_progress(bench, sample%case)
   end subroutine measure_case

   !> Show how far the bench is: a line that is rewritten on a terminal, and a line now and then elsewhere.
   subroutine show_progress(bench, case)
      type(bench_t), intent(inout) :: bench
      type(case_t), intent(in) :: case
      integer :: n_done

      n_done = bench%n_taken + bench%n_found
      call bench%log%show_line(to_text(int(n_done, ip))//' of '//to_text(int(bench%n_samples, ip))//' samples, '// &
         to_text(int(100_lp*int(n_done, lp)/int(max(1, bench%n_samples), lp), ip))//' %, '// &
         elapsed_text(bench)//'; '//case%scene//'  '//case%finder//'  threads '//to_text(case%threads)// &
         '  repeat '//to_text(case%repeat))
   end subroutine show_progress

   !> Write how many samples were taken and found.
   subroutine write_end(bench)
      type(bench_t), intent(inout) :: bench

      call bench%log%write_line(to_text(int(bench%n_taken, ip))//' samples taken, '// &
         to_text(int(bench%n_found, ip))//' found in '//bench%folder//', '//elapsed_text(bench))
      call bench%log%write_line('tables and figures: ./polydem tables '//bench%folder)
   end subroutine write_end

   !> Time since the start of the bench
   function elapsed_text(bench) result(text)
      type(bench_t), intent(in) :: bench
      character(len=:), allocatable :: text

      text = decimal(wall_seconds() - bench%began, 1)//' s'
   end function elapsed_text

   !> Collect the provenance of a sample.
   subroutine collect(bench, provenance)
      type(bench_t), intent(in) :: bench
      type(provenance_t), intent(out) :: provenance

      associate (settings => bench%settings)
         call collect_provenance(provenance, settings%file, settings%text, settings%resolved, 0_ip)
      end associate
   end subroutine collect

end module polydem_bench_cases
