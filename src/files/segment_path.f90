!> Names of the segments of a trajectory, known to those who write them and to those who start from one.
module polydem_segment_path
   use polydem_kinds, only: ip
   use polydem_paths, only: exists
   implicit none
   private
   public :: segment_path, segment_number, last_segment, open_suffix

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

   !> Number of a segment; 0 if the name is not that of a closed one
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
