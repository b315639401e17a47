!> The two entries that set the damping in different ways, of which at most one may be given.
module polydem_exclusive_entries
   use polydem_errors, only: error_t, input_error, raise
   use polydem_group_instances, only: instance_t
   use polydem_kinds, only: wp
   use polydem_namelist_entries, only: entries, first_row
   use polydem_namelist_values, only: label
   implicit none
   private
   public :: resolve_exclusive_entries

contains

   !> Leave one of both entries in use: the damping coefficient if it is given, otherwise the restitution. An entry of
   !> the command line takes precedence over one of the file. The resolved text can then be read again.
   pure subroutine resolve_exclusive_entries(instance, error)
      !> The group &forces with its values
      type(instance_t), intent(inout) :: instance
      !> Both entries are given
      type(error_t), allocatable, intent(inout) :: error
      integer :: other, row
      logical :: use_special

      row = first_row('forces', 'restitution')
      other = first_row('forces', 'damping_coefficient')
      associate (special => instance%values(row), usual => instance%values(other))
         if (.not. special%is_active) return
         use_special = .not. usual%is_given
         if (special%is_given .and. usual%is_given) then
            if (special%is_override .eqv. usual%is_override) then
               call raise(error, input_error, special%place//': '//label(entries(row))//' cannot be combined with '// &
                  label(entries(other))//'; give only one of them')
               return
            end if
            use_special = special%is_override
         end if
         special%is_active = use_special
         usual%is_active = .not. use_special
         if (.not. use_special) special%reals = 0.0_wp
      end associate
   end subroutine resolve_exclusive_entries

end module polydem_exclusive_entries
