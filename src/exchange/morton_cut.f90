!> Division along Morton's curve (G. M. Morton, IBM Ltd, Ottawa, 1966): equal weights follow one another along it.
!>
!> The curve fills the square on the bounding box of all bodies. The place of a body along it is the number whose bits
!> are alternately those of its two coordinates, counted in 2^52 parts of the square; the first key has the leading
!> halves.
module polydem_morton_cut
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_rank_groups, only: rank_groups_t
   use polydem_rank_halving, only: rank_halving_t
   implicit none
   private
   public :: morton_cut_t

   !> Pieces of the curve, one per rank
   type, extends(rank_halving_t) :: morton_cut_t
      private
      !> Lower left corner of the square [m]
      real(dp) :: corner(2) = 0.0_dp
      !> Its side [m]
      real(dp) :: side = 0.0_dp
   contains
      procedure :: choose_order
      procedure :: keys_of
   end type morton_cut_t

   !> Bits of a coordinate in one key
   integer, parameter :: half_bits = 26

contains

   !> Lay the square around all bodies; on further levels it stays.
   pure subroutine choose_order(self, groups, bounds)
      class(morton_cut_t), intent(inout) :: self
      type(rank_groups_t), intent(in) :: groups
      real(dp), intent(in) :: bounds(:, :)

      if (groups%beyond(1) - groups%first(1) < self%n_ranks) return
      self%corner = bounds(1:2, 1)
      self%side = max(bounds(3, 1) - bounds(1, 1), bounds(4, 1) - bounds(2, 1))
   end subroutine choose_order

   !> Place along the curve, which does not depend on the group; outside of the square that of its nearest point
   pure function keys_of(self, middle, position) result(keys)
      class(morton_cut_t), intent(in) :: self
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

   !> The number whose bits are alternately those of two numbers, from the second one's leading bit on
   pure integer(lp) function interleave(numbers)
      integer(lp), intent(in) :: numbers(2)
      integer(lp) :: spread(2)

      spread = apart(numbers)
      interleave = ior(spread(1), ishft(spread(2), 1))
   end function interleave

   !> A zero in front of every bit of a number below 2^32: halves move apart, then their halves, and so on
   elemental integer(lp) function apart(number)
      integer(lp), intent(in) :: number
      integer(lp) :: mask
      integer :: shift

      apart = number
      mask = 2_lp**32 - 1_lp
      shift = 16
      do while (shift > 0)
         ! one bits in every other block of as many bits as the shift has
         mask = ieor(mask, ishft(mask, shift))
         apart = iand(ior(apart, ishft(apart, shift)), mask)
         shift = shift/2
      end do
   end function apart

end module polydem_morton_cut
