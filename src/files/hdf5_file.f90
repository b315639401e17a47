!> HDF5 files, the module for everybody else: named numbers and texts in, the same out.
!>
!> Names are like /frames/position; groups on the way are made. Real numbers in files are always double
!> precision. An array (2, n) is (n, 2) to h5py: the fastest dimension, first in Fortran, is last there.
!> The format is HDF5's default one, so that what was flushed can be read after the program was killed.
!> All calls must come from one thread.
module polydem_hdf5_file
   use, intrinsic :: iso_c_binding, only: c_loc
   use hdf5, only: hsize_t
   use polydem_errors, only: error_t, input_error, raise
   use polydem_hdf5_appender, only: hdf5_appender_t
   use polydem_hdf5_claim, only: believable_shape, shape_text
   use polydem_hdf5_dataset, only: double_type, holds_integers, holds_reals, library_version, long_type, &
      read_dataset, start_library
   use polydem_hdf5_place, only: place_t
   use polydem_hdf5_slab, only: part_t
   use polydem_hdf5_text, only: read_attribute_value, read_text
   use polydem_kinds, only: dp, ip, lp
   use polydem_strings, only: to_text
   implicit none
   private
   public :: hdf5_file_t, part_t, library_version, start_library

   !> An HDF5 file: create, join (to write together), open (to read), flush, close, has, shape_of, write, append,
   !> append_rows, write_attribute, read
   type, extends(hdf5_appender_t) :: hdf5_file_t
   contains
      !> Read a data set, allocating the values: read(name, values, error). Whole numbers may have any width,
      !> or be h5py's booleans.
      generic :: read => read_reals, read_real_table, read_real_block, read_integers, read_longs, &
         read_one_text
      procedure :: read_rows
      procedure :: read_real_attribute
      procedure, private :: read_reals, read_real_table, read_real_block, read_integers, read_longs
      procedure, private :: read_one_text
   end type hdf5_file_t

contains

   !> Read real numbers; the other forms of `read` differ in kind and shape only.
   subroutine read_reals(self, name, values, error)
      class(hdf5_file_t), intent(in) :: self
      !> Name of the data set
      character(len=*), intent(in) :: name
      !> What it holds, fastest dimension first
      real(dp), allocatable, target, intent(out) :: values(:)
      !> Allocated on failure, or if the data set has another number of dimensions
      type(error_t), allocatable, intent(inout) :: error
      integer(hsize_t), allocatable :: extent(:)

      call expect_rank(self%place_of(name), 1, extent, error)
      if (allocated(error)) return
      allocate (values(extent(1)))
      call read_dataset(self%place_of(name), holds_reals, double_type(), 0*extent, extent, &
                        c_loc(values), error)
   end subroutine read_reals

   subroutine read_real_table(self, name, values, error)
      class(hdf5_file_t), intent(in) :: self
      character(len=*), intent(in) :: name
      real(dp), allocatable, target, intent(out) :: values(:, :)
      type(error_t), allocatable, intent(inout) :: error
      integer(hsize_t), allocatable :: extent(:)

      call expect_rank(self%place_of(name), 2, extent, error)
      if (allocated(error)) return
      allocate (values(extent(1), extent(2)))
      call read_dataset(self%place_of(name), holds_reals, double_type(), 0*extent, extent, &
                        c_loc(values), error)
   end subroutine read_real_table

   subroutine read_real_block(self, name, values, error)
      class(hdf5_file_t), intent(in) :: self
      character(len=*), intent(in) :: name
      real(dp), allocatable, target, intent(out) :: values(:, :, :)
      type(error_t), allocatable, intent(inout) :: error
      integer(hsize_t), allocatable :: extent(:)

      call expect_rank(self%place_of(name), 3, extent, error)
      if (allocated(error)) return
      allocate (values(extent(1), extent(2), extent(3)))
      call read_dataset(self%place_of(name), holds_reals, double_type(), 0*extent, extent, &
                        c_loc(values), error)
   end subroutine read_real_block

   !> Read some rows of a data set of three dimensions.
   subroutine read_rows(self, name, first, n_rows, values, error)
      class(hdf5_file_t), intent(in) :: self
      !> Name of the data set
      character(len=*), intent(in) :: name
      !> First row along the slowest dimension, counted from 1
      integer(ip), intent(in) :: first
      !> How many rows; there must be so many
      integer(ip), intent(in) :: n_rows
      !> What they hold, fastest dimension first
      real(dp), allocatable, target, intent(out) :: values(:, :, :)
      !> Allocated on failure, or if the data set has another number of dimensions
      type(error_t), allocatable, intent(inout) :: error
      integer(hsize_t), allocatable :: extent(:)

      call expect_rank(self%place_of(name), 3, extent, error)
      if (allocated(error)) return
      extent(3) = int(n_rows, hsize_t)
      allocate (values(extent(1), extent(2), extent(3)))
      call read_dataset(self%place_of(name), holds_reals, double_type(), &
                        [0_hsize_t, 0_hsize_t, int(first - 1_ip, hsize_t)], extent, c_loc(values), error)
   end subroutine read_rows

   subroutine read_longs(self, name, values, error)
      class(hdf5_file_t), intent(in) :: self
      character(len=*), intent(in) :: name
      integer(lp), allocatable, target, intent(out) :: values(:)
      type(error_t), allocatable, intent(inout) :: error
      integer(hsize_t), allocatable :: extent(:)

      call expect_rank(self%place_of(name), 1, extent, error)
      if (allocated(error)) return
      allocate (values(extent(1)))
      call read_dataset(self%place_of(name), holds_integers, long_type(), 0*extent, extent, &
                        c_loc(values), error)
   end subroutine read_longs

   !> Read by way of 64 bits, since HDF5 would cut what does not fit into 32 without a word.
   subroutine read_integers(self, name, values, error)
      class(hdf5_file_t), intent(in) :: self
      character(len=*), intent(in) :: name
      integer(ip), allocatable, intent(out) :: values(:)
      type(error_t), allocatable, intent(inout) :: error
      integer(lp), allocatable :: wide(:)
      type(place_t) :: place

      place = self%place_of(name)
      call self%read_longs(name, wide, error)
      if (allocated(error)) return
      if (any(wide > huge(1_ip) .or. wide < -huge(1_ip))) then
         call raise(error, input_error, place%path//': '//name//' holds numbers beyond 32 bits')
         return
      end if
      values = int(wide, ip)
   end subroutine read_integers

   subroutine read_one_text(self, name, text, error)
      class(hdf5_file_t), intent(in) :: self
      character(len=*), intent(in) :: name
      character(len=:), allocatable, intent(out) :: text
      type(error_t), allocatable, intent(inout) :: error

      call read_text(self%place_of(name), text, error)
   end subroutine read_one_text

   !> Read a real number that is attached to a group or data set.
   subroutine read_real_attribute(self, object, name, value, error)
      class(hdf5_file_t), intent(in) :: self
      !> Group or data set, and name of the attribute
      character(len=*), intent(in) :: object, name
      !> The number; left as it is if there is no such attribute
      real(dp), intent(inout), target :: value
      !> Allocated if it cannot be read
      type(error_t), allocatable, intent(inout) :: error
      logical :: there

      call read_attribute_value(self%place_of(object), name, double_type(), c_loc(value), there, error)
   end subroutine read_real_attribute

   !> Find the shape of a data set and insist on its number of dimensions.
   subroutine expect_rank(place, rank, extent, error)
      !> File and name
      type(place_t), intent(in) :: place
      !> Number of dimensions it must have
      integer, intent(in) :: rank
      !> Its shape, fastest dimension first
      integer(hsize_t), allocatable, intent(out) :: extent(:)
      !> Allocated if there is no such data set, it has another rank or claims more than the file can hold
      type(error_t), allocatable, intent(inout) :: error

      call believable_shape(place, extent, error)
      if (allocated(error)) return
      if (size(extent) == rank) return
      call raise(error, input_error, place%path//': '//place%name//' has the shape '//shape_text(extent)// &
                 ' but must have '//to_text(int(rank, ip))//' dimensions')
   end subroutine expect_rank

end module polydem_hdf5_file
