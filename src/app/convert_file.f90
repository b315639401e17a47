!> The verb convert: replaces the former words of a namelist file.
module polydem_convert_file
   use polydem_convert_namelist, only: convert_namelist
   use polydem_errors, only: error_t, input_error, raise
   use polydem_file_system, only: exists, remove_file, rename_file
   use polydem_kinds, only: ip
   use polydem_line_writer, only: line_writer_t
   use polydem_strings, only: text_t, to_text
   use polydem_text_file, only: read_text_file
   implicit none
   private
   public :: convert_file

contains

   !> Convert a namelist file. A file without former words is not changed, but copied to `output` if that is given. No
   !> file is overwritten.
   subroutine convert_file(file, output, report, error)
      !> Path of the namelist file
      character(len=*), intent(in) :: file
      !> Path of the converted file; empty: it replaces the namelist file, which is kept with the suffix .old
      character(len=*), intent(in) :: output
      !> What was changed, one line per word
      character(len=:), allocatable, intent(out) :: report
      !> Allocated if the file cannot be read or written, or if the converted or kept file exists already
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: converted, text
      type(text_t), allocatable :: changes(:)
      integer :: k

      report = ''
      call read_text_file(file, text, error)
      if (.not. allocated(error)) call convert_namelist(file, text, converted, changes, error)
      if (allocated(error)) return
      if (output /= '') then
         call write_new(output, converted, error)
      else if (size(changes) > 0) then
         call replace_file(file, converted, error)
      end if
      if (allocated(error)) return
      if (size(changes) == 0) then
         report = file//': contains no former words; nothing is changed'
         if (output /= '') report = report//' in the copy '//output
         return
      end if
      do k = 1, size(changes)
         report = report//changes(k)%text//new_line('a')
      end do
      if (output == '') then
         report = report//'the old file is '//file//'.old'
      else
         report = report//'the new file is '//output
      end if
      report = to_text(size(changes, kind=ip))//' changed in '//file//':'//new_line('a')//report
   end subroutine convert_file

   !> Replace a file and keep the old one.
   subroutine replace_file(file, text, error)
      character(len=*), intent(in) :: file, text
      type(error_t), allocatable, intent(inout) :: error
      type(error_t), allocatable :: ignored

      if (exists(file//'.old', error)) then
         call raise(error, input_error, file//'.old exists already; remove it, or write to another file with -o OUT')
         return
      end if
      if (.not. allocated(error)) call write_new(file//'.new', text, error)
      if (.not. allocated(error)) call rename_file(file, file//'.old', error)
      if (.not. allocated(error)) then
         call rename_file(file//'.new', file, error)
         if (allocated(error)) call rename_file(file//'.old', file, ignored)
      end if
   end subroutine replace_file

   !> Write a file that does not exist yet; remove it after a failure.
   subroutine write_new(file, text, error)
      character(len=*), intent(in) :: file, text
      type(error_t), allocatable, intent(inout) :: error
      type(error_t), allocatable :: ignored
      type(line_writer_t) :: writer

      if (exists(file, error)) then
         call raise(error, input_error, file//' exists already; remove it, or choose another file with -o OUT')
         return
      end if
      if (.not. allocated(error)) call writer%open(file, error)
      if (allocated(error)) return
      call writer%put(text)
      call writer%close(error)
      if (allocated(error)) call remove_file(file, ignored)
   end subroutine write_new

end module polydem_convert_file
