!> The profile of a run (profile.h5): timings of the stages, counters, provenance, hash of the final state. It is an
!> atomic file, written at the end of the run.
module polydem_profile_file
   use polydem_atomic_file, only: begin_file, complete_file
   use polydem_counters, only: counters_t
   use polydem_errors, only: error_t
   use polydem_hash, only: hexadecimal
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_kinds, only: dp, lp
   use polydem_provenance, only: provenance_t, write_provenance
   use polydem_result_files, only: profile_name
   use polydem_timers, only: stage_names, timers_t
   implicit none
   private
   public :: write_profile, read_final_status

contains

   !> Write profile.h5 into the folder of a result.
   subroutine write_profile(folder, timers, seconds, counters, provenance, state_hash, status, warnings, error, memory)
      !> Folder of the result
      character(len=*), intent(in) :: folder
      type(timers_t), intent(in) :: timers
      !> Elapsed time of the whole run [s]
      real(dp), intent(in) :: seconds
      !> Exact counts
      type(counters_t), intent(in) :: counters
      type(provenance_t), intent(in) :: provenance
      !> Hash of the final state
      integer(lp), intent(in) :: state_hash
      !> 'finished', or the reason why the run stopped
      character(len=*), intent(in) :: status
      !> Numbers of warnings of each kind in words, empty without one
      character(len=*), intent(in) :: warnings
      type(error_t), allocatable, intent(inout) :: error
      !> Resident memory after the last step [KiB]; not written if absent
      integer(lp), intent(in), optional :: memory
      type(hdf5_file_t) :: file
      character(len=:), allocatable :: path

      path = folder//'/'//profile_name
      call begin_file(file, path, error)
      call write_provenance(file, 'profile of a run by polydem', provenance, error)
      call file%write('/profile/stage', stage_names, error, '1', 'stages of the time step')
      call file%write('/profile/calls', timers%calls, error, '1', 'steps in which each stage ran')
      call file%write('/profile/total', timers%total, error, 's', 'time spent in each stage')
      call file%write('/profile/least', merge(timers%least, 0.0_dp, timers%calls > 0_lp), error, 's', &
                      'shortest time in a step')
      call file%write('/profile/most', timers%most, error, 's', 'longest time in a step')
      call file%write('/profile/seconds', seconds, error, 's', 'elapsed time of the whole run')
      if (allocated(counters%name)) then
         call file%write('/counters/name', counters%name, error, '1', 'name of each counter')
         call file%write('/counters/value', counters%value, error, '1', 'value of each counter')
         call file%write('/counters/scope', counters%scope, error, '1', 'what the value of each counter belongs to')
      end if
      call file%write('/state_hash', hexadecimal(state_hash), error, '1', &
                      'hash of the bits of identifiers, positions, angles and velocities at the end')
      call file%write('/status', status, error, '1', 'how the run ended')
      call file%write('/warnings', warnings, error, '1', 'numbers of warnings of each kind; empty without one')
      if (present(memory)) call file%write('/profile/memory', memory, error, 'KiB', 'resident after the last step')
      call complete_file(file, path, error)
   end subroutine write_profile

   !> Read the final status and the final state hash of a run.
   subroutine read_final_status(path, status, state_hash, error)
      !> Path of the profile
      character(len=*), intent(in) :: path
      !> 'finished', or the reason why the run stopped
      character(len=:), allocatable, intent(out) :: status
      !> Hash of the final state, hexadecimal
      character(len=:), allocatable, intent(out) :: state_hash
      type(error_t), allocatable, intent(inout) :: error
      type(hdf5_file_t) :: file

      call file%open(path, error)
      call file%read('/status', status, error)
      call file%read('/state_hash', state_hash, error)
      call file%close(error)
   end subroutine read_final_status

end module polydem_profile_file
