!> Walls of a run: which bodies move as one, what moves them, and when walls are removed. All ranks have all fixed
!> bodies.
module polydem_walls
   use polydem_bodies, only: bodies_t
   use polydem_bodies_in_cell, only: put_into_cell
   use polydem_communicator, only: communicator_t
   use polydem_driven, only: along_angle
   use polydem_exact_sum, only: exact_sum_t
   use polydem_hash, only: mix_word
   use polydem_kinds, only: ip, lp, wp
   use polydem_motion, only: motion_item_t, motion_limits_t
   use polydem_serializer, only: serializer_t
   use polydem_wall, only: have_same_drivers, wall_t
   use polydem_wall_load, only: carry_walls, correct_loads, energies_of_loads, n_energies, predict_loads, wall_load_t
   use polydem_wall_terms, only: wall_terms_t
   implicit none
   private
   public :: walls_t

   !> Walls of a run
   type :: walls_t
      !> Those with names, in the order of the file, then bodies without a name that motions drive
      type(wall_t), allocatable :: wall(:)
      !> Number of those with names
      integer(ip) :: n_named = 0_ip
      !> Wall with a name of each body, (slot); 0 for others
      integer(ip), allocatable :: wall_of(:)
      !> All motions
      type(motion_item_t), allocatable :: motions(:)
      !> All loads; not allocated if there are none
      type(wall_load_t), allocatable :: loads(:)
      !> Record of the walls with names, of the contacts of this rank, (`n_rates`, wall); not allocated without a series
      type(exact_sum_t), allocatable :: sums(:, :)
      !> Elastic energy of the contacts of walls that are removed before the next step; used after a restart [J/m]
      real(wp) :: released = 0.0_wp
   contains
      procedure :: append
      procedure :: find_slots
      procedure :: mark_removed
      procedure :: has_gates
      procedure :: removed_at
      procedure :: any_removed_at
      procedure :: serialize_gates
      procedure :: any_driven
      procedure :: greatest_speed
      procedure :: hash_of_tables
      procedure :: predict
      procedure :: accelerate
      procedure :: move
      procedure :: energies
   end type walls_t

contains

   !> Append a wall without a name, of bodies in their present poses.
   subroutine append(self, bodies, id, motions, loads)
      !> The walls, behind which there are none with names
      class(walls_t), intent(inout) :: self
      type(bodies_t), intent(in) :: bodies
      !> Identifiers of the bodies
      integer(ip), intent(in) :: id(:)
      !> Numbers of its motions, and of its loads
      integer, intent(in) :: motions(:), loads(:)
      type(wall_t) :: wall

      wall%name = ''
      wall%id = id
      call wall%start(bodies)
      wall%motions = motions
      wall%loads = loads
      self%wall = [self%wall, wall]
   end subroutine append

   !> Find the bodies of the walls among the bodies of this rank.
   subroutine find_slots(self, bodies)
      class(walls_t), intent(inout) :: self
      type(bodies_t), intent(in) :: bodies
      integer(ip) :: k

      if (.not. allocated(self%wall)) return
      self%wall_of = spread(0_ip, 1, bodies%n)
      do k = 1_ip, size(self%wall, kind=ip)
         call self%wall(k)%find_slots(bodies)
         if (k <= self%n_named) self%wall_of(self%wall(k)%slots) = k
      end do
   end subroutine find_slots

   !> Mark the bodies of walls that have been removed.
   subroutine mark_removed(self, bodies)
      class(walls_t), intent(in) :: self
      !> Bodies; `removed` is set if a wall is removed at any time
      type(bodies_t), intent(inout) :: bodies
      integer :: k

      if (.not. self%has_gates()) return
      bodies%removed = spread(.false., 1, bodies%n)
      do k = 1, size(self%wall)
         if (self%wall(k)%is_removed) bodies%removed(self%wall(k)%slots) = .true.
      end do
   end subroutine mark_removed

   !> Whether a wall is removed at any time
   pure logical function has_gates(self)
      class(walls_t), intent(in) :: self

      has_gates = .false.
      if (allocated(self%wall)) has_gates = any(self%wall%vanish_at < huge(1.0_wp))
   end function has_gates

   !> Whether each wall is removed at a time, and has not been before, (wall)
   pure function removed_at(self, time)
      class(walls_t), intent(in) :: self
      !> Time since the start of the run [s]
      real(wp), intent(in) :: time
      logical :: removed_at(size(self%wall))

      removed_at = time >= self%wall%vanish_at .and. .not. self%wall%is_removed
   end function removed_at

   !> Whether a wall is removed at a time. Asked in every step, so without an array.
   pure logical function any_removed_at(self, time)
      class(walls_t), intent(in) :: self
      !> Time since the start of the run [s]
      real(wp), intent(in) :: time
      integer :: k

      any_removed_at = .false.
      do k = 1, size(self%wall)
         any_removed_at = any_removed_at .or. (time >= self%wall(k)%vanish_at .and. .not. self%wall(k)%is_removed)
      end do
   end function any_removed_at

   !> Serialize which walls with names have been removed.
   subroutine serialize_gates(self, serializer)
      class(walls_t), intent(inout) :: self
      class(serializer_t), intent(inout) :: serializer
      integer(ip), allocatable :: flags(:)

      if (.not. self%has_gates()) return
      associate (walls => self%wall(:self%n_named))
         flags = merge(1_ip, 0_ip, walls%is_removed)
         call serializer%field('/run/gone', flags, '1', 'whether each wall has vanished')
         call serializer%field('/run/released', self%released, 'J/m', 'elastic energy of the contacts of walls '// &
                               'that vanish before the next step')
         walls%is_removed = flags == 1_ip
      end associate
   end subroutine serialize_gates

   !> Whether motions or loads drive a wall
   pure logical function any_driven(self)
      class(walls_t), intent(in) :: self
      integer :: k

      any_driven = .false.
      do k = 1, size(self%wall)
         any_driven = any_driven .or. self%wall(k)%is_driven()
      end do
   end function any_driven

   !> Upper bound of the speed of any point of the walls; with one motion, the greatest speed [m/s]. Walls with the same
   !> motions and loads have one bound.
   pure real(wp) function greatest_speed(self, bodies, duration) result(greatest)
      class(walls_t), intent(in) :: self
      type(bodies_t), intent(in) :: bodies
      !> Duration of the run, in which a motion can move a body away from the pivot of the next one [s]
      real(wp), intent(in) :: duration
      type(motion_limits_t) :: limits
      ! Greatest distance of a point from the pivot, displacement so far, and speed
      real(wp) :: arm, reach, speed
      integer :: j, k, w

      greatest = 0.0_wp
      do w = 1, size(self%wall)
         speed = 0.0_wp
         reach = 0.0_wp
         do k = 1, size(self%wall(w)%motions)
            associate (motion => self%motions(self%wall(w)%motions(k))%motion)
               arm = 0.0_wp
               do j = 1, size(self%wall)
                  if (have_same_drivers(self%wall(j), self%wall(w))) arm = max(arm, &
                     self%wall(j)%reference_arm(motion%pivot, bodies))
               end do
               limits = motion%limits()
               speed = speed + limits%spin*(arm + reach) + limits%speed
               ! A point can come to the other side of the pivot.
               if (limits%moves(along_angle)) reach = reach + 2.0_wp*(arm + reach)
               ! The start in a stage is not known yet.
               if (.not. limits%shift < huge(1.0_wp)) limits%shift = limits%speed &
                  *max(0.0_wp, min(duration, motion%end) - merge(0.0_wp, motion%start, motion%stage > 0_ip))
               reach = reach + limits%shift
            end associate
         end do
         greatest = max(greatest, speed)
      end do
   end function greatest_speed

   !> Hash of the tables of all motions; 0 if there are none
   pure integer(lp) function hash_of_tables(self) result(hash)
      class(walls_t), intent(in) :: self
      integer :: k

      hash = 0_lp
      do k = 1, size(self%motions)
         associate (own => self%motions(k)%motion%hash)
            if (own == 0_lp) cycle
            if (hash /= 0_lp) hash = mix_word(hash, own)
            if (hash == 0_lp) hash = own
         end associate
      end do
   end function hash_of_tables

   !> Move the walls to the end of a step. The velocities of load-controlled ones are predicted.
   subroutine predict(self, dt, time, bodies)
      class(walls_t), intent(inout) :: self
      !> Time step [s]
      real(wp), intent(in) :: dt
      !> Simulated time at the end of the step [s]
      real(wp), intent(in) :: time
      !> Bodies; poses, velocities and accelerations of those of the walls change
      type(bodies_t), intent(inout) :: bodies

      if (allocated(self%loads)) call predict_loads(dt, self%loads)
      call self%move(time, bodies)
   end subroutine predict

   !> Find the velocities of the load-controlled walls from the contacts. Their places do not change. Collective.
   subroutine accelerate(self, comm, dt, time, gravity, bodies, terms)
      !> Walls with loads
      class(walls_t), intent(inout) :: self
      class(communicator_t), intent(inout) :: comm
      !> Time step; 0 at the start [s]
      real(wp), intent(in) :: dt
      !> Simulated time at the end of the step [s]
      real(wp), intent(in) :: time
      !> Acceleration of gravity at this time, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      !> Bodies; velocities and accelerations of those of the walls change
      type(bodies_t), intent(inout) :: bodies
      !> Contacts with fixed bodies
      type(wall_terms_t), intent(in) :: terms

      call correct_loads(self%loads, comm, dt, time, gravity, self%wall, self%wall_of, bodies, terms)
      call self%move(time, bodies)
   end subroutine accelerate

   !> Move the bodies of the walls to their poses at a given time, and displace them by loads. Those that have left a
   !> periodic cell return to it.
   subroutine move(self, time, bodies)
      class(walls_t), intent(in) :: self
      !> Simulated time [s]
      real(wp), intent(in) :: time
      !> Bodies; poses, velocities and accelerations of those of the walls change
      type(bodies_t), intent(inout) :: bodies
      integer :: k

      do k = 1, size(self%wall)
         if (self%wall(k)%is_driven()) call self%wall(k)%move(self%motions, time, bodies)
      end do
      if (allocated(self%loads)) call carry_walls(self%loads, self%wall, bodies)
      if (.not. bodies%cell%is_periodic) return
      do k = 1, size(self%wall)
         if (.not. self%wall(k)%is_driven()) cycle
         bodies%image(self%wall(k)%slots, :) = 0_ip
         call put_into_cell(bodies, self%wall(k)%slots)
      end do
   end subroutine move

   !> Energies of all loads together at the end of a step, (`n_energies`) [J/m]
   pure function energies(self, dt)
      !> Walls with loads
      class(walls_t), intent(in) :: self
      !> Time step [s]
      real(wp), intent(in) :: dt
      real(wp) :: energies(n_energies)

      energies = energies_of_loads(self%loads, dt)
   end function energies

end module polydem_walls
