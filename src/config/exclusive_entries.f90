!> Two entries that say the same thing in different ways: at most one of them is given.
module polydem_exclusive_entries
   use polydem_errors, only: error_t, input_error, raise
   use polydem_kinds, only: wp
   use polydem_namelist_entries, only: entries, first_row
   use polydem_namelist_values, only: label, value_t
   implicit none
   private
   public :: settle_exclusive_entries

contains

   !> Leave one entry of each couple in force, so that the resolved text can be read again.
   pure subroutine settle_exclusive_entries(values, error)
      !> Values, (rows of the table)
      type(value_t), intent(inout) :: values(:)
      !> Both are given
      type(error_t), allocatable, intent(inout) :: error

      call settle(first_row('forces', 'restitution'), first_row('forces', 'damping_coefficient'), values, error)
   end subroutine settle_exclusive_entries

   !> Of a number that replaces another if it is given, and that other, keep one; what the command line gives wins.
   pure subroutine settle(special, usual, values, error)
      integer, intent(in) :: special, usual
      type(value_t), intent(inout) :: values(:)
      type(error_t), allocatable, intent(inout) :: error
      logical :: wins

      if (.not. values(special)%in_force) return
      wins = values(special)%is_given
      if (wins .and. values(usual)%is_given) then
         if (values(special)%is_override .eqv. values(usual)%is_override) then
            call raise(error, input_error, values(special)%place//': '//label(entries(special))// &
               ' does not go with '//label(entries(usual))//'; give one of them')
            return
         end if
         wins = values(special)%is_override
      end if
      values(special)%in_force = wins
      values(usual)%in_force = .not. wins
      if (.not. wins) values(special)%reals = 0.0_wp
   end subroutine settle

end module polydem_exclusive_entries
