!> The communicator of this program: one process (build without MPI).
module polydem_world_communicator
   use polydem_communicator, only: communicator_t
   use polydem_errors, only: error_t, input_error, raise
   implicit none
   private
   public :: create_world, adopt_communicator

   !> Environment variables in which Open MPI and other launchers store the number of processes
   character(len=*), parameter :: size_variables(*) = [character(len=20) :: 'OMPI_COMM_WORLD_SIZE', 'PMI_SIZE']

contains

   !> Create the communicator of one process.
   subroutine create_world(comm, error)
      class(communicator_t), allocatable, intent(out) :: comm
      !> Allocated if several processes were started: they could not communicate
      type(error_t), allocatable, intent(inout) :: error
      character(len=16) :: size
      integer :: k

      allocate (communicator_t :: comm)
      do k = 1, ubound(size_variables, 1)
         call get_environment_variable(trim(size_variables(k)), size)
         if (size /= '' .and. size /= '1') call raise(error, input_error, trim(size)//' processes were started, '// &
            'but this program is built without MPI; use the program of the preset mpi, or ./polydem run '// &
            'FILE.nml --ranks '//trim(size)//', which builds and starts it')
      end do
   end subroutine create_world

   !> Refuse a communicator of MPI.
   subroutine adopt_communicator(handle, has_files, comm, error)
      !> Its Fortran handle, an integer
      integer, intent(in) :: handle
      !> Whether its ranks write files
      logical, intent(in) :: has_files
      !> That of this process alone
      class(communicator_t), allocatable, intent(out) :: comm
      !> Allocated
      type(error_t), allocatable, intent(inout) :: error

      associate (unused => handle, unused_files => has_files)
      end associate
      allocate (communicator_t :: comm)
      call raise(error, input_error, 'this library is of one process; several need that of a build with MPI, '// &
                 'libpolydem_mpi')
   end subroutine adopt_communicator

end module polydem_world_communicator
