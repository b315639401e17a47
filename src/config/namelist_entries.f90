!> Table of namelist entries of runs, and what is in such a table. The reader, its checks and the manual use the table.
!>
!> A new entry is a row of `entries.txt`; afterwards the manual must be generated again (see `entries_manual`).
module polydem_namelist_entries
   use polydem_entry_table, only: entries
   use polydem_namelist_entry, only: allowed_length, entry_t, group_length, key_length, required
   use polydem_strings, only: count_words, split_words
   implicit none
   private
   public :: entry_t, entries, required, group_length, key_length, first_row, row_in, groups, is_repeatable, keys_of, &
      choices_of

contains

   !> First row of an entry of runs; 0 if the table does not contain it
   pure integer function first_row(group, key)
      !> Namelist group
      character(len=*), intent(in) :: group
      !> Key of the entry in its group
      character(len=*), intent(in) :: key

      first_row = row_in(entries, group, key)
   end function first_row

   !> First row of an entry; 0 if the table does not contain it
   pure integer function row_in(table, group, key)
      !> Table of entries
      type(entry_t), intent(in) :: table(:)
      !> Namelist group
      character(len=*), intent(in) :: group
      !> Key of the entry in its group
      character(len=*), intent(in) :: key

      do row_in = 1, size(table)
         if (table(row_in)%group == group .and. table(row_in)%key == key) return
      end do
      row_in = 0
   end function row_in

   !> Names of the groups in the order of the table
   pure function groups(table) result(names)
      !> Table of entries
      type(entry_t), intent(in) :: table(:)
      character(len=group_length), allocatable :: names(:)
      logical :: is_new(size(table))
      integer :: k

      do k = 1, size(table)
         is_new(k) = all(table(:k - 1)%group /= table(k)%group)
      end do
      names = pack(table%group, is_new)
   end function groups

   !> Whether a file may contain a group several times: its first entry is its name
   pure logical function is_repeatable(table, group)
      !> Table of entries
      type(entry_t), intent(in) :: table(:)
      !> Namelist group
      character(len=*), intent(in) :: group
      integer :: row

      is_repeatable = .false.
      do row = 1, size(table)
         if (table(row)%group /= group) cycle
         is_repeatable = table(row)%key == 'name' .and. table(row)%type == 'name'
         return
      end do
   end function is_repeatable

   !> Keys of the entries of a group in the order of the table, each key once
   pure function keys_of(table, group) result(names)
      !> Table of entries
      type(entry_t), intent(in) :: table(:)
      !> Namelist group
      character(len=*), intent(in) :: group
      character(len=key_length), allocatable :: names(:)
      logical :: is_new(size(table))
      integer :: k

      do k = 1, size(table)
         is_new(k) = table(k)%group == group .and. row_in(table, group, trim(table(k)%key)) == k
      end do
      names = pack(table%key, is_new)
   end function keys_of

   !> Choices of a word entry of runs, such as the names of the finders
   pure function choices_of(group, key) result(words)
      !> Namelist group
      character(len=*), intent(in) :: group
      !> Key of the entry in its group; the entry must exist
      character(len=*), intent(in) :: key
      character(len=allowed_length) :: words(count_words(entries(first_row(group, key))%allowed))

      words = split_words(entries(first_row(group, key))%allowed)
   end function choices_of

end module polydem_namelist_entries
