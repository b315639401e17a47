!> The monitor of a run: guards that check whole steps (depth of contacts, bodies passing through each other, energy,
!> stable time step), and the warnings of all guards.
!>
!> A guard that is off takes no time and allocates no array.
module polydem_monitor
   use polydem_contact_depth, only: any_deeper, deepest_contact, depth_share, depth_text
   use polydem_energy_guard, only: check_energy, energy_guard_t, open_energy_guard
   use polydem_errors, only: error_t
   use polydem_guards, only: place_of, shorter_step, warn_share
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_log, only: log_t
   use polydem_passing, only: passing_text
   use polydem_serializer, only: serializer_t
   use polydem_simulation, only: simulation_t
   use polydem_stability_check, only: check_stability, check_suspects, greatest_share
   use polydem_strings, only: to_text, counted
   use polydem_warning, only: warning_t
   implicit none
   private
   public :: monitor_t, new_monitor, check_step, checks_contacts, report_pending_warnings, write_warning_counts, &
      finds_stiff, serialize_monitor, warning_counts, set_warning_counts

   !> Guards and their findings
   type :: monitor_t
      !> Warnings of deep contacts
      type(warning_t) :: overlap
      !> Warnings of bodies passing through each other
      type(warning_t) :: passing
      !> Number of warnings about the initial state
      integer(lp) :: at_start = 0_lp
      !> Guard against unexplained energy gain
      type(energy_guard_t) :: energy
      !> Number of checks at which dt exceeded half the stable time step
      integer(lp) :: large_steps = 0_lp
      !> Greatest dt / stable dt of a warning so far [1]
      real(wp), private :: warned = 0.0_wp
      !> Greatest dt / stable dt so far [1]
      real(wp) :: greatest_share = 0.0_wp
      !> Whether a rank has a contact in this step that is too stiff for dt, as `finds_stiff` says
      logical :: has_stiff = .false.
   end type monitor_t

   !> Steps between checks of guards that do not run in every step
   integer(lp), parameter :: interval = 100_lp

contains

   !> Prepare the guards that are switched on. Collective.
   subroutine new_monitor(monitor, simulation)
      type(monitor_t), intent(out) :: monitor
      !> A simulation at time 0
      type(simulation_t), intent(inout) :: simulation

      associate (settings => simulation%settings%guards)
         if (settings%energy /= 'off') call open_energy_guard(monitor%energy, simulation)
      end associate
   end subroutine new_monitor

   !> Serialize the findings of the guards.
   subroutine serialize_monitor(monitor, serializer)
      type(monitor_t), intent(inout) :: monitor
      class(serializer_t), intent(inout) :: serializer

      call serializer%field('/run/deep_steps', monitor%overlap%count, '1', 'steps with a contact that was too deep')
      call serializer%field('/run/passing_steps', monitor%passing%count, '1', 'steps in which a body was passing '// &
                        'through another')
      call serializer%field('/run/energy_warnings', monitor%energy%warning%count, '1', &
                        'checks that found an unexplained energy gain')
      call serializer%field('/run/large_steps', monitor%large_steps, '1', 'checks with dt above half the stable dt')
      call serializer%field('/run/warned_share', monitor%warned, '1', 'greatest dt / stable dt of a warning')
      call serializer%field('/run/greatest_share', monitor%greatest_share, '1', 'greatest dt / stable dt')
   end subroutine serialize_monitor

   !> Check a step with the guards, and write new warnings. Collective; all ranks get the error.
   subroutine check_step(monitor, simulation, is_last, log, error)
      type(monitor_t), intent(inout) :: monitor
      !> The simulation at the end of a step
      type(simulation_t), intent(inout) :: simulation
      !> Whether to run all guards regardless of the interval between checks
      logical, intent(in) :: is_last
      type(log_t), intent(inout) :: log
      !> Allocated if the run must stop; names body, position and step
      type(error_t), allocatable, intent(inout) :: error
      logical :: check_all

      check_all = is_last .or. is_checked(simulation%step)
      associate (settings => simulation%settings%guards)
         if (settings%overlap /= 'off' .or. settings%passing /= 'off') &
            call check_contact_guards(monitor, simulation, error)
         if (settings%step /= 'off') then
            if (simulation%comm%size == 1_ip) monitor%has_stiff = finds_stiff(monitor, simulation)
            if (check_all) then
               call check_time_step(monitor, simulation, log, error)
            else if (monitor%has_stiff) then
               call respond_to_stiffness(monitor, simulation, log, error)
            end if
         end if
         if (check_all .and. settings%energy /= 'off') call check_energy(monitor%energy, simulation, error)
         if (check_all .or. settings%passing == 'stop') call simulation%comm%all_reduce_error(error)
      end associate
      if (check_all .or. simulation%comm%size == 1_ip) call report_pending_warnings(monitor, simulation, log)
      call write_pending(monitor%energy%warning, log)
   end subroutine check_step

   !> Whether the monitor checks all that it can after a step
   pure logical function is_checked(step)
      integer(lp), intent(in) :: step

      is_checked = mod(step, interval) == 0_lp
   end function is_checked

   !> Whether the monitor needs the table of contacts of a step
   pure logical function checks_contacts(simulation, step, is_last)
      type(simulation_t), intent(in) :: simulation
      !> The step
      integer(lp), intent(in) :: step
      !> As in `look`
      logical, intent(in) :: is_last

      checks_contacts = simulation%settings%guards%step /= 'off' .and. (is_last .or. is_checked(step))
   end function checks_contacts

   !> Write the pending warnings of all ranks, and all-reduce their counts; collective.
   subroutine report_pending_warnings(monitor, simulation, log)
      type(monitor_t), intent(inout) :: monitor
      type(simulation_t), intent(inout) :: simulation
      type(log_t), intent(inout) :: log
      integer(lp) :: counts(3)

      if (simulation%comm%size > 1_ip) then
         counts = warning_counts(monitor, simulation)
         call simulation%comm%all_reduce_max(counts)
         call set_warning_counts(monitor, simulation, counts)
      end if
      call report_guard(simulation%guard%warning)
      call report_guard(monitor%overlap)
      call report_guard(monitor%passing)

   contains

      subroutine report_guard(warning)
         type(warning_t), intent(inout) :: warning

         call simulation%comm%all_reduce_text(warning%text, warning%weight)
         call write_pending(warning, log)
      end subroutine report_guard

   end subroutine report_pending_warnings

   !> Write the pending warning of a guard, if there is one.
   subroutine write_pending(warning, log)
      type(warning_t), intent(inout) :: warning
      type(log_t), intent(inout) :: log
      character(len=:), allocatable :: text

      call warning%take(text)
      if (allocated(text)) call log%write_line('warning: '//text)
   end subroutine write_pending

   !> Number of steps with a warning, for the guards that run on each rank independently: displacement, overlap,
   !> passing. Once per step the counts become the greatest of all ranks, so a step counts once however many ranks warn.
   pure function warning_counts(monitor, simulation) result(counts)
      type(monitor_t), intent(in) :: monitor
      type(simulation_t), intent(in) :: simulation
      integer(lp) :: counts(3)

      counts = [simulation%guard%warning%count, monitor%overlap%count, monitor%passing%count]
   end function warning_counts

   !> Set the counts to the greatest of all ranks.
   pure subroutine set_warning_counts(monitor, simulation, counts)
      type(monitor_t), intent(inout) :: monitor
      type(simulation_t), intent(inout) :: simulation
      !> Counts in the order of `warning_counts`, (3)
      integer(lp), intent(in) :: counts(:)

      simulation%guard%warning%count = counts(1)
      monitor%overlap%count = counts(2)
      monitor%passing%count = counts(3)
   end subroutine set_warning_counts

   !> Write the greatest dt / stable dt and the number of warnings of each guard.
   subroutine write_warning_counts(monitor, simulation, log)
      type(monitor_t), intent(in) :: monitor
      !> The simulation at the end of the run
      type(simulation_t), intent(in) :: simulation
      type(log_t), intent(inout) :: log

      if (monitor%greatest_share > 0.0_wp) call log%write_line( &
         'max dt / stable dt of the contacts: '//to_text(monitor%greatest_share, 3))
      if (monitor%at_start > 0_lp) call log%write_line( &
         'warnings: '//to_text(monitor%at_start)//' about the initial state')
      call write_count(simulation%guard%warning%count, 'step', ' in which a body moved too far')
      call write_count(monitor%overlap%count, 'step', ' with a contact that was too deep')
      call write_count(monitor%passing%count, 'step', ' in which a body was passing through another')
      call write_count(monitor%energy%warning%count, 'check', ' that found an unexplained energy gain')
      call write_count(monitor%large_steps, 'check', ' with dt above half the stable time step')

   contains

      subroutine write_count(n, noun, which)
         integer(lp), intent(in) :: n
         character(len=*), intent(in) :: noun, which

         if (n > 0_lp) call log%write_line('warnings: '//counted(n, noun)//which)
      end subroutine write_count

   end subroutine write_warning_counts

   !> Check for deep contacts, and for bodies passing through each other.
   subroutine check_contact_guards(monitor, simulation, error)
      type(monitor_t), intent(inout) :: monitor
      type(simulation_t), intent(inout) :: simulation
      type(error_t), allocatable, intent(inout) :: error

      associate (settings => simulation%settings%guards)
         if (settings%overlap /= 'off') call respond_to_depth(monitor, simulation, error)
         if (simulation%walk%passing_pair > 0_ip .and. .not. allocated(error)) &
            call respond_to_passing(monitor, simulation, error)
      end associate
   end subroutine check_contact_guards

   !> Respond to the deepest contact. The rank with the deepest contact of all ranks reports it, at once if it stops the
   !> run.
   subroutine respond_to_depth(monitor, simulation, error)
      type(monitor_t), intent(inout) :: monitor
      type(simulation_t), intent(inout) :: simulation
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: text
      integer(ip) :: worst
      real(dp) :: share

      share = 0.0_dp
      associate (s => simulation, settings => simulation%settings%guards, &
                 thickness => simulation%bodies%thickness)
         if (any_deeper(s%walk%flagged, thickness, settings%overlap_limit)) then
            worst = deepest_contact(s%walk%flagged, thickness)
            text = depth_text(s%bodies, s%walk%flagged, thickness, worst)
            share = real(depth_share(s%walk%flagged, thickness, worst), dp)
         end if
         if (settings%overlap == 'stop') call s%comm%all_reduce_text(text, share)
         if (.not. allocated(text)) return
         call monitor%overlap%respond(settings%overlap, 'step '//to_text(s%step)//': '//text// &
                                    '. Increase stiffness in &forces, remove deep initial overlaps (relaxed_depth '// &
                                    'in &guards), or '//shorter_step(s%settings%integrate), error, share)
      end associate
   end subroutine respond_to_depth

   !> Respond to bodies passing through each other. The rank with the first such pair of all ranks reports it.
   subroutine respond_to_passing(monitor, simulation, error)
      type(monitor_t), intent(inout) :: monitor
      type(simulation_t), intent(inout) :: simulation
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: found
      integer(lp) :: place

      associate (s => simulation)
         found = findloc(s%walk%flagged%pair(:s%walk%flagged%n), s%walk%passing_pair, dim=1)
         place = place_of(s%bodies, s%walk%flagged%first(found), s%walk%flagged%second(found))
         call monitor%passing%respond(s%settings%guards%passing, 'step '//to_text(s%step)//': '// &
                                    passing_text(s%bodies, s%walk%flagged, s%bodies%radius, found, &
                                                 shorter_step(s%settings%integrate)), error, &
                                    -real(place, dp))
         if (allocated(error)) error%place = place
      end associate
   end subroutine respond_to_passing

   !> Whether this rank has a contact in this step whose dt / stable dt, alone, exceeds all that the log warns of so far
   logical function finds_stiff(monitor, simulation)
      type(monitor_t), intent(in) :: monitor
      type(simulation_t), intent(in) :: simulation

      finds_stiff = .false.
      if (simulation%settings%guards%step == 'off' .or. simulation%walk%flagged%n == 0_ip) return
      finds_stiff = greatest_share(simulation) > max(warn_share, 1.1_wp*monitor%warned)
   end function finds_stiff

   !> Respond to a contact that is too stiff for dt, in the step in which it becomes so. Collective.
   subroutine respond_to_stiffness(monitor, simulation, log, error)
      type(monitor_t), intent(inout) :: monitor
      type(simulation_t), intent(inout) :: simulation
      type(log_t), intent(inout) :: log
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: warning
      real(wp) :: share

      call check_suspects(simulation, share, warning, error)
      call note_share(monitor, share, warning, log)
   end subroutine respond_to_stiffness

   !> Compare dt to the stable time step of the contacts. A further warning needs a ratio that is larger by a tenth.
   subroutine check_time_step(monitor, simulation, log, error)
      type(monitor_t), intent(inout) :: monitor
      type(simulation_t), intent(inout) :: simulation
      type(log_t), intent(inout) :: log
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: warning
      real(wp) :: stable, share

      call check_stability(simulation, stable, warning, error)
      call simulation%comm%all_reduce_text(warning)
      share = 0.0_wp
      if (stable < huge(stable)) share = simulation%dt/stable
      call note_share(monitor, share, warning, log)
   end subroutine check_time_step

   !> Keep the greatest dt / stable dt, and write a warning about a greater one.
   subroutine note_share(monitor, share, warning, log)
      type(monitor_t), intent(inout) :: monitor
      !> dt / stable dt
      real(wp), intent(in) :: share
      !> Unallocated: none
      character(len=:), allocatable, intent(in) :: warning
      type(log_t), intent(inout) :: log

      monitor%greatest_share = max(monitor%greatest_share, share)
      if (.not. allocated(warning)) return
      monitor%large_steps = monitor%large_steps + 1_lp
      if (share <= 1.1_wp*monitor%warned) return
      monitor%warned = share
      call log%write_line('warning: '//warning)
   end subroutine note_share

end module polydem_monitor
