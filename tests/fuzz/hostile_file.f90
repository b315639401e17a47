!> An HDF5 file of spoilt fields: every type, layout and link that HDF5 has, under names that a reader asks for.
module hostile_file
   use, intrinsic :: iso_c_binding, only: c_char, c_loc, c_null_char, c_ptr
   use hdf5, only: h5aclose_f, h5acreate_f, h5awrite_f, h5dclose_f, h5dcreate_f, h5dont_atexit_f, h5dwrite_f, &
      h5eset_auto_f, h5f_acc_trunc_f, h5fclose_f, h5fcreate_f, h5gclose_f, h5gcreate_f, h5gopen_f, &
      h5lcreate_external_f, h5lcreate_hard_f, h5lcreate_soft_f, h5open_f, h5pclose_f, h5pcreate_f, h5pset_buffer_f, &
      h5pset_chunk_f, h5pset_create_inter_group_f, h5pset_deflate_f, h5pset_fletcher32_f, h5pset_shuffle_f, &
      h5sclose_f, h5screate_f, h5screate_simple_f
   use hdf5, only: h5fget_obj_count_f, h5tarray_create_f, h5tclose_f, h5tcopy_f, h5tcreate_f, h5tenum_create_f, &
      h5tenum_insert_f, h5tinsert_f, h5tset_size_f, h5tvlen_create_f
   use hdf5, only: h5f_obj_all_f, h5p_dataset_create_f, h5p_dataset_xfer_f, h5p_link_create_f, h5s_null_f, &
      h5t_compound_f, h5t_fortran_s1, &
      h5t_ieee_f32le, h5t_ieee_f64be, h5t_ieee_f64le, h5t_native_double, h5t_opaque_f, h5t_std_b8le, h5t_std_i16be, &
      h5t_std_i32le, h5t_std_i64be, h5t_std_i64le, h5t_std_i8le, h5t_std_ref_obj, h5t_std_u64le, h5t_std_u8le, &
      h5t_string, hid_t, hsize_t, size_t
   use hostile_fields, only: absent, as_group, as_it_is, as_link, as_null, field_t, in_chunks, other_type, shape_only
   use polydem_kinds, only: dp, ip
   use polydem_random, only: random_t
   implicit none
   private
   public :: start_hdf5, write_hostile_file, count_open_objects

   !> Number of the types that `type_in_file` makes, of which the first take numbers
   integer(ip), parameter :: n_types = 18_ip, n_number_types = 10_ip
   !> Larger shapes stay without values
   real(dp), parameter :: most_values = 1.0e5_dp

contains

   !> Write a file, and perhaps the attribute dt of its top level.
   subroutine write_hostile_file(path, fields, random, with_dt)
      !> Path of the file
      character(len=*), intent(in) :: path
      !> Its data sets
      type(field_t), intent(in) :: fields(:)
      !> Random numbers
      type(random_t), intent(inout) :: random
      !> Whether there is an attribute, sound or not
      logical, intent(in) :: with_dt
      integer(hid_t) :: file
      integer :: k, status

      call h5fcreate_f(path, h5f_acc_trunc_f, file, status)
      do k = 1, size(fields)
         select case (fields(k)%storage)
         case (absent)
            cycle
         case (as_group)
            call write_group(file, fields(k)%name)
         case (as_link)
            call write_link(file, fields(k)%name, random)
         case default
            call write_field(file, fields(k), random)
         end select
      end do
      if (with_dt) call write_attribute(file, random)
      call h5fclose_f(file, status)
   end subroutine write_hostile_file

   !> Make HDF5 ready, once, and silent.
   subroutine start_hdf5()
      integer :: status

      call h5dont_atexit_f(status)
      call h5open_f(status)
      call h5eset_auto_f(0, status)
   end subroutine start_hdf5

   !> Number of HDF5's objects that somebody forgot to close, in all files
   integer function count_open_objects()
      integer(size_t) :: n
      integer :: status

      call h5fget_obj_count_f(int(h5f_obj_all_f, hid_t), h5f_obj_all_f, n, status)
      count_open_objects = int(n)
   end function count_open_objects

   subroutine write_group(file, name)
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: name
      integer(hid_t) :: group
      integer :: status

      call h5gcreate_f(file, name, group, status)
      call h5gclose_f(group, status)
   end subroutine write_group

   subroutine write_link(file, name, random)
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: name
      type(random_t), intent(inout) :: random
      integer :: status

      select case (random%whole(1_ip, 5_ip))
      case (1)
         call h5lcreate_soft_f('/nowhere', file, name, status)
      case (2)
         call h5lcreate_soft_f('/'//name, file, name, status)
      case (3)
         call h5lcreate_external_f('no_such_file.h5', '/vertex', file, name, status)
      case (4)
         call h5lcreate_external_f('spoilt.h5', '/'//name, file, name, status)
      case default
         call h5lcreate_hard_f(file, '/', file, name, status)
      end select
   end subroutine write_link

   subroutine write_field(file, field, random)
      integer(hid_t), intent(in) :: file
      type(field_t), intent(in) :: field
      type(random_t), intent(inout) :: random
      real(dp), allocatable, target :: buffer(:)
      character(len=:, kind=c_char), allocatable, target :: letters
      type(c_ptr), target :: address
      integer(hid_t) :: dataset, kind_in_file, links, properties, space, transfer
      logical :: has_numbers
      integer :: status

      call h5pcreate_f(h5p_link_create_f, links, status)
      call h5pset_create_inter_group_f(links, 1, status)
      call h5pcreate_f(h5p_dataset_create_f, properties, status)
      if (field%storage == as_null) then
         call h5screate_f(h5s_null_f, space, status)
      else
         call h5screate_simple_f(size(field%extent), field%extent, space, status)
      end if
      if (field%storage == in_chunks .or. field%storage == shape_only) call choose_chunks(field, random, properties)
      call choose_type(field, random, kind_in_file, has_numbers)
      call h5dcreate_f(file, field%name, kind_in_file, space, dataset, status, dcpl_id=properties, lcpl_id=links)
      if (status >= 0) then
         if (has_numbers .and. field%storage /= shape_only .and. field%storage /= as_null .and. &
             product(real(field%extent, dp)) < most_values) then
            buffer = padded(field%value, int(product(field%extent)))
            call h5dwrite_f(dataset, h5t_native_double, c_loc(buffer), status)
         else if (field%text /= '' .and. field%storage == as_it_is .and. size(field%extent) == 0) then
            letters = field%text//c_null_char
            address = c_loc(letters)
            ! HDF5 clears two buffers of a megabyte per text unless told otherwise.
            call h5pcreate_f(h5p_dataset_xfer_f, transfer, status)
            call h5pset_buffer_f(transfer, 1024_hsize_t, status)
            call h5dwrite_f(dataset, kind_in_file, c_loc(address), status, xfer_prp=transfer)
            call h5pclose_f(transfer, status)
         end if
         call h5dclose_f(dataset, status)
      end if
      call h5tclose_f(kind_in_file, status)
      call h5sclose_f(space, status)
      call h5pclose_f(properties, status)
      call h5pclose_f(links, status)
   end subroutine write_field

   !> The values, cut or continued with zeros
   pure function padded(value, n)
      real(dp), intent(in) :: value(:)
      integer, intent(in) :: n
      real(dp), allocatable :: padded(:)

      allocate (padded(max(1, n)), source=0.0_dp)
      padded(:min(n, size(value))) = value(:min(n, size(value)))
   end function padded

   subroutine choose_chunks(field, random, properties)
      type(field_t), intent(in) :: field
      type(random_t), intent(inout) :: random
      integer(hid_t), intent(in) :: properties
      integer(hsize_t) :: chunk(size(field%extent))
      integer(ip) :: layout
      integer :: status

      layout = random%whole(1_ip, 3_ip)
      if (size(chunk) == 0 .or. (field%storage == shape_only .and. layout == 1_ip)) return
      chunk = max(1_hsize_t, min(field%extent, int(random%whole(1_ip, 5_ip), hsize_t)))
      call h5pset_chunk_f(properties, size(chunk), chunk, status)
      if (random%whole(1_ip, 2_ip) == 1_ip) call h5pset_shuffle_f(properties, status)
      if (random%whole(1_ip, 2_ip) == 1_ip) call h5pset_deflate_f(properties, 1, status)
      if (random%whole(1_ip, 2_ip) == 1_ip) call h5pset_fletcher32_f(properties, status)
   end subroutine choose_chunks

   subroutine choose_type(field, random, kind_in_file, has_numbers)
      type(field_t), intent(in) :: field
      type(random_t), intent(inout) :: random
      integer(hid_t), intent(out) :: kind_in_file
      logical, intent(out) :: has_numbers
      integer(ip) :: which
      integer :: status

      has_numbers = .true.
      if (field%storage == other_type) then
         which = random%whole(1_ip, n_types)
         has_numbers = which <= n_number_types
         call make_type(which, kind_in_file)
      else if (field%text /= '') then
         has_numbers = .false.
         call h5tcopy_f(h5t_string, kind_in_file, status)
      else if (field%whole) then
         call h5tcopy_f(h5t_std_i64le, kind_in_file, status)
      else
         call h5tcopy_f(h5t_ieee_f64le, kind_in_file, status)
      end if
   end subroutine choose_type

   !> One of the types that HDF5 has
   subroutine make_type(which, made)
      integer(ip), intent(in) :: which
      integer(hid_t), intent(out) :: made
      integer(hid_t) :: of_numbers(n_number_types)
      integer :: status

      of_numbers = [h5t_ieee_f64le, h5t_ieee_f64be, h5t_ieee_f32le, h5t_std_i8le, h5t_std_u8le, h5t_std_i16be, &
                    h5t_std_i32le, h5t_std_i64le, h5t_std_i64be, h5t_std_u64le]
      select case (which)
      case (:n_number_types)
         call h5tcopy_f(of_numbers(which), made, status)
      case (n_number_types + 1_ip)
         call h5tcopy_f(h5t_fortran_s1, made, status)
         call h5tset_size_f(made, 9_size_t, status)
      case (n_number_types + 2_ip)
         call h5tcopy_f(h5t_string, made, status)
      case (n_number_types + 3_ip)
         call h5tcreate_f(h5t_compound_f, 16_size_t, made, status)
         call h5tinsert_f(made, 'x', 0_size_t, h5t_ieee_f64le, status)
         call h5tinsert_f(made, 'n', 8_size_t, h5t_std_i64le, status)
      case (n_number_types + 4_ip)
         call h5tcreate_f(h5t_opaque_f, 7_size_t, made, status)
      case (n_number_types + 5_ip)
         call h5tarray_create_f(h5t_ieee_f64le, 1, [3_hsize_t], made, status)
      case (n_number_types + 6_ip)
         call h5tvlen_create_f(h5t_ieee_f64le, made, status)
      case (n_number_types + 7_ip)
         call h5tenum_create_f(h5t_std_i32le, made, status)
         call h5tenum_insert_f(made, 'FALSE', 0, status)
         call h5tenum_insert_f(made, 'MANY', 2147483647, status)
      case default
         call h5tcopy_f(merge(h5t_std_ref_obj, h5t_std_b8le, mod(which, 2_ip) == 0_ip), made, status)
      end select
   end subroutine make_type

   !> The attribute dt: one number, or many, or something else.
   subroutine write_attribute(file, random)
      integer(hid_t), intent(in) :: file
      type(random_t), intent(inout) :: random
      real(dp), target :: buffer(4000)
      integer(hid_t) :: attribute, kind_in_file, space, group
      integer(ip) :: which
      integer :: status

      buffer = 10.0_dp**random%whole(-300_ip, 300_ip)
      if (random%whole(1_ip, 10_ip) == 1_ip) buffer = -buffer
      select case (random%whole(1_ip, 4_ip))
      case (1)
         call h5screate_simple_f(1, [int(random%whole(0_ip, 4000_ip), hsize_t)], space, status)
      case (2)
         call h5screate_f(h5s_null_f, space, status)
      case default
         call h5screate_simple_f(0, [integer(hsize_t) ::], space, status)
      end select
      which = 1_ip
      if (random%whole(1_ip, 2_ip) == 1_ip) which = random%whole(1_ip, n_types)
      call make_type(which, kind_in_file)
      call h5gopen_f(file, '/', group, status)
      call h5acreate_f(group, 'dt', kind_in_file, space, attribute, status)
      if (status >= 0) then
         if (which <= n_number_types) call h5awrite_f(attribute, h5t_native_double, c_loc(buffer), status)
         call h5aclose_f(attribute, status)
      end if
      call h5gclose_f(group, status)
      call h5tclose_f(kind_in_file, status)
      call h5sclose_f(space, status)
   end subroutine write_attribute

end module hostile_file
