!> Slabs: numbers in memory, and which part they are of the numbers that all processes write together.
!>
!> Shapes are in the order of Fortran, the fastest dimension first. What is not spread over processes is the same on
!> all of them, and one writes it; calls of HDF5 that write are made by all, those with nothing to write select nothing.
module polydem_hdf5_slab
   use, intrinsic :: iso_c_binding, only: c_ptr
   use hdf5, only: h5dget_space_f, h5dread_f, h5dwrite_f, h5p_dataset_xfer_f, h5pclose_f, h5pcreate_f, &
      h5s_select_set_f, h5sclose_f, h5screate_simple_f, h5sselect_hyperslab_f, h5sselect_none_f, hid_t, hsize_t
   use polydem_errors, only: error_t
   use polydem_hdf5_access, only: transfer_together, writes_shared
   use polydem_hdf5_place, only: expect, place_t
   use polydem_kinds, only: lp
   implicit none
   private
   public :: part_t, slab_t, slab_of, write_slab, read_slab

   !> Which places along the last dimension of values belong to this process
   type :: part_t
      !> Places before its first one
      integer(lp) :: first = 0_lp
      !> Places of all processes
      integer(lp) :: total = 0_lp
   end type part_t

   !> Numbers in memory, as part of a whole
   type :: slab_t
      !> Shape of the whole
      integer(hsize_t), allocatable :: whole(:)
      !> First place of the part in the whole, counted from 0
      integer(hsize_t), allocatable :: start(:)
      !> Shape of the part; empty for a scalar
      integer(hsize_t), allocatable :: extent(:)
      !> Whether this process has nothing to write
      logical :: is_empty = .false.
      !> Address of the first of the contiguous numbers
      type(c_ptr) :: address
   end type slab_t

contains

   !> The slab of some numbers
   function slab_of(place, extent, address, dimension, part) result(slab)
      !> File and data set
      type(place_t), intent(in) :: place
      !> Shape of the numbers; empty for a scalar
      integer(hsize_t), intent(in) :: extent(:)
      !> Address of the first of them
      type(c_ptr), intent(in) :: address
      !> Dimension that is spread over processes, if one is
      integer, intent(in) :: dimension
      !> This process' part of it; if absent, the numbers are the same on all processes
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
      else if (place%together .and. .not. slab%is_empty) then
         slab%is_empty = .not. writes_shared()
      end if
   end function slab_of

   !> Write a slab into a data set; of a file that processes write together, on all of them.
   subroutine write_slab(dataset, place, kind_in_memory, slab, error)
      !> HDF5's number of the open data set, and its type in memory
      integer(hid_t), intent(in) :: dataset, kind_in_memory
      !> File and name
      type(place_t), intent(in) :: place
      !> What to write, and where to
      type(slab_t), intent(in) :: slab
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error
      integer(hid_t) :: file_space, memory_space, properties
      integer :: status, ignored

      call open_spaces(dataset, slab, memory_space, file_space, status)
      if (status >= 0) call h5pcreate_f(h5p_dataset_xfer_f, properties, status)
      if (status >= 0 .and. place%together) call transfer_together(properties, status)
      if (status >= 0) call h5dwrite_f(dataset, kind_in_memory, slab%address, status, memory_space, file_space, &
                                       properties)
      call expect(status, 'write', place, error)
      call h5pclose_f(properties, ignored)
      call h5sclose_f(file_space, ignored)
      call h5sclose_f(memory_space, ignored)
   end subroutine write_slab

   !> Read a slab of a data set.
   subroutine read_slab(dataset, place, kind_in_memory, slab, error)
      !> HDF5's number of the open data set, and its type in memory
      integer(hid_t), intent(in) :: dataset, kind_in_memory
      !> File and name
      type(place_t), intent(in) :: place
      !> What to read, and room for it
      type(slab_t), intent(in) :: slab
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error
      integer(hid_t) :: file_space, memory_space
      type(c_ptr) :: buffer
      integer :: status, ignored

      buffer = slab%address
      call open_spaces(dataset, slab, memory_space, file_space, status)
      if (status >= 0) call h5dread_f(dataset, kind_in_memory, buffer, status, memory_space, file_space)
      call expect(status, 'read', place, error)
      call h5sclose_f(file_space, ignored)
      call h5sclose_f(memory_space, ignored)
   end subroutine read_slab

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

end module polydem_hdf5_slab
