!> Sums of real numbers without rounding, which therefore do not depend on the order of adding or on who adds what.
!>
!> The sum is a whole number of units of 2^-1074, the least double precision number, and is kept in digits of 32 bits
!> within words of 64 (U. Kulisch, Computer Arithmetic and Validity, de Gruyter 2013; the layout is the small
!> superaccumulator of R. M. Neal, arXiv:1505.05571, 2015). A number touches two digits only, and carries wait until the
!> spare bits are nearly used up. Sums of parts are combined by adding the digits element by element, after `carry`.
!>
!> In single and double precision sums are exact. A number of quadruple precision is taken apart into three of double
!> precision, which keeps all its bits as long as it is smaller than 2^1024, and its bits are not below 2^-1074: what is
!> below is cut off, and what is above counts as infinite.
module polydem_exact_sum
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_negative_inf, ieee_positive_inf, &
      ieee_quiet_nan, ieee_value
   use polydem_kinds, only: dp, lp, wp
   implicit none
   private
   public :: exact_sum_t, n_words

   !> Bits of a digit
   integer, parameter :: base_bits = 32
   !> Digits; the highest has a sign, and there is room for 2^63 numbers
   integer, parameter :: n_digits = 68
   !> Places that count what is not finite: infinities of either sign, and not-a-numbers
   integer, parameter :: plus_place = n_digits + 1, minus_place = n_digits + 2, nan_place = n_digits + 3
   !> Words of a sum
   integer, parameter :: n_words = n_digits + 3
   !> Numbers that may be added without carrying: each adds less than 2^52 to a digit
   integer, parameter :: most_waiting = 1024
   !> The unit is 2^unit_exponent
   integer, parameter :: unit_exponent = -1074
   !> Place of the last bit that a number of the working precision can have, in units
   integer, parameter :: last_place = max(0, minexponent(1.0_wp) - digits(1.0_wp) - unit_exponent)
   !> All bits of a digit
   integer(lp), parameter :: digit_mask = 2_lp**base_bits - 1_lp

   !> A sum; zero at first
   type :: exact_sum_t
      !> Digits from low to high, then the numbers of infinities above and below and of not-a-numbers, (n_words). Sums
      !> of parts may be added element by element when `carry` has been called for each
      integer(lp) :: digit(n_words) = 0_lp
      !> Numbers added since carries were last made
      integer, private :: waiting = 0
   contains
      !> Add a number, or another sum
      generic :: add => add_number, add_sum
      procedure :: carry
      procedure :: value => rounded
      procedure, private :: add_number, add_sum, rounded
   end type exact_sum_t

contains

   !> Add a number.
   pure subroutine add_number(self, number)
      class(exact_sum_t), intent(inout) :: self
      !> The number
      real(wp), intent(in) :: number
      real(wp) :: rest
      real(dp) :: part

      rest = number
      do
         part = real(rest, dp)
         call add_double(self, part)
         if (digits(1.0_wp) <= digits(1.0_dp) .or. .not. ieee_is_finite(part)) return
         if (.not. abs(part) > 0.0_dp) return
         rest = rest - real(part, wp)
      end do
   end subroutine add_number

   !> Add another sum.
   pure subroutine add_sum(self, other)
      class(exact_sum_t), intent(inout) :: self
      !> The other sum
      type(exact_sum_t), intent(in) :: other
      type(exact_sum_t) :: copy

      copy = other
      call copy%carry()
      call self%carry()
      self%digit = self%digit + copy%digit
      call self%carry()
   end subroutine add_sum

   !> Make carries, so that every digit but the highest is from 0 to 2^32 - 1: equal sums then have equal digits.
   pure subroutine carry(self)
      class(exact_sum_t), intent(inout) :: self
      integer(lp) :: carried
      integer :: k

      do k = 1, n_digits - 1
         carried = shifta(self%digit(k), base_bits)
         self%digit(k) = iand(self%digit(k), digit_mask)
         self%digit(k + 1) = self%digit(k + 1) + carried
      end do
      self%waiting = 0
   end subroutine carry

   !> The sum, rounded once, to the nearest number of the working precision; of two, to the even one.
   elemental real(wp) function rounded(self)
      class(exact_sum_t), intent(in) :: self
      type(exact_sum_t) :: amount
      logical :: is_negative

      if (self%digit(nan_place) > 0_lp .or. all(self%digit(plus_place:minus_place) > 0_lp)) then
         rounded = ieee_value(rounded, ieee_quiet_nan)
      else if (self%digit(plus_place) > 0_lp) then
         rounded = ieee_value(rounded, ieee_positive_inf)
      else if (self%digit(minus_place) > 0_lp) then
         rounded = ieee_value(rounded, ieee_negative_inf)
      else
         amount%digit = self%digit
         call amount%carry()
         is_negative = amount%digit(n_digits) < 0_lp
         if (is_negative) then
            amount%digit = -amount%digit
            call amount%carry()
         end if
         call round_digits(amount)
         rounded = real_of(amount)
         if (is_negative) rounded = -rounded
      end if
   end function rounded

   pure subroutine add_double(self, number)
      class(exact_sum_t), intent(inout) :: self
      real(dp), intent(in) :: number
      integer(lp) :: bits, mantissa, low, high
      integer :: exponent, k

      bits = transfer(number, 0_lp)
      mantissa = ibits(bits, 0, 52)
      exponent = int(ibits(bits, 52, 11))
      if (exponent == 0) then
         if (mantissa == 0_lp) return
         exponent = 1
      else if (exponent == 2047) then
         call add_infinite(self, mantissa, bits)
         return
      else
         mantissa = ibset(mantissa, 52)
      end if
      k = shiftr(exponent - 1, 5) + 1
      exponent = iand(exponent - 1, base_bits - 1)
      low = iand(shiftl(mantissa, exponent), digit_mask)
      high = shiftr(mantissa, base_bits - exponent)
      if (bits < 0_lp) then
         low = -low
         high = -high
      end if
      self%digit(k) = self%digit(k) + low
      self%digit(k + 1) = self%digit(k + 1) + high
      self%waiting = self%waiting + 1
      if (self%waiting == most_waiting) call self%carry()
   end subroutine add_double

   pure subroutine add_infinite(self, mantissa, bits)
      class(exact_sum_t), intent(inout) :: self
      !> Nought for infinities
      integer(lp), intent(in) :: mantissa
      !> Negative for that below
      integer(lp), intent(in) :: bits
      integer :: place

      place = nan_place
      if (mantissa == 0_lp) place = merge(minus_place, plus_place, bits < 0_lp)
      self%digit(place) = self%digit(place) + 1_lp
   end subroutine add_infinite

   !> Round a positive amount to as many bits as the working precision has.
   pure subroutine round_digits(amount)
      type(exact_sum_t), intent(inout) :: amount
      integer(lp) :: below
      integer :: last, k, shift
      logical :: up

      last = max(leading_place(amount) - digits(1.0_wp) + 1, last_place)
      if (last <= 0) return
      ! The first bit that goes decides, with those behind it, or that before it if there are none.
      k = (last - 1)/base_bits + 1
      shift = mod(last - 1, base_bits)
      up = btest(amount%digit(k), shift)
      below = iand(amount%digit(k), shiftl(1_lp, shift) - 1_lp)
      if (all(amount%digit(:k - 1) == 0_lp) .and. below == 0_lp) up = up .and. has_bit(amount, last)
      amount%digit(:k - 1) = 0_lp
      amount%digit(k) = amount%digit(k) - iand(amount%digit(k), shiftl(1_lp, shift + 1) - 1_lp)
      if (.not. up) return
      k = last/base_bits + 1
      amount%digit(k) = amount%digit(k) + shiftl(1_lp, mod(last, base_bits))
      call amount%carry()
   end subroutine round_digits

   !> An amount without a bit too many as a real number
   pure real(wp) function real_of(amount)
      type(exact_sum_t), intent(in) :: amount
      integer :: k

      real_of = 0.0_wp
      if (leading_place(amount) + unit_exponent >= maxexponent(1.0_wp)) then
         real_of = ieee_value(real_of, ieee_positive_inf)
         return
      end if
      do k = n_digits, 1, -1
         if (amount%digit(k) /= 0_lp) real_of = real_of &
            + scale(real(amount%digit(k), wp), base_bits*(k - 1) + unit_exponent)
      end do
   end function real_of

   !> Place of the highest bit of a positive amount, from 0; -1 for nought
   pure integer function leading_place(amount) result(place)
      type(exact_sum_t), intent(in) :: amount
      integer :: k

      place = -1
      do k = n_digits, 1, -1
         if (amount%digit(k) == 0_lp) cycle
         place = base_bits*(k - 1) + digits(0_lp) - leadz(amount%digit(k))
         return
      end do
   end function leading_place

   !> Whether an amount has the bit of a place
   pure logical function has_bit(amount, place)
      type(exact_sum_t), intent(in) :: amount
      integer, intent(in) :: place

      has_bit = btest(amount%digit(place/base_bits + 1), mod(place, base_bits))
   end function has_bit

end module polydem_exact_sum
