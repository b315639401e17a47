!> Acquires and releases the lock of a folder many times, and looks each time whether somebody else is inside.
!>
!> usage: contend FOLDER ROUNDS
!>
!> Prints how often it was inside, took over a lock, was refused, and met another one inside.
program contend
   use polydem_errors, only: error_t
   use polydem_kinds, only: dp, ip
   use polydem_paths, only: remove_file
   use polydem_processes, only: lives, own_process, wait_for
   use polydem_run_lock, only: lock_times_t, run_lock_t
   implicit none
   character(len=256) :: folder, word
   character(len=:), allocatable :: note
   type(error_t), allocatable :: error
   type(run_lock_t) :: lock
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

   !> Make a file that must not be there, and remove it. One whose process was killed inside may be there.
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
         if (lives(process)) n_met = n_met + 1
         open (newunit=unit, file=path, status='replace', action='write', iostat=status)
      end if
      write (unit, '(i0)') own_process()
      close (unit)
      call remove_file(path, ignored)
      if (allocated(ignored)) n_met = n_met + 1
   end subroutine be_inside

end program contend
