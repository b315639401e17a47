!> Locations of data sets, and errors of HDF5 calls that name the location.
module polydem_hdf5_location
   use hdf5, only: hid_t
   use polydem_errors, only: error_t, io_error, raise
   use polydem_hdf5_access, only: abort_all
   implicit none
   private
   public :: place_t, expect

   !> Location of a data set, for calls and for messages
   type :: place_t
      !> HDF5 identifier of the open file
      integer(hid_t) :: file = -1_hid_t
      !> Path of the file
      character(len=:), allocatable :: path
      !> Name of the data set, like /frames/position
      character(len=:), allocatable :: name
      !> Whether a new extendible data set is compressed
      logical :: compressed = .false.
      !> Whether all ranks of the run write the file in parallel
      logical :: together = .false.
   end type place_t

contains

   !> Convert a failed status of HDF5 into an error that names the file and the data set. If the file is written in
   !> parallel, abort all ranks, because the other ranks may wait for this one.
   subroutine expect(status, action, place, error)
      !> Status of an HDF5 call, negative on failure
      integer, intent(in) :: status
      !> The failed action, like 'write'; it completes the message 'cannot ...'
      character(len=*), intent(in) :: action
      !> Location of the data set
      type(place_t), intent(in) :: place
      !> Allocated if the call failed
      type(error_t), allocatable, intent(inout) :: error

      if (status >= 0) return
      if (place%together) call abort_all(place%path//': cannot '//action//' '//place%name)
      call raise(error, io_error, place%path//': cannot '//action//' '//place%name)
   end subroutine expect

end module polydem_hdf5_location
