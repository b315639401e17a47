!> Splits namelist text into tokens: group names, keys and values, quoted texts, `=`, `,` and `/`.
!>
!> The syntax is the part that Fortran compilers and f90nml have in common. A comment runs from `!` to the end of the
!> line. Blanks, tabs and line ends (also CR LF) separate tokens. A quoted text ends on the line on which it begins;
!> quotes inside it are doubled. Some editors put a byte order mark at the start of the text.
module polydem_namelist_tokens
   use polydem_errors, only: error_t, input_error, raise
   use polydem_strings, only: to_text, lower_case
   implicit none
   private
   public :: source_t, token_t, split_tokens
   public :: group_token, end_token, equals_token, comma_token, bare_token, quoted_token

   !> Kinds of tokens: `&name`; `/` or `&end`; `=`; `,`; text without quotes; text in quotes
   integer, parameter :: group_token = 1, end_token = 2, equals_token = 3
   integer, parameter :: comma_token = 4, bare_token = 5, quoted_token = 6

   character(len=*), parameter :: tab = achar(9), line_feed = achar(10), carriage_return = achar(13)
   !> Byte order mark of UTF-8
   character(len=*), parameter :: byte_order_mark = char(239)//char(187)//char(191)
   !> First two bytes of typographic quotes, single and double, in UTF-8
   character(len=*), parameter :: curly = char(226)//char(128)
   !> Last byte of the dashes that begin alike, and the minus sign of typography
   character(len=*), parameter :: last_of_dashes = char(144)//char(145)//char(146)//char(147)//char(148)//char(149)
   character(len=*), parameter :: typographic_minus = char(226)//char(136)//char(146)
   !> Characters that end a token without quotes
   character(len=*), parameter :: separators = ' '//tab//line_feed//carriage_return//'=,/!&''"'

   !> Namelist text and its origin
   type :: source_t
      !> Path of the file, or the command-line option
      character(len=:), allocatable :: name
      !> Namelist text
      character(len=:), allocatable :: text
      !> Whether messages contain the line number
      logical :: has_lines = .true.
   contains
      !> Place (file:line) of a line, for the start of a message
      procedure :: place
   end type source_t

   !> A token
   type :: token_t
      !> One of the kinds of tokens above
      integer :: kind = 0
      !> Position of the first and of the last character in the text. They exclude the `&` of a group and include the
      !> quotes of a quoted text
      integer :: first = 0, last = 0
      !> Line number, from 1
      integer :: line = 0
   end type token_t

contains

   !> `file:line`, or only the name if messages contain no line numbers
   pure function place(self, line) result(text)
      class(source_t), intent(in) :: self
      !> Line number, from 1
      integer, intent(in) :: line
      character(len=:), allocatable :: text

      text = self%name
      if (self%has_lines) text = text//':'//to_text(line)
   end function place

   !> Split the text into tokens.
   pure subroutine split_tokens(source, tokens, error)
      !> Text to split
      type(source_t), intent(in) :: source
      !> All tokens in the order of the text
      type(token_t), allocatable, intent(out) :: tokens(:)
      !> A quote without end, or a character that a namelist cannot contain
      type(error_t), allocatable, intent(inout) :: error
      type(token_t) :: token
      integer :: length, line, n, next

      length = len(source%text)
      allocate (tokens(length))
      n = 0
      line = 1
      next = 1
      if (index(source%text, byte_order_mark) == 1) next = 4
      do while (next <= length)
         select case (source%text(next:next))
         case (line_feed)
            line = line + 1
            next = next + 1
         case (' ', tab, carriage_return)
            next = next + 1
         case ('!')
            next = place_of_any(source%text, next, line_feed)
         case default
            call read_token(source, next, line, token, error)
            if (allocated(error)) return
            n = n + 1
            tokens(n) = token
            next = token%last + 1
         end select
      end do
      tokens = tokens(:n)
   end subroutine split_tokens

   !> Read the token that begins at a position.
   pure subroutine read_token(source, first, line, token, error)
      type(source_t), intent(in) :: source
      integer, intent(in) :: first, line
      type(token_t), intent(out) :: token
      type(error_t), allocatable, intent(inout) :: error

      token = token_t(bare_token, first, first, line)
      select case (source%text(first:first))
      case ('/')
         token%kind = end_token
      case ('=')
         token%kind = equals_token
      case (',')
         token%kind = comma_token
      case ('''', '"')
         token%kind = quoted_token
         token%last = end_of_quote(source%text, first)
      case ('&')
         token%kind = group_token
         token%first = first + 1
         token%last = end_of_bare(source%text, first + 1)
         if (lower_case(source%text(token%first:token%last)) == 'end') token%kind = end_token
      case default
         token%last = end_of_bare(source%text, first)
      end select
      if (token%kind == quoted_token .and. token%last == 0) then
         call raise(error, input_error, &
            source%place(line)//': a quote is not closed before the end of the line')
      else
         call refuse_characters(source, token, error)
      end if
   end subroutine read_token

   !> Position of the last character of a token without quotes; first - 1 if the token is empty
   pure integer function end_of_bare(text, first)
      character(len=*), intent(in) :: text
      integer, intent(in) :: first

      end_of_bare = place_of_any(text, first, separators) - 1
   end function end_of_bare

   !> Position of the first of the given letters, searched from `first`; len(text) + 1 if there is none
   pure integer function place_of_any(text, first, letters)
      character(len=*), intent(in) :: text, letters
      integer, intent(in) :: first

      place_of_any = first - 1 + scan(text(first:), letters)
      if (place_of_any < first) place_of_any = len(text) + 1
   end function place_of_any

   !> Position of the quote that closes the quote at `first`; 0 if the line has no closing quote
   pure integer function end_of_quote(text, first)
      character(len=*), intent(in) :: text
      integer, intent(in) :: first
      character(len=1) :: quote
      integer :: k

      quote = text(first:first)
      end_of_quote = 0
      k = first + 1
      do while (k <= len(text))
         if (text(k:k) == line_feed) return
         if (text(k:k) == quote) then
            if (k == len(text)) exit
            if (text(k + 1:k + 1) /= quote) exit
            k = k + 1
         end if
         k = k + 1
      end do
      if (k <= len(text)) end_of_quote = k
   end function end_of_quote

   !> Reject control characters in a token, characters beyond ASCII outside quotes, and signs of other formats.
   pure subroutine refuse_characters(source, token, error)
      type(source_t), intent(in) :: source
      type(token_t), intent(in) :: token
      type(error_t), allocatable, intent(inout) :: error
      integer :: code, k

      if (token%kind == bare_token .and. scan(source%text(token%first:token%last), '#') > 0) call raise(error, &
         input_error, source%place(token%line)//': # is not allowed here; a comment begins with !')
      if (source%text(token%last:token%last) == ':' .and. token%kind == bare_token) call raise(error, input_error, &
         source%place(token%line)//': the sign between a key and its value is =, not :')
      if (allocated(error)) return
      do k = token%first, token%last
         if (token%kind /= quoted_token .and. is_dash(source%text(k:min(k + 2, token%last)))) then
            call raise(error, input_error, source%place(token%line)//': a minus sign is the plain -, not the '// &
                       'dash or minus of typography that a text processor or a web page makes of it')
            return
         end if
         if (token%kind /= quoted_token .and. source%text(k:min(k + 1, token%last)) == curly) then
            call raise(error, input_error, source%place(token%line)//': a text is in straight quotes, '' or ", not '// &
                       'in typographic ones as a text processor makes them')
            return
         end if
         code = iachar(source%text(k:k))
         if ((code < 32 .and. source%text(k:k) /= tab) .or. code == 127 &
            .or. (token%kind /= quoted_token .and. code > 127)) then
            call raise(error, input_error, source%place(token%line)// &
               ': the character with code '//to_text(code)//' is not allowed here; is this a namelist file?')
            return
         end if
      end do
   end subroutine refuse_characters

   !> Whether three bytes are a dash or minus of typography
   pure logical function is_dash(bytes)
      character(len=*), intent(in) :: bytes

      is_dash = .false.
      if (len(bytes) < 3) return
      is_dash = bytes == typographic_minus .or. (bytes(:2) == curly .and. scan(bytes(3:), last_of_dashes) > 0)
   end function is_dash

end module polydem_namelist_tokens
