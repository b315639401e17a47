!> Processes of this machine (POSIX): identifier of this process, state of another process, and waiting.
module polydem_processes
   use, intrinsic :: iso_c_binding, only: c_int, c_null_ptr, c_size_t
   use polydem_kinds, only: dp, ip
   use polydem_posix, only: error_number
   use polydem_posix_processes, only: c_getpid, c_kill, c_poll
   use polydem_strings, only: to_text
   implicit none
   private
   public :: own_process, is_running, runs_same_program, wait_for

   !> ESRCH of errno on Linux: no such process
   integer(c_int), parameter :: no_such_process = 3_c_int
   !> Signal 0 of kill(2): it only tests whether a signal could be sent
   integer(c_int), parameter :: no_signal = 0_c_int
   !> Length that holds the start of a line of proc(5)
   integer, parameter :: line_length = 512

contains

   !> Process identifier (PID) of this process
   integer(ip) function own_process()
      own_process = int(c_getpid(), ip)
   end function own_process

   !> Whether a process runs, including a process that this one may not send signals to
   logical function is_running(process)
      !> Process identifier; the result is false below 1
      integer(ip), intent(in) :: process

      is_running = .false.
      if (process < 1_ip) return
      is_running = c_kill(int(process, c_int), no_signal) == 0_c_int
      if (.not. is_running) is_running = error_number() /= no_such_process
      if (is_running) is_running = .not. has_ended(process)
   end function is_running

   !> Whether a process runs the same program as this one, by the name in proc(5); true if proc(5) is not available
   logical function runs_same_program(process)
      !> Process identifier
      integer(ip), intent(in) :: process
      character(len=line_length) :: its, own

      its = status_of(process)
      own = status_of(own_process())
      runs_same_program = .true.
      if (its == '' .or. own == '') return
      runs_same_program = its(index(its, '('):index(its, ')', back=.true.)) == &
                        own(index(own, '('):index(own, ')', back=.true.))
   end function runs_same_program

   !> Suspend this thread for some time.
   subroutine wait_for(seconds)
      !> Duration [s]
      real(dp), intent(in) :: seconds
      integer(c_int) :: ignored

      ignored = c_poll(c_null_ptr, 0_c_size_t, nint(1.0e3_dp*seconds, c_int))
   end subroutine wait_for

   !> Whether a process is a zombie: it has ended, but its parent has not collected its exit status. In a container in
   !> which the first process does not collect zombies, this lasts for ever. kill(2) cannot detect it; proc(5) can.
   logical function has_ended(process)
      integer(ip), intent(in) :: process
      character(len=line_length) :: line
      integer :: k

      line = status_of(process)
      ! The state follows the program name. The name is in parentheses and may itself contain parentheses.
      k = index(line, ')', back=.true.) + 2
      has_ended = line /= '' .and. scan(line(k:k), 'ZXx') > 0
   end function has_ended

   !> Identifier, name and state of a process in the format of proc(5); empty if unknown
   function status_of(process) result(line)
      integer(ip), intent(in) :: process
      character(len=line_length) :: line
      integer :: unit, status

      line = ''
      open (newunit=unit, file='/proc/'//to_text(process)//'/stat', status='old', action='read', iostat=status)
      if (status /= 0) return
      read (unit, '(a)', iostat=status) line
      if (status /= 0) line = ''
      close (unit)
   end function status_of

end module polydem_processes
