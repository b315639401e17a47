!> Start of a run: builds the simulation on all ranks, restores a checkpoint, and opens shared output files.
module polydem_start
   use polydem_bodies, only: bodies_t
   use polydem_broadcast_scene, only: broadcaster_t
   use polydem_checkpoint_fields, only: serialize_global, scene_hash
   use polydem_errors, only: error_t
   use polydem_force_law, only: check_law
   use polydem_hash, only: hexadecimal
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_parallel_start, only: start_on_all_ranks
   use polydem_prescribed_motion, only: motion_t
   use polydem_relaxation, only: relax_bodies, relaxation_t
   use polydem_restart, only: restore
   use polydem_result_files, only: checkpoint_path, n_checkpoints
   use polydem_run, only: run_t
   use polydem_run_output, only: choose_intervals
   use polydem_scene, only: build_scene
   use polydem_settings, only: settings_t
   use polydem_simulation, only: simulation_t
   use polydem_start_simulation, only: start_simulation
   use polydem_strings, only: to_text
   use polydem_timers, only: timers_t
   implicit none
   private
   public :: new_simulation, join, build_start, recall

contains

   !> Build the scene and the simulation that the settings define.
   subroutine new_simulation(settings, self, error)
      !> Checked settings
      type(settings_t), intent(in) :: settings
      !> The simulation, ready to advance
      type(simulation_t), intent(out) :: self
      !> Allocated for bad input
      type(error_t), allocatable, intent(inout) :: error
      type(bodies_t) :: bodies
      type(motion_t), allocatable :: motions(:)
      type(relaxation_t) :: relaxation

      call check_law(settings, 1_ip, error)
      if (allocated(error)) return
      call build_scene(settings, bodies, motions, error)
      if (allocated(error)) return
      if (settings%guards%relaxed_depth > 0.0_wp) call relax_bodies(settings, bodies, relaxation, error)
      if (allocated(error)) return
      call start_simulation(settings, bodies, motions, self, error)
      self%relaxation = relaxation
   end subroutine new_simulation

   !> Broadcast the simulation and the restart state from the root rank, and open the shared output files; collective.
   subroutine join(settings, run, error)
      !> Settings of the run
      type(settings_t), intent(in) :: settings
      !> The run; prepared on the root rank
      type(run_t), intent(inout) :: run
      !> Allocated on failure; the same on all ranks
      type(error_t), allocatable, intent(inout) :: error
      type(broadcaster_t) :: broadcaster
      integer(lp) :: longs(6)
      real(dp) :: stored(1)

      call start_on_all_ranks(settings, run%comm, run%simulation, error)
      call run%comm%all_reduce_error(error)
      if (allocated(error)) return
      if (run%comm%size > 1_ip) then
         longs = [run%attempts%scene, int(run%earlier%checkpoint, lp), run%earlier%step, &
                  int(run%earlier%segments, lp), run%earlier%last_frame, int(run%checkpoints%next, lp)]
         stored = real(run%monitor%energy%stored, dp)
         call run%comm%broadcast(longs)
         call run%comm%broadcast(stored)
         if (.not. run%comm%is_root()) then
            run%attempts%scene = longs(1)
            run%earlier%checkpoint = int(longs(2), ip)
            run%earlier%step = longs(3)
            run%earlier%segments = int(longs(4), ip)
            run%earlier%last_frame = longs(5)
            call run%checkpoints%open(settings%checkpoint, run%simulation%dt, run%began, 0.0_dp)
            if (run%earlier%checkpoint > 0_ip) run%checkpoints%last_step = run%earlier%step
            run%checkpoints%next = int(longs(6), ip)
            run%monitor%energy%stored = real(stored(1), wp)
            call choose_intervals(run)
         end if
         allocate (broadcaster%comm, source=run%comm)
         broadcaster%is_reading = .not. run%comm%is_root()
         call serialize_global(broadcaster, run%simulation, run%attempts, run%monitor)
         if (allocated(broadcaster%error)) call move_alloc(broadcaster%error, error)
         call run%comm%all_reduce_error(error)
         if (allocated(error)) return
         if (.not. run%comm%is_root()) then
            run%simulation%sums = 0_lp
            run%simulation%timers = timers_t()
         end if
      end if
      call run%trajectory%open(run%folder, settings%output%frames_per_segment, run%provenance, error, &
                               run%earlier%segments, run%comm)
      if (run%comm%size == 1_ip .and. .not. allocated(error)) &
         call run%recorder%open(run%simulation, run%folder, run%provenance, run%log, run%manifest, error)
   end subroutine join

   !> Build the simulation at time 0 and hash its scene, unless an earlier call did.
   subroutine build_start(settings, run, error)
      !> Settings of the run
      type(settings_t), intent(in) :: settings
      !> The run; `simulation` and the scene hashes are set
      type(run_t), intent(inout) :: run
      !> Allocated for bad input
      type(error_t), allocatable, intent(inout) :: error

      if (allocated(run%provenance%scene)) return
      call new_simulation(settings, run%simulation, error)
      if (allocated(error)) return
      run%attempts%scene = scene_hash(run%simulation%bodies)
      run%provenance%scene = hexadecimal(run%attempts%scene)
   end subroutine build_start

   !> Start the schedule of checkpoints, and restore the checkpoint of an earlier attempt if there is one.
   subroutine recall(run, error)
      !> The run, after `find_restart`
      type(run_t), intent(inout) :: run
      !> Allocated if the checkpoint cannot be restored
      type(error_t), allocatable, intent(inout) :: error

      call run%checkpoints%open(run%simulation%settings%checkpoint, run%simulation%dt, run%began, run%attempt%limit)
      if (allocated(run%earlier%remark)) call run%log%write_line(run%earlier%remark)
      if (run%earlier%checkpoint == 0_ip) return
      run%provenance%parent = checkpoint_path(run%folder, run%earlier%checkpoint)//', step '//to_text(run%earlier%step)
      call restore(run%folder, run%earlier, run%provenance%revision, run%simulation, run%attempts, run%monitor, &
         run%log, &
         error)
      run%checkpoints%last_step = run%earlier%step
      run%checkpoints%next = modulo(run%earlier%checkpoint, n_checkpoints) + 1_ip
   end subroutine recall

end module polydem_start
