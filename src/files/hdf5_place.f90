!> Where a data set is, and what to say if HDF5 fails there.
module polydem_hdf5_place
   use hdf5, only: hid_t
   use polydem_errors, only: error_t, io_error, raise
   use polydem_hdf5_access, only: give_up
   implicit none
   private
   public :: place_t, expect

   !> Where a data set is, for calls and for messages
   type :: place_t
      !> HDF5's number of the open file
      integer(hid_t) :: file = -1_hid_t
      !> Path of the file
      character(len=:), allocatable :: path
      !> Name of the data set, like /frames/position
      character(len=:), allocatable :: name
      !> Whether a new growing data set is compressed
      logical :: compressed = .false.
      !> Whether all processes of the run write the file together
      logical :: together = .false.
   end type place_t

contains

   !> Turn a failed status of HDF5 into an error that names file and data set. If all processes write the file together,
   !> it ends them all: the others may wait for this one.
   subroutine expect(status, action, place, error)
      !> Status of an HDF5 call, negative on failure
      integer, intent(in) :: status
      !> What was tried, like 'write'
      character(len=*), intent(in) :: action
      !> File and data set
      type(place_t), intent(in) :: place
      !> Allocated if the call failed
      type(error_t), allocatable, intent(inout) :: error

      if (status >= 0) return
      if (place%together) call give_up(place%path//': cannot '//action//' '//place%name)
      call raise(error, io_error, place%path//': cannot '//action//' '//place%name)
   end subroutine expect

end module polydem_hdf5_place
