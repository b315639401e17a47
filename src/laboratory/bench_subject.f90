!> The subject of a sample: a trace in memory (replay), or the state of a simulation (live).
module polydem_bench_subject
   use polydem_bench_scene, only: provide_trace, scene_t
   use polydem_bodies, only: state_hash
   use polydem_boxes, only: boxes_t
   use polydem_errors, only: error_t, input_error, raise
   use polydem_hash, only: mix_word
   use polydem_kinds, only: dp, ip, lp
   use polydem_live_sample, only: live_sample
   use polydem_neighbours, only: neighbours_t
   use polydem_recorder, only: first_trace_step
   use polydem_reference, only: set_by_all_pairs, new_reference, reference_t, all_pairs_steps, total_hash
   use polydem_replay_sample, only: replay_sample, first_boxes
   use polydem_sample_file, only: case_t, sample_t
   use polydem_simulation, only: simulation_t
   use polydem_start, only: new_simulation
   use polydem_strings, only: to_text, quoted
   use polydem_time_step, only: advance
   use polydem_trace_reader, only: read_trace, trace_t
   implicit none
   private
   public :: subject_t, load_subject, load_trace, compare_all_pairs, find_reference, complete_case, take_sample

   !> A trace, or the state of a simulation, and the lists of pairs that finders must find
   type :: subject_t
      !> Properties common to all cases of the subject
      type(case_t) :: case
      !> Recorded boxes, if the bench replays them
      type(trace_t) :: trace
      !> Boxes of one step of the trace
      type(boxes_t) :: boxes
      !> Initial state, if the bench runs whole time steps; else unallocated
      type(simulation_t), allocatable :: simulation
      !> Reference lists of pairs
      type(reference_t) :: reference
   end type subject_t

contains

   !> Load a scene into memory.
   subroutine load_subject(scene, live, steps, subject, error)
      type(scene_t), intent(in) :: scene
      !> Whether the bench runs whole time steps
      logical, intent(in) :: live
      !> Number of steps; 0: all steps of the trace
      integer(ip), intent(in) :: steps
      type(subject_t), intent(out) :: subject
      !> Allocated if the scene cannot be run or read
      type(error_t), allocatable, intent(inout) :: error

      if (live) then
         call load_simulation(scene, steps, subject, error)
      else
         call provide_trace(scene, error)
         if (.not. allocated(error)) call load_trace(scene%path, subject, error, steps)
         if (allocated(error)) return
         call check_length(scene, steps, subject%trace%n_steps, error)
         if (allocated(error)) return
      end if
      subject%case%scene = scene%name
      subject%case%trace = scene%text
   end subroutine load_subject

   !> Read a trace, the properties of its cases, and the numbers and hashes of pairs that it holds.
   subroutine load_trace(path, subject, error, steps)
      !> Path of the trace (HDF5)
      character(len=*), intent(in) :: path
      type(subject_t), intent(inout) :: subject
      !> Allocated if the file cannot be read
      type(error_t), allocatable, intent(inout) :: error
      !> Number of steps to read from the first one; 0 or absent: all
      integer(ip), intent(in), optional :: steps
      integer(ip) :: b, k, s

      call read_trace(path, subject%trace, error, steps)
      if (allocated(error)) return
      call first_boxes(subject%trace, subject%boxes)
      associate (trace => subject%trace, boxes => subject%boxes, case => subject%case, reference => subject%reference)
         case%mode = 'replay'
         case%boxes = boxes%n
         case%fixed = count(boxes%fixed, kind=ip)
         case%bodies = boxes%n_pieces
         case%steps = trace%n_steps
         case%dt = trace%dt
         case%input = trace%input
         case%identity = 0_lp
         do s = 1_ip, trace%n_steps
            do b = 1_ip, boxes%n
               do k = 1_ip, 4_ip
                  case%identity = mix_word(case%identity, transfer(real(trace%bounds(k, b, s), dp), 0_lp))
               end do
            end do
         end do
         call new_reference(reference, trace%n_steps)
         reference%start = case%identity
         reference%other = 'the trace'
         if (allocated(trace%n_pairs)) reference%pairs = trace%n_pairs(:trace%n_steps)
         reference%has_number = allocated(trace%n_pairs)
         if (allocated(trace%pair_hash)) reference%hash = trace%pair_hash(:trace%n_steps)
         reference%has_hash = allocated(trace%pair_hash)
      end associate
   end subroutine load_trace

   !> Set the reference lists of some steps of a trace from the finder all_pairs.
   subroutine compare_all_pairs(subject, wanted, error)
      !> Subject with a trace
      type(subject_t), intent(inout) :: subject
      !> Whether to compare all pairs at each step, (steps)
      logical, intent(in) :: wanted(:)
      !> Allocated if a list in the trace is wrong
      type(error_t), allocatable, intent(inout) :: error
      type(neighbours_t) :: oracle
      integer(ip) :: s

      do s = 1_ip, size(wanted, kind=ip)
         if (.not. wanted(s)) cycle
         subject%boxes%bounds = subject%trace%bounds(:, :, s)
         call set_by_all_pairs(subject%reference, s, subject%boxes, oracle, error)
         if (allocated(error)) return
      end do
   end subroutine compare_all_pairs

   !> Check that a trace has the requested number of steps.
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

   !> Run a scene up to the first step of its trace.
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
         case%mode = 'live'
         case%boxes = simulation%search%boxes%n
         case%fixed = count(simulation%search%boxes%fixed(:case%boxes), kind=ip)
         case%bodies = simulation%bodies%n
         case%dt = real(simulation%dt, dp)
         case%input = scene%settings%resolved
         case%steps = steps
         if (steps == 0_ip) case%steps = scene%settings%output%trace_steps
         call new_reference(subject%reference, case%steps)
         subject%reference%start = state_hash(simulation%bodies)
      end associate
   end subroutine load_simulation

   !> Compute the reference lists: by comparing all pairs at the steps of `all_pairs_steps`, by the first finder at the
   !> others.
   subroutine find_reference(subject, finder, error)
      type(subject_t), intent(inout) :: subject
      !> Name of the first finder
      character(len=*), intent(in) :: finder
      !> Allocated if a list of the finder is wrong
      type(error_t), allocatable, intent(inout) :: error
      type(sample_t) :: sample
      logical :: wanted(subject%case%steps)

      wanted = all_pairs_steps(subject%case%boxes, subject%case%steps)
      sample%case = subject%case
      sample%case%finder = finder
      if (allocated(subject%simulation)) then
         subject%reference%other = finder
         call live_sample(subject%simulation, .true., subject%reference, sample, error, wanted)
      else
         call compare_all_pairs(subject, wanted, error)
         if (allocated(error)) return
         call take_sample(subject, sample, error)
         subject%reference%other = finder
      end if
   end subroutine find_reference

   !> Set the properties of all cases that follow from the reference lists.
   subroutine complete_case(subject)
      type(subject_t), intent(inout) :: subject

      associate (case => subject%case, reference => subject%reference)
         case%pairs_total = sum(int(reference%pairs, lp))
         case%pair_hash = total_hash(reference%hash)
         case%checked = 'all_pairs '//to_text(count(reference%by_oracle, kind=ip))//' steps'
         if (.not. all(reference%by_oracle)) case%checked = case%checked//', else '//reference%other
         if (allocated(subject%simulation)) case%identity = reference%finish
      end associate
   end subroutine complete_case

   !> Take one sample. Repeat 0 checks every list.
   subroutine take_sample(subject, sample, error)
      type(subject_t), intent(inout) :: subject
      !> The sample; its case is set on entry
      type(sample_t), intent(inout) :: sample
      !> Allocated if a list is wrong
      type(error_t), allocatable, intent(inout) :: error
      logical :: checked

      checked = sample%case%repeat == 0_ip
      if (allocated(subject%simulation)) then
         call live_sample(subject%simulation, checked, subject%reference, sample, error)
      else
         call replay_sample(subject%trace, subject%boxes, checked, subject%reference, sample, error)
      end if
   end subroutine take_sample

end module polydem_bench_subject
