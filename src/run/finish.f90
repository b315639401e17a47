!> The end of a run: a last frame after a failure, the profile, and the summary of the log.
module polydem_finish
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use polydem_counters, only: counters_t
   use polydem_end_warnings, only: write_end_warnings
   use polydem_energy_report, only: write_energy_report
   use polydem_errors, only: error_t, run_error
   use polydem_global_hash, only: hash_all_bodies
   use polydem_hash, only: hexadecimal
   use polydem_host, only: resident_memory
   use polydem_kinds, only: dp, ip, lp
   use polydem_log, only: log_t
   use polydem_log_tables, only: write_counters, write_hash, write_ranks, write_timings
   use polydem_monitor, only: report_pending_warnings, warnings_in_words, write_warning_counts
   use polydem_profile_file, only: write_profile
   use polydem_result_files, only: profile_name, series_name
   use polydem_run, only: run_t
   use polydem_run_output, only: update_balance, write_frame
   use polydem_series_csv, only: write_series_csv
   use polydem_simulation_counters, only: report_counters
   use polydem_time_step, only: tabulate_contacts
   use polydem_strings, only: to_text
   use polydem_timers, only: n_stages
   implicit none
   private
   public :: finish, write_csv

contains

   !> After a numerical failure, write the state at which the run stopped as a last frame, unless the state of a body is
   !> not finite; collective.
   subroutine write_last_frame(run, code, error)
      type(run_t), intent(inout) :: run
      !> Exit code of the failure
      integer, intent(in) :: code
      type(error_t), allocatable, intent(inout) :: error
      integer(lp) :: is_not_finite(1)

      associate (s => run%simulation, bodies => run%simulation%bodies)
         if (code /= run_error .or. s%step <= max(run%last_frame, run%previous%last_frame)) return
         is_not_finite = merge(0_lp, 1_lp, all(ieee_is_finite(bodies%position)) &
                               .and. all(ieee_is_finite(bodies%velocity)) .and. all(ieee_is_finite(bodies%angle)) &
                               .and. all(ieee_is_finite(bodies%angular_velocity)))
         call run%comm%all_reduce_max(is_not_finite)
         if (is_not_finite(1) == 1_lp) return
         call update_balance(run)
         call tabulate_contacts(s)
      end associate
      call write_frame(run, error)
   end subroutine write_last_frame

   !> End a run, also after a failure: close the trajectory, write the profile and the summary of the log; collective.
   subroutine finish(run, seconds, error)
      type(run_t), intent(inout) :: run
      !> Elapsed time of the run with its previous starts [s]
      real(dp), intent(in) :: seconds
      !> On entry the reason why the run did not finish; on return that, or a failure to write the end
      type(error_t), allocatable, intent(inout) :: error
      type(error_t), allocatable :: write_error
      type(counters_t) :: counters
      character(len=:), allocatable :: status
      integer(lp) :: hash, memory, at_end

      memory = resident_memory()
      status = 'finished'
      if (allocated(error)) status = error%message
      associate (s => run%simulation)
         call hash_all_bodies(run%comm, s%bodies, hash)
         call report_counters(s, counters)
         call report_pending_warnings(s, run%log)
         if (allocated(error)) call write_last_frame(run, error%code, write_error)
         call run%trajectory%close(write_error, run%manifest)
         if (s%settings%output%csv .and. run%comm%is_root()) call write_csv(run, write_error)
         call run%recorder%close(run%log, run%manifest, write_error)
         call run%checkpoints%close(run%log)
         call write_timings(run%log, s%timers, seconds, s%step, s%bodies%n_all)
         call write_rank_times(run, run%log)
         call write_counters(run%log, counters)
         at_end = run%log%warnings
         if (s%settings%output%energy_balance) call write_energy_report(s, run%log)
         if (.not. allocated(error)) call write_end_warnings(s, run%log)
         at_end = run%log%warnings - at_end
         call write_warning_counts(run%monitor, s, run%log)
         if (at_end > 0_lp) call run%log%write_line('warnings: '//to_text(at_end)//' at the end')
         if (allocated(error)) call run%log%write_line('stopped: '//status)
         call write_hash(run%log, hexadecimal(hash))
         ! The profile comes last: a result with a profile has the whole log.
         if (run%comm%is_root()) call write_profile(run%folder, s%timers, seconds, counters, run%provenance, hash, &
                                                  status, warnings_in_words(run%monitor, s, at_end), write_error, &
                                                 memory)
         call run%manifest%close_file(run%folder//'/'//profile_name, write_error)
      end associate
      call run%log%close(write_error)
      if (.not. allocated(error) .and. allocated(write_error)) call move_alloc(write_error, error)
      call run%comm%all_reduce_error(error)
   end subroutine finish

   !> Write the series as comma-separated values. Called by the root rank only.
   subroutine write_csv(run, error)
      !> The run; its segments are closed, and its series has its columns
      type(run_t), intent(inout) :: run
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error

      if (allocated(error)) return
      call run%manifest%reopen(run%folder//'/'//series_name, error)
      call write_series_csv(run%folder//'/'//series_name, run%folder, run%trajectory%number, &
                            run%simulation%series%row, error)
      call run%manifest%close_file(run%folder//'/'//series_name, error)
   end subroutine write_csv

   !> Write the distribution of the time of each stage over the ranks; collective.
   subroutine write_rank_times(run, log)
      type(run_t), intent(inout) :: run
      type(log_t), intent(inout) :: log
      real(dp), allocatable :: total(:)
      integer(ip), allocatable :: counts(:)

      if (run%comm%size == 1_ip) return
      call run%comm%gather(run%simulation%timers%total, total, counts)
      call write_ranks(log, reshape(total, [n_stages, int(run%comm%size)]))
   end subroutine write_rank_times

end module polydem_finish
