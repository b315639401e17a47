!> HDF5 files of other programs (booleans of h5py, small and wide integers, single precision, fixed-length texts), and
!> hostile HDF5 files whose data sets claim a size without stored values.
module foreign_file
   use, intrinsic :: iso_c_binding, only: c_loc
   use, intrinsic :: iso_fortran_env, only: int8, int32, int64, real32
   use hdf5, only: h5aclose_f, h5acreate_f, h5dclose_f, h5dcreate_f, h5dwrite_f, h5f_acc_trunc_f, h5f_obj_all_f, &
      h5fclose_f, h5fcreate_f, h5fget_obj_count_f, h5kind_to_type, h5open_f, h5p_dataset_create_f, h5pclose_f, &
      h5pcreate_f, h5pset_chunk_f, h5sclose_f, h5screate_f, h5screate_simple_f, h5tclose_f, h5tcopy_f, &
      h5tenum_create_f, h5tenum_insert_f, h5tset_size_f
   use hdf5, only: h5_integer_kind, h5_real_kind, h5s_scalar_f, h5t_fortran_s1, h5t_ieee_f64le, &
      h5t_std_i16be, h5t_std_i64le, h5t_std_u8le, h5t_string, hid_t, hsize_t, size_t
   implicit none
   private
   public :: write_foreign_file, write_hollow_file, count_open_objects

contains

   !> Write the data sets flags (booleans T F T), small (unsigned bytes 0 255 7), big_endian (-2 3 4), wide (1 2 2^40),
   !> single (0.5 1.5 -2), fixed_text ('abc').
   subroutine write_foreign_file(path)
      !> Path of the file
      character(len=*), intent(in) :: path
      integer(hid_t) :: file, boolean, byte, number, long, single
      integer(int8), target :: flags(3)
      integer(int32), target :: numbers(3)
      integer(int64), target :: wide(3)
      real(real32), target :: reals(3)
      integer :: status

      flags = [1_int8, 0_int8, 1_int8]
      wide = [1_int64, 2_int64, 2_int64**40]
      reals = [0.5_real32, 1.5_real32, -2.0_real32]
      call h5open_f(status)
      call h5fcreate_f(path, h5f_acc_trunc_f, file, status)
      byte = h5kind_to_type(int8, h5_integer_kind)
      number = h5kind_to_type(int32, h5_integer_kind)
      long = h5kind_to_type(int64, h5_integer_kind)
      single = h5kind_to_type(real32, h5_real_kind)
      call h5tenum_create_f(byte, boolean, status)
      call h5tenum_insert_f(boolean, 'FALSE', 0, status)
      call h5tenum_insert_f(boolean, 'TRUE', 1, status)
      call put('flags', boolean, boolean)
      numbers = [0_int32, 255_int32, 7_int32]
      call put('small', h5t_std_u8le, number)
      numbers = [-2_int32, 3_int32, 4_int32]
      call put('big_endian', h5t_std_i16be, number)
      call put('wide', h5t_std_i64le, long)
      call put('single', single, single)
      call put_fixed_text()
      call h5tclose_f(boolean, status)
      call h5fclose_f(file, status)

   contains

      subroutine put(name, type_in_file, type_in_memory)
         character(len=*), intent(in) :: name
         integer(hid_t), intent(in) :: type_in_file, type_in_memory
         integer(hid_t) :: space, dataset

         call h5screate_simple_f(1, [3_hsize_t], space, status)
         call h5dcreate_f(file, name, type_in_file, space, dataset, status)
         if (type_in_memory == boolean) call h5dwrite_f(dataset, type_in_memory, c_loc(flags), status)
         if (type_in_memory == number) call h5dwrite_f(dataset, type_in_memory, c_loc(numbers), status)
         if (type_in_memory == long) call h5dwrite_f(dataset, type_in_memory, c_loc(wide), status)
         if (type_in_memory == single) call h5dwrite_f(dataset, type_in_memory, c_loc(reals), status)
         call h5dclose_f(dataset, status)
         call h5sclose_f(space, status)
      end subroutine put

      subroutine put_fixed_text()
         integer(hid_t) :: space, dataset, text
         character(len=3), target :: letters

         letters = 'abc'
         call h5tcopy_f(h5t_fortran_s1, text, status)
         call h5tset_size_f(text, 3_size_t, status)
         call h5screate_f(h5s_scalar_f, space, status)
         call h5dcreate_f(file, 'fixed_text', text, space, dataset, status)
         call h5dwrite_f(dataset, text, c_loc(letters), status)
         call h5dclose_f(dataset, status)
         call h5sclose_f(space, status)
         call h5tclose_f(text, status)
      end subroutine put_fixed_text

   end subroutine write_foreign_file

   !> Write the data sets claims (2^40 numbers, none stored), unwritten (1000 numbers, none stored) and unwritten_text,
   !> and the attributes three (three numbers) and word (a text) of the root group.
   subroutine write_hollow_file(path)
      !> Path of the file
      character(len=*), intent(in) :: path
      integer(hid_t) :: file, text
      integer :: status

      call h5open_f(status)
      call h5fcreate_f(path, h5f_acc_trunc_f, file, status)
      call h5tcopy_f(h5t_string, text, status)
      call put_hollow('claims', h5t_ieee_f64le, [2_hsize_t**40])
      call put_hollow('unwritten', h5t_ieee_f64le, [1000_hsize_t])
      call put_hollow('unwritten_text', text, [integer(hsize_t) ::])
      call put_attribute('three', h5t_ieee_f64le, [3_hsize_t])
      call put_attribute('word', text, [integer(hsize_t) ::])
      call h5tclose_f(text, status)
      call h5fclose_f(file, status)

   contains

      subroutine put_hollow(name, kind_in_file, extent)
         character(len=*), intent(in) :: name
         integer(hid_t), intent(in) :: kind_in_file
         integer(hsize_t), intent(in) :: extent(:)
         integer(hid_t) :: dataset, properties, space

         call h5pcreate_f(h5p_dataset_create_f, properties, status)
         if (size(extent) > 0) call h5pset_chunk_f(properties, 1, [8_hsize_t], status)
         call h5screate_simple_f(size(extent), extent, space, status)
         call h5dcreate_f(file, name, kind_in_file, space, dataset, status, dcpl_id=properties)
         call h5dclose_f(dataset, status)
         call h5sclose_f(space, status)
         call h5pclose_f(properties, status)
      end subroutine put_hollow

      subroutine put_attribute(name, kind_in_file, extent)
         character(len=*), intent(in) :: name
         integer(hid_t), intent(in) :: kind_in_file
         integer(hsize_t), intent(in) :: extent(:)
         integer(hid_t) :: attribute, space

         call h5screate_simple_f(size(extent), extent, space, status)
         call h5acreate_f(file, name, kind_in_file, space, attribute, status)
         call h5aclose_f(attribute, status)
         call h5sclose_f(space, status)
      end subroutine put_attribute

   end subroutine write_hollow_file

   !> Number of open HDF5 objects, inside and outside of files
   integer function count_open_objects()
      integer(size_t) :: n
      integer :: status

      call h5fget_obj_count_f(int(h5f_obj_all_f, hid_t), h5f_obj_all_f, n, status)
      count_open_objects = int(n)
   end function count_open_objects

end module foreign_file
