!> Numbers as text, and foreign texts without harm, for messages and logs.
module polydem_strings
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use polydem_kinds, only: ip, lp, wp
   implicit none
   private
   public :: to_text, join, printable

   !> Shortest sensible text of a number
   interface to_text
      module procedure text_ip, text_lp, text_wp
   end interface to_text

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

   !> Text of a real number in exponent form
   pure function text_wp(number, digits) result(text)
      !> Number to write
      real(wp), intent(in) :: number
      !> Significant digits, 6 if absent
      integer, intent(in), optional :: digits
      character(len=:), allocatable :: text
      character(len=64) :: buffer, form
      integer :: n

      n = 6
      if (present(digits)) n = digits
      write (form, '(a,i0,a,i0,a)') '(es', n + 9, '.', n - 1, ')'
      if (ieee_is_finite(number)) then
         if (abs(number) > 0.0_wp .and. (abs(number) < 1.0e-30_wp .or. abs(number) > 1.0e30_wp)) then
            write (form, '(a,i0,a,i0,a)') '(es', n + 11, '.', n - 1, 'e4)'
         end if
      end if
      write (buffer, form) number
      text = trim(adjustl(buffer))
   end function text_wp

   !> Words with a separator between them
   pure function join(words, separator) result(text)
      !> Words; trailing blanks are dropped
      character(len=*), intent(in) :: words(:)
      !> What goes between two words
      character(len=*), intent(in) :: separator
      character(len=:), allocatable :: text
      integer :: k

      text = ''
      do k = 1, size(words)
         if (k > 1) text = text//separator
         text = text//trim(words(k))
      end do
   end function join

   !> A text as it may be shown on a terminal: characters of UTF-8 stay, but control characters, and bytes that belong
   !> to no character, become \n, \r, \t or like \x1b, with two hexadecimal digits for each byte. So no text from a file
   !> can move the cursor, change a title, or turn the direction of what follows.
   pure function printable(text, keeps_lines) result(shown)
      !> Text from anywhere
      character(len=*), intent(in) :: text
      !> Whether ends of lines stay as they are; no if absent
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
         length = harmless_bytes(text(k:))
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

   !> Bytes of the first character of a text if it may be shown as it is, else 0 (The Unicode Standard 15, table 3-7)
   pure integer function harmless_bytes(text) result(length)
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
      ! No longer forms than needed, no halves of pairs, nothing beyond the last character.
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
   end function harmless_bytes

   !> Whether a character beyond ASCII controls how others are shown: C1, ends of lines, directions of writing
   pure logical function is_control(code)
      integer, intent(in) :: code

      is_control = code < 160 .or. code == 1564 .or. code == 8206 .or. code == 8207 .or. &
         (code >= 8232 .and. code <= 8238) .or. (code >= 8294 .and. code <= 8297)
   end function is_control

   !> A byte in visible letters
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

end module polydem_strings
