!> The team of this program: in a build without MPI, a process on its own.
module polydem_join_team
   use polydem_errors, only: error_t
   use polydem_lone_team, only: lone_team_t
   use polydem_team, only: team_t
   implicit none
   private
   public :: join_team, team_description

   !> What teams are made of, for the log
   character(len=*), parameter :: team_description = 'no MPI'

contains

   !> Find out who belongs to the team.
   subroutine join_team(team, error)
      !> The team
      class(team_t), allocatable, intent(out) :: team
      !> Never allocated
      type(error_t), allocatable, intent(inout) :: error

      if (allocated(error)) return
      allocate (lone_team_t :: team)
   end subroutine join_team

end module polydem_join_team
