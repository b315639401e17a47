!> The guards of a run that look at whole steps: depth of contacts, bodies on their way through each other, energy,
!> stable step; and what all have to tell.
!>
!> A guard that is off is not looked at and holds no array.
module polydem_watch
   use polydem_archive, only: archive_t
   use polydem_body_sizes, only: thickness_of_bodies
   use polydem_depths, only: any_deeper, deepest_contact, depth_share, depth_text
   use polydem_energy_guard, only: check_energy, energy_guard_t, open_energy_guard
   use polydem_contacts, only: at_direction
   use polydem_errors, only: error_t
   use polydem_guards, only: place_of
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_log, only: log_t
   use polydem_passing, only: find_passing, least_depth, passing_text
   use polydem_simulation, only: check_stability, simulation_t
   use polydem_strings, only: to_text
   use polydem_warnings, only: warning_t
   implicit none
   private
   public :: watch_t, new_watch, look, tell_pending, sum_up, keep_watch, warning_counts, set_warning_counts

   !> Guards with what they have seen
   type :: watch_t
      !> Thickness of each body, (slot) [m]; only if contacts are watched
      real(wp), allocatable :: thickness(:)
      !> Generation of these bodies
      integer(ip), private :: generation = 0_ip
      !> Warnings of deep contacts
      type(warning_t) :: overlap
      !> Warnings of bodies on their way through each other
      type(warning_t) :: passing
      !> Warnings of the scene as it is at the start
      integer(lp) :: at_start = 0_lp
      !> Energy that nobody gave
      type(energy_guard_t) :: energy
      !> Looks at which the step was a large share of the stable one
      integer(lp) :: large_steps = 0_lp
      !> Greatest share of the stable step that was warned of
      real(wp), private :: warned = 0.0_wp
      !> Greatest share of the stable step seen
      real(wp) :: greatest_share = 0.0_wp
   end type watch_t

   !> Steps between two looks at what is not looked at in every step
   integer(lp), parameter :: interval = 100_lp

contains

   !> Prepare the guards that the settings ask for.
   subroutine new_watch(watch, simulation)
      !> The guards
      type(watch_t), intent(out) :: watch
      !> A simulation at time 0
      type(simulation_t), intent(in) :: simulation

      associate (settings => simulation%settings%guards)
         if (settings%overlap /= 'off' .or. settings%passing /= 'off') &
            watch%thickness = thickness_of_bodies(simulation%bodies)
         if (settings%energy /= 'off') call open_energy_guard(watch%energy, simulation%contacts)
      end associate
   end subroutine new_watch

   !> Keep in an archive what the guards have seen.
   subroutine keep_watch(watch, archive)
      !> The guards
      type(watch_t), intent(inout) :: watch
      !> Archive
      class(archive_t), intent(inout) :: archive

      call archive%keep('/run/deep_steps', watch%overlap%count, '1', 'steps with a contact that was too deep')
      call archive%keep('/run/passing_steps', watch%passing%count, '1', 'steps in which a body was on its way '// &
                        'through another')
      call archive%keep('/run/energy_looks', watch%energy%warning%count, '1', 'looks that found too much energy')
      call archive%keep('/run/large_steps', watch%large_steps, '1', 'looks that found less than twice the step')
      call archive%keep('/run/warned_share', watch%warned, '1', 'greatest share of the stable step warned of')
      call archive%keep('/run/greatest_share', watch%greatest_share, '1', 'greatest share of the stable step')
   end subroutine keep_watch

   !> Look at a step, and write warnings that are new. Collective; all processes know of a failure.
   subroutine look(watch, simulation, is_last, log, error)
      !> The guards
      type(watch_t), intent(inout) :: watch
      !> The simulation at the end of a step
      type(simulation_t), intent(inout) :: simulation
      !> Whether everything is looked at, however long ago the last look was
      logical, intent(in) :: is_last
      !> Log
      type(log_t), intent(inout) :: log
      !> Allocated if the run must stop; names body, position and step
      type(error_t), allocatable, intent(inout) :: error

      logical :: looks

      looks = is_last .or. mod(simulation%step, interval) == 0_lp
      associate (settings => simulation%settings%guards)
         if (settings%overlap /= 'off' .or. settings%passing /= 'off') call look_at_contacts(watch, simulation, error)
         if (looks .and. settings%step /= 'off') call look_at_step(watch, simulation, log, error)
         if (looks .and. settings%energy /= 'off') call check_energy(watch%energy, simulation, error)
         if (looks .or. settings%passing == 'stop') call simulation%team%agree(error)
      end associate
      if (looks .or. simulation%team%size == 1_ip) call tell_pending(watch, simulation, log)
      call watch%energy%warning%tell(log)
   end subroutine look

   !> Write warnings that one process has and nobody has been told of, and agree on their numbers; collective.
   subroutine tell_pending(watch, simulation, log)
      !> The guards
      type(watch_t), intent(inout) :: watch
      !> The simulation
      type(simulation_t), intent(inout) :: simulation
      !> Log
      type(log_t), intent(inout) :: log
      integer(lp) :: counts(3)

      if (simulation%team%size > 1_ip) then
         counts = warning_counts(watch, simulation)
         call simulation%team%maximise(counts)
         call set_warning_counts(watch, simulation, counts)
      end if
      call tell(simulation%guard%warning)
      call tell(watch%overlap)
      call tell(watch%passing)

   contains

      subroutine tell(warning)
         type(warning_t), intent(inout) :: warning

         call simulation%team%spread_text(warning%text, warning%weight)
         call warning%tell(log)
      end subroutine tell

   end subroutine tell_pending

   !> Steps in which this process had a reason to warn, of the guards that each process has for itself. A process that
   !> finds nothing gets the counts of the others once a step, so that a step counts once however many find something.
   pure function warning_counts(watch, simulation) result(counts)
      !> The guards
      type(watch_t), intent(in) :: watch
      !> The simulation
      type(simulation_t), intent(in) :: simulation
      integer(lp) :: counts(3)

      counts = [simulation%guard%warning%count, watch%overlap%count, watch%passing%count]
   end function warning_counts

   !> Take over the greatest counts of all processes.
   pure subroutine set_warning_counts(watch, simulation, counts)
      !> The guards
      type(watch_t), intent(inout) :: watch
      !> The simulation
      type(simulation_t), intent(inout) :: simulation
      !> As of `warning_counts`
      integer(lp), intent(in) :: counts(:)

      simulation%guard%warning%count = counts(1)
      watch%overlap%count = counts(2)
      watch%passing%count = counts(3)
   end subroutine set_warning_counts

   !> Write how often there was reason to warn.
   subroutine sum_up(watch, simulation, log)
      !> The guards
      type(watch_t), intent(in) :: watch
      !> The simulation at its end
      type(simulation_t), intent(in) :: simulation
      !> Log
      type(log_t), intent(inout) :: log

      if (watch%greatest_share > 0.0_wp) call log%write_line( &
         'greatest share of the stable step of the contacts: '//to_text(watch%greatest_share, 3))
      call write_count(watch%at_start, 'of the scene as it is at the start')
      call write_count(simulation%guard%warning%count, 'steps in which a body moved too far')
      call write_count(watch%overlap%count, 'steps with a contact that was too deep')
      call write_count(watch%passing%count, 'steps in which a body was on its way through another')
      call write_count(watch%energy%warning%count, 'looks at the energy that found too much of it')
      call write_count(watch%large_steps, 'looks at the stable step that found less than twice the step')

   contains

      subroutine write_count(n, what)
         integer(lp), intent(in) :: n
         character(len=*), intent(in) :: what

         if (n > 0_lp) call log%write_line('warnings: '//to_text(n)//' '//what)
      end subroutine write_count

   end subroutine sum_up

   !> Look for deep contacts, and for bodies on their way through each other.
   subroutine look_at_contacts(watch, simulation, error)
      type(watch_t), intent(inout) :: watch
      type(simulation_t), intent(inout) :: simulation
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: limit
      integer(ip) :: found
      logical :: any_deep

      associate (s => simulation, settings => simulation%settings%guards)
         if (watch%generation /= s%generation) watch%thickness = thickness_of_bodies(s%bodies)
         watch%generation = s%generation
         limit = huge(limit)
         if (settings%overlap /= 'off') limit = settings%overlap_limit
         found = 0_ip
         if (settings%passing /= 'off') then
            call find_passing(s%bodies, s%contacts, watch%thickness, s%guard%radius, limit, &
                              s%memory%column(at_direction)%value, found, any_deep)
         end if
         ! Shallow contacts are left out in the search for passing bodies.
         if (settings%passing == 'off' .or. limit < least_depth) &
            any_deep = any_deeper(s%contacts, watch%thickness, limit)
         if (settings%overlap /= 'off') call respond_to_depth(watch, simulation, any_deep, error)
         if (found > 0_ip .and. .not. allocated(error)) call respond_to_passing(watch, simulation, found, error)
      end associate
   end subroutine look_at_contacts

   !> Tell of the deepest contact. Of several processes, the one that has it speaks: at once if that stops the run.
   subroutine respond_to_depth(watch, simulation, any_deep, error)
      type(watch_t), intent(inout) :: watch
      type(simulation_t), intent(inout) :: simulation
      logical, intent(in) :: any_deep
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: text
      integer(ip) :: worst
      real(dp) :: share

      share = 0.0_dp
      associate (s => simulation, settings => simulation%settings%guards)
         if (any_deep) then
            worst = deepest_contact(s%contacts, watch%thickness)
            text = depth_text(s%bodies, s%contacts, watch%thickness, worst)
            share = real(depth_share(s%contacts, watch%thickness, worst), dp)
         end if
         if (settings%overlap == 'stop') call s%team%spread_text(text, share)
         if (.not. allocated(text)) return
         call watch%overlap%respond(settings%overlap, 'step '//to_text(s%step)//': '//text// &
                                    '. Take a smaller dt or a greater stiffness, or look for deep overlaps at the '// &
                                    'start (relaxed_depth in &guards)', error, share)
      end associate
   end subroutine respond_to_depth

   !> Tell of bodies on their way through each other. Of several processes, the one that has the first pair speaks.
   subroutine respond_to_passing(watch, simulation, found, error)
      type(watch_t), intent(inout) :: watch
      type(simulation_t), intent(inout) :: simulation
      !> Place in the table of contacts
      integer(ip), intent(in) :: found
      type(error_t), allocatable, intent(inout) :: error
      integer(lp) :: place

      associate (s => simulation)
         place = place_of(s%bodies, s%contacts%first(found), s%contacts%second(found))
         call watch%passing%respond(s%settings%guards%passing, 'step '//to_text(s%step)//': '// &
                                    passing_text(s%bodies, s%contacts, s%guard%radius, found), error, &
                                    -real(place, dp))
         if (allocated(error)) error%place = place
      end associate
   end subroutine respond_to_passing

   !> Compare the step with the stable step of the contacts, and warn when the share has grown by a tenth.
   subroutine look_at_step(watch, simulation, log, error)
      type(watch_t), intent(inout) :: watch
      type(simulation_t), intent(inout) :: simulation
      type(log_t), intent(inout) :: log
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: warning
      real(wp) :: stable, share

      call check_stability(simulation, stable, warning, error)
      call simulation%team%spread_text(warning)
      share = 0.0_wp
      if (stable < huge(stable)) share = simulation%dt/stable
      watch%greatest_share = max(watch%greatest_share, share)
      if (.not. allocated(warning)) return
      watch%large_steps = watch%large_steps + 1_lp
      if (share <= 1.1_wp*watch%warned) return
      watch%warned = share
      call log%write_line('warning: '//warning)
   end subroutine look_at_step

end module polydem_watch
