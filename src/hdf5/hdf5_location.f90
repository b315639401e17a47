!> Locations of data sets, and errors of HDF5 calls that name the location.
module polydem_hdf5_location
   use hdf5, only: hid_t
   use polydem_errors, only: error_t, input_error, io_error, raise
   use polydem_hdf5_access, only: abort_all
   use polydem_kinds, only: lp
   implicit none
   private
   public :: dataset_location_t, check_status, reject

   !> Location of a data set, for calls and for messages
   type :: dataset_location_t
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
      !> Number of rows that a new extendible data set will probably get; 0: unknown
      integer(lp) :: expected_rows = 0_lp
   end type dataset_location_t

contains

   !> Convert a failed status of HDF5 into an error that names the file and the data set. If the file is written in
   !> parallel, abort all ranks, because the other ranks may wait for this one.
   subroutine check_status(status, action, location, error)
      !> Status of an HDF5 call, negative on failure
      integer, intent(in) :: status
      !> The failed action, like 'write'; it completes the message 'cannot ...'
      character(len=*), intent(in) :: action
      type(dataset_location_t), intent(in) :: location
      !> Allocated if the call failed
      type(error_t), allocatable, intent(inout) :: error

      if (status >= 0) return
      if (location%together) call abort_all(location%path//': cannot '//action//' '//location%name)
      call raise(error, io_error, location%path//': cannot '//action//' '//location%name)
   end subroutine check_status

   !> Report that a data set is not as it must be.
   subroutine reject(location, problem, error)
      type(dataset_location_t), intent(in) :: location
      !> The defect; it completes the message 'FILE: NAME ...'
      character(len=*), intent(in) :: problem
      !> Always allocated afterwards
      type(error_t), allocatable, intent(inout) :: error

      call raise(error, input_error, location%path//': '//location%name//' '//problem)
   end subroutine reject

end module polydem_hdf5_location
