!> What actions do to a simulation. An action that is not possible is an error before anything changes.
module polydem_perform_actions
   use polydem_actions, only: action_t, add_bodies, drag, end_stage, force, friction, gravity, remove_bodies, &
      wall_load, wall_velocity
   use polydem_added_and_removed, only: check_addition, removed_after
   use polydem_begin_stage, only: find_last_steps, use_parameters
   use polydem_changed_gravity, only: change_gravity
   use polydem_choose_step, only: greatest_change
   use polydem_errors, only: error_t, input_error, raise, run_error
   use polydem_give_velocity, only: give_velocity
   use polydem_kinds, only: ip, lp, wp
   use polydem_local_data, only: list_moving
   use polydem_simulation, only: simulation_t
   use polydem_sort, only: ascending_order, place_in
   use polydem_strings, only: suggestion, to_text
   use polydem_wall, only: number_of
   implicit none
   private
   public :: perform_actions, repeat_actions, check_action

contains

   !> Let the actions take effect that were recorded after the last step. Collective; all ranks get the same error.
   subroutine perform_actions(self, error)
      !> The simulation between two steps
      type(simulation_t), intent(inout) :: self
      !> Names the action that is not possible
      type(error_t), allocatable, intent(inout) :: error
      type(action_t) :: action
      real(wp) :: former(2)

      if (.not. allocated(self%actions) .or. allocated(error)) return
      do while (self%actions%next <= self%actions%n)
         if (self%actions%list(self%actions%next)%step > self%step) return
         action = self%actions%list(self%actions%next)
         call check_action(self, action, self%actions%next - 1, error)
         if (allocated(error)) then
            error%message = self%actions%place(self%actions%next)//': '//error%message
            error%code = run_error
            return
         end if
         former = self%forces%gravity
         call apply_action(self, action)
         if (self%settings%output%energy_balance .and. any(abs(self%forces%gravity - former) > 0.0_wp)) call &
            change_gravity(self%energy_balance, self%comm, self%dt, former, self%forces%gravity, self%bodies)
         self%actions%next = self%actions%next + 1
      end do
   end subroutine perform_actions

   !> After a restart, apply again what took effect before. The bodies, the stage and the balance know of it already;
   !> gravity, drag and friction are those of the present stage.
   subroutine repeat_actions(self)
      !> The simulation at a step, with its stage
      type(simulation_t), intent(inout) :: self
      type(action_t) :: action
      integer(lp) :: since
      integer :: k

      if (.not. allocated(self%actions)) return
      since = 0_lp
      if (self%stages%number > 0_ip) since = self%stages%first(self%stages%number)
      do k = 1, self%actions%n
         action = self%actions%list(k)
         if (action%step >= self%step) exit
         self%actions%next = k + 1
         if (action%step < since .and. any(action%kind == [gravity, drag, friction])) cycle
         if (action%kind /= end_stage) call apply_action(self, action)
      end do
   end subroutine repeat_actions

   !> Apply an action that is possible.
   subroutine apply_action(self, action)
      type(simulation_t), intent(inout) :: self
      type(action_t), intent(in) :: action
      integer :: k
      logical :: is_new

      associate (value => action%value)
         select case (action%kind)
         case (wall_velocity)
            k = int(number_of(action%name, self%walls%wall))
            is_new = .not. self%walls%wall(k)%is_driven()
            call give_velocity(self%walls, k, real(action%step, wp)*self%dt, value(1:2), value(3), value(4:5), &
                               self%bodies)
            if (is_new) call list_moving(self%bodies, self%walls%wall, self%moving, self%n_moving)
            return
         case (wall_load)
            call set_load(action%name, value(1), self)
            return
         case (gravity)
            self%forces%gravity = value
         case (drag)
            self%forces%drag = value(1)
            call self%body_forces%allow_drag(self%forces)
         case (friction)
            self%stages%friction_scale = value(1)
         case (force)
            call self%body_forces%give(action%id, reshape(value, [3, size(action%id)]))
         case (add_bodies, remove_bodies)
            ! They enter and leave with those of sources and sinks.
            return
         case (end_stage)
            self%stages%is_decided = .true.
            self%stages%last = min(self%stages%last, action%step + 1_lp)
            call find_last_steps(self)
            return
         case default
            self%actions%last_step = min(self%actions%last_step, action%step + 1_lp)
            call find_last_steps(self)
            return
         end select
      end associate
      call use_parameters(self)
   end subroutine apply_action

   !> Set the force of a load, without ramp and stress.
   subroutine set_load(name, force, self)
      !> Name of the load
      character(len=*), intent(in) :: name
      !> Its force [N/m] or torque [N]
      real(wp), intent(in) :: force
      type(simulation_t), intent(inout) :: self
      integer :: k

      do k = 1, size(self%walls%loads)
         associate (load => self%walls%loads(k))
            if (load%name /= name) cycle
            load%force = force
            load%stress = 0.0_wp
            load%ramp = 0.0_wp
            load%ramp_down = 0.0_wp
         end associate
      end do
   end subroutine set_load

   !> Check that an action is possible now. Collective; all ranks get the same error.
   subroutine check_action(self, action, before, error)
      type(simulation_t), intent(inout) :: self
      !> An action as `new_action` makes it
      type(action_t), intent(in) :: action
      !> Number of the actions before it
      integer, intent(in) :: before
      !> Says why it is not
      type(error_t), allocatable, intent(inout) :: error

      associate (value => action%value)
         select case (action%kind)
         case (wall_velocity)
            call check_wall(self, action%name, value(1:2), value(3), error)
         case (wall_load)
            call check_load(self, action%name, error)
         case (drag)
            if (value(1) < 0.0_wp) call raise(error, input_error, 'the drag must be >= 0, not '//to_text(value(1)))
            if (value(1)*self%dt > greatest_change) call raise(error, input_error, 'with dt = '//to_text(self%dt)// &
               ' s a drag of '//to_text(value(1))//' 1/s changes a velocity by more than a tenth in a step')
         case (friction)
            if (value(1) < 0.0_wp) call raise(error, input_error, 'the factor of the friction must be >= 0, not '// &
                                              to_text(value(1)))
         case (force)
            call check_bodies(self, action%id, error)
         case (add_bodies)
            call check_exchange(self, error)
            if (.not. allocated(error)) call check_addition(self, action, before, error)
            call self%comm%all_reduce_error(error)
         case (remove_bodies)
            call check_exchange(self, error)
            if (.not. allocated(error)) call check_bodies(self, action%id, error)
            if (.not. allocated(error)) call check_bodies_stay(self, action%id, before, error)
         case (end_stage)
            if (self%stages%number == 0_ip) call raise(error, input_error, 'the run has no stages')
         case default
            ! Gravity may have any value, and a run may always end.
            return
         end select
      end associate
   end subroutine check_action

   !> Check that bodies may enter and leave.
   subroutine check_exchange(self, error)
      type(simulation_t), intent(in) :: self
      type(error_t), allocatable, intent(inout) :: error

      if (.not. allocated(self%sources_and_sinks)) call raise(error, input_error, &
         'the run does not expect that bodies enter or leave: make it with exchange=True')
   end subroutine check_exchange

   !> Check that no action before has removed bodies.
   subroutine check_bodies_stay(self, id, before, error)
      type(simulation_t), intent(in) :: self
      !> Their identifiers
      integer(ip), intent(in) :: id(:)
      !> Number of the actions before
      integer, intent(in) :: before
      type(error_t), allocatable, intent(inout) :: error
      integer(ip), allocatable :: removed(:)
      integer(ip) :: k

      removed = removed_after(self%actions, self%step, before)
      do k = 1_ip, size(removed, kind=ip)
         if (any(removed(k) == id)) call raise(error, input_error, 'the body '//to_text(removed(k))// &
                                              ' is removed already')
      end do
   end subroutine check_bodies_stay

   !> Check that a wall can be given a velocity.
   subroutine check_wall(self, name, velocity, spin, error)
      type(simulation_t), intent(in) :: self
      !> Its name
      character(len=*), intent(in) :: name
      !> Velocity [m/s] and angular velocity [rad/s]
      real(wp), intent(in) :: velocity(2), spin
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: k

      k = number_of(name, self%walls%wall(:self%walls%n_named))
      if (k == 0_ip) then
         call raise(error, input_error, 'there is no wall "'//name//'"'//among(self%walls%n_named))
         return
      end if
      associate (wall => self%walls%wall(k))
         if (wall%is_removed) then
            call raise(error, input_error, 'the wall '//name//' has vanished')
         else if (size(wall%loads) > 0) then
            call raise(error, input_error, 'the load '//self%walls%loads(wall%loads(1))%name//' moves the wall '// &
                       name//', which has no velocity of its own')
         end if
      end associate
      if (.not. allocated(error)) call check_driven(self, k, velocity, spin, error)

   contains

      !> The names of all walls, for a message
      function among(n) result(text)
         !> Their number
         integer(ip), intent(in) :: n
         character(len=:), allocatable :: text
         character(len=255) :: names(n)
         integer :: j

         text = '; no wall has a name'
         if (n == 0_ip) return
         do j = 1, int(n)
            names(j) = self%walls%wall(j)%name
         end do
         text = suggestion(name, names)
      end function among

   end subroutine check_wall

   !> Check that nothing else moves the bodies of a wall, and that they may move so in a periodic cell.
   subroutine check_driven(self, k, velocity, spin, error)
      type(simulation_t), intent(in) :: self
      !> Number of the wall
      integer(ip), intent(in) :: k
      real(wp), intent(in) :: velocity(2), spin
      type(error_t), allocatable, intent(inout) :: error
      logical :: is_own(self%bodies%n)
      integer :: axis, j

      associate (wall => self%walls%wall(k), bodies => self%bodies)
         if (size(wall%slots) < size(wall%id) .or. .not. all(bodies%fixed(wall%slots))) &
            call raise(error, input_error, 'not all bodies of the wall '//wall%name//' are fixed')
         is_own = .false.
         is_own(wall%slots) = .true.
         do j = 1, size(self%walls%wall)
            if (int(k) == j .or. .not. self%walls%wall(j)%is_driven()) cycle
            if (any(is_own(self%walls%wall(j)%slots))) call raise(error, input_error, 'bodies of the wall '// &
               wall%name//' have motions of their own, or belong to another wall that moves')
         end do
         if (.not. bodies%cell%is_periodic) return
         if (abs(spin) > 0.0_wp) call raise(error, input_error, 'in a periodic cell the wall '//wall%name// &
                                            ' cannot turn, since its copies do not')
         do axis = 1, 2
            if (bodies%cell%size(axis) > 0.0_wp .and. abs(velocity(axis)) > 0.0_wp .and. &
                any(.not. bodies%inverse_period(axis, wall%slots) > 0.0_wp)) call raise(error, input_error, &
               'the wall '// &
               wall%name//' spans the cell and cannot move along '//'xy'(axis:axis))
         end do
      end associate
   end subroutine check_driven

   !> Check that there is a load.
   subroutine check_load(self, name, error)
      type(simulation_t), intent(in) :: self
      !> Its name
      character(len=*), intent(in) :: name
      type(error_t), allocatable, intent(inout) :: error
      character(len=255), allocatable :: names(:)
      integer :: k

      allocate (names(0))
      if (allocated(self%walls%loads)) then
         do k = 1, size(self%walls%loads)
            if (self%walls%loads(k)%name == name) return
            names = [character(len=255) :: names, self%walls%loads(k)%name]
         end do
      end if
      if (size(names) == 0) then
         call raise(error, input_error, 'there is no load "'//name//'"; the run has no loads')
      else
         call raise(error, input_error, 'there is no load "'//name//'"'//suggestion(name, names))
      end if
   end subroutine check_load

   !> Check that identifiers are those of free bodies, each once. Collective; all ranks get the same error.
   subroutine check_bodies(self, id, error)
      type(simulation_t), intent(inout) :: self
      !> The identifiers
      integer(ip), intent(in) :: id(:)
      type(error_t), allocatable, intent(inout) :: error
      integer(lp) :: is_there(size(id))
      integer(ip), allocatable :: order(:)
      integer(ip) :: k, s

      is_there = 0_lp
      do k = 1_ip, size(id, kind=ip)
         s = place_in(self%bodies%id(:self%bodies%n), id(k))
         if (s > self%bodies%n) cycle
         if (self%bodies%id(s) == id(k)) is_there(k) = merge(2_lp, 1_lp, self%bodies%fixed(s))
      end do
      call self%comm%all_reduce_max(is_there)
      order = ascending_order(int(id, lp))
      do k = 1_ip, size(id, kind=ip)
         if (is_there(k) == 0_lp) then
            call raise(error, input_error, 'there is no body '//to_text(id(k)))
         else if (is_there(k) == 2_lp) then
            call raise(error, input_error, 'the body '//to_text(id(k))//' is fixed')
         else if (k > 1_ip) then
            if (id(order(k)) == id(order(k - 1_ip))) call raise(error, input_error, 'the body '// &
               to_text(id(order(k)))//' is given twice')
         end if
         if (allocated(error)) return
      end do
   end subroutine check_bodies

end module polydem_perform_actions
