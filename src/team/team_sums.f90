!> Sums over what all processes of a team have, which do not depend on how it is divided.
module polydem_team_sums
   use polydem_exact_sum, only: exact_sum_t, n_words
   use polydem_kinds, only: lp
   use polydem_team, only: team_t
   implicit none
   private
   public :: add_up_sums

contains

   !> Replace sums by their totals over all processes; collective.
   subroutine add_up_sums(team, sums)
      !> The team
      class(team_t), intent(inout) :: team
      !> Sums of this process; afterwards the same on all
      type(exact_sum_t), intent(inout) :: sums(:)
      integer(lp) :: words(n_words*size(sums))
      integer :: k

      do k = 1, size(sums)
         call sums(k)%carry()
         words((k - 1)*n_words + 1:k*n_words) = sums(k)%digit
      end do
      call team%add_up(words)
      do k = 1, size(sums)
         sums(k)%digit = words((k - 1)*n_words + 1:k*n_words)
         call sums(k)%carry()
      end do
   end subroutine add_up_sums

end module polydem_team_sums
