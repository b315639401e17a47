!> Acquires and releases the lock of a folder many times, and checks each time that no other process holds it.
!>
!> usage: contend FOLDER ROUNDS
!>
!> Prints four counts: acquired, taken over from a dead process, refused, held by two processes at once.
program contend
   use polydem_errors, only: error_t
   use polydem_kinds, only: dp, ip
   use polydem_file_system, only: remove_file
   use polydem_processes, only: is_running, own_process, wait_for
   use polydem_folder_lock, only: lock_times_t, folder_lock_t
   implicit none
   character(len=256) :: folder, word
   character(len=:), allocatable :: note
   type(error_t), allocatable :: error
   type(folder_lock_t) :: lock
   type(lock_times_t) :: times
   integer :: n_rounds, n_taken, n_refused, n_met, k

   call get_command_argument(1, folder)
   call get_command_argument(2, word)
   read (word, *) n_rounds
   times%patience = 20.0_dp
   n_taken = 0
   n_refused = 0
   n_met = 0
   do k = 1, n_rounds
      if (allocated(error)) deallocate (error)
      call lock%acquire(trim(folder), note, error, times=times)
      if (allocated(error)) then
         n_refused = n_refused + 1
         print '(a)', error%message
         cycle
      end if
      if (allocated(note)) n_taken = n_taken + 1
      call be_inside(trim(folder)//'/inside')
      call lock%release()
   end do
   print '(4(i0,1x))', n_rounds - n_refused, n_taken, n_refused, n_met

contains

   !> Create a file that must not exist, and remove it. A file that a killed process left may exist.
   subroutine be_inside(path)
      character(len=*), intent(in) :: path
      type(error_t), allocatable :: ignored
      integer(ip) :: process
      integer :: attempt, unit, status

      open (newunit=unit, file=path, status='new', action='write', iostat=status)
      if (status /= 0) then
         process = 0_ip
         do attempt = 1, 10
            open (newunit=unit, file=path, status='old', action='read', iostat=status)
            if (status == 0) read (unit, *, iostat=status) process
            close (unit, iostat=status)
            if (process > 0_ip) exit
            call wait_for(0.01_dp)
         end do
         if (is_running(process)) n_met = n_met + 1
         open (newunit=unit, file=path, status='replace', action='write', iostat=status)
      end if
      write (unit, '(i0)') own_process()
      close (unit)
      call remove_file(path, ignored)
      if (allocated(ignored)) n_met = n_met + 1
   end subroutine be_inside

end program contend
