!> Initial state: the bodies of a scene and the prescribed motions of its walls.
!>
!> A scene consists of parts, walls and groups of grains: those of the namelist, or those that a recipe makes. This
!> module makes the bodies from them and assigns the motions.
module polydem_scene
   use polydem_bed, only: make_bed
   use polydem_bodies, only: bodies_t
   use polydem_bodies_reader, only: known_materials_t, read_bodies_file
   use polydem_body_list, only: body_list_t, new_bodies
   use polydem_channel, only: make_channel
   use polydem_drum, only: make_drum
   use polydem_errors, only: error_t, input_error, raise
   use polydem_file_system, only: exists
   use polydem_gas, only: explain_gas, make_gas
   use polydem_heap, only: make_heap
   use polydem_hopper, only: make_hopper
   use polydem_incline, only: make_incline
   use polydem_kinds, only: ip, lp, wp
   use polydem_motion_file, only: read_motion_table
   use polydem_outlines, only: pi
   use polydem_pair_parameters, only: density_of, material_number
   use polydem_parts, only: parts_t
   use polydem_place_parts, only: list_parts
   use polydem_polygon_list, only: polygon_list_t
   use polydem_source_locations, only: overrides_of, place_of
   use polydem_prescribed_motion, only: motion_t
   use polydem_settings, only: motion_settings_t, settings_t
   use polydem_stack, only: make_stack
   use polydem_strings, only: to_text
   use polydem_name_walls, only: assign_loads, ids_of_wall, name_walls, number_of_stage
   use polydem_named_walls, only: named_walls_t
   use polydem_wall, only: new_wall, wall_t
   use polydem_wall_bodies, only: wall_bodies_t
   use polydem_wall_load, only: wall_load_t
   use polydem_wall_outlines, only: is_anticlockwise
   implicit none
   private
   public :: build_scene, find_parts, assign_motions

   !> Entries that determine shapes and masses of generated bodies, for a message
   character(len=*), parameter :: sizes = 'short_axis, long_axis_max, solid_fraction, radius, width, height and density'

   !> Greatest identifier of a bodies file beside parts
   integer(ip), parameter :: most_id = 2_ip**30

contains

   !> Make the bodies of a scene and its moving walls.
   subroutine build_scene(settings, bodies, walls, error, rank, n_ranks, named, loads)
      !> Settings: groups &scene, &motion and &forces (gravity and stiffness, for blocks at rest)
      type(settings_t), intent(in) :: settings
      !> Bodies at the start; free bodies come first unless a bodies file has another order
      type(bodies_t), intent(out) :: bodies
      !> Fixed bodies with prescribed motions or loads; each wall has bodies with the same motions and loads
      type(wall_t), allocatable, intent(out) :: walls(:)
      !> Error in the namelist or the bodies file
      type(error_t), allocatable, intent(inout) :: error
      !> Number of this rank, from 0, and number of ranks; each rank makes all fixed bodies and its share of the free
      !> bodies. Default: one rank
      integer(ip), intent(in), optional :: rank, n_ranks
      !> Walls with their names
      type(named_walls_t), intent(inout), optional :: named
      !> Loads on them; not allocated if there are none
      type(wall_load_t), allocatable, intent(inout), optional :: loads(:)
      type(body_list_t) :: list
      type(parts_t) :: parts
      type(wall_bodies_t), allocatable :: walls_of_parts(:)

      if (present(rank)) list%rank = rank
      if (present(n_ranks)) list%n_ranks = n_ranks
      list%has_materials = size(settings%material) > 0
      allocate (walls_of_parts(0))
      if (settings%scene%bodies_file /= '') call list_file(settings, list, error)
      if (.not. allocated(error)) call find_parts(settings, parts, error)
      if (.not. allocated(error)) call list_parts_beside_file(settings, parts, list, walls_of_parts, error)
      if (.not. allocated(error)) then
         call new_bodies(list, bodies, error)
         if (allocated(error)) error%message = origin_of_bodies(settings)//error%message
         if (allocated(error) .and. parts%recipe /= '') error%message = error%message// &
            ' (the bodies follow from '//sizes//' in &scene)'//overrides_of(settings, 'scene')
         if (allocated(error) .and. parts%recipe == '') error%message = error%message// &
            overrides_of(settings, 'grains')//overrides_of(settings, 'wall')
      end if
      if (.not. allocated(error)) call assign_motions(settings, bodies, walls_of_parts, walls, error)
      if (allocated(error)) return
      if (present(named)) call name_walls(settings, bodies, walls_of_parts, walls, named)
      if (present(loads)) call assign_loads(settings, walls_of_parts, loads)
   end subroutine build_scene

   !> Beginning of a message about one of all bodies
   pure function origin_of_bodies(settings) result(origin)
      type(settings_t), intent(in) :: settings
      character(len=:), allocatable :: origin

      associate (scene => settings%scene)
         origin = place_of(settings, 'scene', 'name')//': &scene: '
         if (size(settings%grains) > 0) origin = place_of(settings, 'grains.'//settings%grains(1)%name, 'name')// &
            ': the bodies of &grains and &wall: '
         if (scene%bodies_file /= '') origin = origin_of_file(settings)//scene%bodies_file//': '
      end associate
   end function origin_of_bodies

   !> Beginning of a message about the bodies file
   pure function origin_of_file(settings) result(origin)
      type(settings_t), intent(in) :: settings
      character(len=:), allocatable :: origin

      origin = place_of(settings, 'scene', 'bodies_file')//": 'bodies_file' in &scene: "
   end function origin_of_file

   !> List the bodies of a file.
   subroutine list_file(settings, list, error)
      type(settings_t), intent(in) :: settings
      type(body_list_t), intent(inout) :: list
      type(error_t), allocatable, intent(inout) :: error

      associate (path => settings%scene%bodies_file)
         if (.not. exists(path)) call raise(error, input_error, path//': there is no such file')
         if (.not. allocated(error)) call read_bodies_file(path, settings%scene%density, list, error, &
                                                            materials_of(settings))
      end associate
      if (allocated(error)) error%message = origin_of_file(settings)//error%message
   end subroutine list_file

   !> The materials of the run, for the bodies of a file
   pure type(known_materials_t) function materials_of(settings) result(materials)
      type(settings_t), intent(in) :: settings
      integer(ip) :: k

      associate (n => size(settings%material, kind=ip), scene => settings%scene)
         allocate (materials%names(n), materials%density(n))
         do k = 1_ip, n
            materials%names(k)%text = settings%material(k)%name
            materials%density(k) = density_of(settings, k)
         end do
         materials%of_free = material_number(settings, scene%material)
         materials%of_fixed = materials%of_free
         if (scene%wall_material /= '') materials%of_fixed = material_number(settings, scene%wall_material)
      end associate
   end function materials_of

   !> Find the parts of a scene: those of the namelist, or those that its recipe makes.
   subroutine find_parts(settings, parts, error)
      !> Settings: groups &scene, &grains, &wall and &forces
      type(settings_t), intent(in) :: settings
      !> Its parts
      type(parts_t), intent(out) :: parts
      !> Allocated if the recipe cannot be followed
      type(error_t), allocatable, intent(inout) :: error

      parts%recipe = ''
      if (any(settings%scene%name == [character(len=5) :: 'parts', 'file'])) then
         parts%grains = settings%grains
         parts%walls = settings%wall
         return
      end if
      call parts%start(settings%scene%name)
      select case (settings%scene%name)
      case ('drum')
         call make_drum(settings%scene, parts, error)
      case ('hopper')
         call make_hopper(settings%scene, parts, error)
      case ('gas')
         call make_gas(settings%scene, parts)
      case ('channel')
         call make_channel(settings%scene, parts, error)
      case ('bed')
         call make_bed(settings%scene, parts, error)
      case ('heap')
         call make_heap(settings%scene, parts, error)
      case ('incline')
         call make_incline(settings, parts, error)
      case ('stack')
         call make_stack(settings%scene, parts)
      case default
         call raise(error, input_error, 'unknown scene '//settings%scene%name)
      end select
      if (allocated(error)) call blame_recipe(settings, error)
   end subroutine find_parts

   !> Complete a message about a recipe.
   pure subroutine blame_recipe(settings, error)
      type(settings_t), intent(in) :: settings
      type(error_t), intent(inout) :: error

      error%message = place_of(settings, 'scene', 'name')//': &scene: '//error%message//overrides_of(settings, 'scene')
   end subroutine blame_recipe

   !> List the bodies of the parts, whose identifiers follow the greatest one of the bodies file.
   subroutine list_parts_beside_file(settings, parts, list, walls, error)
      type(settings_t), intent(in) :: settings
      type(parts_t), intent(in) :: parts
      type(body_list_t), intent(inout) :: list
      !> Walls of the parts with their bodies
      type(wall_bodies_t), allocatable, intent(out) :: walls(:)
      type(error_t), allocatable, intent(inout) :: error
      type(body_list_t) :: whole
      type(polygon_list_t) :: given, others
      character(len=:), allocatable :: text
      integer(ip) :: k

      if (list%n > 0_ip .and. size(parts%grains) + size(parts%walls) > 0) then
         if (list%greatest_id() > most_id) then
            call raise(error, input_error, origin_of_file(settings)//'identifiers must be at most '// &
                       to_text(most_id)//' if there are groups &grains or &wall')
            return
         end if
         list%id_offset = list%greatest_id() - list%n
      end if
      if (list%n > 0_ip .and. size(parts%grains) > 0) then
         call list_file(settings, whole, error)
         if (allocated(error)) return
         given = whole%kept_polygons()
         do k = 1_ip, given%n
            if (is_anticlockwise(given%polygon(k))) call others%append_polygon(given%polygon(k))
            if (.not. is_anticlockwise(given%polygon(k))) call others%append_polygon(reversed(given%polygon(k)))
         end do
      end if
      call list_parts(parts, settings, others, list, walls, error)
      if (.not. allocated(error) .or. parts%recipe == '') return
      if (parts%recipe == 'gas') then
         call explain_gas(settings%scene, parts%grains(1), text)
         error%message = text
      end if
      call blame_recipe(settings, error)
   end subroutine list_parts_beside_file

   !> Corners in the opposite order, (2, corner)
   pure function reversed(corners)
      real(wp), intent(in) :: corners(:, :)
      real(wp) :: reversed(2, size(corners, 2))

      reversed = corners(:, size(corners, 2):1:-1)
   end function reversed

   !> Find the bodies of each prescribed motion and load, and make walls of those with the same ones.
   subroutine assign_motions(settings, bodies, named, walls, error)
      type(settings_t), intent(in) :: settings
      type(bodies_t), intent(in) :: bodies
      !> Walls with names, which motions may refer to
      type(wall_bodies_t), intent(in) :: named(:)
      !> The moving walls
      type(wall_t), allocatable, intent(out) :: walls(:)
      type(error_t), allocatable, intent(inout) :: error
      ! Slots of the fixed bodies; the wall of each one, 0 if it is at rest; the first body of each wall
      integer(ip), allocatable :: slots(:), wall_of(:), first(:)
      ! Whether a motion, or a load behind the motions, moves a body, (motion or load, fixed body)
      logical, allocatable :: moves(:, :)
      type(motion_t), allocatable :: motions(:)
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
         motions(k) = prescribed(settings%motion(k))
         motions(k)%stage = number_of_stage(settings, settings%motion(k)%stage)
         if (motions(k)%stage > 0_ip) motions(k)%start = huge(1.0_wp)
         if (motions(k)%kind /= 'table') cycle
         allocate (motions(k)%table)
         call read_motion_table(settings, settings%motion(k), motions(k)%table, error)
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
         call new_wall(walls(w), pack(motions, moves(:n_motions, first(w))), bodies, pack(slots, wall_of == w))
         walls(w)%is_loaded = any(moves(n_motions + 1:, first(w)))
      end do
   end subroutine assign_motions

   !> Find the bodies of a wall that yields to a load.
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

   !> Parameters of a motion; revolutions per second and hertz become radians per second
   pure type(motion_t) function prescribed(motion)
      type(motion_settings_t), intent(in) :: motion

      prescribed%kind = motion%kind
      prescribed%pivot = motion%pivot
      prescribed%rate = 2.0_wp*pi*motion%rate
      prescribed%velocity = motion%velocity
      prescribed%amplitude = motion%amplitude
      prescribed%frequency = 2.0_wp*pi*motion%frequency
      prescribed%start = motion%start
      prescribed%ramp = motion%ramp
      if (.not. motion%end > 0.0_wp) return
      prescribed%end = motion%end
      prescribed%ramp_down = motion%ramp
   end function prescribed

   !> Identifiers of the bodies that a motion moves; none if it moves all fixed bodies
   pure function ids_of(motion, named) result(ids)
      type(motion_settings_t), intent(in) :: motion
      type(wall_bodies_t), intent(in) :: named(:)
      integer(ip), allocatable :: ids(:)

      ids = motion%bodies
      if (motion%wall /= '') ids = ids_of_wall(motion%wall, named)
   end function ids_of

   !> Beginning of a message about the bodies of a motion: they are entries of a wall, of &motion, or of &scene if the
   !> motion has no name
   pure function origin_of(settings, motion) result(origin)
      type(settings_t), intent(in) :: settings
      type(motion_settings_t), intent(in) :: motion
      character(len=:), allocatable :: origin

      if (motion%wall /= '') then
         origin = place_of(settings, 'wall.'//motion%wall, 'bodies')//": 'bodies' in &wall "//motion%wall//': '
      else if (motion%name == '') then
         origin = place_of(settings, 'scene', 'motion_bodies')//": 'motion_bodies' in &scene: "
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

end module polydem_scene
