!> Numbers as text, for messages and logs.
module polydem_strings
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use polydem_kinds, only: ip, lp, wp
   implicit none
   private
   public :: to_text, join

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

end module polydem_strings
