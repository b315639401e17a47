!> Partition of space by weighted recursive coordinate bisection: M. J. Berger & S. H. Bokhari, IEEE Trans. Comput. C-36
!> (1987) 570.
!>
!> A group is cut across the longer side of the bounding box of its bodies. If the cut meets a line of bodies with the
!> same coordinate, as in a lattice, it has a step: the other coordinate separates the bodies on this line.
module polydem_coordinate_bisection
   use polydem_bisection, only: bisection_t
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_rank_groups, only: rank_groups_t
   use polydem_sort_reals, only: ordered_bits
   implicit none
   private
   public :: coordinate_bisection_t

   !> Partition of space into one rectangle per rank
   type, extends(bisection_t) :: coordinate_bisection_t
      private
      !> Axis perpendicular to each cut, 1 or 2, (n_ranks - 1)
      integer, allocatable :: axis(:)
   contains
      procedure :: choose_order
      procedure :: keys_of
   end type coordinate_bisection_t

contains

   !> Cut across the longer side.
   pure subroutine choose_order(self, groups, bounds)
      class(coordinate_bisection_t), intent(inout) :: self
      type(rank_groups_t), intent(in) :: groups
      real(dp), intent(in) :: bounds(:, :)

      if (.not. allocated(self%axis)) allocate (self%axis(self%n_ranks - 1_ip))
      if (size(self%axis) /= self%n_ranks - 1_ip) then
         deallocate (self%axis)
         allocate (self%axis(self%n_ranks - 1_ip))
      end if
      self%axis(groups%middle) = merge(1, 2, bounds(3, :) - bounds(1, :) >= bounds(4, :) - bounds(2, :))
   end subroutine choose_order

   !> The coordinate along the longer side, then the other one
   pure function keys_of(self, middle, position) result(keys)
      class(coordinate_bisection_t), intent(in) :: self
      integer(ip), intent(in) :: middle
      real(wp), intent(in) :: position(2)
      integer(lp) :: keys(2)

      keys = ordered_bits(position)
      if (self%axis(middle) == 2) keys = keys([2, 1])
   end function keys_of

end module polydem_coordinate_bisection
