!> How files are written by several processes: by HDF5 upon MPI-IO.
!>
!> `alone/hdf5_access.f90` is the same module for builds without MPI. The first two procedures only note a wish in
!> properties; what follows from it is collective. HDF5 duplicates MPI_COMM_WORLD, so that its messages do not mix with
!> others.
module polydem_hdf5_access
   use hdf5, only: h5fd_mpio_collective_f, h5pset_dxpl_mpio_f, h5pset_fapl_mpio_f, hid_t
   use mpi_f08, only: mpi_allreduce, mpi_comm_rank, mpi_comm_world, mpi_in_place, mpi_info_null, mpi_logical, mpi_lor
   implicit none
   private
   public :: access_together, transfer_together, writes_shared, fails_anywhere

contains

   !> Let a file be opened by all processes.
   subroutine access_together(properties, status)
      !> HDF5's properties of access to the file
      integer(hid_t), intent(in) :: properties
      !> Negative on failure
      integer, intent(out) :: status

      call h5pset_fapl_mpio_f(properties, mpi_comm_world%mpi_val, mpi_info_null%mpi_val, status)
   end subroutine access_together

   !> Let numbers be written by all processes at once.
   subroutine transfer_together(properties, status)
      !> HDF5's properties of the transfer
      integer(hid_t), intent(in) :: properties
      !> Negative on failure
      integer, intent(out) :: status

      call h5pset_dxpl_mpio_f(properties, h5fd_mpio_collective_f, status)
   end subroutine transfer_together

   !> Whether this process writes what is the same on all
   logical function writes_shared()
      integer :: rank

      call mpi_comm_rank(mpi_comm_world, rank)
      writes_shared = rank == 0
   end function writes_shared

   !> Whether something failed on any process; all must call it.
   logical function fails_anywhere(fails)
      !> Whether it failed on this one
      logical, intent(in) :: fails

      fails_anywhere = fails
      call mpi_allreduce(mpi_in_place, fails_anywhere, 1, mpi_logical, mpi_lor, mpi_comm_world)
   end function fails_anywhere

end module polydem_hdf5_access
