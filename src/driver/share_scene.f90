!> How the processes that do not lead come to know the scene: its fixed bodies, their motions and the numbers that hold
!> for all. Free bodies come with the first step.
module polydem_share_scene
   use polydem_archive, only: archive_t
   use polydem_assemble, only: index_contacts
   use polydem_bodies, only: bodies_t, turn_bodies
   use polydem_contacts, only: reserve_contacts
   use polydem_domain, only: new_domain
   use polydem_errors, only: error_t, input_error, raise
   use polydem_freight, only: freight_t, load, unload
   use polydem_integrator_factory, only: new_integrator
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_motion, only: motion_names, motion_t
   use polydem_settings, only: settings_t
   use polydem_simulation_parts, only: fit_to_bodies, simulation_t
   use polydem_team, only: team_t
   implicit none
   private
   public :: check_team, share_scene, sharer_t

   !> An archive that gives all processes what the leader has of the whole run
   type, extends(archive_t) :: sharer_t
      !> Processes
      class(team_t), allocatable :: team
   contains
      procedure :: exchange_reals
      procedure :: exchange_longs
   end type sharer_t

contains

   !> Give all processes the scene that the leader has. From now on the simulation belongs to the team; collective.
   subroutine share_scene(settings, team, self, error)
      !> Settings of the run, the same on all
      type(settings_t), intent(in) :: settings
      !> Processes
      class(team_t), intent(inout) :: team
      !> The simulation of the leader, before or between steps; that of others is made
      type(simulation_t), intent(inout) :: self
      !> What processes cannot share
      type(error_t), allocatable, intent(inout) :: error
      integer(lp) :: counts(4)
      real(dp) :: numbers(4)

      if (team%leads()) then
         counts = [int(self%bodies%n_all, lp), self%n_steps, size(self%motions, kind=lp), self%step]
         numbers = real([self%dt, self%expected_stable_step, self%maker%grain, self%guard%limit], dp)
      end if
      if (team%size > 1_ip) then
         call team%share(counts)
         call team%share(numbers)
         if (.not. team%leads()) then
            self%settings = settings
            self%n_steps = counts(2)
            self%step = counts(4)
            self%dt = real(numbers(1), wp)
            self%expected_stable_step = real(numbers(2), wp)
            self%guard%limit = real(numbers(4), wp)
            ! The limit is that of the run, not of the bodies that come to be here.
            self%generation = 1_ip
            call new_integrator(settings%integrate, self%integrator)
            allocate (self%motions(counts(3)))
         end if
         call share_fixed(team, int(counts(1), ip), self%bodies)
         call share_motions(team, self%motions)
         if (.not. team%leads()) call begin_without_free_bodies(self, real(numbers(3), wp), error)
      end if
      call new_domain(self%domain, settings%exchange, self%maker%grain, team, error)
      if (allocated(self%team)) deallocate (self%team)
      allocate (self%team, source=team)
   end subroutine share_scene

   !> Refuse what only one process can do.
   subroutine check_team(settings, team, error)
      !> Settings of a run
      type(settings_t), intent(in) :: settings
      !> Processes that are to share it
      class(team_t), intent(in) :: team
      !> Names the entry; the same on all processes
      type(error_t), allocatable, intent(inout) :: error

      if (team%size == 1_ip) return
      if (settings%forces%friction == 'exact') call raise(error, input_error, settings%file// &
         ': exact friction couples all contacts and needs a process of its own; use threads instead of ranks, or '// &
         'friction = ''cundall_strack'' in &forces')
      if (settings%output%trace_steps > 0_ip .or. settings%output%step_profile) call raise(error, input_error, &
         settings%file//': trace_steps and step_profile in &output record one process; run it without ranks')
   end subroutine check_team

   subroutine share_fixed(team, n_all, bodies)
      class(team_t), intent(inout) :: team
      integer(ip), intent(in) :: n_all
      type(bodies_t), intent(inout) :: bodies
      type(freight_t) :: freight
      real(dp), allocatable :: pose(:, :)
      integer(ip), allocatable :: slots(:)
      integer(lp) :: counts(2)
      integer(ip) :: s

      if (team%leads()) then
         slots = pack([(s, s=1_ip, bodies%n)], bodies%fixed)
         call load(bodies, slots, freight)
         pose = real(reshape([bodies%position(1, slots), bodies%position(2, slots), bodies%angle(slots)], &
                             [size(slots), 3]), dp)
         counts = [size(freight%label, 2, kind=lp), size(freight%shape, 2, kind=lp)]
      end if
      call team%share(counts)
      if (.not. team%leads()) allocate (freight%label(4, counts(1)), freight%mass(4, counts(1)), &
                                        freight%shape(2, counts(2)), pose(counts(1), 3))
      call share_longs(team, freight%label)
      call share_reals(team, freight%mass)
      call share_reals(team, freight%shape)
      call share_doubles(team, pose)
      if (team%leads()) return
      call unload(freight, n_all, bodies, slots)
      bodies%position(1, :) = real(pose(:, 1), wp)
      bodies%position(2, :) = real(pose(:, 2), wp)
      bodies%angle = real(pose(:, 3), wp)
      call turn_bodies(bodies, slots)
   end subroutine share_fixed

   !> Slots of motions are those of the leader before, and of this process after.
   subroutine share_motions(team, motions)
      class(team_t), intent(inout) :: team
      type(motion_t), intent(inout) :: motions(:)
      integer(lp), allocatable :: rows(:)
      real(dp), allocatable :: poses(:)
      real(dp) :: numbers(10)
      integer(lp) :: counts(2)
      integer :: k, n

      do k = 1, size(motions)
         associate (motion => motions(k))
            if (team%leads()) then
               counts(1) = size(motion%slots, kind=lp)
               do n = 1, size(motion_names)
                  if (motion_names(n) == motion%kind) counts(2) = int(n, lp)
               end do
               numbers = real([motion%pivot, motion%rate, motion%velocity, motion%amplitude, motion%frequency, &
                               motion%start, motion%ramp], dp)
               rows = int(motion%slots, lp)
               poses = real([motion%position(1, :), motion%position(2, :), motion%angle], dp)
            end if
            call team%share(counts)
            call team%share(numbers)
            n = int(counts(1))
            if (.not. team%leads()) then
               if (allocated(rows)) deallocate (rows, poses)
               allocate (rows(n), poses(3*n))
            end if
            call team%share(rows)
            call team%share(poses)
            if (team%leads()) cycle
            motion%kind = motion_names(counts(2))
            motion%pivot = real(numbers(1:2), wp)
            motion%rate = real(numbers(3), wp)
            motion%velocity = real(numbers(4:5), wp)
            motion%amplitude = real(numbers(6:7), wp)
            motion%frequency = real(numbers(8), wp)
            motion%start = real(numbers(9), wp)
            motion%ramp = real(numbers(10), wp)
            motion%slots = int(rows, ip)
            allocate (motion%position(2, n))
            motion%position(1, :) = real(poses(:n), wp)
            motion%position(2, :) = real(poses(n + 1:2*n), wp)
            motion%angle = real(poses(2*n + 1:), wp)
         end associate
      end do
   end subroutine share_motions

   !> Everything else of a process that has fixed bodies only.
   subroutine begin_without_free_bodies(self, grain, error)
      type(simulation_t), intent(inout) :: self
      real(wp), intent(in) :: grain
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: k, j, s

      do k = 1_ip, size(self%motions, kind=ip)
         do j = 1_ip, size(self%motions(k)%slots, kind=ip)
            do s = 1_ip, self%bodies%n
               if (self%bodies%row(s) == self%motions(k)%slots(j)) exit
            end do
            self%motions(k)%slots(j) = s
         end do
      end do
      call fit_to_bodies(self, error, grain)
      if (allocated(error)) return
      call reserve_contacts(self%contacts, 0_ip)
      call index_contacts(self%bodies%n, self%contacts, self%incidence)
      call self%integrator%start(self%bodies)
   end subroutine begin_without_free_bodies

   !> Give all processes what the leader has, if it belongs to the whole run.
   subroutine exchange_reals(self, name, width, values, unit, meaning)
      class(sharer_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: width
      real(dp), intent(inout), contiguous :: values(:)
      character(len=*), intent(in) :: unit, meaning

      if (index(name, '/run/') == 1) call self%team%share(values)
      associate (unused => unit//meaning, same => width)
      end associate
   end subroutine exchange_reals

   !> The same for whole numbers
   subroutine exchange_longs(self, name, values, unit, meaning)
      class(sharer_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer(lp), intent(inout), contiguous :: values(:)
      character(len=*), intent(in) :: unit, meaning

      if (index(name, '/run/') == 1) call self%team%share(values)
      associate (unused => unit//meaning)
      end associate
   end subroutine exchange_longs

   subroutine share_longs(team, table)
      class(team_t), intent(inout) :: team
      integer(lp), intent(inout) :: table(:, :)
      integer(lp) :: list(size(table))

      list = reshape(table, [size(table)])
      call team%share(list)
      table = reshape(list, shape(table))
   end subroutine share_longs

   subroutine share_reals(team, table)
      class(team_t), intent(inout) :: team
      real(wp), intent(inout) :: table(:, :)
      real(dp) :: list(size(table))

      list = real(reshape(table, [size(table)]), dp)
      call team%share(list)
      table = real(reshape(list, shape(table)), wp)
   end subroutine share_reals

   subroutine share_doubles(team, table)
      class(team_t), intent(inout) :: team
      real(dp), intent(inout) :: table(:, :)
      real(dp) :: list(size(table))

      list = reshape(table, [size(table)])
      call team%share(list)
      table = reshape(list, shape(table))
   end subroutine share_doubles

end module polydem_share_scene
