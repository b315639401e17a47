!> The command line: tables of verbs and options, their parser and the usage text.
!>
!> Parsing is pure and works on an array of arguments. Only `read_command_line` queries the system.
module polydem_command_line
   use polydem_errors, only: error_t, input_error, raise
   use polydem_help_texts, only: help_text
   use polydem_namelist_entries, only: choices_of
   use polydem_option_values, only: read_count, read_duration
   use polydem_strings, only: join, quoted, split_words, suggestion
   implicit none
   private
   public :: command_t, parse_command, read_command_line, usage

   !> A parsed command line
   type :: command_t
      !> run, check, info, replay or bench; empty if only help or version is requested
      character(len=:), allocatable :: verb
      !> Path of the namelist, result or trace; empty if none is given
      character(len=:), allocatable :: file
      !> Overrides 'group.key=value' in the order given
      character(len=:), allocatable :: overrides(:)
      !> Number of threads; 0: default of the system
      integer :: threads = 0
      !> Whether results may be overwritten
      logical :: force = .false.
      !> Whether an interrupted run is restarted from its last checkpoint
      logical :: continues = .false.
      !> Whether a restart is allowed with changed settings
      logical :: may_change = .false.
      !> Limit of the elapsed time of a run [s]; 0: no limit
      integer :: limit = 0
      !> Neighbour finder of a replay
      character(len=:), allocatable :: finder
      !> Number of repetitions of a replay
      integer :: repeat = 1
      !> Number of steps of a replay; 0: all steps of the trace
      integer :: steps = 0
      !> Folder for the samples of a replay; empty: no samples
      character(len=:), allocatable :: samples
      !> Whether a replay compares every pair list with that of finder all_pairs
      logical :: oracle = .false.
      !> Whether a check prints the parts of the scene as a namelist, and nothing else
      logical :: expands = .false.
      !> Whether the files of a result are compared with their checksums
      logical :: checks = .false.
      !> How the program was called, for messages: polydem, or ./polydem by the launcher
      character(len=:), allocatable :: program
      !> Whether help is requested, for the verb or for all verbs
      logical :: help = .false.
      !> Whether the version is requested
      logical :: version = .false.
   end type command_t

   !> A verb
   type :: verb_t
      !> Name on the command line
      character(len=8) :: name
      !> File argument in the usage text
      character(len=16) :: file
      !> Whether the file argument is optional
      logical :: file_is_optional
   end type verb_t

   !> Table of verbs
   type(verb_t), parameter :: verbs(*) = [ &
      verb_t('run', 'FILE.nml', .false.), verb_t('check', 'FILE.nml', .false.), verb_t('info', '[RESULT.h5]', .true.), &
      verb_t('replay', 'TRACE.h5', .false.), verb_t('bench', 'FILE.nml', .false.)]

   !> An option; src/app/help explains it
   type :: option_t
      !> Name on the command line
      character(len=12) :: name
      !> Name of its value in the usage text; blank if it takes none
      character(len=16) :: value
      !> Verbs that accept the option, separated by blanks
      character(len=40) :: verbs
   end type option_t

   !> Names of all verbs
   character(len=*), parameter :: all_verbs = 'run check info replay bench'

   !> Table of options
   type(option_t), parameter :: options(*) = [ &
      option_t('--set', 'GROUP.KEY=VALUE', 'run check bench'), &
      option_t('--threads', 'T', 'run check replay'), &
      option_t('--ranks', 'R', 'run check'), &
      option_t('--expand', '', 'check'), &
      option_t('--force', '', 'run'), &
      option_t('--continue', '', 'run'), &
      option_t('--changed', '', 'run'), &
      option_t('--walltime', 'HH:MM:SS', 'run'), &
      option_t('--finder', 'NAME', 'replay'), &
      option_t('--repeat', 'R', 'replay'), &
      option_t('--steps', 'N', 'replay'), &
      option_t('--samples', 'FOLDER', 'replay'), &
      option_t('--oracle', '', 'replay'), &
      option_t('--check', '', 'info'), &
      option_t('--help', '', all_verbs), &
      option_t('--version', '', all_verbs)]

contains

   !> Read and parse the command line of the program.
   subroutine read_command_line(command, error)
      type(command_t), intent(out) :: command
      !> Names a verb or an option that is unknown, misplaced or incomplete
      type(error_t), allocatable, intent(inout) :: error
      integer :: k, length, longest

      longest = 0
      do k = 1, command_argument_count()
         call get_command_argument(k, length=length)
         longest = max(longest, length)
      end do
      call parse_arguments(command_argument_count(), longest, caller(), command, error)
   end subroutine read_command_line

   !> Collect n arguments of at most the given length and parse them.
   subroutine parse_arguments(n, length, program, command, error)
      integer, intent(in) :: n, length
      character(len=*), intent(in) :: program
      type(command_t), intent(out) :: command
      type(error_t), allocatable, intent(inout) :: error
      character(len=length) :: arguments(n)
      integer :: k

      do k = 1, n
         call get_command_argument(k, value=arguments(k))
      end do
      call parse_command(arguments, command, error, program)
   end subroutine parse_arguments

   !> How messages call the program: as the launcher says in POLYDEM_CALL, else polydem
   function caller() result(program)
      character(len=:), allocatable :: program
      character(len=16) :: text
      integer :: status

      call get_environment_variable('POLYDEM_CALL', text, status=status)
      program = 'polydem'
      if (status == 0 .and. text == './polydem') program = trim(text)
   end function caller

   !> Parse the arguments.
   pure subroutine parse_command(arguments, command, error, program)
      !> Arguments of the program, blank-padded
      character(len=*), intent(in) :: arguments(:)
      type(command_t), intent(out) :: command
      !> Names a verb or an option that is unknown, misplaced or incomplete
      type(error_t), allocatable, intent(inout) :: error
      !> How messages call the program; default: polydem
      character(len=*), intent(in), optional :: program
      character(len=len(arguments)) :: overrides(size(arguments))
      character(len=:), allocatable :: value
      logical :: only_files, used(size(options))
      integer :: k, n_overrides, which

      command%program = 'polydem'
      if (present(program)) command%program = program
      command%verb = ''
      command%file = ''
      command%finder = 'two_level'
      command%samples = ''
      used = .false.
      n_overrides = 0
      only_files = .false.
      k = 1
      do while (k <= size(arguments))
         if (only_files .or. arguments(k) (1:min(1, len(arguments))) /= '-') then
            call take_word(trim(arguments(k)), command, error)
            k = k + 1
         else if (arguments(k) == '--') then
            only_files = .true.
            k = k + 1
         else
            call take_option(arguments, command%verb, k, which, value, error)
            if (allocated(error)) return
            used(which) = .true.
            if (options(which)%name == '--set') then
               n_overrides = n_overrides + 1
               overrides(n_overrides) = value
            else
               call set_option(which, value, command, error)
            end if
         end if
         if (allocated(error)) return
      end do
      allocate (command%overrides, source=overrides(:n_overrides))
      call check_command(command, used, error)
   end subroutine parse_command

   !> Store a word that is not an option. The first word is the verb, the second is the file.
   pure subroutine take_word(word, command, error)
      character(len=*), intent(in) :: word
      type(command_t), intent(inout) :: command
      type(error_t), allocatable, intent(inout) :: error

      if (word == 'help' .and. command%verb == '' .and. .not. command%help) then
         command%help = .true.
      else if (command%verb == '') then
         command%verb = word
         if (all(verbs%name /= word)) call raise(error, input_error, 'unknown verb '//quoted(word)// &
            suggestion(word, verbs%name)//' ('//command%program//' --help explains them)')
      else if (word == '') then
         call raise(error, input_error, 'the name of the file is empty')
      else if (command%file == '') then
         command%file = word
      else
         call raise(error, input_error, command%verb//' takes one file, but '//quoted(command%file)// &
            ' and '//quoted(word)//' are given')
      end if
   end subroutine take_word

   !> Parse the option at position k, with its value after '=' or in the next argument. Advance k.
   pure subroutine take_option(arguments, verb, k, which, value, error)
      character(len=*), intent(in) :: arguments(:), verb
      integer, intent(inout) :: k
      integer, intent(out) :: which
      character(len=:), allocatable, intent(out) :: value
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: name
      integer :: equals

      equals = index(arguments(k)//'=', '=')
      name = trim(arguments(k) (:equals - 1))
      if (name == '-h') name = '--help'
      which = option_at(name)
      if (which == 0) then
         call raise(error, input_error, 'unknown option '//name// &
                    suggestion(name, pack(options%name, takes(options, verb))))
         return
      end if
      value = ''
      if (options(which)%value /= '') then
         if (equals > len(arguments)) then
            k = k + 1
            if (k <= size(arguments)) value = trim(arguments(k))
         else
            value = trim(arguments(k) (equals + 1:))
         end if
         if (value == '') call raise(error, input_error, name//' needs a value: '//name//' '// &
            trim(options(which)%value))
      else if (equals <= len(arguments)) then
         call raise(error, input_error, name//' takes no value')
      end if
      k = k + 1
   end subroutine take_option

   !> Whether a verb accepts an option; true for an empty verb
   elemental logical function takes(option, verb)
      type(option_t), intent(in) :: option
      character(len=*), intent(in) :: verb

      takes = verb == ''
      if (.not. takes) takes = any(split_words(option%verbs) == verb)
   end function takes

   !> Index of an option in the table; 0 if unknown
   pure integer function option_at(name)
      character(len=*), intent(in) :: name

      do option_at = 1, size(options)
         if (options(option_at)%name == name) return
      end do
      option_at = 0
   end function option_at

   !> Store the value of an option, except `--set`.
   pure subroutine set_option(which, value, command, error)
      integer, intent(in) :: which
      character(len=*), intent(in) :: value
      type(command_t), intent(inout) :: command
      type(error_t), allocatable, intent(inout) :: error

      select case (options(which)%name)
      case ('--threads')
         call read_count('--threads', value, command%threads, error)
      case ('--ranks')
         call raise(error, input_error, '--ranks is for the launcher: ./polydem run FILE.nml --ranks '// &
            value//'; else start the program of the preset mpi with mpirun -n '//value)
      case ('--force')
         command%force = .true.
      case ('--continue')
         command%continues = .true.
      case ('--changed')
         command%may_change = .true.
      case ('--walltime')
         call read_duration('--walltime', value, command%limit, error)
      case ('--finder')
         command%finder = value
         if (all(choices_of('bench', 'finders') /= value)) call raise(error, input_error, '--finder '// &
            value//': there is no such finder'//suggestion(value, choices_of('bench', 'finders')))
      case ('--repeat')
         call read_count('--repeat', value, command%repeat, error)
      case ('--steps')
         call read_count('--steps', value, command%steps, error)
      case ('--samples')
         command%samples = value
      case ('--oracle')
         command%oracle = .true.
      case ('--expand')
         command%expands = .true.
      case ('--check')
         command%checks = .true.
      case ('--help')
         command%help = .true.
      case default
         command%version = .true.
      end select
   end subroutine set_option

   !> Check that the verb and its file are given, and that the verb accepts all options used.
   pure subroutine check_command(command, used, error)
      type(command_t), intent(in) :: command
      logical, intent(in) :: used(:)
      type(error_t), allocatable, intent(inout) :: error
      integer :: k

      if (command%verb == '') then
         if (.not. (command%help .or. command%version)) call raise(error, input_error, &
            'a verb is missing; '//command%program//' --help explains them')
         return
      end if
      do k = 1, size(options)
         if (used(k) .and. .not. takes(options(k), command%verb)) then
            call raise(error, input_error, command%verb//' does not take '//trim(options(k)%name)// &
               '; it belongs to '//join(split_words(options(k)%verbs), ' and '))
            return
         end if
      end do
      if (command%continues .and. command%force) call raise(error, input_error, &
         '--continue cannot be combined with --force, which starts the run again; give only one of them')
      if (command%may_change .and. .not. command%continues) call raise(error, input_error, '--changed needs --continue')
      if (command%help .or. command%version .or. command%file /= '') return
      if (command%checks) call raise(error, input_error, '--check needs the folder of a result: '// &
         command%program//' info --check RESULT')
      do k = 1, size(verbs)
         if (verbs(k)%name /= command%verb .or. verbs(k)%file_is_optional) cycle
         call raise(error, input_error, &
                    command%verb//' needs a file: '//command%program//' '//command%verb//' '//trim(verbs(k)%file))
      end do
   end subroutine check_command

   !> Help text of a verb, or one line per verb
   pure function usage(verb, program) result(text)
      !> A verb, or an empty text for all verbs
      character(len=*), intent(in) :: verb
      !> How the program is called
      character(len=*), intent(in) :: program
      character(len=:), allocatable :: text, lines
      character(len=*), parameter :: line_end = new_line('a')
      character(len=28) :: call_text
      integer :: k, first, second

      if (verb /= '') then
         lines = help_text(verb)
         text = 'usage: '//program//' '//lines(:len(lines) - 1)
         return
      end if
      text = 'usage: '//program//' VERB [ARGUMENTS]'//line_end//line_end
      do k = 1, size(verbs)
         lines = help_text(trim(verbs(k)%name))
         first = index(lines, line_end)
         second = first + index(lines(first + 1:), line_end)
         call_text = '  '//lines(:index(lines, ' [OPTIONS]') - 1)
         text = text//call_text//lines(first + 1:second)
      end do
      text = text//line_end//program//' help VERB prints the options of a verb, '//program//' --version the version.'
   end function usage

end module polydem_command_line
