!> The start of a stage of a run: what changes there, and when the stage ends at the latest.
!>
!> A stage changes parameters only. Force law, contact history and time step stay those of the whole run.
module polydem_begin_stage
   use polydem_bodies_in_cell, only: path_of
   use polydem_changed_gravity, only: change_gravity
   use polydem_errors, only: error_t, input_error, raise
   use polydem_kinds, only: ip, lp, wp
   use polydem_ramp, only: window_t
   use polydem_run_duration, only: longest_stage
   use polydem_run_stages, only: run_stages_t
   use polydem_settings, only: forces_settings_t, settings_t, stage_settings_t
   use polydem_simulation, only: acts_on_all, simulation_t
   use polydem_source_locations, only: place_of
   use polydem_strings, only: to_text
   use polydem_wall, only: number_of
   implicit none
   private
   public :: prepare_stages, begin_stage, continue_stages, check_reference, find_last_steps, use_parameters, wall_vector

   !> Distance of two centres that coincide but for rounding, relative to the radius of a body
   real(wp), parameter :: coincident = sqrt(epsilon(1.0_wp))

contains

   !> Take the parameters of the first stage, before the simulation starts.
   subroutine prepare_stages(settings, stages, forces)
      type(settings_t), intent(in) :: settings
      type(run_stages_t), intent(inout) :: stages
      !> Parameters of the forces, as in the settings; gravity and drag become those of the first stage
      type(forces_settings_t), intent(inout) :: forces

      if (size(settings%stage) == 0) return
      stages%number = 1_ip
      stages%first = [0_lp]
      call set_parameters(settings, stages, forces)
   end subroutine prepare_stages

   !> Take the parameters of the present stage.
   subroutine set_parameters(settings, stages, forces)
      type(settings_t), intent(in) :: settings
      type(run_stages_t), intent(inout) :: stages
      !> Parameters of the forces; gravity and drag are set
      type(forces_settings_t), intent(inout) :: forces

      associate (stage => settings%stage(stages%number))
         forces%gravity = settings%forces%gravity
         if (size(stage%gravity) == 2) forces%gravity = stage%gravity
         forces%drag = settings%forces%drag + stage%drag
         stages%friction_scale = stage%friction_scale
      end associate
   end subroutine set_parameters

   !> Begin the next stage at the end of a step. Collective.
   subroutine begin_stage(self)
      !> The simulation at the last step of a stage that others follow
      type(simulation_t), intent(inout) :: self
      real(wp) :: former(2)

      former = self%forces%gravity
      associate (stages => self%stages)
         stages%number = stages%number + 1_ip
         stages%first = [stages%first, self%step]
         stages%is_decided = .false.
         stages%held_since = -1_lp
         stages%value = -1.0_wp
         call set_parameters(self%settings, stages, self%forces)
         if (self%settings%stage(stages%number)%until == 'strain') stages%reference = wall_vector(self)
      end associate
      associate (gravity => self%forces%gravity)
         if (self%settings%output%energy_balance .and. any(abs(gravity - former) > 0.0_wp)) call change_gravity( &
            self%energy_balance, self%comm, self%dt, former, gravity, self%bodies)
      end associate
      call use_parameters(self)
      call find_last_steps(self)
   end subroutine begin_stage

   !> Let force law, other forces, free flight, motions and loads use the parameters of the present stage.
   subroutine use_parameters(self)
      type(simulation_t), intent(inout) :: self
      integer :: k

      call self%law%scale_friction(self%stages%friction_scale)
      call self%body_forces%configure(self%forces)
      call self%motion%flight%start(self%forces%gravity, acts_on_all(self), self%motion%integrator, &
                                    self%bodies%n)
      do k = 1, size(self%walls%motions)
         call set_window(self%stages, self%dt, self%walls%motions(k)%motion)
      end do
      if (allocated(self%bodies%cell%load)) call set_window(self%stages, self%dt, self%bodies%cell%load%axis)
      if (.not. allocated(self%walls%loads)) return
      do k = 1, size(self%walls%loads)
         call set_window(self%stages, self%dt, self%walls%loads(k))
      end do
   end subroutine use_parameters

   !> Set the times at which a window opens and closes, as far as they are known.
   elemental subroutine set_window(stages, dt, window)
      type(run_stages_t), intent(in) :: stages
      !> Time step [s]
      real(wp), intent(in) :: dt
      !> Window of a motion, a load or the cell
      class(window_t), intent(inout) :: window

      if (window%stage == 0_ip .or. window%stage > stages%number) return
      window%start = real(stages%first(window%stage), wp)*dt
      window%end = huge(1.0_wp)
      if (window%stage < stages%number) window%end = real(stages%first(window%stage + 1_ip), wp)*dt
   end subroutine set_window

   !> Find the last step of the present stage, unless its condition or an action has decided it, and of the run.
   subroutine find_last_steps(self)
      !> The simulation; `stages` and `n_steps` change if it has stages
      type(simulation_t), intent(inout) :: self
      integer(ip) :: k

      associate (stages => self%stages, settings => self%settings%stage)
         if (stages%number > 0_ip) then
            if (.not. stages%is_decided) stages%last = stages%first(stages%number) &
               + steps_of(settings(stages%number), self%dt)
            self%n_steps = stages%last
            do k = stages%number + 1_ip, size(settings, kind=ip)
               self%n_steps = self%n_steps + steps_of(settings(k), self%dt)
            end do
         end if
      end associate
      if (allocated(self%actions)) self%n_steps = min(self%n_steps, self%actions%last_step)
   end subroutine find_last_steps

   !> Greatest number of steps of a stage
   pure integer(lp) function steps_of(stage, dt)
      type(stage_settings_t), intent(in) :: stage
      !> Time step [s]
      real(wp), intent(in) :: dt

      steps_of = max(1_lp, nint(longest_stage(stage)/dt, lp))
   end function steps_of

   !> Go on in the stage of a checkpoint, at the start with the first stage. Collective; all ranks get the same error.
   subroutine continue_stages(self, error)
      !> The simulation with the stages of the checkpoint, or at time 0
      type(simulation_t), intent(inout) :: self
      !> Allocated if the namelist does not have this stage, or if the stage is shorter now
      type(error_t), allocatable, intent(inout) :: error

      if (self%stages%number == 0_ip .or. allocated(error)) return
      if (self%stages%number > size(self%settings%stage)) then
         call raise(error, input_error, 'the run is in its stage '//to_text(self%stages%number)//', but the '// &
                    'namelist has only '//to_text(size(self%settings%stage, kind=ip))//' groups &stage')
         return
      end if
      call set_parameters(self%settings, self%stages, self%forces)
      call use_parameters(self)
      call find_last_steps(self)
      associate (stage => self%settings%stage(self%stages%number))
         if (self%step > self%stages%last) call raise(error, input_error, place_of(self%settings, &
            'stage.'//stage%name, merge('duration', 'longest ', stage%until == 'duration'))//': the run is at step '// &
            to_text(self%step)//', behind the last step of the stage '//stage%name//', '//to_text(self%stages%last))
         if (allocated(error)) return
         if (self%step > 0_lp) return
         if (stage%until == 'strain') self%stages%reference = wall_vector(self)
      end associate
      call check_reference(self, error)
   end subroutine continue_stages

   !> Check that the present stage has walls from which it can measure a strain. All ranks find the same.
   subroutine check_reference(self, error)
      type(simulation_t), intent(in) :: self
      !> Names the stage and the walls
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: place
      real(wp) :: radius
      integer :: j, k

      associate (stage => self%settings%stage(self%stages%number), reference => self%stages%reference)
         if (stage%until /= 'strain') return
         place = place_of(self%settings, 'stage.'//stage%name, 'wall')//': stage '//stage%name
         do k = 1, size(self%walls%wall)
            associate (wall => self%walls%wall(k))
               if (wall%name /= stage%wall .and. wall%name /= stage%opposite) cycle
               if (wall%is_removed) call raise(error, input_error, place//' measures its strain from the wall '// &
                                            wall%name//', which has vanished')
               radius = 0.0_wp
               do j = 1, size(wall%slots)
                  radius = max(radius, self%bodies%radius(wall%slots(j)))
               end do
               if (all(abs(reference) <= coincident*radius)) call raise(error, input_error, place//': the centres '// &
                  'of the walls '//stage%wall//' and '//stage%opposite//' coincide, so their distance is no length '// &
                  'for a strain; name two walls that face each other')
            end associate
         end do
      end associate
   end subroutine check_reference

   !> Vector from the wall `opposite` to the wall `wall` of the present stage, between the means of the centres of their
   !> bodies (2) [m]
   function wall_vector(self) result(vector)
      type(simulation_t), intent(in) :: self
      real(wp) :: vector(2)

      associate (stage => self%settings%stage(self%stages%number))
         vector = centre_of(stage%wall) - centre_of(stage%opposite)
      end associate

   contains

      !> Mean of the centres of the bodies of a wall
      pure function centre_of(name) result(centre)
         character(len=*), intent(in) :: name
         real(wp) :: centre(2)
         integer :: j

         centre = 0.0_wp
         associate (slots => self%walls%wall(number_of(name, self%walls%wall))%slots)
            do j = 1, size(slots)
               centre = centre + path_of(self%bodies, slots(j))/real(size(slots), wp)
            end do
         end associate
      end function centre_of

   end function wall_vector

end module polydem_begin_stage
