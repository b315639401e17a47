!> Initial state: the bodies of a scene and the prescribed motions of its walls.
!>
!> A generator lists polygons. This module makes the bodies from them and assigns the motions. A new scene needs a
!> generator, a case in `list_generated`, and its name in the table of namelist entries, which also holds the checks of
!> single entries.
module polydem_scene
   use polydem_bed, only: list_bed
   use polydem_bodies, only: bodies_t
   use polydem_bodies_reader, only: read_bodies_file
   use polydem_body_list, only: body_list_t, new_bodies
   use polydem_channel, only: list_channel
   use polydem_drum, only: list_drum
   use polydem_errors, only: error_t, input_error, raise
   use polydem_file_system, only: exists
   use polydem_gas, only: list_gas
   use polydem_grains, only: pi
   use polydem_heap, only: list_heap
   use polydem_hopper, only: list_hopper
   use polydem_incline, only: list_incline
   use polydem_kinds, only: ip, lp, wp
   use polydem_source_locations, only: overrides_of, place_of
   use polydem_prescribed_motion, only: motion_t
   use polydem_settings, only: motion_settings_t, settings_t
   use polydem_stack, only: list_stack
   use polydem_strings, only: to_text
   use polydem_wall, only: new_wall, wall_t
   implicit none
   private
   public :: build_scene

   !> Entries that determine shapes and masses of generated bodies, for a message
   character(len=*), parameter :: sizes = 'short_axis, long_axis_max, solid_fraction, radius, width, height and density'

contains

   !> Make the bodies of a scene and its moving walls.
   subroutine build_scene(settings, bodies, walls, error, rank, n_ranks)
      !> Settings: groups &scene, &motion and &forces (gravity and stiffness, for blocks at rest)
      type(settings_t), intent(in) :: settings
      !> Bodies at the start; free bodies come first unless a bodies file has another order
      type(bodies_t), intent(out) :: bodies
      !> Fixed bodies with prescribed motions; each wall has bodies with the same motions
      type(wall_t), allocatable, intent(out) :: walls(:)
      !> Error in the namelist or the bodies file
      type(error_t), allocatable, intent(inout) :: error
      !> Number of this rank, from 0, and number of ranks; each rank makes all fixed bodies and its share of the free
      !> bodies. Default: one rank
      integer(ip), intent(in), optional :: rank, n_ranks
      type(body_list_t) :: list
      character(len=:), allocatable :: origin

      if (present(rank)) list%rank = rank
      if (present(n_ranks)) list%n_ranks = n_ranks

      origin = place_of(settings, 'scene', 'name')//': &scene'
      if (settings%scene%name == 'file') then
         associate (path => settings%scene%bodies_file)
            origin = place_of(settings, 'scene', 'bodies_file')//": 'bodies_file' in &scene"
            if (.not. exists(path)) call raise(error, input_error, path//': there is no such file')
            if (.not. allocated(error)) call read_bodies_file(path, settings%scene%density, list, error)
            if (.not. allocated(error)) then
               call new_bodies(list, bodies, error)
               if (allocated(error)) error%message = path//': '//error%message
            end if
         end associate
      else
         call list_generated(settings, list, error)
         if (.not. allocated(error)) then
            call new_bodies(list, bodies, error)
            if (allocated(error)) error%message = error%message//' (the bodies follow from '//sizes//' in &scene)'
         end if
         if (allocated(error)) error%message = error%message//overrides_of(settings, 'scene')
      end if
      if (allocated(error)) then
         error%message = origin//': '//error%message
         return
      end if
      call assign_motions(settings, bodies, walls, error)
   end subroutine build_scene

   !> Call the generator of the scene, which lists the bodies.
   subroutine list_generated(settings, list, error)
      type(settings_t), intent(in) :: settings
      type(body_list_t), intent(inout) :: list
      type(error_t), allocatable, intent(inout) :: error

      select case (settings%scene%name)
      case ('drum')
         call list_drum(settings, list, error)
      case ('hopper')
         call list_hopper(settings%scene, list, error)
      case ('gas')
         call list_gas(settings%scene, list, error)
      case ('channel')
         call list_channel(settings%scene, list, error)
      case ('bed')
         call list_bed(settings, list, error)
      case ('heap')
         call list_heap(settings%scene, list, error)
      case ('incline')
         call list_incline(settings, list, error)
      case ('stack')
         call list_stack(settings, list, error)
      case default
         call raise(error, input_error, 'unknown scene '//settings%scene%name)
      end select
   end subroutine list_generated

   !> Find the bodies of each prescribed motion, and make walls of those with the same motions.
   subroutine assign_motions(settings, bodies, walls, error)
      type(settings_t), intent(in) :: settings
      type(bodies_t), intent(in) :: bodies
      type(wall_t), allocatable, intent(out) :: walls(:)
      type(error_t), allocatable, intent(inout) :: error
      ! Slots of the fixed bodies; the wall of each one, 0 if it is at rest; the first body of each wall
      integer(ip), allocatable :: slots(:), wall_of(:), first(:)
      ! Whether a motion moves a body, (motion, fixed body)
      logical, allocatable :: moves(:, :)
      type(motion_t), allocatable :: motions(:)
      integer(ip) :: k, n, s, w

      slots = pack([(s, s=1_ip, bodies%n)], bodies%fixed)
      allocate (moves(size(settings%motion), size(slots)), motions(size(settings%motion)))
      do k = 1_ip, size(motions, kind=ip)
         call find_moved(settings%motion(k), bodies, slots, moves(k, :), error)
         if (allocated(error)) then
            error%message = origin_of(settings, settings%motion(k)%name)//error%message
            return
         end if
         motions(k) = prescribed(settings%motion(k))
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
         call new_wall(walls(w), pack(motions, moves(:, first(w))), bodies, pack(slots, wall_of == w))
      end do
   end subroutine assign_motions

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
   end function prescribed

   !> Beginning of a message about the bodies of a motion: the group &motion with this name, or &scene without a name
   pure function origin_of(settings, name) result(origin)
      type(settings_t), intent(in) :: settings
      character(len=*), intent(in) :: name
      character(len=:), allocatable :: origin

      if (name == '') then
         origin = place_of(settings, 'scene', 'motion_bodies')//": 'motion_bodies' in &scene: "
      else
         origin = place_of(settings, 'motion.'//name, 'bodies')//": 'bodies' in &motion: "
      end if
   end function origin_of

   !> Find which fixed bodies a motion moves: those with the given identifiers, or all if no identifiers are given.
   subroutine find_moved(motion, bodies, slots, is_moved, error)
      type(motion_settings_t), intent(in) :: motion
      type(bodies_t), intent(in) :: bodies
      !> Slots of the fixed bodies
      integer(ip), intent(in) :: slots(:)
      !> Whether it moves each of them
      logical, intent(out) :: is_moved(:)
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: k, slot

      is_moved = size(motion%bodies) == 0
      if (size(slots) == 0) then
         call raise(error, input_error, 'motion needs a fixed body, but the scene has none')
         return
      end if
      do k = 1_ip, size(motion%bodies, kind=ip)
         associate (id => motion%bodies(k))
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
