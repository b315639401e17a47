!> Bitwise comparison of two HDF5 files.
module compare_files
   use polydem_errors, only: error_t, raise, run_error
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_kinds, only: dp, lp
   implicit none
   private
   public :: expect_equal_files

contains

   !> Compare the named data sets of two files.
   subroutine expect_equal_files(path, other, names, error)
      !> Paths of the two files
      character(len=*), intent(in) :: path, other
      !> Names of the data sets
      character(len=*), intent(in) :: names(:)
      !> Names the data set that differs
      type(error_t), allocatable, intent(inout) :: error
      integer(lp), allocatable :: shape(:), other_shape(:), bits(:), other_bits(:)
      integer :: k

      do k = 1, size(names)
         call read_bits(path, trim(names(k)), shape, bits, error)
         call read_bits(other, trim(names(k)), other_shape, other_bits, error)
         if (allocated(error)) return
         if (size(shape) /= size(other_shape) .or. size(bits) /= size(other_bits)) then
            call raise(error, run_error, path//' and '//other//': shapes of '//trim(names(k))//' differ')
         else if (any(shape /= other_shape) .or. any(bits /= other_bits)) then
            call raise(error, run_error, path//' and '//other//' differ in '//trim(names(k)))
         end if
         if (allocated(error)) return
      end do
   end subroutine expect_equal_files

   subroutine read_bits(path, name, shape, bits, error)
      character(len=*), intent(in) :: path, name
      integer(lp), allocatable, intent(out) :: shape(:), bits(:)
      type(error_t), allocatable, intent(inout) :: error
      type(hdf5_file_t) :: file
      real(dp), allocatable :: list(:), table(:, :), block(:, :, :)

      call file%open(path, error)
      if (allocated(error)) return
      call file%shape_of(name, shape, error)
      if (allocated(error)) return
      select case (size(shape))
      case (1)
         call file%read(name, list, error)
         bits = transfer(list, [0_lp], size(list))
      case (2)
         call file%read(name, table, error)
         bits = transfer(table, [0_lp], size(table))
      case default
         call file%read(name, block, error)
         bits = transfer(block, [0_lp], size(block))
      end select
      call file%close(error)
      if (.not. allocated(error) .and. size(bits) == 0) &
         call raise(error, run_error, path//': '//name//' is empty, so there is nothing to compare')
   end subroutine read_bits

end module compare_files
