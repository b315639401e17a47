!> Checks of the groups &grains and &wall, and of the entries that name walls, against each other.
module polydem_check_parts
   use polydem_blame_entry, only: blame
   use polydem_check_loads, only: check_loads
   use polydem_check_shapes, only: check_shape
   use polydem_errors, only: error_t, input_error, raise
   use polydem_group_instances, only: index_of_instance, instance_t
   use polydem_kinds, only: ip, lp, wp
   use polydem_missing_entries, only: missing_group, run_example
   use polydem_namelist_entries, only: entries, first_row
   use polydem_settings, only: grains_settings_t, settings_t
   use polydem_strings, only: quoted, split_words, suggestion, to_text
   implicit none
   private
   public :: check_parts

   !> Upper limit of the number of corners of the grains of a group, of which half the range of integers can count
   integer(lp), parameter :: corner_limit = 2_lp**30

contains

   !> Check that the bodies of a scene come from a recipe, from parts or from a file, and check its parts.
   pure subroutine check_parts(settings, instances, error)
      !> Settings with all entries filled in
      type(settings_t), intent(in) :: settings
      !> All groups with their values, which contain the places for messages
      type(instance_t), intent(in) :: instances(:)
      !> First entry that contradicts another
      type(error_t), allocatable, intent(inout) :: error
      integer :: k

      call check_source(settings, instances, error)
      do k = 1, size(settings%grains)
         if (allocated(error)) return
         associate (group => settings%grains(k))
            call check_group(group, instances(index_of_instance(instances, 'grains', group%name)), error)
         end associate
      end do
      do k = 1, size(settings%motion)
         associate (motion => settings%motion(k))
            if (motion%wall /= '' .and. size(motion%bodies) > 0) call blame(instances(index_of_instance( &
               instances, 'motion', motion%name)), 'wall', 'cannot be combined with ''bodies''; give only one of '// &
               'them', error)
         end associate
      end do
      call check_loads(settings, instances, error)
      do k = 1, size(settings%wall)
         if (settings%wall(k)%outline == 'bodies') call check_bodies(settings, k, instances, error)
      end do
   end subroutine check_parts

   !> Check that there are bodies, and that a recipe has no parts beside its own.
   pure subroutine check_source(settings, instances, error)
      type(settings_t), intent(in) :: settings
      type(instance_t), intent(in) :: instances(:)
      type(error_t), allocatable, intent(inout) :: error
      character(len=6) :: kinds(2)
      integer :: k, place

      associate (scene => instances(index_of_instance(instances, 'scene')))
         if (settings%scene%name /= 'parts' .and. settings%scene%name /= 'file') then
            kinds = [character(len=6) :: 'grains', 'wall']
            do k = 1, merge(1, 2, settings%scene%name == 'result')
               place = findloc(instances%group == kinds(k), .true., 1)
               if (place > 0) call raise(error, input_error, instances(place)%place//': &'//trim(kinds(k))//' '// &
                  instances(place)%name//' cannot be combined with name = '//quoted(settings%scene%name)// &
                  ' in &scene; leave out the name, or start from the parts of this scene, which check --expand prints')
            end do
         else if (settings%scene%bodies_file == '' .and. size(settings%grains) + size(settings%source) == 0) then
            if (.not. scene%is_given .and. size(settings%wall) == 0) then
               call raise(error, input_error, scene%place//': '//missing_group('scene', run_example))
            else if (size(settings%wall) == 0) then
               call raise(error, input_error, scene%place//': ''name'' in &scene is required without groups '// &
                  '&grains and without ''bodies_file'''//suggestion('', recipes()))
            else
               call raise(error, input_error, instances(index_of_instance(instances, 'wall', &
                  settings%wall(1)%name))%place//': there are no free bodies; add a group &grains, for '// &
                  'example: &grains name = ''sample'' region = ''box'' low = 0, 0 high = 0.1, 0.1 number = 50 /')
            end if
         end if
      end associate
   end subroutine check_source

   !> Names of the scenes for a message: without that of parts, which need no name
   pure function recipes() result(names)
      character(len=16), allocatable :: names(:)

      names = split_words(entries(first_row('scene', 'name'))%allowed)
      names = pack(names, names /= 'parts')
   end function recipes

   !> Check the entries of a group of grains against each other.
   pure subroutine check_group(group, instance, error)
      type(grains_settings_t), intent(in) :: group
      type(instance_t), intent(in) :: instance
      type(error_t), allocatable, intent(inout) :: error

      if (group%arrangement == 'voronoi') then
         if (group%number == 0_ip) call blame(instance, 'number', 'is 0; give the number of blocks, for example '// &
            'number = 200', error)
         if (group%gap > 0.0_wp .eqv. group%solid_fraction > 0.0_wp) call blame(instance, 'solid_fraction', &
            'or ''gap'' is needed, and only one of them; for example solid_fraction = 0.95', error, 'gap')
      else if (group%region /= 'at') then
         if (group%number == 0_ip .and. .not. group%solid_fraction > 0.0_wp) call blame(instance, 'number', &
            'is 0; give it, or give ''solid_fraction'', for example number = 50', error)
         if (group%number > 0_ip .and. group%solid_fraction > 0.0_wp) call blame(instance, 'solid_fraction', &
            'cannot be combined with ''number''; give only one of them', error, 'number')
      end if
      if (group%arrangement == 'packing' .and. group%number == 0_ip) call blame(instance, 'solid_fraction', &
         'cannot be used with arrangement = ''packing''; give ''number'' in its place', error)
      if (group%arrangement == 'single' .and. group%number > 1_ip) call blame(instance, 'number', &
         'must be 1 with region = ''at'' and arrangement = ''single''; use arrangement = ''column'', or '// &
         'region = ''box''', error)
      if (group%arrangement == 'column' .and. group%shape /= 'rectangle') call blame(instance, 'shape', &
         'must be ''rectangle'' with arrangement = ''column''', error)
      if (group%arrangement == 'column' .and. any(abs(group%angle) > 0.0_wp)) call blame(instance, 'angle', &
         'must be 0, 0 with arrangement = ''column''', error)
      call check_shape(group, instance, error)
      if (group%moving_grains > group%number .and. group%number > 0_ip) call blame(instance, 'moving_grains', &
         'must not exceed ''number''', error, 'number')
      if (group%number*max(4_lp, int(group%corners(2), lp), size(group%outline, kind=lp)/2_lp) > corner_limit) &
         call blame(instance, 'number', 'must not exceed 2^30 divided by the number of corners of a grain; give '// &
         'less, for example number = 1000000', error, 'corners')
      if (group%overlap .and. group%sizes /= 'uniform' .and. group%sizes /= '') call blame(instance, 'overlap', &
         'cannot be combined with sizes = '//quoted(group%sizes), error, 'sizes')
   end subroutine check_group

   !> Check a wall that consists of bodies of a file: there is a file, a motion moves the wall, a load acts on it, it
   !> vanishes, bounds the sample or the series has it, and no other wall has its bodies.
   pure subroutine check_bodies(settings, w, instances, error)
      type(settings_t), intent(in) :: settings
      !> Number of the wall
      integer, intent(in) :: w
      type(instance_t), intent(in) :: instances(:)
      type(error_t), allocatable, intent(inout) :: error
      integer :: j, k
      logical :: is_used

      associate (wall => settings%wall(w), instance => instances(index_of_instance(instances, 'wall', &
                                                                                   settings%wall(w)%name)))
         if (settings%scene%bodies_file == '' .and. settings%scene%name /= 'result') call blame(instance, 'bodies', &
            'needs ''bodies_file'' in &scene, which has these bodies', error)
         is_used = wall%vanish_at > 0.0_wp .or. settings%output%series_interval > 0.0_wp
         do k = 1, size(settings%motion)
            is_used = is_used .or. settings%motion(k)%wall == wall%name
         end do
         do k = 1, size(settings%load)
            is_used = is_used .or. settings%load(k)%wall == wall%name
         end do
         do k = 1, size(settings%stage)
            is_used = is_used .or. any([settings%stage(k)%wall, settings%stage(k)%opposite] == wall%name)
         end do
         do k = 1, size(settings%sample%sides)
            is_used = is_used .or. settings%sample%sides(k)%text == wall%name
         end do
         do k = 1, size(settings%sample%ends)
            is_used = is_used .or. settings%sample%ends(k)%text == wall%name
         end do
         if (.not. is_used) call blame(instance, 'outline', '= ''bodies'' gives a name to bodies that no '// &
            '&motion, &load, &stage or &sample uses; leave out this wall, or write wall = '//quoted(wall%name)// &
            ' in a &motion', error)
         do k = 1, w - 1
            do j = 1, size(settings%wall(k)%bodies)
               if (any(wall%bodies == settings%wall(k)%bodies(j))) call blame(instance, 'bodies', 'contains body '// &
                  to_text(settings%wall(k)%bodies(j))//', which is one of the wall '//settings%wall(k)%name// &
                  '; leave it out of one of them', error)
            end do
         end do
      end associate
   end subroutine check_bodies

end module polydem_check_parts
