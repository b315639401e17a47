!> Partition of space along the Morton curve (G. M. Morton, IBM Ltd, Ottawa, 1966): each rank has a piece of the curve
!> of equal weight.
!>
!> The curve fills a square around the bounding box of all bodies. The position of a body on the curve is the integer
!> with the interleaved bits of its two coordinates, in units of the side of the square over 2^52. The first key
!> contains the leading 26 bits of each coordinate, the second key the other 26.
module polydem_morton_bisection
   use polydem_bisection, only: bisection_t
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_rank_groups, only: rank_groups_t
   implicit none
   private
   public :: morton_bisection_t

   !> Partition of space into one piece of the Morton curve per rank
   type, extends(bisection_t) :: morton_bisection_t
      private
      !> Lower left corner of the square [m]
      real(dp) :: corner(2) = 0.0_dp
      !> Side of the square [m]
      real(dp) :: side = 0.0_dp
   contains
      procedure :: choose_order
      procedure :: keys_of
   end type morton_bisection_t

   !> Bits of a coordinate in one key
   integer, parameter :: half_bits = 26

contains

   !> Choose the square around all bodies, on the first level only.
   pure subroutine choose_order(self, groups, bounds)
      class(morton_bisection_t), intent(inout) :: self
      type(rank_groups_t), intent(in) :: groups
      real(dp), intent(in) :: bounds(:, :)

      if (groups%beyond(1) - groups%first(1) < self%n_ranks) return
      self%corner = bounds(1:2, 1)
      self%side = max(bounds(3, 1) - bounds(1, 1), bounds(4, 1) - bounds(2, 1))
   end subroutine choose_order

   !> Position on the curve, independent of the group. A point outside the square has the keys of the nearest point of
   !> the square.
   pure function keys_of(self, middle, position) result(keys)
      class(morton_bisection_t), intent(in) :: self
      integer(ip), intent(in) :: middle
      real(wp), intent(in) :: position(2)
      integer(lp) :: keys(2), cell(2)
      real(dp) :: share(2)
      integer(lp), parameter :: n_cells = 2_lp**(2*half_bits)

      associate (any_group => middle)
      end associate
      keys = 0_lp
      if (.not. self%side > 0.0_dp) return
      share = min(max((real(position, dp) - self%corner)/self%side, 0.0_dp), 1.0_dp)
      cell = min(int(share*real(n_cells, dp), lp), n_cells - 1_lp)
      keys(1) = interleave(ishft(cell, -half_bits))
      keys(2) = interleave(iand(cell, 2_lp**half_bits - 1_lp))
   end function keys_of

   !> Interleave the bits of two numbers; the leading bit is that of the second number
   pure integer(lp) function interleave(numbers)
      integer(lp), intent(in) :: numbers(2)
      integer(lp) :: spread(2)

      spread = with_zero_bits(numbers)
      interleave = ior(spread(1), ishft(spread(2), 1))
   end function interleave

   !> Insert a zero bit before every bit of a number below 2^32: move its halves apart, then their halves, and so on
   elemental integer(lp) function with_zero_bits(number)
      integer(lp), intent(in) :: number
      integer(lp) :: mask
      integer :: shift

      with_zero_bits = number
      mask = 2_lp**32 - 1_lp
      shift = 16
      do while (shift > 0)
         ! Mask with ones in every other block of `shift` bits
         mask = ieor(mask, ishft(mask, shift))
         with_zero_bits = iand(ior(with_zero_bits, ishft(with_zero_bits, shift)), mask)
         shift = shift/2
      end do
   end function with_zero_bits

end module polydem_morton_bisection
