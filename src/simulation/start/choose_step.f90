!> Choice of the time step, and the number of steps.
module polydem_choose_step
   use polydem_begin_stage, only: find_last_steps
   use polydem_bodies, only: bodies_t
   use polydem_cell_load, only: set_cell_mass
   use polydem_elementary, only: two_pi
   use polydem_errors, only: error_t, input_error, raise
   use polydem_global_reductions, only: keep_greatest, reduce_to_greatest, sum_exactly
   use polydem_kinds, only: ip, lp, wp
   use polydem_run_duration, only: longest_run, longest_stage
   use polydem_source_locations, only: overrides_of, place_of
   use polydem_simulation, only: simulation_t
   use polydem_expected_speed, only: find_expected_speed
   use polydem_stable_step, only: stable_step_of_shapes
   use polydem_strings, only: to_text
   use polydem_wall_load, only: set_masses, wall_mobilities
   implicit none
   private
   public :: choose_step

   !> Upper limit of the number of steps
   real(wp), parameter :: most_steps = 1.0e15_wp
   !> Greatest change of a velocity in a step by a force that is no contact, as a share
   real(wp), parameter, public :: greatest_change = 0.1_wp

contains

   !> Use dt of the settings, or that of the simulation if it has one, or compute it: a fraction of the stable time
   !> step, reduced to divide the duration evenly, or to three digits if the run has stages.
   !> Collective; all ranks get the same error.
   subroutine choose_step(self, sample, error)
      !> The simulation with settings, ranks, bodies, force law and integrator; `dt`, `n_steps` and
      !> `expected_stable_step` are set
      type(simulation_t), intent(inout) :: self
      !> Bodies that will enter, the same on all ranks
      type(bodies_t), intent(in) :: sample
      !> Allocated if no step can be chosen, or if the number of steps is not allowed
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: critical
      real(wp) :: steps, stable, depth, length, damped, has_free(1), found(3)
      integer(lp) :: limiting

      call set_controlled_masses(self, error)
      if (allocated(error)) return
      call find_expected_speed(self)
      call stable_step_of_shapes(self%law, self%motion%integrator%stability(), self%bodies, self%expected%speed, &
                                 stable, critical, depth, length, damped, mobility_of_walls(self))
      has_free = merge(1.0_wp, 0.0_wp, critical > 0_ip)
      call reduce_to_greatest(self%comm, has_free)
      limiting = 0_lp
      if (critical > 0_ip) limiting = int(self%bodies%id(critical), lp)
      stable = -stable
      call keep_greatest(self%comm, stable, limiting)
      self%expected_stable_step = -stable
      self%expected%body = limiting
      found = 0.0_wp
      if (critical > 0_ip) then
         if (int(self%bodies%id(critical), lp) == limiting) found = [depth, length, damped]
      end if
      call reduce_to_greatest(self%comm, found)
      self%expected%depth = found(1)
      self%expected%length = found(2)
      self%expected%damped = found(3)
      if (sample%n > 0_ip) call consider_sample(self, sample, has_free(1))
      associate (settings => self%settings%integrate, duration => longest_run(self%settings))
         if (settings%dt > 0.0_wp) self%dt = settings%dt
         if (self%dt <= 0.0_wp .and. (has_free(1) < 1.0_wp .or. .not. self%expected_stable_step > 0.0_wp)) then
            call raise(error, input_error, place_of(self%settings, 'integrate', 'dt')//': cannot choose dt: there '// &
                       'is no free body, or stiffness or mass is extreme. Set dt in &integrate')
            return
         end if
         if (self%dt <= 0.0_wp) then
            steps = duration/(settings%safety_factor*self%expected_stable_step)
            self%dt = settings%safety_factor*self%expected_stable_step
            if (self%stages%number > 0_ip) then
               self%dt = short_number(self%dt)
            else if (steps < most_steps) then
               self%dt = duration/real(max(1_lp, ceiling(steps, lp)), wp)
            end if
         end if
         steps = duration/self%dt
         call check_number(self, duration, steps, error)
         if (allocated(error)) return
         self%n_steps = nint(steps, lp)
      end associate
      call find_last_steps(self)
      call check_rate(self, error)
      call check_cell_mass(self, error)
   end subroutine choose_step

   !> Set the masses of load-controlled walls and of a stress-controlled cell, if there are any. Collective.
   subroutine set_controlled_masses(self, error)
      type(simulation_t), intent(inout) :: self
      !> Names a load whose mass is not known
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: usual, largest(1)

      if (.not. (allocated(self%walls%loads) .or. allocated(self%bodies%cell%load))) return
      call find_usual_mass(self, usual)
      if (allocated(self%walls%loads)) call prepare_loads(self, usual, error)
      if (allocated(error) .or. .not. allocated(self%bodies%cell%load)) return
      associate (bodies => self%bodies)
         largest = 0.0_wp
         if (size(bodies%free) > 0) largest = 2.0_wp*maxval(bodies%radius(bodies%free))
         call reduce_to_greatest(self%comm, largest)
         call set_cell_mass(usual, self%forces%stiffness, largest(1), bodies%cell%load)
      end associate
   end subroutine set_controlled_masses

   !> Find the mass of what is controlled unless it is given: that of a row of grains, which is light enough to follow
   !> their stress. Collective.
   subroutine find_usual_mass(self, usual)
      type(simulation_t), intent(inout) :: self
      !> Mass of all free bodies over the root of their number; 0 if there are none [kg/m]
      real(wp), intent(out) :: usual

      associate (bodies => self%bodies)
         call sum_exactly(self%comm, bodies%mass(bodies%free), usual)
         usual = usual/sqrt(real(max(1_ip, bodies%n_all - count(bodies%fixed, kind=ip)), wp))
      end associate
   end subroutine find_usual_mass

   !> Check that a stress-controlled cell is not too light for the step. Its size oscillates at most with the stiffness
   !> E of its contents, times the ratio of its sides.
   subroutine check_cell_mass(self, error)
      type(simulation_t), intent(in) :: self
      type(error_t), allocatable, intent(inout) :: error
      real(wp), parameter :: least_steps = 5.0_wp
      real(wp) :: least

      if (allocated(error) .or. .not. allocated(self%bodies%cell%load)) return
      associate (cell => self%bodies%cell)
         least = (least_steps*self%dt)**2*self%forces%stiffness*maxval(cell%size)/minval(cell%size)
         if (cell%load%axis(1)%mass >= least) return
         call raise(error, input_error, place_of(self%settings, 'cell', 'mass')//': ''mass'' in &cell: the size '// &
                    'of a cell of '//to_text(cell%load%axis(1)%mass)//' kg/m oscillates faster than the time step '// &
                    'resolves; use at least '//to_text(short_number(least*1.1_wp))//' kg/m')
      end associate
   end subroutine check_cell_mass

   !> Set the masses of load-controlled walls.
   subroutine prepare_loads(self, usual, error)
      type(simulation_t), intent(inout) :: self
      !> Mass of a wall without a mass of its own; 0: there is none [kg/m]
      real(wp), intent(in) :: usual
      !> Names a load whose mass is not known
      type(error_t), allocatable, intent(inout) :: error
      integer :: k

      do k = 1, size(self%settings%load)
         associate (load => self%settings%load(k))
            if (usual > 0.0_wp .or. load%mass > 0.0_wp) cycle
            call raise(error, input_error, place_of(self%settings, 'load.'//load%name, 'mass')//': ''mass'' in '// &
               '&load '//load%name//' is needed: there are no free bodies at the start, whose mass it could have')
            return
         end associate
      end do
      associate (bodies => self%bodies, walls => self%walls)
         call walls%find_slots(bodies)
         call set_masses(walls%loads, walls%wall, bodies, usual, self%forces%stiffness)
      end associate
   end subroutine prepare_loads

   !> Check the number of steps.
   subroutine check_number(self, duration, steps, error)
      type(simulation_t), intent(in) :: self
      !> Simulated time [s], and its number of steps
      real(wp), intent(in) :: duration, steps
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: group, key
      integer :: k
      real(wp) :: longest

      if (steps >= 0.5_wp .and. steps < most_steps) return
      group = 'integrate'
      key = 'duration'
      longest = -1.0_wp
      do k = 1, size(self%settings%stage)
         associate (stage => self%settings%stage(k))
            if (.not. longest_stage(stage) > longest) cycle
            longest = longest_stage(stage)
            group = 'stage.'//stage%name
            key = 'longest'
            if (stage%until == 'duration') key = 'duration'
         end associate
      end do
      call raise(error, input_error, place_of(self%settings, group, key)//': a duration of '// &
                 to_text(duration)//' s with dt = '//to_text(self%dt)//' s requires '//to_text(steps)// &
                 ' steps, but only 1 to '//to_text(most_steps)//' are allowed. Change duration, dt, safety_factor '// &
                 'or speed in &integrate'//overrides_of(self%settings, 'integrate'))
   end subroutine check_number

   !> Take the stable step of bodies that will enter, if it is shorter.
   subroutine consider_sample(self, sample, has_free)
      type(simulation_t), intent(inout) :: self
      type(bodies_t), intent(in) :: sample
      !> 1 if there is a free body
      real(wp), intent(inout) :: has_free
      real(wp) :: stable, depth, length, damped
      integer(ip) :: critical

      call stable_step_of_shapes(self%law, self%motion%integrator%stability(), sample, self%expected%speed, stable, &
                                 critical, depth, length, damped, mobility_of_walls(self))
      has_free = 1.0_wp
      if (stable >= self%expected_stable_step) return
      self%expected_stable_step = stable
      self%expected%body = 0_lp
      self%expected%depth = depth
      self%expected%length = length
      self%expected%damped = damped
   end subroutine consider_sample

   !> Check that no force that is no contact changes velocities, or itself, by much in a step.
   subroutine check_rate(self, error)
      type(simulation_t), intent(in) :: self
      type(error_t), allocatable, intent(inout) :: error

      character(len=:), allocatable :: key, place, remedy

      if (self%dt*self%body_forces%rate() <= greatest_change) return
      associate (forces => self%forces, rate => self%body_forces%rate())
         key = 'drag'
         if (two_pi*abs(forces%turn_rate) >= rate) key = 'turn_rate'
         if (two_pi*forces%shake_frequency >= rate) key = 'shake_frequency'
         remedy = 'Set dt in &integrate to at most '//to_text(greatest_change/rate, 2)//', '
         ! A step so long follows from a stiffness without its unit more often than from a large rate.
         if (.not. self%settings%integrate%dt > 0.0_wp) remedy = 'This dt follows from stiffness = '// &
            to_text(self%law%pairs%stiffness%least(), 3)//' N/m2: increase it in &forces (is it in N/m2?), set '// &
            'dt to at most '//to_text(greatest_change/rate, 2)//', '
         place = place_of(self%settings, 'forces', key)
         if (place == self%settings%file) place = place_of(self%settings, 'forces', 'stiffness')
         call raise(error, input_error, place//': with dt = '//to_text(self%dt)// &
                    ' s a rate of '//to_text(rate)//' 1/s changes '// &
                    trim(merge('a velocity  ', 'acceleration', key == 'drag'))//' by more than a tenth in a step. '// &
                    remedy//'or decrease '//key//' in &forces')
      end associate
   end subroutine check_rate

   !> A number with three digits that does not exceed another one
   pure real(wp) function short_number(number)
      real(wp), intent(in) :: number
      character(len=16) :: text
      integer :: k

      do k = 0, 1
         write (text, '(es16.2e4)') number*(1.0_wp - 0.005_wp*real(k, wp))
         read (text, *) short_number
         if (short_number <= number) return
      end do
   end function short_number

   !> Greatest mobility of a load-controlled wall [m/kg], and greatest product of mobility and length of the wall
   !> [m2/kg]
   pure function mobility_of_walls(self) result(greatest)
      type(simulation_t), intent(in) :: self
      real(wp) :: greatest(2), extent(2, 2)
      real(wp), allocatable :: mobility(:)
      integer :: k

      greatest = 0.0_wp
      if (.not. allocated(self%walls%loads)) return
      mobility = wall_mobilities(self%walls%loads, self%walls%wall, self%bodies)
      do k = 1, size(self%walls%loads)
         associate (wall => self%walls%wall(self%walls%loads(k)%wall))
            extent(:, 1) = wall%extent(1, self%bodies)
            extent(:, 2) = wall%extent(2, self%bodies)
            if (size(wall%slots) > 0) greatest = max(greatest, &
               mobility(wall%slots(1))*[1.0_wp, maxval(extent(2, :) - extent(1, :))])
         end associate
      end do
   end function mobility_of_walls

end module polydem_choose_step
