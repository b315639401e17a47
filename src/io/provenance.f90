!> Provenance of a result: program, build, machine and input. Every HDF5 file of a result contains it.
module polydem_provenance
   use, intrinsic :: iso_fortran_env, only: compiler_options, compiler_version
   use omp_lib, only: omp_get_max_threads, omp_get_num_procs, omp_get_proc_bind, omp_proc_bind_false
   use polydem_build_info, only: build_type, git_revision, program_version
   use polydem_choose_instruction_set, only: choose_instruction_set
   use polydem_errors, only: error_t
   use polydem_hdf5_file, only: hdf5_file_t, library_version
   use polydem_host, only: cache_sizes, cores_online, environment, frequency_governor, host_name, kernel_release, &
      load_average, memory_size, processor_clock, processor_name, utc_now
   use polydem_instruction_set, only: isa_names
   use polydem_kinds, only: dp, ip, precision_name
   implicit none
   private
   public :: provenance_t, collect_provenance, threads_are_bound, write_provenance, origin_of, schema_version

   !> Origin of a result
   type :: provenance_t
      !> Version of the program
      character(len=:), allocatable :: version
      !> Git commit of the program
      character(len=:), allocatable :: revision
      !> CMake build type
      character(len=:), allocatable :: build_type
      !> Compiler with its version
      character(len=:), allocatable :: compiler
      !> Compiler options that affect the code; without search paths and warning options
      character(len=:), allocatable :: options
      !> Name of the working precision
      character(len=:), allocatable :: precision
      !> Version of the HDF5 library
      character(len=:), allocatable :: hdf5_version
      !> Host name
      character(len=:), allocatable :: host
      !> Processor model
      character(len=:), allocatable :: processor
      !> Instruction set of the kernels
      character(len=:), allocatable :: instruction_set
      !> Clock of the first processor at the start
      character(len=:), allocatable :: clock
      !> Cache sizes
      character(len=:), allocatable :: caches
      !> Size of the main memory
      character(len=:), allocatable :: memory
      !> Frequency governor of the processors
      character(len=:), allocatable :: governor
      !> Kernel release
      character(len=:), allocatable :: kernel
      !> Number of online processors
      integer(ip) :: cores = 0_ip
      !> Load average of the minute before the start
      real(dp) :: load = 0.0_dp
      !> Thread binding: whether threads are bound, OMP_PROC_BIND and OMP_PLACES
      character(len=:), allocatable :: binding
      !> Wait policy of idle threads (OMP_WAIT_POLICY)
      character(len=:), allocatable :: wait_policy
      !> Number of MPI ranks
      integer(ip) :: processes = 1_ip
      !> OpenMP threads per rank
      integer(ip) :: threads = 0_ip
      !> Number of processors available to the run
      integer(ip) :: processors = 0_ip
      !> Command line of the run
      character(len=:), allocatable :: command_line
      !> Path of the input file
      character(len=:), allocatable :: input_file
      !> Text of the input file
      character(len=:), allocatable :: input_text
      !> All resolved settings, one per line
      character(len=:), allocatable :: resolved_input
      !> Seed of the scene
      integer(ip) :: seed = 0_ip
      !> Hash of the initial bodies; empty if there are none
      character(len=:), allocatable :: scene
      !> Start time of this attempt of the run (UTC)
      character(len=:), allocatable :: started
      !> Checkpoint from which this attempt was restarted; 'none' for the first attempt
      character(len=:), allocatable :: parent
   end type provenance_t

   !> Version of the file layout. It increases when a reader of the previous version would fail.
   integer(ip), parameter :: schema_version = 4_ip

contains

   !> Collect facts about build and machine, and store the input. Call it at the start of a run.
   subroutine collect_provenance(provenance, input_file, input_text, resolved_input, seed)
      type(provenance_t), intent(out) :: provenance
      !> Path of the input file
      character(len=*), intent(in) :: input_file
      !> Text of the input file
      character(len=*), intent(in) :: input_text
      !> All resolved settings, one per line
      character(len=*), intent(in) :: resolved_input
      !> Seed of the scene
      integer(ip), intent(in) :: seed
      type(error_t), allocatable :: ignored
      integer :: isa

      call choose_instruction_set(isa, ignored)
      provenance%instruction_set = isa_names(isa)
      provenance%version = program_version
      provenance%revision = git_revision
      provenance%build_type = build_type
      provenance%compiler = compiler_version()
      provenance%options = relevant_options(compiler_options())
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

   !> Write what a file contains, the version of its layout, and the group /provenance. Its entry `written` is the time
   !> of this call.
   subroutine write_provenance(file, content, provenance, error)
      !> File, open for writing
      type(hdf5_file_t), intent(inout) :: file
      !> What the file contains
      character(len=*), intent(in) :: content
      type(provenance_t), intent(in) :: provenance
      type(error_t), allocatable, intent(inout) :: error

      call file%write_attribute('/', 'content', content, error)
      call file%write_attribute('/', 'schema_version', schema_version, error)
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
      call file%write('/provenance/instruction_set', provenance%instruction_set, error)
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

   !> Command line of this process
   function command_line() result(text)
      character(len=:), allocatable :: text
      integer :: length

      call get_command(length=length)
      allocate (character(len=length) :: text)
      call get_command(text)
   end function command_line

   !> Compiler options without warning options, search paths and file names. The value of an omitted option may be a
   !> separate word.
   pure function relevant_options(options) result(relevant)
      !> Text of compiler_options()
      character(len=*), intent(in) :: options
      character(len=:), allocatable :: relevant
      character(len=:), allocatable :: word, rest
      logical :: skips_value
      integer :: k

      relevant = ''
      rest = trim(adjustl(options))//' '
      skips_value = .false.
      do while (len_trim(rest) > 0)
         k = index(rest, ' ')
         word = rest(:k - 1)
         rest = trim(adjustl(rest(k + 1:)))//' '
         if (word(1:1) == '-') skips_value = is_irrelevant(word)
         if (.not. skips_value) relevant = relevant//word//' '
      end do
      relevant = trim(relevant)
   end function relevant_options

   !> Whether an option is a warning option, a search path or a file name
   pure logical function is_irrelevant(word)
      character(len=*), intent(in) :: word
      character(len=9), parameter :: beginnings(8) = [character(len=9) :: &
         '-I', '-J', '-W', '-fpre-inc', '-dumpbase', '-auxbase', '-imultiar', '-fimplici']
      integer :: k

      is_irrelevant = .false.
      do k = 1, size(beginnings)
         if (index(word, trim(beginnings(k))) == 1) is_irrelevant = .true.
      end do
   end function is_irrelevant

   !> Entry of the provenance of a file; empty if it cannot be read
   function origin_of(path, entry) result(text)
      !> Path of an HDF5 file, and name of a data set in its group /provenance
      character(len=*), intent(in) :: path, entry
      character(len=:), allocatable :: text
      type(hdf5_file_t) :: file
      type(error_t), allocatable :: error

      text = ''
      call file%open(path, error)
      if (.not. allocated(error)) call file%read('/provenance/'//entry, text, error)
      call file%close(error)
      if (allocated(error)) text = ''
   end function origin_of

end module polydem_provenance
