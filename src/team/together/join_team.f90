!> The team of this program: in a build with MPI, all ranks of the run.
module polydem_join_team
   use mpi_f08, only: mpi_comm_rank, mpi_comm_size, mpi_comm_world, mpi_init_thread, mpi_thread_funneled
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip
   use polydem_mpi_team, only: mpi_team_t
   use polydem_team, only: team_t
   implicit none
   private
   public :: join_team, team_description

   !> What teams are made of, for the log
   character(len=*), parameter :: team_description = 'MPI'

contains

   !> Find out who belongs to the team.
   subroutine join_team(team, error)
      !> The team
      class(team_t), allocatable, intent(out) :: team
      !> A failure so far; none is added, since MPI ends the program by itself if it cannot start
      type(error_t), allocatable, intent(inout) :: error
      integer :: provided, rank, size

      associate (unused => error)
      end associate
      call mpi_init_thread(mpi_thread_funneled, provided)
      call mpi_comm_rank(mpi_comm_world, rank)
      call mpi_comm_size(mpi_comm_world, size)
      allocate (team, source=mpi_team_t(rank=int(rank, ip), size=int(size, ip)))
   end subroutine join_team

end module polydem_join_team
