!> The program: understands the command line, does what it says, and is the only place that stops.
program polydem
   use, intrinsic :: iso_c_binding, only: c_int
   use omp_lib, only: omp_get_max_threads, omp_get_num_procs, omp_get_thread_limit, omp_set_num_threads
   use polydem_bench, only: run_bench
   use polydem_bench_settings, only: bench_settings_t
   use polydem_build_info, only: git_revision, program_version
   use polydem_check, only: check_simulation
   use polydem_check_result, only: check_result
   use polydem_command_line, only: command_t, read_command_line, usage
   use polydem_crowding, only: crowding, crowding_text
   use polydem_errors, only: error_t
   use polydem_hdf5_file, only: start_library
   use polydem_info, only: describe_program, describe_result
   use polydem_join_team, only: join_team
   use polydem_kinds, only: dp, ip
   use polydem_line_writer, only: line_writer_t
   use polydem_process_limits, only: check_stack, check_threads
   use polydem_read_bench, only: read_bench
   use polydem_read_settings, only: read_settings
   use polydem_replay, only: replay_trace
   use polydem_run, only: attempt_t, run_simulation
   use polydem_settings, only: settings_t
   use polydem_signals, only: survive_failed_writes
   use polydem_standard_streams, only: secure_streams
   use polydem_strings, only: printable
   use polydem_team, only: team_t
   implicit none

   interface
      !> C exit: ends the program with a code and without a word
      subroutine c_exit(code) bind(C, name='exit')
         import :: c_int
         integer(c_int), value :: code
      end subroutine c_exit
   end interface

   type(command_t) :: command
   type(error_t), allocatable :: error
   class(team_t), allocatable :: team

   call secure_streams()
   call survive_failed_writes()
   call check_stack(1_ip, error)
   if (allocated(error)) then
      call warn(error%message)
      call c_exit(int(error%code, c_int))
   end if
   ! HDF5 must outlive MPI, so it comes first.
   call start_library(error)
   call join_team(team, error)
   if (.not. allocated(error)) call read_command_line(command, error)
   if (.not. allocated(error)) call obey(command, error)
   if (allocated(error) .and. team%leads()) call warn(error%message)
   call team%leave()
   if (allocated(error)) call c_exit(int(error%code, c_int))

contains

   !> Do what the command line says.
   subroutine obey(command, error)
      type(command_t), intent(in) :: command
      type(error_t), allocatable, intent(inout) :: error
      type(settings_t) :: settings
      type(bench_settings_t) :: bench
      character(len=:), allocatable :: crowd

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
         call team%agree(error)
         if (.not. allocated(error)) call run_simulation(settings, command%force, error, attempt_t( &
            continues=command%continues, may_change=command%may_change, limit=real(command%limit, dp)), team)
         return
      end if
      crowd = ''
      if (command%verb == 'check') crowd = crowding(team)
      ! The other verbs are those of one process.
      if (allocated(error) .or. .not. team%leads()) return
      select case (command%verb)
      case ('check')
         call read_settings(command%file, command%overrides, settings, error)
         if (.not. allocated(error)) call check_simulation(settings, error, crowd)
      case ('replay')
         call warn(crowding_text(int(max(1, command%threads), ip), int(omp_get_num_procs(), ip)))
         call replay_trace(command%file, command%finder, max(1, command%threads), command%repeat, error, &
                           int(command%steps, ip), command%samples, command%oracle)
      case ('bench')
         call read_bench(command%file, command%overrides, bench, error)
         if (.not. allocated(error)) call check_threads(maxval(bench%threads), error)
         if (.not. allocated(error)) call run_bench(bench, error)
      case default
         if (command%file == '') call describe_program(error)
         if (command%checks) then
            call check_result(command%file, error)
         else if (command%file /= '') then
            call describe_result(command%file, error)
         end if
      end select
   end subroutine obey

   !> As many threads as the command line says, or else OpenMP, and no more than there can be.
   subroutine choose_threads(command, error)
      type(command_t), intent(in) :: command
      type(error_t), allocatable, intent(inout) :: error

      if (command%verb == 'info') return
      if (command%threads > 0) then
         call check_threads(int(command%threads, ip), error)
         if (.not. allocated(error)) call omp_set_num_threads(command%threads)
      else if (command%verb /= 'replay') then
         call omp_set_num_threads(min(omp_get_max_threads(), omp_get_thread_limit()))
         call check_threads(int(omp_get_max_threads(), ip), error)
      end if
   end subroutine choose_threads

   !> Write a line, or several, on the screen of the leader.
   subroutine print_line(text, error)
      character(len=*), intent(in) :: text
      type(error_t), allocatable, intent(inout) :: error
      type(line_writer_t) :: screen

      if (.not. team%leads()) return
      call screen%open_screen()
      call screen%put_line(text)
      call screen%close(error)
   end subroutine print_line

   !> Write a message to standard error; nothing happens if it is empty.
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
