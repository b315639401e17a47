!> Names of the files in a result folder.
!>
!>     trajectory_0001.h5, ...    closed segments of the trajectory, in order
!>     trajectory_0007.h5.open    the open segment
!>     profile.h5                 timings, counters, provenance; it exists only after the end of the run
!>     trace.h5                   recorded boxes (optional)
!>     steps.h5                   timings and counts of every step (optional)
!>     overlaps.csv               deep contacts at the start, if any
!>     series.csv                 series of walls and loads (optional)
!>     actions.txt                actions of the program that held the run, or of its file of actions, if any
!>     log.txt                    log of the run
!>     checkpoint_1.h5, _2.h5     the last two checkpoints, written alternately
!>     manifest.txt               list of these files with checksums (polydem_manifest)
!>     running.lock               lock that identifies the writing process (polydem_folder_lock)
module polydem_result_files
   use polydem_errors, only: error_t
   use polydem_file_system, only: exists
   use polydem_kinds, only: ip
   use polydem_strings, only: to_text
   implicit none
   private
   public :: segment_path, checkpoint_path, actions_name, log_name, overlaps_name, profile_name, series_name, steps_name
   public :: trace_name
   public :: default_folder, n_checkpoints, open_suffix, unfinished, name_in, stem, segment_number, last_segment, &
      manifest_name, forms_of, complete_name, conflict_text, is_table

   !> Suffix of the temporary name of an incomplete file other than a segment
   character(len=*), parameter :: unfinished = '.unfinished'
   !> Number of checkpoint files of a run
   integer(ip), parameter :: n_checkpoints = 2_ip

   !> Suffix of the temporary name of the open segment
   character(len=*), parameter :: open_suffix = '.open'

   !> Names of single files of a result
   character(len=*), parameter :: manifest_name = 'manifest.txt', log_name = 'log.txt', profile_name = 'profile.h5', &
      trace_name = 'trace.h5', steps_name = 'steps.h5', overlaps_name = 'overlaps.csv', series_name = 'series.csv', &
      actions_name = 'actions.txt'

contains

   !> Whether a file is a table that a run makes again when it is continued, if the table is missing or damaged
   elemental logical function is_table(name)
      !> Name of the file without its folder
      character(len=*), intent(in) :: name

      is_table = name == series_name .or. name == overlaps_name
   end function is_table

   !> Default result folder: results/<name of the input file without path and suffix>
   pure function default_folder(input_file) result(folder)
      !> Path of the namelist file
      character(len=*), intent(in) :: input_file
      character(len=:), allocatable :: folder

      folder = 'results/'//stem(input_file)
   end function default_folder

   !> Name of a file without path and suffix
   pure function stem(path)
      !> Path of the file
      character(len=*), intent(in) :: path
      character(len=:), allocatable :: stem
      integer :: first, last

      first = index(path, '/', back=.true.) + 1
      last = index(path, '.', back=.true.) - 1
      if (last < first) last = len(path)
      stem = path(first:last)
   end function stem

   !> Path of a checkpoint
   pure function checkpoint_path(folder, number) result(path)
      !> Folder of the result
      character(len=*), intent(in) :: folder
      !> Number of the checkpoint, 1 to n_checkpoints
      integer(ip), intent(in) :: number
      character(len=:), allocatable :: path

      path = folder//'/checkpoint_'//to_text(number)//'.h5'
   end function checkpoint_path

   !> Name of a file without its folder
   pure function name_in(path) result(name)
      !> Path of the file
      character(len=*), intent(in) :: path
      character(len=:), allocatable :: name

      name = path(index(path, '/', back=.true.) + 1:)
   end function name_in

   !> Path of a closed segment
   pure function segment_path(folder, number) result(path)
      !> Folder of the result
      character(len=*), intent(in) :: folder
      !> Number of the segment, from 1
      integer(ip), intent(in) :: number
      character(len=:), allocatable :: path
      character(len=16) :: digits

      write (digits, '(i0.4)') number
      path = folder//'/trajectory_'//trim(digits)//'.h5'
   end function segment_path

   !> Number of a closed segment; 0 for any other file name
   pure integer(ip) function segment_number(name)
      !> Name of a file without its folder
      character(len=*), intent(in) :: name
      character(len=*), parameter :: head = 'trajectory_', tail = '.h5'
      integer :: n, status

      segment_number = 0_ip
      n = len_trim(name) - len(head) - len(tail)
      if (n < 4 .or. n > 9) return
      if (name(:len(head)) /= head .or. name(len(head) + n + 1:) /= tail) return
      if (verify(name(len(head) + 1:len(head) + n), '0123456789') /= 0) return
      read (name(len(head) + 1:len(head) + n), *, iostat=status) segment_number
      if (status /= 0) segment_number = 0_ip
   end function segment_number

   !> Path of the last closed segment of a result; empty if there is none
   function last_segment(folder, error) result(path)
      !> Folder of the result
      character(len=*), intent(in) :: folder
      !> Allocated if the system does not tell
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: path
      integer(ip) :: number

      path = ''
      number = last_number(folder, error)
      if (number > 0_ip) path = segment_path(folder, number)
   end function last_segment

   !> Number of the last closed segment of a result; 0 if there is none
   integer(ip) function last_number(folder, error)
      !> Folder of the result
      character(len=*), intent(in) :: folder
      !> Allocated if the system does not tell
      type(error_t), allocatable, intent(inout) :: error

      last_number = 0_ip
      do while (exists(segment_path(folder, last_number + 1_ip), error))
         last_number = last_number + 1_ip
      end do
   end function last_number

   !> Possible names of a file: the final name and the two temporary names
   pure function forms_of(name) result(forms)
      !> Final name of the file
      character(len=*), intent(in) :: name
      character(len=len(name) + len(unfinished)) :: forms(3)

      forms(1) = name
      forms(2) = name//unfinished
      forms(3) = name//open_suffix
   end function forms_of

   !> Final name of a file
   pure function complete_name(form) result(name)
      !> Final or temporary name, one of `forms_of`
      character(len=*), intent(in) :: form
      character(len=:), allocatable :: name

      name = without_end(without_end(form, unfinished), open_suffix)
   end function complete_name

   !> Text without a suffix
   pure function without_end(text, ending) result(rest)
      character(len=*), intent(in) :: text, ending
      character(len=:), allocatable :: rest
      integer :: n

      rest = text
      n = len(text) - len(ending)
      if (n < 1) return
      if (text(n + 1:) == ending) rest = text(:n)
   end function without_end

   !> Error message for an existing file that has a name of the result but is not listed in its manifest
   pure function conflict_text(path) result(message)
      !> Path of the file
      character(len=*), intent(in) :: path
      character(len=:), allocatable :: message

      message = path//' blocks a file of the result: no '//manifest_name//' lists it, so it is neither changed nor '// &
         'removed. Move the file away, or choose another folder with --set output.folder=NAME'
   end function conflict_text

end module polydem_result_files
