!> Shapes that may be believed: a few bytes of HDF5 can claim more numbers than any memory holds.
module polydem_hdf5_claim
   use hdf5, only: h5dclose_f, h5dget_storage_size_f, h5dget_type_f, h5dopen_f, h5fget_filesize_f, h5tclose_f, &
      h5tget_size_f, hid_t, hsize_t, size_t
   use polydem_errors, only: error_t, input_error, raise
   use polydem_hdf5_dataset, only: dataset_shape
   use polydem_hdf5_place, only: expect, place_t
   use polydem_kinds, only: dp, lp
   use polydem_strings, only: join, to_text
   implicit none
   private
   public :: believable_shape, shape_text

   !> Most bytes that one stored byte can stand for: the limit of deflate (zlib.net, technical details)
   real(dp), parameter :: greatest_ratio = 1032.0_dp
   !> Claims up to this size are believed without anything stored: data sets that nobody wrote to are all zero [bytes]
   real(dp), parameter :: harmless = 16777216.0_dp

contains

   !> Shape of a data set, fastest dimension first, no larger than what the file stores can stand for.
   subroutine believable_shape(place, extent, error)
      !> File and name
      type(place_t), intent(in) :: place
      !> Its shape; empty for a scalar
      integer(hsize_t), allocatable, intent(out) :: extent(:)
      !> Allocated if there is no such data set, or if it claims too much
      type(error_t), allocatable, intent(inout) :: error
      integer(hid_t) :: dataset, kind_in_file
      integer(hsize_t) :: stored, whole
      integer(size_t) :: bytes
      real(dp) :: claimed
      integer :: status, ignored

      call dataset_shape(place, extent, error)
      if (allocated(error)) return
      call h5dopen_f(place%file, place%name, dataset, status)
      call expect(status, 'open', place, error)
      if (allocated(error)) return
      ! HDF5 1.10 calls it a failure if nothing is stored.
      call h5dget_storage_size_f(dataset, stored, status)
      if (status < 0) stored = 0_hsize_t
      ! What is said to be stored may be a lie, too.
      call h5fget_filesize_f(place%file, whole, status)
      if (status >= 0) stored = min(stored, whole)
      call h5dget_type_f(dataset, kind_in_file, status)
      if (status >= 0) then
         call h5tget_size_f(kind_in_file, bytes, status)
         call h5tclose_f(kind_in_file, ignored)
      end if
      call expect(status, 'find the size of', place, error)
      call h5dclose_f(dataset, ignored)
      if (allocated(error)) return
      claimed = real(bytes, dp)*product(real(extent, dp))
      if (claimed <= max(harmless, greatest_ratio*real(stored, dp)) .and. all(extent >= 0_hsize_t)) return
      call raise(error, input_error, place%path//': '//place%name//' claims the shape '//shape_text(extent)// &
                 ', but the file holds '//to_text(int(stored, lp))//' bytes of it: it is damaged or was never written')
   end subroutine believable_shape

   !> A shape as h5py shows it, the slowest dimension first
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

end module polydem_hdf5_claim
