!> The verbs of runs.
module polydem_verbs
   use omp_lib, only: omp_get_max_threads, omp_get_thread_limit, omp_set_num_threads
   use polydem_check, only: check_simulation
   use polydem_check_result, only: check_result
   use polydem_communicator, only: communicator_t
   use polydem_errors, only: error_t
   use polydem_expand, only: expand_scene
   use polydem_host, only: environment
   use polydem_kinds, only: dp, ip
   use polydem_oversubscription, only: oversubscription
   use polydem_process, only: answer_question
   use polydem_process_limits, only: check_threads
   use polydem_read_settings, only: read_settings
   use polydem_result_info, only: describe_program, describe_result
   use polydem_run, only: run_options_t
   use polydem_run_command, only: run_command_t
   use polydem_run_simulation, only: run_simulation
   use polydem_console, only: print_line
   use polydem_settings, only: settings_t
   use polydem_signals, only: release_signals
   use polydem_thread_choice, only: thread_choice_t
   implicit none
   private
   public :: execute

contains

   !> Execute the verb of the command line. Collective.
   subroutine execute(command, comm, error)
      type(run_command_t), intent(in) :: command
      class(communicator_t), intent(inout) :: comm
      !> Allocated if the verb fails
      type(error_t), allocatable, intent(inout) :: error
      type(settings_t) :: settings
      type(run_options_t) :: options
      type(thread_choice_t) :: threads
      character(len=:), allocatable :: crowd, text

      if (command%help .or. command%version) then
         call answer_question(command, comm, error)
         return
      end if
      call set_threads(command, threads, error)
      if (command%verb == 'run') then
         if (.not. allocated(error)) call read_settings(command%file, command%overrides, settings, error)
         call comm%all_reduce_error(error)
         if (allocated(error)) return
         options%continues = command%continues
         options%may_change = command%may_change
         options%limit = real(command%limit, dp)
         options%threads = threads
         if (allocated(command%actions)) options%actions = command%actions
         call run_simulation(settings, command%force, error, options, comm)
         return
      end if
      call release_signals()
      crowd = ''
      if (command%verb == 'check') crowd = oversubscription(comm)
      ! The root rank alone executes the other verbs.
      if (allocated(error) .or. .not. comm%is_root()) return
      select case (command%verb)
      case ('check')
         call read_settings(command%file, command%overrides, settings, error)
         if (allocated(error)) return
         if (command%expands) then
            call expand_scene(settings, text, error)
            if (.not. allocated(error)) call print_line(text(:len(text) - 1), error)
         else
            call check_simulation(settings, error, crowd, threads)
         end if
      case default
         if (command%file == '') call describe_program(error)
         if (command%checks) then
            call check_result(command%file, error)
         else if (command%file /= '') then
            call describe_result(command%file, error)
         end if
      end select
   end subroutine execute

   !> Set the number of OpenMP threads, and check it against system limits: from the command line, otherwise from
   !> OMP_NUM_THREADS. Without both, `run` and `check` choose it once they know the scene.
   subroutine set_threads(command, choice, error)
      type(run_command_t), intent(in) :: command
      type(thread_choice_t), intent(out) :: choice
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: value

      if (command%verb == 'info') return
      if (command%threads > 0) then
         choice%reason = 'given by --threads'
         call check_threads(int(command%threads, ip), error)
         if (.not. allocated(error)) call omp_set_num_threads(command%threads)
      else
         value = environment('OMP_NUM_THREADS')
         choice%is_open = .not. is_given(value)
         if (choice%is_open) then
            call omp_set_num_threads(1)
         else
            choice%reason = 'given by OMP_NUM_THREADS'
            call omp_set_num_threads(min(omp_get_max_threads(), omp_get_thread_limit()))
         end if
         call check_threads(int(omp_get_max_threads(), ip), error)
      end if
   end subroutine set_threads

   !> Whether the value of OMP_NUM_THREADS is a number, or a list of numbers
   pure logical function is_given(value)
      character(len=*), intent(in) :: value

      is_given = scan(adjustl(value), '0123456789+') == 1
   end function is_given

end module polydem_verbs
