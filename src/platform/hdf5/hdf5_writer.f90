!> HDF5 output: new data sets, rows of extendible data sets, and attributes.
!>
!> Every procedure takes the name of the data set and the values. On failure it allocates `error`, whose message names
!> the file and the data set. `unit` and `meaning` become attributes of the data set. With `rows`, values are appended
!> to an extendible data set, which the first call creates with its attributes.
!>
!> All ranks make the same write calls, in the same order, to a file that is written in parallel. The values are equal
!> on all ranks; with `part`, each rank writes its part of the last dimension. Texts are written before the other ranks
!> join the file.
module polydem_hdf5_writer
   use, intrinsic :: iso_c_binding, only: c_loc, c_null_ptr, c_ptr
   use hdf5, only: h5_integer_kind, h5_real_kind, h5kind_to_type, hid_t, hsize_t
   use polydem_errors, only: error_t
   use polydem_hdf5_dataset, only: append_rows_to, write_dataset
   use polydem_hdf5_handle, only: hdf5_handle_t
   use polydem_hdf5_hyperslab, only: part_t, slab_of
   use polydem_hdf5_location, only: dataset_location_t
   use polydem_hdf5_strings, only: write_attribute_value, write_text_attribute, write_texts
   use polydem_kinds, only: bp, dp, ip, lp
   implicit none
   private
   public :: hdf5_writer_t, one_row, many_rows

   !> The values are one row of an extendible data set
   integer, parameter :: one_row = 1
   !> Each index of the last dimension of the values is a row of an extendible data set
   integer, parameter :: many_rows = 2

   !> An HDF5 file for writing
   type, extends(hdf5_handle_t) :: hdf5_writer_t
      private
      !> Expected number of rows of a new extendible data set, for one_row and many_rows; 0: unknown
      integer(lp) :: expected(2) = 0_lp
      !> Rows that belong together, for many_rows
      integer(lp) :: batch = 1_lp
   contains
      procedure :: expect_rows
      !> Write a new data set, or append rows to an extendible one: write(name, values, error, unit, meaning, part,
      !> rows). Numbers may have any rank; `part` is for arrays, `rows` for numbers and arrays of numbers.
      generic :: write => write_reals, write_integers, write_longs, write_bytes, write_text, write_text_list
      !> Write an attribute of a group or data set: write_attribute(object, name, value, error)
      generic :: write_attribute => attach_text, attach_integer, attach_real
      procedure :: describe
      procedure, private :: write_reals, write_integers, write_longs, write_bytes, write_text, write_text_list
      procedure, private :: attach_text, attach_integer, attach_real
      procedure, private :: put
   end type hdf5_writer_t

contains

   !> Set how many rows extendible data sets will probably get. Their chunks are then so small that a small file stays
   !> small. More rows are possible.
   subroutine expect_rows(self, single, many, batch)
      class(hdf5_writer_t), intent(inout) :: self
      !> Rows of data sets that grow by one row at a time, and of those that grow by many; 0: unknown
      integer(lp), intent(in) :: single, many
      !> Number of the many rows that belong together, so that chunks get a multiple of it; default: 1
      integer(lp), intent(in), optional :: batch

      self%expected(one_row) = single
      self%expected(many_rows) = many
      self%batch = 1_lp
      if (present(batch)) self%batch = max(1_lp, batch)
   end subroutine expect_rows

   !> Write contiguous values as a new data set, as another part of one, or as rows of an extendible one. A new data set
   !> gets its attributes.
   subroutine put(self, name, kind_in_file, values, error, unit, meaning, part, rows)
      class(hdf5_writer_t), intent(in) :: self
      character(len=*), intent(in) :: name
      integer(hid_t), intent(in) :: kind_in_file
      type(*), intent(in), target, contiguous :: values(..)
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in), optional :: unit, meaning
      type(part_t), intent(in), optional :: part
      integer, intent(in), optional :: rows
      type(dataset_location_t) :: location
      type(c_ptr) :: address
      integer(hsize_t), allocatable :: extent(:)
      integer :: n_dimensions
      logical :: is_new

      if (allocated(error)) return
      location = self%location_of(name)
      address = c_null_ptr
      if (size(values) > 0) address = c_loc(values)
      ! gfortran 12 passes an empty array constructor with the extent -1 to an array of assumed rank.
      extent = int(max(0, shape(values)), hsize_t)
      n_dimensions = size(extent)
      is_new = .true.
      if (present(rows) .or. present(part)) is_new = .not. self%has(name, error)
      if (allocated(error)) return
      if (present(rows)) then
         if (rows == one_row) extent = [extent, 1_hsize_t]
         location%expected_rows = self%expected(rows)
         if (rows == many_rows) location%batch = self%batch
         call append_rows_to(location, kind_in_file, &
                             slab_of(location, extent, address, max(1, n_dimensions), part), error)
      else
         call write_dataset(location, kind_in_file, slab_of(location, extent, address, n_dimensions, part), is_new, &
                            error)
      end if
      if (is_new) call self%describe(name, error, unit, meaning)
   end subroutine put

   !> Write the attributes `unit` and `meaning` of a data set.
   subroutine describe(self, name, error, unit, meaning)
      class(hdf5_writer_t), intent(in) :: self
      !> Name of the data set
      character(len=*), intent(in) :: name
      !> Allocated on failure; nothing happens if it is allocated before
      type(error_t), allocatable, intent(inout) :: error
      !> Unit and meaning; an attribute is not written if it is absent
      character(len=*), intent(in), optional :: unit, meaning

      if (allocated(error)) return
      if (present(unit)) call write_text_attribute(self%location_of(name), 'unit', unit, error)
      if (allocated(error)) return
      if (present(meaning)) call write_text_attribute(self%location_of(name), 'meaning', meaning, error)
   end subroutine describe

   !> Write a number or an array of numbers. The other forms of `write` for numbers differ only in kind.
   subroutine write_reals(self, name, values, error, unit, meaning, part, rows)
      class(hdf5_writer_t), intent(in) :: self
      !> Name of the data set, like /frames/position
      character(len=*), intent(in) :: name
      !> The values, of any rank
      real(dp), intent(in), target, contiguous :: values(..)
      !> Allocated on failure; nothing happens if it is allocated before
      type(error_t), allocatable, intent(inout) :: error
      !> Attributes, written with a new data set
      character(len=*), intent(in), optional :: unit, meaning
      !> Part of the last dimension that this rank has; if absent, the values are equal on all ranks. Several calls may
      !> write parts of one data set
      type(part_t), intent(in), optional :: part
      !> one_row or many_rows: append to an extendible data set; a new data set if absent
      integer, intent(in), optional :: rows

      call self%put(name, h5kind_to_type(dp, h5_real_kind), values, error, unit, meaning, part, rows)
   end subroutine write_reals

   subroutine write_integers(self, name, values, error, unit, meaning, part, rows)
      class(hdf5_writer_t), intent(in) :: self
      character(len=*), intent(in) :: name
      integer(ip), intent(in), target, contiguous :: values(..)
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in), optional :: unit, meaning
      type(part_t), intent(in), optional :: part
      integer, intent(in), optional :: rows

      call self%put(name, h5kind_to_type(ip, h5_integer_kind), values, error, unit, meaning, part, rows)
   end subroutine write_integers

   subroutine write_longs(self, name, values, error, unit, meaning, part, rows)
      class(hdf5_writer_t), intent(in) :: self
      character(len=*), intent(in) :: name
      integer(lp), intent(in), target, contiguous :: values(..)
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in), optional :: unit, meaning
      type(part_t), intent(in), optional :: part
      integer, intent(in), optional :: rows

      call self%put(name, h5kind_to_type(lp, h5_integer_kind), values, error, unit, meaning, part, rows)
   end subroutine write_longs

   subroutine write_bytes(self, name, values, error, unit, meaning, part, rows)
      class(hdf5_writer_t), intent(in) :: self
      character(len=*), intent(in) :: name
      integer(bp), intent(in), target, contiguous :: values(..)
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in), optional :: unit, meaning
      type(part_t), intent(in), optional :: part
      integer, intent(in), optional :: rows

      call self%put(name, h5kind_to_type(bp, h5_integer_kind), values, error, unit, meaning, part, rows)
   end subroutine write_bytes

   subroutine write_text(self, name, values, error, unit, meaning)
      class(hdf5_writer_t), intent(in) :: self
      character(len=*), intent(in) :: name
      character(len=*), intent(in) :: values
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in), optional :: unit, meaning

      if (allocated(error)) return
      call write_texts(self%location_of(name), [integer(hsize_t) ::], [values], error)
      call self%describe(name, error, unit, meaning)
   end subroutine write_text

   subroutine write_text_list(self, name, values, error, unit, meaning)
      class(hdf5_writer_t), intent(in) :: self
      character(len=*), intent(in) :: name
      character(len=*), intent(in) :: values(:)
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in), optional :: unit, meaning

      if (allocated(error)) return
      call write_texts(self%location_of(name), [size(values, kind=hsize_t)], values, error)
      call self%describe(name, error, unit, meaning)
   end subroutine write_text_list

   !> Write an attribute of a group or data set. The other forms of `write_attribute` differ only in kind.
   subroutine attach_text(self, object, name, value, error)
      class(hdf5_writer_t), intent(in) :: self
      !> Name of the group or data set, name of the attribute, and value
      character(len=*), intent(in) :: object, name, value
      !> Allocated on failure; nothing happens if it is allocated before
      type(error_t), allocatable, intent(inout) :: error

      if (allocated(error)) return
      call write_text_attribute(self%location_of(object), name, value, error)
   end subroutine attach_text

   subroutine attach_integer(self, object, name, value, error)
      class(hdf5_writer_t), intent(in) :: self
      character(len=*), intent(in) :: object, name
      integer(ip), intent(in), target :: value
      type(error_t), allocatable, intent(inout) :: error

      if (allocated(error)) return
      call write_attribute_value(self%location_of(object), name, h5kind_to_type(ip, h5_integer_kind), c_loc(value), &
                                 error)
   end subroutine attach_integer

   subroutine attach_real(self, object, name, value, error)
      class(hdf5_writer_t), intent(in) :: self
      character(len=*), intent(in) :: object, name
      real(dp), intent(in), target :: value
      type(error_t), allocatable, intent(inout) :: error

      if (allocated(error)) return
      call write_attribute_value(self%location_of(object), name, h5kind_to_type(dp, h5_real_kind), c_loc(value), error)
   end subroutine attach_real

end module polydem_hdf5_writer
