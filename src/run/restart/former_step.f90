!> The time step of the previous starts of a run. A run that goes on keeps it, so that a step that is chosen
!> automatically does not change with the duration or with other entries.
module polydem_former_step
   use polydem_broadcaster, only: broadcaster_t
   use polydem_checkpoint_fields, only: restarts_t, serialize_progress
   use polydem_checkpoint_file, only: checkpoint_file_t
   use polydem_errors, only: error_t
   use polydem_file_system, only: exists
   use polydem_kinds, only: ip, lp, wp
   use polydem_result_files, only: checkpoint_path, n_checkpoints
   use polydem_run, only: run_t
   implicit none
   private
   public :: find_former_step

contains

   !> Find the time step of the checkpoint from which a run goes on. What is wrong with the files is found again, and
   !> reported, once the folder is locked. Collective.
   subroutine find_former_step(run, dt)
      type(run_t), intent(inout) :: run
      !> The time step [s]; 0: there is no checkpoint
      real(wp), intent(out) :: dt
      type(broadcaster_t) :: broadcaster
      type(error_t), allocatable :: ignored
      integer(lp) :: newest
      integer(ip) :: k

      dt = 0.0_wp
      if (.not. run%options%continues) return
      newest = -1_lp
      do k = 1_ip, merge(n_checkpoints, 0_ip, run%comm%is_root())
         if (allocated(ignored)) deallocate (ignored)
         if (.not. exists(checkpoint_path(run%folder, k), ignored)) cycle
         call read_step(checkpoint_path(run%folder, k), newest, dt, ignored)
      end do
      allocate (broadcaster%comm, source=run%comm)
      broadcaster%is_reading = .not. run%comm%is_root()
      call broadcaster%field('/run/time_step', dt, 's', 'time step')
   end subroutine find_former_step

   !> Read the time step of a checkpoint if it is newer than others.
   subroutine read_step(path, newest, dt, error)
      character(len=*), intent(in) :: path
      !> Number of steps of the newest checkpoint so far
      integer(lp), intent(inout) :: newest
      !> Its time step
      real(wp), intent(inout) :: dt
      type(error_t), allocatable, intent(inout) :: error
      type(checkpoint_file_t) :: file
      type(restarts_t) :: restarts
      integer(lp) :: step
      real(wp) :: found

      call file%open(path, error)
      if (allocated(error)) return
      step = -1_lp
      found = 0.0_wp
      call serialize_progress(file, step, restarts)
      call file%field('/run/time_step', found, 's', 'time step')
      call file%close(error)
      if (allocated(error) .or. step <= newest .or. .not. found > 0.0_wp) return
      newest = step
      dt = found
   end subroutine read_step

end module polydem_former_step
