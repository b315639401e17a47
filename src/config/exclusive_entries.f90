!> The two entries that set the damping in different ways, of which at most one may be given.
module polydem_exclusive_entries
   use polydem_errors, only: error_t, input_error, raise
   use polydem_kinds, only: wp
   use polydem_namelist_entries, only: entries, first_row
   use polydem_namelist_values, only: label, value_t
   implicit none
   private
   public :: resolve_exclusive_entries

contains

   !> Leave one of both entries in use: the damping coefficient if it is given, otherwise the restitution. An entry of
   !> the command line takes precedence over one of the file. The resolved text can then be read again.
   pure subroutine resolve_exclusive_entries(values, error)
      !> Values, (row of the table)
      type(value_t), intent(inout) :: values(:)
      !> Both entries are given
      type(error_t), allocatable, intent(inout) :: error
      integer :: special, usual
      logical :: use_special

      special = first_row('forces', 'restitution')
      usual = first_row('forces', 'damping_coefficient')
      if (.not. values(special)%is_active) return
      use_special = .not. values(usual)%is_given
      if (values(special)%is_given .and. values(usual)%is_given) then
         if (values(special)%is_override .eqv. values(usual)%is_override) then
            call raise(error, input_error, values(special)%place//': '//label(entries(special))// &
               ' cannot be combined with '//label(entries(usual))//'; give only one of them')
            return
         end if
         use_special = values(special)%is_override
      end if
      values(special)%is_active = use_special
      values(usual)%is_active = .not. use_special
      if (.not. use_special) values(special)%reals = 0.0_wp
   end subroutine resolve_exclusive_entries

end module polydem_exclusive_entries
