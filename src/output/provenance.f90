!> Where a result comes from: the program, the build, the machine, the input. Stored in every file.
module polydem_provenance
   use, intrinsic :: iso_fortran_env, only: compiler_options, compiler_version
   use omp_lib, only: omp_get_max_threads, omp_get_num_procs, omp_get_proc_bind, omp_proc_bind_false
   use polydem_build_info, only: build_type, git_revision, program_version
   use polydem_errors, only: error_t
   use polydem_hdf5_file, only: hdf5_file_t, library_version
   use polydem_kinds, only: dp, ip, precision_name
   use polydem_machine, only: cache_sizes, cores_online, environment, frequency_governor, host_name, kernel_release, &
      load_average, memory_size, processor_clock, processor_name, utc_now
   implicit none
   private
   public :: provenance_t, collect_provenance, threads_are_bound, write_provenance

   !> Everything that is worth knowing about the origin of a result
   type :: provenance_t
      !> Version of the program
      character(len=:), allocatable :: version
      !> Commit it was built from
      character(len=:), allocatable :: revision
      !> CMake's type of build
      character(len=:), allocatable :: build_type
      !> Compiler with its version
      character(len=:), allocatable :: compiler
      !> Options of the compiler that change the program; search paths and warnings are left out
      character(len=:), allocatable :: options
      !> Working precision
      character(len=:), allocatable :: precision
      !> Version of the HDF5 library
      character(len=:), allocatable :: hdf5_version
      !> Name of the machine
      character(len=:), allocatable :: host
      !> Model of its processor
      character(len=:), allocatable :: processor
      !> Clock of its first processor at the start
      character(len=:), allocatable :: clock
      !> Sizes of its caches
      character(len=:), allocatable :: caches
      !> Size of its memory
      character(len=:), allocatable :: memory
      !> What chooses the frequency of its processors
      character(len=:), allocatable :: governor
      !> Release of its kernel
      character(len=:), allocatable :: kernel
      !> Processors that are switched on
      integer(ip) :: cores = 0_ip
      !> Processes that wanted to run in the minute before the start
      real(dp) :: load = 0.0_dp
      !> Whether and where threads are bound to processors
      character(len=:), allocatable :: binding
      !> How idle threads wait
      character(len=:), allocatable :: wait_policy
      !> Processes that share the run
      integer(ip) :: processes = 1_ip
      !> OpenMP threads of each
      integer(ip) :: threads = 0_ip
      !> Processors that the run may use
      integer(ip) :: processors = 0_ip
      !> The command that started the run
      character(len=:), allocatable :: command_line
      !> Path of the input file
      character(len=:), allocatable :: input_file
      !> The input as it was given
      character(len=:), allocatable :: input_text
      !> All settings in force
      character(len=:), allocatable :: resolved_input
      !> Seed of the scene
      integer(ip) :: seed = 0_ip
      !> Hash of the bodies at the start; empty if there are none
      character(len=:), allocatable :: scene
      !> When the run, or this attempt of it, started (UTC)
      character(len=:), allocatable :: started
      !> Checkpoint that this attempt went on from; 'none' at the start of a run
      character(len=:), allocatable :: parent
   end type provenance_t

contains

   !> Ask the build and the machine, and keep the input; call it at the start of the run.
   subroutine collect_provenance(provenance, input_file, input_text, resolved_input, seed)
      !> All that is known
      type(provenance_t), intent(out) :: provenance
      !> Path of the input file
      character(len=*), intent(in) :: input_file
      !> Its text
      character(len=*), intent(in) :: input_text
      !> All settings in force, one per line
      character(len=*), intent(in) :: resolved_input
      !> Seed of the scene
      integer(ip), intent(in) :: seed

      provenance%version = program_version
      provenance%revision = git_revision
      provenance%build_type = build_type
      provenance%compiler = compiler_version()
      provenance%options = telling_options(compiler_options())
      provenance%precision = trim(precision_name)
      provenance%hdf5_version = library_version()
      provenance%host = host_name()
      provenance%processor = processor_name()
      provenance%clock = processor_clock()
      provenance%caches = cache_sizes()
      provenance%memory = memory_size()
      provenance%governor = frequency_governor()
      provenance%kernel = kernel_release()
      provenance%cores = cores_online()
      provenance%load = load_average()
      provenance%binding = trim(merge('bound    ', 'not bound', threads_are_bound()))//', OMP_PROC_BIND '// &
         environment('OMP_PROC_BIND')//', OMP_PLACES '//environment('OMP_PLACES')
      provenance%wait_policy = environment('OMP_WAIT_POLICY')
      provenance%threads = int(omp_get_max_threads(), ip)
      provenance%processors = int(omp_get_num_procs(), ip)
      provenance%command_line = command_line()
      provenance%input_file = input_file
      provenance%input_text = input_text
      provenance%resolved_input = resolved_input
      provenance%seed = seed
      provenance%started = utc_now()
      provenance%parent = 'none'
      provenance%scene = ''
   end subroutine collect_provenance

   !> Whether OpenMP binds its threads to processors
   logical function threads_are_bound()
      threads_are_bound = omp_get_proc_bind() /= omp_proc_bind_false
   end function threads_are_bound

   !> Write the group /provenance; the time of writing is its entry `written`.
   subroutine write_provenance(provenance, file, error)
      !> All that is known
      type(provenance_t), intent(in) :: provenance
      !> File, open for writing
      type(hdf5_file_t), intent(inout) :: file
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error

      call file%write('/provenance/program', 'polydem', error)
      call file%write('/provenance/version', provenance%version, error)
      call file%write('/provenance/revision', provenance%revision, error)
      call file%write('/provenance/build_type', provenance%build_type, error)
      call file%write('/provenance/compiler', provenance%compiler, error)
      call file%write('/provenance/options', provenance%options, error)
      call file%write('/provenance/precision', provenance%precision, error)
      call file%write('/provenance/hdf5_version', provenance%hdf5_version, error)
      call file%write('/provenance/host', provenance%host, error)
      call file%write('/provenance/processor', provenance%processor, error)
      call file%write('/provenance/clock', provenance%clock, error)
      call file%write('/provenance/caches', provenance%caches, error)
      call file%write('/provenance/memory', provenance%memory, error)
      call file%write('/provenance/governor', provenance%governor, error)
      call file%write('/provenance/kernel', provenance%kernel, error)
      call file%write('/provenance/cores', provenance%cores, error)
      call file%write('/provenance/load', provenance%load, error)
      call file%write('/provenance/binding', provenance%binding, error)
      call file%write('/provenance/wait_policy', provenance%wait_policy, error)
      call file%write('/provenance/processes', provenance%processes, error)
      call file%write('/provenance/threads', provenance%threads, error)
      call file%write('/provenance/processors', provenance%processors, error)
      call file%write('/provenance/command_line', provenance%command_line, error)
      call file%write('/provenance/input_file', provenance%input_file, error)
      call file%write('/provenance/input_text', provenance%input_text, error)
      call file%write('/provenance/resolved_input', provenance%resolved_input, error)
      call file%write('/provenance/seed', provenance%seed, error)
      call file%write('/provenance/started', provenance%started, error)
      call file%write('/provenance/parent', provenance%parent, error)
      call file%write('/provenance/scene', provenance%scene, error)
      call file%write('/provenance/written', utc_now(), error)
   end subroutine write_provenance

   function command_line() result(text)
      character(len=:), allocatable :: text
      integer :: length

      call get_command(length=length)
      allocate (character(len=length) :: text)
      call get_command(text)
   end function command_line

   !> Options without warnings, search paths and names of files, which may stand in a word of their own
   pure function telling_options(options) result(telling)
      !> As from compiler_options()
      character(len=*), intent(in) :: options
      character(len=:), allocatable :: telling
      character(len=:), allocatable :: word, rest
      logical :: after_dull
      integer :: k

      telling = ''
      rest = trim(adjustl(options))//' '
      after_dull = .false.
      do while (len_trim(rest) > 0)
         k = index(rest, ' ')
         word = rest(:k - 1)
         rest = trim(adjustl(rest(k + 1:)))//' '
         if (word(1:1) == '-') after_dull = is_dull(word)
         if (.not. after_dull) telling = telling//word//' '
      end do
      telling = trim(telling)
   end function telling_options

   pure logical function is_dull(word)
      character(len=*), intent(in) :: word
      character(len=9), parameter :: beginnings(8) = [character(len=9) :: &
         '-I', '-J', '-W', '-fpre-inc', '-dumpbase', '-auxbase', '-imultiar', '-fimplici']
      integer :: k

      is_dull = .false.
      do k = 1, size(beginnings)
         if (index(word, trim(beginnings(k))) == 1) is_dull = .true.
      end do
   end function is_dull

end module polydem_provenance
