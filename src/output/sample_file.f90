!> Samples of a bench: one repeat of one case, step by step, in a file that explains itself.
!>
!>     case        what was measured: scene, finder, threads, repeat, ...
!>     steps       elapsed, processor, pairs, phase, count, stage: one row per step
!>     provenance  by what program on what machine
module polydem_sample_file
   use polydem_complete_file, only: begin_file, complete_file
   use polydem_errors, only: error_t
   use polydem_hash, only: hexadecimal
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_kinds, only: dp, ip, lp
   use polydem_provenance, only: provenance_t, write_provenance
   use polydem_segment, only: schema_version
   use polydem_timers, only: stage_names
   implicit none
   private
   public :: case_t, sample_t, write_sample

   !> What is measured
   type :: case_t
      !> Name of the scene, 'replay' or 'live', name of the finder
      character(len=:), allocatable :: scene, mode, finder
      !> Where the boxes come from: a trace, or a namelist file with overrides
      character(len=:), allocatable :: trace
      !> Settings of the run that made the boxes, resolved; empty or not allocated: not known
      character(len=:), allocatable :: input
      !> What the lists of pairs were checked against
      character(len=:), allocatable :: checked
      !> Number of threads, and of the repeat; repeat 0 is the warm-up
      integer(ip) :: threads = 1_ip, repeat = 0_ip
      !> Boxes, those of fixed bodies among them, and bodies
      integer(ip) :: boxes = 0_ip, fixed = 0_ip, bodies = 0_ip
      !> Number of steps, the first one from an empty list included
      integer(ip) :: steps = 0_ip
      !> Time between steps [s]; 0 if it is not known
      real(dp) :: dt = 0.0_dp
      !> Pairs of all steps, and the sum of their hashes
      integer(lp) :: pairs_total = 0_lp, pair_hash = 0_lp
      !> Hash of what is measured: of all bounds (replay), or of the last state (live)
      integer(lp) :: identity = 0_lp
   end type case_t

   !> What was measured; arrays that are not allocated are left out of the file
   type :: sample_t
      !> What is measured
      type(case_t) :: case
      !> When it began (UTC)
      character(len=:), allocatable :: time_utc
      !> Load of the machine then, average over a minute
      real(dp) :: load = 0.0_dp
      !> What asking the clock of processor time costs, and was taken off each step [s]
      real(dp) :: clock_cost = 0.0_dp
      !> Elapsed time, and processor time of the calling thread, of each step [s]
      real(dp), allocatable :: elapsed(:), processor(:)
      !> Pairs of each step
      integer(ip), allocatable :: pairs(:)
      !> Sum of the hashes of the pairs of each step
      integer(lp), allocatable :: hash(:)
      !> Seconds of each phase of the finder, (phases, step)
      real(dp), allocatable :: phase(:, :)
      !> Counts of the finder, (counts, step)
      integer(lp), allocatable :: count(:, :)
      !> Seconds of each stage of the time step, (stages, step)
      real(dp), allocatable :: stage(:, :)
   end type sample_t

contains

   !> Write a sample, whole or not at all.
   subroutine write_sample(path, sample, phase_names, count_names, provenance, error)
      !> Name of the file
      character(len=*), intent(in) :: path
      !> What was measured
      type(sample_t), intent(in) :: sample
      !> Names of the phases and counts of finders
      character(len=*), intent(in) :: phase_names(:), count_names(:)
      !> By what program on what machine
      type(provenance_t), intent(in) :: provenance
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error
      type(hdf5_file_t) :: file

      call begin_file(file, path, error)
      if (allocated(error)) return
      call file%write_attribute('/', 'content', 'sample of a bench by polydem', error)
      call file%write_attribute('/', 'schema_version', schema_version, error)
      call write_case(file, sample, error)
      call write_steps(file, sample, phase_names, count_names, error)
      if (.not. allocated(error)) call write_provenance(provenance, file, error)
      call complete_file(file, path, error)
   end subroutine write_sample

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
         call file%write('/case/checked', case%checked, error, '1', 'what the lists of pairs were compared with')
         call file%write('/case/trace', case%trace, error, '1', 'where the boxes come from')
         input = ''
         if (allocated(case%input)) input = case%input
         call file%write('/case/input', input, error, '1', 'settings of the run that made the boxes; empty: not known')
      end associate
      call file%write('/case/time_utc', sample%time_utc, error, '1', 'when the sample was begun')
      call file%write('/case/load', sample%load, error, '1', 'load of the machine then, average over a minute')
      call file%write('/case/clock_cost', sample%clock_cost, error, 's', &
                      'cost of asking for processor time, taken off each step')
   end subroutine write_case

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
         call file%write('/steps/count_name', count_names, error, '1', 'what the neighbour finder counts')
         call file%write('/steps/count', sample%count, error, '1', &
                         'work of the finder in the step, or its state after it')
      end if
      if (allocated(sample%stage)) then
         call file%write('/steps/stage_name', stage_names, error, '1', 'stages of the time step')
         call file%write('/steps/stage', sample%stage, error, 's', 'time of each stage')
      end if
   end subroutine write_steps

end module polydem_sample_file
