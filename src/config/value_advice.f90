!> What a message adds about a value that cannot be read: what was probably meant.
module polydem_value_advice
   use polydem_namelist_entries, only: entries, entry_t
   use polydem_namelist_statements, only: statement_t
   use polydem_strings, only: lower_case, quoted
   implicit none
   private
   public :: advice, no_expression, number_beside, is_number, text_at, digits

   !> Decimal digits
   character(len=*), parameter :: digits = '0123456789'

contains

   !> Advice for a number with a unit or with a decimal comma, which reads as two values; otherwise empty
   pure function advice(entry, statement) result(text)
      !> Entry with a wrong number of values
      type(entry_t), intent(in) :: entry
      !> The values
      type(statement_t), intent(in) :: statement
      character(len=:), allocatable :: text

      text = ''
      if (.not. is_number(lower_case(statement%values(1)%text))) text = no_expression(statement%values(1)%text)
      if (text /= '') return
      if (index(entry%meaning, 'Smallest and largest') == 1 .and. size(statement%values) == 1) then
         if (is_number(lower_case(statement%values(1)%text))) text = ', the smallest and the largest; write '// &
            statement%values(1)%text//', '//statement%values(1)%text
      else if (entry%count /= 1 .or. size(statement%values) /= 2 .or. entry%type /= 'real') then
         return
      else if (statement%values(1)%is_repeated) then
         text = '; a number is no expression: 2*x stands for x, x'
      else if (is_number(lower_case(statement%values(2)%text))) then
         text = '; a number has a decimal point, no comma'
      else
         text = '; write the number alone'
         if (entry%unit /= '' .and. entry%unit /= '1') text = text//', in '//trim(entry%unit)
      end if
   end function advice

   !> Advice where an expression or a list in brackets stands in place of a number; otherwise empty
   pure function no_expression(given) result(text)
      !> What is given
      character(len=*), intent(in) :: given
      character(len=:), allocatable :: text

      text = ''
      if (scan(given, '[](){}') > 0) then
         text = '; numbers stand without brackets, with commas between them'
      else if (verify(given, digits//'.+-*eEdD') == 0 .and. scan(given, digits) > 0 .and. scan(given, '*+-') > 0) then
         text = '; a number is no expression: give its result'
      end if
   end function no_expression

   !> Advice where a number stands in place of a word: the number whose key begins alike; empty if there is none
   pure function number_beside(entry) result(text)
      !> Entry of type word
      type(entry_t), intent(in) :: entry
      character(len=:), allocatable :: text
      integer :: k

      text = ''
      do k = size(entries), 1, -1
         if (entries(k)%group == entry%group .and. entries(k)%type == 'real' .and. &
             index(entries(k)%key, trim(entry%key)//'_') == 1) text = '; its number is '//quoted(trim(entries(k)%key))
      end do
   end function number_beside

   !> Whether a text in lower case has the form [sign] digits [. digits] [e or d [sign] digits]. The digits on one side
   !> of the point may be absent.
   pure logical function is_number(text)
      !> Text in lower case
      character(len=*), intent(in) :: text
      integer :: k, n

      k = 1
      if (scan(text_at(text, 1), '+-') > 0) k = 2
      n = run_of_digits(text(k:))
      k = k + n
      if (text_at(text, k) == '.') then
         k = k + 1
         n = n + run_of_digits(text(k:))
         k = k + run_of_digits(text(k:))
      end if
      is_number = n > 0
      if (scan(text_at(text, k), 'ed') > 0) then
         k = k + 1
         if (scan(text_at(text, k), '+-') > 0) k = k + 1
         n = run_of_digits(text(k:))
         is_number = is_number .and. n > 0 .and. n < 6
         k = k + n
      end if
      is_number = is_number .and. k == len(text) + 1
   end function is_number

   !> Number of digits at the start of a text
   pure integer function run_of_digits(text)
      character(len=*), intent(in) :: text

      run_of_digits = verify(text//'.', digits) - 1
   end function run_of_digits

   !> Character at a position; blank behind the end of the text
   pure character(len=1) function text_at(text, place)
      !> The text
      character(len=*), intent(in) :: text
      !> Position, from 1
      integer, intent(in) :: place

      text_at = ' '
      if (place <= len(text)) text_at = text(place:place)
   end function text_at

end module polydem_value_advice
