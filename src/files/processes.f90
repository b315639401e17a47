!> Processes of this machine (POSIX): the number of this one, and whether another one lives.
module polydem_processes
   use, intrinsic :: iso_c_binding, only: c_f_pointer, c_int, c_ptr
   use polydem_kinds, only: ip
   use polydem_strings, only: to_text
   implicit none
   private
   public :: own_process, lives

   !> ESRCH of errno on Linux: no such process
   integer(c_int), parameter :: no_such_process = 3_c_int
   !> The signal of kill(2) that is not sent but only tried
   integer(c_int), parameter :: no_signal = 0_c_int

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

   !> Whether a process has ended but nobody has asked how (a zombie), which may stay so for ever in a container whose
   !> first process asks for none. Its number tells nothing of that, proc(5) does where it is there.
   logical function has_ended(process)
      integer(ip), intent(in) :: process
      character(len=512) :: line
      integer :: unit, status, k

      has_ended = .false.
      open (newunit=unit, file='/proc/'//to_text(process)//'/stat', status='old', action='read', iostat=status)
      if (status /= 0) return
      read (unit, '(a)', iostat=status) line
      close (unit)
      if (status /= 0) return
      ! The state follows the name of the program, which stands in parentheses and may hold some itself.
      k = index(line, ')', back=.true.) + 2
      has_ended = scan(line(k:k), 'ZXx') > 0
   end function has_ended

end module polydem_processes
