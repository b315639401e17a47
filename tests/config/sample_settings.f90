!> Short namelists for the tests of config; `|` is a line end.
module sample_settings
   use polydem_errors, only: error_t
   use polydem_read_settings, only: read_settings_text
   use polydem_settings, only: settings_t
   implicit none
   private
   public :: with_line_ends, message_of, override_message, settings_of, drum

   !> Shortest namelist of a run
   character(len=*), parameter :: drum = "&scene name = 'drum' bodies = 10 /|&integrate duration = 1 /"

contains

   !> The text with line ends in place of `|`
   function with_line_ends(text) result(changed)
      !> Text of any length
      character(len=*), intent(in) :: text
      character(len=len(text)) :: changed
      integer :: k

      changed = text
      do k = 1, len(text)
         if (text(k:k) == '|') changed(k:k) = new_line('a')
      end do
   end function with_line_ends

   !> Message of the input error of a namelist called t.nml; 'no error' if it is accepted
   function message_of(text) result(message)
      !> Namelist
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: message

      message = override_message(text, '')
   end function message_of

   !> Message of the input error of a namelist called t.nml with an override; 'no error' if they are accepted
   function override_message(text, override) result(message)
      !> Namelist
      character(len=*), intent(in) :: text
      !> Override; none if it is empty
      character(len=*), intent(in) :: override
      character(len=:), allocatable :: message
      type(settings_t) :: settings
      type(error_t), allocatable :: error

      if (override == '') then
         call read_settings_text('t.nml', with_line_ends(text), [character(len=1) ::], settings, error)
      else
         call read_settings_text('t.nml', with_line_ends(text), [override], settings, error)
      end if
      message = 'no error'
      if (.not. allocated(error)) return
      message = error%message
      if (error%code /= 2) message = message//' (not an input error)'
   end function override_message

   !> Settings of a namelist, with up to two overrides; the name is empty after an error
   function settings_of(text, first, second) result(settings)
      !> Namelist
      character(len=*), intent(in) :: text
      !> Overrides
      character(len=*), intent(in), optional :: first, second
      type(settings_t) :: settings
      type(error_t), allocatable :: error
      character(len=80) :: overrides(2)
      integer :: n

      n = 0
      overrides = ''
      if (present(first)) then
         n = 1
         overrides(1) = first
      end if
      if (present(second)) then
         n = 2
         overrides(2) = second
      end if
      call read_settings_text('t.nml', with_line_ends(text), overrides(:n), settings, error)
      if (allocated(error)) settings%file = error%message
      if (allocated(error)) settings%scene%name = ''
   end function settings_of

end module sample_settings
