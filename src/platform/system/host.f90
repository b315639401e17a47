!> Facts about the machine of a run (Linux): name, processor, memory, load, environment, date, terminal.
module polydem_host
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_null_char, c_null_ptr, c_size_t
   use polydem_kinds, only: dp, ip, lp
   use polydem_posix, only: standard_output
   use polydem_posix_processes, only: c_time, gethostname, gmtime, isatty, strftime, sysconf
   use polydem_strings, only: decimal, to_text
   implicit none
   private
   public :: host_name, processor_name, processor_clock, processor_has, cache_sizes, memory_size, frequency_governor
   public :: kernel_release, boot_identity, cores_online
   public :: load_average, environment, first_line, utc_now, is_terminal, resident_memory

   !> Text for facts that the system does not report
   character(len=*), parameter :: unknown = 'unknown'
   !> File with a line per fact of each processor
   character(len=*), parameter :: processor_facts = '/proc/cpuinfo'
   !> Length that holds a line of a file in /sys
   integer, parameter :: line_length = 64
   !> _SC_NPROCESSORS_ONLN of sysconf(3) on Linux
   integer(c_int), parameter :: online = 84_c_int

contains

   !> Name of the machine in its network
   function host_name() result(name)
      character(len=:), allocatable :: name
      character(len=256, kind=c_char) :: buffer

      buffer = c_null_char
      name = unknown
      if (gethostname(buffer, len(buffer, kind=c_size_t) - 1_c_size_t) /= 0_c_int) return
      name = buffer(:index(buffer, c_null_char) - 1)
   end function host_name

   !> Model of the processor
   function processor_name() result(name)
      character(len=:), allocatable :: name

      name = fact_in(processor_facts, 'model name')
   end function processor_name

   !> Current clock rate of the first processor, like '2.596 GHz'
   function processor_clock() result(text)
      character(len=:), allocatable :: text
      real(dp) :: megahertz
      integer :: status

      text = fact_in(processor_facts, 'cpu MHz')
      read (text, *, iostat=status) megahertz
      if (status /= 0) then
         text = unknown
         return
      end if
      text = decimal(1.0e-3_dp*megahertz, 3)//' GHz'
   end function processor_clock

   !> Whether the first processor has a feature of /proc/cpuinfo, like 'avx2'. Linux lists only what it supports itself:
   !> without XSAVE for the wide registers it removes AVX and all that needs it. Without /proc no feature is known.
   logical function processor_has(feature)
      !> Name of the feature
      character(len=*), intent(in) :: feature

      processor_has = index(' '//fact_in(processor_facts, 'flags')//' ', ' '//feature//' ') > 0
   end function processor_has

   !> First entry of a name in a file of /proc with lines like 'name: entry'
   function fact_in(path, name) result(fact)
      character(len=*), intent(in) :: path, name
      character(len=:), allocatable :: fact
      character(len=8192) :: line
      integer :: unit, status

      fact = unknown
      open (newunit=unit, file=path, status='old', action='read', iostat=status)
      if (status /= 0) return
      do
         read (unit, '(a)', iostat=status) line
         if (status /= 0) exit
         if (index(line, name) /= 1) cycle
         fact = trim(adjustl(line(index(line, ':') + 1:)))
         exit
      end do
      close (unit)
   end function fact_in

   !> Caches of the first processor, like 'L1d 48K, L1i 32K, L2 2048K, L3 107520K', from /sys
   function cache_sizes() result(text)
      character(len=:), allocatable :: text
      character(len=:), allocatable :: folder
      character(len=line_length) :: level, kind, size
      integer :: k

      text = ''
      do k = 0, 9
         folder = '/sys/devices/system/cpu/cpu0/cache/index'//achar(iachar('0') + k)//'/'
         level = first_line(folder//'level')
         if (level == '') exit
         kind = first_line(folder//'type')
         size = first_line(folder//'size')
         if (k > 0) text = text//', '
         text = text//'L'//trim(level)
         if (kind == 'Data') text = text//'d'
         if (kind == 'Instruction') text = text//'i'
         text = text//' '//trim(size)
      end do
      if (text == '') text = unknown
   end function cache_sizes

   !> Size of the main memory, like '32768 MiB', from /proc/meminfo
   function memory_size() result(text)
      character(len=:), allocatable :: text
      integer(lp) :: kibibytes

      kibibytes = kibibytes_in('/proc/meminfo', 'MemTotal')
      text = unknown
      if (kibibytes > 0_lp) text = to_text(kibibytes/1024_lp)//' MiB'
   end function memory_size

   !> Frequency governor of the first processor, like 'performance', from /sys
   function frequency_governor() result(text)
      character(len=:), allocatable :: text

      text = trim(first_line('/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor'))
      if (text == '') text = unknown
   end function frequency_governor

   !> Release of the kernel, from /proc
   function kernel_release() result(text)
      character(len=:), allocatable :: text

      text = trim(first_line('/proc/sys/kernel/osrelease'))
      if (text == '') text = unknown
   end function kernel_release

   !> Identity of the running kernel, which changes at each boot; '-' if unknown. Containers of a machine share it.
   function boot_identity() result(text)
      character(len=:), allocatable :: text

      text = trim(first_line('/proc/sys/kernel/random/boot_id'))
      if (text == '') text = '-'
   end function boot_identity

   !> Number of processors that are online
   integer(ip) function cores_online()
      cores_online = int(sysconf(online), ip)
   end function cores_online

   !> Load average over the last minute: mean number of processes ready to run; 0 if unknown
   real(dp) function load_average()
      character(len=line_length) :: line
      integer :: status

      line = first_line('/proc/loadavg')
      read (line, *, iostat=status) load_average
      if (status /= 0) load_average = 0.0_dp
   end function load_average

   !> Value of an environment variable, or 'unset'
   function environment(name) result(text)
      !> Name of the variable
      character(len=*), intent(in) :: name
      character(len=:), allocatable :: text
      integer :: length, status

      call get_environment_variable(name, length=length, status=status)
      text = 'unset'
      if (status /= 0) return
      text = repeat(' ', length)
      if (length > 0) call get_environment_variable(name, text)
   end function environment

   !> First line of a file; empty if it cannot be read
   function first_line(path) result(text)
      !> Path of the file
      character(len=*), intent(in) :: path
      character(len=line_length) :: text
      integer :: unit, status

      text = ''
      open (newunit=unit, file=path, status='old', action='read', iostat=status)
      if (status /= 0) return
      read (unit, '(a)', iostat=status) text
      text = adjustl(text)
      close (unit)
   end function first_line

   !> Current date and time (UTC), like 2025-03-01T12:00:00Z
   function utc_now() result(text)
      character(len=:), allocatable :: text
      character(len=32, kind=c_char) :: buffer
      integer(c_size_t) :: length

      length = strftime(buffer, len(buffer, kind=c_size_t), '%Y-%m-%dT%H:%M:%SZ'//c_null_char, &
                        gmtime(c_time(c_null_ptr)))
      text = buffer(:length)
   end function utc_now

   !> Whether standard output is a terminal
   logical function is_terminal()
      is_terminal = isatty(standard_output) == 1_c_int
   end function is_terminal

   !> Resident memory of this process (VmRSS of Linux) [KiB]; 0 if unknown
   integer(lp) function resident_memory()
      resident_memory = kibibytes_in('/proc/self/status', 'VmRSS')
   end function resident_memory

   !> Number in an entry of a file of /proc [KiB]; 0 if unknown
   integer(lp) function kibibytes_in(path, name)
      character(len=*), intent(in) :: path, name
      character(len=:), allocatable :: fact
      integer :: status

      fact = fact_in(path, name)
      read (fact, *, iostat=status) kibibytes_in
      if (status /= 0) kibibytes_in = 0_lp
   end function kibibytes_in

end module polydem_host
