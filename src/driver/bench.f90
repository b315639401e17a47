!> A bench: neighbour finders by numbers of threads on scenes, sample by sample.
!>
!> Scenes come one after the other, since a trace is held in memory. Within a scene the repeats are the outer loop
!> and the cases (finder, threads) the inner one, rotated by one at each repeat, so that slow spells of the machine meet
!> all cases. Repeat 0 warms up and checks every list. A sample that is on disk is not taken again.
module polydem_bench
   use omp_lib, only: omp_get_max_threads, omp_get_num_procs, omp_set_num_threads
   use polydem_bench_scene, only: provide_result, read_scene, scene_t
   use polydem_bench_settings, only: bench_settings_t
   use polydem_bench_subject, only: complete_case, find_reference, load_subject, subject_t, take_sample
   use polydem_bench_summary, only: ns_per_box, write_summary
   use polydem_check_sample, only: check_sample
   use polydem_crowding, only: crowding_text
   use polydem_errors, only: error_t
   use polydem_finder, only: finder_t
   use polydem_finder_factory, only: new_finder
   use polydem_kinds, only: dp, ip, lp
   use polydem_log, only: log_t
   use polydem_machine, only: load_average
   use polydem_paths, only: exists, make_folder
   use polydem_provenance, only: collect_provenance, provenance_t, threads_are_bound
   use polydem_reference, only: reference_t
   use polydem_reference_file, only: read_reference, write_reference
   use polydem_replay, only: sample_path
   use polydem_result_folder, only: default_folder
   use polydem_run_lock, only: run_lock_t
   use polydem_sample_file, only: sample_t, write_sample
   use polydem_strings, only: to_text
   use polydem_work, only: count_names, phase_names
   implicit none
   private
   public :: run_bench

   !> A load above this many busy processors disturbs a bench
   real(dp), parameter :: quiet_load = 0.5_dp

   !> A bench under way
   type :: bench_t
      !> What is measured how
      type(bench_settings_t) :: settings
      !> Folder of traces, expected lists and samples
      character(len=:), allocatable :: folder
      !> Lock of the folder
      type(run_lock_t) :: lock
      !> Screen
      type(log_t) :: log
      !> Threads for all that is not timed
      integer :: all_threads = 1
      !> Samples done or found, and samples in all
      integer :: n_done = 0, n_samples = 0
   end type bench_t

contains

   !> Do what is left to do of a bench, and show its result.
   subroutine run_bench(settings, error)
      !> What is measured how
      type(bench_settings_t), intent(in) :: settings
      !> Allocated if the input is bad, a run fails, or a finder is wrong
      type(error_t), allocatable, intent(inout) :: error
      type(bench_t) :: bench
      type(scene_t), allocatable :: scenes(:), first_runs(:)
      character(len=:), allocatable :: note

      bench%settings = settings
      bench%folder = settings%folder
      if (bench%folder == '') bench%folder = default_folder(settings%file)
      bench%all_threads = omp_get_max_threads()
      bench%n_samples = size(settings%scenes)*size(settings%finders)*size(settings%threads)*(settings%repeats + 1)
      call read_scenes(bench, scenes, first_runs, error)
      if (.not. allocated(error)) call make_folder(bench%folder, error)
      if (.not. allocated(error)) call bench%lock%acquire(bench%folder, note, error)
      if (allocated(error)) return
      call bench%log%open('', error)
      if (allocated(note)) call bench%log%write_line(note)
      call write_warnings(bench)
      call measure_all(bench, scenes, first_runs, error)
      call bench%lock%release()
      call bench%log%close(error)
   end subroutine run_bench

   !> Understand all that is given before anything is measured.
   subroutine read_scenes(bench, scenes, first_runs, error)
      type(bench_t), intent(in) :: bench
      type(scene_t), allocatable, intent(out) :: scenes(:), first_runs(:)
      type(error_t), allocatable, intent(inout) :: error
      class(finder_t), allocatable :: finder
      integer :: k

      associate (settings => bench%settings)
         allocate (scenes(size(settings%scenes)), first_runs(size(settings%prepare)))
         do k = 1, size(settings%finders)
            if (.not. allocated(error)) call new_finder(finder, settings%finders(k)%text, error)
         end do
         do k = 1, size(settings%prepare)
            if (.not. allocated(error)) call read_scene(settings%place_of_prepare//": 'prepare' in &bench", &
               settings%prepare(k)%text, first_runs(k), error)
         end do
         do k = 1, size(settings%scenes)
            if (.not. allocated(error)) call read_scene(settings%place_of_scenes//": 'scenes' in &bench", &
               settings%scenes(k)%text, scenes(k), error, settings%names(k)%text, &
               bench%folder//'/traces/'//settings%names(k)%text)
         end do
      end associate
   end subroutine read_scenes

   !> Tell what makes timings doubtful.
   subroutine write_warnings(bench)
      type(bench_t), intent(inout) :: bench
      character(len=:), allocatable :: warning
      character(len=12) :: number
      real(dp) :: load
      logical :: bound

      associate (threads => bench%settings%threads, log => bench%log)
         warning = crowding_text(maxval(threads), int(omp_get_num_procs(), ip))
         if (warning /= '') call log%write_line(warning//'; such timings say little')
         load = load_average()
         write (number, '(f12.2)') load
         if (load > quiet_load) call log%write_line('warning: this machine is busy, its load was '// &
            trim(adjustl(number))//' over the last minute')
         bound = threads_are_bound()
         if (maxval(threads) > 1_ip .and. .not. bound) call log%write_line('warning: threads are not bound to '// &
            'processors; OMP_PROC_BIND=close OMP_PLACES=cores does it')
      end associate
   end subroutine write_warnings

   !> First runs, then scene by scene, then all tables.
   subroutine measure_all(bench, scenes, first_runs, error)
      type(bench_t), intent(inout) :: bench
      type(scene_t), intent(in) :: scenes(:), first_runs(:)
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: n_boxes(size(scenes))
      integer :: k

      do k = 1, size(first_runs)
         if (.not. allocated(error)) call provide_result(first_runs(k)%settings, error)
      end do
      if (.not. allocated(error)) call make_folder(bench%folder//'/samples', error)
      if (.not. allocated(error)) call make_folder(bench%folder//'/oracle', error)
      do k = 1, size(scenes)
         if (allocated(error)) return
         call omp_set_num_threads(bench%all_threads)
         call measure_scene(bench, scenes(k), n_boxes(k), error)
         if (allocated(error)) error%message = 'scene '//scenes(k)%name//': '//error%message
      end do
      if (allocated(error)) return
      call bench%log%write_line('')
      do k = 1, size(scenes)
         if (.not. allocated(error)) call write_summary(bench%settings, scenes(k)%name, n_boxes(k), &
            bench%folder//'/samples', bench%log, error)
      end do
   end subroutine measure_all

   !> All samples of a scene.
   subroutine measure_scene(bench, scene, n_boxes, error)
      type(bench_t), intent(inout) :: bench
      type(scene_t), intent(in) :: scene
      integer(ip), intent(out) :: n_boxes
      type(error_t), allocatable, intent(inout) :: error
      type(subject_t) :: subject
      type(reference_t) :: reference
      integer :: n_cases, c, k, r

      associate (settings => bench%settings)
         call load_subject(scene, settings%mode == 'live', settings%steps, subject, error)
         n_boxes = subject%case%boxes
         if (.not. allocated(error)) call provide_reference(bench, subject, reference, error)
         n_cases = size(settings%finders)*size(settings%threads)
         do r = 0, settings%repeats
            do k = 0, n_cases - 1
               if (allocated(error)) return
               c = mod(k + r, n_cases)
               subject%case%finder = settings%finders(1 + c/size(settings%threads))%text
               subject%case%threads = settings%threads(1 + mod(c, size(settings%threads)))
               subject%case%repeat = int(r, ip)
               call measure_case(bench, subject, reference, error)
            end do
         end do
      end associate
   end subroutine measure_scene

   !> What the lists should be, from disk or found out now.
   subroutine provide_reference(bench, subject, reference, error)
      type(bench_t), intent(inout) :: bench
      type(subject_t), intent(inout) :: subject
      type(reference_t), intent(out) :: reference
      type(error_t), allocatable, intent(inout) :: error
      type(provenance_t) :: provenance
      character(len=:), allocatable :: path
      integer(lp) :: finish

      path = bench%folder//'/oracle/'//subject%case%scene//'.h5'
      if (exists(path)) then
         call read_reference(path, subject%case%steps, subject%start, reference, finish, error)
      else
         call bench%log%write_line(subject%case%scene//': '//to_text(subject%case%boxes)//' boxes, '// &
            to_text(subject%case%steps)//' steps; comparing all pairs')
         call find_reference(subject, bench%settings%finders(1)%text, reference, finish, error)
         if (allocated(error)) return
         call collect(bench, provenance)
         call write_reference(path, reference, subject%start, finish, provenance, error)
      end if
      if (.not. allocated(error)) call complete_case(reference, finish, subject)
   end subroutine provide_reference

   !> One sample, unless it is on disk.
   subroutine measure_case(bench, subject, reference, error)
      type(bench_t), intent(inout) :: bench
      type(subject_t), intent(inout) :: subject
      type(reference_t), intent(inout) :: reference
      type(error_t), allocatable, intent(inout) :: error
      type(sample_t) :: sample
      type(provenance_t) :: provenance
      character(len=:), allocatable :: path
      logical :: is_lost

      sample%case = subject%case
      call omp_set_num_threads(int(sample%case%threads))
      call collect(bench, provenance)
      path = sample_path(bench%folder//'/samples', sample%case)
      if (exists(path)) then
         call check_sample(path, sample%case, provenance, error)
         bench%n_done = bench%n_done + 1
         return
      end if
      call take_sample(subject, reference, sample, error)
      call bench%lock%check(is_lost, error)
      if (allocated(error)) return
      call write_sample(path, sample, phase_names, count_names, provenance, error)
      if (allocated(error)) return
      bench%n_done = bench%n_done + 1
      call write_progress(bench, sample)
   end subroutine measure_case

   subroutine write_progress(bench, sample)
      type(bench_t), intent(inout) :: bench
      type(sample_t), intent(in) :: sample
      character(len=110) :: line
      real(dp) :: time

      associate (case => sample%case)
         if (case%threads == 1_ip) time = ns_per_box(sample%processor, case%boxes)
         if (case%threads > 1_ip) time = ns_per_box(sample%elapsed, case%boxes)
         write (line, '(i6,a,i0,7a,f10.2,a)') bench%n_done, ' of ', bench%n_samples, '  '//case%scene//'  ', &
            case%finder, '  threads ', to_text(case%threads), '  repeat ', to_text(case%repeat), ': ', time, ' ns'
         call bench%log%write_line(trim(line))
      end associate
   end subroutine write_progress

   subroutine collect(bench, provenance)
      type(bench_t), intent(in) :: bench
      type(provenance_t), intent(out) :: provenance

      associate (settings => bench%settings)
         call collect_provenance(provenance, settings%file, settings%text, settings%resolved, 0_ip)
      end associate
   end subroutine collect

end module polydem_bench
