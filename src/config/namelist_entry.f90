!> A namelist entry: one row of the table of entries.
module polydem_namelist_entry
   implicit none
   private
   public :: entry_t, required, group_length, key_length, allowed_length

   !> Lengths of the character components of a row
   integer, parameter :: group_length = 13, key_length = 24, allowed_length = 300

   !> One row of the table
   type :: entry_t
      !> Namelist group
      character(len=group_length) :: group
      !> Key of the entry in its group
      character(len=key_length) :: key
      !> real, integer, logical, word (one of `allowed`), path (any text) or name (letters, digits and _)
      character(len=7) :: type
      !> Number of values; 0: a list, which is empty by default and has at least one value if given
      integer :: count
      !> Default in namelist syntax without quotes, or `required`
      character(len=20) :: default
      !> Unit; blank if dimensionless
      character(len=8) :: unit
      !> Choices of a word, bounds of a number such as '>= 0, < 1', or the group of which a name is one; blank: any
      !> (finite) value
      character(len=allowed_length) :: allowed
      !> Condition under which the entry is in use: 'key: word word' in the same group; blank: always
      character(len=160) :: needs
      !> Meaning in one sentence
      character(len=100) :: meaning
      !> Usual values of a real number, beyond which there is a warning, as alternatives such as '<= 5 or > 90'; those
      !> of further numbers behind a ' / '; blank: any. Zero is always usual
      character(len=60) :: usual = ''
      !> What may have been meant by an unusual value: the end of the warning
      character(len=120) :: meant = ''
   end type entry_t

   !> Default of an entry that must be given if it is in use
   character(len=*), parameter :: required = '(required)'

end module polydem_namelist_entry
