!> The team of this program: in a build without MPI, a process on its own.
module polydem_join_team
   use polydem_errors, only: error_t, input_error, raise
   use polydem_lone_team, only: lone_team_t
   use polydem_team, only: team_t
   implicit none
   private
   public :: join_team, team_description

   !> What teams are made of, for the log
   character(len=*), parameter :: team_description = 'no MPI'
   !> Where Open MPI, and others, say how many processes they started
   character(len=*), parameter :: sizes(*) = [character(len=20) :: 'OMPI_COMM_WORLD_SIZE', 'PMI_SIZE']

contains

   !> Find out who belongs to the team.
   subroutine join_team(team, error)
      !> The team
      class(team_t), allocatable, intent(out) :: team
      !> Several processes were started, which would not know of each other
      type(error_t), allocatable, intent(inout) :: error
      character(len=16) :: size
      integer :: k

      allocate (lone_team_t :: team)
      do k = 1, ubound(sizes, 1)
         call get_environment_variable(trim(sizes(k)), size)
         if (size /= '' .and. size /= '1') call raise(error, input_error, trim(size)//' processes were started of '// &
            'a program without MPI, which cannot share a run; use the one of the preset mpi, or ./polydem run '// &
            'FILE.nml --ranks '//trim(size)//', which builds and starts it')
      end do
   end subroutine join_team

end module polydem_join_team
