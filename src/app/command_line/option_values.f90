!> Values of options of the command line: counts and durations.
module polydem_option_values
   use polydem_errors, only: error_t, input_error, raise
   implicit none
   private
   public :: read_count, read_duration

contains

   !> Read an integer from 1 to 999999.
   pure subroutine read_count(name, text, number, error)
      !> Name of the option, and its value
      character(len=*), intent(in) :: name, text
      !> The number; unchanged if the value is none
      integer, intent(inout) :: number
      !> Allocated if the value is none
      type(error_t), allocatable, intent(inout) :: error
      integer :: read_number

      read_number = 0
      if (verify(text, '0123456789') == 0 .and. len(text) < 7) read (text, *) read_number
      if (read_number > 0) then
         number = read_number
      else
         call raise(error, input_error, name//' '//text//': an integer from 1 to 999999 was expected')
      end if
   end subroutine read_count

   !> Read a duration HH:MM:SS as seconds.
   pure subroutine read_duration(name, text, seconds, error)
      !> Name of the option, and its value
      character(len=*), intent(in) :: name, text
      !> The duration [s]; unchanged if the value is none
      integer, intent(inout) :: seconds
      !> Allocated if the value is none
      type(error_t), allocatable, intent(inout) :: error
      integer :: colon, hours, minutes, rest
      logical :: good

      colon = index(text, ':')
      good = len(text) == colon + 5 .and. colon > 1 .and. colon <= 6
      if (good) good = verify(text(:colon - 1)//text(colon + 1:colon + 2)//text(colon + 4:), '0123456789') == 0 &
         .and. text(colon + 3:colon + 3) == ':'
      if (good) then
         read (text(:colon - 1), *) hours
         read (text(colon + 1:colon + 2), *) minutes
         read (text(colon + 4:), *) rest
         good = minutes < 60 .and. rest < 60 .and. hours + minutes + rest > 0
      end if
      if (good) seconds = 3600*hours + 60*minutes + rest
      if (.not. good) call raise(error, input_error, name//' '//text//': hours, minutes and seconds were expected, '// &
         'as in 23:30:00')
   end subroutine read_duration

end module polydem_option_values
