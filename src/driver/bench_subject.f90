!> What a bench takes its samples of: a trace in memory, or the state of a simulation.
module polydem_bench_subject
   use polydem_bench_scene, only: provide_trace, scene_t
   use polydem_bodies, only: state_hash
   use polydem_boxes, only: boxes_t
   use polydem_errors, only: error_t, input_error, raise
   use polydem_kinds, only: dp, ip, lp
   use polydem_live_sample, only: live_sample
   use polydem_neighbours, only: neighbours_t
   use polydem_recorder, only: first_trace_step
   use polydem_reference, only: expect_by_oracle, new_reference, reference_t, steps_of_oracle, total_hash
   use polydem_replay, only: describe_trace, expect_by_trace
   use polydem_replay_sample, only: replay_sample
   use polydem_sample_file, only: case_t, sample_t
   use polydem_simulation, only: advance, new_simulation, simulation_t
   use polydem_strings, only: to_text
   use polydem_trace, only: first_boxes, read_trace, trace_t
   use polydem_words, only: quoted
   implicit none
   private
   public :: subject_t, load_subject, find_reference, complete_case, take_sample

   !> A trace, or a state
   type :: subject_t
      !> What all of its cases have in common
      type(case_t) :: case
      !> Hash of what the lists of pairs belong to: of all bounds, or of the state at the start
      integer(lp) :: start = 0_lp
      !> Recorded boxes, if they are replayed
      type(trace_t) :: trace
      !> Boxes of one of its steps
      type(boxes_t) :: boxes
      !> The state at the start, if whole steps are done
      type(simulation_t), allocatable :: simulation
   end type subject_t

contains

   !> Bring a scene into memory.
   subroutine load_subject(scene, live, steps, subject, error)
      !> Scene
      type(scene_t), intent(in) :: scene
      !> Whether whole steps are done
      logical, intent(in) :: live
      !> Number of steps; 0: as many as there are
      integer(ip), intent(in) :: steps
      !> What samples are taken of
      type(subject_t), intent(out) :: subject
      !> Allocated if the scene cannot be made or read
      type(error_t), allocatable, intent(inout) :: error

      if (live) then
         call load_simulation(scene, steps, subject, error)
      else
         call provide_trace(scene, error)
         if (.not. allocated(error)) call read_trace(scene%path, subject%trace, error, steps)
         if (allocated(error)) return
         call check_length(scene, steps, subject%trace%n_steps, error)
         if (allocated(error)) return
         call first_boxes(subject%trace, subject%boxes)
         call describe_trace(subject%trace, subject%boxes, subject%case)
         subject%start = subject%case%identity
      end if
      subject%case%scene = scene%name
      subject%case%trace = scene%text
   end subroutine load_subject

   !> A trace must have the steps that are asked for.
   subroutine check_length(scene, steps, n_steps, error)
      type(scene_t), intent(in) :: scene
      integer(ip), intent(in) :: steps, n_steps
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: wanted

      wanted = steps
      if (steps == 0_ip .and. .not. scene%is_trace) wanted = scene%settings%output%trace_steps
      if (wanted > n_steps) call raise(error, input_error, scene%path//': has '//to_text(n_steps)//' steps, but '// &
         to_text(wanted)//' are wanted')
   end subroutine check_length

   !> Run a scene up to the step at which its trace would begin.
   subroutine load_simulation(scene, steps, subject, error)
      type(scene_t), intent(in) :: scene
      integer(ip), intent(in) :: steps
      type(subject_t), intent(inout) :: subject
      type(error_t), allocatable, intent(inout) :: error
      integer(lp) :: first

      if (scene%is_trace) then
         call raise(error, input_error, quoted(scene%text)//': a live bench needs a namelist file, not a trace')
         return
      end if
      allocate (subject%simulation)
      associate (simulation => subject%simulation, case => subject%case)
         call new_simulation(scene%settings, simulation, error)
         if (allocated(error)) return
         first = first_trace_step(scene%settings%output%trace_start, simulation%dt)
         do while (simulation%step < first .and. .not. allocated(error))
            call advance(simulation, error)
            call simulation%timers%end_step()
         end do
         if (allocated(error)) return
         subject%start = state_hash(simulation%bodies)
         case%mode = 'live'
         case%boxes = simulation%boxes%n
         case%fixed = count(simulation%boxes%fixed(:case%boxes), kind=ip)
         case%bodies = simulation%bodies%n
         case%dt = real(simulation%dt, dp)
         case%input = scene%settings%resolved
         case%steps = steps
         if (steps == 0_ip) case%steps = scene%settings%output%trace_steps
      end associate
   end subroutine load_simulation

   !> Find out what all lists should be: by comparing all pairs at some steps or all, by the first finder at the others.
   subroutine find_reference(subject, finder, reference, finish, error)
      !> What samples are taken of
      type(subject_t), intent(inout) :: subject
      !> Name of the first finder
      character(len=*), intent(in) :: finder
      !> Expected lists
      type(reference_t), intent(out) :: reference
      !> Hash of the last state of a live bench, else 0
      integer(lp), intent(out) :: finish
      !> Allocated if the finder is wrong
      type(error_t), allocatable, intent(inout) :: error
      type(sample_t) :: sample
      type(neighbours_t) :: oracle
      logical :: wanted(subject%case%steps)
      integer(ip) :: s

      finish = 0_lp
      call new_reference(reference, subject%case%steps)
      wanted = steps_of_oracle(subject%case%boxes, subject%case%steps)
      sample%case = subject%case
      sample%case%finder = finder
      if (allocated(subject%simulation)) then
         reference%other = finder
         call live_sample(subject%simulation, .true., reference, sample, finish, error, wanted)
         return
      end if
      call expect_by_trace(subject%trace, reference)
      do s = 1_ip, subject%case%steps
         if (.not. wanted(s)) cycle
         subject%boxes%bounds = subject%trace%bounds(:, :, s)
         call expect_by_oracle(reference, s, subject%boxes, oracle, error)
         if (allocated(error)) return
      end do
      call replay_sample(subject%trace, subject%boxes, .true., reference, sample, error)
      reference%other = finder
   end subroutine find_reference

   !> Let the cases know what was found out by `find_reference`.
   subroutine complete_case(reference, finish, subject)
      !> Expected lists
      type(reference_t), intent(in) :: reference
      !> Hash of the last state of a live bench, else 0
      integer(lp), intent(in) :: finish
      !> What samples are taken of
      type(subject_t), intent(inout) :: subject

      associate (case => subject%case)
         case%pairs_total = sum(int(reference%pairs, lp))
         case%pair_hash = total_hash(reference%hash)
         case%checked = 'all_pairs '//to_text(count(reference%by_oracle, kind=ip))//' steps'
         if (.not. all(reference%by_oracle)) case%checked = case%checked//', else '//reference%other
         if (allocated(subject%simulation)) case%identity = finish
      end associate
   end subroutine complete_case

   !> Take one sample.
   subroutine take_sample(subject, reference, sample, error)
      !> What samples are taken of
      type(subject_t), intent(inout) :: subject
      !> Expected lists
      type(reference_t), intent(inout) :: reference
      !> Its case says what to measure
      type(sample_t), intent(inout) :: sample
      !> Allocated if a list is wrong
      type(error_t), allocatable, intent(inout) :: error
      integer(lp) :: finish

      if (allocated(subject%simulation)) then
         call live_sample(subject%simulation, sample%case%repeat == 0_ip, reference, sample, finish, error)
      else
         call replay_sample(subject%trace, subject%boxes, sample%case%repeat == 0_ip, reference, sample, error)
      end if
   end subroutine take_sample

end module polydem_bench_subject
