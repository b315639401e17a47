!> Parallel access to HDF5 files in a build without MPI: there is one process, and every procedure is a no-op.
!>
!> `parallel/hdf5_access.f90` is the unused module for builds with MPI.
module polydem_hdf5_access
   use hdf5, only: hid_t
   implicit none
   private
   public :: enable_parallel_access, enable_collective_write, writes_replicated, abort_all, barrier

contains

   !> Enable parallel access to a file: a no-op.
   subroutine enable_parallel_access(properties, path, status)
      !> HDF5 file access property list
      integer(hid_t), intent(in) :: properties
      !> Path of the file
      character(len=*), intent(in) :: path
      !> Always 0
      integer, intent(out) :: status

      associate (unused => properties, unused_path => path)
      end associate
      status = 0
   end subroutine enable_parallel_access

   !> Enable collective writes: a no-op.
   subroutine enable_collective_write(properties, status)
      !> HDF5 dataset transfer property list
      integer(hid_t), intent(in) :: properties
      !> Always 0
      integer, intent(out) :: status

      associate (unused => properties)
      end associate
      status = 0
   end subroutine enable_collective_write

   !> Whether this process writes values that are equal on all ranks: true
   logical function writes_replicated()
      writes_replicated = .true.
   end function writes_replicated

   !> End all ranks: a no-op, because no file is written in parallel.
   pure subroutine abort_all(reason)
      !> Error message
      character(len=*), intent(in) :: reason

      associate (unused => reason)
      end associate
   end subroutine abort_all

   !> Barrier: a no-op.
   subroutine barrier()
   end subroutine barrier

end module polydem_hdf5_access
