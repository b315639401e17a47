!> The command line of the program `polydem`: its verbs and options.
module polydem_run_command
   use polydem_command_line, only: command_t, option_t, verb_t
   use polydem_errors, only: error_t, input_error, raise
   use polydem_option_values, only: read_duration
   use polydem_help_texts, only: texts => help_text
   implicit none
   private
   public :: run_command_t

   !> Table of verbs
   type(verb_t), parameter :: verbs(*) = [ &
      verb_t('run', 'FILE.nml', .false.), verb_t('check', 'FILE.nml', .false.), verb_t('info', '[RESULT.h5]', .true.)]

   !> Names of all verbs
   character(len=*), parameter :: all_verbs = 'run check info'

   !> Table of options
   type(option_t), parameter :: options(*) = [ &
      option_t('--set', 'GROUP.KEY=VALUE', 'run check'), &
      option_t('--threads', 'T', 'run check'), &
      option_t('--ranks', 'R', 'run check'), &
      option_t('--expand', '', 'check'), &
      option_t('--force', '', 'run'), &
      option_t('--continue', '', 'run'), &
      option_t('--changed', '', 'run'), &
      option_t('--walltime', 'HH:MM:SS', 'run'), &
      option_t('--actions', 'FILE', 'run'), &
      option_t('--check', '', 'info'), &
      option_t('--help', '', all_verbs), &
      option_t('--version', '', all_verbs)]

   !> A command line of the program
   type, extends(command_t) :: run_command_t
      !> Whether results may be overwritten
      logical :: force = .false.
      !> Whether an interrupted run is restarted from its last checkpoint
      logical :: continues = .false.
      !> Whether a restart is allowed with changed settings
      logical :: may_change = .false.
      !> Limit of the elapsed time of a run [s]; 0: no limit
      integer :: limit = 0
      !> Path of a file of actions; unallocated: there is none
      character(len=:), allocatable :: actions
      !> Whether a check prints the parts of the scene as a namelist, and nothing else
      logical :: expands = .false.
      !> Whether the files of a result are compared with their checksums
      logical :: checks = .false.
   contains
      procedure :: begin
      procedure :: set_option
      procedure :: check
      procedure, nopass :: help_text => texts
   end type run_command_t

contains

   !> Set the name of the program, its verbs and options.
   pure subroutine begin(self)
      class(run_command_t), intent(inout) :: self

      self%program = 'polydem'
      self%verbs = verbs
      self%options = options
      self%other = 'polydem_lab'
      self%verbs_of_other = 'bench replay'
   end subroutine begin

   !> Store the value of an option that only this program has.
   pure subroutine set_option(self, name, value, error)
      class(run_command_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      character(len=*), intent(in) :: value
      type(error_t), allocatable, intent(inout) :: error

      select case (name)
      case ('--ranks')
         call raise(error, input_error, '--ranks is for the launcher: ./polydem run FILE.nml --ranks '// &
            value//'; else start the program of the preset mpi with mpirun -n '//value)
      case ('--force')
         self%force = .true.
      case ('--continue')
         self%continues = .true.
      case ('--changed')
         self%may_change = .true.
      case ('--walltime')
         call read_duration('--walltime', value, self%limit, error)
      case ('--actions')
         self%actions = value
      case ('--expand')
         self%expands = .true.
      case default
         self%checks = .true.
      end select
   end subroutine set_option

   !> Check options that depend on each other.
   pure subroutine check(self, error)
      class(run_command_t), intent(in) :: self
      type(error_t), allocatable, intent(inout) :: error

      if (self%continues .and. self%force) call raise(error, input_error, &
         '--continue cannot be combined with --force, which starts the run again; give only one of them')
      if (self%may_change .and. .not. self%continues) call raise(error, input_error, '--changed needs --continue')
      if (self%help .or. self%version .or. self%file /= '') return
      if (self%checks) call raise(error, input_error, '--check needs the folder of a result: '// &
         self%program//' info --check RESULT')
   end subroutine check

end module polydem_run_command
