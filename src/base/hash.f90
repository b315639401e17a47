!> 64-bit hashes of a set of pairs (independent of their order) and of a sequence of integers.
!>
!> Arithmetic is modulo 2^64 on signed integers. This file is compiled with -fwrapv, which makes it so: without it, the
!> compiler may assume that no sum or product overflows. The mixing function is the 64-bit finaliser of MurmurHash3
!> (A. Appleby, public domain).
module polydem_hash
   use polydem_kinds, only: ip, lp
   use polydem_pair_keys, only: pair_key
   implicit none
   private
   public :: pair_hash, add_modulo, mix_word, hexadecimal

   integer(lp), parameter :: factor_1 = ior(shiftl(int(z'FF51AFD7', lp), 32), int(z'ED558CCD', lp))
   integer(lp), parameter :: factor_2 = ior(shiftl(int(z'C4CEB9FE', lp), 32), int(z'1A85EC53', lp))

contains

   !> Hash of one pair. The hash of a set of pairs is the sum modulo 2^64 of the hashes of its pairs.
   pure integer(lp) function pair_hash(i, j)
      !> Smaller index of the pair, counted from 0
      integer(ip), intent(in) :: i
      !> Larger index of the pair, counted from 0
      integer(ip), intent(in) :: j

      pair_hash = finalise(pair_key(i, j))
   end function pair_hash

   !> Hash of a sequence extended by one word. The start value of a sequence is arbitrary.
   pure integer(lp) function mix_word(hash, word)
      !> Hash of the words so far
      integer(lp), intent(in) :: hash
      !> Next word
      integer(lp), intent(in) :: word

      mix_word = finalise(ieor(finalise(hash), word))
      mix_word = mix_word + hash
   end function mix_word

   !> Sum modulo 2^64
   pure integer(lp) function add_modulo(a, b)
      !> First term
      integer(lp), intent(in) :: a
      !> Second term
      integer(lp), intent(in) :: b

      add_modulo = a + b
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
      finalise = finalise*factor_1
      finalise = ieor(finalise, shiftr(finalise, 33))
      finalise = finalise*factor_2
      finalise = ieor(finalise, shiftr(finalise, 33))
   end function finalise

end module polydem_hash
