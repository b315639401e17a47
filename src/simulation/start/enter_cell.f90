!> Puts the bodies of a simulation into its periodic cell at the start.
module polydem_enter_cell
   use polydem_bodies, only: bodies_t, turn_bodies
   use polydem_bodies_in_cell, only: add_profile, find_periods, put_into_cell, set_cell
   use polydem_cell, only: cell_t, new_cell
   use polydem_driven, only: along_angle
   use polydem_errors, only: error_t, input_error, raise
   use polydem_global_reductions, only: reduce_to_greatest
   use polydem_kinds, only: ip, lp, wp
   use polydem_motion, only: motion_limits_t
   use polydem_ramp, only: new_window
   use polydem_run_duration, only: number_of_stage
   use polydem_settings, only: cell_settings_t, settings_t
   use polydem_simulation, only: simulation_t
   use polydem_source_locations, only: place_of
   use polydem_strings, only: to_text
   use polydem_walls, only: walls_t
   implicit none
   private
   public :: enter_cell, join_copies, check_constraint

   !> Names of the axes
   character(len=1), parameter :: name(2) = ['x', 'y']
   !> Greatest distance of a body from the cell at the start, in cells: such a place keeps the digits for contacts
   real(wp), parameter :: most_cells = 1.0e6_wp

contains

   !> Put all bodies into the cell, if there is one, and check that it is large enough for them. Collective; all ranks
   !> get the same error.
   subroutine enter_cell(self, error)
      !> The simulation with its settings, bodies and walls. On entry the cell of the bodies has nothing but
      !> displacement and velocity of the copy above in the result from which the run starts; `n_outside` counts the
      !> bodies that were outside the cell
      type(simulation_t), intent(inout) :: self
      !> Names a body that is too large for the cell
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: largest(1), former_jump
      integer(lp) :: n_outside(1)
      integer(ip), allocatable :: former(:, :)
      logical, allocatable :: is_outside(:)
      integer(ip) :: s

      if (self%settings%cell%periodic == 'none') return
      associate (bodies => self%bodies, settings => self%settings)
         former_jump = bodies%cell%jump
         call set_cell(bodies, new_cell(settings%cell%periodic, settings%cell%low, settings%cell%size, &
                                       settings%cell%shear_rate, settings%cell%shear_ramp, &
                                       bodies%cell%first_shift))
         ! A velocity beyond the profile is that of all copies.
         if (settings%cell%profile) bodies%cell%former_jump = 0.0_wp
         if (settings%scene%name == 'result') bodies%cell%former_jump = former_jump
         if (settings%cell%stress_controlled /= 'none') call control_stress(settings, bodies%cell)
         call turn_bodies(bodies, [(s, s=1_ip, bodies%n)])
         call find_periods(bodies)
         largest = 0.0_wp
         if (size(bodies%free) > 0) largest = 2.0_wp*maxval(bodies%radius(bodies%free))
         call reduce_to_greatest(self%comm, largest)
         if (allocated(bodies%cell%load)) bodies%cell%load%least = 2.0_wp*largest(1) + 4.0_wp*settings%boxes%margin
         do s = 1_ip, bodies%n
            call check_size(self, s, largest(1) + 2.0_wp*settings%boxes%margin, error)
            if (.not. allocated(error)) call check_place(self, s, error)
            if (allocated(error)) exit
         end do
         call check_walls(self, error)
         call self%comm%all_reduce_error(error)
         if (allocated(error)) return
         former = bodies%image
         call join_copies(settings%cell, [(s, s=1_ip, bodies%n)], bodies)
         is_outside = any(bodies%image /= former, 2)
         self%n_outside = count(is_outside(bodies%free), kind=lp)
         if (self%comm%is_root()) self%n_outside = self%n_outside + count(is_outside .and. bodies%fixed, kind=lp)
         n_outside = self%n_outside
         call self%comm%all_reduce_sum(n_outside)
         self%n_outside = n_outside(1)
         ! The cell in which a fixed body starts is its own.
         do s = 1_ip, bodies%n
            if (bodies%fixed(s)) bodies%image(s, :) = 0_ip
         end do
         do s = 1_ip, size(self%walls%wall, kind=ip)
            self%walls%wall(s)%position = bodies%position(:, self%walls%wall(s)%slots)
         end do
      end associate
   end subroutine enter_cell

   !> Put bodies into the cell at the start, and give them the profile of its shear, less that which they have already.
   !> A shear that grows is 0 at the start.
   pure subroutine join_copies(settings, slots, bodies)
      type(cell_settings_t), intent(in) :: settings
      !> Slots of the bodies
      integer(ip), intent(in) :: slots(:)
      !> Bodies after `find_periods`, in a cell before its first step: its former jump is that of the shear of the
      !> bodies
      type(bodies_t), intent(inout) :: bodies

      real(wp) :: rate

      call put_into_cell(bodies, slots)
      if (.not. settings%profile) return
      associate (cell => bodies%cell)
         rate = merge(0.0_wp, cell%rate, cell%window%ramp > 0.0_wp)
         if (abs(rate*cell%size(2) - cell%former_jump) > 0.0_wp) &
            call add_profile(bodies, rate - cell%former_jump/cell%size(2), slots)
      end associate
   end subroutine join_copies

   !> Let a stress control the size of the cell. Its mass is set later.
   subroutine control_stress(settings, cell)
      type(settings_t), intent(in) :: settings
      type(cell_t), intent(inout) :: cell
      integer :: axis

      allocate (cell%load)
      associate (load => cell%load, given => settings%cell)
         do axis = 1, 2
            load%is_controlled(axis) = scan(given%stress_controlled, 'xy'(axis:axis)) > 0
         end do
         load%stress = given%stress
         load%axis%window_t = new_window(0.0_wp, 0.0_wp, given%stress_ramp, number_of_stage(settings, given%stage))
         load%axis%mass = given%mass
         load%axis%damping_ratio = given%damping_ratio
         load%axis%place = cell%size
         load%centre = cell%low + 0.5_wp*cell%size
      end associate
   end subroutine control_stress

   !> Check that no constraint on velocities acts in a sheared cell, in a stress-controlled one, or with local damping.
   subroutine check_constraint(self, error)
      !> The simulation with its force law
      type(simulation_t), intent(in) :: self
      !> Allocated if there is one
      type(error_t), allocatable, intent(inout) :: error

      if (self%bodies%cell%is_sheared .and. allocated(self%law%constraint)) call raise(error, input_error, &
         place_of(self%settings, 'cell', 'shear_rate')//': ''shear_rate'' in &cell cannot be combined with this '// &
         '''friction'' in &forces, which does not know the velocity of the border; use cundall_strack')
      if (allocated(self%bodies%cell%load) .and. allocated(self%law%constraint)) call raise(error, input_error, &
         place_of(self%settings, 'cell', 'stress_controlled')//': ''stress_controlled'' in &cell cannot be '// &
         'combined with this ''friction'' in &forces, which does not know how the cell grows; use cundall_strack')
      if (self%forces%local_damping > 0.0_wp .and. allocated(self%law%constraint)) call raise(error, &
         input_error, place_of(self%settings, 'forces', 'local_damping')//': ''local_damping'' in &forces cannot '// &
         'be combined with this ''friction'', whose forces depend on the motion without it; use drag')
   end subroutine check_constraint

   !> Check that a body is small enough for the cell, or spans it.
   subroutine check_size(self, s, largest, error)
      type(simulation_t), intent(in) :: self
      !> Slot of the body
      integer(ip), intent(in) :: s
      !> Largest diameter of a free body, with the margins of two boxes [m]
      real(wp), intent(in) :: largest
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: low, high
      integer :: axis

      associate (bodies => self%bodies, cell => self%bodies%cell)
         if (bodies%fixed(s) .and. allocated(cell%load)) then
            call raise(error, input_error, place_of(self%settings, 'cell', 'stress_controlled')// &
               ': ''stress_controlled'' in &cell: body '//to_text(bodies%id(s))// &
               ' is fixed, but a stress-controlled cell can have no fixed bodies')
            error%place = int(bodies%global_index(s), lp)
            return
         end if
         if (bodies%fixed(s) .and. cell%is_sheared) then
            call raise(error, input_error, place_of(self%settings, 'cell', 'shear_rate')//': ''shear_rate'' in '// &
               '&cell: body '//to_text(bodies%id(s))//' is fixed, but a sheared cell can have no fixed bodies')
            error%place = int(bodies%global_index(s), lp)
            return
         end if
         do axis = 1, 2
            if (.not. cell%size(axis) > 0.0_wp) cycle
            if (.not. bodies%fixed(s)) then
               if (4.0_wp*(bodies%radius(s) + self%settings%boxes%margin) < cell%size(axis)) cycle
               call raise(error, input_error, place_of(self%settings, 'cell', 'size')//': ''size'' in &cell: body '// &
                  to_text(bodies%id(s))//' needs more than '// &
                  to_text(4.0_wp*(bodies%radius(s) + self%settings%boxes%margin))//' m along '//name(axis)// &
                  ', twice its diameter, but the cell has '//to_text(cell%size(axis))//' m')
            else
               if (bodies%inverse_period(axis, s) > 0.0_wp) cycle
               associate (place => bodies%position(axis, s), shape => bodies%pieces%turned_polygon(s))
                  low = place + minval(shape(axis, :))
                  high = place + maxval(shape(axis, :))
               end associate
               if (low <= cell%low(axis) - largest .and. high >= cell%low(axis) + cell%size(axis) + largest) cycle
               call raise(error, input_error, place_of(self%settings, 'cell', 'size')//': ''size'' in &cell: the '// &
                  'fixed body '//to_text(bodies%id(s))//' reaches along '//name(axis)//' from '//to_text(low)// &
                  ' to '//to_text(high)//' m. Make it shorter than half the cell, or let it reach at least from '// &
                  to_text(cell%low(axis) - largest)//' to '//to_text(cell%low(axis) + cell%size(axis) + largest)// &
                  ' m, a diameter beyond both borders')
            end if
            error%place = int(bodies%global_index(s), lp)
            return
         end do
      end associate
   end subroutine check_size

   !> Check that a body is not so far from the cell that it cannot be put into it.
   subroutine check_place(self, s, error)
      type(simulation_t), intent(in) :: self
      !> Slot of the body
      integer(ip), intent(in) :: s
      type(error_t), allocatable, intent(inout) :: error
      integer :: axis

      associate (bodies => self%bodies, cell => self%bodies%cell, place => self%bodies%position(:, s))
         do axis = 1, 2
            if (abs(place(axis) - cell%low(axis))*bodies%inverse_period(axis, s) <= most_cells) cycle
            call raise(error, input_error, place_of(self%settings, 'cell', 'low')//': ''low'' in &cell: the place '// &
               to_text(place(1))//', '//to_text(place(2))//' m of body '//to_text(bodies%id(s))//' is '// &
               to_text(abs(place(axis) - cell%low(axis))*cell%inverse(axis), 3)//' cells away along '//name(axis)// &
               ', more than '//to_text(most_cells, 3)//'; put the cell where the bodies are')
            error%place = int(bodies%global_index(s), lp)
            return
         end do
      end associate
   end subroutine check_place

   !> Check that no body that spans the cell moves along it, and that none turns, since its copies would not.
   subroutine check_walls(self, error)
      type(simulation_t), intent(in) :: self
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: k
      integer :: axis, w

      do w = 1, size(self%walls%wall)
         do k = 1_ip, size(self%walls%wall(w)%slots, kind=ip)
            associate (s => self%walls%wall(w)%slots(k), bodies => self%bodies)
               if (allocated(error)) return
               if (moves(self%walls, w, along_angle)) call refuse(self, s, 'turns, which its copies do not; leave '// &
                  'out the angles of its table of motion, and loads along ''angle''', error)
               do axis = 1, 2
                  if (allocated(error)) return
                  if (.not. bodies%cell%size(axis) > 0.0_wp .or. bodies%inverse_period(axis, s) > 0.0_wp) cycle
                  if (moves(self%walls, w, axis)) call refuse(self, s, 'spans the cell and cannot move along '// &
                     name(axis)//'; use a conveyor, or make it of bodies that are shorter than half the cell, for '// &
                     'example with outline = ''row'' in &wall', error)
               end do
            end associate
         end do
      end do
   end subroutine check_walls

   !> Whether a motion or a load moves a wall along a direction, 1, 2 or `along_angle`
   pure logical function moves(walls, w, direction)
      type(walls_t), intent(in) :: walls
      !> Number of the wall
      integer, intent(in) :: w
      integer, intent(in) :: direction
      type(motion_limits_t) :: limits
      integer :: k

      moves = .false.
      if (allocated(walls%loads)) moves = any(walls%loads(walls%wall(w)%loads)%direction == direction)
      do k = 1, size(walls%wall(w)%motions)
         limits = walls%motions(walls%wall(w)%motions(k))%motion%limits()
         moves = moves .or. limits%moves(direction)
      end do
   end function moves

   !> Raise an error about a fixed body in a periodic cell.
   subroutine refuse(self, s, words, error)
      type(simulation_t), intent(in) :: self
      integer(ip), intent(in) :: s
      !> What is wrong, and the remedy
      character(len=*), intent(in) :: words
      type(error_t), allocatable, intent(inout) :: error

      call raise(error, input_error, place_of(self%settings, 'cell', 'periodic')//': ''periodic'' in &cell: the '// &
         'fixed body '//to_text(self%bodies%id(s))//' '//words)
   end subroutine refuse

end module polydem_enter_cell
