!> The command line of a program: its verbs and options, their parser and the usage text. Each program extends
!> `command_t` by its own options.
!>
!> Parsing is pure and works on an array of arguments. Only `read_command_line` queries the system.
module polydem_command_line
   use polydem_errors, only: error_t, input_error, raise
   use polydem_option_values, only: read_count
   use polydem_strings, only: join, quoted, split_words, suggestion
   implicit none
   private
   public :: command_t, option_t, verb_t, parse_command, read_command_line, usage

   !> A verb
   type :: verb_t
      !> Name on the command line
      character(len=8) :: name
      !> File argument in the usage text
      character(len=16) :: file
      !> Whether the file argument is optional
      logical :: file_is_optional
   end type verb_t

   !> An option; the help texts of the verbs explain it
   type :: option_t
      !> Name on the command line
      character(len=12) :: name
      !> Name of its value in the usage text; blank if it takes none
      character(len=16) :: value
      !> Verbs that accept the option, separated by blanks
      character(len=40) :: verbs
   end type option_t

   !> A parsed command line
   type, abstract :: command_t
      !> The verb; empty if only help or version is requested
      character(len=:), allocatable :: verb
      !> Path of the file of the verb; empty if none is given
      character(len=:), allocatable :: file
      !> Overrides 'group.key=value' in the order given
      character(len=:), allocatable :: overrides(:)
      !> Number of threads; 0: default of the system
      integer :: threads = 0
      !> How the program was called, for messages: its name, or ./polydem by the launcher
      character(len=:), allocatable :: program
      !> Whether help is requested, for the verb or for all verbs
      logical :: help = .false.
      !> Whether the version is requested
      logical :: version = .false.
      !> Verbs of the program
      type(verb_t), allocatable :: verbs(:)
      !> Options of the program; those of all programs are --set, --threads, --help and --version
      type(option_t), allocatable :: options(:)
      !> The other program, and its verbs, separated by blanks
      character(len=:), allocatable :: other, verbs_of_other
   contains
      procedure(begin), deferred :: begin
      procedure(set_option), deferred :: set_option
      procedure :: check => check_nothing
      procedure(help_text), deferred, nopass :: help_text
   end type command_t

   abstract interface
      !> Set the name of the program, its verbs and options, and defaults of its own options.
      pure subroutine begin(self)
         import :: command_t
         class(command_t), intent(inout) :: self
      end subroutine begin

      !> Store the value of an option that only this program has.
      pure subroutine set_option(self, name, value, error)
         import :: command_t, error_t
         class(command_t), intent(inout) :: self
         !> Name of the option
         character(len=*), intent(in) :: name
         !> Its value; empty if it takes none
         character(len=*), intent(in) :: value
         !> Allocated for a value that is none
         type(error_t), allocatable, intent(inout) :: error
      end subroutine set_option

      !> The call of a verb, its meaning in one line, and its options
      pure function help_text(verb) result(text)
         !> Name of the verb
         character(len=*), intent(in) :: verb
         character(len=:), allocatable :: text
      end function help_text
   end interface

contains

   !> Read and parse the command line of the program.
   subroutine read_command_line(command, error)
      !> A new one
      class(command_t), intent(inout) :: command
      !> Names a verb or an option that is unknown, misplaced or incomplete
      type(error_t), allocatable, intent(inout) :: error
      integer :: k, length, longest

      longest = 0
      do k = 1, command_argument_count()
         call get_command_argument(k, length=length)
         longest = max(longest, length)
      end do
      call parse_arguments(command_argument_count(), longest, command, error)
   end subroutine read_command_line

   !> Collect n arguments of at most the given length and parse them.
   subroutine parse_arguments(n, length, command, error)
      integer, intent(in) :: n, length
      class(command_t), intent(inout) :: command
      type(error_t), allocatable, intent(inout) :: error
      character(len=length) :: arguments(n)
      integer :: k

      do k = 1, n
         call get_command_argument(k, value=arguments(k))
      end do
      call parse_command(arguments, command, error, caller())
   end subroutine parse_arguments

   !> How the launcher says in POLYDEM_CALL that it is called; empty if it did not start the program
   function caller() result(program)
      character(len=:), allocatable :: program
      character(len=16) :: text
      integer :: status

      call get_environment_variable('POLYDEM_CALL', text, status=status)
      program = ''
      if (status == 0 .and. text == './polydem') program = trim(text)
   end function caller

   !> Parse arguments.
   pure subroutine parse_command(arguments, command, error, program)
      !> Arguments of the program, blank-padded
      character(len=*), intent(in) :: arguments(:)
      !> A new one
      class(command_t), intent(inout) :: command
      !> Names a verb or an option that is unknown, misplaced or incomplete
      type(error_t), allocatable, intent(inout) :: error
      !> How messages call the program; absent or empty: by its name
      character(len=*), intent(in), optional :: program
      character(len=len(arguments)) :: overrides(size(arguments))
      character(len=:), allocatable :: value
      logical, allocatable :: used(:)
      logical :: only_files
      integer :: k, n_overrides, which

      call command%begin()
      if (present(program)) then
         if (program /= '') command%program = program
      end if
      command%verb = ''
      command%file = ''
      allocate (used(size(command%options)), source=.false.)
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
            call take_option(arguments, command, k, which, value, error)
            if (allocated(error)) return
            used(which) = .true.
            select case (command%options(which)%name)
            case ('--set')
               n_overrides = n_overrides + 1
               overrides(n_overrides) = value
            case ('--threads')
               call read_count('--threads', value, command%threads, error)
            case ('--help')
               command%help = .true.
            case ('--version')
               command%version = .true.
            case default
               call command%set_option(trim(command%options(which)%name), value, error)
            end select
         end if
         if (allocated(error)) return
      end do
      allocate (command%overrides, source=overrides(:n_overrides))
      call check_command(command, used, error)
   end subroutine parse_command

   !> Store a word that is not an option. The first word is the verb, the second is the file.
   pure subroutine take_word(word, command, error)
      character(len=*), intent(in) :: word
      class(command_t), intent(inout) :: command
      type(error_t), allocatable, intent(inout) :: error

      if (word == 'help' .and. command%verb == '' .and. .not. command%help) then
         command%help = .true.
      else if (command%verb == '') then
         command%verb = word
         if (any(command%verbs%name == word)) return
         if (any(split_words(command%verbs_of_other) == word)) call raise(error, input_error, word// &
            ' is a verb of the program '//command%other//'; call '//command%other//' '//word)
         call raise(error, input_error, 'unknown verb '//quoted(word)//suggestion(word, command%verbs%name)//' ('// &
                    command%program//' --help explains them)')
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
   pure subroutine take_option(arguments, command, k, which, value, error)
      character(len=*), intent(in) :: arguments(:)
      class(command_t), intent(in) :: command
      integer, intent(inout) :: k
      integer, intent(out) :: which
      character(len=:), allocatable, intent(out) :: value
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: name
      integer :: equals

      equals = index(arguments(k)//'=', '=')
      name = trim(arguments(k) (:equals - 1))
      if (name == '-h') name = '--help'
      which = option_at(command%options, name)
      if (which == 0) then
         call raise(error, input_error, 'unknown option '//name// &
                    suggestion(name, pack(command%options%name, takes(command%options, command%verb))))
         return
      end if
      value = ''
      if (command%options(which)%value /= '') then
         if (equals > len(arguments)) then
            k = k + 1
            if (k <= size(arguments)) value = trim(arguments(k))
         else
            value = trim(arguments(k) (equals + 1:))
         end if
         if (value == '') call raise(error, input_error, name//' needs a value: '//name//' '// &
            trim(command%options(which)%value))
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
   pure integer function option_at(options, name)
      type(option_t), intent(in) :: options(:)
      character(len=*), intent(in) :: name

      do option_at = 1, size(options)
         if (options(option_at)%name == name) return
      end do
      option_at = 0
   end function option_at

   !> Check that the verb and its file are given, and that the verb accepts all options used.
   pure subroutine check_command(command, used, error)
      class(command_t), intent(in) :: command
      logical, intent(in) :: used(:)
      type(error_t), allocatable, intent(inout) :: error
      integer :: k

      if (command%verb == '') then
         if (.not. (command%help .or. command%version)) call raise(error, input_error, &
            'a verb is missing; '//command%program//' --help explains them')
         return
      end if
      do k = 1, size(command%options)
         if (used(k) .and. .not. takes(command%options(k), command%verb)) then
            call raise(error, input_error, command%verb//' does not take '//trim(command%options(k)%name)// &
               '; it belongs to '//join(split_words(command%options(k)%verbs), ' and '))
            return
         end if
      end do
      call command%check(error)
      if (command%help .or. command%version .or. command%file /= '') return
      do k = 1, size(command%verbs)
         associate (verb => command%verbs(k))
            if (verb%name /= command%verb .or. verb%file_is_optional) cycle
            call raise(error, input_error, command%verb//' needs a file: '//command%program//' '//command%verb//' '// &
                       trim(verb%file))
         end associate
      end do
   end subroutine check_command

   !> Check options that depend on each other. A program without such options has no check of its own.
   pure subroutine check_nothing(self, error)
      class(command_t), intent(in) :: self
      !> Allocated if options cannot be combined
      type(error_t), allocatable, intent(inout) :: error

      associate (unused => self%help, unused_error => allocated(error))
      end associate
   end subroutine check_nothing

   !> Help text of the verb of a command, or one line per verb
   pure function usage(command) result(text)
      !> Without a verb: for all verbs
      class(command_t), intent(in) :: command
      character(len=:), allocatable :: text, lines
      character(len=*), parameter :: line_end = new_line('a')
      character(len=28) :: call_text
      integer :: k, first, second

      associate (program => command%program)
         if (command%verb /= '') then
            lines = command%help_text(command%verb)
            text = 'usage: '//program//' '//lines(:len(lines) - 1)
            return
         end if
         text = 'usage: '//program//' VERB [ARGUMENTS]'//line_end//line_end
         do k = 1, size(command%verbs)
            lines = command%help_text(trim(command%verbs(k)%name))
            first = index(lines, line_end)
            second = first + index(lines(first + 1:), line_end)
            call_text = '  '//lines(:index(lines, ' [OPTIONS]') - 1)
            text = text//call_text//lines(first + 1:second)
         end do
         text = text//line_end//program//' help VERB prints the options of a verb, '//program//' --version the version.'
      end associate
   end function usage

end module polydem_command_line
