!> A serializer that copies the fields of the root rank to all ranks.
module polydem_broadcaster
   use polydem_communicator, only: communicator_t
   use polydem_kinds, only: dp, lp
   use polydem_serializer, only: serializer_t
   implicit none
   private
   public :: broadcaster_t

   !> Broadcaster; `is_reading` is true on all ranks but the root rank
   type, extends(serializer_t) :: broadcaster_t
      !> Ranks
      class(communicator_t), allocatable :: comm
   contains
      procedure :: transfer_reals
      procedure :: transfer_longs
   end type broadcaster_t

contains

   !> Broadcast real numbers from the root rank.
   subroutine transfer_reals(self, name, width, values, unit, meaning)
      class(broadcaster_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: width
      real(dp), intent(inout), contiguous :: values(:)
      character(len=*), intent(in) :: unit, meaning

      call self%comm%broadcast(values)
      associate (unused => name//unit//meaning, unused_width => width)
      end associate
   end subroutine transfer_reals

   !> Broadcast integers from the root rank.
   subroutine transfer_longs(self, name, width, values, unit, meaning)
      class(broadcaster_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: width
      integer(lp), intent(inout), contiguous :: values(:)
      character(len=*), intent(in) :: unit, meaning

      call self%comm%broadcast(values)
      associate (unused => name//unit//meaning, unused_width => width)
      end associate
   end subroutine transfer_longs

end module polydem_broadcaster
