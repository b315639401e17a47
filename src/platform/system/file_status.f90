!> Status of files (Linux): kind, number of names and identity, of a name itself and not of the target of a link, except
!> in `is_stream`.
module polydem_file_status
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_int16_t, c_int32_t, c_int64_t, c_null_char
   implicit none
   private
   public :: is_name_of, is_link, is_shared, is_stream, stream_reason

   !> struct statx of Linux, the same on all processors
   type, bind(C) :: statx_t
      !> Known fields, size of a block
      integer(c_int32_t) :: mask, block_size
      !> Attributes
      integer(c_int64_t) :: attributes
      !> Number of names (hard links), owner and group
      integer(c_int32_t) :: n_names, user, group
      !> Kind and permissions
      integer(c_int16_t) :: mode, spare
      !> Number of the file on its device, its length, and others
      integer(c_int64_t) :: number, length, blocks, attributes_mask
      !> Times of access, creation and changes
      integer(c_int64_t) :: times(8)
      !> Numbers of a special file, and of the device that holds the file
      integer(c_int32_t) :: special(2), device(2)
      !> Reserved for the kernel
      integer(c_int64_t) :: rest(14)
   end type statx_t

   !> Why such a file is not read
   character(len=*), parameter :: stream_reason = 'it is a pipe or a device, not a file'

   !> AT_FDCWD, AT_SYMLINK_NOFOLLOW and AT_EMPTY_PATH of openat(2)
   integer(c_int), parameter :: working_directory = -100_c_int, name_itself = 256_c_int, open_file = 4096_c_int
   !> STATX_BASIC_STATS of statx(2)
   integer(c_int), parameter :: basic = int(z'7ff', c_int)
   !> Bits of the kind of a file, and kinds: link, regular file
   integer, parameter :: kind_bits = int(o'170000'), link_kind = int(o'120000'), regular_kind = int(o'100000')
   !> Kind of a folder
   integer, parameter :: folder_kind = int(o'040000')

   interface
      !> statx(2)
      integer(c_int) function c_statx(folder, path, flags, mask, status) bind(C, name='statx')
         import :: c_char, c_int, statx_t
         integer(c_int), value :: folder
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value :: flags, mask
         type(statx_t), intent(out) :: status
      end function c_statx
   end interface

contains

   !> Whether a path names an open file, itself and not through a link
   logical function is_name_of(path, descriptor)
      !> The path
      character(len=*), intent(in) :: path
      !> Descriptor of the open file
      integer(c_int), intent(in) :: descriptor
      type(statx_t) :: file, name

      is_name_of = c_statx(descriptor, c_null_char, open_file, basic, file) == 0_c_int
      if (is_name_of) is_name_of = is_known(path, name)
      if (is_name_of) is_name_of = file%number == name%number .and. all(file%device == name%device)
   end function is_name_of

   !> Whether a path is a symbolic link, with or without a target
   logical function is_link(path)
      !> The path
      character(len=*), intent(in) :: path
      type(statx_t) :: status

      is_link = is_known(path, status)
      if (is_link) is_link = kind_of(status) == link_kind
   end function is_link

   !> Whether writing to a file would change what another name shows: a symbolic link, or a file with several names
   logical function is_shared(path)
      !> The path
      character(len=*), intent(in) :: path
      type(statx_t) :: status

      is_shared = is_known(path, status)
      if (is_shared) is_shared = kind_of(status) == link_kind .or. &
                                 (kind_of(status) == regular_kind .and. status%n_names > 1_c_int32_t)
   end function is_shared

   !> Whether a path names a pipe, a socket or a device, also by a link: to open one may wait for ever
   logical function is_stream(path)
      !> The path
      character(len=*), intent(in) :: path
      type(statx_t) :: status

      is_stream = c_statx(working_directory, path//c_null_char, 0_c_int, basic, status) == 0_c_int
      if (is_stream) is_stream = kind_of(status) /= regular_kind .and. kind_of(status) /= folder_kind
   end function is_stream

   !> Whether the status of a path is known
   logical function is_known(path, status)
      character(len=*), intent(in) :: path
      type(statx_t), intent(out) :: status

      is_known = c_statx(working_directory, path//c_null_char, name_itself, basic, status) == 0_c_int
   end function is_known

   !> Kind of a file
   pure integer function kind_of(status)
      type(statx_t), intent(in) :: status

      kind_of = iand(int(status%mode), kind_bits)
   end function kind_of

end module polydem_file_status
