!> The walls of a scene, from its settings: their motions and loads, and walls without a name, of other fixed bodies
!> that motions drive.
module polydem_assign_walls
   use polydem_bodies, only: bodies_t
   use polydem_check_loads, only: act_together, one_of_them
   use polydem_driven, only: along_angle
   use polydem_errors, only: error_t, input_error, raise
   use polydem_kinds, only: ip, lp, wp
   use polydem_motion, only: motion_item_t, motion_limits_t
   use polydem_motion_factory, only: new_motion
   use polydem_ramp, only: new_window
   use polydem_run_duration, only: number_of_stage
   use polydem_settings, only: motion_settings_t, settings_t
   use polydem_source_locations, only: place_of
   use polydem_strings, only: index_of, text_t, to_text
   use polydem_wall, only: gap, number_of, wall_t
   use polydem_wall_load, only: wall_load_t
   use polydem_walls, only: walls_t
   implicit none
   private
   public :: assign_walls

   !> Directions of a load, by their numbers
   character(len=*), parameter :: directions(3) = [character(len=5) :: 'x', 'y', 'angle']

contains

   !> Make the walls of a scene from its settings.
   subroutine assign_walls(settings, bodies, walls, error)
      !> Settings: groups &wall, &motion and &load
      type(settings_t), intent(in) :: settings
      !> Bodies at the start
      type(bodies_t), intent(in) :: bodies
      !> Those with names, and the identifiers of their bodies; afterwards all walls, without a record
      type(walls_t), intent(inout) :: walls
      !> Allocated if a motion or a load names bodies that cannot move
      type(error_t), allocatable, intent(inout) :: error
      ! Slots of the fixed bodies
      integer(ip), allocatable :: slots(:)
      ! Whether a motion, or a load behind the motions, moves a body, (motion or load, fixed body)
      logical, allocatable :: moves(:, :)
      integer(ip) :: k, s

      walls%n_named = size(walls%wall, kind=ip)
      do k = 1_ip, walls%n_named
         call walls%wall(k)%start(bodies)
         call set_end(settings, walls%wall(k))
      end do
      slots = pack([(s, s=1_ip, bodies%n)], bodies%fixed)
      call find_motions(settings, bodies, slots, walls, moves, error)
      if (.not. allocated(error)) call check_directions(settings, walls%motions, moves, error)
      if (allocated(error)) return
      do k = 1_ip, walls%n_named
         call set_pivot(settings, slots, moves, walls, walls%wall(k))
      end do
      call assign_drivers(bodies, slots, moves, walls)
      call walls%find_slots(bodies)
      call assign_loads(settings, walls%wall, walls%loads)
      call check_sample(settings, bodies, walls%wall, error)
   end subroutine assign_walls

   !> Set the time at which a wall is removed.
   pure subroutine set_end(settings, wall)
      type(settings_t), intent(in) :: settings
      type(wall_t), intent(inout) :: wall
      integer :: k

      do k = 1, size(settings%wall)
         if (settings%wall(k)%name == wall%name .and. settings%wall(k)%vanish_at > 0.0_wp) &
            wall%vanish_at = settings%wall(k)%vanish_at
      end do
   end subroutine set_end

   !> State the torque on a wall about the pivot of the first motion of its first body that has one, or of its first
   !> load by angle, else about the origin.
   pure subroutine set_pivot(settings, slots, moves, walls, wall)
      type(settings_t), intent(in) :: settings
      !> Slots of the fixed bodies
      integer(ip), intent(in) :: slots(:)
      !> Whether a motion, or a load behind the motions, moves each of them
      logical, intent(in) :: moves(:, :)
      type(walls_t), intent(in) :: walls
      type(wall_t), intent(inout) :: wall
      integer :: k, s

      if (size(wall%slots) == 0) return
      do k = size(settings%load), 1, -1
         if (settings%load(k)%wall == wall%name .and. settings%load(k)%direction == 'angle') &
            wall%pivot = settings%load(k)%pivot
      end do
      s = findloc(slots, wall%slots(1), dim=1)
      if (s == 0) return
      do k = size(walls%motions), 1, -1
         if (moves(k, s) .and. walls%motions(k)%motion%has_pivot) wall%pivot = walls%motions(k)%motion%pivot
      end do
   end subroutine set_pivot

   !> Give each wall with a name its motions and loads, and make walls of the other bodies with the same ones. Bodies of
   !> a wall of which a motion moves only some are among the others.
   subroutine assign_drivers(bodies, slots, moves, walls)
      type(bodies_t), intent(in) :: bodies
      !> Slots of the fixed bodies
      integer(ip), intent(in) :: slots(:)
      !> Whether a motion, or a load behind the motions, moves each of them
      logical, intent(in) :: moves(:, :)
      type(walls_t), intent(inout) :: walls
      logical :: is_open(size(slots)), is_same(size(slots))
      ! Place in `slots` of each slot, 0 for free bodies; those of the bodies of a wall
      integer(ip) :: place(bodies%n)
      integer(ip), allocatable :: own(:)
      integer(ip) :: j, k, s

      is_open = any(moves, 1)
      place = 0_ip
      place(slots) = [(s, s=1_ip, size(slots, kind=ip))]
      do k = 1_ip, walls%n_named
         own = place(walls%wall(k)%slots)
         own = pack(own, own > 0_ip)
         if (size(own) == 0 .or. .not. all(is_open(own))) cycle
         if (.not. all([(all(moves(:, own(j)) .eqv. moves(:, own(1))), j=1_ip, size(own, kind=ip))])) cycle
         walls%wall(k)%motions = motions_of(own(1))
         walls%wall(k)%loads = loads_of(own(1))
         is_open(own) = .false.
      end do
      do while (any(is_open))
         s = findloc(is_open, .true., dim=1, kind=ip)
         is_same = is_open .and. all(moves .eqv. spread(moves(:, s), 2, size(slots)), 1)
         call walls%append(bodies, bodies%id(pack(slots, is_same)), motions_of(s), loads_of(s))
         is_open = is_open .and. .not. is_same
      end do

   contains

      !> Numbers of the motions of a fixed body
      pure function motions_of(body) result(numbers)
         !> Its place in `slots`
         integer(ip), intent(in) :: body
         integer, allocatable :: numbers(:)
         integer :: m

         numbers = pack([(m, m=1, size(walls%motions))], moves(:size(walls%motions), body))
      end function motions_of

      !> Numbers of its loads
      pure function loads_of(body) result(numbers)
         !> Its place in `slots`
         integer(ip), intent(in) :: body
         integer, allocatable :: numbers(:)
         integer :: m

         numbers = pack([(m, m=1, size(moves, 1) - size(walls%motions))], moves(size(walls%motions) + 1:, body))
      end function loads_of

   end subroutine assign_drivers

   !> Check that the walls that bound the sample along an axis are apart along it.
   subroutine check_sample(settings, bodies, walls, error)
      type(settings_t), intent(in) :: settings
      type(bodies_t), intent(in) :: bodies
      type(wall_t), intent(in) :: walls(:)
      type(error_t), allocatable, intent(inout) :: error

      if (settings%sample%area /= 'walls') return
      call check_pair(settings%sample%sides, 'sides', 'the walls on the left and on the right', 1)
      call check_pair(settings%sample%ends, 'ends', 'the walls below and above', 2)

   contains

      !> Check the walls that bound it along an axis.
      subroutine check_pair(names, key, meaning, axis)
         type(text_t), intent(in) :: names(:)
         !> The entry, and what its walls are
         character(len=*), intent(in) :: key, meaning
         integer, intent(in) :: axis
         integer(ip) :: pair(2)

         if (size(names) /= 2) return
         pair = [number_of(names(1)%text, walls), number_of(names(2)%text, walls)]
         if (gap(walls(pair(1)), walls(pair(2)), axis, bodies) > 0.0_wp) return
         call raise(error, input_error, place_of(settings, 'sample', key)//': '''//key//''' in &sample: the walls '// &
                    names(1)%text//' and '//names(2)%text//' are not apart along '//'xy'(axis:axis)// &
                    ', so there is no sample between them; '''//key//''' names '//meaning)
      end subroutine check_pair

   end subroutine check_sample

   !> Make the motions, and find the bodies that motions and loads move.
   subroutine find_motions(settings, bodies, slots, walls, moves, error)
      type(settings_t), intent(in) :: settings
      type(bodies_t), intent(in) :: bodies
      !> Slots of the fixed bodies
      integer(ip), intent(in) :: slots(:)
      !> Walls with names; the motions are set
      type(walls_t), intent(inout) :: walls
      !> Whether a motion, or a load behind the motions, moves each fixed body
      logical, allocatable, intent(out) :: moves(:, :)
      !> Allocated if a motion or a load names bodies that cannot move
      type(error_t), allocatable, intent(inout) :: error
      integer :: k, n

      n = size(settings%motion)
      allocate (walls%motions(n), moves(n + size(settings%load), size(slots)))
      do k = 1, n
         associate (motion => settings%motion(k))
            call find_moved(ids_of(motion, walls%wall), bodies, slots, moves(k, :), error)
            if (allocated(error)) then
               error%message = origin_of(settings, motion)//error%message
               return
            end if
            call new_motion(settings, k, walls%motions(k)%motion, error)
            if (allocated(error)) return
         end associate
      end do
      do k = 1, size(settings%load)
         call find_loaded(settings, settings%load(k)%wall, walls%wall, bodies, slots, moves(n + k, :), error)
         if (allocated(error)) return
      end do
   end subroutine find_motions

   !> Check that no motion moves a wall along the direction of a load at the same time.
   subroutine check_directions(settings, motions, moves, error)
      type(settings_t), intent(in) :: settings
      type(motion_item_t), intent(in) :: motions(:)
      !> Whether a motion, or a load behind the motions, moves each fixed body
      logical, intent(in) :: moves(:, :)
      type(error_t), allocatable, intent(inout) :: error
      type(motion_limits_t) :: limits
      integer :: k, l

      do l = 1, size(settings%load)
         do k = 1, size(motions)
            associate (load => settings%load(l), motion => settings%motion(k))
               limits = motions(k)%motion%limits()
               if (.not. limits%moves(index_of(load%direction, directions))) cycle
               if (.not. any(moves(k, :) .and. moves(size(motions) + l, :))) cycle
               if (.not. act_together([load%start, load%end], load%stage, [motion%start, motion%end], motion%stage)) &
                  cycle
               call raise(error, input_error, place_of(settings, 'load.'//load%name, 'direction')// &
                          ': ''direction'' in &load '//load%name//' is one in which the motion '//motion%name// &
                          ' moves the same wall'//one_of_them)
               return
            end associate
         end do
      end do
   end subroutine check_directions

   !> Set the parameters of the loads.
   pure subroutine assign_loads(settings, walls, loads)
      type(settings_t), intent(in) :: settings
      type(wall_t), intent(in) :: walls(:)
      !> The loads; not allocated if there are none
      type(wall_load_t), allocatable, intent(inout) :: loads(:)
      integer :: j, k

      if (size(settings%load) == 0) return
      allocate (loads(size(settings%load)))
      do k = 1, size(loads)
         associate (given => settings%load(k), load => loads(k))
            load%name = given%name
            load%wall = number_of(given%wall, walls)
            load%direction = index_of(given%direction, directions)
            load%force = given%force
            if (load%direction == along_angle) load%force = given%torque
            load%stress = given%stress
            load%width = given%width
            do j = 1, min(2, size(given%between))
               load%between(j) = number_of(given%between(j)%text, walls)
            end do
            load%pivot = given%pivot
            load%mass = given%mass
            load%has_weight = given%weight
            load%damping_ratio = given%damping_ratio
            load%window_t = new_window(given%start, given%end, given%ramp, number_of_stage(settings, given%stage))
         end associate
      end do
   end subroutine assign_loads

   !> Find the bodies of a load-controlled wall.
   subroutine find_loaded(settings, name, walls, bodies, slots, is_moved, error)
      type(settings_t), intent(in) :: settings
      character(len=*), intent(in) :: name
      type(wall_t), intent(in) :: walls(:)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: slots(:)
      logical, intent(out) :: is_moved(:)
      type(error_t), allocatable, intent(inout) :: error

      call find_moved(walls(number_of(name, walls))%id, bodies, slots, is_moved, error)
      if (allocated(error)) error%message = place_of(settings, 'wall.'//name, 'bodies')//": 'bodies' in &wall "// &
         name//': '//error%message
   end subroutine find_loaded

   !> Identifiers of the bodies that a motion moves; none if it moves all fixed bodies
   pure function ids_of(motion, walls) result(ids)
      type(motion_settings_t), intent(in) :: motion
      type(wall_t), intent(in) :: walls(:)
      integer(ip), allocatable :: ids(:)

      ids = motion%bodies
      if (motion%wall /= '') ids = walls(number_of(motion%wall, walls))%id
   end function ids_of

   !> Beginning of a message about the bodies of a motion: they are entries of a wall, or of &motion
   pure function origin_of(settings, motion) result(origin)
      type(settings_t), intent(in) :: settings
      type(motion_settings_t), intent(in) :: motion
      character(len=:), allocatable :: origin

      if (motion%wall /= '') then
         origin = place_of(settings, 'wall.'//motion%wall, 'bodies')//": 'bodies' in &wall "//motion%wall//': '
      else
         origin = place_of(settings, 'motion.'//motion%name, 'bodies')//": 'bodies' in &motion: "
      end if
   end function origin_of

   !> Find which fixed bodies a motion moves: those with the given identifiers, or all if no identifiers are given.
   subroutine find_moved(ids, bodies, slots, is_moved, error)
      integer(ip), intent(in) :: ids(:)
      type(bodies_t), intent(in) :: bodies
      !> Slots of the fixed bodies
      integer(ip), intent(in) :: slots(:)
      !> Whether it moves each of them
      logical, intent(out) :: is_moved(:)
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: k, slot

      is_moved = size(ids) == 0
      if (size(slots) == 0) then
         call raise(error, input_error, 'motion needs a fixed body, but the scene has none')
         return
      end if
      do k = 1_ip, size(ids, kind=ip)
         associate (id => ids(k))
            slot = findloc(bodies%id, id, dim=1)
            if (slot == 0_ip) then
               call raise(error, input_error, 'body '//to_text(id)//' does not exist')
            else if (.not. bodies%fixed(slot)) then
               call raise(error, input_error, 'body '//to_text(id)//' is not fixed')
            else if (is_moved(findloc(slots, slot, dim=1))) then
               call raise(error, input_error, 'body '//to_text(id)//' is named twice')
            else
               is_moved(findloc(slots, slot, dim=1)) = .true.
            end if
         end associate
         if (.not. allocated(error)) cycle
         ! A rank does not know the free bodies of other ranks. The rank that has the body reports that it is free.
         error%place = 2_lp*int(k, lp) + merge(1_lp, 0_lp, slot == 0_ip)
         return
      end do
   end subroutine find_moved

end module polydem_assign_walls
