!> One of two processes of which the other one runs later or earlier, for tests of what is added up between them.
!>
!> What is said in a first round, in which nothing is heard, is what the other one hears in the second.
module paired_team
   use polydem_kinds, only: lp
   use polydem_lone_team, only: lone_team_t
   implicit none
   private
   public :: paired_team_t

   !> Words of one process at one time
   type :: words_t
      !> The words
      integer(lp), allocatable :: word(:)
   end type words_t

   !> A process of two
   type, extends(lone_team_t) :: paired_team_t
      !> Calls so far
      integer :: n_calls = 0
      !> What this one said in each call
      type(words_t) :: said(9)
      !> What the other one says in each call; nothing in a first round
      type(words_t) :: heard(9)
   contains
      procedure :: add_up
   end type paired_team_t

contains

   !> Replace numbers by their sums over both.
   subroutine add_up(self, values)
      class(paired_team_t), intent(inout) :: self
      !> Numbers of this process; afterwards the sums
      integer(lp), intent(inout), contiguous :: values(:)

      self%n_calls = self%n_calls + 1
      self%said(self%n_calls)%word = values
      if (allocated(self%heard(self%n_calls)%word)) values = values + self%heard(self%n_calls)%word
   end subroutine add_up

end module paired_team
