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
   use polydem_hdf5_location, only: dataset_location_t
   use polydem_kinds, only: dp, ip, precision_name
   use polydem_result_files, only: complete_name, name_in
   implicit none
   private
   public :: provenance_t, collect_provenance, threads_are_bound, write_provenance, origin_of, schema_version

   !> One fact
   type :: fact_t
      !> Name of its data set in the group /provenance, and its text
      character(len=:), allocatable :: name, text
   end type fact_t

   !> Origin of a result
   type :: provenance_t
      !> All facts but the numbers below
      type(fact_t), allocatable, private :: facts(:)
      !> Number of online processors
      integer(ip) :: cores = 0_ip
      !> Load average of the minute before the start
      real(dp) :: load = 0.0_dp
      !> Number of MPI ranks
      integer(ip) :: processes = 1_ip
      !> OpenMP threads per rank
      integer(ip) :: threads = 0_ip
      !> Number of processors available to the run
      integer(ip) :: processors = 0_ip
      !> Seed of the scene
      integer(ip) :: seed = 0_ip
      !> Where the origin of the coordinates lies in those of the program that made the polygons, (2) [m]
      real(dp) :: origin(2) = 0.0_dp
   contains
      procedure :: set
      procedure :: text_of
   end type provenance_t

   !> Version of the file layout. It increases when a reader of the previous version would fail.
   integer(ip), parameter :: schema_version = 8_ip

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
      call provenance%set('version', program_version)
      call provenance%set('revision', git_revision)
      call provenance%set('build_type', build_type)
      call provenance%set('compiler', compiler_version())
      call provenance%set('options', relevant_options(compiler_options()))
      call provenance%set('precision', trim(precision_name))
      call provenance%set('hdf5_version', library_version())
      call provenance%set('host', host_name())
      call provenance%set('processor', processor_name())
      call provenance%set('instruction_set', trim(isa_names(isa)))
      call provenance%set('clock', processor_clock())
      call provenance%set('caches', cache_sizes())
      call provenance%set('memory', memory_size())
      call provenance%set('governor', frequency_governor())
      call provenance%set('kernel', kernel_release())
      call provenance%set('binding', trim(merge('bound    ', 'not bound', threads_are_bound()))//', OMP_PROC_BIND '// &
         environment('OMP_PROC_BIND')//', OMP_PLACES '//environment('OMP_PLACES'))
      call provenance%set('wait_policy', environment('OMP_WAIT_POLICY'))
      call provenance%set('command_line', command_line())
      call provenance%set('input_file', input_file)
      call provenance%set('input_text', input_text)
      call provenance%set('resolved_input', resolved_input)
      call provenance%set('started', utc_now())
      ! Identifier of the run, checkpoint from which the run was restarted, hash of the initial bodies
      call provenance%set('run', '')
      call provenance%set('parent', 'none')
      call provenance%set('scene', '')
      ! Names of walls, with the identifiers of their bodies
      call provenance%set('walls', '')
      ! Why the run has so many threads
      call provenance%set('thread_choice', '')
      provenance%cores = cores_online()
      provenance%load = load_average()
      provenance%threads = int(omp_get_max_threads(), ip)
      provenance%processors = int(omp_get_num_procs(), ip)
      provenance%seed = seed
   end subroutine collect_provenance

   !> Set a fact.
   pure subroutine set(self, name, text)
      class(provenance_t), intent(inout) :: self
      !> Name of the fact, and its text
      character(len=*), intent(in) :: name, text
      integer :: k

      if (.not. allocated(self%facts)) allocate (self%facts(0))
      do k = 1, size(self%facts)
         if (self%facts(k)%name == name) self%facts(k)%text = text
         if (self%facts(k)%name == name) return
      end do
      self%facts = [self%facts, fact_t(name, text)]
   end subroutine set

   !> Text of a fact; empty if it is not set
   pure function text_of(self, name) result(text)
      class(provenance_t), intent(in) :: self
      !> Name of the fact
      character(len=*), intent(in) :: name
      character(len=:), allocatable :: text
      integer :: k

      text = ''
      if (.not. allocated(self%facts)) return
      do k = 1, size(self%facts)
         if (self%facts(k)%name == name) text = self%facts(k)%text
      end do
   end function text_of

   !> Whether OpenMP binds its threads to processors
   logical function threads_are_bound()
      threads_are_bound = omp_get_proc_bind() /= omp_proc_bind_false
   end function threads_are_bound

   !> Write what a file contains, the version of its layout, and the group /provenance. Its entry `file` is the final
   !> name of the file, `written` the time of this call.
   subroutine write_provenance(file, content, provenance, error)
      !> File, open for writing
      type(hdf5_file_t), intent(inout) :: file
      !> What the file contains
      character(len=*), intent(in) :: content
      type(provenance_t), intent(in) :: provenance
      type(error_t), allocatable, intent(inout) :: error
      type(dataset_location_t) :: place
      integer :: k

      if (allocated(error)) return
      place = file%location_of('/provenance/file')
      call file%write_attribute('/', 'content', content, error)
      call file%write_attribute('/', 'schema_version', schema_version, error)
      call file%write('/provenance/program', 'polydem', error)
      call file%write(place%name, complete_name(name_in(place%path)), error)
      do k = 1, size(provenance%facts)
         call file%write('/provenance/'//provenance%facts(k)%name, provenance%facts(k)%text, error)
      end do
      call file%write('/provenance/cores', provenance%cores, error)
      call file%write('/provenance/load', provenance%load, error)
      call file%write('/provenance/processes', provenance%processes, error)
      call file%write('/provenance/threads', provenance%threads, error)
      call file%write('/provenance/processors', provenance%processors, error)
      call file%write('/provenance/seed', provenance%seed, error)
      call file%write('/provenance/origin_x', provenance%origin(1), error, 'm')
      call file%write('/provenance/origin_y', provenance%origin(2), error, 'm')
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

   !> Entry of the provenance of a file; empty after an error
   function origin_of(path, entry, error) result(text)
      !> Path of an HDF5 file, and name of a data set in its group /provenance
      character(len=*), intent(in) :: path, entry
      !> Allocated if the entry is missing or cannot be read
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: text
      type(hdf5_file_t) :: file

      text = ''
      if (allocated(error)) return
      call file%open(path, error)
      call file%read('/provenance/'//entry, text, error)
      call file%close(error)
      if (allocated(error)) text = ''
   end function origin_of

end module polydem_provenance
