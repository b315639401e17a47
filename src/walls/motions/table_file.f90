!> Reads the table of a motion from a CSV file: a header that names columns, then one row per time.
module polydem_table_file
   use polydem_elementary, only: pi
   use polydem_errors, only: error_t, input_error, raise, raise_unread
   use polydem_file_status, only: is_stream
   use polydem_file_system, only: exists, is_folder
   use polydem_kinds, only: ip, wp
   use polydem_motion_table, only: greatest_rates, motion_table_t, prepare_table
   use polydem_namelist_values, only: is_readable
   use polydem_settings, only: motion_settings_t, settings_t
   use polydem_source_locations, only: place_of
   use polydem_strings, only: index_of, lower_case, printable, quoted, to_text
   implicit none
   private
   public :: read_motion_table, table_path

   !> Columns of a table; a file without one of the last three has zeros there
   character(len=*), parameter :: columns(4) = [character(len=5) :: 'time', 'x', 'y', 'angle']
   !> Longest line
   integer, parameter :: longest_line = 1000
   !> Upper limit of the speeds, as of those in the table of entries [m/s]
   real(wp), parameter :: speed_limit = 1.0e6_wp
   !> Byte order mark of UTF-8
   character(len=*), parameter :: byte_order_mark = char(239)//char(187)//char(191)
   !> Upper limit of the values
   real(wp), parameter :: value_limit = 1.0e12_wp

contains

   !> Path of the table of a motion: an absolute one, or relative to the folder of the namelist; empty if there is none
   pure function table_path(settings, motion) result(path)
      type(settings_t), intent(in) :: settings
      !> A motion of any kind
      type(motion_settings_t), intent(in) :: motion
      character(len=:), allocatable :: path
      integer :: last

      path = trim(motion%file)
      last = index(settings%file, '/', back=.true.)
      if (path == '' .or. index(path, '/') == 1) return
      path = settings%file(:last)//path
   end function table_path

   !> Read the table of a motion and compute its slopes.
   subroutine read_motion_table(settings, motion, table, error)
      type(settings_t), intent(in) :: settings
      !> A motion of the kind table
      type(motion_settings_t), intent(in) :: motion
      !> The table
      type(motion_table_t), intent(out) :: table
      !> Names the entry, the file and the line
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: path, problem
      real(wp) :: rates(3)
      integer :: row

      path = table_path(settings, motion)
      if (is_folder(path, error)) then
         problem = path//': is a folder, not a CSV file'
      else if (is_stream(path)) then
         problem = path//': is a pipe or a device, not a CSV file; write the rows to a file'
      else if (.not. exists(path, error)) then
         problem = path//': no such file; the path is relative to the folder of the namelist'
      else if (.not. allocated(error)) then
         call read_rows(path, table, problem, error)
      end if
      if (allocated(error)) return
      if (.not. allocated(problem)) then
         do row = 2, size(table%time)
            if (table%time(row) > table%time(row - 1)) cycle
            problem = path//': times must ascend, but '//to_text(table%time(row), 3)//' s follows '// &
               to_text(table%time(row - 1), 3)//' s; sort the rows and leave out repeated times'
            exit
         end do
      end if
      if (.not. allocated(problem)) then
         call prepare_table(table)
         rates = greatest_rates(table)
         if (max(rates(1), rates(2)) >= speed_limit) problem = path//': gives a speed of 1e6 m/s or more; check '// &
            'the units, times are in s and displacements in m'
      end if
      if (allocated(problem)) call raise(error, input_error, place_of(settings, 'motion.'//motion%name, 'file')// &
         ': ''file'' in &motion '//motion%name//': '//problem)
   end subroutine read_motion_table

   !> Read all rows.
   subroutine read_rows(path, table, problem, error)
      character(len=*), intent(in) :: path
      !> The table, without slopes
      type(motion_table_t), intent(inout) :: table
      !> What is wrong with the contents, with the path and the line
      character(len=:), allocatable, intent(inout) :: problem
      !> The file cannot be read
      type(error_t), allocatable, intent(inout) :: error
      character(len=longest_line + 1) :: line
      character(len=256) :: reason
      real(wp), allocatable :: rows(:, :), more(:, :)
      real(wp) :: row(4)
      integer, allocatable :: place(:)
      integer :: unit, status, number, n

      open (newunit=unit, file=path, action='read', status='old', iostat=status, iomsg=reason)
      if (status /= 0) then
         call raise_unread(error, path, trim(reason))
         return
      end if
      allocate (rows(4, 64))
      n = 0
      number = 0
      do
         read (unit, '(a)', iostat=status, iomsg=reason) line
         if (status /= 0) exit
         number = number + 1
         ! Spreadsheets write this mark before a table in UTF-8.
         if (number == 1 .and. index(line, byte_order_mark) == 1) line = line(len(byte_order_mark) + 1:)
         call replace_blanks(line)
         if (line == '' .or. line(1:1) == '#') cycle
         if (len_trim(line) > longest_line) then
            problem = 'is too long for a row of a table'
         else if (.not. allocated(place)) then
            call read_header(trim(line), place, problem)
         else
            call read_row(trim(line), place, row, problem)
            if (n == size(rows, 2)) then
               allocate (more(4, 2*n))
               more(:, :n) = rows
               call move_alloc(more, rows)
            end if
            n = n + 1
            rows(:, n) = row
         end if
         if (allocated(problem)) exit
      end do
      close (unit)
      if (allocated(problem)) then
         problem = path//':'//to_text(int(number, ip))//': '//problem
      else if (.not. is_iostat_end(status)) then
         call raise_unread(error, path, trim(reason))
      else if (n < 2) then
         problem = path//': has fewer than two rows below its header time,x,y,angle'
      end if
      table%time = rows(1, :n)
      table%value = rows(2:, :n)
      table%value(3, :) = table%value(3, :)*(pi/180.0_wp)
   end subroutine read_rows

   !> Replace tabs and carriage returns by blanks, and move the text to the left.
   pure subroutine replace_blanks(line)
      character(len=*), intent(inout) :: line
      integer :: k

      do k = 1, len(line)
         if (line(k:k) == achar(9) .or. line(k:k) == achar(13)) line(k:k) = ' '
      end do
      line = adjustl(line)
   end subroutine replace_blanks

   !> Find which column each field of the rows belongs to.
   pure subroutine read_header(line, place, problem)
      character(len=*), intent(in) :: line
      !> Index in `columns` of each field
      integer, allocatable, intent(out) :: place(:)
      character(len=:), allocatable, intent(inout) :: problem
      character(len=:), allocatable :: word
      integer :: first, k

      allocate (place(0))
      first = 1
      do while (first <= len(line) + 1)
         call next_field(line, first, word)
         k = index_of(lower_case(word), columns)
         if (k == 0) then
            problem = 'unknown column '//quoted(printable(word))//' in the header; the columns are time,x,y,angle'
         else if (any(place == k)) then
            problem = 'column '//word//' is there twice'
         end if
         if (allocated(problem)) return
         place = [place, k]
      end do
      if (all(place /= 1)) problem = 'column time is missing in the header; the columns are time,x,y,angle'
   end subroutine read_header

   !> Read one row.
   subroutine read_row(line, place, row, problem)
      character(len=*), intent(in) :: line
      integer, intent(in) :: place(:)
      !> Values of `columns`
      real(wp), intent(out) :: row(4)
      character(len=:), allocatable, intent(inout) :: problem
      character(len=:), allocatable :: word
      integer :: first, field
      logical :: is_good

      row = 0.0_wp
      first = 1
      do field = 1, size(place)
         if (first > len(line) + 1) then
            problem = 'has fewer values than the header has columns'
            return
         end if
         call next_field(line, first, word)
         is_good = is_readable(lower_case(word))
         if (is_good) read (word, *) row(place(field))
         if (.not. is_good .or. abs(row(place(field))) > value_limit) then
            problem = quoted(printable(word))//' is not a number of at most 1e12'
            return
         end if
      end do
      if (first <= len(line) + 1) problem = 'has more values than the header has columns'
   end subroutine read_row

   !> The field that begins at a place, without blanks around it.
   pure subroutine next_field(line, first, word)
      character(len=*), intent(in) :: line
      !> Place of its first character; on return of that of the next field
      integer, intent(inout) :: first
      character(len=:), allocatable, intent(out) :: word
      integer :: length

      length = scan(line(first:), ',;') - 1
      if (length < 0) length = len(line) + 1 - first
      word = trim(adjustl(line(first:first + length - 1)))
      first = first + length + 1
   end subroutine next_field

end module polydem_table_file
