!> Unbuffered text output to a file or to the screen.
!>
!> Every written line survives a crash of the program, and every failure is detected. The Fortran `flush` statement does
!> not report a full disk.
module polydem_line_writer
   use, intrinsic :: iso_c_binding, only: c_int, c_new_line, c_null_char
   use, intrinsic :: iso_fortran_env, only: output_unit
   use polydem_errors, only: error_t, io_error, raise
   use polydem_file_status, only: is_shared
   use polydem_file_system, only: exists, last_failure, remove_file, rename_file, sync_file
   use polydem_folders, only: read_bytes
   use polydem_posix, only: c_close, c_creat, c_open, error_number, is_written, standard_error, &
      standard_output
   implicit none
   private
   public :: line_writer_t

   !> An open text file, or the screen. Writing has no effect if it is closed or after a failure. It is no failure if
   !> the screen is a pipe whose reader has stopped, as with `| head`.
   type :: line_writer_t
      private
      !> File descriptor; negative if closed
      integer(c_int) :: descriptor = -1_c_int
      !> Path of the file, or name of the stream, for messages
      character(len=:), allocatable :: name
      !> Reason of the first failed write
      character(len=:), allocatable :: failure
   contains
      procedure :: open => open_writer
      procedure :: open_screen
      procedure :: put
      procedure :: put_line
      procedure :: check
      procedure :: close => close_writer
      procedure, private :: is_screen
   end type line_writer_t

   !> EPIPE of errno on Linux: the reader of the pipe has closed it
   integer(c_int), parameter :: broken_pipe = 32_c_int
   !> Permissions of a new file before umask: rw-rw-rw-
   integer(c_int), parameter :: read_and_write = int(o'666', c_int)
   !> Suffix of the temporary name of a copy, one of those that files of a result have
   character(len=*), parameter :: temporary = '.unfinished'
   !> O_WRONLY and O_APPEND of Linux
   integer(c_int), parameter :: write_and_append = int(o'2001', c_int)

contains

   !> Open a file for writing. An existing file is replaced unless `appended` is true. What other names of the file show
   !> does not change: a link, or a file with several names, is first replaced by a new file.
   recursive subroutine open_writer(self, path, error, appended)
      class(line_writer_t), intent(inout) :: self
      !> Path of the file
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(inout) :: error
      !> Whether to append to an existing file; false if absent
      logical, intent(in), optional :: appended
      logical :: appends

      self%name = path
      if (allocated(self%failure)) deallocate (self%failure)
      appends = exists(path)
      if (appends) appends = present(appended)
      if (appends) appends = appended
      if (is_shared(path)) then
         if (appends) call copy_file(path, error)
         if (.not. appends) call remove_file(path, error)
         if (allocated(error)) return
      end if
      if (appends) self%descriptor = c_open(path//c_null_char, write_and_append, 0_c_int)
      if (.not. appends) self%descriptor = c_creat(path//c_null_char, read_and_write)
      if (self%descriptor < 0_c_int) call raise(error, io_error, path//': cannot be written: '//last_failure())
   end subroutine open_writer

   !> Replace a file by a copy of it, atomically.
   recursive subroutine copy_file(path, error)
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(inout) :: error
      type(line_writer_t) :: copy
      character(len=:), allocatable :: text

      call read_bytes(path, text, error)
      if (allocated(error)) return
      call copy%open(path//temporary, error)
      call copy%put(text)
      call copy%close(error)
      if (.not. allocated(error)) call sync_file(path//temporary, error)
      if (.not. allocated(error)) call rename_file(path//temporary, path, error)
   end subroutine copy_file

   !> Open standard output. Its previous Fortran output is flushed before each write.
   subroutine open_screen(self, errors)
      class(line_writer_t), intent(inout) :: self
      !> Whether to open standard error instead; false if absent
      logical, intent(in), optional :: errors

      self%name = 'standard output'
      self%descriptor = standard_output
      if (allocated(self%failure)) deallocate (self%failure)
      if (.not. present(errors)) return
      if (.not. errors) return
      self%name = 'standard error'
      self%descriptor = standard_error
   end subroutine open_screen

   !> Write a text unchanged. A failure is stored and reported by `check` and `close`.
   subroutine put(self, text)
      class(line_writer_t), intent(inout) :: self
      !> The text
      character(len=*), intent(in) :: text
      integer :: ignored

      if (self%descriptor < 0_c_int .or. allocated(self%failure)) return
      if (self%descriptor == standard_output) flush (output_unit, iostat=ignored)
      if (is_written(self%descriptor, text)) return
      if (error_number() == broken_pipe .and. self%is_screen()) then
         self%descriptor = -1_c_int
      else
         self%failure = last_failure()
      end if
   end subroutine put

   !> Write a text and a line feed.
   subroutine put_line(self, text)
      class(line_writer_t), intent(inout) :: self
      !> The line
      character(len=*), intent(in) :: text

      call self%put(text//c_new_line)
   end subroutine put_line

   !> Report a failed write while the file is open.
   subroutine check(self, error)
      class(line_writer_t), intent(in) :: self
      !> Allocated if a text could not be written
      type(error_t), allocatable, intent(inout) :: error

      if (allocated(self%failure)) call raise(error, io_error, self%name//': cannot be written: '//self%failure)
   end subroutine check

   !> Close the file and report a failed write. A stream of the screen stays open.
   subroutine close_writer(self, error)
      class(line_writer_t), intent(inout) :: self
      !> Allocated if a write failed
      type(error_t), allocatable, intent(inout) :: error

      if (self%descriptor < 0_c_int) return
      if (.not. self%is_screen()) then
         if (c_close(self%descriptor) /= 0_c_int .and. .not. allocated(self%failure)) self%failure = last_failure()
      end if
      self%descriptor = -1_c_int
      call self%check(error)
   end subroutine close_writer

   !> Whether the writer uses standard output or standard error
   pure logical function is_screen(self)
      class(line_writer_t), intent(in) :: self

      is_screen = self%descriptor == standard_output .or. self%descriptor == standard_error
   end function is_screen

end module polydem_line_writer
