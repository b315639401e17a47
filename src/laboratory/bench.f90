!> A bench: timings of neighbour finders for several numbers of threads on several scenes.
!>
!> The bench measures one scene after the other, since a trace is held in memory. Within a scene the outer loop runs
!> over repeats and the inner one over cases (finder, threads). Each repeat rotates the cases by one, so slow periods of
!> the machine affect all cases alike. Repeat 0 is a warm-up that checks every list of pairs. The bench skips samples
!> that are on disk.
module polydem_bench
   use omp_lib, only: omp_get_max_threads, omp_get_num_procs, omp_set_num_threads
   use polydem_bench_cases, only: bench_t, measure_scene, write_end
   use polydem_bench_scene, only: provide_result, read_scene, scene_t
   use polydem_bench_settings, only: bench_settings_t
   use polydem_bench_summary, only: write_summary
   use polydem_clock, only: wall_seconds
   use polydem_errors, only: error_t
   use polydem_file_system, only: make_folder
   use polydem_finder, only: finder_t
   use polydem_finder_variants, only: new_finder_or_variant
   use polydem_host, only: load_average
   use polydem_kinds, only: dp, ip
   use polydem_source_locations, only: place_of
   use polydem_oversubscription, only: oversubscription_text
   use polydem_provenance, only: threads_are_bound
   use polydem_result_files, only: default_folder
   use polydem_strings, only: decimal
   implicit none
   private
   public :: run_bench

   !> Load average above which there is a warning [busy processors]
   real(dp), parameter :: quiet_load = 0.5_dp

contains

   !> Take the missing samples of a bench, and print its results.
   subroutine run_bench(settings, error)
      type(bench_settings_t), intent(in) :: settings
      !> Allocated for bad input, a failed run, or a wrong list of pairs
      type(error_t), allocatable, intent(inout) :: error
      type(bench_t) :: bench
      type(scene_t), allocatable :: scenes(:), first_runs(:)
      character(len=:), allocatable :: note

      bench%settings = settings
      bench%folder = settings%folder
      if (bench%folder == '') bench%folder = default_folder(settings%file)
      bench%all_threads = omp_get_max_threads()
      bench%began = wall_seconds()
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

   !> Read and check all finders and scenes before the first measurement.
   subroutine read_scenes(bench, scenes, first_runs, error)
      type(bench_t), intent(in) :: bench
      type(scene_t), allocatable, intent(out) :: scenes(:), first_runs(:)
      type(error_t), allocatable, intent(inout) :: error
      class(finder_t), allocatable :: finder
      integer :: k

      associate (settings => bench%settings)
         allocate (scenes(size(settings%scenes)), first_runs(size(settings%prepare)))
         do k = 1, size(settings%finders)
            if (.not. allocated(error)) call new_finder_or_variant(finder, &
               settings%finders(k)%text, error)
         end do
         do k = 1, size(settings%prepare)
            if (.not. allocated(error)) call read_scene(place_of(settings, 'bench', 'prepare')// &
               ": 'prepare' in &bench", settings%prepare(k)%text, first_runs(k), error)
         end do
         do k = 1, size(settings%scenes)
            if (.not. allocated(error)) call read_scene(place_of(settings, 'bench', 'scenes')// &
               ": 'scenes' in &bench", settings%scenes(k)%text, scenes(k), error, settings%names(k)%text, &
               bench%folder//'/traces/'//settings%names(k)%text)
         end do
      end associate
   end subroutine read_scenes

   !> Warn of conditions that disturb timings.
   subroutine write_warnings(bench)
      type(bench_t), intent(inout) :: bench
      character(len=:), allocatable :: warning
      real(dp) :: load
      logical :: bound

      associate (threads => bench%settings%threads, log => bench%log)
         warning = oversubscription_text(maxval(threads), int(omp_get_num_procs(), ip))
         if (warning /= '') call log%write_line(warning//'; timings are unreliable')
         load = load_average()
         if (load > quiet_load) call log%write_line('warning: this machine is busy: its load average is '// &
            decimal(load, 2)//' over the last minute')
         bound = threads_are_bound()
         if (maxval(threads) > 1_ip .and. .not. bound) call log%write_line('warning: threads are not bound to '// &
            'processors; set OMP_PROC_BIND=close OMP_PLACES=cores')
      end associate
   end subroutine write_warnings

   !> Run the namelists of `prepare`, measure all scenes, and print all tables.
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
      call write_end(bench)
      call bench%log%write_line('')
      do k = 1, size(scenes)
         if (.not. allocated(error)) call write_summary(bench%settings, scenes(k)%name, n_boxes(k), &
            bench%folder//'/samples', bench%log, error)
      end do
   end subroutine measure_all

end module polydem_bench
