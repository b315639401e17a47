!> Processes of this machine (POSIX): the number of this one, whether another one lives, and waiting.
module polydem_processes
   use, intrinsic :: iso_c_binding, only: c_f_pointer, c_int, c_null_ptr, c_ptr, c_size_t
   use polydem_kinds, only: dp, ip
   use polydem_strings, only: to_text
   implicit none
   private
   public :: own_process, lives, has_own_program, wait_for

   !> ESRCH of errno on Linux: no such process
   integer(c_int), parameter :: no_such_process = 3_c_int
   !> The signal of kill(2) that is not sent but only tried
   integer(c_int), parameter :: no_signal = 0_c_int
   !> Enough for the beginning of a line of proc(5)
   integer, parameter :: line_length = 512

   interface
      !> POSIX getpid(2)
      integer(c_int) function c_getpid() bind(C, name='getpid')
         import :: c_int
      end function c_getpid

      !> POSIX kill(2)
      integer(c_int) function c_kill(process, signal) bind(C, name='kill')
         import :: c_int
         integer(c_int), value :: process, signal
      end function c_kill

      !> POSIX poll(2), here of no files; nfds_t is as wide as size_t on Linux
      integer(c_int) function c_poll(files, n, milliseconds) bind(C, name='poll')
         import :: c_int, c_ptr, c_size_t
         type(c_ptr), value :: files
         integer(c_size_t), value :: n
         integer(c_int), value :: milliseconds
      end function c_poll

      !> Where errno stands (Linux)
      type(c_ptr) function errno_location() bind(C, name='__errno_location')
         import :: c_ptr
      end function errno_location
   end interface

contains

   !> Number of this process
   integer(ip) function own_process()
      own_process = int(c_getpid(), ip)
   end function own_process

   !> Whether a process of this number runs; also one that may not be sent signals lives.
   logical function lives(process)
      !> Its number; those below 1 are no processes
      integer(ip), intent(in) :: process
      integer(c_int), pointer :: number

      lives = .false.
      if (process < 1_ip) return
      lives = c_kill(int(process, c_int), no_signal) == 0_c_int
      call c_f_pointer(errno_location(), number)
      if (.not. lives) lives = number /= no_such_process
      if (lives) lives = .not. has_ended(process)
   end function lives

   !> Whether a process runs the program that this one runs, by the name that proc(5) has; yes where it has none.
   logical function has_own_program(process)
      !> Its number
      integer(ip), intent(in) :: process
      character(len=line_length) :: its, own

      its = status_of(process)
      own = status_of(own_process())
      has_own_program = .true.
      if (its == '' .or. own == '') return
      has_own_program = its(index(its, '('):index(its, ')', back=.true.)) == &
                        own(index(own, '('):index(own, ')', back=.true.))
   end function has_own_program

   !> Do nothing for a while.
   subroutine wait_for(seconds)
      !> How long [s]
      real(dp), intent(in) :: seconds
      integer(c_int) :: ignored

      ignored = c_poll(c_null_ptr, 0_c_size_t, nint(1.0e3_dp*seconds, c_int))
   end subroutine wait_for

   !> Whether a process has ended but nobody has asked how (a zombie), which may stay so for ever in a container whose
   !> first process asks for none. Its number tells nothing of that, proc(5) does where it is there.
   logical function has_ended(process)
      integer(ip), intent(in) :: process
      character(len=line_length) :: line
      integer :: k

      line = status_of(process)
      ! The state follows the name of the program, which stands in parentheses and may hold some itself.
      k = index(line, ')', back=.true.) + 2
      has_ended = line /= '' .and. scan(line(k:k), 'ZXx') > 0
   end function has_ended

   !> Number, name and state of a process in the form of proc(5); empty if unknown
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
