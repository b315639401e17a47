!> Checks of the groups &stage, and of a start from a result: entries that depend on each other.
module polydem_check_stages
   use polydem_errors, only: error_t, input_error, raise
   use polydem_group_instances, only: index_of_instance, instance_t, row_of
   use polydem_kinds, only: wp
   use polydem_settings, only: settings_t, stage_settings_t
   use polydem_strings, only: quoted
   implicit none
   private
   public :: check_stages

contains

   !> Check stages, the motions that name them, and the start from a result.
   pure subroutine check_stages(settings, instances, error)
      !> Settings with all entries filled in
      type(settings_t), intent(in) :: settings
      !> All groups with their values, which contain the places for messages
      type(instance_t), intent(in) :: instances(:)
      !> First contradiction
      type(error_t), allocatable, intent(inout) :: error
      integer :: k

      do k = 1, size(settings%stage)
         call check_stage(settings, k, instances, error)
      end do
      do k = 1, size(settings%motion)
         if (settings%motion(k)%stage /= '' .and. settings%motion(k)%start > 0.0_wp) call blame('motion', &
            settings%motion(k)%name, 'start', 'cannot be combined with ''stage'': the motion starts with its stage', &
            instances, error)
         if (settings%motion(k)%stage /= '' .and. settings%motion(k)%end > 0.0_wp) call blame('motion', &
            settings%motion(k)%name, 'end', 'cannot be combined with ''stage'': the motion ends with its stage', &
            instances, error)
      end do
      do k = 1, size(settings%load)
         if (settings%load(k)%stage == '') cycle
         if (settings%load(k)%start > 0.0_wp) call blame('load', settings%load(k)%name, 'start', &
            'cannot be combined with ''stage'': the load begins with its stage', instances, error)
         if (settings%load(k)%end > 0.0_wp) call blame('load', settings%load(k)%name, 'end', &
            'cannot be combined with ''stage'': the load ends with its stage', instances, error)
      end do
      do k = 1, size(settings%wall)
         if (settings%wall(k)%outline == 'result' .and. settings%scene%name /= 'result') call blame('wall', &
            settings%wall(k)%name, 'outline', '= ''result'' needs ''start_from'' in &scene, with name = ''result''', &
            instances, error)
         if (settings%scene%name == 'result' .and. all(settings%wall(k)%outline /= ['result', 'bodies'])) call blame( &
            'wall', settings%wall(k)%name, 'outline', 'must be ''result'' or ''bodies'': a scene that starts from '// &
            'a result has its walls already', instances, error)
      end do
      if (settings%scene%name == 'result' .and. settings%scene%remove_overlap > 0.0_wp) call blame('scene', '', &
         'remove_overlap', 'cannot be combined with ''start_from''', instances, error)
   end subroutine check_stages

   !> Check a stage.
   pure subroutine check_stage(settings, k, instances, error)
      type(settings_t), intent(in) :: settings
      !> Number of the stage
      integer, intent(in) :: k
      type(instance_t), intent(in) :: instances(:)
      type(error_t), allocatable, intent(inout) :: error

      associate (stage => settings%stage(k))
         if (all(size(stage%gravity) /= [0, 2])) call blame('stage', stage%name, 'gravity', &
            'needs two numbers, along x and y', instances, error)
         if (stage%until == 'duration') return
         if (stage%below > 0.0_wp .and. stage%above > 0.0_wp) call blame('stage', stage%name, 'above', &
            'cannot be combined with ''below''; give only one of them', instances, error)
         if (.not. (stage%below > 0.0_wp .or. stage%above > 0.0_wp)) call blame('stage', stage%name, 'until', &
            '= '//quoted(stage%until)//' needs a limit: give ''below'' or ''above'', for example '// &
            example_of(stage%until), instances, error)
         if (stage%until == 'departed' .and. stage%below > 0.0_wp) call blame('stage', stage%name, 'below', &
            'cannot be combined with until = ''departed'', which only grows; give ''above''', instances, error)
         if (stage%until == 'departed' .and. size(settings%sink) == 0) call blame('stage', stage%name, 'until', &
            '= ''departed'' needs a sink; add a group &sink', instances, error)
         if (stage%hold >= stage%longest) call blame('stage', stage%name, 'hold', 'must be less than ''longest''', &
            instances, error)
         if (stage%until == 'strain' .and. stage%wall == stage%opposite) call blame('stage', stage%name, 'opposite', &
            'must be another wall than ''wall''', instances, error)
         if (stage%until == 'stress' .and. settings%sample%area == 'none' .and. settings%cell%periodic /= 'xy') call &
            blame('stage', stage%name, 'until', '= ''stress'' needs the area of the sample; give ''area'' in '// &
            '&sample', instances, error)
         if (any(stage%until == [character(len=14) :: 'count', 'solid_fraction']) &
             .and. .not. all(stage%low < stage%high)) call check_rectangle(settings, stage, instances, error)
      end associate
   end subroutine check_stage

   !> Check a stage without a rectangle: the solid fraction may be that of a sample or of a cell.
   pure subroutine check_rectangle(settings, stage, instances, error)
      type(settings_t), intent(in) :: settings
      type(stage_settings_t), intent(in) :: stage
      type(instance_t), intent(in) :: instances(:)
      type(error_t), allocatable, intent(inout) :: error

      if (any(abs([stage%low, stage%high]) > 0.0_wp)) then
         call blame('stage', stage%name, 'high', 'must exceed ''low'' along x and y', instances, error)
      else if (stage%until == 'count') then
         call blame('stage', stage%name, 'until', '= ''count'' needs a rectangle; give ''low'' and ''high''', &
                    instances, error)
      else if (settings%sample%area == 'none' .and. settings%cell%periodic /= 'xy') then
         call blame('stage', stage%name, 'until', '= ''solid_fraction'' needs an area; give ''low'' and ''high'', '// &
                    'or ''area'' in &sample', instances, error)
      end if
   end subroutine check_rectangle

   !> An example of a limit
   pure function example_of(until) result(text)
      !> Quantity that is compared with it
      character(len=*), intent(in) :: until
      character(len=:), allocatable :: text

      select case (until)
      case ('strain')
         text = 'above = 0.1'
      case ('departed')
         text = 'above = 100'
      case default
         text = 'below = 1e-3'
      end select
   end function example_of

   !> Raise an error about an entry.
   pure subroutine blame(group, name, key, problem, instances, error)
      character(len=*), intent(in) :: group, name, key, problem
      type(instance_t), intent(in) :: instances(:)
      type(error_t), allocatable, intent(inout) :: error

      associate (instance => instances(index_of_instance(instances, group, name)))
         call raise(error, input_error, instance%values(row_of(instance, key))%place//': '''//key//''' in &'// &
                    trim(group//' '//name)//' '//problem)
      end associate
   end subroutine blame

end module polydem_check_stages
