!> Builds the scene and the simulation of a run. All ranks build alike.
module polydem_start
   use omp_lib, only: omp_get_thread_limit, omp_set_num_threads
   use polydem_assign_walls, only: assign_walls
   use polydem_communicator, only: choose_communicator, communicator_t
   use polydem_errors, only: error_t
   use polydem_former_step, only: find_former_step
   use polydem_global_hash, only: hash_scene
   use polydem_hash, only: hexadecimal
   use polydem_kinds, only: ip, wp
   use polydem_law_factory, only: check_law
   use polydem_process_limits, only: check_threads
   use polydem_run, only: run_t
   use polydem_scene, only: build_scene
   use polydem_scene_measures, only: measure_scene
   use polydem_settings, only: settings_t
   use polydem_simulation, only: simulation_t
   use polydem_start_bodies, only: read_start_bodies
   use polydem_start_forces, only: start_forces
   use polydem_start_simulation, only: place_bodies
   use polydem_start_state, only: recall_history
   use polydem_thread_choice, only: choose_threads, thread_choice_t
   implicit none
   private
   public :: build_start, new_simulation

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
      call new_simulation(settings, run%simulation, error, run%comm, run%options%threads, former_step)
      if (allocated(error)) return
      call measure_scene(run%simulation, run%measures)
      call hash_scene(run%comm, run%simulation%bodies, run%restarts%scene)
      run%scene_hash = hexadecimal(run%restarts%scene)
   end subroutine build_start

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
      !> Time step of a previous start, which the simulation keeps unless the settings have one [s]; 0: there is none
      real(wp), intent(in), optional :: former_step
      class(communicator_t), allocatable :: ranks

      call choose_communicator(ranks, comm)
      if (present(former_step)) self%dt = former_step
      call check_law(settings, 1_ip, error)
      if (allocated(error)) return
      if (settings%scene%name == 'result') then
         call read_start_bodies(settings, ranks, self%bodies, self%walls%wall, error)
         if (.not. allocated(error)) call assign_walls(settings, self%bodies, self%walls, error)
      else
         call build_scene(settings, self%bodies, self%walls, error, ranks%rank, ranks%size)
      end if
      call ranks%all_reduce_error(error)
      if (present(threads) .and. .not. allocated(error)) &
         call set_threads(threads, ranks, size(self%bodies%free, kind=ip), error)
      if (.not. allocated(error)) call place_bodies(settings, ranks, self, error)
      if (.not. allocated(error)) call recall_history(self, error)
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

end module polydem_start
