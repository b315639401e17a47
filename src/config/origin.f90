!> Where settings come from: the base of the types that `make_entries.py` makes of the table of entries.
module polydem_origin
   use polydem_namelist_entries, only: first_row
   use polydem_strings, only: text_t
   implicit none
   private
   public :: origin_t, place_of

   !> Origin of settings
   type :: origin_t
      !> Path of the namelist file, for messages
      character(len=:), allocatable :: file
      !> Text of the namelist file, with a line end after each line
      character(len=:), allocatable :: text
      !> Every entry in use with its value, one per line, as namelist text
      character(len=:), allocatable :: resolved
      !> Where each entry was given, (rows of the table); not allocated in settings that no text gave
      type(text_t), allocatable :: places(:)
   end type origin_t

contains

   !> Where an entry was given, for the beginning of a message: file:line, --set group.key=value, or the file alone
   pure function place_of(settings, group, key) result(place)
      !> Settings of a run or a bench
      class(origin_t), intent(in) :: settings
      !> Namelist group
      character(len=*), intent(in) :: group
      !> Name in the group; the entry must exist
      character(len=*), intent(in) :: key
      character(len=:), allocatable :: place

      place = settings%file
      if (allocated(settings%places)) place = settings%places(first_row(group, key))%text
   end function place_of

end module polydem_origin
