!> CRC-32 of a sequence of bytes, the checksum of gzip and PNG (`zlib.crc32` in Python; ISO 3309, polynomial 04C11DB7).
!>
!> Eight tables give the remainder of eight bytes at once (slicing by eight; Kounavis and Berry 2008). All arithmetic is
!> without carries. Words are little-endian, as on all machines that this program supports.
module polydem_crc32
   use polydem_hash, only: hexadecimal
   use polydem_kinds, only: ip, lp
   implicit none
   private
   public :: crc32_t, new_crc32, crc32_of

   !> Checksum of the bytes so far
   type :: crc32_t
      private
      !> Remainder of the division by the polynomial, lowest power in the highest bit
      integer(ip) :: remainder = -1_ip
      !> Remainder of each byte that is followed by 0 to 7 zero bytes, (byte, number)
      integer(ip) :: table(0:255, 0:7)
   contains
      procedure :: add
      procedure :: text => text_of
   end type crc32_t

   !> The polynomial without its highest power, lowest power in the highest bit
   integer(ip), parameter :: polynomial = ieor(not(0_ip), int(z'12477CDF', ip))

contains

   !> Checksum of no bytes
   pure type(crc32_t) function new_crc32() result(self)
      integer(ip) :: bit, byte, n

      do byte = 0_ip, 255_ip
         n = byte
         do bit = 1_ip, 8_ip
            n = ieor(shiftr(n, 1), merge(polynomial, 0_ip, btest(n, 0)))
         end do
         self%table(byte, 0) = n
      end do
      do n = 1_ip, 7_ip
         do byte = 0_ip, 255_ip
            associate (former => self%table(byte, n - 1_ip))
               self%table(byte, n) = ieor(shiftr(former, 8), self%table(iand(former, 255_ip), 0))
            end associate
         end do
      end do
   end function new_crc32

   !> Append bytes.
   pure subroutine add(self, words, bytes)
      class(crc32_t), intent(inout) :: self
      !> The bytes, eight in a word
      integer(lp), intent(in) :: words(:)
      !> Number of bytes
      integer(lp), intent(in) :: bytes
      integer(ip) :: high, low
      integer(lp) :: k

      associate (r => self%remainder, table => self%table)
         do k = 1_lp, bytes/8_lp
            low = ieor(r, int(ibits(words(k), 0, 32) - shiftl(ibits(words(k), 31, 1), 32), ip))
            high = int(shifta(words(k), 32), ip)
            r = ieor(ieor(ieor(table(ibits(low, 0, 8), 7), table(ibits(low, 8, 8), 6)), &
                          ieor(table(ibits(low, 16, 8), 5), table(ibits(low, 24, 8), 4))), &
                     ieor(ieor(table(ibits(high, 0, 8), 3), table(ibits(high, 8, 8), 2)), &
                          ieor(table(ibits(high, 16, 8), 1), table(ibits(high, 24, 8), 0))))
         end do
         do k = 0_lp, modulo(bytes, 8_lp) - 1_lp
            low = int(ibits(words(bytes/8_lp + 1_lp), int(8_lp*k), 8), ip)
            r = ieor(shiftr(r, 8), table(ieor(ibits(r, 0, 8), low), 0))
         end do
      end associate
   end subroutine add

   !> The checksum as eight hexadecimal digits
   pure function text_of(self) result(text)
      class(crc32_t), intent(in) :: self
      character(len=8) :: text
      character(len=16) :: digits

      digits = hexadecimal(int(not(self%remainder), lp))
      text = digits(9:)
   end function text_of

   !> Checksum of a text as eight hexadecimal digits
   pure function crc32_of(text) result(checksum)
      !> Text of any length
      character(len=*), intent(in) :: text
      character(len=8) :: checksum
      type(crc32_t) :: crc

      crc = new_crc32()
      call crc%add(transfer(text//repeat(' ', 8), [0_lp]), len(text, lp))
      checksum = crc%text()
   end function crc32_of

end module polydem_crc32
