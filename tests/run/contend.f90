!> Acquires and releases the lock of a folder many times, and checks each time that no other process holds it.
!>
!> usage: contend FOLDER ROUNDS
!>
!> Prints three counts: acquired, taken over from a dead process, held by two processes at once.
program contend
   use polydem_errors, only: error_t, input_error
   use, intrinsic :: iso_c_binding, only: c_int, c_null_ptr, c_size_t
   use polydem_kinds, only: ip
   use polydem_file_system, only: remove_file
   use polydem_posix_processes, only: c_getpid, c_poll
   use polydem_strings, only: to_text
   use polydem_folder_lock, only: folder_lock_t
   implicit none
   character(len=256) :: folder, word
   character(len=:), allocatable :: note
   type(error_t), allocatable :: error
   type(folder_lock_t) :: lock
   integer :: n_rounds, n_taken, n_met, k

   call get_command_argument(1, folder)
   call get_command_argument(2, word)
   read (word, *) n_rounds
   n_taken = 0
   n_met = 0
   do k = 1, n_rounds
      do
         call lock%acquire(trim(folder), note, error)
         if (.not. allocated(error)) exit
         if (error%code /= input_error) print '(a)', error%message
         if (error%code /= input_error) stop 1
         deallocate (error)
         call wait_for(1)
      end do
      if (allocated(note)) n_taken = n_taken + 1
      call be_inside(trim(folder)//'/inside')
      call lock%release()
   end do
   print '(3(i0,1x))', n_rounds, n_taken, n_met

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
            call wait_for(10)
         end do
         if (is_running(process)) n_met = n_met + 1
         open (newunit=unit, file=path, status='replace', action='write', iostat=status)
      end if
      write (unit, '(i0)') int(c_getpid())
      close (unit)
      call remove_file(path, ignored)
      if (allocated(ignored)) n_met = n_met + 1
   end subroutine be_inside

   !> Suspend this process.
   subroutine wait_for(milliseconds)
      integer, intent(in) :: milliseconds
      integer(c_int) :: ignored

      ignored = c_poll(c_null_ptr, 0_c_size_t, int(milliseconds, c_int))
   end subroutine wait_for

   !> Whether a process exists that has not ended, by its line in proc(5)
   logical function is_running(process)
      integer(ip), intent(in) :: process
      character(len=256) :: line
      integer :: k, unit, status

      line = ''
      open (newunit=unit, file='/proc/'//to_text(process)//'/stat', status='old', action='read', iostat=status)
      is_running = status == 0
      if (.not. is_running) return
      read (unit, '(a)', iostat=status) line
      close (unit)
      k = index(line, ')', back=.true.) + 2
      is_running = status == 0 .and. scan(line(k:k), 'ZXx') == 0
   end function is_running

end program contend
