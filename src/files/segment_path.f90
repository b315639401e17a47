!> Names of the segments of a trajectory, known to those who write them and to those who start from one.
module polydem_segment_path
   use polydem_kinds, only: ip
   use polydem_paths, only: exists
   implicit none
   private
   public :: segment_path, last_segment, last_number, open_suffix

   !> End of the name of a segment that is being written
   character(len=*), parameter :: open_suffix = '.open'

contains

   !> Path of a closed segment
   pure function segment_path(folder, number) result(path)
      !> Folder of the result
      character(len=*), intent(in) :: folder
      !> Its number, from 1
      integer(ip), intent(in) :: number
      character(len=:), allocatable :: path
      character(len=16) :: digits

      write (digits, '(i0.4)') number
      path = folder//'/trajectory_'//trim(digits)//'.h5'
   end function segment_path

   !> Path of the last closed segment of a result; empty if there is none
   function last_segment(folder) result(path)
      !> Folder of the result
      character(len=*), intent(in) :: folder
      character(len=:), allocatable :: path

      path = ''
      if (last_number(folder) > 0_ip) path = segment_path(folder, last_number(folder))
   end function last_segment

   !> Number of the last closed segment of a result; 0 if there is none
   integer(ip) function last_number(folder)
      !> Folder of the result
      character(len=*), intent(in) :: folder

      last_number = 0_ip
      do while (exists(segment_path(folder, last_number + 1_ip)))
         last_number = last_number + 1_ip
      end do
   end function last_number

end module polydem_segment_path
