!> Weighted medians over all ranks: cuts that divide groups of bodies in two parts of given weights.
!>
!> Two integer keys order the bodies; the second key decides between equal first keys. The search for a cut proceeds
!> digit by digit, as in a radix sort. In each round the ranks add up the weights of the candidates by one digit of
!> their keys. The sums determine this digit of the key at the cut, and bodies with another digit cease to be
!> candidates. All groups are searched at once. The result is exact after a fixed number of rounds, for any
!> distribution of the bodies over the ranks.
module polydem_weighted_median
   use polydem_communicator, only: communicator_t
   use polydem_kinds, only: ip, lp
   implicit none
   private
   public :: split_groups, is_below

   !> Bits of a digit; more bits mean fewer rounds and longer messages
   integer, parameter :: digit_bits = 4
   !> Number of values of a digit
   integer(ip), parameter :: n_digits = 2_ip**digit_bits
   !> Sign bit; the XOR of a key with it makes digits ascend from negative to positive keys
   integer(lp), parameter :: sign_bit = ibset(0_lp, bit_size(0_lp) - 1)
   !> Least and greatest key of a cut
   integer(lp), parameter :: least = -huge(0_lp)
   integer(lp), parameter :: greatest = huge(0_lp)

contains

   !> Find the greatest keys below each cut. The body at the cut goes to the side that brings the weights closer to the
   !> given ones; the error is at most half the weight of a body. Collective.
   subroutine split_groups(comm, keys, weight, group, lower, all_parts, cut)
      class(communicator_t), intent(inout) :: comm
      !> Keys of the bodies of this rank, (2, body)
      integer(lp), intent(in) :: keys(:, :)
      !> Weights of the bodies, >= 0, (body); their sum over all ranks must not overflow
      integer(lp), intent(in) :: weight(:)
      !> Group of each body; 0: none, (body)
      integer(ip), intent(in) :: group(:)
      !> Number of parts of the weight below the cut, (group)
      integer(ip), intent(in) :: lower(:)
      !> Number of all parts of the weight, (group)
      integer(ip), intent(in) :: all_parts(:)
      !> Greatest keys below each cut, (2, group)
      integer(lp), intent(out) :: cut(:, :)
      integer(lp) :: wanted(size(lower)), below(size(lower)), at(size(lower)), number(size(lower))
      integer(ip), allocatable :: candidate(:)
      integer(ip) :: g
      integer(lp) :: total

      candidate = group
      call count_candidates(comm, weight, candidate, wanted, number)
      do g = 1_ip, size(lower, kind=ip)
         total = wanted(g)
         wanted(g) = (total/all_parts(g))*lower(g) + modulo(total, int(all_parts(g), lp))*lower(g)/all_parts(g)
      end do
      below = 0_lp
      call find_keys(comm, keys(1, :), weight, wanted, candidate, cut(1, :), below)
      call count_candidates(comm, weight, candidate, at, number)
      if (any(number > 1_lp)) then
         call find_keys(comm, keys(2, :), weight, wanted, candidate, cut(2, :), below)
         call count_candidates(comm, weight, candidate, at, number)
         cut(2, :) = merge(cut(2, :), max(cut(2, :), least) - 1_lp, below + at - wanted <= wanted - below)
      else
         cut(2, :) = merge(greatest, least, below + at - wanted <= wanted - below)
      end if
   end subroutine split_groups

   !> Whether the keys of a body are below a cut
   pure logical function is_below(keys, cut)
      !> Keys of the body, (2)
      integer(lp), intent(in) :: keys(2)
      !> Greatest keys below the cut, (2)
      integer(lp), intent(in) :: cut(2)

      is_below = keys(1) < cut(1) .or. (keys(1) == cut(1) .and. keys(2) <= cut(2))
   end function is_below

   !> Weight and number of the candidates of each group, over all ranks.
   subroutine count_candidates(comm, weight, candidate, total, number)
      class(communicator_t), intent(inout) :: comm
      integer(lp), intent(in) :: weight(:)
      integer(ip), intent(in) :: candidate(:)
      integer(lp), intent(out) :: total(:), number(:)
      integer(lp) :: sums(2*size(total))
      integer(ip) :: k, g

      sums = 0_lp
      do k = 1_ip, size(candidate, kind=ip)
         g = candidate(k)
         if (g == 0_ip) cycle
         sums(2_ip*g - 1_ip) = sums(2_ip*g - 1_ip) + weight(k)
         sums(2_ip*g) = sums(2_ip*g) + 1_lp
      end do
      call comm%all_reduce_sum(sums)
      total = sums(1::2)
      number = sums(2::2)
   end subroutine count_candidates

   !> Find the key at the cut of each group: the least key up to which the weight is at least the wanted one.
   subroutine find_keys(comm, keys, weight, wanted, candidate, found, below)
      class(communicator_t), intent(inout) :: comm
      integer(lp), intent(in) :: keys(:), weight(:), wanted(:)
      !> Group of each candidate, otherwise 0; afterwards only bodies with the key at the cut are candidates
      integer(ip), intent(inout) :: candidate(:)
      !> Key at the cut
      integer(lp), intent(out) :: found(:)
      !> Weight of the bodies below all candidates
      integer(lp), intent(inout) :: below(:)
      integer(lp) :: sums(0:n_digits*size(wanted, kind=ip) - 1_ip)
      integer(ip) :: digit(size(wanted)), k, g, place, d
      integer :: shift

      found = 0_lp
      do shift = bit_size(0_lp) - digit_bits, 0, -digit_bits
         sums = 0_lp
         do k = 1_ip, size(keys, kind=ip)
            if (candidate(k) == 0_ip) cycle
            place = (candidate(k) - 1_ip)*n_digits + digit_of(keys(k), shift)
            sums(place) = sums(place) + weight(k)
         end do
         call comm%all_reduce_sum(sums)
         do g = 1_ip, size(wanted, kind=ip)
            do d = 0_ip, n_digits - 2_ip
               place = (g - 1_ip)*n_digits + d
               if (below(g) + sums(place) >= wanted(g)) exit
               below(g) = below(g) + sums(place)
            end do
            digit(g) = d
            found(g) = ior(found(g), ishft(int(d, lp), shift))
         end do
         do k = 1_ip, size(keys, kind=ip)
            if (candidate(k) == 0_ip) cycle
            if (digit_of(keys(k), shift) /= digit(candidate(k))) candidate(k) = 0_ip
         end do
      end do
      found = ieor(found, sign_bit)
   end subroutine find_keys

   !> Digit of a key
   pure integer(ip) function digit_of(key, shift)
      integer(lp), intent(in) :: key
      !> Number of bits behind the digit
      integer, intent(in) :: shift

      digit_of = int(iand(ishft(ieor(key, sign_bit), -shift), int(n_digits - 1_ip, lp)), ip)
   end function digit_of

end module polydem_weighted_median
