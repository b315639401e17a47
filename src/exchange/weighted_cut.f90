!> Cuts of several groups of bodies in two of wanted weights, each body being known to one process only.
!>
!> Bodies are ordered by two whole numbers, the second of which tells apart those that agree in the first. A cut is
!> found as digits are looked up in a radix sort: the processes add up the weights of bodies by the leading digit of
!> their number, and so learn that of the body at the cut, then the next one among those bodies that have it, and so
!> on. All groups are served at once, and the search is exact after a fixed number of rounds, however bodies are
!> spread.
module polydem_weighted_cut
   use polydem_kinds, only: ip, lp
   use polydem_team, only: team_t
   implicit none
   private
   public :: cut_groups, is_below

   !> Bits of a digit: with more of them there are fewer rounds of longer messages
   integer, parameter :: digit_bits = 4
   !> Values of a digit
   integer(ip), parameter :: n_digits = 2_ip**digit_bits
   !> What a whole number is to be XORed with so that digits ascend from negative numbers to positive ones
   integer(lp), parameter :: sign_bit = ibset(0_lp, bit_size(0_lp) - 1)
   !> The least and the greatest number that a cut has
   integer(lp), parameter :: least = -huge(0_lp)
   integer(lp), parameter :: greatest = huge(0_lp)

contains

   !> Find the last key below each cut. The body at the cut falls to the side that comes nearer to the wanted weight,
   !> which therefore is off by half a body at most. All processes must call this.
   subroutine cut_groups(team, keys, weight, group, lower, all_parts, cut)
      !> Processes
      class(team_t), intent(inout) :: team
      !> Place of the bodies of this process in the order, (2, body)
      integer(lp), intent(in) :: keys(:, :)
      !> Their weights, >= 0; their sum over all processes must be a number, (body)
      integer(lp), intent(in) :: weight(:)
      !> Their groups; 0: none, (body)
      integer(ip), intent(in) :: group(:)
      !> Parts of the weight that are wanted below the cut, (group)
      integer(ip), intent(in) :: lower(:)
      !> Parts that the weight has, (group)
      integer(ip), intent(in) :: all_parts(:)
      !> The last keys below the cut, (2, group)
      integer(lp), intent(out) :: cut(:, :)
      integer(lp) :: wanted(size(lower)), below(size(lower)), at(size(lower)), number(size(lower))
      integer(ip), allocatable :: candidate(:)
      integer(ip) :: g
      integer(lp) :: total

      candidate = group
      call count_candidates(team, weight, candidate, wanted, number)
      do g = 1_ip, size(lower, kind=ip)
         total = wanted(g)
         wanted(g) = (total/all_parts(g))*lower(g) + modulo(total, int(all_parts(g), lp))*lower(g)/all_parts(g)
      end do
      below = 0_lp
      call find_keys(team, keys(1, :), weight, wanted, candidate, cut(1, :), below)
      call count_candidates(team, weight, candidate, at, number)
      if (any(number > 1_lp)) then
         call find_keys(team, keys(2, :), weight, wanted, candidate, cut(2, :), below)
         call count_candidates(team, weight, candidate, at, number)
         cut(2, :) = merge(cut(2, :), max(cut(2, :), least) - 1_lp, below + at - wanted <= wanted - below)
      else
         cut(2, :) = merge(greatest, least, below + at - wanted <= wanted - below)
      end if
   end subroutine cut_groups

   !> Whether a place in the order is below a cut
   pure logical function is_below(keys, cut)
      !> The place, (2)
      integer(lp), intent(in) :: keys(2)
      !> The last keys below the cut, (2)
      integer(lp), intent(in) :: cut(2)

      is_below = keys(1) < cut(1) .or. (keys(1) == cut(1) .and. keys(2) <= cut(2))
   end function is_below

   !> Weight and number of the candidates of each group, over all processes.
   subroutine count_candidates(team, weight, candidate, total, number)
      class(team_t), intent(inout) :: team
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
      call team%add_up(sums)
      total = sums(1::2)
      number = sums(2::2)
   end subroutine count_candidates

   !> Find the least key of each group up to which the weight is at least the wanted one.
   subroutine find_keys(team, keys, weight, wanted, candidate, found, below)
      class(team_t), intent(inout) :: team
      integer(lp), intent(in) :: keys(:), weight(:), wanted(:)
      !> Group of each body that may be at the cut; afterwards only of those that are
      integer(ip), intent(inout) :: candidate(:)
      !> That key
      integer(lp), intent(out) :: found(:)
      !> Weight below the candidates
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
         call team%add_up(sums)
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
      !> Number of bits behind it
      integer, intent(in) :: shift

      digit_of = int(iand(ishft(ieor(key, sign_bit), -shift), int(n_digits - 1_ip, lp)), ip)
   end function digit_of

end module polydem_weighted_cut
