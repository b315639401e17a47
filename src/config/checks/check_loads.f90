!> Checks of the groups &load against each other.
module polydem_check_loads
   use polydem_blame_entry, only: blame
   use polydem_errors, only: error_t
   use polydem_group_instances, only: index_of_instance, instance_t, row_of
   use polydem_kinds, only: wp
   use polydem_settings, only: load_settings_t, settings_t
   implicit none
   private
   public :: check_loads, act_together, one_of_them

   !> Remedy for a direction in which a wall moves already, behind what moves it
   character(len=*), parameter :: one_of_them = ' at the same time; leave out one of them, or let one begin at the '// &
      '''end'' of the other'

contains

   !> Check all loads.
   pure subroutine check_loads(settings, instances, error)
      !> Settings with all entries filled in
      type(settings_t), intent(in) :: settings
      !> All groups with their values, which contain the places for messages
      type(instance_t), intent(in) :: instances(:)
      !> First entry that contradicts another
      type(error_t), allocatable, intent(inout) :: error
      integer :: k

      do k = 1, size(settings%load)
         associate (instance => instances(index_of_instance(instances, 'load', settings%load(k)%name)))
            call check_width(settings%load(k), instance, error)
            call check_weight(settings, settings%load(k), instance, error)
            call check_direction(settings, k, instance, error)
            if (.not. settings%output%series_interval > 0.0_wp) cycle
            if (index_of_instance(instances, 'wall', settings%load(k)%name) > 0) call blame(instance, 'name', &
               'is that of a wall; both would have a column '//settings%load(k)%name//'.work in the series. Give '// &
               'the load another name', error)
         end associate
      end do
   end subroutine check_loads

   !> Check the force of a load, and its times.
   pure subroutine check_width(load, instance, error)
      type(load_settings_t), intent(in) :: load
      type(instance_t), intent(in) :: instance
      type(error_t), allocatable, intent(inout) :: error
      logical :: has_stress

      has_stress = abs(load%stress) > 0.0_wp
      if (has_stress .and. abs(load%force) > 0.0_wp) call blame(instance, 'stress', 'cannot be combined with '// &
         '''force''; give only one of them', error, 'force')
      if (has_stress .and. .not. load%width > 0.0_wp .and. size(load%between) == 0) call blame(instance, 'stress', &
         'needs a width on which it acts; give ''width'', or ''between'' = two walls', error)
      if (.not. has_stress .and. load%width > 0.0_wp) call blame(instance, 'width', 'is used only with ''stress''', &
         error)
      if (.not. has_stress .and. size(load%between) > 0) call blame(instance, 'between', &
         'is used only with ''stress''', error)
      if (load%width > 0.0_wp .and. size(load%between) > 0) call blame(instance, 'width', 'cannot be combined '// &
         'with ''between''; give only one of them', error, 'between')
      if (size(load%between) == 1 .or. size(load%between) > 2) call blame(instance, 'between', &
         'must name two walls, as in ''left'', ''right''', error)
      if (size(load%between) == 2) then
         if (load%between(1)%text == load%between(2)%text) call blame(instance, 'between', &
            'names the same wall twice; it must name two walls, as in ''left'', ''right''', error)
         if (load%between(1)%text == load%wall .or. load%between(2)%text == load%wall) call blame(instance, 'between', &
            'names the load-controlled wall; the width is the distance of two other walls, across the direction '// &
            'of the load', error)
      end if
      if (load%mass > 0.0_wp .and. load%mass < 1.0e-12_wp) call blame(instance, 'mass', &
         'must be 0, or at least 1e-12', error)
      if (load%direction /= 'angle' .and. .not. load%weight .and. &
          .not. any([instance%values(row_of(instance, 'force'))%is_given, &
                     instance%values(row_of(instance, 'stress'))%is_given])) call blame(instance, 'force', &
         'and ''stress'' are both missing; give one of them, for example force = -100. A wall moved by the '// &
         'grains alone has force = 0, one that lies on them weight = .true.', error)
      if (load%direction == 'angle' .and. .not. load%weight .and. &
          .not. instance%values(row_of(instance, 'torque'))%is_given) call blame(instance, 'torque', 'is missing; '// &
         'give it, for example torque = 100. A wall moved by the grains alone has torque = 0, one that '// &
         'swings weight = .true.', error)
      if (load%end > 0.0_wp .and. load%end <= load%start) call blame(instance, 'end', 'must be behind ''start''', &
         error, 'start')
   end subroutine check_width

   !> Check that gravity acts along the direction of a wall with a weight at some time.
   pure subroutine check_weight(settings, load, instance, error)
      type(settings_t), intent(in) :: settings
      type(load_settings_t), intent(in) :: load
      type(instance_t), intent(in) :: instance
      type(error_t), allocatable, intent(inout) :: error
      logical :: acts(2)
      integer :: k

      if (.not. load%weight) return
      associate (forces => settings%forces)
         acts = abs(forces%gravity) > 0.0_wp
         do k = 1, size(settings%stage)
            if (size(settings%stage(k)%gravity) == 2) acts = acts .or. abs(settings%stage(k)%gravity) > 0.0_wp
         end do
         if (abs(forces%turn_rate) > 0.0_wp) acts = any(acts)
         acts = acts .or. abs(forces%shake) > 0.0_wp
      end associate
      if (load%direction == 'x' .and. acts(1) .or. load%direction == 'y' .and. acts(2)) return
      if (load%direction == 'angle' .and. any(acts)) return
      call blame(instance, 'weight', 'has no effect: gravity never acts along the direction of the load. Leave it '// &
                 'out, or change ''gravity'' in &forces', error)
   end subroutine check_weight

   !> Check that no load before it moves the wall along the direction of a load. The motions of the wall are checked
   !> when they are made (`polydem_assign_walls`).
   pure subroutine check_direction(settings, l, instance, error)
      type(settings_t), intent(in) :: settings
      !> Number of the load
      integer, intent(in) :: l
      type(instance_t), intent(in) :: instance
      type(error_t), allocatable, intent(inout) :: error
      integer :: k

      do k = 1, l - 1
         associate (load => settings%load(l), other => settings%load(k))
            if (other%wall /= load%wall .or. other%direction /= load%direction) cycle
            if (act_together([load%start, load%end], load%stage, [other%start, other%end], other%stage)) &
               call blame(instance, 'direction', 'is that of the load '//other%name//' of the same wall'// &
                          one_of_them, error)
         end associate
      end do
   end subroutine check_direction

   !> Whether two loads, or a load and a motion, act at the same time
   pure logical function act_together(times, stage, other_times, other_stage)
      !> Start and end of both; an end of 0 is none
      real(wp), intent(in) :: times(2), other_times(2)
      !> Names of their stages, empty without one
      character(len=*), intent(in) :: stage, other_stage

      act_together = (.not. other_times(2) > 0.0_wp .or. times(1) < other_times(2)) .and. &
                     (.not. times(2) > 0.0_wp .or. other_times(1) < times(2))
      if (stage /= '' .and. other_stage /= '') act_together = act_together .and. stage == other_stage
   end function act_together

end module polydem_check_loads
