!> Entries of which at most one of two may be given.
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

   !> Leave one entry of each pair in use: the damping coefficient if it is given, otherwise the restitution; the
   !> stiffness over the pressure if it is given, otherwise the stiffness. The resolved text can then be read again.
   pure subroutine resolve_exclusive_entries(instance, error)
      !> The group &forces with its values
      type(instance_t), intent(inout) :: instance
      !> Both entries of a pair are given
      type(error_t), allocatable, intent(inout) :: error
      integer :: row

      row = first_row('forces', 'restitution')
      if (instance%values(row)%is_active) then
         call choose_one(instance, row, first_row('forces', 'damping_coefficient'), error)
         if (allocated(error)) return
         if (.not. instance%values(row)%is_active) instance%values(row)%reals = 0.0_wp
      end if
      row = first_row('forces', 'stiffness_over_pressure')
      if (.not. instance%values(row)%is_active) return
      call choose_one(instance, first_row('forces', 'stiffness'), row, error)
      if (.not. instance%values(row)%is_active) instance%values(row)%reals = [real(wp) ::]
   end subroutine resolve_exclusive_entries

   !> Leave one of two entries in use: the second one if it is given, otherwise the first one. An entry of the command
   !> line takes precedence over one of the file.
   pure subroutine choose_one(instance, first, second, error)
      type(instance_t), intent(inout) :: instance
      !> Rows of the entries
      integer, intent(in) :: first, second
      type(error_t), allocatable, intent(inout) :: error
      logical :: use_first

      associate (usual => instance%values(first), special => instance%values(second))
         use_first = .not. special%is_given
         if (usual%is_given .and. special%is_given) then
            if (usual%is_override .eqv. special%is_override) then
               call raise(error, input_error, usual%place//': '//label(entries(first))//' cannot be combined with '// &
                  label(entries(second))//'; give only one of them')
               return
            end if
            use_first = usual%is_override
         end if
         usual%is_active = use_first
         special%is_active = .not. use_first
      end associate
   end subroutine choose_one

end module polydem_exclusive_entries
