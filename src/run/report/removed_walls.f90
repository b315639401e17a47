!> Warnings about what is asked of a wall that was removed: to bear a load, to move, to bound a sample.
module polydem_removed_walls
   use polydem_wall_warnings, only: add
   use polydem_kinds, only: wp
   use polydem_settings, only: settings_t
   use polydem_source_locations, only: place_of
   use polydem_strings, only: text_t, to_text
   implicit none
   private
   public :: warn_of_removed

contains

   !> Warn of loads and motions that begin when their wall was removed, and of measures of walls that are removed.
   subroutine warn_of_removed(settings, warnings)
      type(settings_t), intent(in) :: settings
      !> The warnings so far
      type(text_t), allocatable, intent(inout) :: warnings(:)
      integer :: j, k

      do k = 1, size(settings%load)
         associate (load => settings%load(k))
            if (load%stage == '') call begin(settings, 'load', load%name, load%wall, load%start, warnings)
            do j = 1, size(load%between)
               call measure(settings, 'load', '.'//load%name, 'between', load%between(j)%text, warnings)
            end do
         end associate
      end do
      do k = 1, size(settings%motion)
         associate (motion => settings%motion(k))
            if (motion%stage == '') call begin(settings, 'motion', motion%name, motion%wall, motion%start, warnings)
         end associate
      end do
      do k = 1, size(settings%stage)
         associate (stage => settings%stage(k))
            if (stage%until /= 'strain') cycle
            call measure(settings, 'stage', '.'//stage%name, 'wall', stage%wall, warnings)
            call measure(settings, 'stage', '.'//stage%name, 'opposite', stage%opposite, warnings)
         end associate
      end do
      if (settings%sample%area /= 'walls') return
      do j = 1, size(settings%sample%sides)
         call measure(settings, 'sample', '', 'sides', settings%sample%sides(j)%text, warnings)
      end do
      do j = 1, size(settings%sample%ends)
         call measure(settings, 'sample', '', 'ends', settings%sample%ends(j)%text, warnings)
      end do
   end subroutine warn_of_removed

   !> Warn if something begins when its wall is not there any more.
   subroutine begin(settings, group, name, wall, start, warnings)
      type(settings_t), intent(in) :: settings
      !> Group and name of what begins, and its wall
      character(len=*), intent(in) :: group, name, wall
      !> When it begins [s]
      real(wp), intent(in) :: start
      type(text_t), allocatable, intent(inout) :: warnings(:)

      associate (time => removal_time(settings, wall))
         if (.not. time > 0.0_wp .or. start < time) return
         call add(warnings, place_of(settings, group//'.'//name, 'start')//': &'//group//' '//name//' begins at '// &
                  to_text(start, 3)//' s, but its wall '//wall//' has vanished at '//to_text(time, 3)//' s: it '// &
                  'moves nothing')
      end associate
   end subroutine begin

   !> Warn if a quantity is measured from a wall that is removed.
   subroutine measure(settings, group, name, key, wall, warnings)
      type(settings_t), intent(in) :: settings
      !> Group, name of the instance behind a dot if it has one, key, and the wall
      character(len=*), intent(in) :: group, name, key, wall
      type(text_t), allocatable, intent(inout) :: warnings(:)

      associate (time => removal_time(settings, wall))
         if (time > 0.0_wp) call add(warnings, place_of(settings, group//name, key)//': '''//key//''' in &'// &
            trim(group//' '//name(2:))//' names the wall '//wall//', which vanishes at '//to_text(time, 3)//' s: '// &
            'what is measured from it then is meaningless')
      end associate
   end subroutine measure

   !> Time at which a wall is removed [s]; 0: never
   pure real(wp) function removal_time(settings, wall) result(time)
      type(settings_t), intent(in) :: settings
      !> Name of the wall
      character(len=*), intent(in) :: wall
      integer :: k

      time = 0.0_wp
      do k = 1, size(settings%wall)
         if (settings%wall(k)%name == wall) time = settings%wall(k)%vanish_at
      end do
   end function removal_time

end module polydem_removed_walls
