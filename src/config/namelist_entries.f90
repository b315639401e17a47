!> Table of namelist entries. The reader, its checks and the manual use this table.
!>
!> A new entry is a row of `entries.txt`; afterwards the manual must be generated again (see `entries_manual`).
module polydem_namelist_entries
   use polydem_entry_table, only: entries, repeatable_groups
   use polydem_namelist_entry, only: allowed_length, bench_group, entry_t, group_length, key_length, required
   use polydem_strings, only: count_words, split_words
   implicit none
   private
   public :: entry_t, entries, required, group_length, key_length, bench_group, first_row, groups, is_repeatable, &
      keys_of, choices_of

contains

   !> First row of an entry; 0 if the table does not contain it
   pure integer function first_row(group, key)
      !> Namelist group
      character(len=*), intent(in) :: group
      !> Key of the entry in its group
      character(len=*), intent(in) :: key

      do first_row = 1, size(entries)
         if (entries(first_row)%group == group .and. entries(first_row)%key == key) return
      end do
      first_row = 0
   end function first_row

   !> Names of the groups in the order of the table
   pure function groups() result(names)
      character(len=group_length), allocatable :: names(:)
      logical :: is_new(size(entries))
      integer :: k

      do k = 1, size(entries)
         is_new(k) = all(entries(:k - 1)%group /= entries(k)%group)
      end do
      names = pack(entries%group, is_new)
   end function groups

   !> Whether a file may contain a group several times, each time with another `name`
   pure logical function is_repeatable(group)
      !> Namelist group
      character(len=*), intent(in) :: group

      is_repeatable = any(repeatable_groups == group)
   end function is_repeatable

   !> Keys of the entries of a group in the order of the table, each key once
   pure function keys_of(group) result(names)
      !> Namelist group
      character(len=*), intent(in) :: group
      character(len=key_length), allocatable :: names(:)
      logical :: is_new(size(entries))
      integer :: k

      do k = 1, size(entries)
         is_new(k) = entries(k)%group == group .and. first_row(group, trim(entries(k)%key)) == k
      end do
      names = pack(entries%key, is_new)
   end function keys_of

   !> Choices of a word entry, such as the names of the finders
   pure function choices_of(group, key) result(words)
      !> Namelist group
      character(len=*), intent(in) :: group
      !> Key of the entry in its group; the entry must exist
      character(len=*), intent(in) :: key
      character(len=allowed_length) :: words(count_words(entries(first_row(group, key))%allowed))

      words = split_words(entries(first_row(group, key))%allowed)
   end function choices_of

end module polydem_namelist_entries
