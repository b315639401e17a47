!> Processors that this process may use, and tasks that occupy processors (Linux).
module polydem_processors
   use, intrinsic :: iso_c_binding, only: c_int, c_null_ptr, c_size_t
   use omp_lib, only: omp_get_num_procs
   use polydem_host, only: first_line
   use polydem_kinds, only: dp, ip, lp
   use polydem_posix_processes, only: c_poll
   use polydem_process_limits, only: allowed_processors
   implicit none
   private
   public :: granted_processors, processor_quota, running_tasks, tasks_in

   !> Longest line that is read from /proc
   integer, parameter :: line_length = 4096
   !> Number of readings of the tasks, which is odd, and the time between two of them [ms]
   integer, parameter :: n_readings = 5
   integer(c_int), parameter :: pause = 5_c_int

contains

   !> Number of processors that the process may use: by affinity, and by the quota of its control groups. At least 1.
   integer(ip) function granted_processors(mask)
      !> Processors that the process and others with which it shares them may use, one bit each; default: its own
      integer(lp), intent(in), optional :: mask(:)
      integer :: affine

      affine = sum(popcnt(allowed_processors()))
      if (present(mask)) affine = sum(popcnt(mask))
      ! A bound thread may use only one processor, but its process may use more.
      affine = max(1, affine, omp_get_num_procs())
      granted_processors = int(max(1.0_dp, min(real(affine, dp), aint(processor_quota('')))), ip)
   end function granted_processors

   !> Processor time per elapsed time that the control groups of the process allow, of version 1 or 2: the least quota
   !> of the groups that contain it; a huge number if there is none.
   real(dp) function processor_quota(root)
      !> Folder that contains proc and sys; empty except in tests
      character(len=*), intent(in) :: root
      character(len=line_length) :: line
      integer :: first, second, status, unit

      processor_quota = huge(1.0_dp)
      open (newunit=unit, file=root//'/proc/self/cgroup', status='old', action='read', iostat=status)
      if (status /= 0) return
      do
         ! Number, controllers and path of the group, separated by colons; version 2 names no controllers
         read (unit, '(a)', iostat=status) line
         if (status /= 0) exit
         first = index(line, ':')
         second = first + index(line(first + 1:), ':')
         if (line(first:second) == '::') then
            call reduce(root//'/sys/fs/cgroup', trim(line(second + 1:)), .true., processor_quota)
         else if (index(','//line(first + 1:second - 1)//',', ',cpu,') > 0) then
            call reduce(root//'/sys/fs/cgroup/cpu', trim(line(second + 1:)), .false., processor_quota)
         end if
      end do
      close (unit)
   end function processor_quota

   !> Reduce a quota to the least one of a control group and of those that contain it.
   subroutine reduce(root, path, is_second, quota)
      !> Folder of all groups, and path of the group in it, from '/'
      character(len=*), intent(in) :: root, path
      !> Whether these are groups of version 2
      logical, intent(in) :: is_second
      real(dp), intent(inout) :: quota
      character(len=:), allocatable :: folder
      character(len=130) :: text
      real(dp) :: used, period
      integer :: length, status

      length = len(path)
      do while (length >= 0)
         folder = root//path(:length)
         if (is_second) then
            text = first_line(folder//'/cpu.max')
         else
            text = first_line(folder//'/cpu.cfs_quota_us')//' '//first_line(folder//'/cpu.cfs_period_us')
         end if
         ! Without a quota there is no file, the word max, or -1.
         read (text, *, iostat=status) used, period
         if (status == 0) then
            if (used > 0.0_dp .and. period > 0.0_dp) quota = min(quota, used/period)
         end if
         if (length == 0) exit
         length = max(0, index(path(:length), '/', back=.true.) - 1)
      end do
   end subroutine reduce

   !> Number of tasks that run or wait for a processor at this moment on the machine, this one included; 0 if unknown.
   !>
   !> The median of some readings overlooks tasks that soon end. The load averages of the system would still count runs
   !> that ended minutes ago.
   integer(ip) function running_tasks()
      integer(ip) :: readings(n_readings)
      integer(c_int) :: ignored
      integer :: k

      do k = 1, n_readings
         if (k > 1) ignored = c_poll(c_null_ptr, 0_c_size_t, pause)
         readings(k) = tasks_in(first_line('/proc/loadavg'))
      end do
      do k = 1, n_readings
         running_tasks = readings(k)
         if (2*max(count(readings < running_tasks), count(readings > running_tasks)) < n_readings) exit
      end do
   end function running_tasks

   !> Number of running tasks in a line of /proc/loadavg, like '0.20 0.18 0.12 3/80 11206'; 0 if there is none
   pure integer(ip) function tasks_in(line)
      !> The line
      character(len=*), intent(in) :: line
      character(len=len(line)) :: words(4)
      integer :: slash, status

      tasks_in = 0_ip
      slash = index(line, '/')
      if (slash == 0) return
      read (line(:slash - 1), *, iostat=status) words
      if (status == 0) read (words(4), *, iostat=status) tasks_in
      if (status /= 0) tasks_in = 0_ip
   end function tasks_in

end module polydem_processors
