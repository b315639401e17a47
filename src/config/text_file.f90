!> Reads a text file into one string.
module polydem_text_file
   use polydem_errors, only: error_t, input_error, raise, raise_unread
   use polydem_file_system, only: exists, is_folder, last_failure
   implicit none
   private
   public :: read_text_file

   !> Upper limit of the size of a namelist file [B]
   integer, parameter :: greatest_size = 1048576

contains

   !> Read all bytes of a file.
   subroutine read_text_file(file, text, error)
      !> Path of the file
      character(len=*), intent(in) :: file
      !> Bytes of the file
      character(len=:), allocatable, intent(out) :: text
      !> input_error: the file is missing, empty, a folder, a device or too long; io_error: it cannot be read
      type(error_t), allocatable, intent(inout) :: error
      character(len=256) :: reason
      integer :: bytes, status, unit

      if (is_folder(trim(file), error) .or. len_trim(file) == 0) &
         call raise(error, input_error, trim(file)//': is a folder, not a namelist file')
      if (.not. exists(trim(file), error)) call raise(error, input_error, trim(file)//': no such file')
      if (allocated(error)) return
      inquire (file=trim(file), size=bytes)
      if (bytes < 0) then
         call raise_unread(error, trim(file), last_failure())
      else if (bytes > greatest_size) then
         call raise(error, input_error, &
            trim(file)//': is not a namelist file (longer than 1 MiB, or not a regular file)')
      else if (bytes == 0) then
         ! Opening a pipe would wait until another process writes to it.
         call raise(error, input_error, trim(file)//': is empty, or is not a regular file (a pipe or a device); '// &
            'a namelist file is expected')
      end if
      if (allocated(error)) return

      open (newunit=unit, file=trim(file), access='stream', form='unformatted', action='read', status='old', &
         iostat=status, iomsg=reason)
      if (status == 0) then
         allocate (character(len=bytes) :: text)
         read (unit, iostat=status, iomsg=reason) text
         close (unit)
      end if
      if (status /= 0) call raise_unread(error, trim(file), reason)
   end subroutine read_text_file

end module polydem_text_file
