!> The list of fields of a checkpoint: the bodies, and all other state that outlives a time step and does not follow
!> from the namelist. Parts of a simulation that have a procedure `serialize_...` name their own fields there.
!>
!> A checkpoint does not hold motions (functions of time, of which tables are compared by a hash), contacts (computed by
!> the next step) or the state of neighbour finders. After a restart the first search starts without pairs. The pairs
!> that it finds again get their contact history. A hash of the bodies at the start guards against the checkpoint of
!> another run.
module polydem_checkpoint_fields
   use polydem_balance_state, only: serialize_balance, serialize_contributions
   use polydem_begin_stage, only: continue_stages
   use polydem_bodies, only: piece_identifiers
   use polydem_checkpoint_bodies, only: read_bodies, save_bodies
   use polydem_contact_history, only: contact_history_t
   use polydem_errors, only: error_t, input_error, raise
   use polydem_force_sums, only: total_forces
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_monitor, only: serialize_guards
   use polydem_packed_history, only: pack_pairs, packed_history_t, slots_of_pair
   use polydem_perform_actions, only: repeat_actions
   use polydem_participants, only: serialize_participants
   use polydem_replace_bodies, only: rebuild_bodies
   use polydem_run_stages, only: serialize_stages
   use polydem_serializer, only: serializer_t
   use polydem_simulation, only: simulation_t
   implicit none
   private
   public :: restarts_t, serialize_run, serialize_progress, read_pairs

   !> Number of pairs that are read at a time
   integer(lp), parameter :: most_rows = 65536_lp

   !> Hash of the initial scene, and counts of a run with its restarts
   type :: restarts_t
      !> `hash_scene` of the bodies at time 0
      integer(lp) :: scene = 0_lp
      !> Number of restarts so far
      integer(lp) :: number = 0_lp
      !> Elapsed time of the run up to the checkpoint, without repeated steps [s]
      real(dp) :: seconds = 0.0_dp
      !> Number of closed segments of the trajectory
      integer(lp) :: segments = 0_lp
   end type restarts_t

contains

   !> Write the state of a run to a serializer, or restore it from there.
   subroutine serialize_run(serializer, simulation, restarts)
      !> Serializer; its `error` holds a failure
      class(serializer_t), intent(inout) :: serializer
      !> Written: the simulation at the end of a step. Restored: on entry any state of the same scene, on return the
      !> stored state without contacts, which the next step computes
      type(simulation_t), intent(inout) :: simulation
      type(restarts_t), intent(inout) :: restarts

      call serialize_global(serializer, simulation, restarts)
      associate (s => simulation)
         if (serializer%is_reading) then
            call read_bodies(serializer, s%comm, s%bodies)
            if (.not. allocated(serializer%error)) call s%motion%integrator%start(s%bodies)
         else
            call total_forces(s%forces%gravity, s%loop%force_sums, s%bodies)
            call save_bodies(serializer, s%bodies)
         end if
         call s%motion%integrator%serialize(serializer)
         if (s%settings%output%energy_balance) call serialize_contributions(s%energy_balance, s%bodies%n, serializer)
         associate (work => s%search%neighbours%finder%work)
            call serializer%field('/run/finder_counts', work%value, '1', 'statistics of the finder so far')
            call serializer%seconds_field('/run/finder_seconds', work%seconds, 'time of each phase of the finder')
         end associate
         if (.not. serializer%is_reading) then
            call save_pairs(serializer, s)
            return
         end if
         call read_pairs(serializer, s)
         call s%comm%all_reduce_error(serializer%error)
         if (allocated(serializer%error)) return
         call continue_stages(s, serializer%error)
         if (.not. allocated(serializer%error)) call repeat_actions(s)
         call rebuild_bodies(s, serializer%error)
      end associate
   end subroutine serialize_run

   !> Serialize the global fields: those of the whole run, not of bodies, boxes or pairs.
   subroutine serialize_global(serializer, simulation, restarts)
      !> Serializer; its `error` holds a failure
      class(serializer_t), intent(inout) :: serializer
      type(simulation_t), intent(inout) :: simulation
      type(restarts_t), intent(inout) :: restarts
      integer(lp) :: tables

      call serialize_progress(serializer, simulation%step, restarts)
      call serialize_guards(simulation, serializer)
      associate (s => simulation)
         call serialize_stages(s%stages, serializer)
         call serializer%match('/run/time_step', s%dt, 's', 'time step')
         call serializer%match('/run/scene', [restarts%scene], '1', 'hash of the bodies at the start')
         tables = s%walls%hash_of_tables()
         if (tables /= 0_lp) call serializer%match('/run/motion_tables', [tables], '1', 'hash of the tables of motions')
         call serializer%match('/run/precision', [int(storage_size(1.0_wp), lp)], 'bit', 'working precision')
         call serializer%field('/run/sums', s%sums, '1', 'sums over steps: contacts, pairs that began, pairs that '// &
                           'ended, contacts without direction')
         call serializer%field('/run/stage_calls', s%timers%calls, '1', 'steps in which each stage ran')
         call serializer%seconds_field('/run/stage_total', s%timers%total, 'time spent in each stage')
         call serializer%seconds_field('/run/stage_least', s%timers%least, 'shortest time in a step')
         call serializer%seconds_field('/run/stage_most', s%timers%most, 'longest time in a step')
         if (s%settings%output%energy_balance) call serialize_balance(s%energy_balance, serializer)
      end associate
      call serialize_participants(simulation, serializer)
   end subroutine serialize_global

   !> Serialize the progress of a run. This part of `serialize_run` needs no simulation.
   subroutine serialize_progress(serializer, step, restarts)
      !> Serializer; its `error` holds a failure
      class(serializer_t), intent(inout) :: serializer
      !> Number of completed steps
      integer(lp), intent(inout) :: step
      type(restarts_t), intent(inout) :: restarts
      real(dp) :: seconds(1)

      call serializer%field('/run/step', step, '1', 'completed steps')
      call serializer%field('/run/restarts', restarts%number, '1', 'restarts so far')
      call serializer%field('/run/segments', restarts%segments, '1', 'closed segments of the trajectory')
      seconds = restarts%seconds
      call serializer%seconds_field('/run/seconds', seconds, 'elapsed time of the run, without repeated steps')
      restarts%seconds = seconds(1)
   end subroutine serialize_progress

   !> Save the pairs and their contact history.
   subroutine save_pairs(serializer, s)
      class(serializer_t), intent(inout) :: serializer
      type(simulation_t), intent(inout) :: s
      type(packed_history_t) :: packed

      associate (pairs => s%search%neighbours%pairs)
         call pack_pairs(pairs%n, pairs%first, pairs%second, piece_identifiers(s%bodies), s%history, packed)
      end associate
      call serialize_pairs(serializer, s%history, packed)
   end subroutine save_pairs

   !> Read the contact history of the pairs that have a body of this rank. All pairs are read, some at a time.
   subroutine read_pairs(serializer, s, most_pieces)
      !> Serializer; its `error` holds a failure
      class(serializer_t), intent(inout) :: serializer
      !> The simulation, which receives the history
      type(simulation_t), intent(inout) :: s
      !> Greatest number of pieces of a body of the run that wrote the pairs; default: that of this run
      integer(ip), intent(in), optional :: most_pieces
      type(packed_history_t) :: part
      integer(ip), allocatable :: id(:), owned(:)
      integer(lp) :: first, n
      integer(ip) :: k

      id = piece_identifiers(s%bodies)
      call serializer%count_rows('/pairs/first', n)
      if (allocated(s%received_history)) deallocate (s%received_history)
      allocate (s%received_history)
      call resize(part, s%history, 0_ip)
      s%received_history = part
      do first = 0_lp, max(0_lp, n - 1_lp), most_rows
         if (allocated(serializer%error)) return
         call resize(part, s%history, int(min(most_rows, n - first), ip))
         call serializer%choose_rows('/pairs/', [(first + k, k=1_ip, size(part%key, kind=ip))])
         call serialize_pairs(serializer, s%history, part)
         if (allocated(serializer%error)) cycle
         if (present(most_pieces)) part%key = translated(part%key)
         call check_pairs(s, part, serializer%error)
         owned = pack([(k, k=1_ip, size(part%key, kind=ip))], &
                      [(has_body(part%key(k)), k=1_ip, size(part%key, kind=ip))])
         call s%received_history%append(part, owned)
      end do

   contains

      !> The key of a pair with the identifiers that its pieces have in this run
      elemental integer(lp) function translated(key)
         integer(lp), intent(in) :: key
         integer(lp) :: id(2)

         id = [shiftr(key, 32), iand(key, int(huge(1_ip), lp))]
         id = id/most_pieces*s%bodies%pieces%most + modulo(id, int(most_pieces, lp))
         translated = ior(shiftl(id(1), 32), id(2))
      end function translated

      !> Whether this rank moves a body of a pair
      pure logical function has_body(key)
         integer(lp), intent(in) :: key
         integer(ip) :: slots(2)

         slots = s%bodies%pieces%bodies_of(slots_of_pair(id, key))
         has_body = any(slots > 0_ip)
         if (slots(1) > 0_ip) has_body = .not. s%bodies%in_halo(slots(1)) .and. .not. s%bodies%fixed(slots(1))
         if (.not. has_body .and. slots(2) > 0_ip) &
            has_body = .not. s%bodies%in_halo(slots(2)) .and. .not. s%bodies%fixed(slots(2))
      end function has_body

   end subroutine read_pairs

   !> Serialize pairs and their contact history.
   subroutine serialize_pairs(serializer, history, packed)
      class(serializer_t), intent(inout) :: serializer
      !> Columns of the history
      type(contact_history_t), intent(in) :: history
      !> Pairs; when reading, their number is given
      type(packed_history_t), intent(inout) :: packed
      integer(lp), allocatable :: ids(:)
      real(wp), allocatable :: column(:)
      integer :: k

      ids = shiftr(packed%key, 32)
      call serializer%field('/pairs/first', ids, '1', 'lower identifier of each pair of pieces')
      if (serializer%is_reading) packed%key = shiftl(ids, 32)
      ids = iand(packed%key, int(huge(1_ip), lp))
      call serializer%field('/pairs/second', ids, '1', 'higher identifier of each pair of pieces')
      if (serializer%is_reading) packed%key = ior(packed%key, iand(ids, int(huge(1_ip), lp)))
      if (.not. allocated(history%column)) return
      do k = 1, size(history%column)
         associate (kind => history%column(k)%kind)
            column = packed%value(k, :)
            call serializer%field('/pairs/'//trim(kind%name), column, trim(kind%unit), trim(kind%meaning))
            packed%value(k, :) = column
         end associate
      end do
   end subroutine serialize_pairs

   !> Allocate a number of pairs without history.
   subroutine resize(packed, history, n)
      type(packed_history_t), intent(out) :: packed
      type(contact_history_t), intent(in) :: history
      integer(ip), intent(in) :: n
      integer :: n_columns

      n_columns = 0
      if (allocated(history%column)) n_columns = size(history%column)
      allocate (packed%key(n), source=0_lp)
      allocate (packed%features(n), source=0_ip)
      allocate (packed%value(max(1, n_columns), n), source=0.0_wp)
   end subroutine resize

   !> Check that pairs are in ascending order, and in a serial run, which has all bodies, that their bodies exist.
   subroutine check_pairs(s, packed, error)
      type(simulation_t), intent(in) :: s
      type(packed_history_t), intent(in) :: packed
      type(error_t), allocatable, intent(inout) :: error
      integer(ip), allocatable :: id(:)
      integer(ip) :: k, slots(2)
      logical :: is_known

      id = piece_identifiers(s%bodies)
      do k = 1_ip, size(packed%key, kind=ip)
         slots = slots_of_pair(id, packed%key(k))
         is_known = all(slots > 0_ip) .or. s%bodies%n < s%bodies%n_all
         if (k > 1_ip) is_known = is_known .and. packed%key(k) > packed%key(k - 1_ip)
         if (.not. is_known) then
            call raise(error, input_error, '/pairs/first or /pairs/second differs from the saved state')
            return
         end if
      end do
   end subroutine check_pairs

end module polydem_checkpoint_fields
