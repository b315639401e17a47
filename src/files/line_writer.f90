!> Text written to a file or the screen at once, without a buffer.
!>
!> So every line outlives the program, and every failure is noticed: `flush` of Fortran does not tell of a full disk.
module polydem_line_writer
   use, intrinsic :: iso_c_binding, only: c_char, c_f_pointer, c_int, c_loc, c_new_line, c_null_char, c_ptr, c_size_t
   use, intrinsic :: iso_fortran_env, only: output_unit
   use polydem_errors, only: error_t, io_error, raise
   use polydem_paths, only: exists, last_failure
   implicit none
   private
   public :: line_writer_t

   !> A text file that is being written, or the screen; nothing happens while it is closed or after a failure. Whoever
   !> reads the screen through a pipe may stop reading, as `head` does: that is no failure.
   type :: line_writer_t
      private
      !> Descriptor of the operating system, negative if closed
      integer(c_int) :: descriptor = -1_c_int
      !> Path of the file, or a word for the screen
      character(len=:), allocatable :: name
      !> Why the first failed write failed
      character(len=:), allocatable :: failure
   contains
      procedure :: open => open_writer
      procedure :: open_screen
      procedure :: open_errors
      procedure :: put
      procedure :: put_line
      procedure :: check
      procedure :: close => close_writer
      procedure, private :: is_screen
   end type line_writer_t

   !> Descriptor of standard output
   integer(c_int), parameter :: standard_output = 1_c_int
   !> Descriptor of standard error
   integer(c_int), parameter :: standard_error = 2_c_int
   !> EPIPE of errno on Linux: nobody reads the pipe any more
   integer(c_int), parameter :: unread = 32_c_int
   !> Permissions of a new file before umask: rw-rw-rw-
   integer(c_int), parameter :: read_and_write = int(o'666', c_int)
   !> O_WRONLY and O_APPEND of Linux
   integer(c_int), parameter :: write_at_the_end = int(o'2001', c_int)

   interface
      !> POSIX creat(2)
      integer(c_int) function c_creat(path, mode) bind(C, name='creat')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value :: mode
      end function c_creat

      !> POSIX open(2) of a file that is there
      integer(c_int) function c_open(path, flags) bind(C, name='open')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value :: flags
      end function c_open

      !> POSIX write(2), whose ssize_t is as wide as size_t
      integer(c_size_t) function c_write(descriptor, bytes, length) bind(C, name='write')
         import :: c_int, c_ptr, c_size_t
         integer(c_int), value :: descriptor
         type(c_ptr), value :: bytes
         integer(c_size_t), value :: length
      end function c_write

      !> POSIX close(2)
      integer(c_int) function c_close(descriptor) bind(C, name='close')
         import :: c_int
         integer(c_int), value :: descriptor
      end function c_close

      !> Where errno stands (Linux)
      type(c_ptr) function errno_location() bind(C, name='__errno_location')
         import :: c_ptr
      end function errno_location
   end interface

contains

   !> Begin a file; a former one of the same name is lost, unless it is to be continued.
   subroutine open_writer(self, path, error, appended)
      class(line_writer_t), intent(inout) :: self
      !> Path of the file
      character(len=*), intent(in) :: path
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error
      !> Whether to write behind what is there; no if absent
      logical, intent(in), optional :: appended
      logical :: goes_on

      self%name = path
      if (allocated(self%failure)) deallocate (self%failure)
      goes_on = exists(path)
      if (goes_on) goes_on = present(appended)
      if (goes_on) goes_on = appended
      if (goes_on) self%descriptor = c_open(path//c_null_char, write_at_the_end)
      if (.not. goes_on) self%descriptor = c_creat(path//c_null_char, read_and_write)
      if (self%descriptor < 0_c_int) call raise(error, io_error, path//': cannot be written: '//last_failure())
   end subroutine open_writer

   !> Write to the screen, behind what the program has written there so far.
   subroutine open_screen(self)
      class(line_writer_t), intent(inout) :: self

      self%name = 'standard output'
      if (allocated(self%failure)) deallocate (self%failure)
      self%descriptor = standard_output
   end subroutine open_screen

   !> Write to standard error.
   subroutine open_errors(self)
      class(line_writer_t), intent(inout) :: self

      self%name = 'standard error'
      if (allocated(self%failure)) deallocate (self%failure)
      self%descriptor = standard_error
   end subroutine open_errors

   !> Write a text as it is; a failure is kept for `close`.
   subroutine put(self, text)
      class(line_writer_t), intent(inout) :: self
      !> The text
      character(len=*), intent(in) :: text
      character(kind=c_char), target :: bytes(len(text))
      integer(c_size_t) :: written
      integer(c_int), pointer :: number
      integer :: k, n, ignored

      if (self%descriptor < 0_c_int .or. allocated(self%failure)) return
      if (self%descriptor == standard_output) flush (output_unit, iostat=ignored)
      do k = 1, len(text)
         bytes(k) = text(k:k)
      end do
      n = 0
      do while (n < len(text))
         written = c_write(self%descriptor, c_loc(bytes(n + 1)), int(len(text) - n, c_size_t))
         if (written <= 0_c_size_t) then
            call c_f_pointer(errno_location(), number)
            if (self%is_screen() .and. number == unread) then
               self%descriptor = -1_c_int
            else
               self%failure = last_failure()
            end if
            return
         end if
         n = n + int(written)
      end do
   end subroutine put

   !> Write a text and end the line.
   subroutine put_line(self, text)
      class(line_writer_t), intent(inout) :: self
      !> The line
      character(len=*), intent(in) :: text

      call self%put(text//c_new_line)
   end subroutine put_line

   !> Tell of a failed write while the file is open.
   subroutine check(self, error)
      class(line_writer_t), intent(in) :: self
      !> Allocated if a text could not be written
      type(error_t), allocatable, intent(inout) :: error

      if (allocated(self%failure)) call raise(error, io_error, self%name//': cannot be written: '//self%failure)
   end subroutine check

   !> End the file; the screen stays open.
   subroutine close_writer(self, error)
      class(line_writer_t), intent(inout) :: self
      !> Allocated if not all of the text was written
      type(error_t), allocatable, intent(inout) :: error

      if (self%descriptor < 0_c_int) return
      if (.not. self%is_screen()) then
         if (c_close(self%descriptor) /= 0_c_int .and. .not. allocated(self%failure)) self%failure = last_failure()
      end if
      self%descriptor = -1_c_int
      call self%check(error)
   end subroutine close_writer

   !> Whether standard output or error is written to
   pure logical function is_screen(self)
      class(line_writer_t), intent(in) :: self

      is_screen = self%descriptor == standard_output .or. self%descriptor == standard_error
   end function is_screen

end module polydem_line_writer
