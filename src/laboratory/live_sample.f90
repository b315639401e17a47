!> One sample of a live bench: whole time steps from a given state, with one finder.
!>
!> A sample copies the state and replaces its finder. It keeps the list of pairs, since all finders find the same pairs,
!> and the contact history. Therefore the last state has the same bits for every finder and any number of threads.
module polydem_live_sample
   use polydem_bodies, only: state_hash
   use polydem_errors, only: error_t, raise, run_error
   use polydem_finder, only: finder_t
   use polydem_finder_meter, only: finder_meter_t
   use polydem_finder_variants, only: new_finder_or_variant
   use polydem_hash, only: hexadecimal
   use polydem_kinds, only: dp, ip, lp
   use polydem_neighbours, only: neighbours_t
   use polydem_reference, only: set_by_all_pairs, reference_t
   use polydem_replay_sample, only: begin_sample, check_step
   use polydem_sample_file, only: sample_t
   use polydem_simulation, only: simulation_t
   use polydem_step_clock, only: step_clock_t
   use polydem_time_step, only: advance
   use polydem_timers, only: n_stages, timers_t
   implicit none
   private
   public :: live_sample

contains

   !> Run the steps of a case once.
   subroutine live_sample(start, checked, reference, sample, error, by_oracle)
      !> Initial state of all samples
      type(simulation_t), intent(in) :: start
      !> Whether to check every list and to collect finder statistics
      logical, intent(in) :: checked
      !> Reference lists; a checked sample adds missing ones, and each sets the hash of the last state
      type(reference_t), intent(inout) :: reference
      !> The sample; its case sets the finder and the number of steps
      type(sample_t), intent(inout) :: sample
      !> Allocated if the finder is unknown, a list is wrong or a step fails
      type(error_t), allocatable, intent(inout) :: error
      !> Whether to compare all pairs at each step, (steps); absent: at no step
      logical, intent(in), optional :: by_oracle(:)
      type(simulation_t) :: simulation
      class(finder_t), allocatable :: finder
      type(neighbours_t) :: oracle
      type(finder_meter_t) :: meter
      type(step_clock_t) :: clock
      integer(ip) :: s

      simulation = start
      simulation%timers = timers_t()
      call new_finder_or_variant(finder, sample%case%finder, error)
      if (allocated(error)) return
      finder%isa = simulation%bodies%isa
      call simulation%search%neighbours%change_finder(finder, simulation%search%boxes)
      simulation%search%neighbours%finder%work%thorough = checked
      call begin_sample(sample%case%steps, checked, clock, sample)
      allocate (sample%stage(n_stages, sample%case%steps))
      call meter%read_seconds(simulation%search%neighbours%finder, sample%phase(:, 1))
      if (checked) call meter%read_all(simulation%search%neighbours%finder, sample%phase(:, 1), sample%count(:, 1))
      do s = 1_ip, sample%case%steps
         call time_step(clock, simulation, s, sample, error)
         if (allocated(error)) return
         if (present(by_oracle)) then
            if (by_oracle(s)) call set_by_all_pairs(reference, s, simulation%search%boxes, oracle, error)
         end if
         call check_step(simulation%search%neighbours, s, checked, meter, reference, sample, error)
         if (allocated(error)) return
      end do
      reference%finish = state_hash(simulation%bodies)
      call check_finish(sample, reference%finish, error)
   end subroutine live_sample

   !> Run and time one step; its elapsed time is the sum over stages.
   subroutine time_step(clock, simulation, s, sample, error)
      type(step_clock_t), intent(inout) :: clock
      type(simulation_t), intent(inout) :: simulation
      integer(ip), intent(in) :: s
      type(sample_t), intent(inout) :: sample
      type(error_t), allocatable, intent(inout) :: error
      real(dp) :: elapsed, before(n_stages)

      before = simulation%timers%total
      call clock%start()
      call advance(simulation, error, tabulate=.false.)   ! as a run between frames
      call clock%stop(elapsed, sample%processor(s))
      if (allocated(error)) return
      call simulation%timers%end_step()
      sample%stage(:, s) = simulation%timers%total - before
      sample%elapsed(s) = sum(sample%stage(:, s))
   end subroutine time_step

   !> Check that the last state is that of the other samples; a hash of 0 is not known yet.
   subroutine check_finish(sample, finish, error)
      type(sample_t), intent(in) :: sample
      integer(lp), intent(in) :: finish
      type(error_t), allocatable, intent(inout) :: error

      if (sample%case%identity == 0_lp .or. sample%case%identity == finish) return
      call raise(error, run_error, sample%case%finder//': the state after the last step has the hash '// &
                 hexadecimal(finish)//', not '//hexadecimal(sample%case%identity)//' as with other finders or threads')
   end subroutine check_finish

end module polydem_live_sample
