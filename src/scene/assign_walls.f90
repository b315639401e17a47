!> The walls of a scene: which fixed bodies motions and loads drive, and the walls by name.
module polydem_assign_walls
   use polydem_bodies, only: bodies_t
   use polydem_errors, only: error_t, input_error, raise
   use polydem_kinds, only: ip, lp, wp
   use polydem_motion, only: motion_item_t
   use polydem_motion_factory, only: new_motion
   use polydem_name_walls, only: assign_loads, ids_of_wall, name_walls
   use polydem_named_walls, only: named_walls_t
   use polydem_settings, only: motion_settings_t, settings_t
   use polydem_source_locations, only: place_of
   use polydem_strings, only: text_t, to_text
   use polydem_wall, only: new_wall, wall_t
   use polydem_wall_bodies, only: wall_bodies_t
   use polydem_walls, only: walls_t
   implicit none
   private
   public :: assign_walls

contains

   !> Make the walls of a scene from its settings.
   subroutine assign_walls(settings, bodies, named, walls, error)
      !> Settings: groups &wall, &motion and &load
      type(settings_t), intent(in) :: settings
      !> Bodies at the start
      type(bodies_t), intent(in) :: bodies
      !> Walls with names and their bodies, which motions and loads refer to
      type(wall_bodies_t), intent(in) :: named(:)
      !> The walls; their record is not started
      type(walls_t), intent(inout) :: walls
      !> Allocated if a motion or a load names bodies that cannot move
      type(error_t), allocatable, intent(inout) :: error

      call assign_motions(settings, bodies, named, walls%driven, error)
      if (allocated(error)) return
      call name_walls(settings, bodies, named, walls%driven, walls%named)
      call assign_loads(settings, named, walls%loads)
      call check_sample(settings, bodies, walls%named, error)
   end subroutine assign_walls

   !> Check that the walls that bound the sample along an axis are apart along it.
   subroutine check_sample(settings, bodies, named, error)
      type(settings_t), intent(in) :: settings
      type(bodies_t), intent(in) :: bodies
      type(named_walls_t), intent(in) :: named
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
         integer(ip) :: k, pair(2)

         if (size(names) /= 2) return
         pair = 0_ip
         do k = 1_ip, size(named%wall, kind=ip)
            if (named%wall(k)%name == names(1)%text) pair(1) = k
            if (named%wall(k)%name == names(2)%text) pair(2) = k
         end do
         if (named%gap(pair, axis, bodies) > 0.0_wp) return
         call raise(error, input_error, place_of(settings, 'sample', key)//': '''//key//''' in &sample: the walls '// &
                    names(1)%text//' and '//names(2)%text//' are not apart along '//'xy'(axis:axis)// &
                    ', so there is no sample between them; '''//key//''' names '//meaning)
      end subroutine check_pair

   end subroutine check_sample

   !> Find the bodies of each prescribed motion and load, and make walls of those with the same ones.
   subroutine assign_motions(settings, bodies, named, walls, error)
      type(settings_t), intent(in) :: settings
      type(bodies_t), intent(in) :: bodies
      !> Walls with names, which motions may refer to
      type(wall_bodies_t), intent(in) :: named(:)
      !> The moving walls
      type(wall_t), allocatable, intent(out) :: walls(:)
      !> Allocated if a motion or a load names bodies that cannot move
      type(error_t), allocatable, intent(inout) :: error
      ! Slots of the fixed bodies; the wall of each one, 0 if it is at rest; the first body of each wall
      integer(ip), allocatable :: slots(:), wall_of(:), first(:)
      ! Whether a motion, or a load behind the motions, moves a body, (motion or load, fixed body)
      logical, allocatable :: moves(:, :)
      type(motion_item_t), allocatable :: motions(:)
      integer(ip), allocatable :: indices(:)
      integer(ip) :: k, n, n_motions, s, w

      slots = pack([(s, s=1_ip, bodies%n)], bodies%fixed)
      n_motions = size(settings%motion, kind=ip)
      allocate (moves(n_motions + size(settings%load), size(slots)), motions(n_motions))
      do k = 1_ip, size(motions, kind=ip)
         associate (motion => settings%motion(k))
            call find_moved(ids_of(motion, named), bodies, slots, moves(k, :), error)
            if (allocated(error)) then
               error%message = origin_of(settings, motion)//error%message
               return
            end if
         end associate
         call new_motion(settings, settings%motion(k), motions(k)%motion, error)
         if (allocated(error)) return
      end do
      do k = 1_ip, size(settings%load, kind=ip)
         call find_loaded(settings, settings%load(k)%wall, named, bodies, slots, moves(n_motions + k, :), error)
         if (allocated(error)) return
      end do
      allocate (wall_of(size(slots)), first(size(slots)))
      wall_of = 0_ip
      n = 0_ip
      do s = 1_ip, size(slots, kind=ip)
         if (.not. any(moves(:, s))) cycle
         do w = 1_ip, n
            if (all(moves(:, first(w)) .eqv. moves(:, s))) exit
         end do
         wall_of(s) = w
         if (w <= n) cycle
         n = w
         first(n) = s
      end do
      allocate (walls(n))
      do w = 1_ip, n
         indices = pack([(k, k=1_ip, n_motions)], moves(:n_motions, first(w)))
         call new_wall(walls(w), motions(indices), bodies, pack(slots, wall_of == w))
         walls(w)%is_loaded = any(moves(n_motions + 1:, first(w)))
      end do
   end subroutine assign_motions

   !> Find the bodies of a load-controlled wall.
   subroutine find_loaded(settings, name, named, bodies, slots, is_moved, error)
      type(settings_t), intent(in) :: settings
      character(len=*), intent(in) :: name
      type(wall_bodies_t), intent(in) :: named(:)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: slots(:)
      logical, intent(out) :: is_moved(:)
      type(error_t), allocatable, intent(inout) :: error

      call find_moved(ids_of_wall(name, named), bodies, slots, is_moved, error)
      if (allocated(error)) error%message = place_of(settings, 'wall.'//name, 'bodies')//": 'bodies' in &wall "// &
         name//': '//error%message
   end subroutine find_loaded

   !> Identifiers of the bodies that a motion moves; none if it moves all fixed bodies
   pure function ids_of(motion, named) result(ids)
      type(motion_settings_t), intent(in) :: motion
      type(wall_bodies_t), intent(in) :: named(:)
      integer(ip), allocatable :: ids(:)

      ids = motion%bodies
      if (motion%wall /= '') ids = ids_of_wall(motion%wall, named)
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
