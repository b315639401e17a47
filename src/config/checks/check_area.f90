!> Checks of rectangles: the area of the sample, and all rectangles in a periodic cell.
module polydem_check_area
   use polydem_blame_entry, only: blame
   use polydem_errors, only: error_t
   use polydem_group_instances, only: index_of_instance, instance_t
   use polydem_kinds, only: wp
   use polydem_settings, only: settings_t
   use polydem_strings, only: text_t, to_text
   implicit none
   private
   public :: check_area, check_rectangles

contains

   !> Check that the area of the sample has sides along both axes.
   pure subroutine check_area(settings, instances, error)
      !> Settings with all entries filled in
      type(settings_t), intent(in) :: settings
      !> All groups with their values, which contain the places for messages
      type(instance_t), intent(in) :: instances(:)
      !> First entry that contradicts another
      type(error_t), allocatable, intent(inout) :: error

      associate (sample => settings%sample, instance => instances(index_of_instance(instances, 'sample')))
         if (sample%area == 'rectangle' .and. .not. all(sample%low < sample%high)) call blame(instance, 'high', &
            'must exceed ''low'' along x and y', error)
         if (sample%area == 'walls') then
            call check_pair(sample%sides, 'sides', scan(settings%cell%periodic, 'x') > 0, instance, error)
            call check_pair(sample%ends, 'ends', scan(settings%cell%periodic, 'y') > 0, instance, error)
         end if
      end associate
   end subroutine check_area

   !> Check that no rectangle in which bodies enter, leave or are counted is longer than the periodic cell: it would
   !> have several copies of a body.
   pure subroutine check_rectangles(settings, instances, error)
      !> Settings with all entries filled in
      type(settings_t), intent(in) :: settings
      !> All groups with their values, which contain the places for messages
      type(instance_t), intent(in) :: instances(:)
      !> First rectangle that is too long
      type(error_t), allocatable, intent(inout) :: error
      integer :: k

      if (settings%cell%periodic == 'none') return
      do k = 1, size(settings%source)
         associate (source => settings%source(k))
            call check_length('source', source%name, source%low, source%high, error)
         end associate
      end do
      do k = 1, size(settings%sink)
         associate (sink => settings%sink(k))
            call check_length('sink', sink%name, sink%low, sink%high, error)
         end associate
      end do
      do k = 1, size(settings%stage)
         associate (stage => settings%stage(k))
            if (any(stage%until == [character(len=14) :: 'count', 'solid_fraction'])) &
               call check_length('stage', stage%name, stage%low, stage%high, error)
         end associate
      end do
      associate (sample => settings%sample)
         if (sample%area == 'rectangle') call check_length('sample', '', sample%low, sample%high, error)
      end associate

   contains

      !> Compare the sides of a rectangle with those of the cell.
      pure subroutine check_length(group, name, low, high, error)
         !> Group with the rectangle, and its name
         character(len=*), intent(in) :: group, name
         !> Corners of the rectangle [m]
         real(wp), intent(in) :: low(2), high(2)
         type(error_t), allocatable, intent(inout) :: error
         integer :: axis

         do axis = 1, 2
            if (scan(settings%cell%periodic, 'xy'(axis:axis)) == 0) cycle
            associate (period => settings%cell%size(axis))
               if (high(axis) - low(axis) <= 1.000001_wp*period) cycle
               call blame(instances(index_of_instance(instances, group, name)), 'high', 'makes the rectangle '// &
                  to_text(high(axis) - low(axis), 3)//' m long along '//'xy'(axis:axis)//', but the periodic cell '// &
                  'is only '//to_text(period, 3)//' m long, so it would have several copies of a body; make it at '// &
                  'most as long as the cell, which then means everywhere', error, 'low')
            end associate
         end do
      end subroutine check_length

   end subroutine check_rectangles

   !> Check the walls that bound the area along an axis.
   pure subroutine check_pair(names, key, is_periodic, instance, error)
      !> Names of the walls
      type(text_t), intent(in) :: names(:)
      !> Entry that has them
      character(len=*), intent(in) :: key
      !> Whether the cell is periodic along the axis
      logical, intent(in) :: is_periodic
      type(instance_t), intent(in) :: instance
      type(error_t), allocatable, intent(inout) :: error

      if (size(names) == 0 .and. is_periodic) return
      if (is_periodic) then
         call blame(instance, key, 'cannot be used in a cell that is periodic along this axis; leave it out', error)
      else if (size(names) /= 2) then
         call blame(instance, key, 'must name two walls, as in ''left'', ''right''', error)
      else if (names(1)%text == names(2)%text) then
         call blame(instance, key, 'names the same wall twice; it must name two walls, as in ''left'', ''right''', &
                    error)
      end if
   end subroutine check_pair

end module polydem_check_area
