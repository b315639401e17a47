!> Beginning of a run on all ranks: time 0 or a checkpoint, and the output files.
module polydem_begin_run
   use polydem_broadcaster, only: broadcaster_t
   use polydem_errors, only: error_t
   use polydem_former_step, only: find_former_step
   use polydem_global_hash, only: hash_scene
   use polydem_hash, only: hexadecimal
   use polydem_kinds, only: dp, ip, wp
   use polydem_restart, only: restore, serialize_earlier
   use polydem_result_files, only: checkpoint_path, n_checkpoints
   use polydem_run, only: run_t
   use polydem_output_intervals, only: frames_per_segment
   use polydem_scene_measures, only: measure_scene
   use polydem_settings, only: settings_t
   use polydem_start, only: new_simulation
   use polydem_strings, only: to_text
   implicit none
   private
   public :: build_start, recall, open_output

contains

   !> Build the simulation at time 0, measure it and hash its scene, unless an earlier call did. Collective; all ranks
   !> get the same error.
   subroutine build_start(settings, run, error)
      type(settings_t), intent(in) :: settings
      !> The run; `simulation`, `measures` and the scene hashes are set
      type(run_t), intent(inout) :: run
      !> Allocated for bad input
      type(error_t), allocatable, intent(inout) :: error

      real(wp) :: former_step

      if (allocated(run%scene_hash)) return
      call find_former_step(run, former_step)
      call new_simulation(settings, run%simulation, error, run%comm, run%attempt%threads, former_step)
      if (allocated(error)) return
      call measure_scene(run%simulation, run%measures)
      call hash_scene(run%comm, run%simulation%bodies, run%attempts%scene)
      run%scene_hash = hexadecimal(run%attempts%scene)
   end subroutine build_start

   !> Broadcast which checkpoint the root rank has chosen, start the schedule of checkpoints, and restore the checkpoint
   !> if there is one. Collective; all ranks get the same error.
   subroutine recall(run, error)
      !> The run, after `find_restart`
      type(run_t), intent(inout) :: run
      !> Allocated if the checkpoint cannot be restored
      type(error_t), allocatable, intent(inout) :: error
      type(broadcaster_t) :: broadcaster

      allocate (broadcaster%comm, source=run%comm)
      broadcaster%is_reading = .not. run%comm%is_root()
      call serialize_earlier(broadcaster, run%earlier)
      call run%checkpoints%open(run%simulation%settings%checkpoint, run%simulation%dt, run%began, &
                                merge(run%attempt%limit, 0.0_dp, run%comm%is_root()))
      if (allocated(run%earlier%remark)) call run%log%write_line(run%earlier%remark)
      if (run%earlier%checkpoint == 0_ip) return
      call run%provenance%set('parent', checkpoint_path(run%folder, run%earlier%checkpoint)//', step '// &
                              to_text(run%earlier%step))
      call restore(run%folder, run%earlier, run%provenance%text_of('revision'), run%simulation, run%attempts, &
                   run%log, error)
      if (allocated(error)) return
      run%checkpoints%last_step = run%earlier%step
      run%checkpoints%next = modulo(run%earlier%checkpoint, n_checkpoints) + 1_ip
   end subroutine recall

   !> Open the output files that the ranks share; collective.
   subroutine open_output(run, error)
      !> The run, prepared
      type(run_t), intent(inout) :: run
      !> Allocated on failure; the same on all ranks
      type(error_t), allocatable, intent(inout) :: error

      call run%trajectory%open(run%folder, frames_per_segment(run%simulation), run%provenance, error, &
                               run%earlier%segments, run%comm, allocated(run%simulation%traffic))
      if (run%comm%size == 1_ip .and. .not. allocated(error)) &
         call run%recorder%open(run%simulation, run%folder, run%provenance, run%log, run%manifest, error)
   end subroutine open_output

end module polydem_begin_run
