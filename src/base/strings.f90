!> Text for messages and logs: numbers as text, safe display of untrusted text, lists of words, suggestions.
module polydem_strings
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use polydem_kinds, only: dp, ip, lp, wp
   implicit none
   private
   public :: to_text, decimal, counted, join, printable, text_t, lower_case, quoted, count_words, split_words, &
      suggestion, index_of

   !> Text of a number without blanks
   interface to_text
      module procedure text_ip, text_lp, text_wp
   end interface to_text

   !> A text of any length, for arrays of texts of different lengths
   type :: text_t
      !> The text
      character(len=:), allocatable :: text
   end type text_t

contains

   !> Text of a 32-bit integer
   pure function text_ip(number) result(text)
      !> Number to write
      integer(ip), intent(in) :: number
      character(len=:), allocatable :: text

      text = text_lp(int(number, lp))
   end function text_ip

   !> Text of a 64-bit integer
   pure function text_lp(number) result(text)
      !> Number to write
      integer(lp), intent(in) :: number
      character(len=:), allocatable :: text
      character(len=24) :: buffer

      write (buffer, '(i0)') number
      text = trim(buffer)
   end function text_lp

   !> A number of things in words, such as '1 step' or '2 steps'
   pure function counted(number, noun) result(text)
      !> Number of the things
      integer(lp), intent(in) :: number
      !> One of them; the plural has the suffix s
      character(len=*), intent(in) :: noun
      character(len=:), allocatable :: text

      text = to_text(number)//' '//noun
      if (number /= 1_lp) text = text//'s'
   end function counted

   !> Text of a real number in exponent form
   pure function text_wp(number, digits) result(text)
      !> Number to write
      real(wp), intent(in) :: number
      !> Significant digits, 6 if absent
      integer, intent(in), optional :: digits
      character(len=:), allocatable :: text
      character(len=64) :: buffer, form
      !> Binary exponents, less 2, above which a decimal exponent may have three and four digits
      integer, parameter :: longer_exponents(2) = [329, 3319]
      integer :: n, width

      n = 6
      if (present(digits)) n = digits
      width = 2
      if (ieee_is_finite(number)) width = 2 + count(abs(exponent(number) - 2) > longer_exponents)
      write (form, '(a,i0,a,i0,a,i0,a)') '(es', n + 7 + width, '.', n - 1, 'e', width, ')'
      write (buffer, form) number
      text = trim(adjustl(buffer))
   end function text_wp

   !> Number with the given count of decimal places
   pure function decimal(number, digits) result(text)
      !> Number to write
      real(dp), intent(in) :: number
      !> Decimal places
      integer, intent(in) :: digits
      character(len=:), allocatable :: text
      character(len=32) :: form, buffer

      write (form, '(a,i0,a)') '(f32.', digits, ')'
      write (buffer, form) number
      text = trim(adjustl(buffer))
   end function decimal

   !> Words joined by a separator
   pure function join(words, separator) result(text)
      !> Words; trailing blanks are dropped
      character(len=*), intent(in) :: words(:)
      !> Text between two words
      character(len=*), intent(in) :: separator
      character(len=:), allocatable :: text
      integer :: k

      text = ''
      do k = 1, size(words)
         if (k > 1) text = text//separator
         text = text//trim(words(k))
      end do
   end function join

   !> A text that is safe to show on a terminal. Printable UTF-8 characters are unchanged. Control characters and bytes
   !> that are not valid UTF-8 become \n, \r, \t or an escape like \x1b, with two hexadecimal digits per byte. Text from
   !> a file can therefore not move the cursor, change the window title or reverse the direction of writing.
   pure function printable(text, keeps_lines) result(shown)
      !> Untrusted text
      character(len=*), intent(in) :: text
      !> Whether line feeds are unchanged; false if absent
      logical, intent(in), optional :: keeps_lines
      character(len=:), allocatable :: shown
      character(len=:), allocatable :: buffer
      logical :: has_lines
      integer :: i, k, length, n

      has_lines = .false.
      if (present(keeps_lines)) has_lines = keeps_lines
      allocate (character(len=4*len(text)) :: buffer)
      n = 0
      k = 1
      do while (k <= len(text))
         length = safe_bytes(text(k:))
         if (has_lines .and. text(k:k) == new_line('a')) length = 1
         if (length > 0) then
            buffer(n + 1:n + length) = text(k:k + length - 1)
            n = n + length
            k = k + length
         else
            i = len(escaped(text(k:k)))
            buffer(n + 1:n + i) = escaped(text(k:k))
            n = n + i
            k = k + 1
         end if
      end do
      shown = buffer(:n)
   end function printable

   !> Number of bytes of the first character if it is safe to show, else 0 (The Unicode Standard 15, table 3-7)
   pure integer function safe_bytes(text) result(length)
      character(len=*), intent(in) :: text
      integer :: first, least, most, k, code

      first = iachar(text(1:1))
      length = 0
      if (first >= 32 .and. first < 127) length = 1
      if (first < 194 .or. first > 244) return
      length = 2
      if (first >= 224) length = 3
      if (first >= 240) length = 4
      least = 128
      most = 191
      ! Excluded: overlong forms, surrogates, and code points beyond U+10FFFF.
      if (first == 224) least = 160
      if (first == 237) most = 159
      if (first == 240) least = 144
      if (first == 244) most = 143
      code = iand(first, 127/2**length)
      do k = 2, length
         if (k > len(text)) then
            length = 0
         else if (iachar(text(k:k)) < least .or. iachar(text(k:k)) > most) then
            length = 0
         end if
         if (length == 0) return
         code = 64*code + iachar(text(k:k)) - 128
         least = 128
         most = 191
      end do
      if (is_control(code)) length = 0
   end function safe_bytes

   !> Whether a non-ASCII code point is a control: C1 controls, line separators, or directions of writing
   pure logical function is_control(code)
      integer, intent(in) :: code

      is_control = code < 160 .or. code == 1564 .or. code == 8206 .or. code == 8207 .or. &
         (code >= 8232 .and. code <= 8238) .or. (code >= 8294 .and. code <= 8297)
   end function is_control

   !> A byte as a visible escape sequence
   pure function escaped(byte) result(text)
      character(len=1), intent(in) :: byte
      character(len=:), allocatable :: text
      character(len=*), parameter :: digits = '0123456789abcdef'
      integer :: code

      code = iachar(byte)
      select case (code)
      case (9)
         text = '\t'
      case (10)
         text = '\n'
      case (13)
         text = '\r'
      case default
         text = '\x'//digits(code/16 + 1:code/16 + 1)//digits(mod(code, 16) + 1:mod(code, 16) + 1)
      end select
   end function escaped

   !> The text with the letters A to Z in lower case
   pure function lower_case(text) result(small)
      !> Text of any length
      character(len=*), intent(in) :: text
      character(len=len(text)) :: small
      integer, parameter :: shift = iachar('a') - iachar('A')
      integer :: k

      small = text
      do k = 1, len(text)
         if (text(k:k) >= 'A' .and. text(k:k) <= 'Z') small(k:k) = achar(iachar(text(k:k)) + shift)
      end do
   end function lower_case

   !> The text in single quotes, as in a namelist; quotes inside are doubled
   pure function quoted(text) result(literal)
      !> Text of any length
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: literal
      integer :: k, n

      allocate (character(len=2*len(text) + 2) :: literal)
      literal(1:1) = "'"
      n = 1
      do k = 1, len(text)
         if (text(k:k) == "'") then
            n = n + 1
            literal(n:n) = "'"
         end if
         n = n + 1
         literal(n:n) = text(k:k)
      end do
      literal = literal(:n)//"'"
   end function quoted

   !> Number of words in a text; blanks and commas separate words
   pure integer function count_words(text)
      !> Text of any length
      character(len=*), intent(in) :: text
      integer :: k

      count_words = 0
      do k = 1, len(text)
         if (scan(text(k:k), ' ,') > 0) cycle
         if (scan(text(k + 1:)//' ', ' ,') == 1) count_words = count_words + 1
      end do
   end function count_words

   !> The words of a text; blanks and commas separate words
   pure function split_words(text) result(words)
      !> Text of any length
      character(len=*), intent(in) :: text
      character(len=len(text)) :: words(count_words(text))
      integer :: first, k, last

      last = 0
      do k = 1, size(words)
         first = last + verify(text(last + 1:), ' ,')
         last = scan(text(first:)//' ', ' ,') + first - 2
         words(k) = text(first:last)
      end do
   end function split_words

   !> End of a message about an unknown word: the most similar candidate, or all candidates if none is similar.
   !>
   !> A candidate is similar if it contains the word, or if its edit distance is at most a third of the length of the
   !> word, rounded up. A letter that is missing, added or changed, or two swapped neighbours, count one.
   pure function suggestion(word, candidates) result(text)
      !> The unknown word
      character(len=*), intent(in) :: word
      !> The valid words
      character(len=*), intent(in) :: candidates(:)
      character(len=:), allocatable :: text
      character(len=len_trim(word)) :: small
      integer :: best, distance, k, near

      small = lower_case(trim(word))
      near = (len(small) + 2)/3 + 1
      best = 0
      do k = 1, size(candidates)
         ! The distance is at least the difference of the lengths. This test avoids large tables.
         distance = abs(len(small) - len_trim(candidates(k)))
         if (distance < near) distance = edit_distance(small, trim(candidates(k)))
         if (len(small) > 2 .and. index(candidates(k), small) > 0) distance = min(distance, 1)
         if (distance < near) then
            near = distance
            best = k
         end if
      end do
      if (best > 0) then
         text = '; did you mean '//quoted(trim(candidates(best)))//'?'
      else
         text = '; choose from '//join(candidates, ', ')
      end if
   end function suggestion

   !> Index of a word in a list; 0 if the list does not contain it
   pure integer function index_of(word, words)
      !> The word
      character(len=*), intent(in) :: word
      !> The list
      character(len=*), intent(in) :: words(:)

      do index_of = 1, size(words)
         if (words(index_of) == word) return
      end do
      index_of = 0
   end function index_of

   !> Smallest number of single-letter changes and swaps of neighbours that turn one word into the other
   pure integer function edit_distance(a, b)
      character(len=*), intent(in) :: a, b
      integer :: d(-1:len(a), -1:len(b)), i, j

      d = len(a) + len(b)
      d(0:, 0) = [(i, i=0, len(a))]
      d(0, 0:) = [(j, j=0, len(b))]
      do j = 1, len(b)
         do i = 1, len(a)
            d(i, j) = min(d(i - 1, j) + 1, d(i, j - 1) + 1, &
               d(i - 1, j - 1) + merge(0, 1, a(i:i) == b(j:j)))
            if (i > 1 .and. j > 1) then
               if (a(i - 1:i) == b(j:j)//b(j - 1:j - 1)) d(i, j) = min(d(i, j), d(i - 2, j - 2) + 1)
            end if
         end do
      end do
      edit_distance = d(len(a), len(b))
   end function edit_distance

end module polydem_strings
