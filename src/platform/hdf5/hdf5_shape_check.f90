!> Plausibility check of shapes: a damaged or hostile HDF5 file of a few bytes can claim more data than fit into memory.
module polydem_hdf5_shape_check
   use hdf5, only: h5dclose_f, h5dget_storage_size_f, h5dget_type_f, h5dopen_f, h5fget_filesize_f, h5tclose_f, &
      h5tget_size_f, hid_t, hsize_t, size_t
   use polydem_errors, only: error_t
   use polydem_hdf5_dataset, only: dataset_shape
   use polydem_hdf5_location, only: check_status, dataset_location_t, reject, system_error
   use polydem_kinds, only: dp, lp
   use polydem_strings, only: join, to_text
   implicit none
   private
   public :: checked_shape, shape_text

   !> Maximum compression ratio of deflate (zlib.net, technical details)
   real(dp), parameter :: max_ratio = 1032.0_dp
   !> Size up to which a data set is accepted even if no bytes are stored [B]: unwritten data sets are all zero
   real(dp), parameter :: max_unchecked = 16777216.0_dp

contains

   !> Read the shape of a data set, fastest dimension first, and check that the stored bytes can contain so many values.
   subroutine checked_shape(location, extent, error)
      type(dataset_location_t), intent(in) :: location
      !> Shape; empty for a scalar
      integer(hsize_t), allocatable, intent(out) :: extent(:)
      !> Allocated if the data set is missing or claims more data than the file can hold
      type(error_t), allocatable, intent(inout) :: error
      integer(hid_t) :: dataset, kind_in_file
      integer(hsize_t) :: stored, file_size
      integer(size_t) :: bytes
      real(dp) :: claimed
      integer :: status, ignored

      call dataset_shape(location, extent, error)
      if (allocated(error)) return
      call h5dopen_f(location%file, location%name, dataset, status)
      call check_status(status, 'open', location, error)
      if (allocated(error)) return
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
      call h5dclose_f(dataset, ignored)
      if (allocated(error)) return
      claimed = real(bytes, dp)*product(real(extent, dp))
      if (claimed <= max(max_unchecked, max_ratio*real(stored, dp)) .and. all(extent >= 0_hsize_t)) return
      call reject(location, 'claims the shape '//shape_text(extent)//', but the file holds '// &
                  to_text(int(stored, lp))//' bytes of it: it is damaged or was never written', error)
   end subroutine checked_shape

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

end module polydem_hdf5_shape_check
