!> The main program. It reads the command line, executes the verb and sets the exit code. No other module stops the
!> program.
program polydem
   use, intrinsic :: iso_c_binding, only: c_int
   use omp_lib, only: omp_get_max_threads, omp_get_num_procs, omp_get_thread_limit, omp_set_num_threads
   use polydem_bench, only: run_bench
   use polydem_bench_settings, only: bench_settings_t
   use polydem_build_info, only: git_revision, program_version
   use polydem_check, only: check_simulation
   use polydem_check_result, only: check_result
   use polydem_command_line, only: command_t, read_command_line, usage
   use polydem_communicator, only: communicator_t
   use polydem_convert_file, only: convert_file
   use polydem_errors, only: error_t
   use polydem_hdf5_file, only: start_library
   use polydem_kinds, only: dp, ip
   use polydem_line_writer, only: line_writer_t
   use polydem_oversubscription, only: oversubscription, oversubscription_text
   use polydem_process_limits, only: check_stack, check_threads
   use polydem_read_bench, only: read_bench
   use polydem_read_settings, only: read_settings
   use polydem_replay, only: replay_trace
   use polydem_result_info, only: describe_program, describe_result
   use polydem_run, only: attempt_t
   use polydem_run_simulation, only: run_simulation
   use polydem_settings, only: settings_t
   use polydem_signals, only: ignore_write_signals
   use polydem_standard_streams, only: open_closed_streams
   use polydem_strings, only: printable
   use polydem_world_communicator, only: create_world
   implicit none

   interface
      !> C function exit: ends the program with an exit code and without output
      subroutine c_exit(code) bind(C, name='exit')
         import :: c_int
         integer(c_int), value :: code
      end subroutine c_exit
   end interface

   type(command_t) :: command
   type(error_t), allocatable :: error
   class(communicator_t), allocatable :: comm

   call open_closed_streams()
   call ignore_write_signals()
   call check_stack(1_ip, error)
   if (allocated(error)) then
      call warn(error%message)
      call c_exit(int(error%code, c_int))
   end if
   ! HDF5 must outlive MPI and is therefore started first.
   call start_library(error)
   call create_world(comm, error)
   if (.not. allocated(error)) call read_command_line(command, error)
   if (.not. allocated(error)) call obey(command, error)
   if (allocated(error) .and. comm%is_root()) call warn(error%message)
   call comm%finalize()
   if (allocated(error)) call c_exit(int(error%code, c_int))

contains

   !> Execute the command line.
   subroutine obey(command, error)
      type(command_t), intent(in) :: command
      type(error_t), allocatable, intent(inout) :: error
      type(settings_t) :: settings
      type(bench_settings_t) :: bench
      character(len=:), allocatable :: crowd, report

      if (command%help) then
         call print_line(usage(command%verb), error)
         return
      else if (command%version) then
         call print_line('polydem '//program_version//' (git '//git_revision//')', error)
         return
      end if
      call choose_threads(command, error)
      if (command%verb == 'run') then
         if (.not. allocated(error)) call read_settings(command%file, command%overrides, settings, error)
         call comm%all_reduce_error(error)
         if (.not. allocated(error)) call run_simulation(settings, command%force, error, attempt_t( &
            continues=command%continues, may_change=command%may_change, limit=real(command%limit, dp)), comm)
         return
      end if
      crowd = ''
      if (command%verb == 'check') crowd = oversubscription(comm)
      ! The root rank alone executes the other verbs.
      if (allocated(error) .or. .not. comm%is_root()) return
      select case (command%verb)
      case ('check')
         call read_settings(command%file, command%overrides, settings, error)
         if (.not. allocated(error)) call check_simulation(settings, error, crowd)
      case ('replay')
         call warn(oversubscription_text(int(max(1, command%threads), ip), int(omp_get_num_procs(), ip)))
         call replay_trace(command%file, command%finder, max(1, command%threads), command%repeat, error, &
                           int(command%steps, ip), command%samples, command%oracle)
      case ('bench')
         call read_bench(command%file, command%overrides, bench, error)
         if (.not. allocated(error)) call check_threads(maxval(bench%threads), error)
         if (.not. allocated(error)) call run_bench(bench, error)
      case ('convert')
         call convert_file(command%file, command%output, report, error)
         if (.not. allocated(error)) call print_line(report, error)
      case default
         if (command%file == '') call describe_program(error)
         if (command%checks) then
            call check_result(command%file, error)
         else if (command%file /= '') then
            call describe_result(command%file, error)
         end if
      end select
   end subroutine obey

   !> Set the number of OpenMP threads: from the command line, otherwise the OpenMP default. Check it against system
   !> limits.
   subroutine choose_threads(command, error)
      type(command_t), intent(in) :: command
      type(error_t), allocatable, intent(inout) :: error

      if (command%verb == 'info' .or. command%verb == 'convert') return
      if (command%threads > 0) then
         call check_threads(int(command%threads, ip), error)
         if (.not. allocated(error)) call omp_set_num_threads(command%threads)
      else if (command%verb /= 'replay') then
         call omp_set_num_threads(min(omp_get_max_threads(), omp_get_thread_limit()))
         call check_threads(int(omp_get_max_threads(), ip), error)
      end if
   end subroutine choose_threads

   !> Write one or several lines to the standard output of the root rank.
   subroutine print_line(text, error)
      character(len=*), intent(in) :: text
      type(error_t), allocatable, intent(inout) :: error
      type(line_writer_t) :: screen

      if (.not. comm%is_root()) return
      call screen%open_screen()
      call screen%put_line(text)
      call screen%close(error)
   end subroutine print_line

   !> Write a message to standard error. A no-op if the message is empty.
   subroutine warn(message)
      character(len=*), intent(in) :: message
      type(line_writer_t) :: screen
      type(error_t), allocatable :: ignored

      if (message == '') return
      call screen%open_errors()
      call screen%put_line('polydem: '//printable(message, keeps_lines=.true.))
      call screen%close(ignored)
   end subroutine warn

end program polydem
