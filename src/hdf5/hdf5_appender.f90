!> HDF5 output: appending rows to extendible data sets.
!>
!> A data set is created with its attributes when its first row is appended.
module polydem_hdf5_appender
   use, intrinsic :: iso_c_binding, only: c_loc, c_null_ptr, c_ptr
   use hdf5, only: hid_t, hsize_t
   use polydem_errors, only: error_t
   use polydem_hdf5_dataset, only: append_rows_to, double_type, integer_type, long_type
   use polydem_hdf5_hyperslab, only: part_t, slab_of
   use polydem_hdf5_location, only: place_t
   use polydem_hdf5_writer, only: hdf5_writer_t
   use polydem_kinds, only: dp, ip, lp
   implicit none
   private
   public :: hdf5_appender_t

   !> An HDF5 file to whose data sets rows can be appended
   type, extends(hdf5_writer_t) :: hdf5_appender_t
   contains
      !> Append one row along the slowest dimension: append(name, values, error, unit, meaning[, part]); `part` is only
      !> for lists and tables
      generic :: append => append_real, append_reals, append_real_table, append_integer, append_integers, &
         append_long
      !> Append one row per index of the last dimension: append_rows(name, values, error, unit, meaning, part)
      generic :: append_rows => append_rows_reals, append_rows_table, append_rows_integers, append_rows_longs, &
         append_rows_long_table
      procedure, private :: append_real, append_reals, append_real_table, append_integer, append_integers
      procedure, private :: append_long, append_rows_reals, append_rows_table, append_rows_integers
      procedure, private :: append_rows_longs, append_rows_long_table
      procedure, private :: add
   end type hdf5_appender_t

contains

   !> Append a contiguous slab to an extendible data set. Attributes are written when the data set is created.
   subroutine add(self, name, type, extent, dimension, address, error, unit, meaning, part)
      class(hdf5_appender_t), intent(in) :: self
      character(len=*), intent(in) :: name
      integer(hid_t), intent(in) :: type
      !> Shape of the values; the last dimension counts rows
      integer, intent(in) :: extent(:)
      !> Dimension that may be distributed over ranks
      integer, intent(in) :: dimension
      type(c_ptr), intent(in) :: address
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in), optional :: unit, meaning
      type(part_t), intent(in), optional :: part
      type(place_t) :: place
      logical :: known

      if (allocated(error)) return
      place = self%place_of(name)
      known = self%has(name)
      call append_rows_to(place, type, slab_of(place, int(extent, hsize_t), address, dimension, part), error)
      if (.not. known) call self%describe(name, error, unit, meaning)
   end subroutine add

   !> Append a row to an extendible data set. The other forms of `append` differ only in kind and shape.
   subroutine append_real(self, name, values, error, unit, meaning)
      class(hdf5_appender_t), intent(in) :: self
      !> Name of the data set, like /frames/position
      character(len=*), intent(in) :: name
      !> The row
      real(dp), intent(in), target :: values
      !> Allocated on failure; nothing happens if it is allocated before
      type(error_t), allocatable, intent(inout) :: error
      !> Attributes, written when the data set is created
      character(len=*), intent(in), optional :: unit, meaning

      call self%add(name, double_type(), [1], 1, c_loc(values), error, unit, meaning)
   end subroutine append_real

   subroutine append_reals(self, name, values, error, unit, meaning, part)
      class(hdf5_appender_t), intent(in) :: self
      character(len=*), intent(in) :: name
      real(dp), intent(in), target, contiguous :: values(:)
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in), optional :: unit, meaning
      type(part_t), intent(in), optional :: part
      type(c_ptr) :: address

      address = c_null_ptr
      if (size(values) > 0) address = c_loc(values)
      call self%add(name, double_type(), [size(values), 1], 1, address, error, unit, meaning, part)
   end subroutine append_reals

   subroutine append_real_table(self, name, values, error, unit, meaning, part)
      class(hdf5_appender_t), intent(in) :: self
      character(len=*), intent(in) :: name
      real(dp), intent(in), target, contiguous :: values(:, :)
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in), optional :: unit, meaning
      type(part_t), intent(in), optional :: part
      type(c_ptr) :: address

      address = c_null_ptr
      if (size(values) > 0) address = c_loc(values)
      call self%add(name, double_type(), [size(values, 1), size(values, 2), 1], 2, address, error, unit, meaning, part)
   end subroutine append_real_table

   subroutine append_integer(self, name, values, error, unit, meaning)
      class(hdf5_appender_t), intent(in) :: self
      character(len=*), intent(in) :: name
      integer(ip), intent(in), target :: values
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in), optional :: unit, meaning

      call self%add(name, integer_type(), [1], 1, c_loc(values), error, unit, meaning)
   end subroutine append_integer

   subroutine append_integers(self, name, values, error, unit, meaning, part)
      class(hdf5_appender_t), intent(in) :: self
      character(len=*), intent(in) :: name
      integer(ip), intent(in), target, contiguous :: values(:)
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in), optional :: unit, meaning
      type(part_t), intent(in), optional :: part
      type(c_ptr) :: address

      address = c_null_ptr
      if (size(values) > 0) address = c_loc(values)
      call self%add(name, integer_type(), [size(values), 1], 1, address, error, unit, meaning, part)
   end subroutine append_integers

   subroutine append_long(self, name, values, error, unit, meaning)
      class(hdf5_appender_t), intent(in) :: self
      character(len=*), intent(in) :: name
      integer(lp), intent(in), target :: values
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in), optional :: unit, meaning

      call self%add(name, long_type(), [1], 1, c_loc(values), error, unit, meaning)
   end subroutine append_long

   !> Append several rows to an extendible data set. The other forms of `append_rows` differ only in kind and shape.
   subroutine append_rows_reals(self, name, values, error, unit, meaning, part)
      class(hdf5_appender_t), intent(in) :: self
      !> Name of the data set, like /frames/position
      character(len=*), intent(in) :: name
      !> The rows, one per index of the last dimension
      real(dp), intent(in), target, contiguous :: values(:)
      !> Allocated on failure; nothing happens if it is allocated before
      type(error_t), allocatable, intent(inout) :: error
      !> Attributes, written when the data set is created
      character(len=*), intent(in), optional :: unit, meaning
      !> Part of the last dimension that this rank has; if absent, the values are equal on all ranks
      type(part_t), intent(in), optional :: part
      type(c_ptr) :: address

      address = c_null_ptr
      if (size(values) > 0) address = c_loc(values)
      call self%add(name, double_type(), [size(values)], 1, address, error, unit, meaning, part)
   end subroutine append_rows_reals

   subroutine append_rows_table(self, name, values, error, unit, meaning, part)
      class(hdf5_appender_t), intent(in) :: self
      character(len=*), intent(in) :: name
      real(dp), intent(in), target, contiguous :: values(:, :)
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in), optional :: unit, meaning
      type(part_t), intent(in), optional :: part
      type(c_ptr) :: address

      address = c_null_ptr
      if (size(values) > 0) address = c_loc(values)
      call self%add(name, double_type(), [size(values, 1), size(values, 2)], 2, address, error, unit, meaning, &
                    part)
   end subroutine append_rows_table

   subroutine append_rows_integers(self, name, values, error, unit, meaning, part)
      class(hdf5_appender_t), intent(in) :: self
      character(len=*), intent(in) :: name
      integer(ip), intent(in), target, contiguous :: values(:)
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in), optional :: unit, meaning
      type(part_t), intent(in), optional :: part
      type(c_ptr) :: address

      address = c_null_ptr
      if (size(values) > 0) address = c_loc(values)
      call self%add(name, integer_type(), [size(values)], 1, address, error, unit, meaning, part)
   end subroutine append_rows_integers

   subroutine append_rows_longs(self, name, values, error, unit, meaning, part)
      class(hdf5_appender_t), intent(in) :: self
      character(len=*), intent(in) :: name
      integer(lp), intent(in), target, contiguous :: values(:)
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in), optional :: unit, meaning
      type(part_t), intent(in), optional :: part
      type(c_ptr) :: address

      address = c_null_ptr
      if (size(values) > 0) address = c_loc(values)
      call self%add(name, long_type(), [size(values)], 1, address, error, unit, meaning, part)
   end subroutine append_rows_longs

   subroutine append_rows_long_table(self, name, values, error, unit, meaning, part)
      class(hdf5_appender_t), intent(in) :: self
      character(len=*), intent(in) :: name
      integer(lp), intent(in), target, contiguous :: values(:, :)
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in), optional :: unit, meaning
      type(part_t), intent(in), optional :: part
      type(c_ptr) :: address

      address = c_null_ptr
      if (size(values) > 0) address = c_loc(values)
      call self%add(name, long_type(), [size(values, 1), size(values, 2)], 2, address, error, unit, meaning, part)
   end subroutine append_rows_long_table

end module polydem_hdf5_appender
