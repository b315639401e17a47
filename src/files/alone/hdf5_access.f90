!> How files are written by several processes: in a build without MPI there is only one.
!>
!> `together/hdf5_access.f90` is the same module for builds with MPI.
module polydem_hdf5_access
   use hdf5, only: hid_t
   implicit none
   private
   public :: access_together, transfer_together, writes_shared, give_up, await_all

contains

   !> Let a file be opened by all processes: nothing is to be done.
   subroutine access_together(properties, path, status)
      !> HDF5's properties of access to the file
      integer(hid_t), intent(in) :: properties
      !> Path of the file
      character(len=*), intent(in) :: path
      !> Always 0
      integer, intent(out) :: status

      associate (same => properties, place => path)
      end associate
      status = 0
   end subroutine access_together

   !> Let numbers be written by all processes at once: nothing is to be done.
   subroutine transfer_together(properties, status)
      !> HDF5's properties of the transfer
      integer(hid_t), intent(in) :: properties
      !> Always 0
      integer, intent(out) :: status

      associate (same => properties)
      end associate
      status = 0
   end subroutine transfer_together

   !> Whether this process writes what is the same on all
   logical function writes_shared()
      writes_shared = .true.
   end function writes_shared

   !> End all processes: there are no files of several processes, and so nothing is to be done.
   pure subroutine give_up(reason)
      !> What is wrong
      character(len=*), intent(in) :: reason

      associate (same => reason)
      end associate
   end subroutine give_up

   !> Wait until all processes have come here: there is only one.
   subroutine await_all()
   end subroutine await_all

end module polydem_hdf5_access
