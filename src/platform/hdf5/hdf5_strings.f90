!> Texts in HDF5 files: data sets and attributes of variable-length UTF-8 strings, which h5py shows as `str`.
!>
!> HDF5 handles such strings as addresses of null-terminated texts. In a file that is written in parallel, it can write
!> attributes of this type but not data sets.
module polydem_hdf5_strings
   use, intrinsic :: iso_c_binding, only: c_char, c_loc, c_null_char, c_null_ptr, c_ptr
   use hdf5, only: h5aclose_f, h5acreate_f, h5adelete_f, h5aexists_f, h5aget_space_f, h5aget_type_f, h5aopen_f, &
      h5aread_f, h5awrite_f, h5dclose_f, h5dget_space_f, h5dget_type_f, h5dopen_f, h5dread_f, h5dvlen_reclaim_f, &
      h5oclose_f, h5oopen_f, h5sclose_f, h5screate_f, h5sget_simple_extent_npoints_f, h5tclose_f, h5tcopy_f, &
      h5tget_class_f, h5tis_variable_str_f, h5tset_cset_f, h5p_default_f, h5s_scalar_f, h5t_cset_utf8_f, h5t_float_f, &
      h5t_integer_f, h5t_no_class_f, h5t_string, hid_t, hsize_t
   use polydem_errors, only: error_t, input_error, raise
   use polydem_hdf5_dataset, only: dataset_shape, write_dataset
   use polydem_hdf5_hyperslab, only: slab_of
   use polydem_hdf5_links, only: raise_external, is_external_link
   use polydem_hdf5_location, only: check_status, dataset_location_t, reject
   use polydem_posix, only: text_at
   implicit none
   private
   public :: write_texts, read_text, write_attribute_value, read_attribute_value, write_text_attribute

contains

   !> Write a new data set of texts.
   subroutine write_texts(location, extent, texts, error)
      type(dataset_location_t), intent(in) :: location
      !> Shape: empty for a scalar, else the number of texts
      integer(hsize_t), intent(in) :: extent(:)
      !> The texts; trailing blanks of list elements are removed
      character(len=*), intent(in) :: texts(:)
      type(error_t), allocatable, intent(inout) :: error
      character(kind=c_char), allocatable, target :: characters(:)
      type(c_ptr), allocatable, target :: addresses(:)
      integer(hid_t) :: kind_in_file
      integer :: status

      call pack_texts(texts, size(extent) > 0, characters, addresses)
      call text_type(location, kind_in_file, error)
      if (allocated(error)) return
      call write_dataset(location, kind_in_file, slab_of(location, extent, c_loc(addresses), 1), .true., error)
      call h5tclose_f(kind_in_file, status)
   end subroutine write_texts

   !> Store texts one after the other, each terminated by a null character, and return their addresses.
   subroutine pack_texts(texts, trimmed, characters, addresses)
      character(len=*), intent(in) :: texts(:)
      logical, intent(in) :: trimmed
      character(kind=c_char), allocatable, target, intent(out) :: characters(:)
      type(c_ptr), allocatable, intent(out) :: addresses(:)
      integer :: i, k, n, length

      allocate (characters(size(texts)*(len(texts) + 1) + 1), addresses(max(1, size(texts))))
      addresses = c_null_ptr
      n = 0
      do i = 1, size(texts)
         length = len(texts)
         if (trimmed) length = len_trim(texts(i))
         addresses(i) = c_loc(characters(n + 1))
         do k = 1, length
            characters(n + k) = texts(i) (k:k)
         end do
         n = n + length + 1
         characters(n) = c_null_char
      end do
   end subroutine pack_texts

   !> Create the HDF5 type of variable-length UTF-8 strings.
   subroutine text_type(location, kind_in_file, error)
      type(dataset_location_t), intent(in) :: location
      integer(hid_t), intent(out) :: kind_in_file
      type(error_t), allocatable, intent(inout) :: error
      integer :: status

      call h5tcopy_f(h5t_string, kind_in_file, status)
      if (status >= 0) call h5tset_cset_f(kind_in_file, h5t_cset_utf8_f, status)
      call check_status(status, 'create the type of', location, error)
   end subroutine text_type

   !> Read a data set of one text.
   subroutine read_text(location, text, error)
      type(dataset_location_t), intent(in) :: location
      !> The text
      character(len=:), allocatable, intent(out) :: text
      !> Allocated on failure, or if the data set is not one text
      type(error_t), allocatable, intent(inout) :: error
      integer(hsize_t), allocatable :: extent(:)
      type(c_ptr), target :: address
      type(c_ptr) :: buffer
      integer(hid_t) :: dataset, space, kind_in_file
      logical :: variable
      integer :: status, ignored

      call dataset_shape(location, extent, error)
      if (allocated(error)) return
      call h5dopen_f(location%file, location%name, dataset, status)
      if (status >= 0) call h5dget_type_f(dataset, kind_in_file, status)
      call check_status(status, 'open', location, error)
      if (allocated(error)) return
      call h5tis_variable_str_f(kind_in_file, variable, status)
      if (status < 0 .or. size(extent) > 0) variable = .false.
      if (variable) then
         ! A text that was never written has a null address.
         address = c_null_ptr
         buffer = c_loc(address)
         call h5dread_f(dataset, kind_in_file, buffer, status)
         call check_status(status, 'read', location, error)
         if (.not. allocated(error)) then
            text = text_at(address)
            call h5dget_space_f(dataset, space, ignored)
            call h5dvlen_reclaim_f(kind_in_file, space, h5p_default_f, buffer, ignored)
            call h5sclose_f(space, ignored)
         end if
      else
         call reject(location, 'does not hold one text of variable length', error)
      end if
      call h5tclose_f(kind_in_file, ignored)
      call h5dclose_f(dataset, ignored)
   end subroutine read_text

   !> Write a text attribute of a group or data set. An existing attribute of this name is replaced.
   subroutine write_text_attribute(location, name, text, error)
      !> File, and name of the group or data set
      type(dataset_location_t), intent(in) :: location
      !> Name of the attribute
      character(len=*), intent(in) :: name
      !> The text
      character(len=*), intent(in) :: text
      type(error_t), allocatable, intent(inout) :: error
      character(kind=c_char), allocatable, target :: characters(:)
      type(c_ptr), allocatable, target :: addresses(:)
      integer(hid_t) :: kind_in_file
      integer :: status

      call pack_texts([text], .false., characters, addresses)
      call text_type(location, kind_in_file, error)
      if (allocated(error)) return
      call write_attribute_value(location, name, kind_in_file, c_loc(addresses), error)
      call h5tclose_f(kind_in_file, status)
   end subroutine write_text_attribute

   !> Write an attribute of one value to a group or data set. An existing attribute of this name is replaced.
   subroutine write_attribute_value(location, name, kind_in_file, address, error)
      !> File, and name of the group or data set
      type(dataset_location_t), intent(in) :: location
      !> Name of the attribute
      character(len=*), intent(in) :: name
      !> HDF5 type in memory and in the file
      integer(hid_t), intent(in) :: kind_in_file
      !> Address of the value
      type(c_ptr), intent(in) :: address
      type(error_t), allocatable, intent(inout) :: error
      integer(hid_t) :: object, space, attribute
      logical :: there
      integer :: status, ignored

      call h5oopen_f(location%file, location%name, object, status)
      call check_status(status, 'open', location, error)
      if (allocated(error)) return
      call h5aexists_f(object, name, there, status)
      if (status >= 0 .and. there) call h5adelete_f(object, name, status)
      if (status >= 0) call h5screate_f(h5s_scalar_f, space, status)
      if (status >= 0) call h5acreate_f(object, name, kind_in_file, space, attribute, status)
      if (status >= 0) call h5awrite_f(attribute, kind_in_file, address, status)
      call check_status(status, "write the attribute '"//name//"' of", location, error)
      call h5aclose_f(attribute, ignored)
      call h5sclose_f(space, ignored)
      call h5oclose_f(object, ignored)
   end subroutine write_attribute_value

   !> Read a numeric attribute of a group or data set.
   subroutine read_attribute_value(location, name, kind_in_memory, address, there, error)
      !> File, and name of the group or data set
      type(dataset_location_t), intent(in) :: location
      !> Name of the attribute
      character(len=*), intent(in) :: name
      !> HDF5 type in memory; HDF5 converts the value
      integer(hid_t), intent(in) :: kind_in_memory
      !> Address of the value, which is unchanged if the attribute does not exist
      type(c_ptr), intent(in) :: address
      !> Whether the attribute exists
      logical, intent(out) :: there
      !> Allocated if the attribute cannot be read or is not exactly one number
      type(error_t), allocatable, intent(inout) :: error
      integer(hid_t) :: object, attribute
      type(c_ptr) :: buffer
      logical :: is_number
      integer :: status, ignored

      there = .false.
      if (is_external_link(location)) then
         call raise_external(location, error)
         return
      end if
      call h5oopen_f(location%file, location%name, object, status)
      call check_status(status, 'open', location, error)
      if (allocated(error)) return
      call h5aexists_f(object, name, there, status)
      if (status >= 0 .and. there) then
         buffer = address
         call h5aopen_f(object, name, attribute, status)
         if (status >= 0) then
            ! The memory at `address` holds only one number.
            is_number = holds_one_number(attribute)
            if (is_number) call h5aread_f(attribute, kind_in_memory, buffer, status)
            call check_status(status, "read the attribute '"//name//"' of", location, error)
            if (.not. is_number) call raise(error, input_error, location%path//": the attribute '"//name//"' of "// &
                                            location%name//' must be one number')
            call h5aclose_f(attribute, ignored)
         end if
      end if
      call check_status(status, "read the attribute '"//name//"' of", location, error)
      call h5oclose_f(object, ignored)
   end subroutine read_attribute_value

   !> Whether an open attribute contains exactly one real number or integer
   logical function holds_one_number(attribute)
      integer(hid_t), intent(in) :: attribute
      integer(hid_t) :: kind_in_file, space
      integer(hsize_t) :: n
      integer :: type_class, status, ignored

      n = 0_hsize_t
      type_class = h5t_no_class_f
      call h5aget_space_f(attribute, space, status)
      if (status >= 0) then
         call h5sget_simple_extent_npoints_f(space, n, status)
         call h5sclose_f(space, ignored)
      end if
      call h5aget_type_f(attribute, kind_in_file, status)
      if (status >= 0) then
         call h5tget_class_f(kind_in_file, type_class, status)
         call h5tclose_f(kind_in_file, ignored)
      end if
      holds_one_number = n == 1_hsize_t .and. (type_class == h5t_float_f .or. type_class == h5t_integer_f)
   end function holds_one_number

end module polydem_hdf5_strings
