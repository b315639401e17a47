!> Calls the guards of a run after each step, writes their warnings, and counts these.
module polydem_monitor
   use polydem_errors, only: error_t
   use polydem_guard_list, only: choose_guards
   use polydem_kinds, only: ip, lp
   use polydem_log, only: log_t
   use polydem_serializer, only: serializer_t
   use polydem_simulation, only: guard_item_t, simulation_t
   use polydem_strings, only: counted, to_text
   use polydem_warning, only: warning_t
   implicit none
   private
   public :: monitor_t, new_monitor, check_step, needs_contacts, asks_all, report_pending_warnings, &
      write_warning_counts, warnings_in_words, serialize_guards, warning_counts, set_warning_counts, most_guards

   !> Greatest number of guards
   integer, parameter :: most_guards = 16

   !> What the guards share
   type :: monitor_t
      !> Number of warnings about the initial state
      integer(lp) :: at_start = 0_lp
      !> Whether the guard of a rank asks in this step for a look of all ranks, as `asks_all` says
      logical :: is_asked = .false.
      !> Whether a guard may stop the run on one rank, in a step that is no check
      logical, private :: stops_alone = .false.
   end type monitor_t

   !> Steps between checks of guards that do not look in every step
   integer(lp), parameter :: interval = 100_lp

contains

   !> Prepare the guards. Collective.
   subroutine new_monitor(monitor, simulation)
      type(monitor_t), intent(out) :: monitor
      !> A simulation at time 0; its guards begin anew
      type(simulation_t), intent(inout) :: simulation
      type(guard_item_t), allocatable :: list(:)
      integer :: k

      call choose_guards(simulation%settings, list)
      do k = 1, size(list)
         associate (guard => list(k)%guard)
            call guard%start(simulation)
            monitor%stops_alone = monitor%stops_alone .or. (guard%stops_alone .and. guard%choice == 'stop')
         end associate
      end do
      call move_alloc(list, simulation%guards)
   end subroutine new_monitor

   !> Serialize the findings of the guards.
   subroutine serialize_guards(simulation, serializer)
      type(simulation_t), intent(inout) :: simulation
      class(serializer_t), intent(inout) :: serializer
      integer :: k

      do k = 1, size(simulation%guards)
         call simulation%guards(k)%guard%serialize(serializer)
      end do
   end subroutine serialize_guards

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
      type(guard_item_t), allocatable :: list(:)
      logical :: is_check
      integer :: k

      is_check = is_last .or. is_checked(simulation%step)
      if (simulation%comm%size == 1_ip) monitor%is_asked = asks_all(simulation)
      call move_alloc(simulation%guards, list)
      do k = 1, size(list)
         associate (guard => list(k)%guard)
            if (.not. guard%is_on) cycle
            guard%is_check = is_check
            guard%is_asked = monitor%is_asked
            call guard%look(simulation, error)
         end associate
      end do
      call move_alloc(list, simulation%guards)
      if (is_check .or. monitor%stops_alone) call simulation%comm%all_reduce_error(error)
      if (is_check .or. simulation%comm%size == 1_ip) call report_pending_warnings(simulation, log)
      do k = 1, size(simulation%guards)
         associate (guard => simulation%guards(k)%guard)
            if (guard%is_global) call write_pending(guard%warning, log)
         end associate
      end do
   end subroutine check_step

   !> Whether the monitor checks all that it can after a step
   pure logical function is_checked(step)
      integer(lp), intent(in) :: step

      is_checked = mod(step, interval) == 0_lp
   end function is_checked

   !> Whether the monitor needs the table of contacts of a step
   pure logical function needs_contacts(simulation, step, is_last)
      type(simulation_t), intent(in) :: simulation
      !> The step
      integer(lp), intent(in) :: step
      !> As in `check_step`
      logical, intent(in) :: is_last
      integer :: k

      needs_contacts = .false.
      if (.not. (is_last .or. is_checked(step))) return
      do k = 1, size(simulation%guards)
         associate (guard => simulation%guards(k)%guard)
            needs_contacts = needs_contacts .or. (guard%needs_contacts .and. guard%is_on)
         end associate
      end do
   end function needs_contacts

   !> Whether a guard of this rank asks for a look of all ranks
   logical function asks_all(simulation)
      !> The simulation at the end of a step
      type(simulation_t), intent(in) :: simulation
      integer :: k

      asks_all = .false.
      do k = 1, size(simulation%guards)
         if (.not. asks_all) asks_all = simulation%guards(k)%guard%asks(simulation)
      end do
   end function asks_all

   !> Write the pending warnings of all ranks, and all-reduce their counts; collective.
   subroutine report_pending_warnings(simulation, log)
      type(simulation_t), intent(inout) :: simulation
      type(log_t), intent(inout) :: log
      integer(lp) :: counts(most_guards)
      integer :: k

      if (simulation%comm%size > 1_ip) then
         counts = warning_counts(simulation)
         call simulation%comm%all_reduce_max(counts)
         call set_warning_counts(simulation, counts)
      end if
      do k = 1, size(simulation%guards)
         associate (warning => simulation%guards(k)%guard%warning)
            if (simulation%comm%size > 1_ip) call simulation%comm%all_reduce_text(warning%text, warning%weight)
            call write_pending(warning, log)
         end associate
      end do
   end subroutine report_pending_warnings

   !> Write the pending warning of a guard, if there is one.
   subroutine write_pending(warning, log)
      type(warning_t), intent(inout) :: warning
      type(log_t), intent(inout) :: log
      character(len=:), allocatable :: text

      if (.not. allocated(warning%text)) return
      call warning%take(text)
      call log%write_line('warning: '//text)
   end subroutine write_pending

   !> Number of warnings of each guard on this rank. Once per step the counts become the greatest of all ranks, so that
   !> a step counts once however many ranks warn.
   pure function warning_counts(simulation) result(counts)
      type(simulation_t), intent(in) :: simulation
      integer(lp) :: counts(most_guards)
      integer :: k

      counts = 0_lp
      do k = 1, size(simulation%guards)
         counts(k) = simulation%guards(k)%guard%warning%count
      end do
   end function warning_counts

   !> Set the counts to the greatest of all ranks.
   pure subroutine set_warning_counts(simulation, counts)
      type(simulation_t), intent(inout) :: simulation
      !> Counts in the order of `warning_counts`
      integer(lp), intent(in) :: counts(:)
      integer :: k

      do k = 1, size(simulation%guards)
         simulation%guards(k)%guard%warning%count = counts(k)
      end do
   end subroutine set_warning_counts

   !> Numbers of warnings of each kind, as in '2 about the initial state; 30 steps with a contact that was too deep';
   !> empty without one
   function warnings_in_words(monitor, simulation, at_end) result(text)
      type(monitor_t), intent(in) :: monitor
      type(simulation_t), intent(in) :: simulation
      !> Number of warnings at the end of the run
      integer(lp), intent(in) :: at_end
      character(len=:), allocatable :: text
      integer :: k

      text = ''
      if (monitor%at_start > 0_lp) text = text//'; '//to_text(monitor%at_start)//' about the initial state'
      do k = 1, size(simulation%guards)
         associate (guard => simulation%guards(k)%guard)
            if (guard%warning%count > 0_lp) text = text//'; '//counted(guard%warning%count, guard%noun)//' '// &
               guard%finding
         end associate
      end do
      if (at_end > 0_lp) text = text//'; '//to_text(at_end)//' at the end'
      text = text(min(len(text), 2) + 1:)
   end function warnings_in_words

   !> Write what each guard has found.
   subroutine write_warning_counts(monitor, simulation, log)
      type(monitor_t), intent(in) :: monitor
      type(simulation_t), intent(in) :: simulation
      type(log_t), intent(inout) :: log
      integer :: k

      if (monitor%at_start > 0_lp) call log%write_line( &
         'warnings: '//to_text(monitor%at_start)//' about the initial state')
      do k = 1, size(simulation%guards)
         if (simulation%guards(k)%guard%report() /= '') call log%write_line(simulation%guards(k)%guard%report())
      end do
   end subroutine write_warning_counts

end module polydem_monitor
