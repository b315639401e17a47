!> Errors about entries of groups.
module polydem_blame_entry
   use polydem_errors, only: error_t, input_error, raise
   use polydem_group_instances, only: instance_t, row_of
   use polydem_namelist_entries, only: entries, is_repeatable
   use polydem_strings, only: to_text
   implicit none
   private
   public :: blame

contains

   !> Raise an error about an entry of a group. It names the place of another entry if this one alone is given on the
   !> command line, and the line of the group if the entry is not given.
   pure subroutine blame(instance, key, problem, error, other)
      !> The group
      type(instance_t), intent(in) :: instance
      !> Key of the entry, and what is wrong, as a predicate
      character(len=*), intent(in) :: key, problem
      type(error_t), allocatable, intent(inout) :: error
      !> Key of the other entry
      character(len=*), intent(in), optional :: other
      character(len=:), allocatable :: place
      integer :: row

      row = row_of(instance, key)
      if (present(other)) then
         if (instance%values(row_of(instance, other))%is_override .and. .not. instance%values(row)%is_override) &
            row = row_of(instance, other)
      end if
      place = instance%values(row)%place
      if (instance%line > 0 .and. .not. (instance%values(row)%is_given .or. is_repeatable(entries, instance%group))) &
         place = place//':'//to_text(instance%line)
      call raise(error, input_error, place//': '''//key//''' in &'// &
                 trim(trim(instance%group)//' '//instance%name)//' '//problem)
   end subroutine blame

end module polydem_blame_entry
