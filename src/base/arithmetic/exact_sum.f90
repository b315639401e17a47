!> Sums of real numbers without rounding errors. The result does not depend on the order of the terms or on their
!> distribution over threads and ranks.
!>
!> The sum is an integer multiple of 2^-1074, the smallest double precision number. It is stored in digits of 32 bits
!> within words of 64 bits (U. Kulisch, Computer Arithmetic and Validity, de Gruyter 2013; the layout is the small
!> superaccumulator of R. M. Neal, arXiv:1505.05571, 2015). Adding a number changes only two digits. Carries are
!> deferred until the spare bits are nearly used up. Partial sums are combined by adding their digits element by
!> element, after `carry` of each.
!>
!> Sums are exact in single and double precision. A number of quadruple precision is split into three numbers of double
!> precision. The split is exact if the number is smaller than 2^1024 and has no bits below 2^-1074. Lower bits are
!> dropped, and larger numbers count as infinite.
module polydem_exact_sum
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_negative_inf, ieee_positive_inf, &
      ieee_quiet_nan, ieee_value
   use polydem_kinds, only: dp, lp, wp
   implicit none
   private
   public :: exact_sum_t, n_words

   !> Bits of a digit
   integer, parameter :: base_bits = 32
   !> Number of digits. The highest digit has a sign. There is room for 2^63 numbers
   integer, parameter :: n_digits = 68
   !> Indices of the words that count non-finite terms: +infinity, -infinity and NaN
   integer, parameter :: plus_index = n_digits + 1, minus_index = n_digits + 2, nan_index = n_digits + 3
   !> Number of words of a sum
   integer, parameter :: n_words = n_digits + 3
   !> Maximum number of additions between two carries: each adds less than 2^52 to a digit
   integer, parameter :: max_deferred = 1024
   !> Bit 0 of the sum has the value 2^unit_exponent
   integer, parameter :: unit_exponent = -1074
   !> Position of the lowest bit that a number of the working precision can have
   integer, parameter :: lowest_bit = max(0, minexponent(1.0_wp) - digits(1.0_wp) - unit_exponent)
   !> Mask of all bits of a digit
   integer(lp), parameter :: digit_mask = 2_lp**base_bits - 1_lp

   !> A sum, initially zero
   type :: exact_sum_t
      !> Digits from low to high, then the counts of +infinity, -infinity and NaN, (n_words). Partial sums may be added
      !> element by element after `carry` has been called for each of them
      integer(lp) :: digit(n_words) = 0_lp
      !> Number of additions since the last `carry`
      integer, private :: n_deferred = 0
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

   !> Propagate carries. Afterwards every digit but the highest is in [0, 2^32 - 1], and equal sums have equal digits.
   pure subroutine carry(self)
      class(exact_sum_t), intent(inout) :: self
      integer(lp) :: carried
      integer :: k

      do k = 1, n_digits - 1
         carried = shifta(self%digit(k), base_bits)
         self%digit(k) = iand(self%digit(k), digit_mask)
         self%digit(k + 1) = self%digit(k + 1) + carried
      end do
      self%n_deferred = 0
   end subroutine carry

   !> The sum, rounded once to the nearest number of the working precision; ties go to the even number
   elemental real(wp) function rounded(self)
      class(exact_sum_t), intent(in) :: self
      type(exact_sum_t) :: amount
      logical :: is_negative

      if (self%digit(nan_index) > 0_lp .or. all(self%digit(plus_index:minus_index) > 0_lp)) then
         rounded = ieee_value(rounded, ieee_quiet_nan)
      else if (self%digit(plus_index) > 0_lp) then
         rounded = ieee_value(rounded, ieee_positive_inf)
      else if (self%digit(minus_index) > 0_lp) then
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

   !> Add a double precision number.
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
      self%n_deferred = self%n_deferred + 1
      if (self%n_deferred == max_deferred) call self%carry()
   end subroutine add_double

   !> Count a non-finite number.
   pure subroutine add_infinite(self, mantissa, bits)
      class(exact_sum_t), intent(inout) :: self
      !> Zero for infinities, else the number is NaN
      integer(lp), intent(in) :: mantissa
      !> Bits of the number; negative for -infinity
      integer(lp), intent(in) :: bits
      integer :: place

      place = nan_index
      if (mantissa == 0_lp) place = merge(minus_index, plus_index, bits < 0_lp)
      self%digit(place) = self%digit(place) + 1_lp
   end subroutine add_infinite

   !> Round a positive sum to the number of bits of the working precision.
   pure subroutine round_digits(amount)
      type(exact_sum_t), intent(inout) :: amount
      integer(lp) :: below
      integer :: last, k, shift
      logical :: up

      last = max(highest_bit(amount) - digits(1.0_wp) + 1, lowest_bit)
      if (last <= 0) return
      ! The highest dropped bit decides. In a tie (no lower bit is set), the lowest kept bit decides.
      k = (last - 1)/base_bits + 1
      shift = mod(last - 1, base_bits)
      up = btest(amount%digit(k), shift)
      below = iand(amount%digit(k), shiftl(1_lp, shift) - 1_lp)
      if (all(amount%digit(:k - 1) == 0_lp) .and. below == 0_lp) up = &
         up .and. btest(amount%digit(last/base_bits + 1), mod(last, base_bits))
      amount%digit(:k - 1) = 0_lp
      amount%digit(k) = amount%digit(k) - iand(amount%digit(k), shiftl(1_lp, shift + 1) - 1_lp)
      if (.not. up) return
      k = last/base_bits + 1
      amount%digit(k) = amount%digit(k) + shiftl(1_lp, mod(last, base_bits))
      call amount%carry()
   end subroutine round_digits

   !> A positive sum, already rounded, as a real number
   pure real(wp) function real_of(amount)
      type(exact_sum_t), intent(in) :: amount
      integer :: k

      real_of = 0.0_wp
      if (highest_bit(amount) + unit_exponent >= maxexponent(1.0_wp)) then
         real_of = ieee_value(real_of, ieee_positive_inf)
         return
      end if
      do k = n_digits, 1, -1
         if (amount%digit(k) /= 0_lp) real_of = real_of &
            + scale(real(amount%digit(k), wp), base_bits*(k - 1) + unit_exponent)
      end do
   end function real_of

   !> Position of the highest bit of a positive sum, counted from 0; -1 if the sum is zero
   pure integer function highest_bit(amount) result(place)
      type(exact_sum_t), intent(in) :: amount
      integer :: k

      place = -1
      do k = n_digits, 1, -1
         if (amount%digit(k) == 0_lp) cycle
         place = base_bits*(k - 1) + digits(0_lp) - leadz(amount%digit(k))
         return
      end do
   end function highest_bit

end module polydem_exact_sum
