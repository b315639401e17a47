!> HDF5 files: the interface of this layer for all others. It writes and reads named numbers and texts.
!>
!> Names have the form /frames/position; missing groups are created. Real numbers in files are always double precision.
!> An array (2, n) appears as (n, 2) in h5py, because the fastest dimension is the first in Fortran and the last in
!> h5py. Files have the default format of HDF5; flushed data remain readable after the program is killed. All calls must
!> come from one thread.
module polydem_hdf5_file
   use, intrinsic :: iso_c_binding, only: c_loc
   use hdf5, only: h5_real_kind, h5kind_to_type, hsize_t
   use polydem_errors, only: error_t
   use polydem_hdf5_dataset, only: dataset_shape, holds_integers, holds_reals, library_version, &
      read_dataset, shape_text, start_library
   use polydem_hdf5_hyperslab, only: part_t
   use polydem_hdf5_location, only: dataset_location_t, reject
   use polydem_hdf5_strings, only: read_attribute_value, read_text
   use polydem_hdf5_writer, only: hdf5_writer_t, many_rows, one_row
   use polydem_kinds, only: dp, ip, lp
   use polydem_strings, only: counted, to_text
   implicit none
   private
   public :: hdf5_file_t, part_t, one_row, many_rows, library_version, start_library

   !> An HDF5 file: create, join (for parallel writing), open (for reading), flush, close, has, shape_of, write,
   !> write_attribute, read
   type, extends(hdf5_writer_t) :: hdf5_file_t
   contains
      !> Read a data set into an allocatable: read(name, values, error). Integers in the file may have any width, or be
      !> booleans of h5py. With `rows` only some rows along the slowest dimension are read. Nothing happens if `error`
      !> is allocated before.
      generic :: read => read_reals, read_real_table, read_real_block, read_integers, read_longs, &
         read_one_text
      procedure :: read_real_attribute
      procedure, private :: read_reals, read_real_table, read_real_block, read_integers, read_longs
      procedure, private :: read_one_text
   end type hdf5_file_t

contains

   !> Read real numbers. The other forms of `read` differ only in kind and shape.
   subroutine read_reals(self, name, values, error, rows)
      class(hdf5_file_t), intent(in) :: self
      !> Name of the data set
      character(len=*), intent(in) :: name
      !> Values of the data set, fastest dimension first
      real(dp), allocatable, target, intent(out) :: values(:)
      !> Allocated on failure, or if the data set has another number of dimensions
      type(error_t), allocatable, intent(inout) :: error
      !> Number of rows before the rows to read, and number of rows to read; default: all rows
      integer(lp), intent(in), optional :: rows(2)
      integer(hsize_t), allocatable :: start(:), extent(:)

      call choose_rows(self%location_of(name), 1, rows, start, extent, error)
      if (allocated(error)) return
      allocate (values(extent(1)))
      call read_dataset(self%location_of(name), holds_reals, start, extent, c_loc(values), error)
   end subroutine read_reals

   subroutine read_real_table(self, name, values, error, rows)
      class(hdf5_file_t), intent(in) :: self
      character(len=*), intent(in) :: name
      real(dp), allocatable, target, intent(out) :: values(:, :)
      type(error_t), allocatable, intent(inout) :: error
      integer(lp), intent(in), optional :: rows(2)
      integer(hsize_t), allocatable :: start(:), extent(:)

      call choose_rows(self%location_of(name), 2, rows, start, extent, error)
      if (allocated(error)) return
      allocate (values(extent(1), extent(2)))
      call read_dataset(self%location_of(name), holds_reals, start, extent, c_loc(values), error)
   end subroutine read_real_table

   subroutine read_real_block(self, name, values, error, rows)
      class(hdf5_file_t), intent(in) :: self
      character(len=*), intent(in) :: name
      real(dp), allocatable, target, intent(out) :: values(:, :, :)
      type(error_t), allocatable, intent(inout) :: error
      integer(lp), intent(in), optional :: rows(2)
      integer(hsize_t), allocatable :: start(:), extent(:)

      call choose_rows(self%location_of(name), 3, rows, start, extent, error)
      if (allocated(error)) return
      allocate (values(extent(1), extent(2), extent(3)))
      call read_dataset(self%location_of(name), holds_reals, start, extent, c_loc(values), error)
   end subroutine read_real_block

   subroutine read_longs(self, name, values, error, rows)
      class(hdf5_file_t), intent(in) :: self
      character(len=*), intent(in) :: name
      integer(lp), allocatable, target, intent(out) :: values(:)
      type(error_t), allocatable, intent(inout) :: error
      integer(lp), intent(in), optional :: rows(2)
      integer(hsize_t), allocatable :: start(:), extent(:)

      call choose_rows(self%location_of(name), 1, rows, start, extent, error)
      if (allocated(error)) return
      allocate (values(extent(1)))
      call read_dataset(self%location_of(name), holds_integers, start, extent, c_loc(values), error)
   end subroutine read_longs

   !> Read 64-bit integers and check their range, because HDF5 clips values beyond 32 bits without an error.
   subroutine read_integers(self, name, values, error)
      class(hdf5_file_t), intent(in) :: self
      character(len=*), intent(in) :: name
      integer(ip), allocatable, intent(out) :: values(:)
      type(error_t), allocatable, intent(inout) :: error
      integer(lp), allocatable :: wide(:)

      call self%read_longs(name, wide, error)
      if (allocated(error)) return
      if (any(wide > huge(1_ip) .or. wide < -huge(1_ip))) then
         call reject(self%location_of(name), 'holds numbers beyond 32 bits', error)
      else
         values = int(wide, ip)
      end if
   end subroutine read_integers

   subroutine read_one_text(self, name, text, error)
      class(hdf5_file_t), intent(in) :: self
      character(len=*), intent(in) :: name
      character(len=:), allocatable, intent(out) :: text
      type(error_t), allocatable, intent(inout) :: error

      if (allocated(error)) return
      call read_text(self%location_of(name), text, error)
   end subroutine read_one_text

   !> Read a real attribute of a group or data set.
   subroutine read_real_attribute(self, object, name, value, error)
      class(hdf5_file_t), intent(in) :: self
      !> Group or data set, and name of the attribute
      character(len=*), intent(in) :: object, name
      !> The number; unchanged if the attribute does not exist
      real(dp), intent(inout), target :: value
      !> Allocated if the attribute cannot be read; nothing happens if it is allocated before
      type(error_t), allocatable, intent(inout) :: error
      logical :: there

      if (allocated(error)) return
      call read_attribute_value(self%location_of(object), name, h5kind_to_type(dp, h5_real_kind), c_loc(value), there, &
                                error)
   end subroutine read_real_attribute

   !> Choose the part of a data set to read, and check that it exists.
   subroutine choose_rows(location, rank, rows, start, extent, error)
      type(dataset_location_t), intent(in) :: location
      !> Required number of dimensions
      integer, intent(in) :: rank
      !> Number of rows before the rows to read, and number of rows to read; absent: all rows
      integer(lp), intent(in), optional :: rows(2)
      !> Start and shape of the part, fastest dimension first
      integer(hsize_t), allocatable, intent(out) :: start(:), extent(:)
      !> Allocated if the data set is missing, has another number of dimensions, or claims more data than the file can
      !> hold; nothing happens if it is allocated before
      type(error_t), allocatable, intent(inout) :: error

      if (.not. allocated(error)) call dataset_shape(location, extent, error, is_checked=.true.)
      if (allocated(error)) return
      if (size(extent) /= rank) then
         call reject(location, 'has the shape '//shape_text(extent)//' but must have '// &
                     counted(int(rank, lp), 'dimension'), error)
         return
      end if
      start = 0*extent
      if (.not. present(rows)) return
      if (rows(1) + rows(2) > extent(rank)) call reject(location, 'has only '//to_text(int(extent(rank), lp))// &
                                                        ' rows', error)
      if (allocated(error)) return
      start(rank) = rows(1)
      extent(rank) = rows(2)
   end subroutine choose_rows

end module polydem_hdf5_file
