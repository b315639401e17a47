!> Data sets of an open HDF5 file, by memory address and HDF5 type. The other modules of this layer build on it.
!>
!> Shapes have the Fortran order, with the fastest dimension first; the file and h5py show them reversed. The messages
!> of the HDF5 library are switched off. `expect` checks every status; its message names the file and the data set.
!> All calls must come from one thread.
module polydem_hdf5_dataset
   use, intrinsic :: iso_c_binding, only: c_ptr
   use hdf5, only: h5dclose_f, h5dcreate_f, h5dget_space_f, h5dget_storage_size_f, h5dget_type_f, &
      h5dont_atexit_f, h5dopen_f, h5dset_extent_f, h5eset_auto_f, h5fget_filesize_f, h5get_libversion_f, &
      h5iis_valid_f, h5kind_to_type, h5lexists_f, h5open_f, h5pclose_f, h5pcreate_f, h5pset_chunk_f, &
      h5pset_create_inter_group_f, h5pset_deflate_f, h5pset_fill_time_f, h5pset_shuffle_f, h5sclose_f, &
      h5screate_simple_f, h5sget_simple_extent_dims_f, h5sget_simple_extent_ndims_f, h5tclose_f, &
      h5tget_class_f, h5tget_size_f, h5zfilter_avail_f, h5_integer_kind, h5_real_kind, h5d_fill_time_never_f, &
      h5p_dataset_create_f, h5p_link_create_f, h5s_unlimited_f, h5t_enum_f, h5t_float_f, h5t_integer_f, &
      h5t_native_double, h5z_filter_deflate_f, hid_t, hsize_t, size_t
   use polydem_errors, only: error_t, input_error, io_error, raise
   use polydem_hdf5_hyperslab, only: read_slab, slab_t, write_slab
   use polydem_hdf5_links, only: check_storage, disable_external_links, raise_external, is_external_link
   use polydem_hdf5_location, only: check_status, dataset_location_t, reject, system_error
   use polydem_kinds, only: dp, ip, lp
   use polydem_strings, only: join, to_text
   implicit none
   private
   public :: start_library, library_version
   public :: write_dataset, append_rows_to, read_dataset, dataset_shape, has_link, shape_text
   public :: holds_reals, holds_integers

   !> Accepted types: real numbers or integers
   integer, parameter :: holds_reals = 1
   !> Accepted types: integers of any width, or booleans of h5py
   integer, parameter :: holds_integers = 2

   !> Maximum size of a chunk of an extendible data set, unless one row is larger [B]
   integer(hsize_t), parameter :: chunk_bytes = 16384_hsize_t
   !> Maximum compression ratio of deflate (zlib.net, technical details)
   real(dp), parameter :: max_ratio = 1032.0_dp
   !> Size up to which a data set is accepted even if no bytes are stored [B]: unwritten data sets are all zero
   real(dp), parameter :: max_unchecked = 16777216.0_dp
   !> Least number of chunks for the expected number of rows. At most one of them is partly filled.
   integer(hsize_t), parameter :: expected_chunks = 5_hsize_t

contains

   !> Initialise the HDF5 library. Repeated calls are harmless.
   !>
   !> HDF5 1.10 creates its 55 predefined types again at each h5open_f and never frees the old ones. Therefore h5open_f
   !> is called once. The exit handler of HDF5 is disabled: it would retry to write files that could not be written, and
   !> crash. All other files are closed before the exit. h5dont_atexit_f must precede the first use of HDF5; a repeated
   !> call only returns a status. If MPI was initialised before, HDF5 still registers itself for the end of MPI.
   !> Therefore a program initialises HDF5 before MPI.
   subroutine start_library(error)
      type(error_t), allocatable, intent(inout) :: error
      logical :: is_open
      integer :: status

      call h5dont_atexit_f(status)
      call h5iis_valid_f(h5t_native_double, is_open, status)
      if (.not. is_open) then
         call h5open_f(status)
         call disable_external_links()
      end if
      if (status == 0) call h5eset_auto_f(0, status)
      if (status /= 0) call raise(error, io_error, 'cannot initialise the HDF5 library')
   end subroutine start_library

   !> Version of the HDF5 library, like 1.10.8
   function library_version() result(version)
      character(len=:), allocatable :: version
      integer :: major, minor, release, status

      call h5dont_atexit_f(status)
      call h5get_libversion_f(major, minor, release, status)
      version = to_text(int(major, ip))//'.'//to_text(int(minor, ip))//'.'//to_text(int(release, ip))
   end function library_version

   !> Whether a name exists. Every group of the path is tested, as HDF5 requires. A name that leads to another file
   !> exists; an attempt to read it gives an error.
   logical function has_link(location, error)
      type(dataset_location_t), intent(in) :: location
      !> Allocated if the system refuses to read the file
      type(error_t), allocatable, intent(inout) :: error
      integer :: k, status

      has_link = .false.
      do k = 2, len(location%name) + 1
         if (k <= len(location%name)) then
            if (location%name(k:k) /= '/') cycle
         end if
         call h5lexists_f(location%file, location%name(:k - 1), has_link, status)
         if (status /= 0) has_link = .false.
         if (status < 0) then
            if (system_error() /= 0) call check_status(status, 'look for', location, error)
            if (allocated(error)) return
         end if
         if (.not. has_link) exit
      end do
      if (.not. has_link) has_link = is_external_link(location)
   end function has_link

   !> Write a data set of fixed shape: a new one, or another part of one.
   subroutine write_dataset(location, kind_in_file, slab, is_new, error)
      type(dataset_location_t), intent(in) :: location
      !> HDF5 type in memory and in the file
      integer(hid_t), intent(in) :: kind_in_file
      !> Values to write
      type(slab_t), intent(in) :: slab
      !> Whether to create the data set
      logical, intent(in) :: is_new
      type(error_t), allocatable, intent(inout) :: error
      integer(hid_t) :: space, dataset
      integer :: status

      if (is_new) then
         call h5screate_simple_f(size(slab%whole), slab%whole, space, status)
         call check_status(status, 'create the data space of', location, error)
         if (allocated(error)) return
         call create_dataset(location, kind_in_file, space, dataset, error)
         call h5sclose_f(space, status)
      else
         call h5dopen_f(location%file, location%name, dataset, status)
         call check_status(status, 'open', location, error)
      end if
      if (allocated(error)) return
      if (product(slab%whole) > 0_hsize_t) call write_slab(dataset, location, kind_in_file, slab, error)
      call h5dclose_f(dataset, status)
      call check_status(status, 'finish writing', location, error)
   end subroutine write_dataset

   !> Create a data set and its missing groups. The caller closes the data set.
   subroutine create_dataset(location, kind_in_file, space, dataset, error, properties)
      type(dataset_location_t), intent(in) :: location
      !> HDF5 type in the file
      integer(hid_t), intent(in) :: kind_in_file
      !> HDF5 data space of the data set
      integer(hid_t), intent(in) :: space
      !> HDF5 identifier of the open data set
      integer(hid_t), intent(out) :: dataset
      type(error_t), allocatable, intent(inout) :: error
      !> Dataset creation property list, for chunks
      integer(hid_t), intent(in), optional :: properties
      integer(hid_t) :: links
      integer :: status, ignored

      dataset = -1_hid_t
      call h5pcreate_f(h5p_link_create_f, links, status)
      if (status >= 0) call h5pset_create_inter_group_f(links, 1, status)
      if (status >= 0) then
         if (present(properties)) then
            call h5dcreate_f(location%file, location%name, kind_in_file, space, dataset, status, &
                             dcpl_id=properties, lcpl_id=links)
         else
            call h5dcreate_f(location%file, location%name, kind_in_file, space, dataset, status, lcpl_id=links)
         end if
      end if
      call check_status(status, 'create', location, error)
      call h5pclose_f(links, ignored)
   end subroutine create_dataset

   !> Append rows along the slowest dimension, which is unlimited. The first call creates the data set.
   subroutine append_rows_to(location, kind_in_file, rows, error)
      type(dataset_location_t), intent(in) :: location
      !> HDF5 type in memory and in the file
      integer(hid_t), intent(in) :: kind_in_file
      !> Rows to append; the last dimension counts rows
      type(slab_t), intent(in) :: rows
      type(error_t), allocatable, intent(inout) :: error
      integer(hid_t) :: dataset
      integer :: status
      logical :: there

      there = has_link(location, error)
      if (allocated(error)) return
      if (.not. there) call create_growing(location, kind_in_file, rows%whole(:size(rows%whole) - 1), error)
      if (allocated(error)) return
      call h5dopen_f(location%file, location%name, dataset, status)
      call check_status(status, 'open', location, error)
      if (allocated(error)) return
      call grow(dataset, location, kind_in_file, rows, error)
      call h5dclose_f(dataset, status)
      call check_status(status, 'finish writing', location, error)
   end subroutine append_rows_to

   !> Create an extendible data set without rows.
   subroutine create_growing(location, kind_in_file, row, error)
      type(dataset_location_t), intent(in) :: location
      integer(hid_t), intent(in) :: kind_in_file
      integer(hsize_t), intent(in) :: row(:)
      type(error_t), allocatable, intent(inout) :: error
      integer(hid_t) :: space, properties, dataset
      integer(hsize_t) :: chunk(size(row) + 1), batch
      integer(size_t) :: bytes
      integer :: n, status, ignored

      n = size(row) + 1
      batch = int(location%batch, hsize_t)
      call h5tget_size_f(kind_in_file, bytes, status)
      chunk(:n - 1) = max(1_hsize_t, row)
      chunk(n) = max(1_hsize_t, chunk_bytes/(product(chunk(:n - 1))*int(bytes, hsize_t)*batch))
      if (location%expected_rows > 0_lp) then
         associate (expected => (int(location%expected_rows, hsize_t) + batch - 1_hsize_t)/batch)
            chunk(n) = min(chunk(n), (expected + expected_chunks - 1_hsize_t)/expected_chunks)
            ! As many chunks as these need, of equal size
            chunk(n) = 1_hsize_t + (expected - 1_hsize_t)/(1_hsize_t + (expected - 1_hsize_t)/chunk(n))
         end associate
      end if
      chunk(n) = chunk(n)*batch
      call h5screate_simple_f(n, [row, 0_hsize_t], space, status, [row, h5s_unlimited_f])
      if (status >= 0) call h5pcreate_f(h5p_dataset_create_f, properties, status)
      if (status >= 0) call h5pset_chunk_f(properties, n, chunk, status)
      if (status >= 0 .and. location%compressed) call compress(properties, status)
      ! In parallel, space for rows is allocated long before they are written. Filling it first would cost time.
      if (status >= 0 .and. location%together) call h5pset_fill_time_f(properties, h5d_fill_time_never_f, status)
      call check_status(status, 'set the properties of', location, error)
      if (allocated(error)) return
      call create_dataset(location, kind_in_file, space, dataset, error, properties)
      if (.not. allocated(error)) call h5dclose_f(dataset, ignored)
      call h5pclose_f(properties, ignored)
      call h5sclose_f(space, ignored)
   end subroutine create_growing

   !> Enable shuffling and deflation of chunks, if the HDF5 library supports them.
   subroutine compress(properties, status)
      integer(hid_t), intent(in) :: properties
      integer, intent(out) :: status
      logical :: possible

      call h5zfilter_avail_f(h5z_filter_deflate_f, possible, status)
      if (status < 0 .or. .not. possible) return
      call h5pset_shuffle_f(properties, status)
      if (status >= 0) call h5pset_deflate_f(properties, 1, status)
   end subroutine compress

   !> Extend an open data set by rows and write them.
   subroutine grow(dataset, location, kind_in_file, rows, error)
      integer(hid_t), intent(in) :: dataset, kind_in_file
      type(dataset_location_t), intent(in) :: location
      type(slab_t), intent(in) :: rows
      type(error_t), allocatable, intent(inout) :: error
      type(slab_t) :: slab
      integer(hsize_t), allocatable :: extent(:)
      integer :: n, status

      call dataset_shape(location, extent, error)
      if (allocated(error)) return
      n = size(extent)
      if (n /= size(rows%whole)) status = -1
      if (n == size(rows%whole)) status = merge(0, -1, all(extent(:n - 1) == rows%whole(:n - 1)))
      call check_status(status, 'add rows of another shape to', location, error)
      if (allocated(error)) return
      if (rows%whole(n) == 0_hsize_t) return
      slab = rows
      slab%start(n) = slab%start(n) + extent(n)
      extent(n) = extent(n) + rows%whole(n)
      call h5dset_extent_f(dataset, extent, status)
      call check_status(status, 'extend', location, error)
      if (allocated(error) .or. product(rows%whole) == 0_hsize_t) return
      call write_slab(dataset, location, kind_in_file, slab, error)
   end subroutine grow

   !> Read the shape of a data set, fastest dimension first.
   subroutine dataset_shape(location, extent, error, is_checked)
      type(dataset_location_t), intent(in) :: location
      !> Shape; empty for a scalar
      integer(hsize_t), allocatable, intent(out) :: extent(:)
      !> Allocated if the data set is missing or cannot be read
      type(error_t), allocatable, intent(inout) :: error
      !> Whether a shape is refused that the stored bytes cannot fill; default: false. A damaged or hostile file of a
      !> few bytes can claim more data than fit into memory
      logical, intent(in), optional :: is_checked
      integer(hsize_t), allocatable :: limit(:)
      integer(hid_t) :: dataset, space
      integer :: n, status, ignored
      logical :: checks

      if (.not. has_link(location, error)) then
         call raise(error, input_error, location%path//': the data set '//location%name//' is missing')
         return
      else if (is_external_link(location)) then
         call raise_external(location, error)
         return
      end if
      call h5dopen_f(location%file, location%name, dataset, status)
      call check_status(status, 'open the data set', location, error)
      if (allocated(error)) return
      ! This check precedes the query of the shape, because HDF5 may open other files for it.
      call check_storage(dataset, location, error)
      if (.not. allocated(error)) then
         call h5dget_space_f(dataset, space, status)
         if (status >= 0) call h5sget_simple_extent_ndims_f(space, n, status)
         if (status >= 0) then
            allocate (extent(n), limit(n))
            if (n > 0) call h5sget_simple_extent_dims_f(space, extent, limit, status)
         end if
         call check_status(status, 'read the shape of', location, error)
         call h5sclose_f(space, ignored)
      end if
      checks = .false.
      if (present(is_checked)) checks = is_checked
      if (checks .and. .not. allocated(error)) call check_size(dataset, location, extent, error)
      call h5dclose_f(dataset, ignored)
   end subroutine dataset_shape

   !> Check that the stored bytes of an open data set can contain as many values as it claims.
   subroutine check_size(dataset, location, extent, error)
      integer(hid_t), intent(in) :: dataset
      type(dataset_location_t), intent(in) :: location
      integer(hsize_t), intent(in) :: extent(:)
      type(error_t), allocatable, intent(inout) :: error
      integer(hid_t) :: kind_in_file
      integer(hsize_t) :: stored, file_size
      integer(size_t) :: bytes
      integer :: status, ignored

      ! HDF5 1.10 returns a failure if no bytes are stored.
      call h5dget_storage_size_f(dataset, stored, status)
      if (status < 0) then
         stored = 0_hsize_t
         if (system_error() /= 0) call check_status(status, 'read the size of', location, error)
      end if
      ! The claimed number of stored bytes may be wrong too.
      call h5fget_filesize_f(location%file, file_size, status)
      if (status >= 0) stored = min(stored, file_size)
      call h5dget_type_f(dataset, kind_in_file, status)
      if (status >= 0) then
         call h5tget_size_f(kind_in_file, bytes, status)
         call h5tclose_f(kind_in_file, ignored)
      end if
      call check_status(status, 'read the size of', location, error)
      if (allocated(error)) return
      if (real(bytes, dp)*product(real(extent, dp)) <= max(max_unchecked, max_ratio*real(stored, dp)) &
          .and. all(extent >= 0_hsize_t)) return
      call reject(location, 'claims the shape '//shape_text(extent)//', but the file holds '// &
                  to_text(int(stored, lp))//' bytes of it: it is damaged or was never written', error)
   end subroutine check_size

   !> Text of a shape in the order of h5py, with the slowest dimension first
   pure function shape_text(extent) result(text)
      !> Shape, fastest dimension first
      integer(hsize_t), intent(in) :: extent(:)
      character(len=:), allocatable :: text
      character(len=24) :: words(size(extent))
      integer :: k

      do k = 1, size(extent)
         words(k) = to_text(int(extent(size(extent) + 1 - k), lp))
      end do
      text = '('//join(words, ', ')//')'
   end function shape_text

   !> Read a slab of a data set into memory.
   subroutine read_dataset(location, wanted, start, extent, address, error)
      type(dataset_location_t), intent(in) :: location
      !> holds_reals: read real(dp); holds_integers: read integer(lp). HDF5 converts the values
      integer, intent(in) :: wanted
      !> Start of the slab, counted from 0, fastest dimension first
      integer(hsize_t), intent(in) :: start(:)
      !> Shape of the slab
      integer(hsize_t), intent(in) :: extent(:)
      !> Address of a sufficiently large contiguous array
      type(c_ptr), intent(in) :: address
      !> Allocated on failure, or if the data set has a type that is not accepted
      type(error_t), allocatable, intent(inout) :: error
      integer(hid_t) :: dataset, kind_in_memory
      integer :: status

      if (product(extent) == 0_hsize_t) return
      call h5dopen_f(location%file, location%name, dataset, status)
      call check_status(status, 'open', location, error)
      if (allocated(error)) return
      call check_class(dataset, location, wanted, error)
      if (.not. allocated(error)) then
         if (wanted == holds_reals) kind_in_memory = h5kind_to_type(dp, h5_real_kind)
         if (wanted == holds_integers) kind_in_memory = h5kind_to_type(lp, h5_integer_kind)
         call read_slab(dataset, location, kind_in_memory, &
                        slab_t(whole=extent, start=start, extent=extent, address=address), error)
      end if
      call h5dclose_f(dataset, status)
   end subroutine read_dataset

   !> Check that an open data set has an accepted type.
   subroutine check_class(dataset, location, wanted, error)
      integer(hid_t), intent(in) :: dataset
      type(dataset_location_t), intent(in) :: location
      integer, intent(in) :: wanted
      type(error_t), allocatable, intent(inout) :: error
      integer(hid_t) :: kind_in_file
      integer :: class, status, ignored

      call h5dget_type_f(dataset, kind_in_file, status)
      if (status >= 0) call h5tget_class_f(kind_in_file, class, status)
      call check_status(status, 'read the type of', location, error)
      call h5tclose_f(kind_in_file, ignored)
      if (allocated(error)) return
      if (wanted == holds_reals .and. (class == h5t_float_f .or. class == h5t_integer_f)) return
      if (wanted == holds_integers .and. (class == h5t_integer_f .or. class == h5t_enum_f)) return
      call reject(location, 'does not hold '//trim(merge('numbers ', 'integers', wanted == holds_reals)), error)
   end subroutine check_class

end module polydem_hdf5_dataset
