!> Parser of namelist text. Its result is a list of statements: `&group` opens a group, `key = value, value` sets an
!> entry.
!>
!> This module checks only the syntax. `resolve_entries` checks the names of groups and keys.
module polydem_namelist_statements
   use polydem_errors, only: error_t, input_error, raise
   use polydem_namelist_tokens, only: source_t, token_t, split_tokens, &
      group_token, end_token, equals_token, comma_token, bare_token, quoted_token
   use polydem_strings, only: lower_case, quoted, to_text
   implicit none
   private
   public :: literal_t, statement_t, read_statements

   !> A value as written in the source text
   type :: literal_t
      !> Text of the value without the enclosing quotes
      character(len=:), allocatable :: text
      !> Whether the value is in quotes
      logical :: has_quotes = .false.
      !> Whether it is one of several that a repeat count makes, as in 3*0.5
      logical :: is_repeated = .false.
   contains
      !> The value as written, for messages
      procedure :: as_written
   end type literal_t

   !> The opening of a group, or a key with its values
   type :: statement_t
      !> Group in lower case
      character(len=:), allocatable :: group
      !> Key in lower case; empty if the statement opens a group
      character(len=:), allocatable :: key
      !> Values, (value); none if the statement opens a group
      type(literal_t), allocatable :: values(:)
      !> Place (file:line) of the statement, for the start of a message
      character(len=:), allocatable :: place
      !> Line number, from 1
      integer :: line = 0
      !> Whether the statement comes from the command line
      logical :: is_override = .false.
   end type statement_t

   !> Greatest repeat count of a value
   integer, parameter :: most_repeats = 10000

contains

   !> The value as written in the source text
   pure function as_written(self) result(text)
      class(literal_t), intent(in) :: self
      character(len=:), allocatable :: text

      text = self%text
      if (self%has_quotes) text = quoted(self%text)
   end function as_written

   !> Read all statements of a namelist text.
   pure subroutine read_statements(source, statements, error)
      !> Namelist text
      type(source_t), intent(in) :: source
      !> Statements in the order of the text
      type(statement_t), allocatable, intent(out) :: statements(:)
      !> First syntax error
      type(error_t), allocatable, intent(inout) :: error
      type(token_t), allocatable :: tokens(:)
      integer :: n, next, opening

      call split_tokens(source, tokens, error)
      if (allocated(error)) return
      allocate (statements(count(tokens%kind == group_token .or. tokens%kind == equals_token)))
      n = 0
      opening = 0
      next = 1
      do while (next <= size(tokens))
         select case (tokens(next)%kind)
         case (group_token)
            if (opening > 0) exit
            opening = next
            n = n + 1
            call open_group(source, tokens(next), statements(n))
            next = next + 1
         case (end_token)
            if (opening == 0) exit
            opening = 0
            next = next + 1
         case default
            if (opening == 0) exit
            call read_assignment(source, tokens, next, statements, n, error)
            if (allocated(error)) return
         end select
      end do

      if (opening > 0) then
         call raise(error, input_error, source%place(tokens(opening)%line)//': group &'// &
            statements(n)%group//' is not closed by ''/''')
      else if (next <= size(tokens)) then
         call raise(error, input_error, source%place(tokens(next)%line)//': '// &
            text_of(source, tokens(next))//' is outside a group; &name opens a group and / closes it'// &
            hint_of_quotes(tokens(:next), scan(text_of(source, tokens(next)), '0123456789.') == 1))
      end if
   end subroutine read_statements

   !> Hint if the last token follows a value and a slash on one line, as in a path without quotes
   pure function hint_of_quotes(tokens, is_number) result(hint)
      type(token_t), intent(in) :: tokens(:)
      !> Whether the last token begins as a number
      logical, intent(in) :: is_number
      character(len=:), allocatable :: hint

      hint = ''
      associate (n => size(tokens))
         if (n < 3) return
         if (any(tokens(n - 2:n)%line /= tokens(n)%line)) return
         if (tokens(n - 2)%kind /= bare_token .or. tokens(n - 1)%kind /= end_token) return
         hint = '; a value that contains / must be in quotes'
         if (tokens(n - 2)%last + 2 == tokens(n)%first .and. is_number) hint = hint// &
            ', and a number is no expression: give the result of a division'
      end associate
   end function hint_of_quotes

   !> Make the statement that opens a group.
   pure subroutine open_group(source, token, statement)
      type(source_t), intent(in) :: source
      type(token_t), intent(in) :: token
      type(statement_t), intent(inout) :: statement

      statement%group = lower_case(text_of(source, token))
      statement%key = ''
      allocate (statement%values(0))
      statement%line = token%line
      statement%place = source%place(token%line)
   end subroutine open_group

   !> Read `key = values` in the group of the last statement.
   pure subroutine read_assignment(source, tokens, next, statements, n, error)
      type(source_t), intent(in) :: source
      type(token_t), intent(in) :: tokens(:)
      integer, intent(inout) :: next
      type(statement_t), intent(inout) :: statements(:)
      integer, intent(inout) :: n
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: key, place
      integer :: last

      place = source%place(tokens(next)%line)
      key = text_of(source, tokens(next))
      if (scan(key, '(%') > 0) then
         call raise(error, input_error, &
            place//': '//key//' is a part of an entry; give all values of the entry')
      else if (tokens(next)%kind /= bare_token) then
         call raise(error, input_error, place//': a key is expected in &'//statements(n)%group//', but '// &
            key//' is found')
      else if (kind_at(tokens, next + 1) /= equals_token) then
         call raise(error, input_error, &
            place//': ''='' is expected after '//key//' in &'//statements(n)%group//trim(merge(', not :', '       ', &
                                                                                              scan(key, ':') > 0)))
      end if
      if (allocated(error)) return

      n = n + 1
      statements(n)%group = statements(n - 1)%group
      statements(n)%key = lower_case(key)
      statements(n)%line = tokens(next)%line
      statements(n)%place = place
      last = last_of_values(tokens, next + 2)
      call read_values(source, tokens(next + 2:last), statements(n), error)
      next = last + 1
   end subroutine read_assignment

   !> Index of the last token of a list of values. The list ends before the next key, group or end token.
   pure integer function last_of_values(tokens, first) result(last)
      type(token_t), intent(in) :: tokens(:)
      integer, intent(in) :: first

      last = first - 1
      do
         select case (kind_at(tokens, last + 1))
         case (bare_token, quoted_token)
            if (kind_at(tokens, last + 2) == equals_token) exit
            last = last + 1
         case (comma_token)
            last = last + 1
         case default
            exit
         end select
      end do
   end function last_of_values

   !> Kind of the token with an index; 0 behind the last token
   pure integer function kind_at(tokens, place)
      type(token_t), intent(in) :: tokens(:)
      integer, intent(in) :: place

      kind_at = 0
      if (place <= size(tokens)) kind_at = tokens(place)%kind
   end function kind_at

   !> Read values separated by a comma or blanks. A comma may follow the last value. As in Fortran 2*0.5 is 0.5, 0.5.
   pure subroutine read_values(source, tokens, statement, error)
      type(source_t), intent(in) :: source
      type(token_t), intent(in) :: tokens(:)
      type(statement_t), intent(inout) :: statement
      type(error_t), allocatable, intent(inout) :: error
      type(literal_t) :: literal
      type(token_t) :: token
      logical :: may_follow
      integer :: j, k, n, repeats(size(tokens))

      repeats = 0
      do k = 1, size(tokens)
         if (tokens(k)%kind /= comma_token) repeats(k) = repeats_of(text_of(source, tokens(k)))
         if (repeats(k) <= most_repeats) cycle
         call raise(error, input_error, statement%place//': '//text_of(source, tokens(k))// &
                    ' repeats a value more than '//to_text(most_repeats)//' times')
         return
      end do
      allocate (statement%values(sum(repeats)))
      n = 0
      may_follow = .false.
      do k = 1, size(tokens)
         if (tokens(k)%kind == comma_token) then
            if (.not. may_follow) exit
            may_follow = .false.
         else
            token = tokens(k)
            if (is_repeated(text_of(source, token))) token%first = token%first + index(text_of(source, token), '*')
            call read_literal(source, token, literal)
            literal%is_repeated = token%first > tokens(k)%first
            do j = n + 1, n + repeats(k)
               statement%values(j) = literal
            end do
            n = n + repeats(k)
            may_follow = .true.
         end if
      end do
      if (n == 0 .or. k <= size(tokens)) call raise(error, input_error, statement%place//': a value of '''// &
         statement%key//''' in &'//statement%group//' is missing')
   end subroutine read_values

   !> Whether a token begins with a repeat count, as in 3*0.5
   pure logical function is_repeated(text)
      character(len=*), intent(in) :: text
      integer :: star

      star = verify(text, '0123456789')
      is_repeated = .false.
      if (star > 1 .and. star < len(text)) is_repeated = text(star:star) == '*' .and. text(star + 1:star + 1) /= '*'
   end function is_repeated

   !> Number of values that a token stands for; more than `most_repeats` if there are too many
   pure integer function repeats_of(text) result(n)
      character(len=*), intent(in) :: text
      integer :: k

      n = 1
      if (.not. is_repeated(text)) return
      n = 0
      do k = 1, index(text, '*') - 1
         n = min(10*n + index('0123456789', text(k:k)) - 1, most_repeats + 1)
      end do
   end function repeats_of

   !> Read one value and remove its quotes.
   pure subroutine read_literal(source, token, literal)
      type(source_t), intent(in) :: source
      type(token_t), intent(in) :: token
      type(literal_t), intent(inout) :: literal
      character(len=:), allocatable :: inside
      integer :: k, n

      literal%has_quotes = token%kind == quoted_token
      literal%text = text_of(source, token)
      if (.not. literal%has_quotes) return
      inside = literal%text(2:len(literal%text) - 1)
      n = 0
      k = 1
      do while (k <= len(inside))
         n = n + 1
         literal%text(n:n) = inside(k:k)
         if (inside(k:k) == source%text(token%first:token%first)) k = k + 1
         k = k + 1
      end do
      literal%text = literal%text(:n)
   end subroutine read_literal

   !> Text of a token
   pure function text_of(source, token) result(text)
      type(source_t), intent(in) :: source
      type(token_t), intent(in) :: token
      character(len=:), allocatable :: text

      text = source%text(token%first:token%last)
   end function text_of

end module polydem_namelist_statements
