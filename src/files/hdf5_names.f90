!> What stands at the top level of an open HDF5 file: names, and whether a name is a data set.
!>
!> All calls must come from one thread.
module polydem_hdf5_names
   use hdf5, only: h5_index_name_f, h5_iter_inc_f, h5gclose_f, h5gget_info_f, h5gopen_f, h5i_dataset_f, h5iget_type_f, &
      h5lget_name_by_idx_f, h5oclose_f, h5oopen_f, hid_t, hsize_t, size_t
   use polydem_errors, only: error_t
   use polydem_hdf5_dataset, only: expect, place_t
   implicit none
   private
   public :: list_names, is_dataset

contains

   !> List the names at the top level in alphabetical order.
   subroutine list_names(place, names, error)
      !> File; the name is that of the top level, /
      type(place_t), intent(in) :: place
      !> Names, all as long as the longest
      character(len=:), allocatable, intent(out) :: names(:)
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: buffer
      integer(hid_t) :: group
      integer(size_t) :: length, longest
      integer(hsize_t) :: k
      integer :: kind_of_links, last_order, n, pass, status, ignored

      call h5gopen_f(place%file, '/', group, status)
      call expect(status, 'open', place, error)
      if (allocated(error)) return
      call h5gget_info_f(group, kind_of_links, n, last_order, status)
      longest = 1_size_t
      ! Once for the greatest length, once for the names.
      do pass = 1, 2
         allocate (character(len=longest) :: buffer)
         if (pass == 2) allocate (character(len=longest) :: names(n))
         do k = 1_hsize_t, int(n, hsize_t)
            if (status < 0) exit
            call h5lget_name_by_idx_f(group, '.', h5_index_name_f, h5_iter_inc_f, k - 1_hsize_t, buffer, status, length)
            longest = max(longest, length)
            if (pass == 2) names(k) = buffer
         end do
         deallocate (buffer)
      end do
      call expect(status, 'list the names in', place, error)
      call h5gclose_f(group, ignored)
   end subroutine list_names

   !> Whether a name stands for a data set, rather than a group, a type, or a link to nowhere
   logical function is_dataset(place)
      !> File and name
      type(place_t), intent(in) :: place
      integer(hid_t) :: object
      integer :: kind_of_object, status

      is_dataset = .false.
      call h5oopen_f(place%file, place%name, object, status)
      if (status < 0) return
      call h5iget_type_f(object, kind_of_object, status)
      if (status >= 0) is_dataset = kind_of_object == h5i_dataset_f
      call h5oclose_f(object, status)
   end function is_dataset

end module polydem_hdf5_names
