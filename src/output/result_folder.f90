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
module polydem_result_folder
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip
   use polydem_paths, only: exists, remove_file
   use polydem_segment_path, only: last_number, open_suffix, segment_path
   use polydem_strings, only: to_text
   implicit none
   private
   public :: segment_path, profile_path, log_path, trace_path, steps_path, overlaps_path, checkpoint_path
   public :: default_folder, holds_result, clear_result, clear_unfinished, open_suffix, unfinished, last_number
   public :: n_checkpoints

   !> End of the name of any other file that is not complete
   character(len=*), parameter :: unfinished = '.unfinished'
   !> Segments are looked for until so many numbers in a row are missing
   integer(ip), parameter :: greatest_gap = 100_ip
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

   !> Whether a folder holds a result that a run would overwrite
   logical function holds_result(folder)
      !> Folder of the result
      character(len=*), intent(in) :: folder
      integer(ip) :: number

      holds_result = exists(profile_path(folder))
      if (.not. holds_result) holds_result = exists(log_path(folder))
      do number = 1_ip, greatest_gap
         if (.not. holds_result) holds_result = has_segment(folder, number)
      end do
      do number = 1_ip, n_checkpoints
         if (.not. holds_result) holds_result = exists(checkpoint_path(folder, number))
      end do
   end function holds_result

   !> Remove a former result, so that its segments do not mix with new ones; other files stay.
   subroutine clear_result(folder, error)
      !> Folder of the result
      character(len=*), intent(in) :: folder
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: number, last

      ! The checkpoints first: without one, nobody goes on with what a kill in the middle of this would leave.
      do number = 1_ip, n_checkpoints
         call remove_if_there(checkpoint_path(folder, number), error)
      end do
      call remove_if_there(log_path(folder), error)
      call remove_if_there(overlaps_path(folder), error)
      call remove_if_there(trace_path(folder), error)
      call remove_if_there(steps_path(folder), error)
      call clear_unfinished(folder, error)
      last = 0_ip
      number = 1_ip
      do while (number <= last + greatest_gap)
         if (has_segment(folder, number)) last = number
         call remove_if_there(segment_path(folder, number), error)
         call remove_if_there(segment_path(folder, number)//open_suffix, error)
         number = number + 1_ip
      end do
   end subroutine clear_result

   !> Remove what a run that did not end left unfinished: files that were not complete, and the open segment. What is
   !> complete stays, but for the profile, which says that a run has ended.
   subroutine clear_unfinished(folder, error)
      !> Folder of the result
      character(len=*), intent(in) :: folder
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: number

      call remove_if_there(profile_path(folder), error)
      call remove_if_there(profile_path(folder)//unfinished, error)
      call remove_if_there(trace_path(folder)//unfinished, error)
      call remove_if_there(steps_path(folder)//unfinished, error)
      do number = 1_ip, n_checkpoints
         call remove_if_there(checkpoint_path(folder, number)//unfinished, error)
      end do
      call remove_if_there(segment_path(folder, last_number(folder) + 1_ip)//open_suffix, error)
   end subroutine clear_unfinished

   logical function has_segment(folder, number)
      character(len=*), intent(in) :: folder
      integer(ip), intent(in) :: number

      has_segment = exists(segment_path(folder, number))
      if (.not. has_segment) has_segment = exists(segment_path(folder, number)//open_suffix)
   end function has_segment

   subroutine remove_if_there(path, error)
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(inout) :: error

      if (exists(path)) call remove_file(path, error)
   end subroutine remove_if_there

end module polydem_result_folder
