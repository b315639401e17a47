!> Names of the segments of a trajectory, known to those who write them and to those who start from one.
module polydem_segment_path
   use polydem_kinds, only: ip
   use polydem_paths, only: exists
   implicit none
   private
   public :: segment_path, last_segment, open_suffix

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
      integer(ip) :: number

      path = ''
      number = 1_ip
      do while (exists(segment_path(folder, number)))
         path = segment_path(folder, number)
         number = number + 1_ip
      end do
   end function last_segment

end module polydem_segment_path
