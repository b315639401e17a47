!> Initial state: the bodies of a scene and the prescribed motion of its walls.
!>
!> A generator lists polygons. This module makes the bodies from them and assigns the motion. A new scene needs a
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
   use polydem_origin, only: overrides_of, place_of
   use polydem_prescribed_motion, only: motion_t, new_motion
   use polydem_settings, only: scene_settings_t, settings_t
   use polydem_stack, only: list_stack
   use polydem_strings, only: to_text
   implicit none
   private
   public :: build_scene

   !> Entries that determine shapes and masses of generated bodies, for a message
   character(len=*), parameter :: sizes = 'short_axis, long_axis_max, fraction, radius, width, height and density'

contains

   !> Make the bodies of a scene and the motions of its walls.
   subroutine build_scene(settings, bodies, motions, error, rank, n_ranks)
      !> Settings: groups &scene and &forces (gravity and stiffness, for blocks at rest)
      type(settings_t), intent(in) :: settings
      !> Bodies at the start; free bodies come first unless a bodies file has another order
      type(bodies_t), intent(out) :: bodies
      !> Prescribed motions, none or one
      type(motion_t), allocatable, intent(out) :: motions(:)
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
      call assign_motion(settings%scene, bodies, motions, error)
      if (allocated(error)) error%message = place_of(settings, 'scene', 'motion_bodies')//': &scene: ' &
         //error%message
   end subroutine build_scene

   !> Call the generator of the scene, which lists the bodies.
   subroutine list_generated(settings, list, error)
      type(settings_t), intent(in) :: settings
      type(body_list_t), intent(inout) :: list
      type(error_t), allocatable, intent(inout) :: error

      select case (settings%scene%name)
      case ('drum')
         call list_drum(settings%scene, list, error)
      case ('hopper')
         call list_hopper(settings%scene, list, error)
      case ('gas')
         call list_gas(settings%scene, list, error)
      case ('channel')
         call list_channel(settings%scene, list, error)
      case ('bed')
         call list_bed(settings%scene, list, error)
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

   !> Assign the prescribed motion to its bodies; convert revolutions per second and hertz to radians per second.
   subroutine assign_motion(scene, bodies, motions, error)
      type(scene_settings_t), intent(in) :: scene
      type(bodies_t), intent(in) :: bodies
      type(motion_t), allocatable, intent(out) :: motions(:)
      type(error_t), allocatable, intent(inout) :: error
      type(motion_t) :: prescription
      integer(ip), allocatable :: slots(:)

      if (scene%motion == 'none') then
         allocate (motions(0))
         return
      end if
      call find_moved(scene%motion_bodies, bodies, slots, error)
      if (allocated(error)) return
      prescription%kind = scene%motion
      prescription%pivot = scene%motion_pivot
      prescription%rate = 2.0_wp*pi*scene%motion_rate
      prescription%velocity = scene%motion_velocity
      prescription%amplitude = scene%motion_amplitude
      prescription%frequency = 2.0_wp*pi*scene%motion_frequency
      prescription%start = scene%motion_start
      prescription%ramp = scene%motion_ramp
      allocate (motions(1))
      call new_motion(motions(1), prescription, bodies, slots)
   end subroutine assign_motion

   !> Find the slots of the bodies with prescribed motion: the bodies with the given identifiers, or all fixed bodies if
   !> no identifiers are given.
   subroutine find_moved(ids, bodies, slots, error)
      integer(ip), intent(in) :: ids(:)
      type(bodies_t), intent(in) :: bodies
      integer(ip), allocatable, intent(out) :: slots(:)
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: k, s

      slots = pack([(s, s=1_ip, bodies%n)], bodies%fixed)
      if (size(slots) == 0) then
         call raise(error, input_error, 'motion needs a fixed body, but the scene has none')
      end if
      if (size(ids) == 0 .or. allocated(error)) return
      slots = ids
      do k = 1_ip, size(ids, kind=ip)
         slots(k) = findloc(bodies%id, ids(k), dim=1)
         if (slots(k) == 0_ip) then
            call raise(error, input_error, 'motion_bodies: body '//to_text(ids(k))//' does not exist')
         else if (.not. bodies%fixed(slots(k))) then
            call raise(error, input_error, 'motion_bodies: body '//to_text(ids(k))//' is not fixed')
         else if (any(ids(:k - 1_ip) == ids(k))) then
            call raise(error, input_error, 'motion_bodies: body '//to_text(ids(k))//' is named twice')
         end if
         if (.not. allocated(error)) cycle
         ! A rank does not know the free bodies of other ranks. The rank that has the body reports that it is free.
         error%place = 2_lp*int(k, lp) + merge(1_lp, 0_lp, slots(k) == 0_ip)
         return
      end do
   end subroutine find_moved

end module polydem_scene
