!> The communicator of this program: all ranks of the run (build with MPI).
module polydem_world_communicator
   use mpi_f08, only: mpi_comm_rank, mpi_comm_size, mpi_comm_world, mpi_init_thread, mpi_thread_funneled
   use polydem_communicator, only: communicator_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip
   use polydem_mpi_communicator, only: mpi_communicator_t
   implicit none
   private
   public :: create_world

contains

   !> Start MPI and create the communicator of all ranks.
   subroutine create_world(comm, error)
      class(communicator_t), allocatable, intent(out) :: comm
      !> Unchanged: MPI itself ends the program if it cannot start
      type(error_t), allocatable, intent(inout) :: error
      integer :: provided, rank, size

      associate (unused => error)
      end associate
      call mpi_init_thread(mpi_thread_funneled, provided)
      call mpi_comm_rank(mpi_comm_world, rank)
      call mpi_comm_size(mpi_comm_world, size)
      allocate (comm, source=mpi_communicator_t(rank=int(rank, ip), size=int(size, ip)))
   end subroutine create_world

end module polydem_world_communicator
