!> Where settings come from: the base of the types that `make_entries.py` makes of the table of entries.
module polydem_source_locations
   use polydem_strings, only: text_t
   implicit none
   private
   public :: source_locations_t, overrides_of, place_of

   !> Beginning of the place of an override of the command line
   character(len=*), parameter :: option = '--set '

   !> Where an entry was given
   type :: entry_place_t
      !> Group and key; a repeatable group with its name, such as 'motion.turn'
      character(len=:), allocatable :: group, key
      !> Beginning of a message: file:line, --set group.key=value, or the file alone
      character(len=:), allocatable :: place
   end type entry_place_t

   !> Origin of settings
   type :: source_locations_t
      !> Path of the namelist file, for messages
      character(len=:), allocatable :: file
      !> Text of the namelist file, with a line end after each line
      character(len=:), allocatable :: text
      !> Every entry in use with its value, one per line, as namelist text
      character(len=:), allocatable :: resolved
      !> Those of these entries that the file or the command line gives, likewise
      character(len=:), allocatable :: given
      !> Where each entry was given, (any); not allocated in settings that no text gave
      type(entry_place_t), allocatable :: places(:)
      !> A warning about each given value that is unusual, (any); not allocated in settings that no text gave
      type(text_t), allocatable :: unusual(:)
   end type source_locations_t

contains

   !> Where an entry was given, for the beginning of a message: file:line, --set group.key=value, or the file alone
   pure function place_of(settings, group, key) result(place)
      !> Settings of a run or a bench
      class(source_locations_t), intent(in) :: settings
      !> Namelist group; a repeatable group with its name, such as 'motion.turn'
      character(len=*), intent(in) :: group
      !> Key in the group
      character(len=*), intent(in) :: key
      character(len=:), allocatable :: place
      integer :: k

      place = settings%file
      if (.not. allocated(settings%places)) return
      do k = 1, size(settings%places)
         if (settings%places(k)%group == group .and. settings%places(k)%key == key) place = settings%places(k)%place
      end do
   end function place_of

   !> Overrides of a group on the command line, for the end of a message that says what follows from several entries:
   !> ' (with --set group.key=value, ...)'; empty if there are none
   pure function overrides_of(settings, group) result(text)
      !> Settings of a run or a bench
      class(source_locations_t), intent(in) :: settings
      !> Namelist group; with all of its names if it is repeatable and the name is not given
      character(len=*), intent(in) :: group
      character(len=:), allocatable :: text
      integer :: k

      text = ''
      if (.not. allocated(settings%places)) return
      do k = 1, size(settings%places)
         if (index(settings%places(k)%group//'.', group//'.') /= 1) cycle
         associate (place => settings%places(k)%place)
            if (index(place, option) == 1) text = text//trim(merge(' (with', ',     ', text == ''))//' '//place
         end associate
      end do
      if (text /= '') text = text//')'
   end function overrides_of

end module polydem_source_locations
