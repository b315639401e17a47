!> Parallel access to HDF5 files through MPI-IO (build with MPI).
!>
!> `serial/hdf5_access.f90` is the same module for builds without MPI. `enable_parallel_access` and
!> `enable_collective_write` only set properties; the HDF5 calls that use these properties are collective. HDF5
!> duplicates MPI_COMM_WORLD, so its messages do not mix with those of the program.
!>
!> A rank whose call to the file system fails cannot inform the other ranks: they wait for it inside HDF5 or MPI-IO.
!> Therefore this rank prints the reason and aborts all ranks at once, before HDF5 makes another call that waits for
!> other ranks. MPI-IO calls an error handler at the moment of a failure. Open MPI 4.1 does not call it if bytes cannot
!> be written; it only returns a smaller count. Therefore the write calls of HDF5 are intercepted in this module through
!> the MPI profiling interface: a program may define its own MPI_X, which calls PMPI_X.
module polydem_hdf5_access
   use, intrinsic :: iso_c_binding, only: c_associated, c_int, c_int64_t, c_ptr
   use, intrinsic :: iso_fortran_env, only: error_unit
   use hdf5, only: h5fd_mpio_collective_f, h5pset_dxpl_mpio_f, h5pset_fapl_mpio_f, hid_t
   use mpi_f08, only: mpi_abort, mpi_barrier, mpi_comm_rank, mpi_comm_world, mpi_errhandler, mpi_errhandler_free, &
      mpi_error_string, mpi_file, mpi_file_create_errhandler, mpi_file_get_info, mpi_file_null, &
      mpi_file_set_errhandler, mpi_info, mpi_info_create, mpi_info_free, mpi_info_get, mpi_info_set, &
      mpi_max_error_string, operator(==)
   use polydem_errors, only: io_error
   use polydem_file_system, only: disk_hint, last_failure
   use polydem_kinds, only: ip
   use polydem_posix, only: clear_error_number, error_number
   use polydem_strings, only: to_text
   implicit none
   private
   public :: enable_parallel_access, enable_collective_write, writes_replicated, abort_all, barrier

   !> H5FD_MPIO_INDIVIDUAL_IO of HDF5, which is missing from its Fortran interface
   integer(c_int), parameter :: individual_io = 1_c_int
   !> Key of the MPI info object that stores the path of a file; MPI keeps keys that it does not know
   character(len=*), parameter :: path_key = 'polydem_path'
   !> EIO of errno on Linux
   integer(c_int), parameter :: disk_fault = 5_c_int
   !> Maximum length of a path in a message
   integer, parameter :: path_length = 255

   abstract interface
      !> MPI function that writes or reads; handles of Open MPI are addresses
      integer(c_int) function transfer_at(file, offset, bytes, count, kind, status) bind(C)
         import :: c_int, c_int64_t, c_ptr
         type(c_ptr), value :: file, bytes, kind, status
         integer(c_int64_t), value :: offset
         integer(c_int), value :: count
      end function transfer_at
   end interface

   procedure(transfer_at), bind(C, name='PMPI_File_write_at') :: pmpi_write_at
   procedure(transfer_at), bind(C, name='PMPI_File_write_at_all') :: pmpi_write_at_all
   procedure(transfer_at), bind(C, name='PMPI_File_read_at') :: pmpi_read_at
   procedure(transfer_at), bind(C, name='PMPI_File_read_at_all') :: pmpi_read_at_all

   interface
      !> HDF5 function H5Pset_dxpl_mpio_collective_opt; hid_t has 64 bits since version 1.10
      integer(c_int) function set_collective_option(properties, option) &
         bind(C, name='H5Pset_dxpl_mpio_collective_opt')
         import :: c_int, c_int64_t
         integer(c_int64_t), value :: properties
         integer(c_int), value :: option
      end function set_collective_option

      !> Number of elements of a type that a call has written or read
      integer(c_int) function pmpi_get_count(status, kind, count) bind(C, name='PMPI_Get_count')
         import :: c_int, c_ptr
         type(c_ptr), value :: status, kind
         integer(c_int), intent(out) :: count
      end function pmpi_get_count

      !> Size of a type [B]
      integer(c_int) function pmpi_type_size(kind, bytes) bind(C, name='PMPI_Type_size_x')
         import :: c_int, c_int64_t, c_ptr
         type(c_ptr), value :: kind
         integer(c_int64_t), intent(out) :: bytes
      end function pmpi_type_size

      !> Fortran handle of a file
      integer(c_int) function pmpi_file_c2f(file) bind(C, name='PMPI_File_c2f')
         import :: c_int, c_ptr
         type(c_ptr), value :: file
      end function pmpi_file_c2f
   end interface

contains

   !> Enable parallel access to a file.
   subroutine enable_parallel_access(properties, path, status)
      !> HDF5 file access property list
      integer(hid_t), intent(in) :: properties
      !> Path of the file, for messages
      character(len=*), intent(in) :: path
      !> Negative on failure
      integer, intent(out) :: status
      type(mpi_errhandler) :: handler
      type(mpi_info) :: info

      ! All files that are opened from now on use this error handler.
      call mpi_file_create_errhandler(abort_on_failure, handler)
      call mpi_file_set_errhandler(mpi_file_null, handler)
      call mpi_errhandler_free(handler)
      call mpi_info_create(info)
      call mpi_info_set(info, path_key, path(max(1, len(path) - path_length + 1):))
      call h5pset_fapl_mpio_f(properties, mpi_comm_world%mpi_val, info%mpi_val, status)
      call mpi_info_free(info)
   end subroutine enable_parallel_access

   !> Enable collective writes. Each rank passes its own contiguous block to the operating system. Aggregation of blocks
   !> on other ranks would gain nothing, and Open MPI 4.1 waits for ever if one of several aggregating ranks finds the
   !> disk full.
   subroutine enable_collective_write(properties, status)
      !> HDF5 dataset transfer property list
      integer(hid_t), intent(in) :: properties
      !> Negative on failure
      integer, intent(out) :: status

      call h5pset_dxpl_mpio_f(properties, h5fd_mpio_collective_f, status)
      if (status >= 0) status = int(set_collective_option(int(properties, c_int64_t), individual_io))
   end subroutine enable_collective_write

   !> Whether this rank writes values that are equal on all ranks: true on the root rank
   logical function writes_replicated()
      integer :: rank

      call mpi_comm_rank(mpi_comm_world, rank)
      writes_replicated = rank == 0
   end function writes_replicated

   !> Print why this rank cannot write a file, and abort all ranks.
   subroutine abort_all(reason)
      !> Error message with the path of the file
      character(len=*), intent(in) :: reason
      integer :: rank

      call mpi_comm_rank(mpi_comm_world, rank)
      write (error_unit, '(a)') 'polydem: rank '//to_text(int(rank, ip))//': '//reason//disk_hint// &
         '; run the same command with --continue to resume'
      flush (error_unit)
      call mpi_abort(mpi_comm_world, io_error)
   end subroutine abort_all

   !> Barrier over all ranks. Ranks that failed never reach it.
   subroutine barrier()
      call mpi_barrier(mpi_comm_world)
   end subroutine barrier

   !> MPI-IO error handler: abort all ranks after a failed operation on a file. HDF5 reports a file that cannot be
   !> opened.
   subroutine abort_on_failure(file, code)
      type(mpi_file) :: file
      integer :: code
      character(len=mpi_max_error_string) :: reason
      integer :: length

      if (file == mpi_file_null) return
      call mpi_error_string(code, reason, length)
      call abort_all(path_of(file)//': cannot be written: '//reason(:length))
   end subroutine abort_on_failure

   !> Path of a file, from its MPI info object
   function path_of(file) result(path)
      type(mpi_file), intent(in) :: file
      character(len=:), allocatable :: path
      type(mpi_info) :: info
      character(len=path_length) :: text
      logical :: is_known

      call mpi_file_get_info(file, info)
      call mpi_info_get(info, path_key, path_length, text, is_known)
      path = 'a file'
      if (is_known) path = trim(text)
   end function path_of

   !> Replaces the MPI function of this name: it calls the original function and checks the count.
   integer(c_int) function write_at(file, offset, bytes, count, kind, status) bind(C, name='MPI_File_write_at')
      type(c_ptr), value :: file, bytes, kind, status
      integer(c_int64_t), value :: offset
      integer(c_int), value :: count

      write_at = pmpi_write_at(file, offset, bytes, count, kind, status)
      call check_count(file, count, kind, status)
   end function write_at

   !> Replaces the MPI function of this name: it calls the original function and checks the count.
   integer(c_int) function write_at_all(file, offset, bytes, count, kind, status) bind(C, name='MPI_File_write_at_all')
      type(c_ptr), value :: file, bytes, kind, status
      integer(c_int64_t), value :: offset
      integer(c_int), value :: count

      write_at_all = pmpi_write_at_all(file, offset, bytes, count, kind, status)
      call check_count(file, count, kind, status)
   end function write_at_all

   !> Replaces the MPI function of this name: it calls the original function and checks for a fault of the disk.
   integer(c_int) function read_at(file, offset, bytes, count, kind, status) bind(C, name='MPI_File_read_at')
      type(c_ptr), value :: file, bytes, kind, status
      integer(c_int64_t), value :: offset
      integer(c_int), value :: count

      call clear_error_number()
      read_at = pmpi_read_at(file, offset, bytes, count, kind, status)
      call check_reading(file)
   end function read_at

   !> Replaces the MPI function of this name: it calls the original function and checks for a fault of the disk.
   integer(c_int) function read_at_all(file, offset, bytes, count, kind, status) bind(C, name='MPI_File_read_at_all')
      type(c_ptr), value :: file, bytes, kind, status
      integer(c_int64_t), value :: offset
      integer(c_int), value :: count

      call clear_error_number()
      read_at_all = pmpi_read_at_all(file, offset, bytes, count, kind, status)
      call check_reading(file)
   end function read_at_all

   !> Abort all ranks if the disk could not be read. Open MPI then gives no data, like behind the end of the file, where
   !> HDF5 may read.
   subroutine check_reading(file)
      type(c_ptr), intent(in) :: file

      if (error_number() == disk_fault) call abort_all(path_of(mpi_file(pmpi_file_c2f(file)))//': cannot be read: '// &
                                                       last_failure())
   end subroutine check_reading

   !> Abort all ranks if fewer elements were written than requested.
   subroutine check_count(file, count, kind, status)
      type(c_ptr), intent(in) :: file, kind, status
      integer(c_int), intent(in) :: count
      character(len=:), allocatable :: reason
      integer(c_int) :: written, ignored
      integer(c_int64_t) :: bytes

      reason = last_failure()
      if (.not. c_associated(status)) return
      ignored = pmpi_type_size(kind, bytes)
      if (bytes*int(count, c_int64_t) == 0_c_int64_t) return
      ignored = pmpi_get_count(status, kind, written)
      if (written == count) return
      call abort_all(path_of(mpi_file(pmpi_file_c2f(file)))//': cannot be written: '//reason)
   end subroutine check_count

end module polydem_hdf5_access
