!> What is in folders of the operating system (POSIX, GNU C library on Linux): lists of names, links, true paths, and
!> small files as they are.
module polydem_folders
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_f_pointer, c_int, c_null_char, c_null_ptr, c_ptr, &
      c_size_t
   use polydem_errors, only: error_t, io_error, raise
   use polydem_paths, only: last_failure
   implicit none
   private
   public :: is_there, list_names, read_bytes, remove_folder, true_path

   !> AT_FDCWD of openat(2): paths are relative to the working directory
   integer(c_int), parameter :: working_directory = -100_c_int
   !> AT_SYMLINK_NOFOLLOW of openat(2)
   integer(c_int), parameter :: link_itself = 256_c_int
   !> F_OK of access(2)
   integer(c_int), parameter :: existence = 0_c_int
   !> Place of d_name in struct dirent of Linux with 64 bits, behind its number, offset, length and kind
   integer, parameter :: name_offset = 19
   !> Longest name of a file (NAME_MAX of Linux)
   integer, parameter :: longest_name = 255

   interface
      !> POSIX faccessat(2)
      integer(c_int) function c_faccessat(folder, path, mode, flags) bind(C, name='faccessat')
         import :: c_char, c_int
         integer(c_int), value :: folder
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value :: mode, flags
      end function c_faccessat

      !> POSIX opendir(3)
      type(c_ptr) function c_opendir(path) bind(C, name='opendir')
         import :: c_char, c_ptr
         character(kind=c_char), intent(in) :: path(*)
      end function c_opendir

      !> POSIX readdir(3)
      type(c_ptr) function c_readdir(stream) bind(C, name='readdir')
         import :: c_ptr
         type(c_ptr), value :: stream
      end function c_readdir

      !> POSIX closedir(3)
      integer(c_int) function c_closedir(stream) bind(C, name='closedir')
         import :: c_int, c_ptr
         type(c_ptr), value :: stream
      end function c_closedir

      !> POSIX rmdir(2)
      integer(c_int) function c_rmdir(path) bind(C, name='rmdir')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
      end function c_rmdir

      !> POSIX realpath(3), which allocates its result if there is no place for it
      type(c_ptr) function c_realpath(path, resolved) bind(C, name='realpath')
         import :: c_char, c_ptr
         character(kind=c_char), intent(in) :: path(*)
         type(c_ptr), value :: resolved
      end function c_realpath

      !> C strlen
      integer(c_size_t) function c_strlen(text) bind(C, name='strlen')
         import :: c_ptr, c_size_t
         type(c_ptr), value :: text
      end function c_strlen

      !> C free
      subroutine c_free(memory) bind(C, name='free')
         import :: c_ptr
         type(c_ptr), value :: memory
      end subroutine c_free
   end interface

contains

   !> Whether there is anything of this name, also a link that leads nowhere
   logical function is_there(path)
      !> Path of a file, folder or link
      character(len=*), intent(in) :: path

      is_there = c_faccessat(working_directory, path//c_null_char, existence, link_itself) == 0_c_int
   end function is_there

   !> List the names in a folder, in no order; a folder that is not there has none.
   subroutine list_names(folder, names, error)
      !> Path of the folder
      character(len=*), intent(in) :: folder
      !> Names, blank-padded
      character(len=longest_name), allocatable, intent(out) :: names(:)
      !> Allocated if there is such a folder but it cannot be read
      type(error_t), allocatable, intent(inout) :: error
      type(c_ptr) :: stream, entry
      integer(c_int) :: ignored
      character(len=longest_name) :: name

      allocate (names(0))
      if (.not. is_there(folder)) return
      stream = c_opendir(folder//c_null_char)
      if (.not. c_associated(stream)) then
         call raise(error, io_error, "cannot list the folder '"//folder//"': "//last_failure())
         return
      end if
      do
         entry = c_readdir(stream)
         if (.not. c_associated(entry)) exit
         name = name_of(entry)
         if (name /= '.' .and. name /= '..') names = [names, name]
      end do
      ignored = c_closedir(stream)
   end subroutine list_names

   !> Name in an entry of a folder
   function name_of(entry) result(name)
      type(c_ptr), intent(in) :: entry
      character(len=longest_name) :: name
      character(kind=c_char), pointer :: letters(:)
      integer :: k

      call c_f_pointer(entry, letters, [name_offset + longest_name + 1])
      name = ''
      do k = 1, longest_name
         if (letters(name_offset + k) == c_null_char) exit
         name(k:k) = letters(name_offset + k)
      end do
   end function name_of

   !> Read all bytes of a small file.
   subroutine read_bytes(path, text, problem)
      !> Path of the file
      character(len=*), intent(in) :: path
      !> Its bytes
      character(len=:), allocatable, intent(out) :: text
      !> Why it cannot be read; not allocated if it was
      character(len=:), allocatable, intent(out) :: problem
      character(len=256) :: reason
      integer :: bytes, status, unit

      text = ''
      open (newunit=unit, file=path, access='stream', form='unformatted', action='read', status='old', &
            iostat=status, iomsg=reason)
      if (status == 0) then
         inquire (unit=unit, size=bytes)
         deallocate (text)
         allocate (character(len=max(0, bytes)) :: text)
         if (bytes > 0) read (unit, iostat=status, iomsg=reason) text
         close (unit)
      end if
      if (status /= 0) problem = 'cannot be read: '//trim(reason)
   end subroutine read_bytes

   !> Remove a folder that is empty; nothing happens if it is not.
   subroutine remove_folder(path)
      !> Path of the folder
      character(len=*), intent(in) :: path
      integer(c_int) :: ignored

      ignored = c_rmdir(path//c_null_char)
   end subroutine remove_folder

   !> The one path of a file or folder without links and detours; empty if there is no such file
   function true_path(path) result(resolved)
      !> Any path that leads there
      character(len=*), intent(in) :: path
      character(len=:), allocatable :: resolved
      character(kind=c_char), pointer :: letters(:)
      type(c_ptr) :: text
      integer :: k

      resolved = ''
      text = c_realpath(path//c_null_char, c_null_ptr)
      if (.not. c_associated(text)) return
      call c_f_pointer(text, letters, [c_strlen(text)])
      deallocate (resolved)
      allocate (character(len=size(letters)) :: resolved)
      do k = 1, size(letters)
         resolved(k:k) = letters(k)
      end do
      call c_free(text)
   end function true_path

end module polydem_folders
