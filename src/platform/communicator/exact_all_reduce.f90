!> All-reduce of exact sums. The totals do not depend on the distribution of the terms over the ranks.
module polydem_exact_all_reduce
   use polydem_communicator, only: communicator_t
   use polydem_exact_sum, only: exact_sum_t, n_words
   use polydem_kinds, only: lp
   implicit none
   private
   public :: all_reduce_exact_sums

contains

   !> Replace sums by their totals over all ranks; collective.
   subroutine all_reduce_exact_sums(comm, sums)
      class(communicator_t), intent(inout) :: comm
      !> Sums of this rank; afterwards the totals, the same on all ranks
      type(exact_sum_t), intent(inout) :: sums(:)
      integer(lp) :: words(n_words*size(sums))
      integer :: k

      do k = 1, size(sums)
         call sums(k)%carry()
         words((k - 1)*n_words + 1:k*n_words) = sums(k)%digit
      end do
      call comm%all_reduce_sum(words)
      do k = 1, size(sums)
         sums(k)%digit = words((k - 1)*n_words + 1:k*n_words)
         call sums(k)%carry()
      end do
   end subroutine all_reduce_exact_sums

end module polydem_exact_all_reduce
