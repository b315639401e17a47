!> The parts of a scene as a namelist, which makes the same bodies as the file from which the settings come.
module polydem_expand
   use polydem_errors, only: error_t
   use polydem_fill_groups, only: store_grains, store_wall
   use polydem_group_instances, only: instance_t, new_instance
   use polydem_parts, only: parts_t
   use polydem_namelist_entries, only: entries
   use polydem_resolve_entries, only: write_group
   use polydem_recipes, only: find_parts
   use polydem_settings, only: settings_t
   implicit none
   private
   public :: expand_scene

   !> Keys of &scene that are no arguments of a recipe
   character(len=*), parameter :: common(*) = [character(len=14) :: 'bodies_file', 'seed', 'density', 'material', &
      'wall_material', 'remove_overlap']

contains

   !> Write the parts of a scene, and the other groups with the entries that are given.
   subroutine expand_scene(settings, text, error)
      !> All settings of a run
      type(settings_t), intent(in) :: settings
      !> The namelist
      character(len=:), allocatable, intent(out) :: text
      !> Allocated if the recipe cannot be followed
      type(error_t), allocatable, intent(inout) :: error
      type(parts_t) :: parts
      type(instance_t) :: instance
      character(len=:), allocatable :: group
      integer :: k

      call find_parts(settings, parts, error)
      if (allocated(error)) return
      text = scene_text(settings%given)
      do k = 1, size(parts%grains)
         call new_instance(entries, 'grains', instance)
         call store_grains(parts%grains(k), instance)
         call write_group(instance, group)
         text = text//group
      end do
      do k = 1, size(parts%walls)
         call new_instance(entries, 'wall', instance)
         call store_wall(parts%walls(k), instance)
         call write_group(instance, group)
         text = text//group
      end do
      text = text//other_groups(settings%given)
   end subroutine expand_scene

   !> The group &scene without the arguments of its recipe; empty if nothing is left
   pure function scene_text(given) result(text)
      !> Given entries, one per line
      character(len=*), intent(in) :: given
      character(len=:), allocatable :: text, group, key, line
      integer :: first

      text = ''
      group = ''
      first = 1
      do while (first <= len(given))
         call take_line(given, first, line)
         if (index(line, '&') == 1) group = line
         if (group /= '&scene' .or. index(line, ' = ') == 0) cycle
         key = trim(adjustl(line(:index(line, ' = '))))
         if (any(common == key)) text = text//line//new_line('a')
      end do
      if (text /= '') text = '&scene'//new_line('a')//text//'/'//new_line('a')
   end function scene_text

   !> All groups except &scene and the parts
   pure function other_groups(given) result(text)
      !> Given entries, one per line
      character(len=*), intent(in) :: given
      character(len=:), allocatable :: text, group, line
      integer :: first

      text = ''
      group = ''
      first = 1
      do while (first <= len(given))
         call take_line(given, first, line)
         if (index(line, '&') == 1) group = line
         if (all([character(len=7) :: '&scene', '&grains', '&wall'] /= group)) text = text//line//new_line('a')
      end do
   end function other_groups

   !> Take the line that begins at a place, and go to the next one.
   pure subroutine take_line(text, first, line)
      character(len=*), intent(in) :: text
      !> Place of the first character of the line
      integer, intent(inout) :: first
      character(len=:), allocatable, intent(out) :: line
      integer :: last

      last = first + index(text(first:)//new_line('a'), new_line('a')) - 2
      line = text(first:last)
      first = last + 2
   end subroutine take_line

end module polydem_expand
