!> Names of the files of a result, which is a folder.
!>
!>     trajectory_0001.h5, ...    closed segments of the trajectory, in order
!>     trajectory_0007.h5.open    the segment being written
!>     profile.h5                 times, counters, provenance; its presence says that the run ended
!>     trace.h5                   recorded boxes, if asked for
!>     steps.h5                   times and counts of every step, if asked for
!>     overlaps.csv               contacts that were deep at the start, if there were any
!>     log.txt                    what the run printed
!>     checkpoint_1.h5, _2.h5     the last two checkpoints, in turns
!>     manifest.txt               which of these files there are, with checksums (polydem_manifest)
!>     running.lock               who writes there (polydem_run_lock)
!>     replaced                   the result that `--force` replaces, until the new one has a frame (polydem_replaced)
module polydem_result_folder
   use polydem_kinds, only: ip
   use polydem_segment_path, only: open_suffix, segment_number, segment_path
   use polydem_strings, only: to_text
   implicit none
   private
   public :: segment_path, profile_path, log_path, trace_path, steps_path, overlaps_path, checkpoint_path
   public :: default_folder, n_checkpoints, open_suffix, unfinished, name_in, segment_number

   !> End of the name of any other file that is not complete
   character(len=*), parameter :: unfinished = '.unfinished'
   !> Checkpoints that are kept
   integer(ip), parameter :: n_checkpoints = 2_ip

contains

   !> results/<name of the input without path and suffix>
   pure function default_folder(input_file) result(folder)
      !> Path of the namelist file
      character(len=*), intent(in) :: input_file
      character(len=:), allocatable :: folder
      integer :: first, last

      first = index(input_file, '/', back=.true.) + 1
      last = index(input_file, '.', back=.true.) - 1
      if (last < first) last = len(input_file)
      folder = 'results/'//input_file(first:last)
   end function default_folder

   !> Path of the profile
   pure function profile_path(folder) result(path)
      !> Folder of the result
      character(len=*), intent(in) :: folder
      character(len=:), allocatable :: path

      path = folder//'/profile.h5'
   end function profile_path

   !> Path of the log
   pure function log_path(folder) result(path)
      !> Folder of the result
      character(len=*), intent(in) :: folder
      character(len=:), allocatable :: path

      path = folder//'/log.txt'
   end function log_path

   !> Path of the recorded boxes
   pure function trace_path(folder) result(path)
      !> Folder of the result
      character(len=*), intent(in) :: folder
      character(len=:), allocatable :: path

      path = folder//'/trace.h5'
   end function trace_path

   !> Path of the times and counts of every step
   pure function steps_path(folder) result(path)
      !> Folder of the result
      character(len=*), intent(in) :: folder
      character(len=:), allocatable :: path

      path = folder//'/steps.h5'
   end function steps_path

   !> Path of the table of deep contacts at the start
   pure function overlaps_path(folder) result(path)
      !> Folder of the result
      character(len=*), intent(in) :: folder
      character(len=:), allocatable :: path

      path = folder//'/overlaps.csv'
   end function overlaps_path

   !> Path of a checkpoint
   pure function checkpoint_path(folder, number) result(path)
      !> Folder of the result
      character(len=*), intent(in) :: folder
      !> 1 to n_checkpoints
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

end module polydem_result_folder
