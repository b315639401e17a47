!> Contents of the root group of an open HDF5 file: names, and whether a name is a data set.
!>
!> All calls must come from one thread.
module polydem_hdf5_members
   use hdf5, only: h5_index_name_f, h5_iter_inc_f, h5gclose_f, h5gget_info_f, h5gopen_f, h5i_dataset_f, h5iget_type_f, &
      h5lget_name_by_idx_f, h5oclose_f, h5oopen_f, hid_t, hsize_t, size_t
   use polydem_errors, only: error_t
   use polydem_hdf5_links, only: is_external_link
   use polydem_hdf5_location, only: check_status, dataset_location_t, system_error
   implicit none
   private
   public :: count_names, read_name, is_dataset

contains

   !> Count the names in the root group.
   subroutine count_names(location, n, error)
      !> File; its name is that of the root group, /
      type(dataset_location_t), intent(in) :: location
      !> Number of names
      integer, intent(out) :: n
      type(error_t), allocatable, intent(inout) :: error
      integer(hid_t) :: group
      integer :: kind_of_links, last_order, status, ignored

      n = 0
      call h5gopen_f(location%file, '/', group, status)
      call check_status(status, 'open', location, error)
      if (allocated(error)) return
      call h5gget_info_f(group, kind_of_links, n, last_order, status)
      call check_status(status, 'count the names in', location, error)
      call h5gclose_f(group, ignored)
   end subroutine count_names

   !> Read one name of the root group, in alphabetical order. One name at a time, because all names may need much
   !> memory.
   subroutine read_name(location, k, name, error)
      !> File; its name is that of the root group, /
      type(dataset_location_t), intent(in) :: location
      !> Index of the name, from 1
      integer, intent(in) :: k
      !> The name
      character(len=:), allocatable, intent(out) :: name
      type(error_t), allocatable, intent(inout) :: error
      integer(size_t) :: length
      integer :: status, pass

      ! The first pass reads the length, the second pass reads the name.
      length = 1_size_t
      do pass = 1, 2
         if (allocated(name)) deallocate (name)
         allocate (character(len=length) :: name)
         call h5lget_name_by_idx_f(location%file, '/', h5_index_name_f, h5_iter_inc_f, int(k - 1, hsize_t), name, &
                                   status, length)
         call check_status(status, 'read the names in', location, error)
         if (allocated(error)) return
      end do
   end subroutine read_name

   !> Whether a name is that of a data set, not of a group, a type or a dangling link. The result is true for a name in
   !> another file; an attempt to read it gives an error
   logical function is_dataset(location, error)
      type(dataset_location_t), intent(in) :: location
      !> Allocated if the system refuses to read the file
      type(error_t), allocatable, intent(inout) :: error
      integer(hid_t) :: object
      integer :: kind_of_object, status

      is_dataset = is_external_link(location)
      if (is_dataset) return
      call h5oopen_f(location%file, location%name, object, status)
      if (status < 0) then
         if (system_error() /= 0) call check_status(status, 'open', location, error)
         return
      end if
      call h5iget_type_f(object, kind_of_object, status)
      if (status >= 0) is_dataset = kind_of_object == h5i_dataset_f
      call h5oclose_f(object, status)
   end function is_dataset

end module polydem_hdf5_members
