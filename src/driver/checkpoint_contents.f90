!> The list of what a checkpoint holds, and the only one: what outlives a step and does not follow from the namelist.
!>
!> Not in it are shapes and masses (scenes are made again; a hash tells if they come out otherwise), motions (functions
!> of time), contacts (functions of the step to come) and what neighbour finders remember. These start afresh with the
!> boxes of the last search, which are kept: they need not be those of the bodies at the end of the step, since Gear's
!> scheme moves bodies once more, and the pairs whose memory is kept are theirs.
module polydem_checkpoint_contents
   use polydem_archive, only: archive_t
   use polydem_bodies, only: bodies_t, state_hash, turn_bodies
   use polydem_contacts, only: contact_memory_t, memory_kinds
   use polydem_errors, only: error_t, input_error, raise, run_error
   use polydem_hash, only: mix_word
   use polydem_kept_bodies, only: keep_bodies
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_ledger, only: keep_books, keep_ledger
   use polydem_neighbours, only: neighbours_t, new_neighbours
   use polydem_simulation, only: simulation_t
   use polydem_strings, only: to_text
   use polydem_watch, only: keep_watch, watch_t
   implicit none
   private
   public :: history_t, keep_run, keep_whole, keep_progress, scene_hash

   !> The scene that a run began with, and its former attempts
   type :: history_t
      !> `scene_hash` of the bodies at time 0
      integer(lp) :: scene = 0_lp
      !> Attempts so far, with the present one
      integer(lp) :: attempts = 1_lp
      !> Elapsed time up to the checkpoint, without what was done twice [s]
      real(dp) :: seconds = 0.0_dp
      !> Closed segments of the trajectory
      integer(lp) :: segments = 0_lp
   end type history_t

contains

   !> Keep a run in an archive, or let one go on from there.
   subroutine keep_run(archive, simulation, history, watch)
      !> Archive; a failure is in its `error`
      class(archive_t), intent(inout) :: archive
      !> The simulation at the end of a step; if the archive gives back, any state of the same scene, which becomes the
      !> one that was kept, except that contacts are unknown until the next step
      type(simulation_t), intent(inout) :: simulation
      !> Former attempts
      type(history_t), intent(inout) :: history
      !> Guards
      type(watch_t), intent(inout) :: watch

      call keep_whole(archive, simulation, history, watch)
      associate (s => simulation)
         call keep_bodies(archive, s%bodies)
         call s%integrator%keep(archive)
         if (s%settings%output%ledger) call keep_books(s%ledger, s%bodies%n, archive)
         call archive%keep('/boxes/bounds', s%boxes%bounds(:, :s%boxes%n), 'm', &
                           'xmin, ymin, xmax, ymax when pairs were last searched')
         call keep_pairs(archive, s)
         if (.not. archive%gives_back .or. allocated(archive%error)) return
         call turn_bodies(s%bodies, s%moving)
         s%contacts%n = 0_ip
         s%contacts%n_degenerate = 0_ip
      end associate
   end subroutine keep_run

   !> Keep what belongs to the whole run and not to bodies, boxes or pairs.
   subroutine keep_whole(archive, simulation, history, watch)
      !> Archive; a failure is in its `error`
      class(archive_t), intent(inout) :: archive
      !> The simulation
      type(simulation_t), intent(inout) :: simulation
      !> Former attempts
      type(history_t), intent(inout) :: history
      !> Guards
      type(watch_t), intent(inout) :: watch

      call keep_progress(archive, simulation%step, history)
      call keep_watch(watch, archive)
      associate (s => simulation)
         call archive%match('/run/time_step', s%dt, 's', 'time step')
         call archive%match('/run/scene', [history%scene], '1', 'hash of the bodies at the start')
         call archive%match('/run/precision', [int(storage_size(1.0_wp), lp)], 'bit', 'working precision')
         call archive%keep('/run/sums', s%sums, '1', 'sums of pairs, contacts, pairs that began and ended, '// &
                           'contacts without direction')
         call archive%keep('/run/far_moves', s%guard%warning%count, '1', 'steps in which a body moved too far')
         call archive%keep('/run/stage_calls', s%timers%calls, '1', 'steps in which each stage ran')
         call archive%keep_seconds('/run/stage_total', s%timers%total, 'time spent in each stage')
         call archive%keep_seconds('/run/stage_least', s%timers%least, 'shortest time in a step')
         call archive%keep_seconds('/run/stage_most', s%timers%most, 'longest time in a step')
         if (s%settings%output%ledger) call keep_ledger(s%ledger, archive)
      end associate
   end subroutine keep_whole

   !> Keep how far a run has got; the part of `keep_run` that needs no simulation.
   subroutine keep_progress(archive, step, history)
      !> Archive; a failure is in its `error`
      class(archive_t), intent(inout) :: archive
      !> Steps done
      integer(lp), intent(inout) :: step
      !> Former attempts
      type(history_t), intent(inout) :: history
      real(dp) :: seconds(1)

      call archive%keep('/run/step', step, '1', 'steps done')
      call archive%keep('/run/attempts', history%attempts, '1', 'attempts so far')
      call archive%keep('/run/segments', history%segments, '1', 'closed segments of the trajectory')
      seconds = history%seconds
      call archive%keep_seconds('/run/seconds', seconds, 'elapsed time of the run, without what was done twice')
      history%seconds = seconds(1)
   end subroutine keep_progress

   !> Keep the pairs and what is remembered of them. Pairs that are given back are found again first.
   subroutine keep_pairs(archive, s)
      class(archive_t), intent(inout) :: archive
      type(simulation_t), intent(inout) :: s
      integer(ip) :: n

      if (archive%gives_back .and. .not. allocated(archive%error)) then
         call find_again(s, archive%error)
         if (allocated(archive%error)) return
      end if
      associate (pairs => s%neighbours%pairs, work => s%neighbours%finder%work)
         n = pairs%n
         call archive%match('/pairs/first', int(s%bodies%id(pairs%first(:n)), lp), '1', 'lower identifier of each pair')
         call archive%match('/pairs/second', int(s%bodies%id(pairs%second(:n)), lp), '1', 'higher identifier')
         call keep_memory(archive, n, s%memory)
         call expect_edges(archive, s)
         call archive%keep('/run/finder_counts', work%value, '1', 'work of the finder so far')
         call archive%keep_seconds('/run/finder_seconds', work%seconds, 'time of each phase of the finder')
      end associate
   end subroutine keep_pairs

   !> Begin the list of pairs anew, with the boxes of the last search.
   subroutine find_again(s, error)
      type(simulation_t), intent(inout) :: s
      type(error_t), allocatable, intent(inout) :: error

      call new_neighbours(s%neighbours, s%settings%neighbours%finder, s%boxes, error, s%settings%neighbours%skin)
      if (allocated(error)) return
      call s%neighbours%update(s%boxes)
      if (s%neighbours%pairs%contradictions > 0_lp) call raise(error, run_error, 'the finder '// &
         s%settings%neighbours%finder//' contradicts itself. This is a mistake in the program; all_pairs can take '// &
         'its place')
   end subroutine find_again

   !> Keep the columns of memory that the models of the scene have.
   subroutine keep_memory(archive, n, memory)
      class(archive_t), intent(inout) :: archive
      !> Number of pairs
      integer(ip), intent(in) :: n
      type(contact_memory_t), intent(inout) :: memory
      integer :: k

      if (archive%gives_back) memory%separating_edge = spread(0_ip, 1, n)
      call archive%keep('/pairs/separating_edge', memory%separating_edge(:n), '1', &
                        'edge that separated the pair last: +k of the first body, -k of the second, 0 unknown')
      do k = 1, size(memory_kinds)
         associate (kind => memory_kinds(k))
            call keep_column(archive, '/pairs/'//trim(kind%name), n, memory%column(k)%value, trim(kind%unit), &
                             trim(kind%meaning))
         end associate
      end do
   end subroutine keep_memory

   !> Refuse edges that the bodies of a pair do not have.
   subroutine expect_edges(archive, s)
      class(archive_t), intent(inout) :: archive
      type(simulation_t), intent(in) :: s
      integer(ip) :: edge, k

      if (.not. archive%gives_back .or. allocated(archive%error)) return
      associate (pairs => s%neighbours%pairs, start => s%bodies%vertex_start)
         do k = 1_ip, pairs%n
            edge = s%memory%separating_edge(k)
            if (edge <= start(pairs%first(k) + 1_ip) - start(pairs%first(k)) .and. &
                -edge <= start(pairs%second(k) + 1_ip) - start(pairs%second(k))) cycle
            call raise(archive%error, input_error, '/pairs/separating_edge of the bodies '// &
                       to_text(int(s%bodies%id(pairs%first(k)), lp))//' and '// &
                       to_text(int(s%bodies%id(pairs%second(k)), lp))//' is none that they have')
            return
         end do
      end associate
   end subroutine expect_edges

   !> Keep a column over pairs, if there is one.
   subroutine keep_column(archive, name, n, column, unit, meaning)
      class(archive_t), intent(inout) :: archive
      character(len=*), intent(in) :: name, unit, meaning
      integer(ip), intent(in) :: n
      real(wp), allocatable, intent(inout) :: column(:)

      if (.not. allocated(column)) return
      if (archive%gives_back) column = spread(0.0_wp, 1, n)
      call archive%keep(name, column(:n), unit, meaning)
   end subroutine keep_column

   !> Hash of everything that is known of bodies at the start: what never changes, and what does
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

end module polydem_checkpoint_contents
