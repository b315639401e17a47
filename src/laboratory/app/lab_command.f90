!> The command line of the program `polydem_lab`: its verbs and options.
module polydem_lab_command
   use polydem_bench_table, only: entries
   use polydem_command_line, only: command_t, option_t, verb_t
   use polydem_errors, only: error_t, input_error, raise
   use polydem_lab_help_texts, only: texts => help_text
   use polydem_namelist_entries, only: row_in
   use polydem_option_values, only: read_count
   use polydem_strings, only: split_words, suggestion
   implicit none
   private
   public :: lab_command_t

   !> Table of verbs
   type(verb_t), parameter :: verbs(*) = [ &
      verb_t('replay', 'TRACE.h5', .false.), verb_t('bench', 'FILE.nml', .false.)]

   !> Names of all verbs
   character(len=*), parameter :: all_verbs = 'replay bench'

   !> Table of options
   type(option_t), parameter :: options(*) = [ &
      option_t('--set', 'GROUP.KEY=VALUE', 'bench'), &
      option_t('--threads', 'T', 'replay'), &
      option_t('--finder', 'NAME', 'replay'), &
      option_t('--repeat', 'R', 'replay'), &
      option_t('--steps', 'N', 'replay'), &
      option_t('--samples', 'FOLDER', 'replay'), &
      option_t('--oracle', '', 'replay'), &
      option_t('--help', '', all_verbs), &
      option_t('--version', '', all_verbs)]

   !> A command line of the program
   type, extends(command_t) :: lab_command_t
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
   contains
      procedure :: begin
      procedure :: set_option
      procedure, nopass :: help_text => texts
   end type lab_command_t

contains

   !> Set the name of the program, its verbs and options, and defaults.
   pure subroutine begin(self)
      class(lab_command_t), intent(inout) :: self

      self%program = 'polydem_lab'
      self%verbs = verbs
      self%options = options
      self%other = 'polydem'
      self%verbs_of_other = 'run check info'
      self%finder = 'two_level'
      self%samples = ''
   end subroutine begin

   !> Store the value of an option that only this program has.
   pure subroutine set_option(self, name, value, error)
      class(lab_command_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      character(len=*), intent(in) :: value
      type(error_t), allocatable, intent(inout) :: error

      select case (name)
      case ('--finder')
         self%finder = value
         associate (finders => split_words(entries(row_in(entries, 'bench', 'finders'))%allowed))
            if (all(finders /= value)) call raise(error, input_error, '--finder '//value// &
               ': there is no such finder'//suggestion(value, finders))
         end associate
      case ('--repeat')
         call read_count('--repeat', value, self%repeat, error)
      case ('--steps')
         call read_count('--steps', value, self%steps, error)
      case ('--samples')
         self%samples = value
      case default
         self%oracle = .true.
      end select
   end subroutine set_option

end module polydem_lab_command
