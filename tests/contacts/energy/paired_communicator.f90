!> Communicator of one of two ranks that run one after the other in one process, for tests of all-reduce sums.
!>
!> In the first round each rank records the values that it contributes. In the second round they are the values of the
!> other rank.
module paired_communicator
   use polydem_communicator, only: communicator_t
   use polydem_kinds, only: lp
   implicit none
   private
   public :: paired_communicator_t

   !> Values of one rank in one call
   type :: words_t
      !> The values
      integer(lp), allocatable :: word(:)
   end type words_t

   !> One of two ranks
   type, extends(communicator_t) :: paired_communicator_t
      !> Number of calls so far
      integer :: n_calls = 0
      !> Values of this rank in each call
      type(words_t) :: sent(9)
      !> Values of the other rank in each call; none in the first round
      type(words_t) :: received(9)
   contains
      procedure :: all_reduce_sum
   end type paired_communicator_t

contains

   !> Replace values by their sums over both ranks.
   subroutine all_reduce_sum(self, values)
      class(paired_communicator_t), intent(inout) :: self
      !> Values of this rank; afterwards the sums
      integer(lp), intent(inout), contiguous :: values(:)

      self%n_calls = self%n_calls + 1
      self%sent(self%n_calls)%word = values
      if (allocated(self%received(self%n_calls)%word)) values = values + self%received(self%n_calls)%word
   end subroutine all_reduce_sum

end module paired_communicator
