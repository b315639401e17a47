!> Checks of the group &sample.
module polydem_check_area
   use polydem_blame_entry, only: blame
   use polydem_errors, only: error_t
   use polydem_group_instances, only: index_of_instance, instance_t
   use polydem_settings, only: settings_t
   use polydem_strings, only: text_t
   implicit none
   private
   public :: check_area

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
