!> Values of namelist entries: conversion from text with the checks of the table of entries, and conversion to text.
module polydem_namelist_values
   use polydem_errors, only: error_t, input_error, raise
   use polydem_kinds, only: ip, lp, wp
   use polydem_namelist_entries, only: entry_t, required
   use polydem_namelist_statements, only: literal_t, statement_t
   use polydem_strings, only: to_text, counted, count_words, join, lower_case, quoted, split_words, suggestion, text_t
   use polydem_value_advice, only: advice, digits, is_number, no_expression, number_beside, text_at
   implicit none
   private
   public :: value_t, read_value, value_text, label, is_text, list_text, is_readable

   !> Characters of a name
   character(len=*), parameter :: name_characters = &
      'abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ_'//digits

   !> The value of an entry
   type :: value_t
      !> Place (file:line) of the value, for the start of a message; only the file for a default
      character(len=:), allocatable :: place
      !> Whether the value is given in the file or on the command line and is not the default
      logical :: is_given = .false.
      !> Whether the value comes from the command line
      logical :: is_override = .false.
      !> Whether the entry is in use: the chosen scene and options need it
      logical :: is_active = .false.
      !> Values of a real entry, (count)
      real(wp), allocatable :: reals(:)
      !> Values of an integer entry, (count)
      integer(ip), allocatable :: integers(:)
      !> Value of a logical entry
      logical :: flag = .false.
      !> Value of a word, path or name entry
      character(len=:), allocatable :: text
      !> Values of a word, path or name entry or of a list of them, (count)
      type(text_t), allocatable :: texts(:)
   end type value_t

contains

   !> Read the values of an entry and check them against its row.
   pure subroutine read_value(entry, statement, value, error)
      type(entry_t), intent(in) :: entry
      type(statement_t), intent(in) :: statement
      type(value_t), intent(inout) :: value
      !> Wrong number of values, wrong type, not finite, out of bounds, or no valid choice
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: problem
      integer :: k, n

      n = size(statement%values)
      value%place = statement%place
      value%is_override = statement%is_override
      value%is_given = statement%is_override .or. statement%line > 0
      if (entry%count > 0 .and. n /= entry%count) then
         call raise(error, input_error, value%place//': '//label(entry)//' takes '// &
            counted(int(entry%count, lp), 'value')//', but '//counted(int(n, lp), 'value')// &
            trim(merge(' is ', ' are', n == 1))//' given'//advice(entry, statement))
         return
      end if
      value%reals = [(0.0_wp, k=1, merge(n, 0, entry%type == 'real'))]
      value%integers = [(0_ip, k=1, merge(n, 0, entry%type == 'integer'))]
      value%text = ''
      if (allocated(value%texts)) deallocate (value%texts)
      allocate (value%texts(merge(n, 0, is_text(entry))))
      do k = 1, n
         call read_one(entry, statement%values(k), k, value, problem)
         if (allocated(problem)) then
            call raise(error, input_error, value%place//': '//label(entry)//' '//problem)
            return
         end if
      end do
   end subroutine read_value

   !> Name of an entry in messages
   pure function label(entry) result(text)
      type(entry_t), intent(in) :: entry
      character(len=:), allocatable :: text

      text = quoted(trim(entry%key))//' in &'//trim(entry%group)
   end function label

   !> Whether the values of an entry are words, paths or names
   pure logical function is_text(entry)
      type(entry_t), intent(in) :: entry

      is_text = any(entry%type == [character(len=4) :: 'word', 'path', 'name'])
   end function is_text

   !> Read value k of an entry.
   pure subroutine read_one(entry, literal, k, value, problem)
      type(entry_t), intent(in) :: entry
      type(literal_t), intent(in) :: literal
      integer, intent(in) :: k
      type(value_t), intent(inout) :: value
      character(len=:), allocatable, intent(out) :: problem

      select case (entry%type)
      case ('real')
         call read_real(literal, value%reals(k), problem)
         if (.not. allocated(problem)) call check_bounds(entry, literal, value%reals(k), problem)
      case ('integer')
         call read_integer(literal, value%integers(k), problem)
         if (.not. allocated(problem)) call check_bounds(entry, literal, real(value%integers(k), wp), problem)
      case ('logical')
         call read_logical(literal, value%flag, problem)
      case default
         value%text = trim(literal%text)
         value%texts(k)%text = trim(literal%text)
         call check_text(entry, literal, problem)
      end select
   end subroutine read_one

   !> Read a real number; `problem` is allocated if it is not one, not finite or out of range.
   pure subroutine read_real(literal, number, problem)
      type(literal_t), intent(in) :: literal
      real(wp), intent(out) :: number
      character(len=:), allocatable, intent(inout) :: problem
      character(len=len(literal%text)) :: text

      number = 0.0_wp
      text = lower_case(literal%text)
      if (literal%has_quotes .or. .not. (is_number(text) .or. is_not_finite(text))) then
         problem = 'must be a real number, but '//literal%as_written()//' is given'//no_expression(literal%text)
      else if (is_not_finite(text)) then
         problem = 'must be finite, but '//literal%text//' is given'
      else if (abs(magnitude(text)) > range(number)) then
         problem = 'must be within the range of this precision, but '//literal%text//' is given'
      else
         read (text, *) number
      end if
   end subroutine read_real

   !> Whether a text in lower case is a number whose reading neither overflows nor underflows
   pure logical function is_readable(text)
      character(len=*), intent(in) :: text

      is_readable = is_number(text)
      if (is_readable) is_readable = abs(magnitude(text)) <= range(1.0_wp)
   end function is_readable

   !> Whether a text in lower case is nan, inf or infinity, with or without a sign
   pure logical function is_not_finite(text)
      character(len=*), intent(in) :: text
      integer :: first

      first = 1 + merge(1, 0, scan(text_at(text, 1), '+-') > 0)
      is_not_finite = any(text(first:) == [character(len=8) :: 'nan', 'inf', 'infinity'])
   end function is_not_finite

   !> Decimal exponent of the leading digit of a number; 0 for zero
   pure integer function magnitude(text)
      character(len=*), intent(in) :: text
      integer :: exponent_mark, leading, point

      magnitude = 0
      exponent_mark = scan(text//'e', 'ed')
      leading = scan(text(:exponent_mark - 1), '123456789')
      if (leading == 0) return
      if (exponent_mark < len(text)) read (text(exponent_mark + 1:), *) magnitude
      point = index(text(:exponent_mark - 1)//'.', '.')
      magnitude = magnitude + point - leading - merge(1, 0, point > leading)
   end function magnitude

   !> Read an integer; `problem` is allocated if it is not one or too large.
   pure subroutine read_integer(literal, number, problem)
      type(literal_t), intent(in) :: literal
      integer(ip), intent(out) :: number
      character(len=:), allocatable, intent(inout) :: problem
      character(len=len(literal%text)) :: text
      integer(lp) :: wide

      number = 0_ip
      text = literal%text
      if (literal%has_quotes .or. .not. is_number(text) .or. scan(text, '.edED') > 0) then
         problem = 'must be an integer, but '//literal%as_written()//' is given'//no_expression(literal%text)
         return
      end if
      wide = huge(wide)
      if (magnitude(text) <= range(number)) read (text, *) wide
      if (abs(wide) <= huge(number)) then
         number = int(wide, ip)
      else
         problem = 'must be at most '//to_text(huge(number))//' in magnitude, but '//text//' is given'
      end if
   end subroutine read_integer

   !> Read a logical value; `problem` is allocated if it is not one.
   pure subroutine read_logical(literal, flag, problem)
      type(literal_t), intent(in) :: literal
      logical, intent(out) :: flag
      character(len=:), allocatable, intent(inout) :: problem

      flag = .false.
      if (.not. literal%has_quotes) then
         select case (lower_case(literal%text))
         case ('.true.', '.t.', 't', 'true')
            flag = .true.
            return
         case ('.false.', '.f.', 'f', 'false')
            return
         end select
      end if
      problem = 'must be .true. or .false., but '//literal%as_written()//' is given'
   end subroutine read_logical

   !> Check a number against bounds such as '>= 0, < 1'.
   pure subroutine check_bounds(entry, literal, number, problem)
      type(entry_t), intent(in) :: entry
      type(literal_t), intent(in) :: literal
      real(wp), intent(in) :: number
      character(len=:), allocatable, intent(inout) :: problem
      character(len=len(entry%allowed)) :: words(count_words(entry%allowed))
      real(wp) :: bound
      logical :: holds
      integer :: k

      words = split_words(entry%allowed)
      do k = 1, size(words), 2
         read (words(k + 1), *) bound
         select case (words(k))
         case ('>')
            holds = number > bound
         case ('>=')
            holds = number >= bound
         case ('<')
            holds = number < bound
         case default
            holds = number <= bound
         end select
         if (.not. holds) problem = 'must be '//trim(words(k))//' '//trim(words(k + 1))//', but '// &
            literal%text//' is given'
      end do
   end subroutine check_bounds

   !> Check that a text is in quotes, that a word is one of the choices, that a required path or name is not empty, and
   !> the characters of a name.
   pure subroutine check_text(entry, literal, problem)
      type(entry_t), intent(in) :: entry
      type(literal_t), intent(in) :: literal
      character(len=:), allocatable, intent(inout) :: problem

      if (entry%type == 'word' .and. is_number(lower_case(literal%text))) then
         problem = 'is one of the words '//join(split_words(entry%allowed), ', ')//', but '//literal%as_written()// &
            ' is given'//number_beside(entry)
      else if (.not. literal%has_quotes) then
         problem = 'must be in quotes: write '//quoted(literal%text)
      else if (entry%type /= 'word' .and. literal%text == '') then
         if (entry%default == required) problem = 'must not be empty'
      else if (entry%type == 'name') then
         if (verify(literal%text, name_characters) > 0) problem = 'cannot be '//literal%as_written()// &
            '; a name has only letters, digits and _'
      else if (entry%type == 'word' .and. all(split_words(entry%allowed) /= literal%text)) then
         problem = 'cannot be '//literal%as_written()//suggestion(literal%text, split_words(entry%allowed))
      end if
   end subroutine check_text

   !> A value in namelist syntax. Reading this text gives the same bits
   pure function value_text(entry, value) result(text)
      type(entry_t), intent(in) :: entry
      type(value_t), intent(in) :: value
      character(len=:), allocatable :: text
      type(text_t), allocatable :: words(:)
      integer :: k

      select case (entry%type)
      case ('real')
         text = list_text(value%reals)
         return
      case ('integer')
         allocate (words(size(value%integers)))
         do k = 1, size(words)
            words(k)%text = to_text(value%integers(k))
         end do
      case ('logical')
         allocate (words(1))
         words(1)%text = trim(merge('.true. ', '.false.', value%flag))
      case default
         allocate (words(size(value%texts)))
         do k = 1, size(words)
            words(k)%text = quoted(value%texts(k)%text)
         end do
      end select
      text = listed(words)
   end function value_text

   !> Numbers in namelist syntax, which reads back to the same bits
   pure function list_text(numbers) result(text)
      !> Numbers
      real(wp), intent(in) :: numbers(:)
      character(len=:), allocatable :: text
      type(text_t), allocatable :: words(:)
      integer :: k

      allocate (words(size(numbers)))
      do k = 1, size(words)
         words(k)%text = real_text(numbers(k))
      end do
      text = listed(words)
   end function list_text

   !> Words separated by commas; the cost is linear in their number
   pure function listed(words) result(text)
      type(text_t), intent(in) :: words(:)
      character(len=:), allocatable :: text
      integer :: k, n

      n = max(0, 2*(size(words) - 1))
      do k = 1, size(words)
         n = n + len(words(k)%text)
      end do
      allocate (character(len=n) :: text)
      n = 0
      do k = 1, size(words)
         if (k > 1) text(n + 1:n + 2) = ', '
         if (k > 1) n = n + 2
         text(n + 1:n + len(words(k)%text)) = words(k)%text
         n = n + len(words(k)%text)
      end do
   end function listed

   !> Shortest decimal text of a number that reads back to the same bits
   pure function real_text(number) result(text)
      real(wp), intent(in) :: number
      character(len=:), allocatable :: text
      character(len=64) :: buffer, form
      real(wp) :: again
      integer :: mark, n, power

      do n = 0, precision(number) + 3
         write (form, '(a,i0,a)') '(es60.', n, 'e4)'
         write (buffer, form) number
         read (buffer, *) again
         if (.not. abs(again - number) > 0.0_wp) exit
      end do
      buffer = adjustl(buffer)
      mark = scan(buffer, 'E')
      read (buffer(mark + 1:), *) power
      if (power < -4 .or. power > 6) then
         text = buffer(:mark - 1)//trim(merge('0', ' ', n == 0))//'e'//to_text(power)
      else
         write (form, '(a,i0,a)') '(f60.', max(1, n - power), ')'
         write (buffer, form) number
         text = trim(adjustl(buffer))
      end if
   end function real_text

end module polydem_namelist_values
