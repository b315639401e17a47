!> How files are written by several processes: by HDF5 upon MPI-IO.
!>
!> `alone/hdf5_access.f90` is the same module for builds without MPI. The first two procedures only note a wish in
!> properties; what follows from it is collective. HDF5 duplicates MPI_COMM_WORLD, so that its messages do not mix with
!> others.
module polydem_hdf5_access
   use, intrinsic :: iso_c_binding, only: c_int, c_int64_t
   use hdf5, only: h5fd_mpio_collective_f, h5pset_dxpl_mpio_f, h5pset_fapl_mpio_f, hid_t
   use mpi_f08, only: mpi_allreduce, mpi_comm_rank, mpi_comm_world, mpi_in_place, mpi_info_null, mpi_logical, mpi_lor
   implicit none
   private
   public :: access_together, transfer_together, writes_shared, fails_anywhere

   !> H5FD_MPIO_INDIVIDUAL_IO of HDF5, which its Fortran interface lacks
   integer(c_int), parameter :: individually = 1_c_int

   interface
      !> HDF5's H5Pset_dxpl_mpio_collective_opt; its numbers of properties have 64 bits since version 1.10
      integer(c_int) function set_collective_option(properties, option) &
         bind(C, name='H5Pset_dxpl_mpio_collective_opt')
         import :: c_int, c_int64_t
         integer(c_int64_t), value :: properties
         integer(c_int), value :: option
      end function set_collective_option
   end interface

contains

   !> Let a file be opened by all processes.
   subroutine access_together(properties, status)
      !> HDF5's properties of access to the file
      integer(hid_t), intent(in) :: properties
      !> Negative on failure
      integer, intent(out) :: status

      call h5pset_fapl_mpio_f(properties, mpi_comm_world%mpi_val, mpi_info_null%mpi_val, status)
   end subroutine access_together

   !> Let numbers be written by all processes at once, in calls of HDF5 that are collective. Each process hands its own
   !> contiguous block to the operating system: nothing is to be gained by sending it to another first, and Open MPI 4.1
   !> waits for ever if one of several processes that write for others finds the disk full.
   subroutine transfer_together(properties, status)
      !> HDF5's properties of the transfer
      integer(hid_t), intent(in) :: properties
      !> Negative on failure
      integer, intent(out) :: status

      call h5pset_dxpl_mpio_f(properties, h5fd_mpio_collective_f, status)
      if (status >= 0) status = int(set_collective_option(int(properties, c_int64_t), individually))
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
