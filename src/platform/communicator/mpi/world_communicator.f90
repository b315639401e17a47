!> Communicators of MPI (build with MPI): that of all ranks of this program, or one of a program that holds a run.
module polydem_world_communicator
   use mpi_f08, only: mpi_comm, mpi_comm_compare, mpi_comm_rank, mpi_comm_size, mpi_comm_world, mpi_congruent, &
      mpi_ident, mpi_init_thread, mpi_initialized, mpi_thread_funneled
   use polydem_communicator, only: communicator_t
   use polydem_errors, only: error_t, input_error, raise
   use polydem_kinds, only: ip
   use polydem_mpi_communicator, only: mpi_communicator_t
   implicit none
   private
   public :: create_world, adopt_communicator

contains

   !> Start MPI and create the communicator of all ranks.
   subroutine create_world(comm, error)
      class(communicator_t), allocatable, intent(out) :: comm
      !> Unchanged: MPI itself ends the program if it cannot start
      type(error_t), allocatable, intent(inout) :: error
      integer :: provided

      associate (unused => error)
      end associate
      call mpi_init_thread(mpi_thread_funneled, provided)
      call wrap(mpi_comm_world, comm)
   end subroutine create_world

   !> Use a communicator of a program that has started MPI and will end it.
   subroutine adopt_communicator(handle, has_files, comm, error)
      !> Its Fortran handle, an integer
      integer, intent(in) :: handle
      !> Whether its ranks write files, which only all processes together do
      logical, intent(in) :: has_files
      class(communicator_t), allocatable, intent(out) :: comm
      !> Allocated if it cannot be used; the same on all its ranks
      type(error_t), allocatable, intent(inout) :: error
      type(mpi_comm) :: given
      integer :: relation
      logical :: is_ready

      call mpi_initialized(is_ready)
      if (.not. is_ready) then
         call raise(error, input_error, 'the MPI of this library is not started: the program, or '// &
                    'mpi4py, uses another MPI')
         return
      end if
      given%mpi_val = handle
      call wrap(given, comm)
      if (.not. has_files) return
      call mpi_comm_compare(given, mpi_comm_world, relation)
      if (relation /= mpi_ident .and. relation /= mpi_congruent) call raise(error, input_error, 'a folder needs a '// &
         'communicator of all processes in their order, as MPI_COMM_WORLD: only these write files together')
   end subroutine adopt_communicator

   !> Make the object of a communicator of MPI.
   subroutine wrap(handle, comm)
      type(mpi_comm), intent(in) :: handle
      class(communicator_t), allocatable, intent(out) :: comm
      integer :: rank, size

      call mpi_comm_rank(handle, rank)
      call mpi_comm_size(handle, size)
      allocate (comm, source=mpi_communicator_t(rank=int(rank, ip), size=int(size, ip), handle=handle))
   end subroutine wrap

end module polydem_world_communicator
