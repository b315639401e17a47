!> Row of the table of entries that holds the value of an entry.
module polydem_entry_row
   use polydem_namelist_entries, only: entries, first_row
   use polydem_namelist_values, only: value_t
   implicit none
   private
   public :: row_of

contains

   !> Row of the entry that is in use; the first row of the entry if none is in use
   pure integer function row_of(values, group, key) result(row)
      !> Values, (row of the table)
      type(value_t), intent(in) :: values(:)
      !> Namelist group, and name in the group; the entry must exist
      character(len=*), intent(in) :: group, key

      do row = first_row(group, key), size(entries)
         if (values(row)%is_active .and. entries(row)%group == group .and. entries(row)%key == key) return
      end do
      row = first_row(group, key)
   end function row_of

end module polydem_entry_row
