!> Locations of data sets, and errors of HDF5 calls that name the location and the cause.
module polydem_hdf5_location
   use, intrinsic :: iso_c_binding, only: c_associated, c_f_pointer, c_funloc, c_funptr, c_int, c_int64_t, c_loc, c_ptr
   use hdf5, only: hid_t
   use polydem_errors, only: error_t, input_error, io_error, raise
   use polydem_file_system, only: errno_message
   use polydem_hdf5_access, only: abort_all
   use polydem_kinds, only: lp
   use polydem_posix, only: text_at
   implicit none
   private
   public :: dataset_location_t, check_status, system_error, reject

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
      !> Number of rows that belong together: a chunk has a multiple of it
      integer(lp) :: batch = 1_lp
   end type dataset_location_t

   !> H5E_error2_t of HDF5: an entry of its stack of errors
   type, bind(C) :: stack_entry_t
      !> Identifiers of the class and of the kind of error
      integer(c_int64_t) :: class_id, major_id, minor_id
      !> Line of the source of HDF5
      integer(c_int) :: line
      !> Its function and file, and the description
      type(c_ptr) :: procedure_name, file_name, description
   end type stack_entry_t

   interface
      !> HDF5 function H5Ewalk2, which is missing from its Fortran interface
      integer(c_int) function h5ewalk2(stack, direction, visit, found) bind(C, name='H5Ewalk2')
         import :: c_funptr, c_int, c_int64_t, c_ptr
         integer(c_int64_t), value :: stack
         integer(c_int), value :: direction
         type(c_funptr), value :: visit
         type(c_ptr), value :: found
      end function h5ewalk2
   end interface

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
      character(len=:), allocatable :: message
      integer(c_int) :: cause

      if (status >= 0) return
      cause = system_error()
      message = location%path//': cannot '//action//' '//location%name
      if (cause /= 0_c_int) message = message//': '//errno_message(cause)
      if (location%together) call abort_all(message)
      if (allocated(error)) return
      call raise(error, io_error, message)
      error%is_unread = cause /= 0_c_int
   end subroutine check_status

   !> Number of the error of the system that made the last call of HDF5 fail; 0 if there is none. The next call of HDF5
   !> forgets it.
   integer(c_int) function system_error()
      integer(c_int), parameter :: present_stack = 0_c_int, inwards = 0_c_int
      integer(c_int), target :: found
      integer(c_int) :: ignored

      found = 0_c_int
      ignored = h5ewalk2(int(present_stack, c_int64_t), inwards, c_funloc(find_error_number), c_loc(found))
      system_error = found
   end function system_error

   !> Read the error number from an entry of the stack of errors, whose description then has the words 'errno = N,'.
   integer(c_int) function find_error_number(k, entry, found) bind(C)
      integer(c_int), value :: k
      type(stack_entry_t), intent(in) :: entry
      type(c_ptr), value :: found
      character(len=*), parameter :: words = 'errno = '
      character(len=:), allocatable :: text
      integer(c_int), pointer :: number
      integer :: first, last, status

      find_error_number = 0_c_int
      if (k < 0_c_int .or. .not. c_associated(entry%description)) return
      text = text_at(entry%description)
      first = index(text, words) + len(words)
      if (first == len(words)) return
      last = index(text(first:), ',')
      call c_f_pointer(found, number)
      if (last > 1 .and. number == 0_c_int) read (text(first:first + last - 2), *, iostat=status) number
   end function find_error_number

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
