!> Contents of folders (POSIX, GNU C library on Linux): lists of names, links, canonical paths, and the bytes of small
!> files.
module polydem_folders
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_f_pointer, c_int, c_loc, c_null_char, c_null_ptr, &
      c_ptr
   use polydem_errors, only: error_t, raise_unread
   use polydem_file_status, only: is_stream, stream_reason
   use polydem_file_system, only: decide_existence, find_length, last_failure
   use polydem_kinds, only: lp
   use polydem_posix, only: c_closedir, c_faccessat, c_opendir, c_readdir, c_realpath, clear_error_number, &
      error_number, existence, text_at
   use polydem_posix_processes, only: c_free
   implicit none
   private
   public :: link_exists, list_names, read_bytes, canonical_path

   !> AT_FDCWD of openat(2): paths are relative to the working directory
   integer(c_int), parameter :: working_directory = -100_c_int
   !> AT_SYMLINK_NOFOLLOW of openat(2)
   integer(c_int), parameter :: link_itself = 256_c_int
   !> Offset of d_name in struct dirent of 64-bit Linux, after inode number, offset, length and type [B]
   integer, parameter :: name_offset = 19
   !> Maximum length of a file name (NAME_MAX of Linux)
   integer, parameter :: max_name_length = 255

contains

   !> Whether a file, folder or link exists, including a link without a target
   logical function link_exists(path, error)
      !> Path of a file, folder or link
      character(len=*), intent(in) :: path
      !> Allocated if the system does not tell; absent: such a file counts as existing
      type(error_t), allocatable, intent(inout), optional :: error

      call decide_existence(path, c_faccessat(working_directory, path//c_null_char, existence, link_itself), &
                            link_exists, error)
   end function link_exists

   !> List the names in a folder, in no particular order. The list is empty if the folder does not exist.
   subroutine list_names(folder, names, error)
      !> Path of the folder
      character(len=*), intent(in) :: folder
      !> Names, blank-padded
      character(len=max_name_length), allocatable, intent(out) :: names(:)
      !> Allocated if the folder exists but cannot be read
      type(error_t), allocatable, intent(inout) :: error
      type(c_ptr) :: stream, entry
      integer(c_int) :: ignored
      character(len=max_name_length) :: name

      allocate (names(0))
      if (.not. link_exists(folder, error)) return
      stream = c_opendir(folder//c_null_char)
      if (.not. c_associated(stream)) then
         call raise_unread(error, folder, last_failure())
         return
      end if
      do
         call clear_error_number()
         entry = c_readdir(stream)
         if (.not. c_associated(entry)) exit
         name = name_of(entry)
         if (name /= '.' .and. name /= '..') names = [names, name]
      end do
      if (error_number() /= 0_c_int) call raise_unread(error, folder, last_failure())
      ignored = c_closedir(stream)
   end subroutine list_names

   !> Name in a directory entry
   function name_of(entry) result(name)
      type(c_ptr), intent(in) :: entry
      character(len=max_name_length) :: name
      character(kind=c_char), pointer :: letters(:)

      call c_f_pointer(entry, letters, [name_offset + 1])
      name = text_at(c_loc(letters(name_offset + 1)))
   end function name_of

   !> Read all bytes of a small file.
   subroutine read_bytes(path, text, error)
      !> Path of the file
      character(len=*), intent(in) :: path
      !> Bytes of the file
      character(len=:), allocatable, intent(out) :: text
      !> Allocated if the file cannot be read
      type(error_t), allocatable, intent(inout) :: error
      character(len=256) :: reason
      integer(lp) :: bytes
      integer :: status, unit

      text = ''
      if (is_stream(path)) call raise_unread(error, path, stream_reason)
      if (allocated(error)) return
      open (newunit=unit, file=path, access='stream', form='unformatted', action='read', status='old', &
            iostat=status, iomsg=reason)
      if (status == 0) then
         call find_length(unit, bytes, status, reason)
         deallocate (text)
         allocate (character(len=max(0_lp, bytes)) :: text)
         if (bytes > 0_lp .and. status == 0) read (unit, iostat=status, iomsg=reason) text
         close (unit)
      end if
      if (status /= 0) call raise_unread(error, path, reason)
   end subroutine read_bytes

   !> Canonical path of a file or folder, without links, '.' and '..'; empty if it does not exist
   function canonical_path(path, error) result(resolved)
      !> Any path of the file or folder
      character(len=*), intent(in) :: path
      !> Allocated if the system does not tell
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: resolved
      type(c_ptr) :: text
      logical :: ignored

      text = c_realpath(path//c_null_char, c_null_ptr)
      if (.not. c_associated(text)) call decide_existence(path, -1_c_int, ignored, error)
      resolved = text_at(text)
      call c_free(text)
   end function canonical_path

end module polydem_folders
