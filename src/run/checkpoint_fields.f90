!> The list of fields of a checkpoint: all state that outlives a time step and does not follow from the namelist.
!>
!> A checkpoint does not hold shapes and masses (the scene is built again; a hash detects a difference), motions
!> (functions of time), contacts (computed by the next step) or the state of neighbour finders. A restart rebuilds the
!> finder and its pairs from the boxes of the last search, which the checkpoint holds. These boxes can differ from those
!> of the bodies at the end of the step, since Gear's scheme moves bodies once more; the contact history belongs to the
!> pairs of these boxes.
module polydem_checkpoint_fields
   use polydem_bodies, only: bodies_t, state_hash, turn_bodies
   use polydem_body_fields, only: serialize_bodies
   use polydem_contact_history, only: contact_history_t
   use polydem_energy_balance, only: serialize_contributions, serialize_balance
   use polydem_errors, only: input_error, raise
   use polydem_hash, only: mix_word
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_local_bodies, only: rebuild_pairs
   use polydem_monitor, only: serialize_monitor, monitor_t
   use polydem_serializer, only: serializer_t
   use polydem_simulation, only: simulation_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: attempts_t, serialize_run, serialize_global, serialize_progress, scene_hash

   !> Hash of the initial scene, and counts of all attempts of a run
   type :: attempts_t
      !> `scene_hash` of the bodies at time 0
      integer(lp) :: scene = 0_lp
      !> Number of attempts, including the present one
      integer(lp) :: attempts = 1_lp
      !> Elapsed time of the run up to the checkpoint, without repeated steps [s]
      real(dp) :: seconds = 0.0_dp
      !> Number of closed segments of the trajectory
      integer(lp) :: segments = 0_lp
   end type attempts_t

contains

   !> Write the state of a run to a serializer, or restore it from there.
   subroutine serialize_run(serializer, simulation, attempts, monitor)
      !> Serializer; its `error` holds a failure
      class(serializer_t), intent(inout) :: serializer
      !> Written: the simulation at the end of a step. Restored: on entry any state of the same scene, on return the
      !> stored state without contacts, which the next step computes
      type(simulation_t), intent(inout) :: simulation
      !> Attempts of the run
      type(attempts_t), intent(inout) :: attempts
      !> Monitor
      type(monitor_t), intent(inout) :: monitor

      call serialize_global(serializer, simulation, attempts, monitor)
      associate (s => simulation)
         call serialize_bodies(serializer, s%bodies)
         call s%integrator%serialize(serializer)
         if (s%settings%output%energy_balance) call serialize_contributions(s%energy_balance, s%bodies%n, serializer)
         call serializer%field('/boxes/bounds', s%boxes%bounds(:, :s%boxes%n), 'm', &
                           'xmin, ymin, xmax, ymax at the last search for pairs')
         call serialize_pairs(serializer, s)
         if (.not. serializer%is_reading .or. allocated(serializer%error)) return
         call turn_bodies(s%bodies, s%moving, s%isa)
         s%contacts%n = 0_ip
         s%contacts%n_degenerate = 0_ip
         s%walls%n = 0_ip
         s%suspects%n = 0_ip
         s%passing_pair = 0_ip
      end associate
   end subroutine serialize_run

   !> Serialize the global fields: those of the whole run, not of bodies, boxes or pairs.
   subroutine serialize_global(serializer, simulation, attempts, monitor)
      !> Serializer; its `error` holds a failure
      class(serializer_t), intent(inout) :: serializer
      !> The simulation
      type(simulation_t), intent(inout) :: simulation
      !> Attempts of the run
      type(attempts_t), intent(inout) :: attempts
      !> Monitor
      type(monitor_t), intent(inout) :: monitor

      call serialize_progress(serializer, simulation%step, attempts)
      call serialize_monitor(monitor, serializer)
      associate (s => simulation)
         call serializer%match('/run/time_step', s%dt, 's', 'time step')
         call serializer%match('/run/scene', [attempts%scene], '1', 'hash of the bodies at the start')
         call serializer%match('/run/precision', [int(storage_size(1.0_wp), lp)], 'bit', 'working precision')
         call serializer%field('/run/sums', s%sums, '1', 'sums over steps: pairs, contacts, pairs that began, '// &
                           'pairs that ended, contacts without direction')
         call serializer%field('/run/displacement_warnings', s%guard%warning%count, '1', &
                               'steps in which a body moved too far')
         call serializer%field('/run/stage_calls', s%timers%calls, '1', 'steps in which each stage ran')
         call serializer%seconds_field('/run/stage_total', s%timers%total, 'time spent in each stage')
         call serializer%seconds_field('/run/stage_least', s%timers%least, 'shortest time in a step')
         call serializer%seconds_field('/run/stage_most', s%timers%most, 'longest time in a step')
         if (s%settings%output%energy_balance) call serialize_balance(s%energy_balance, serializer)
      end associate
   end subroutine serialize_global

   !> Serialize the progress of a run. This part of `serialize_run` needs no simulation.
   subroutine serialize_progress(serializer, step, attempts)
      !> Serializer; its `error` holds a failure
      class(serializer_t), intent(inout) :: serializer
      !> Number of completed steps
      integer(lp), intent(inout) :: step
      !> Attempts of the run
      type(attempts_t), intent(inout) :: attempts
      real(dp) :: seconds(1)

      call serializer%field('/run/step', step, '1', 'completed steps')
      call serializer%field('/run/attempts', attempts%attempts, '1', 'attempts, including the present one')
      call serializer%field('/run/segments', attempts%segments, '1', 'closed segments of the trajectory')
      seconds = attempts%seconds
      call serializer%seconds_field('/run/seconds', seconds, 'elapsed time of the run, without repeated steps')
      attempts%seconds = seconds(1)
   end subroutine serialize_progress

   !> Serialize the pairs and their contact history. A restart rebuilds the pairs and compares them to the file.
   subroutine serialize_pairs(serializer, s)
      class(serializer_t), intent(inout) :: serializer
      type(simulation_t), intent(inout) :: s
      integer(ip) :: n

      if (serializer%is_reading .and. .not. allocated(serializer%error)) then
         call rebuild_pairs(s, serializer%error)
         if (allocated(serializer%error)) return
      end if
      associate (pairs => s%neighbours%pairs, work => s%neighbours%finder%work)
         n = pairs%n
         call serializer%match('/pairs/first', int(s%bodies%id(pairs%first(:n)), lp), '1', &
            'lower identifier of each pair')
         call serializer%match('/pairs/second', int(s%bodies%id(pairs%second(:n)), lp), '1', &
            'higher identifier of each pair')
         call serialize_history(serializer, n, s%history)
         call serializer%field('/run/finder_counts', work%value, '1', 'statistics of the finder so far')
         call serializer%seconds_field('/run/finder_seconds', work%seconds, 'time of each phase of the finder')
      end associate
   end subroutine serialize_pairs

   !> Serialize the columns of the contact history that the force models of the scene use.
   subroutine serialize_history(serializer, n, history)
      class(serializer_t), intent(inout) :: serializer
      !> Number of pairs
      integer(ip), intent(in) :: n
      type(contact_history_t), intent(inout) :: history
      integer :: k

      if (serializer%is_reading) history%memory = spread(0_ip, 1, n)
      if (.not. allocated(history%column)) return
      do k = 1, size(history%column)
         associate (kind => history%column(k)%kind)
            call serialize_column(serializer, '/pairs/'//trim(kind%name), n, history%column(k)%value, trim(kind%unit), &
                             trim(kind%meaning))
         end associate
      end do
   end subroutine serialize_history

   !> Serialize a column over pairs.
   subroutine serialize_column(serializer, name, n, column, unit, meaning)
      class(serializer_t), intent(inout) :: serializer
      character(len=*), intent(in) :: name, unit, meaning
      integer(ip), intent(in) :: n
      real(wp), allocatable, intent(inout) :: column(:)

      if (serializer%is_reading) column = spread(0.0_wp, 1, n)
      call serializer%field(name, column(:n), unit, meaning)
   end subroutine serialize_column

   !> Hash of the initial bodies: their state, and their constant properties (fixed or free, mass, inertia, shape)
   pure integer(lp) function scene_hash(bodies)
      !> Bodies at time 0
      type(bodies_t), intent(in) :: bodies
      integer(ip) :: s, v

      scene_hash = state_hash(bodies)
      do s = 1_ip, bodies%n
         scene_hash = mix_word(scene_hash, merge(1_lp, 0_lp, bodies%fixed(s)))
         scene_hash = mix_word(scene_hash, transfer(real(bodies%mass(s), dp), 0_lp))
         scene_hash = mix_word(scene_hash, transfer(real(bodies%inertia(s), dp), 0_lp))
         scene_hash = mix_word(scene_hash, int(bodies%vertex_start(s + 1_ip), lp))
      end do
      do v = 1_ip, size(bodies%shape, 2, kind=ip)
         scene_hash = mix_word(scene_hash, transfer(real(bodies%shape(1, v), dp), 0_lp))
         scene_hash = mix_word(scene_hash, transfer(real(bodies%shape(2, v), dp), 0_lp))
      end do
   end function scene_hash

end module polydem_checkpoint_fields
