!> Hyperslabs: values in memory and their position in a data set that all ranks may write in parallel.
!>
!> Shapes have the Fortran order, with the fastest dimension first. Values that are not distributed over ranks are equal
!> on all ranks, and one rank writes them. All ranks make each HDF5 write call; ranks without data select nothing.
module polydem_hdf5_hyperslab
   use, intrinsic :: iso_c_binding, only: c_ptr
   use hdf5, only: h5dget_space_f, h5dread_f, h5dwrite_f, h5p_dataset_xfer_f, h5pclose_f, h5pcreate_f, &
      h5pset_buffer_f, h5s_select_set_f, h5sclose_f, h5screate_simple_f, h5sselect_hyperslab_f, h5sselect_none_f, &
      hid_t, hsize_t
   use polydem_errors, only: error_t
   use polydem_hdf5_access, only: enable_collective_write, writes_replicated
   use polydem_hdf5_location, only: check_status, dataset_location_t
   use polydem_kinds, only: lp
   implicit none
   private
   public :: part_t, slab_t, slab_of, write_slab, read_slab

   !> Size of the buffer in which HDF5 converts values to or from their type in the file [B]. HDF5 clears it in each
   !> call; with its own choice of 1 MiB that takes longer than to write a small frame
   integer(hsize_t), parameter :: buffer_size = 65536_hsize_t

   !> Part of the last dimension of an array that belongs to this rank
   type :: part_t
      !> Number of indices of lower ranks, before the first index of this rank
      integer(lp) :: first = 0_lp
      !> Number of indices of all ranks
      integer(lp) :: total = 0_lp
   end type part_t

   !> Values in memory as part of a data set
   type :: slab_t
      !> Shape of the data set
      integer(hsize_t), allocatable :: whole(:)
      !> Start of the part in the data set, counted from 0
      integer(hsize_t), allocatable :: start(:)
      !> Shape of the part; empty for a scalar
      integer(hsize_t), allocatable :: extent(:)
      !> Whether this rank has nothing to write
      logical :: is_empty = .false.
      !> Address of the first of the contiguous values
      type(c_ptr) :: address
   end type slab_t

contains

   !> Create the slab of an array
   function slab_of(location, extent, address, dimension, part) result(slab)
      !> File and data set
      type(dataset_location_t), intent(in) :: location
      !> Shape of the array; empty for a scalar
      integer(hsize_t), intent(in) :: extent(:)
      !> Address of the first value
      type(c_ptr), intent(in) :: address
      !> Dimension that is distributed over ranks if `part` is present
      integer, intent(in) :: dimension
      !> Part of this dimension that this rank has; if absent, the array is equal on all ranks
      type(part_t), intent(in), optional :: part
      type(slab_t) :: slab

      slab%whole = extent
      slab%start = 0_hsize_t*extent
      slab%extent = extent
      slab%address = address
      slab%is_empty = product(extent) == 0_hsize_t
      if (present(part)) then
         slab%whole(dimension) = int(part%total, hsize_t)
         slab%start(dimension) = int(part%first, hsize_t)
      else if (location%together .and. .not. slab%is_empty) then
         slab%is_empty = .not. writes_replicated()
      end if
   end function slab_of

   !> Write a slab into a data set. The call is collective if the file is written in parallel.
   subroutine write_slab(dataset, location, kind_in_memory, slab, error)
      !> HDF5 identifiers of the open data set and of the type in memory
      integer(hid_t), intent(in) :: dataset, kind_in_memory
      type(dataset_location_t), intent(in) :: location
      !> Values, and their position in the data set
      type(slab_t), intent(in) :: slab
      type(error_t), allocatable, intent(inout) :: error
      integer(hid_t) :: file_space, memory_space, properties
      integer :: status, ignored

      properties = -1_hid_t
      call open_spaces(dataset, slab, memory_space, file_space, status)
      if (status >= 0) call open_transfer(properties, status)
      if (status >= 0 .and. location%together) call enable_collective_write(properties, status)
      if (status >= 0) call h5dwrite_f(dataset, kind_in_memory, slab%address, status, memory_space, file_space, &
                                       properties)
      call check_status(status, 'write', location, error)
      call h5pclose_f(properties, ignored)
      call h5sclose_f(file_space, ignored)
      call h5sclose_f(memory_space, ignored)
   end subroutine write_slab

   !> Read a slab of a data set.
   subroutine read_slab(dataset, location, kind_in_memory, slab, error)
      !> HDF5 identifiers of the open data set and of the type in memory
      integer(hid_t), intent(in) :: dataset, kind_in_memory
      type(dataset_location_t), intent(in) :: location
      !> Position in the data set, and the array to fill
      type(slab_t), intent(in) :: slab
      type(error_t), allocatable, intent(inout) :: error
      integer(hid_t) :: file_space, memory_space, properties
      type(c_ptr) :: buffer
      integer :: status, ignored

      buffer = slab%address
      properties = -1_hid_t
      call open_spaces(dataset, slab, memory_space, file_space, status)
      if (status >= 0) call open_transfer(properties, status)
      if (status >= 0) call h5dread_f(dataset, kind_in_memory, buffer, status, memory_space, file_space, properties)
      call check_status(status, 'read', location, error)
      call h5pclose_f(properties, ignored)
      call h5sclose_f(file_space, ignored)
      call h5sclose_f(memory_space, ignored)
   end subroutine read_slab

   !> Create the properties of a transfer.
   subroutine open_transfer(properties, status)
      integer(hid_t), intent(out) :: properties
      integer, intent(out) :: status

      call h5pcreate_f(h5p_dataset_xfer_f, properties, status)
      if (status >= 0) call h5pset_buffer_f(properties, buffer_size, status)
   end subroutine open_transfer

   !> Create the data spaces of a slab in memory and in the file.
   subroutine open_spaces(dataset, slab, memory_space, file_space, status)
      integer(hid_t), intent(in) :: dataset
      type(slab_t), intent(in) :: slab
      integer(hid_t), intent(out) :: memory_space, file_space
      integer, intent(out) :: status

      file_space = -1_hid_t
      call h5screate_simple_f(size(slab%extent), slab%extent, memory_space, status)
      if (status >= 0) call h5dget_space_f(dataset, file_space, status)
      if (status < 0) return
      if (slab%is_empty) then
         call h5sselect_none_f(file_space, status)
         if (status >= 0) call h5sselect_none_f(memory_space, status)
      else if (size(slab%extent) > 0) then
         call h5sselect_hyperslab_f(file_space, h5s_select_set_f, slab%start, slab%extent, status)
      end if
   end subroutine open_spaces

end module polydem_hdf5_hyperslab
