!> Initial state: the bodies of a scene and the prescribed motions of its walls.
!>
!> A scene consists of parts, walls and groups of grains: those of the namelist, or those that a recipe makes. This
!> module makes the bodies from them.
module polydem_scene
   use polydem_assign_walls, only: assign_walls
   use polydem_bodies, only: bodies_t
   use polydem_body_list, only: body_list_t, new_bodies
   use polydem_errors, only: error_t, input_error, raise
   use polydem_gas, only: explain_gas
   use polydem_kinds, only: ip, wp
   use polydem_list_file, only: list_file, origin_of_file
   use polydem_parts, only: parts_t
   use polydem_place_parts, only: list_parts
   use polydem_polygon_list, only: polygon_list_t
   use polydem_recipes, only: blame_recipe, find_parts
   use polydem_settings, only: settings_t
   use polydem_source_locations, only: overrides_of, place_of
   use polydem_strings, only: to_text
   use polydem_wall, only: wall_t
   use polydem_wall_outlines, only: is_anticlockwise
   use polydem_walls, only: walls_t
   implicit none
   private
   public :: build_scene

   !> Entries that determine shapes and masses of generated bodies, for a message
   character(len=*), parameter :: sizes = 'short_axis, long_axis, solid_fraction, radius, width, height and density'

   !> Greatest identifier of a bodies file beside parts
   integer(ip), parameter :: most_id = 2_ip**30

contains

   !> Make the bodies of a scene and its moving walls.
   subroutine build_scene(settings, bodies, walls, error, rank, n_ranks)
      !> Settings: groups &scene, &motion and &forces (gravity and stiffness, for blocks at rest)
      type(settings_t), intent(in) :: settings
      !> Bodies at the start; free bodies come first unless a bodies file has another order
      type(bodies_t), intent(out) :: bodies
      !> Walls with their names, motions and loads
      type(walls_t), intent(out) :: walls
      !> Error in the namelist or the bodies file
      type(error_t), allocatable, intent(inout) :: error
      !> Number of this rank, from 0, and number of ranks; each rank makes all fixed bodies and its share of the free
      !> bodies. Default: one rank
      integer(ip), intent(in), optional :: rank, n_ranks
      type(body_list_t) :: list
      type(parts_t) :: parts

      if (present(rank)) list%rank = rank
      if (present(n_ranks)) list%n_ranks = n_ranks
      list%has_materials = size(settings%material) > 0
      allocate (walls%wall(0))
      if (settings%scene%bodies_file /= '') call list_file(settings, list, error)
      if (.not. allocated(error)) call find_parts(settings, parts, error)
      if (.not. allocated(error)) call list_parts_beside_file(settings, parts, list, walls%wall, error)
      if (.not. allocated(error)) then
         call new_bodies(list, bodies, error)
         if (allocated(error)) error%message = origin_of_bodies(settings)//error%message
         if (allocated(error) .and. parts%recipe /= '') error%message = error%message// &
            ' (the bodies follow from '//sizes//' in &scene)'//overrides_of(settings, 'scene')
         if (allocated(error) .and. parts%recipe == '') error%message = error%message// &
            overrides_of(settings, 'grains')//overrides_of(settings, 'wall')
      end if
      if (.not. allocated(error)) call assign_walls(settings, bodies, walls, error)
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

   !> List the bodies of the parts, whose identifiers follow the greatest one of the bodies file.
   subroutine list_parts_beside_file(settings, parts, list, walls, error)
      type(settings_t), intent(in) :: settings
      type(parts_t), intent(in) :: parts
      type(body_list_t), intent(inout) :: list
      !> Walls of the parts with their bodies
      type(wall_t), allocatable, intent(out) :: walls(:)
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

end module polydem_scene
