!> The program: understands the command line, does what it says, and is the only place that stops.
program polydem
   use, intrinsic :: iso_c_binding, only: c_int
   use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
   use omp_lib, only: omp_set_num_threads
   use polydem_bench, only: run_bench
   use polydem_bench_settings, only: bench_settings_t
   use polydem_build_info, only: git_revision, program_version
   use polydem_check, only: check_simulation
   use polydem_check_result, only: check_result
   use polydem_command_line, only: command_t, read_command_line, usage
   use polydem_errors, only: error_t
   use polydem_hdf5_file, only: start_library
   use polydem_info, only: describe_program, describe_result
   use polydem_join_team, only: join_team
   use polydem_kinds, only: dp, ip
   use polydem_read_bench, only: read_bench
   use polydem_read_settings, only: read_settings
   use polydem_replay, only: replay_trace
   use polydem_run, only: attempt_t, run_simulation
   use polydem_settings, only: settings_t
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

   ! HDF5 must outlive MPI, so it comes first.
   call start_library(error)
   call join_team(team, error)
   if (.not. allocated(error)) call read_command_line(command, error)
   if (.not. allocated(error)) call obey(command, error)
   flush (output_unit)
   if (allocated(error)) then
      if (team%leads()) write (error_unit, '(2a)') 'polydem: ', error%message
      flush (error_unit)
   end if
   call team%leave()
   if (allocated(error)) call c_exit(int(error%code, c_int))

contains

   !> Do what the command line says.
   subroutine obey(command, error)
      type(command_t), intent(in) :: command
      type(error_t), allocatable, intent(inout) :: error
      type(settings_t) :: settings
      type(bench_settings_t) :: bench

      if (command%help) then
         if (team%leads()) write (output_unit, '(a)') usage(command%verb)
         return
      else if (command%version) then
         if (team%leads()) write (output_unit, '(5a)') 'polydem ', program_version, ' (git ', git_revision, ')'
         return
      end if
      if (command%threads > 0) call omp_set_num_threads(command%threads)
      if (command%verb == 'run') then
         call read_settings(command%file, command%overrides, settings, error)
         call team%agree(error)
         if (.not. allocated(error)) call run_simulation(settings, command%force, error, attempt_t( &
            continues=command%continues, may_change=command%may_change, limit=real(command%limit, dp)), team)
         return
      end if
      ! The other verbs are those of one process.
      if (.not. team%leads()) return
      select case (command%verb)
      case ('check')
         call read_settings(command%file, command%overrides, settings, error)
         if (.not. allocated(error)) call check_simulation(settings, error)
      case ('replay')
         call replay_trace(command%file, command%finder, max(1, command%threads), command%repeat, error, &
                           int(command%steps, ip), command%samples, command%oracle)
      case ('bench')
         call read_bench(command%file, command%overrides, bench, error)
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

end program polydem
