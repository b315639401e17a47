!> The verbs of the laboratory.
module polydem_lab_verbs
   use omp_lib, only: omp_get_max_threads, omp_get_num_procs, omp_get_thread_limit, omp_set_num_threads
   use polydem_bench, only: run_bench
   use polydem_bench_settings, only: bench_settings_t
   use polydem_communicator, only: communicator_t
   use polydem_console, only: warn
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip
   use polydem_lab_command, only: lab_command_t
   use polydem_oversubscription, only: oversubscription_text
   use polydem_process, only: answer_question
   use polydem_process_limits, only: check_threads
   use polydem_read_bench, only: read_bench
   use polydem_replay, only: replay_trace
   use polydem_signals, only: release_signals
   implicit none
   private
   public :: execute

contains

   !> Execute the verb of the command line: the root rank alone does.
   subroutine execute(command, comm, error)
      type(lab_command_t), intent(in) :: command
      class(communicator_t), intent(in) :: comm
      !> Allocated if the verb fails
      type(error_t), allocatable, intent(inout) :: error
      type(bench_settings_t) :: bench

      if (command%help .or. command%version) then
         call answer_question(command, comm, error)
         return
      end if
      call set_threads(command, error)
      call release_signals()
      if (allocated(error) .or. .not. comm%is_root()) return
      if (command%verb == 'replay') then
         call warn(oversubscription_text(int(max(1, command%threads), ip), int(omp_get_num_procs(), ip)))
         call replay_trace(command%file, command%finder, max(1, command%threads), command%repeat, error, &
                           int(command%steps, ip), command%samples, command%oracle)
      else
         call read_bench(command%file, command%overrides, bench, error)
         if (.not. allocated(error)) call check_threads(maxval(bench%threads), error)
         if (.not. allocated(error)) call run_bench(bench, error)
      end if
   end subroutine execute

   !> Set the number of OpenMP threads, and check it against system limits: that of a replay from the command line, that
   !> of a bench outside its samples from OMP_NUM_THREADS.
   subroutine set_threads(command, error)
      type(lab_command_t), intent(in) :: command
      type(error_t), allocatable, intent(inout) :: error

      if (command%threads > 0) then
         call check_threads(int(command%threads, ip), error)
         if (.not. allocated(error)) call omp_set_num_threads(command%threads)
      else if (command%verb == 'bench') then
         call omp_set_num_threads(min(omp_get_max_threads(), omp_get_thread_limit()))
         call check_threads(int(omp_get_max_threads(), ip), error)
      end if
   end subroutine set_threads

end module polydem_lab_verbs
