!> Start of a run: all ranks build the scene and the simulation alike, restore a checkpoint, and open the output files.
module polydem_start
   use omp_lib, only: omp_get_thread_limit, omp_set_num_threads
   use polydem_broadcaster, only: broadcaster_t
   use polydem_communicator, only: choose_communicator, communicator_t
   use polydem_end_condition, only: pass_end
   use polydem_errors, only: error_t
   use polydem_law_factory, only: check_law
   use polydem_former_step, only: find_former_step
   use polydem_global_hash, only: hash_scene
   use polydem_hash, only: hexadecimal
   use polydem_kinds, only: dp, ip, wp
   use polydem_name_walls, only: assign_loads, name_walls
   use polydem_restart, only: restore, serialize_earlier
   use polydem_process_limits, only: check_threads
   use polydem_result_files, only: checkpoint_path, n_checkpoints
   use polydem_run, only: run_t
   use polydem_run_output, only: frames_per_segment
   use polydem_scene, only: assign_motions, build_scene
   use polydem_scene_measures, only: measure_scene
   use polydem_settings, only: settings_t
   use polydem_simulation, only: simulation_t
   use polydem_start_from, only: read_start, recall_history
   use polydem_start_simulation, only: place_bodies, start_forces
   use polydem_strings, only: to_text
   use polydem_thread_choice, only: choose_threads, thread_choice_t
   use polydem_wall_bodies, only: wall_bodies_t
   implicit none
   private
   public :: new_simulation, build_start, recall, open_output

contains

   !> Build the scene and the simulation that the settings define. Collective; all ranks get the same error.
   subroutine new_simulation(settings, self, error, comm, threads, former_step)
      type(settings_t), intent(in) :: settings
      !> The simulation, ready to advance
      type(simulation_t), intent(out) :: self
      !> Allocated for bad input
      type(error_t), allocatable, intent(inout) :: error
      !> Ranks that share the bodies; default: this one alone
      class(communicator_t), intent(in), optional :: comm
      !> How the number of threads is determined; default: it is set already
      type(thread_choice_t), intent(inout), optional :: threads
      !> Time step of an earlier attempt, which the simulation keeps unless the settings have one [s]; 0: there is none
      real(wp), intent(in), optional :: former_step
      class(communicator_t), allocatable :: ranks
      type(wall_bodies_t), allocatable :: of_result(:)

      call choose_communicator(ranks, comm)
      if (present(former_step)) self%dt = former_step
      call check_law(settings, 1_ip, error)
      if (allocated(error)) return
      if (settings%scene%name == 'result') then
         call read_start(settings, ranks, self%bodies, of_result, error)
         if (.not. allocated(error)) call assign_motions(settings, self%bodies, of_result, self%walls, error)
         if (.not. allocated(error)) call name_walls(settings, self%bodies, of_result, self%walls, self%named)
         if (.not. allocated(error)) call assign_loads(settings, of_result, self%loads)
      else
         call build_scene(settings, self%bodies, self%walls, error, ranks%rank, ranks%size, self%named, self%loads)
      end if
      call ranks%all_reduce_error(error)
      if (present(threads) .and. .not. allocated(error)) &
         call set_threads(threads, ranks, size(self%bodies%free, kind=ip), error)
      if (.not. allocated(error)) call place_bodies(settings, ranks, self, error)
      if (settings%scene%name == 'result' .and. .not. allocated(error)) call recall_history(self, error)
      if (.not. allocated(error)) call start_forces(self, error)
   end subroutine new_simulation

   !> Set the number of OpenMP threads if it is still open. Collective; all ranks get the same error.
   subroutine set_threads(choice, comm, free, error)
      !> On return the number is set, and the reason known
      type(thread_choice_t), intent(inout) :: choice
      class(communicator_t), intent(inout) :: comm
      !> Number of free bodies of this rank
      integer(ip), intent(in) :: free
      !> Allocated if the system does not allow so many threads
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: threads

      if (.not. choice%is_open) return
      call choose_threads(comm, free, threads, choice%reason)
      threads = min(threads, int(omp_get_thread_limit(), ip))
      call check_threads(threads, error)
      call comm%all_reduce_error(error)
      if (.not. allocated(error)) call omp_set_num_threads(int(threads))
      choice%is_open = .false.
   end subroutine set_threads

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
      logical :: begins

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
                   run%monitor, run%log, error)
      if (allocated(error)) return
      call pass_end(run%simulation, begins, error)
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

end module polydem_start
