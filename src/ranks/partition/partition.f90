!> Interface of all partitions of space among the ranks of a communicator.
!>
!> All ranks have the whole partition, with the same bits. The owner of a body depends on all positions and weights, but
!> not on the previous owners: ranks exchange only extremes and sums of integers, which do not depend on the order of
!> the bodies.
module polydem_partition
   use polydem_communicator, only: communicator_t
   use polydem_kinds, only: dp, ip, wp
   implicit none
   private
   public :: partition_t

   !> A partition of space; before the first call of `divide` rank 0 owns all of it
   type, abstract :: partition_t
   contains
      procedure(divide), deferred :: divide
      procedure(owner_of), deferred :: owner_of
   end type partition_t

   abstract interface
      !> Compute the partition such that all ranks have about the same weight. Collective.
      subroutine divide(self, comm, position, weight)
         import :: dp, partition_t, communicator_t, wp
         class(partition_t), intent(inout) :: self
         class(communicator_t), intent(inout) :: comm
         !> Positions of the bodies of this rank, possibly none, (2, body) [m]
         real(wp), intent(in) :: position(:, :)
         !> Work of each body, >= 0, in any unit, (body); if all weights are 0, all bodies have the same weight
         real(dp), intent(in) :: weight(:)
      end subroutine divide

      !> Rank that owns a position: 0 to size - 1 for any position, even far from all bodies
      pure integer(ip) function owner_of(self, position)
         import :: ip, partition_t, wp
         class(partition_t), intent(in) :: self
         !> The position, (2) [m]
         real(wp), intent(in) :: position(2)
      end function owner_of
   end interface

end module polydem_partition
