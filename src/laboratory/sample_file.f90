!> Samples of a bench: one repeat of one case, step by step, in a self-describing HDF5 file.
!>
!>     case        properties of the case: scene, finder, threads, repeat, ...
!>     steps       elapsed, processor, pairs, phase, count, stage: one row per step
!>     provenance  program and machine
module polydem_sample_file
   use polydem_atomic_file, only: begin_file, complete_file
   use polydem_errors, only: error_t
   use polydem_hash, only: hexadecimal
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_kinds, only: dp, ip, lp
   use polydem_provenance, only: provenance_t, write_provenance
   use polydem_strings, only: to_text
   use polydem_timers, only: stage_names
   implicit none
   private
   public :: case_t, sample_t, sample_path, write_sample

   !> A case of a bench, and the number of the repeat
   type :: case_t
      !> Name of the scene, 'replay' or 'live', name of the finder
      character(len=:), allocatable :: scene, mode, finder
      !> Source of the boxes: a trace, or a namelist file with overrides
      character(len=:), allocatable :: trace
      !> Resolved settings of the run that made the boxes; empty or not allocated: not known
      character(len=:), allocatable :: input
      !> Source of the reference lists of pairs
      character(len=:), allocatable :: checked
      !> Number of threads, and index of the repeat; repeat 0 is the warm-up
      integer(ip) :: threads = 1_ip, repeat = 0_ip
      !> Number of boxes, of boxes of fixed bodies, and of bodies
      integer(ip) :: boxes = 0_ip, fixed = 0_ip, bodies = 0_ip
      !> Number of steps, including the first one from an empty list
      integer(ip) :: steps = 0_ip
      !> Time between steps [s]; 0: not known
      real(dp) :: dt = 0.0_dp
      !> Number of pairs of all steps, and sum of their hashes modulo 2^64
      integer(lp) :: pairs_total = 0_lp, pair_hash = 0_lp
      !> Hash of all bounds (replay), or of the last state (live)
      integer(lp) :: identity = 0_lp
   end type case_t

   !> Measurements of one repeat of a case; the file omits arrays that are not allocated
   type :: sample_t
      !> The case
      type(case_t) :: case
      !> Start of the sample (UTC)
      character(len=:), allocatable :: time_utc
      !> Load average of the machine at the start, over one minute
      real(dp) :: load = 0.0_dp
      !> Cost of reading the processor time, subtracted from each step [s]
      real(dp) :: clock_cost = 0.0_dp
      !> Cost of a barrier of all threads, and of starting and joining them; 0: one thread [s]
      real(dp) :: barrier_cost = 0.0_dp, region_cost = 0.0_dp
      !> Elapsed time, and processor time of the calling thread, of each step, (steps) [s]
      real(dp), allocatable :: elapsed(:), processor(:)
      !> Number of pairs of each step, (steps)
      integer(ip), allocatable :: pairs(:)
      !> Sum of the hashes of the pairs of each step, (steps)
      integer(lp), allocatable :: hash(:)
      !> Time of each phase of the finder, (phases, steps) [s]
      real(dp), allocatable :: phase(:, :)
      !> Counts of the finder, (counts, steps)
      integer(lp), allocatable :: count(:, :)
      !> Time of each stage of the time step, (stages, steps) [s]
      real(dp), allocatable :: stage(:, :)
   end type sample_t

contains

   !> Path of a sample: FOLDER/SCENE-FINDER-THREADS-REPEAT.h5
   pure function sample_path(folder, case) result(path)
      !> Folder of the samples
      character(len=*), intent(in) :: folder
      type(case_t), intent(in) :: case
      character(len=:), allocatable :: path

      path = folder//'/'//case%scene//'-'//case%finder//'-'//to_text(case%threads)//'-'//to_text(case%repeat)//'.h5'
   end function sample_path

   !> Write a sample atomically: the file is complete or does not exist.
   subroutine write_sample(path, sample, phase_names, count_names, provenance, error)
      !> Path of the file
      character(len=*), intent(in) :: path
      type(sample_t), intent(in) :: sample
      !> Names of the phases and counts of finders
      character(len=*), intent(in) :: phase_names(:), count_names(:)
      type(provenance_t), intent(in) :: provenance
      type(error_t), allocatable, intent(inout) :: error
      type(hdf5_file_t) :: file

      call begin_file(file, path, error)
      if (allocated(error)) return
      call write_provenance(file, 'sample of a bench by polydem', provenance, error)
      call write_case(file, sample, error)
      call write_steps(file, sample, phase_names, count_names, error)
      call complete_file(file, path, error)
   end subroutine write_sample

   !> Write the properties of a case.
   subroutine write_case(file, sample, error)
      type(hdf5_file_t), intent(inout) :: file
      type(sample_t), intent(in) :: sample
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: input

      associate (case => sample%case)
         call file%write('/case/scene', case%scene, error, '1', 'name of the scene')
         call file%write('/case/mode', case%mode, error, '1', 'replay of recorded boxes, or live: whole time steps')
         call file%write('/case/finder', case%finder, error, '1', 'name of the neighbour finder')
         call file%write('/case/threads', case%threads, error, '1', 'number of threads')
         call file%write('/case/repeat', case%repeat, error, '1', 'number of the repeat; 0 is the warm-up')
         call file%write('/case/boxes', case%boxes, error, '1', 'number of boxes')
         call file%write('/case/fixed', case%fixed, error, '1', 'boxes of fixed bodies')
         call file%write('/case/bodies', case%bodies, error, '1', 'number of bodies')
         call file%write('/case/steps', case%steps, error, '1', 'number of steps')
         call file%write('/case/dt', case%dt, error, 's', 'time between steps; 0: not known')
         call file%write('/case/pairs_total', case%pairs_total, error, '1', 'pairs of all steps')
         call file%write('/case/pair_hash', hexadecimal(case%pair_hash), error, '1', &
                         'sum over steps of the hashes of all pairs, as checked in repeat 0')
         call file%write('/case/identity', hexadecimal(case%identity), error, '1', &
                         'hash of all bounds (replay), or of the last state (live)')
         call file%write('/case/checked', case%checked, error, '1', 'source of the reference lists of pairs')
         call file%write('/case/trace', case%trace, error, '1', 'source of the boxes: a trace or a namelist')
         input = ''
         if (allocated(case%input)) input = case%input
         call file%write('/case/input', input, error, '1', 'settings of the run that made the boxes; empty: not known')
      end associate
      call file%write('/case/time_utc', sample%time_utc, error, '1', 'start of the sample (UTC)')
      call file%write('/case/load', sample%load, error, '1', 'load average of the machine at the start, over a minute')
      call file%write('/case/clock_cost', sample%clock_cost, error, 's', &
                      'cost of reading processor time, subtracted from each step')
      call file%write('/case/barrier_cost', sample%barrier_cost, error, 's', &
                      'time of a barrier of all threads just before the sample; 0: one thread')
      call file%write('/case/region_cost', sample%region_cost, error, 's', &
                      'time to start and join all threads just before the sample; 0: one thread')
   end subroutine write_case

   !> Write the measurements of all steps.
   subroutine write_steps(file, sample, phase_names, count_names, error)
      type(hdf5_file_t), intent(inout) :: file
      type(sample_t), intent(in) :: sample
      character(len=*), intent(in) :: phase_names(:), count_names(:)
      type(error_t), allocatable, intent(inout) :: error

      call file%write('/steps/elapsed', sample%elapsed, error, 's', 'elapsed time')
      call file%write('/steps/processor', sample%processor, error, 's', 'processor time of the calling thread')
      call file%write('/steps/pairs', sample%pairs, error, '1', 'pairs of bodies whose boxes overlap')
      call file%write('/steps/phase_name', phase_names, error, '1', 'phases of the neighbour finder')
      call file%write('/steps/phase', sample%phase, error, 's', 'time of each phase')
      if (allocated(sample%hash)) then
         call file%write('/steps/pair_hash', sample%hash, error, '1', 'sum modulo 2^64 of the hashes of the pairs')
      end if
      if (allocated(sample%count)) then
         call file%write('/steps/count_name', count_names, error, '1', 'counts of the neighbour finder')
         call file%write('/steps/count', sample%count, error, '1', &
                         'statistics of the finder in the step, or its state after it')
      end if
      if (allocated(sample%stage)) then
         call file%write('/steps/stage_name', stage_names, error, '1', 'stages of the time step')
         call file%write('/steps/stage', sample%stage, error, 's', 'time of each stage')
      end if
   end subroutine write_steps

end module polydem_sample_file
