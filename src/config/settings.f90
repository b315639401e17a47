!> Settings of a run: one type per namelist group. They do not change after reading.
!>
!> The types of the groups and the defaults follow from `entries.txt`.
module polydem_settings
   use polydem_group_settings, only: boxes_settings_t, checkpoint_settings_t, decomposition_settings_t, &
      forces_settings_t, group_settings_t, guards_settings_t, integrate_settings_t, neighbours_settings_t, &
      output_settings_t, overlap_settings_t, scene_settings_t
   use polydem_namelist_entries, only: first_row
   use polydem_strings, only: text_t
   implicit none
   private
   public :: settings_t, scene_settings_t, boxes_settings_t, neighbours_settings_t, overlap_settings_t
   public :: place_of
   public :: forces_settings_t, integrate_settings_t, guards_settings_t, output_settings_t, checkpoint_settings_t
   public :: decomposition_settings_t

   !> All settings of a run: its groups, and where they come from
   type, extends(group_settings_t) :: settings_t
      !> Path of the namelist file, for messages
      character(len=:), allocatable :: file
      !> Text of the namelist file, with a line end after each line
      character(len=:), allocatable :: text
      !> Every entry in use with its value, one per line, as namelist text
      character(len=:), allocatable :: resolved
      !> Where each entry was given, (rows of the table); not allocated in settings that no text gave
      type(text_t), allocatable :: places(:)
   end type settings_t

contains

   !> Where an entry was given, for the beginning of a message: file:line, --set group.key=value, or the file alone
   pure function place_of(settings, group, key) result(place)
      type(settings_t), intent(in) :: settings
      !> Namelist group
      character(len=*), intent(in) :: group
      !> Name in the group; the entry must exist
      character(len=*), intent(in) :: key
      character(len=:), allocatable :: place

      place = settings%file
      if (allocated(settings%places)) place = settings%places(first_row(group, key))%text
   end function place_of

end module polydem_settings
