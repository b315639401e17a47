!> Where settings come from: the base of the types that `make_entries.py` makes of the table of entries.
module polydem_origin
   use polydem_namelist_entries, only: entries, first_row
   use polydem_strings, only: text_t
   implicit none
   private
   public :: origin_t, overrides_of, place_of

   !> Beginning of the place of an override of the command line
   character(len=*), parameter :: option = '--set '

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

   !> Overrides of a group on the command line, for the end of a message that says what follows from several entries:
   !> ' (with --set group.key=value, ...)'; empty if there are none
   pure function overrides_of(settings, group) result(text)
      !> Settings of a run or a bench
      class(origin_t), intent(in) :: settings
      !> Namelist group
      character(len=*), intent(in) :: group
      character(len=:), allocatable :: text
      integer :: row

      text = ''
      if (.not. allocated(settings%places)) return
      do row = 1, size(entries)
         if (entries(row)%group /= group .or. first_row(group, entries(row)%key) /= row) cycle
         associate (place => settings%places(row)%text)
            if (index(place, option) == 1) text = text//trim(merge(' (with', ',     ', text == ''))//' '//place
         end associate
      end do
      if (text /= '') text = text//')'
   end function overrides_of

end module polydem_origin
