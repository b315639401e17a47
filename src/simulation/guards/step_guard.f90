!> Guard of time steps above the stable time step of the contacts, or above half of it.
!>
!> A check compares dt with the stable step of all contacts together. Between checks a contact that is too stiff alone
!> is found in the step in which it becomes so.
module polydem_step_guard
   use polydem_bodies, only: bodies_t
   use polydem_contacts, only: contacts_t
   use polydem_errors, only: error_t, raise, run_error
   use polydem_global_reductions, only: reduce_to_greatest, reduce_to_least
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_serializer, only: serializer_t
   use polydem_settings, only: settings_t
   use polydem_simulation, only: guard_t, report_guard, serialize_guard, simulation_t
   use polydem_stability_limit, only: stability_table_t
   use polydem_stable_bodies, only: stable_step_of_bodies
   use polydem_stable_step, only: contact_numbers, stable_step_alone, stable_step_of_contacts, stiffest_product
   use polydem_strings, only: to_text
   use polydem_wall_load, only: wall_mobilities
   implicit none
   private
   public :: step_guard_t, check_stability, find_stable_step

   !> Fraction of the stable time step above which a run warns
   real(wp), parameter :: warn_share = 0.5_wp

   !> Guard of the time step
   type, extends(guard_t) :: step_guard_t
      !> Greatest dt / stable dt so far, and that of a warning so far [1]
      real(wp) :: greatest = 0.0_wp, warned = 0.0_wp
   contains
      procedure :: configure
      procedure :: set_local_limits
      procedure :: look
      procedure :: asks
      procedure :: serialize
      procedure :: report
   end type step_guard_t

contains

   !> Set what the guard says of itself.
   subroutine configure(self, settings)
      class(step_guard_t), intent(inout) :: self
      type(settings_t), intent(in) :: settings

      self%noun = 'check'
      self%finding = 'with dt above half the stable time step'
      self%choice = settings%guards%step
      self%needs_contacts = .true.
      self%is_global = .true.
   end subroutine configure

   !> Flag contacts that may be too stiff alone.
   subroutine set_local_limits(self, simulation)
      class(step_guard_t), intent(in) :: self
      type(simulation_t), intent(inout) :: simulation

      if (self%is_on) simulation%loop%flag_limits%soft = stiffest_product( &
         simulation%law, simulation%motion%integrator%stability(), simulation%bodies, simulation%dt/warn_share)
   end subroutine set_local_limits

   !> Whether this rank has a contact in this step whose dt / stable dt, alone, exceeds all that the log warns of so far
   logical function asks(self, simulation)
      class(step_guard_t), intent(in) :: self
      type(simulation_t), intent(in) :: simulation

      asks = .false.
      if (.not. self%is_on .or. simulation%loop%flagged%n == 0_ip) return
      asks = greatest_share(simulation) > max(warn_share, 1.1_wp*self%warned)
   end function asks

   !> Compare dt with the stable time step. A further warning needs a ratio that is larger by a tenth.
   subroutine look(self, simulation, error)
      class(step_guard_t), intent(inout) :: self
      type(simulation_t), intent(inout) :: simulation
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: warning
      real(wp) :: stable, share

      share = 0.0_wp
      if (self%is_check) then
         call check_stability(simulation, stable, warning, error)
         call simulation%comm%all_reduce_text(warning)
         if (stable < huge(stable)) share = simulation%dt/stable
      else if (self%is_asked) then
         call check_flagged(simulation, share, warning, error)
      end if
      self%greatest = max(self%greatest, share)
      if (.not. allocated(warning)) return
      self%warning%count = self%warning%count + 1_lp
      if (share <= 1.1_wp*self%warned) return
      self%warned = share
      call move_alloc(warning, self%warning%text)
   end subroutine look

   !> Serialize what the guard has found.
   subroutine serialize(self, serializer)
      class(step_guard_t), intent(inout) :: self
      class(serializer_t), intent(inout) :: serializer

      call serialize_guard(self, serializer)
      call serializer%field('/run/warned_share', self%warned, '1', 'greatest dt / stable dt of a warning')
      call serializer%field('/run/greatest_share', self%greatest, '1', 'greatest dt / stable dt')
   end subroutine serialize

   !> Lines for the end of the log
   function report(self) result(text)
      class(step_guard_t), intent(in) :: self
      character(len=:), allocatable :: text
      character(len=:), allocatable :: ratio

      text = report_guard(self)
      if (.not. self%greatest > 0.0_wp) return
      ratio = 'max dt / stable dt of the contacts: '//to_text(self%greatest, 3)
      if (text /= '') ratio = ratio//new_line('a')
      text = ratio//text
   end function report

   !> Compare the time step with the stable time step of the present contacts. The rank that has the critical contact
   !> warns or fails. Collective.
   subroutine check_stability(self, stable, warning, error)
      type(simulation_t), intent(inout) :: self
      !> Stable time step of the present contacts [s], huge if there are none
      real(wp), intent(out) :: stable
      !> Allocated if dt is large, or if it is unstable and `step` of &guards is not 'stop'
      character(len=:), allocatable, intent(out) :: warning
      !> Allocated if dt is unstable and `step` of &guards is 'stop'
      type(error_t), allocatable, intent(inout) :: error
      type(error_t), allocatable :: failure
      integer(ip) :: critical

      call find_stable_step(self, stable, critical)
      call compare_step(self%bodies, self%contacts, self%step, self%dt, stable, critical, &
                      remedy_text(self, self%contacts, critical), warning, failure)
      if (.not. allocated(failure)) return
      if (self%settings%guards%step /= 'stop') then
         warning = failure%message
      else if (.not. allocated(error)) then
         call move_alloc(failure, error)
      end if
   end subroutine check_stability

   !> Greatest dt / stable dt of the flagged contacts of this rank, each contact alone; 0 if there is none
   real(wp) function greatest_share(self)
      type(simulation_t), intent(in) :: self
      integer(ip) :: worst

      call find_stiffest(self, greatest_share, worst)
   end function greatest_share

   !> Find the flagged contact with the greatest dt / stable dt, each contact alone.
   subroutine find_stiffest(self, share, worst)
      type(simulation_t), intent(in) :: self
      !> Greatest dt / stable dt, 0 if there is no flagged contact
      real(wp), intent(out) :: share
      !> Its index among the flagged contacts, 0 if there is none
      integer(ip), intent(out) :: worst
      real(wp) :: this
      integer(ip) :: c

      share = 0.0_wp
      worst = 0_ip
      associate (flagged => self%loop%flagged, bodies => self%bodies)
         do c = 1_ip, flagged%n
            if (.not. flagged%row(c)%length*flagged%row(c)%inverse_length*(bodies%inverse_mass(flagged%row(c)%first) &
                + bodies%inverse_mass(flagged%row(c)%second)) > self%loop%flag_limits%soft) cycle
            this = self%dt/stable_step_alone(self%law, self%motion%integrator%stability(), bodies, flagged, c)
            if (this <= share) cycle
            share = this
            worst = c
         end do
      end associate
   end subroutine find_stiffest

   !> Compare the time step with the stable time step of each flagged contact alone. This finds short contacts; the
   !> stable step of all contacts together is less (`check_stability`). All ranks get the message of the stiffest
   !> contact. Collective.
   subroutine check_flagged(self, share, warning, error)
      type(simulation_t), intent(inout) :: self
      !> Greatest dt / stable dt of the flagged contacts of all ranks
      real(wp), intent(out) :: share
      !> Allocated if dt is large, or if it is unstable and `step` of &guards is not 'stop'
      character(len=:), allocatable, intent(out) :: warning
      !> Allocated if dt is unstable and `step` of &guards is 'stop'
      type(error_t), allocatable, intent(inout) :: error
      type(error_t), allocatable :: failure
      real(wp) :: greatest(1)
      integer(ip) :: worst

      call find_stiffest(self, share, worst)
      if (worst > 0_ip) call compare_step(self%bodies, self%loop%flagged, self%step, self%dt, self%dt/share, worst, &
                                        remedy_text(self, self%loop%flagged, worst), warning, failure)
      if (allocated(failure)) warning = failure%message
      call self%comm%all_reduce_text(warning, real(share, dp))
      greatest = share
      call reduce_to_greatest(self%comm, greatest)
      share = greatest(1)
      if (.not. allocated(warning) .or. share <= 1.0_wp .or. self%settings%guards%step /= 'stop') return
      call raise(error, run_error, warning)
      deallocate (warning)
   end subroutine check_flagged

   !> Sentences about a contact that is too stiff for dt: the speed of its impact and the one assumed, and the remedy
   function remedy_text(self, contacts, c) result(text)
      type(simulation_t), intent(in) :: self
      type(contacts_t), intent(in) :: contacts
      !> Index of the contact; 0: none
      integer(ip), intent(in) :: c
      character(len=:), allocatable :: text
      real(wp) :: mobility, speed

      text = '. Reduce dt'
      if (c == 0_ip .or. self%settings%integrate%dt > 0.0_wp) return
      mobility = self%bodies%inverse_mass(contacts%row(c)%first) + self%bodies%inverse_mass(contacts%row(c)%second)
      ! The energy of the contact is as yet that of the approach, and that of the spring.
      speed = sqrt((contacts%row(c)%rate/contacts%row(c)%length)**2 &
                   + contacts%row(c)%elastic*contacts%row(c)%area/contacts%row(c)%length*mobility)
      text = '. Its bodies met at about '//to_text(speed, 3)//' m/s; dt is chosen for '// &
         to_text(self%expected%speed, 3)//' m/s ('//self%expected%origin//'). '
      ! The step of bodies of several pieces does not depend on the speed.
      if (speed > self%expected%speed .and. self%bodies%pieces%most == 1_ip) then
         text = text//'Increase speed in &integrate'
      else
         text = text//'Reduce safety_factor in &integrate'
      end if
   end function remedy_text

   !> Find the stable time step of the present contacts. Collective.
   subroutine find_stable_step(self, stable, critical)
      type(simulation_t), intent(inout) :: self
      !> Stable time step of the contacts of all ranks [s], huge if there are none
      real(wp), intent(out) :: stable
      !> Index of the contact that limits it; 0 if this rank does not have it
      integer(ip), intent(out) :: critical
      type(stability_table_t) :: table
      real(wp), allocatable :: numbers(:), wall_mobility(:)
      real(wp) :: steps(2), least(2)
      integer(ip) :: limiting(2)
      integer :: k

      numbers = contact_numbers(self%bodies%n, self%loop%incidence)
      call self%domain%halo%exchange_column(self%comm, numbers)
      if (allocated(self%walls%loads)) wall_mobility = wall_mobilities(self%walls%loads, self%walls%wall, self%bodies)
      table = self%motion%integrator%stability()
      call stable_step_of_contacts(self%law, table, self%bodies, numbers, self%contacts, steps(1), limiting(1), &
                                   wall_mobility)
      call stable_step_of_bodies(self%law, table, self%bodies, self%contacts, self%loop%incidence, steps(2), &
                                 limiting(2), wall_mobility)
      least = steps
      call reduce_to_least(self%comm, least)
      ! Each of both is a bound.
      k = maxloc(least, 1)
      stable = least(k)
      critical = merge(0_ip, limiting(k), steps(k) > stable)
   end subroutine find_stable_step

   !> Compare the time step with the stable time step of the contacts: warning above one half of it, error above it.
   subroutine compare_step(bodies, contacts, step, dt, stable, critical, remedy, warning, error)
      type(bodies_t), intent(in) :: bodies
      type(contacts_t), intent(in) :: contacts
      !> Number of the step
      integer(lp), intent(in) :: step
      !> Time step [s]
      real(wp), intent(in) :: dt
      !> Stable time step [s]
      real(wp), intent(in) :: stable
      !> Index of the contact that determines it, 0 if there is none
      integer(ip), intent(in) :: critical
      !> Sentences that follow the message: what is assumed, and what to do
      character(len=*), intent(in) :: remedy
      !> Allocated if dt exceeds `warn_share` of the stable time step, but not the stable time step
      character(len=:), allocatable, intent(out) :: warning
      !> Names the contact if dt exceeds the stable time step
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: text

      if (critical == 0_ip .or. dt <= warn_share*stable) return
      associate (i => contacts%row(critical)%first, j => contacts%row(critical)%second)
         text = 'step '//to_text(step)//': dt = '//to_text(dt)//' s is '//to_text(dt/stable, 3)// &
            ' of the stable step, set by the contact of the bodies '//to_text(bodies%id(i))//' and '// &
            to_text(bodies%id(j))//' at ('// &
            to_text(bodies%position(1, i) + contacts%row(critical)%arm_first(1))//', '// &
            to_text(bodies%position(2, i) + contacts%row(critical)%arm_first(2))//') m'//remedy
      end associate
      if (dt > stable) then
         call raise(error, run_error, text)
      else
         warning = text
      end if
   end subroutine compare_step

end module polydem_step_guard
