!> Handle of an HDF5 file: create, open, flush, query and close. Extended types read and write its contents.
module polydem_hdf5_handle
   use, intrinsic :: iso_c_binding, only: c_bool, c_int, c_int64_t
   use hdf5, only: h5f_acc_rdonly_f, h5f_acc_rdwr_f, h5f_acc_trunc_f, h5f_scope_global_f, h5fclose_f, h5fcreate_f, &
      h5fflush_f, h5fis_hdf5_f, h5fopen_f, h5f_libver_v18_f, h5p_file_access_f, h5p_file_create_f, h5pclose_f, &
      h5pcreate_f, h5pset_istore_k_f, h5pset_libver_bounds_f, h5pset_link_phase_change_f, h5pset_userblock_f, hid_t, &
      hsize_t
   use polydem_errors, only: error_t, input_error, io_error, raise, raise_unread
   use polydem_file_status, only: is_shared, is_stream
   use polydem_file_system, only: check_access, disk_hint, errno_message, exists, is_folder, remove_file
   use polydem_hdf5_access, only: enable_parallel_access, barrier, abort_all
   use polydem_hdf5_dataset, only: dataset_shape, has_link, start_library
   use polydem_hdf5_location, only: dataset_location_t, system_error
   use polydem_kinds, only: ip, lp
   implicit none
   private
   public :: hdf5_handle_t

   !> An open HDF5 file
   type :: hdf5_handle_t
      private
      !> HDF5 identifier of the file; negative if the file is closed
      integer(hid_t) :: id = -1_hid_t
      !> Path of the file
      character(len=:), allocatable :: path
      !> Whether extendible data sets are compressed
      logical :: compressed = .false.
      !> Whether all ranks of the run write the file in parallel
      logical :: together = .false.
   contains
      procedure :: create
      procedure :: join
      procedure :: open => open_file
      procedure :: flush => flush_file
      procedure :: close => close_file
      procedure :: abandon
      procedure :: has
      procedure :: shape_of
      procedure :: location_of
      procedure :: reject
      procedure, private :: check
   end type hdf5_handle_t

   !> Half the number of chunks in a node of the index of a data set. A node takes 32 bytes or more per chunk even if it
   !> is empty; the default is 32.
   integer, parameter :: chunk_index_k = 3
   !> Maximum number of links in a group that are stored in its header, without an index
   integer, parameter :: compact_links = 64

   interface
      !> HDF5 function H5Fset_dset_no_attrs_hint, which is missing from its Fortran interface: no room for attributes is
      !> reserved in the header of a data set. The header grows if attributes are added.
      integer(c_int) function set_small_headers(file, is_small) bind(C, name='H5Fset_dset_no_attrs_hint')
         import :: c_bool, c_int, c_int64_t
         integer(c_int64_t), value :: file
         logical(c_bool), value :: is_small
      end function set_small_headers
   end interface

   !> EAGAIN, ENOLCK, ENOSYS and EOPNOTSUPP of errno on Linux: another program has the lock, or there are no locks
   integer(c_int), parameter :: no_locks(4) = [11_c_int, 37_c_int, 38_c_int, 95_c_int]
   !> Hint for messages about existing files that cannot be opened
   character(len=*), parameter :: locking_hint = &
      '; another program may be writing it; on a network file system try HDF5_USE_FILE_LOCKING=FALSE'

contains

   !> Create a file for writing. An existing file of the same name is overwritten.
   subroutine create(self, path, error, compressed, user_block)
      class(hdf5_handle_t), intent(inout) :: self
      !> Path of the file
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(inout) :: error
      !> Whether extendible data sets are compressed (lossless); false if absent
      logical, intent(in), optional :: compressed
      !> Size of the user block, the first bytes of the file, which HDF5 does not use [B]: 0, 512 or a larger power of
      !> 2; 0 if absent
      integer(ip), intent(in), optional :: user_block
      integer(hid_t) :: properties, access
      integer(c_int) :: cause
      integer :: status, ignored

      if (is_shared(path)) call remove_file(path, error)
      call start_library(error)
      if (allocated(error)) return
      self%path = path
      self%together = .false.
      self%compressed = .false.
      if (present(compressed)) self%compressed = compressed
      call h5pcreate_f(h5p_file_create_f, properties, status)
      if (status >= 0 .and. present(user_block)) call h5pset_userblock_f(properties, int(user_block, hsize_t), status)
      if (status >= 0) call h5pset_istore_k_f(properties, chunk_index_k, status)
      if (status >= 0) call h5pset_link_phase_change_f(properties, compact_links, compact_links - 1, status)
      if (status >= 0) call h5pcreate_f(h5p_file_access_f, access, status)
      if (status >= 0) call h5pset_libver_bounds_f(access, h5f_libver_v18_f, h5f_libver_v18_f, status)
      if (status >= 0) call h5fcreate_f(path, h5f_acc_trunc_f, self%id, status, properties, access)
      cause = 0_c_int
      if (status < 0) cause = system_error()
      ! As in `open_file`, HDF5 may not tell why.
      if (status < 0 .and. cause == 0_c_int) then
         call h5fcreate_f(path, h5f_acc_trunc_f, self%id, status, properties, access)
         if (status < 0) cause = system_error()
      end if
      call h5pclose_f(properties, ignored)
      call h5pclose_f(access, ignored)
      if (status >= 0) status = int(set_small_headers(int(self%id, c_int64_t), .true._c_bool))
      if (status >= 0) return
      self%id = -1_hid_t
      if (cause /= 0_c_int .and. .not. any(cause == no_locks)) call raise(error, io_error, path// &
         ': cannot be created: '//errno_message(cause)//disk_hint)
      call raise(error, io_error, path//': cannot be created; check that the folder exists, '// &
                 'that you may write there and that the disk is not full'//locking_hint)
   end subroutine create

   !> Open a file for parallel writing by all ranks of the run. One rank must have created and closed it before. Until
   !> the file is closed, all ranks must make the same calls in the same order. A rank that fails aborts all ranks.
   subroutine join(self, path, error)
      class(hdf5_handle_t), intent(inout) :: self
      !> Path of the file
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(inout) :: error
      integer(hid_t) :: properties
      integer :: status, ignored

      call start_library(error)
      if (allocated(error)) return
      ! Open MPI waits for ever for a rank that cannot open the file.
      call check_access(path, error)
      if (allocated(error)) call abort_all(error%message//'; all ranks must see the same folder')
      self%path = path
      self%together = .true.
      call h5pcreate_f(h5p_file_access_f, properties, status)
      if (status >= 0) call h5pset_libver_bounds_f(properties, h5f_libver_v18_f, h5f_libver_v18_f, status)
      if (status >= 0) call enable_parallel_access(properties, path, status)
      if (status >= 0) call h5fopen_f(path, h5f_acc_rdwr_f, self%id, status, access_prp=properties)
      call h5pclose_f(properties, ignored)
      if (status >= 0) status = int(set_small_headers(int(self%id, c_int64_t), .true._c_bool))
      call self%check(status, 'cannot be opened by all ranks; all ranks must see the same folder'//locking_hint, error)
   end subroutine join

   !> Open a file for reading.
   subroutine open_file(self, path, error)
      class(hdf5_handle_t), intent(inout) :: self
      !> Path of the file
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(inout) :: error
      logical :: is_hdf5
      integer(c_int) :: cause
      integer :: status

      if (.not. exists(path, error)) call raise(error, input_error, path//': there is no such file')
      if (is_folder(path, error)) call raise(error, input_error, path//': is a folder, not a file')
      if (is_stream(path)) call raise(error, input_error, path//': is a pipe or a device, not an HDF5 file')
      if (.not. allocated(error)) call start_library(error)
      if (allocated(error)) return
      self%path = path
      self%together = .false.
      call h5fopen_f(path, h5f_acc_rdonly_f, self%id, status)
      if (status >= 0) return
      cause = system_error()
      ! HDF5 does not tell why it cannot look for a file, the first thing that it does.
      if (cause == 0_c_int) call h5fopen_f(path, h5f_acc_rdonly_f, self%id, status)
      if (status >= 0) return
      if (cause == 0_c_int) cause = system_error()
      self%id = -1_hid_t
      if (cause /= 0_c_int .and. .not. any(cause == no_locks)) then
         call raise_unread(error, path, errno_message(cause))
         return
      end if
      call h5fis_hdf5_f(path, is_hdf5, status)
      if (status >= 0 .and. .not. is_hdf5) then
         call raise(error, io_error, path//': is not an HDF5 file')
      else
         call raise(error, io_error, path//': cannot be opened as an HDF5 file; it may be truncated or damaged'// &
                    locking_hint)
      end if
   end subroutine open_file

   !> Pass all written data to the operating system. They then survive a crash of the program.
   subroutine flush_file(self, error)
      class(hdf5_handle_t), intent(in) :: self
      type(error_t), allocatable, intent(inout) :: error
      integer :: status

      call h5fflush_f(self%id, h5f_scope_global_f, status)
      call self%check(status, 'cannot be flushed', error)
   end subroutine flush_file

   !> Close the file; nothing happens if it is already closed. A file that cannot be closed is abandoned.
   subroutine close_file(self, error)
      class(hdf5_handle_t), intent(inout) :: self
      type(error_t), allocatable, intent(inout) :: error
      type(error_t), allocatable :: failure
      integer :: status

      if (self%id < 0_hid_t) return
      ! MPI-IO does not report a failure to close a file, but it reports a failure to flush it.
      if (self%together) call self%flush(failure)
      call h5fclose_f(self%id, status)
      call self%check(status, 'cannot be closed', failure)
      if (self%together) call barrier()
      if (allocated(failure)) then
         call self%abandon(failure)
         if (.not. allocated(error)) call move_alloc(failure, error)
      end if
      self%id = -1_hid_t
   end subroutine close_file

   !> Convert a failed status of HDF5 into an error. If the file is written in parallel, abort all ranks.
   subroutine check(self, status, problem, error)
      class(hdf5_handle_t), intent(in) :: self
      !> Status of the call on this rank
      integer, intent(in) :: status
      !> Error message if the status is negative
      character(len=*), intent(in) :: problem
      type(error_t), allocatable, intent(inout) :: error

      if (status >= 0) return
      if (self%together) call abort_all(self%path//': '//problem)
      call raise(error, io_error, self%path//': '//problem)
   end subroutine check

   !> Abandon a file that could not be written, and add a hint to the error message. The file is not closed, because
   !> HDF5 would try to write it again and might crash. The operating system closes it when the program ends.
   subroutine abandon(self, error)
      class(hdf5_handle_t), intent(inout) :: self
      !> Error of the failed write; its message gets a hint
      type(error_t), intent(inout) :: error

      if (self%id < 0_hid_t) return
      self%id = -1_hid_t
      if (index(error%message, disk_hint) == 0) error%message = error%message//disk_hint
   end subroutine abandon

   !> Whether the file contains a group or data set of this name
   logical function has(self, name, error)
      class(hdf5_handle_t), intent(in) :: self
      !> Name like /frames/position
      character(len=*), intent(in) :: name
      !> Allocated if the file cannot be read; false if it is allocated before
      type(error_t), allocatable, intent(inout) :: error

      has = .false.
      if (.not. allocated(error)) has = has_link(self%location_of(name), error)
   end function has

   !> Read the shape of a data set in the order of h5py, with the slowest dimension first.
   subroutine shape_of(self, name, shape, error)
      class(hdf5_handle_t), intent(in) :: self
      !> Name of the data set
      character(len=*), intent(in) :: name
      !> Shape; empty for a scalar
      integer(lp), allocatable, intent(out) :: shape(:)
      !> Allocated if the data set is missing, or if it claims more data than the file can hold; nothing happens if it
      !> is allocated before
      type(error_t), allocatable, intent(inout) :: error
      integer(hsize_t), allocatable :: extent(:)

      if (allocated(error)) return
      call dataset_shape(self%location_of(name), extent, error, is_checked=.true.)
      if (allocated(error)) return
      shape = int(extent(size(extent):1:-1), lp)
   end subroutine shape_of

   !> Report that the contents of the file are not as they must be.
   pure subroutine reject(self, problem, error)
      class(hdf5_handle_t), intent(in) :: self
      !> The defect; the message names the file before it
      character(len=*), intent(in) :: problem
      !> Always allocated afterwards
      type(error_t), allocatable, intent(inout) :: error

      call raise(error, input_error, self%path//': '//problem)
   end subroutine reject

   !> Location of a data set, for the procedures of `polydem_hdf5_dataset`
   function location_of(self, name) result(location)
      class(hdf5_handle_t), intent(in) :: self
      !> Name of the data set
      character(len=*), intent(in) :: name
      type(dataset_location_t) :: location

      location%file = self%id
      location%path = self%path
      location%name = name
      location%compressed = self%compressed
      location%together = self%together
   end function location_of

end module polydem_hdf5_handle
