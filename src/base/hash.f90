!> 64-bit hashes of a set of pairs (independent of their order) and of a sequence of integers.
!>
!> Arithmetic is modulo 2^64 on signed integers. Products are computed from 32-bit halves because signed overflow is
!> undefined in Fortran. The mixing function is the 64-bit finaliser of MurmurHash3 (A. Appleby, public domain).
module polydem_hash
   use polydem_kinds, only: ip, lp
   implicit none
   private
   public :: pair_hash, add_modulo, mix_word, hexadecimal

   integer(lp), parameter :: low_mask = int(z'FFFFFFFF', lp)
   integer(lp), parameter :: factor_1_high = int(z'FF51AFD7', lp)
   integer(lp), parameter :: factor_1_low = int(z'ED558CCD', lp)
   integer(lp), parameter :: factor_2_high = int(z'C4CEB9FE', lp)
   integer(lp), parameter :: factor_2_low = int(z'1A85EC53', lp)

contains

   !> Hash of one pair. The hash of a set of pairs is the sum modulo 2^64 of the hashes of its pairs.
   pure integer(lp) function pair_hash(i, j)
      !> Smaller index of the pair, counted from 0
      integer(ip), intent(in) :: i
      !> Larger index of the pair, counted from 0
      integer(ip), intent(in) :: j

      pair_hash = finalise(ior(shiftl(int(i, lp), 32), int(j, lp)))
   end function pair_hash

   !> Hash of a sequence extended by one word. The start value of a sequence is arbitrary.
   pure integer(lp) function mix_word(hash, word)
      !> Hash of the words so far
      integer(lp), intent(in) :: hash
      !> Next word
      integer(lp), intent(in) :: word

      mix_word = finalise(ieor(finalise(hash), word))
      mix_word = add_modulo(mix_word, hash)
   end function mix_word

   !> Sum modulo 2^64
   pure integer(lp) function add_modulo(a, b)
      !> First term
      integer(lp), intent(in) :: a
      !> Second term
      integer(lp), intent(in) :: b
      integer(lp) :: low, high

      low = iand(a, low_mask) + iand(b, low_mask)
      high = shiftr(a, 32) + shiftr(b, 32) + shiftr(low, 32)
      add_modulo = ior(shiftl(high, 32), iand(low, low_mask))
   end function add_modulo

   !> A hash as sixteen hexadecimal digits
   pure function hexadecimal(hash) result(text)
      !> Any 64 bits
      integer(lp), intent(in) :: hash
      character(len=16) :: text
      character(len=*), parameter :: digits = '0123456789abcdef'
      integer :: k, digit

      do k = 1, 16
         digit = int(iand(shiftr(hash, 4*(16 - k)), 15_lp))
         text(k:k) = digits(digit + 1:digit + 1)
      end do
   end function hexadecimal

   !> Mixing function: the 64-bit finaliser of MurmurHash3
   pure integer(lp) function finalise(word)
      integer(lp), intent(in) :: word

      finalise = ieor(word, shiftr(word, 33))
      finalise = multiply(finalise, factor_1_high, factor_1_low)
      finalise = ieor(finalise, shiftr(finalise, 33))
      finalise = multiply(finalise, factor_2_high, factor_2_low)
      finalise = ieor(finalise, shiftr(finalise, 33))
   end function finalise

   !> Product modulo 2^64 of `a` and the integer 2^32 high + low
   pure integer(lp) function multiply(a, high, low)
      integer(lp), intent(in) :: a, high, low
      integer(lp) :: a_low, a_high, cross

      a_low = iand(a, low_mask)
      a_high = shiftr(a, 32)
      cross = iand(add_modulo(half_product(a_high, low), half_product(a_low, high)), low_mask)
      multiply = add_modulo(half_product(a_low, low), shiftl(cross, 32))
   end function multiply

   !> Product modulo 2^64 of two integers below 2^32; the product may exceed 2^63
   pure integer(lp) function half_product(a, b)
      integer(lp), intent(in) :: a, b
      integer(lp) :: low, high

      low = iand(a, 65535_lp)*b
      high = shiftr(a, 16)*b
      half_product = add_modulo(low, shiftl(high, 16))
   end function half_product

end module polydem_hash
