!> Checks that involve two or more entries. The table of entries holds the checks of single entries.
module polydem_check_settings
   use polydem_check_shapes, only: check_ellipse
   use polydem_errors, only: error_t, input_error, raise
   use polydem_group_instances, only: index_of_instance, instance_t, row_of
   use polydem_kinds, only: lp, wp
   use polydem_settings, only: settings_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: check_settings

   !> Upper limit of the speed of a wall, as in the table of entries [m/s]
   real(wp), parameter :: speed_limit = 1.0e6_wp
   !> Upper limit of the length of a container in long axes of a grain. Longer containers need too much time to fill
   real(wp), parameter :: length_limit = 1.0e5_wp
   !> Upper limit of the number of corners of all polygons, of which half the range of integers can count
   integer(lp), parameter :: corner_limit = 2_lp**30
   !> What is said of entries beyond these two limits
   character(len=*), parameter :: too_long = 'must not exceed 1e5 times'
   character(len=*), parameter :: too_many = 'must not exceed 2^30 corners divided by'
   !> Upper limit of the ratio of the sides of a body. A polygon that is longer has hardly an area
   real(wp), parameter :: slenderness_limit = 1.0e6_wp
   !> What is said of entries beyond this limit, and of containers without room for a grain
   character(len=*), parameter :: too_slender = 'must not exceed 1e6 times', too_small = 'must be 0, or at least'
   !> What is said of an oscillation beyond the limit of the speed
   character(len=*), parameter :: too_fast = 'gives a speed of 1e6 m/s or more together with'
   !> What is said of a rotation in a periodic cell
   character(len=*), parameter :: no_rotation = 'cannot be ''rotation'' in a periodic cell, whose copies do not '// &
      'turn with it; use translation or oscillation'
   !> Angle of a full turn [rad]
   real(wp), parameter :: two_pi = 6.283185307179586_wp

   !> Scenes in which `width` is the width of the container; in other scenes it is the width of a block
   character(len=*), parameter :: grain_scenes(4) = [character(len=6) :: 'hopper', 'gas', 'bed', 'heap']
   !> Scenes in which it is the width of a block
   character(len=*), parameter :: block_scenes(2) = [character(len=7) :: 'incline', 'stack']

contains

   !> Check entries against each other.
   pure subroutine check_settings(settings, instances, error)
      !> Settings with all entries filled in
      type(settings_t), intent(in) :: settings
      !> All groups with their values, which contain the places for messages
      type(instance_t), intent(in) :: instances(:)
      !> First pair of contradictory entries
      type(error_t), allocatable, intent(inout) :: error

      call check_scene(settings, instances(index_of_instance(instances, 'scene')), error)
      call check_motions(settings, instances, error)
      call check_cell(settings, instances, error)
      associate (group => instances(index_of_instance(instances, 'forces')))
         call check_gravity(settings, group, error)
         call check_pressure(settings, group, error)
      end associate
      if (settings%output%csv .and. .not. settings%output%series_interval > 0.0_wp) then
         associate (group => instances(index_of_instance(instances, 'output')))
            call raise(error, input_error, group%values(row_of(group, 'csv'))%place// &
               ': ''csv'' in &output needs a series; give ''series_interval'', for example 1e-3')
         end associate
      end if
      if (settings%output%trace_steps > 0 .and. any(settings%wall%vanish_at > 0.0_wp)) then
         associate (group => instances(index_of_instance(instances, 'output')))
            call raise(error, input_error, group%values(row_of(group, 'trace_steps'))%place// &
               ': ''trace_steps'' in &output cannot be combined with ''vanish_at'' in &wall, because a trace has '// &
               'the same boxes in all steps')
         end associate
      end if
      if (settings%guards%energy /= 'off' .and. .not. settings%output%energy_balance) then
         associate (group => instances(index_of_instance(instances, 'guards')))
            call raise(error, input_error, group%values(row_of(group, 'energy'))%place// &
               ': ''energy'' in &guards needs ''energy_balance'' = .true. in &output')
         end associate
      end if
      if (settings%output%body_works .and. .not. settings%output%energy_balance) then
         associate (group => instances(index_of_instance(instances, 'output')))
            call raise(error, input_error, group%values(row_of(group, 'body_works'))%place// &
               ': ''body_works'' in &output needs ''energy_balance'' = .true.')
         end associate
      end if
   end subroutine check_settings

   !> Check the entries of gravity that changes.
   pure subroutine check_gravity(settings, group, error)
      type(settings_t), intent(in) :: settings
      !> The group &forces
      type(instance_t), intent(in) :: group
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: key

      associate (forces => settings%forces)
         if (any(abs(forces%shake) > 0.0_wp) .neqv. forces%shake_frequency > 0.0_wp) then
            key = 'shake'
            if (forces%shake_frequency > 0.0_wp) key = 'shake_frequency'
            call raise(error, input_error, group%values(row_of(group, key))%place// &
               ': ''shake'' and ''shake_frequency'' in &forces need each other; give both or none')
         end if
         if (abs(forces%turn_rate) > 0.0_wp .and. .not. any(abs(forces%gravity) > 0.0_wp) .and. &
             size(settings%stage) == 0) call raise(error, input_error, &
            group%values(row_of(group, 'turn_rate'))%place//': ''turn_rate'' in &forces turns gravity, which is '// &
            '0; give ''gravity'', for example 0, -9.81')
      end associate
   end subroutine check_gravity

   !> Check that the static pressure by which the stiffness is chosen is known once the bodies are placed.
   pure subroutine check_pressure(settings, group, error)
      type(settings_t), intent(in) :: settings
      !> The group &forces
      type(instance_t), intent(in) :: group
      type(error_t), allocatable, intent(inout) :: error
      logical :: sinks_in
      integer :: k

      if (.not. allocated(settings%forces%stiffness_over_pressure)) return
      sinks_in = any(settings%scene%name == ['incline', 'stack  '])
      do k = 1, size(settings%grains)
         sinks_in = sinks_in .or. settings%grains(k)%arrangement == 'column'
      end do
      if (sinks_in) call blame(group, 'stiffness_over_pressure', 'cannot be used with blocks that start as deep in '// &
         'each other as their stiffness lets them sink; give ''stiffness''', error)
      if (size(settings%source) > 0) call blame(group, 'stiffness_over_pressure', 'cannot be combined with '// &
         '&source, because the pressure of bodies that enter during the run is not known at its start; give '// &
         '''stiffness''', error)
   end subroutine check_pressure

   !> Check entries of &scene against each other.
   pure subroutine check_scene(settings, group, error)
      type(settings_t), intent(in) :: settings
      !> The group &scene
      type(instance_t), intent(in) :: group
      type(error_t), allocatable, intent(inout) :: error

      associate (scene => settings%scene, longest => length_limit*settings%scene%long_axis(2), &
                 most_corners => int(settings%scene%corners(2), lp))
         call check_ellipse(scene, group, error)
         ! Lengths and numbers are 0 if their entries are not in use.
         call require(scene%radius <= longest, too_long, 'radius', 'long_axis', group, error)
         call require(scene%opening <= longest, too_long, 'opening', 'long_axis', group, error)
         call require(scene%width <= longest .or. all(scene%name /= grain_scenes), &
            too_long, 'width', 'long_axis', group, error)
         call require(scene%width >= scene%short_axis .or. all(scene%name /= grain_scenes) .or. &
            .not. scene%width > 0.0_wp, too_small, 'width', 'short_axis', group, error)
         call require(scene%radius >= scene%short_axis .or. .not. scene%radius > 0.0_wp, &
            too_small, 'radius', 'short_axis', group, error)
         if (any(scene%name == block_scenes)) then
            call require(scene%width <= slenderness_limit*scene%height, too_slender, 'width', 'height', group, error)
            call require(scene%height <= slenderness_limit*scene%width, too_slender, 'height', 'width', group, error)
         end if
         call require(scene%bodies*most_corners <= corner_limit, too_many, 'bodies', 'corners', group, error)
         call require(scene%boxes*most_corners <= corner_limit, too_many, 'boxes', 'corners', group, error)
         call require(scene%moving_grains <= scene%bodies, 'must not exceed', 'moving_grains', 'bodies', group, error)
         call require(scene%size_ratio <= 1.0_wp .or. scene%packing == '', &
            'above 1 cannot be combined with', 'size_ratio', 'packing', group, error)
         call require(scene%size_ratio <= 1.0_wp .or. .not. scene%overlap, &
            'above 1 cannot be combined with', 'size_ratio', 'overlap', group, error)
         if (scene%name == 'drum') then
            call require(scene%boxes > 0 .or. scene%bodies > 0, &
               'is 0; give it, or give', 'boxes', 'bodies', group, error)
            call require(scene%boxes == 0 .or. scene%bodies == 0, &
               'cannot be combined with', 'boxes', 'bodies', group, error)
         end if
      end associate
   end subroutine check_scene

   !> Check the speeds of oscillations and the ends of motions.
   pure subroutine check_motions(settings, instances, error)
      type(settings_t), intent(in) :: settings
      type(instance_t), intent(in) :: instances(:)
      type(error_t), allocatable, intent(inout) :: error
      integer :: k

      do k = 1, size(settings%motion)
         associate (motion => settings%motion(k))
            call require( &
               two_pi*motion%frequency*maxval(abs(motion%amplitude)) < speed_limit, too_fast, 'amplitude', &
               'frequency', instances(index_of_instance(instances, 'motion', motion%name)), error)
            if (motion%end > 0.0_wp) call require( &
               motion%end > motion%start .and. motion%end - motion%start >= 2.0_wp*motion%ramp, &
               'must be behind ''start'' by at least twice', 'end', 'ramp', &
               instances(index_of_instance(instances, 'motion', motion%name)), error)
         end associate
      end do
   end subroutine check_motions

   !> Check what cannot be combined with a periodic cell.
   pure subroutine check_cell(settings, instances, error)
      type(settings_t), intent(in) :: settings
      type(instance_t), intent(in) :: instances(:)
      type(error_t), allocatable, intent(inout) :: error
      integer :: axis, k

      if (settings%cell%periodic == 'none') return
      do axis = 1, 2
         if (scan(settings%cell%periodic, 'xy'(axis:axis)) == 0 .or. settings%cell%size(axis) > 0.0_wp) cycle
         call blame(instances(index_of_instance(instances, 'cell')), 'size', &
            'must be positive along each periodic axis; for example size = 0.4, 0.4', error)
      end do
      associate (scene => instances(index_of_instance(instances, 'scene')))
         if (all(settings%scene%name /= [character(len=6) :: 'parts', 'file', 'result'])) call blame(scene, 'name', &
            'must be left out in a periodic cell, since recipes have walls around the grains; start from the '// &
            'groups &grains and &wall that check --expand prints, without these walls', error)
      end associate
      do k = 1, size(settings%motion)
         if (settings%motion(k)%kind == 'rotation') call blame( &
            instances(index_of_instance(instances, 'motion', settings%motion(k)%name)), 'kind', no_rotation, error)
      end do
      call check_parts_in_cell(settings, instances, error)
      if (settings%output%trace_steps > 0) call blame(instances(index_of_instance(instances, 'output')), &
         'trace_steps', 'must be 0 in a periodic cell, where the number of boxes changes', error)
      if (settings%cell%stress_controlled /= 'none') call check_stress_control(settings, instances, error)
   end subroutine check_cell

   !> Check that regions of grains and rows of fixed grains are not longer than the cell, whose copies would overlap.
   pure subroutine check_parts_in_cell(settings, instances, error)
      type(settings_t), intent(in) :: settings
      type(instance_t), intent(in) :: instances(:)
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: extent(2)
      integer :: k

      do k = 1, size(settings%grains)
         associate (group => settings%grains(k))
            extent = 0.0_wp
            select case (group%region)
            case ('box')
               extent = group%high - group%low
            case ('disc')
               extent = 2.0_wp*group%radius
            case ('polygon')
               if (size(group%vertices) >= 4) extent = [maxval(group%vertices(1::2)) - minval(group%vertices(1::2)), &
                                                        maxval(group%vertices(2::2)) - minval(group%vertices(2::2))]
            case default
               ! The region follows from a wall, or is a point.
            end select
            call check_length(extent, 'region', instances(index_of_instance(instances, 'grains', group%name)), error)
         end associate
      end do
      do k = 1, size(settings%wall)
         if (settings%wall(k)%outline == 'row') call check_length(abs(settings%wall(k)%to - settings%wall(k)%from), &
            'to', instances(index_of_instance(instances, 'wall', settings%wall(k)%name)), error)
      end do

   contains

      !> Compare lengths with those of the cell.
      pure subroutine check_length(length, key, instance, error)
         !> Length of the part along x and y [m]
         real(wp), intent(in) :: length(2)
         !> Entry that gives the length
         character(len=*), intent(in) :: key
         type(instance_t), intent(in) :: instance
         type(error_t), allocatable, intent(inout) :: error
         integer :: axis

         do axis = 1, 2
            associate (period => settings%cell%size(axis))
               if (scan(settings%cell%periodic, 'xy'(axis:axis)) == 0 .or. length(axis) <= 1.000001_wp*period) cycle
               call raise(error, input_error, instance%values(row_of(instance, key))%place//': '''//key//''' in &'// &
                  trim(instance%group)//' '//instance%name//': its length along '//'xy'(axis:axis)//' is '// &
                  to_text(length(axis), 3)//' m, but the periodic cell is only '//to_text(period, 3)// &
                  ' m long, so it would overlap its copies; make it at most as long as the cell (''size'' in &cell)')
            end associate
         end do
      end subroutine check_length

   end subroutine check_parts_in_cell

   !> Check what cannot be combined with a cell whose size is stress-controlled.
   pure subroutine check_stress_control(settings, instances, error)
      type(settings_t), intent(in) :: settings
      type(instance_t), intent(in) :: instances(:)
      type(error_t), allocatable, intent(inout) :: error
      integer :: k

      associate (cell => instances(index_of_instance(instances, 'cell')))
         if (abs(settings%cell%shear_rate) > 0.0_wp .and. scan(settings%cell%stress_controlled, 'x') > 0) &
            call blame(cell, 'stress_controlled', 'must be ''y'' in a sheared cell', error)
         do k = 1, 2
            if (scan(settings%cell%stress_controlled, 'xy'(k:k)) > 0) cycle
            if (.not. abs(settings%cell%stress(k)) > 0.0_wp) cycle
            call blame(cell, 'stress', 'must be 0 along '//'xy'(k:k)//', where the cell has a constant size; or '// &
                       'give stress_controlled = ''xy''', error)
         end do
         if (any(abs(settings%forces%gravity) > 0.0_wp)) call blame(cell, 'stress_controlled', &
            'needs gravity = 0, 0 in &forces, since a cell without walls falls with what it has', error)
         do k = 1, size(settings%stage)
            if (any(abs(settings%stage(k)%gravity) > 0.0_wp)) call blame(cell, 'stress_controlled', &
               'needs gravity = 0, 0 in all stages, since a cell without walls falls with what it has', error)
         end do
         if (size(settings%source) + size(settings%sink) > 0) call blame(cell, 'stress_controlled', &
            'cannot be combined with &source and &sink, whose regions do not move with the cell', error)
      end associate
   end subroutine check_stress_control

   !> Raise an error about an entry.
   pure subroutine blame(instance, key, text, error)
      type(instance_t), intent(in) :: instance
      character(len=*), intent(in) :: key
      !> What is wrong, as a predicate
      character(len=*), intent(in) :: text
      type(error_t), allocatable, intent(inout) :: error

      call raise(error, input_error, instance%values(row_of(instance, key))%place//': '''//key//''' in &'// &
         trim(instance%group)//' '//text)
   end subroutine blame

   !> Raise an error about two entries of a group if their relation does not hold. The error names the place of `key` if
   !> this entry is given, otherwise the place of `other`; of both, the place on the command line.
   pure subroutine require(holds, relation, key, other, group, error)
      logical, intent(in) :: holds
      character(len=*), intent(in) :: relation, key, other
      type(instance_t), intent(in) :: group
      type(error_t), allocatable, intent(inout) :: error
      integer :: row, second

      if (holds) return
      row = row_of(group, key)
      second = row_of(group, other)
      associate (values => group%values)
         if (.not. values(row)%is_given .or. (values(second)%is_override .and. .not. values(row)%is_override)) &
            row = second
      end associate
      call raise(error, input_error, group%values(row)%place//': '''//key//''' in &'//trim(group%group)//' '// &
         relation//' '''//other//'''')
   end subroutine require

end module polydem_check_settings
