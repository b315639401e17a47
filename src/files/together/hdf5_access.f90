!> How files are written by several processes: by HDF5 upon MPI-IO.
!>
!> `alone/hdf5_access.f90` is the same module for builds without MPI. The first two procedures only note a wish in
!> properties; what follows from it is collective. HDF5 duplicates MPI_COMM_WORLD, so that its messages do not mix with
!> others.
!>
!> A process whose call to the file system fails cannot let the others know: they wait for it inside HDF5 or MPI-IO, at
!> places that depend on which call it was. So it says what failed and ends all processes at once, before HDF5 goes on
!> to a call in which it would wait, too: MPI-IO calls a handler at the moment of the failure. Open MPI 4.1 does not if
!> bytes cannot be written, it only counts fewer; so calls of HDF5 that write pass through here, by way of what MPI
!> calls its profiling interface: a program may have its own MPI_X, which calls PMPI_X.
module polydem_hdf5_access
   use, intrinsic :: iso_c_binding, only: c_associated, c_int, c_int64_t, c_ptr
   use, intrinsic :: iso_fortran_env, only: error_unit
   use hdf5, only: h5fd_mpio_collective_f, h5pset_dxpl_mpio_f, h5pset_fapl_mpio_f, hid_t
   use mpi_f08, only: mpi_abort, mpi_barrier, mpi_comm_rank, mpi_comm_world, mpi_errhandler, mpi_errhandler_free, &
      mpi_error_string, mpi_file, mpi_file_create_errhandler, mpi_file_get_info, mpi_file_null, &
      mpi_file_set_errhandler, mpi_info, mpi_info_create, mpi_info_free, mpi_info_get, mpi_info_set, &
      mpi_max_error_string, operator(==)
   use polydem_errors, only: io_error
   use polydem_kinds, only: ip
   use polydem_paths, only: disk_hint, last_failure
   use polydem_strings, only: to_text
   implicit none
   private
   public :: access_together, transfer_together, writes_shared, give_up, await_all

   !> H5FD_MPIO_INDIVIDUAL_IO of HDF5, which its Fortran interface lacks
   integer(c_int), parameter :: individually = 1_c_int
   !> Name under which the path of a file is kept with it: MPI keeps names that it does not know
   character(len=*), parameter :: path_key = 'polydem_path'
   !> Longest path that a message shows
   integer, parameter :: path_length = 255

   interface
      !> HDF5's H5Pset_dxpl_mpio_collective_opt; its numbers of properties have 64 bits since version 1.10
      integer(c_int) function set_collective_option(properties, option) &
         bind(C, name='H5Pset_dxpl_mpio_collective_opt')
         import :: c_int, c_int64_t
         integer(c_int64_t), value :: properties
         integer(c_int), value :: option
      end function set_collective_option

      !> MPI's function that writes; handles of Open MPI are addresses
      integer(c_int) function pmpi_write_at(file, offset, bytes, count, kind, status) &
         bind(C, name='PMPI_File_write_at')
         import :: c_int, c_int64_t, c_ptr
         type(c_ptr), value :: file, bytes, kind, status
         integer(c_int64_t), value :: offset
         integer(c_int), value :: count
      end function pmpi_write_at

      !> The same, called by all processes
      integer(c_int) function pmpi_write_at_all(file, offset, bytes, count, kind, status) &
         bind(C, name='PMPI_File_write_at_all')
         import :: c_int, c_int64_t, c_ptr
         type(c_ptr), value :: file, bytes, kind, status
         integer(c_int64_t), value :: offset
         integer(c_int), value :: count
      end function pmpi_write_at_all

      !> How many numbers of a kind a call has written
      integer(c_int) function pmpi_get_count(status, kind, count) bind(C, name='PMPI_Get_count')
         import :: c_int, c_ptr
         type(c_ptr), value :: status, kind
         integer(c_int), intent(out) :: count
      end function pmpi_get_count

      !> Bytes of a number of a kind
      integer(c_int) function pmpi_type_size(kind, bytes) bind(C, name='PMPI_Type_size_x')
         import :: c_int, c_int64_t, c_ptr
         type(c_ptr), value :: kind
         integer(c_int64_t), intent(out) :: bytes
      end function pmpi_type_size

      !> Fortran's handle of a file
      integer(c_int) function pmpi_file_c2f(file) bind(C, name='PMPI_File_c2f')
         import :: c_int, c_ptr
         type(c_ptr), value :: file
      end function pmpi_file_c2f
   end interface

contains

   !> Let a file be opened by all processes.
   subroutine access_together(properties, path, status)
      !> HDF5's properties of access to the file
      integer(hid_t), intent(in) :: properties
      !> Path of the file, for messages
      character(len=*), intent(in) :: path
      !> Negative on failure
      integer, intent(out) :: status
      type(mpi_errhandler) :: handler
      type(mpi_info) :: info

      ! Files that are opened from now on have this handler.
      call mpi_file_create_errhandler(end_all, handler)
      call mpi_file_set_errhandler(mpi_file_null, handler)
      call mpi_errhandler_free(handler)
      call mpi_info_create(info)
      call mpi_info_set(info, path_key, path(max(1, len(path) - path_length + 1):))
      call h5pset_fapl_mpio_f(properties, mpi_comm_world%mpi_val, info%mpi_val, status)
      call mpi_info_free(info)
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

   !> Say why this process cannot write a file, and end all processes.
   subroutine give_up(reason)
      !> What is wrong, with the path of the file
      character(len=*), intent(in) :: reason
      integer :: rank

      call mpi_comm_rank(mpi_comm_world, rank)
      write (error_unit, '(a)') 'polydem: rank '//to_text(int(rank, ip))//': '//reason//disk_hint// &
         '; the same command with --continue goes on'
      flush (error_unit)
      call mpi_abort(mpi_comm_world, io_error)
   end subroutine give_up

   !> Wait until all processes have come here; those that failed do not.
   subroutine await_all()
      call mpi_barrier(mpi_comm_world)
   end subroutine await_all

   !> What MPI-IO calls when an operation upon a file has failed on this process. A file that could not be opened is
   !> left to HDF5.
   subroutine end_all(file, code)
      type(mpi_file) :: file
      integer :: code
      character(len=mpi_max_error_string) :: reason
      integer :: length

      if (file == mpi_file_null) return
      call mpi_error_string(code, reason, length)
      call give_up(path_of(file)//': cannot be written: '//reason(:length))
   end subroutine end_all

   !> The path that was noted for a file
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

   !> Stands in front of MPI's function of this name.
   integer(c_int) function write_at(file, offset, bytes, count, kind, status) bind(C, name='MPI_File_write_at')
      type(c_ptr), value :: file, bytes, kind, status
      integer(c_int64_t), value :: offset
      integer(c_int), value :: count

      write_at = pmpi_write_at(file, offset, bytes, count, kind, status)
      call check_count(file, count, kind, status)
   end function write_at

   !> Stands in front of MPI's function of this name.
   integer(c_int) function write_at_all(file, offset, bytes, count, kind, status) bind(C, name='MPI_File_write_at_all')
      type(c_ptr), value :: file, bytes, kind, status
      integer(c_int64_t), value :: offset
      integer(c_int), value :: count

      write_at_all = pmpi_write_at_all(file, offset, bytes, count, kind, status)
      call check_count(file, count, kind, status)
   end function write_at_all

   !> End all processes if fewer numbers were written than there are.
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
      call give_up(path_of(mpi_file(pmpi_file_c2f(file)))//': cannot be written: '//reason)
   end subroutine check_count

end module polydem_hdf5_access
