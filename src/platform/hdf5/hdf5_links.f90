!> References of an HDF5 file to other files: external links, and data sets with external storage. They are rejected.
!>
!> A file must contain all data that are read from it. Checksums and hashes do not cover data in other files, and an
!> untrusted file could make the program read any file of the user. Links within the file are harmless.
!> All calls must come from one thread.
module polydem_hdf5_links
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_int64_t, c_null_char, c_size_t
   use hdf5, only: h5d_virtual_f, h5dget_create_plist_f, h5l_type_external_f, h5l_type_soft_f, h5lget_info_f, &
      h5p_default_f, h5pclose_f, h5pget_external_count_f, h5pget_layout_f, hid_t, size_t
   use polydem_errors, only: error_t
   use polydem_hdf5_location, only: check_status, dataset_location_t, reject
   implicit none
   private
   public :: disable_external_links, is_external_link, check_storage, raise_external

   !> H5L_TYPE_EXTERNAL, the class of external links
   integer(c_int), parameter :: external_class = 64_c_int
   !> Maximum number of soft links that are followed in a chain, the same as in HDF5
   integer, parameter :: most_links = 16

   interface
      !> HDF5 function H5Lunregister, which is missing from its Fortran interface
      integer(c_int) function h5lunregister(class) bind(C, name='H5Lunregister')
         import :: c_int
         integer(c_int), value :: class
      end function h5lunregister

      !> HDF5 function H5Lget_val, which is missing from its Fortran interface
      integer(c_int) function h5lget_val(file, name, value, length, access) bind(C, name='H5Lget_val')
         import :: c_char, c_int, c_int64_t, c_size_t
         integer(c_int64_t), value :: file
         character(kind=c_char), intent(in) :: name(*)
         character(kind=c_char), intent(out) :: value(*)
         integer(c_size_t), value :: length
         integer(c_int64_t), value :: access
      end function h5lget_val
   end interface

contains

   !> Disable external links in the HDF5 library, which must be initialised.
   subroutine disable_external_links()
      integer(c_int) :: ignored

      ignored = h5lunregister(external_class)
   end subroutine disable_external_links

   !> Whether the path of a name contains an external link
   recursive logical function is_external_link(location, followed) result(is_external)
      type(dataset_location_t), intent(in) :: location
      !> Number of soft links that were already followed; 0 if absent
      integer, intent(in), optional :: followed
      type(dataset_location_t) :: target_location
      character(len=:), allocatable :: target_name
      integer(size_t) :: length
      integer :: character_set, kind_of_link, k, n, order, status
      integer(kind(location%file)) :: address
      logical :: has_order

      is_external = .false.
      n = 0
      if (present(followed)) n = followed
      do k = 2, len(location%name) + 1
         if (k <= len(location%name)) then
            if (location%name(k:k) /= '/') cycle
         end if
         call h5lget_info_f(location%file, location%name(:k - 1), character_set, order, has_order, kind_of_link, &
                            address, length, status)
         if (status < 0) return
         is_external = kind_of_link == h5l_type_external_f
         if (is_external) return
         if (kind_of_link /= h5l_type_soft_f .or. n >= most_links) cycle
         call read_target(location, location%name(:k - 1), length, target_name)
         target_location = location
         target_location%name = target_name//location%name(k:)
         is_external = is_external_link(target_location, n + 1)
         return
      end do
   end function is_external_link

   !> Target of a soft link as an absolute name
   subroutine read_target(location, name, length, target_name)
      type(dataset_location_t), intent(in) :: location
      character(len=*), intent(in) :: name
      integer(size_t), intent(in) :: length
      character(len=:), allocatable, intent(out) :: target_name
      character(kind=c_char) :: characters(length + 1_size_t)
      integer(size_t) :: k

      characters = c_null_char
      target_name = ''
      if (h5lget_val(int(location%file, c_int64_t), name//c_null_char, characters, int(length, c_size_t), &
                     int(h5p_default_f, c_int64_t)) < 0_c_int) return
      do k = 1_size_t, length
         if (characters(k) == c_null_char) exit
         target_name = target_name//characters(k)
      end do
      if (index(target_name, '/') /= 1) target_name = name(:index(name, '/', back=.true.))//target_name
   end subroutine read_target

   !> Reject an open data set whose values are stored in other files.
   subroutine check_storage(dataset, location, error)
      !> HDF5 identifier of the open data set
      integer(hid_t), intent(in) :: dataset
      type(dataset_location_t), intent(in) :: location
      !> Allocated if the values are in other files
      type(error_t), allocatable, intent(inout) :: error
      integer(hid_t) :: properties
      integer :: layout, n, status, ignored

      n = 0
      call h5dget_create_plist_f(dataset, properties, status)
      if (status >= 0) then
         call h5pget_layout_f(properties, layout, status)
         if (status >= 0 .and. layout == h5d_virtual_f) n = 1
         if (status >= 0 .and. n == 0) call h5pget_external_count_f(properties, n, status)
         call h5pclose_f(properties, ignored)
      end if
      call check_status(status, 'find the storage of', location, error)
      if (n > 0) call raise_external(location, error)
   end subroutine check_storage

   !> Report that a data set is in another file.
   subroutine raise_external(location, error)
      type(dataset_location_t), intent(in) :: location
      !> Always allocated afterwards
      type(error_t), allocatable, intent(inout) :: error

      call reject(location, 'lies in another file. External links and external storage are not followed; copy the '// &
                  'data set into this file', error)
   end subroutine raise_external

end module polydem_hdf5_links
