!> Ways out of an HDF5 file: links into other files, and data sets whose numbers are kept in others.
!>
!> A file must hold all that is read from it: what lies elsewhere no seal or hash covers, and a file from a stranger
!> could make any file of the reader be read. Links within the file are harmless.
!> All calls must come from one thread.
module polydem_hdf5_links
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_int64_t, c_null_char, c_size_t
   use hdf5, only: h5d_virtual_f, h5dget_create_plist_f, h5l_type_external_f, h5l_type_soft_f, h5lget_info_f, &
      h5p_default_f, h5pclose_f, h5pget_external_count_f, h5pget_layout_f, hid_t, size_t
   use polydem_errors, only: error_t, input_error, raise
   use polydem_hdf5_place, only: expect, place_t
   implicit none
   private
   public :: close_ways_out, leads_out, check_storage, complain_of_way_out

   !> H5L_TYPE_EXTERNAL, the class of links into other files
   integer(c_int), parameter :: external_class = 64_c_int
   !> Links within the file that are followed one after the other; HDF5 follows as many
   integer, parameter :: most_links = 16

   interface
      !> HDF5's H5Lunregister, which its Fortran lacks
      integer(c_int) function h5lunregister(class) bind(C, name='H5Lunregister')
         import :: c_int
         integer(c_int), value :: class
      end function h5lunregister

      !> HDF5's H5Lget_val, which its Fortran lacks
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

   !> Let the library, which has begun, follow no link into another file.
   subroutine close_ways_out()
      integer(c_int) :: ignored

      ignored = h5lunregister(external_class)
   end subroutine close_ways_out

   !> Whether the way to a name leads into another file
   recursive logical function leads_out(place, followed) result(leads)
      !> File and name
      type(place_t), intent(in) :: place
      !> Links within the file that were followed on the way; none if absent
      integer, intent(in), optional :: followed
      type(place_t) :: target_place
      character(len=:), allocatable :: target_name
      integer(size_t) :: length
      integer :: character_set, kind_of_link, k, n, order, status
      integer(kind(place%file)) :: address
      logical :: has_order

      leads = .false.
      n = 0
      if (present(followed)) n = followed
      do k = 2, len(place%name) + 1
         if (k <= len(place%name)) then
            if (place%name(k:k) /= '/') cycle
         end if
         call h5lget_info_f(place%file, place%name(:k - 1), character_set, order, has_order, kind_of_link, address, &
                            length, status)
         if (status < 0) return
         leads = kind_of_link == h5l_type_external_f
         if (leads) return
         if (kind_of_link /= h5l_type_soft_f .or. n >= most_links) cycle
         call read_target(place, place%name(:k - 1), length, target_name)
         target_place = place
         target_place%name = target_name//place%name(k:)
         leads = leads_out(target_place, n + 1)
         return
      end do
   end function leads_out

   !> Where a link within the file leads, as a name from the top
   subroutine read_target(place, name, length, target_name)
      type(place_t), intent(in) :: place
      character(len=*), intent(in) :: name
      integer(size_t), intent(in) :: length
      character(len=:), allocatable, intent(out) :: target_name
      character(kind=c_char) :: letters(length + 1_size_t)
      integer(size_t) :: k

      letters = c_null_char
      target_name = ''
      if (h5lget_val(int(place%file, c_int64_t), name//c_null_char, letters, int(length, c_size_t), &
                     int(h5p_default_f, c_int64_t)) < 0_c_int) return
      do k = 1_size_t, length
         if (letters(k) == c_null_char) exit
         target_name = target_name//letters(k)
      end do
      if (index(target_name, '/') /= 1) target_name = name(:index(name, '/', back=.true.))//target_name
   end subroutine read_target

   !> Refuse an open data set whose numbers are in other files.
   subroutine check_storage(dataset, place, error)
      !> HDF5's number of the data set
      integer(hid_t), intent(in) :: dataset
      !> File and name
      type(place_t), intent(in) :: place
      !> Allocated if they are
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
      call expect(status, 'find where the numbers are of', place, error)
      if (n > 0) call complain_of_way_out(place, error)
   end subroutine check_storage

   !> Say that what is wanted lies in another file.
   subroutine complain_of_way_out(place, error)
      !> File and name
      type(place_t), intent(in) :: place
      !> Allocated afterwards
      type(error_t), allocatable, intent(inout) :: error

      call raise(error, input_error, place%path//': '//place%name//' lies in another file, and files that are '// &
                 'named in others are not read; copy it into this one')
   end subroutine complain_of_way_out

end module polydem_hdf5_links
